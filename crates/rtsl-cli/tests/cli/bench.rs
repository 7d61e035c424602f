//! `rtsl bench`: kernels and scenes.

use expect_test::expect;

use crate::command::{DONE, Folder, INPUT_AT_FAULT, SPHERE, WRONG_USAGE};
use crate::lsp::{BALL, WAVE};

/// A branch that no usual ray takes, long enough not to be done for all lanes, and one that no ray
/// takes.
const RARE: &str = "class Rare : rt_Texture;
void lookup()
{
    float x = rt_TextureUV.x;
    if (x > 2.0) x = 1.0 / (1.0 + 2.0 / (1.0 + 3.0 / (1.0 + 4.0 / (1.0 + x))));
    if (x - x > 1.0) x = sqrt(-x);
    rt_FloatTextureValue = sqrt(x);
}
";

/// The output of `rtsl bench --json`, one value for each kernel.
fn bench(folder: &Folder, arguments: &[&str]) -> Vec<serde_json::Value> {
    let time: &[&str] = if arguments.contains(&"--time") { &[] } else { &["--time", "1"] };
    let ran = folder.run(&[&["bench", "--json"], arguments, time].concat()).exits(DONE);
    ran.output().lines().map(|line| serde_json::from_str(line).unwrap()).collect()
}

const SLOPE: &str = "class Slope : rt_Texture; public float steep = 1.0;
    void lookup() { rt_TextureColor = color(steep * rt_TextureUV.x / rt_TextureUV.y); }";

#[test]
fn test_tells_which_contracts_are_broken() {
    let folder = Folder::new("test");
    folder.write("slope.rtsl", SLOPE);
    let ran = folder.run(&["test", "slope.rtsl", "--param", "steep=2"]).exits(INPUT_AT_FAULT);
    assert_eq!(ran.errors(), "error: 1 contract is broken\n");
    ran.prints(expect![[r#"
        Slope (texture), steep=2
          BROKEN  values are numbers, whatever the filter
                  lookup gives colour [NaN, NaN, NaN] and value NaN
                  (5705 of 20480 tests)
                  try: rtsl eval slope.rtsl lookup --param 'steep=2' --state rt_TextureUV=0,-0
                  look at: divisions by rt_du and rt_dv, which may be 0, and numbers far from 0
          -       wide filters tend to the mean: the texture does not filter: wide lookups are as narrow ones
          held    results have the same bits at every width
          held    every call comes to its end

    "#]]);
    let ran = folder.run(&["test", "slope.rtsl", "--json"]).exits(INPUT_AT_FAULT);
    let report: serde_json::Value = serde_json::from_str(&ran.output()).unwrap();
    assert_eq!((&report["class"], &report["holds"]), (&"Slope".into(), &false.into()));
    assert_eq!(report["contracts"][0]["outcome"], "broken");

    folder.write("flat.rtsl", SLOPE.replace("/ rt_TextureUV.y", ""));
    folder.run(&["test", "flat.rtsl"]).exits(DONE);
    folder.run(&["test", "flat.rtsl", "--samples", "1"]).exits(WRONG_USAGE);
    folder.run(&["test", "flat.rtsl", "--param", "flat=1"]).fails_with("E0502");
    folder.run(&["test", "none.rtsl"]).fails_with("E0601");
}

#[test]
fn test_checks_the_instances_of_a_scene() {
    let folder = Folder::new("test-scene");
    let root = "class Root : rt_Texture; public float of = 0.25;
        void lookup() { rt_TextureColor = color(sqrt(of)); }";
    folder.write("root.rtsl", root);
    let scene = |of: &str| {
        format!(
            "Camera \"Pinhole\" Film \"rgb\" WorldBegin LightSource \"PointLight\"
            Texture \"root\" \"spectrum\" \"Root\" \"float of\" {of}
            Material \"Lambertian\" \"texture kd\" \"root\" Shape \"Sphere\" Shape \"Sphere\" \"float radius\" 2"
        )
    };
    folder.write("good.pbrt", scene("0.25"));
    folder.write("bad.pbrt", scene("-1"));
    let tested = |arguments: &[&str]| folder.run(&[&["test", "--json"], arguments].concat());
    let lines = |text: String| -> Vec<serde_json::Value> {
        text.lines().map(|line| serde_json::from_str(line).unwrap()).collect()
    };
    let reports = lines(tested(&["good.pbrt"]).exits(DONE).output());
    let names: Vec<_> = reports.iter().map(|it| it["instance"].as_str().unwrap()).collect();
    assert_eq!(names, ["camera", "material 0", "light 0", "shape 0", "shape 1"]);
    let bad = tested(&["bad.pbrt", "--class", "Lambertian"]).exits(INPUT_AT_FAULT);
    let reports = lines(bad.output());
    let [report] = &reports[..] else { panic!("{reports:?}") };
    assert_eq!((&report["class"], &report["holds"]), (&"Lambertian".into(), &false.into()));
    tested(&["good.pbrt", "--param", "of=1"]).exits(WRONG_USAGE);
}

#[test]
fn bench_measures_every_width() {
    let folder = Folder::new("bench");
    folder.write("rare.rtsl", RARE);
    let rows = bench(&folder, &["rare.rtsl"]);
    let kernels: Vec<_> =
        rows.iter().map(|row| format!("{} {}", row["shape"], row["width"])).collect();
    let mut expected: Vec<_> = [1, 4, 8, 16].map(|width| format!("\"packet\" {width}")).into();
    expected.extend([1, 4, 8, 16].map(|width| format!("\"stream\" {width}")));
    expected.extend([1, 4, 8, 16].map(|width| format!("\"leaf\" {width}")));
    expected.push("\"single\" 1".to_owned());
    assert_eq!(kernels, expected);
    for row in &rows {
        assert_eq!((&row["class"], &row["method"]), (&"Rare".into(), &"lookup".into()));
        let number = |name: &str| row[name].as_f64().unwrap_or_else(|| panic!("{name}: {row}"));
        for name in [
            "nanosecondsPerLane",
            "tenthPercentile",
            "ninetiethPercentile",
            "speedup",
            "floatOperationsPerLane",
            "bytesPerLane",
            "shareOfPeakFloatOperations",
            "shareOfPeakBytes",
            "dividerBusy",
            "peakGigaflops",
            "peakGigabytesPerSecond",
        ] {
            assert!(number(name) > 0.0, "{name}: {row}");
        }
        assert!(number("tenthPercentile") <= number("nanosecondsPerLane"), "{row}");
        assert!(number("nanosecondsPerLane") <= number("ninetiethPercentile"), "{row}");
        assert!((0.0..=1.0).contains(&number("activeLanes")), "{row}");
        assert!(number("width") > 1.0 || number("speedup") == 1.0, "{row}");
        let (rays, calls) = match row["shape"].as_str() {
            Some("single") => (1.0, 16.0),
            Some("leaf") => (256.0, 4.0),
            _ => (256.0, 1.0),
        };
        assert_eq!((number("lanes"), number("calls")), (rays, calls), "{row}");
        assert!([1.0, 2.0, 4.0, 8.0, 16.0].contains(&number("vector")), "{row}");
    }
}

/// Chains of `fma`, as many as peaks are measured with, and nothing besides.
fn chains() -> String {
    let repeat = |line: &dyn Fn(usize) -> String| (0..8).map(line).collect::<String>();
    format!(
        "class Chains : rt_Texture; public float scale = 0.5; public float shift = 0.25;
        void lookup() {{ {} for (int i = 0; i < 40; i++) {{ {} }} rt_FloatTextureValue = 0.0{}; }}",
        repeat(&|it| format!("float x{it} = abs({it}.0 * rt_TextureUVW.x);\n")),
        repeat(&|it| format!("x{it} = fma(x{it}, scale, shift);\n")).repeat(4),
        repeat(&|it| format!(" + x{it}"))
    )
}

/// Other work on the machine may slow down either side of a ratio, so a few runs may fail.
fn in_one_of_five_runs(what: &str, run: impl Fn() -> Result<(), String>) {
    let failures: Vec<String> = (0..5).map_while(|_| run().err()).collect();
    assert!(failures.len() < 5, "{what}: {failures:?}");
}

/// Kernels that are what peaks are measured with reach the peak, also where several calls are timed together.
#[test]
fn bench_measures_peaks_that_kernels_reach() {
    let folder = Folder::new("bench-peak");
    folder.write("chains.rtsl", chains());
    let sums = "class Sums : rt_Light; scratch float a; scratch float b; scratch float c;
        void emission() { rt_EmissionColor = color(a, b, c); }";
    folder.write("sums.rtsl", sums);
    for (file, share) in
        [("chains.rtsl", "shareOfPeakFloatOperations"), ("sums.rtsl", "shareOfPeakBytes")]
    {
        let arguments = [file, "--shape", "packet", "--width", "8", "--lanes", "64"];
        in_one_of_five_runs(share, || {
            let row = bench(&folder, &[&arguments[..], &["--time", "20"]].concat()).remove(0);
            assert_eq!((&row["lanes"], &row["calls"]), (&64.into(), &4.into()), "{row}");
            let share = row[share].as_f64().unwrap();
            if (0.45..1.6).contains(&share) { Ok(()) } else { Err(format!("{file}: {share}")) }
        });
    }
}

#[test]
fn bench_finds_rays_for_rare_branches() {
    let folder = Folder::new("bench-rare");
    folder.write("rare.rtsl", RARE);
    let rows = bench(&folder, &["rare.rtsl", "lookup", "--width", "8", "--shape", "packet"]);
    let sides =
        |row: &serde_json::Value| (row["branchSidesReached"].clone(), row["branchSides"].clone());
    assert_eq!(rows.iter().map(sides).collect::<Vec<_>>(), [(3.into(), 4.into())]);
    // Another seed finds other rays.
    let arguments = ["rare.rtsl", "lookup", "--width", "8", "--shape", "packet", "--seed", "5"];
    assert_eq!(
        bench(&folder, &arguments).iter().map(sides).collect::<Vec<_>>(),
        [(3.into(), 4.into())]
    );
}

#[test]
fn bench_takes_inputs_by_name() {
    let folder = Folder::new("bench-inputs");
    folder.write("rare.rtsl", RARE);
    let bench_with = |state: &str| {
        let arguments = ["rare.rtsl", "--width", "4", "--call-mode", "packet", "--lanes", "32"];
        let rows = bench(&folder, &[&arguments[..], &["--state", state]].concat());
        assert_eq!(rows.len(), 1);
        (rows[0]["branchSidesReached"].clone(), rows[0]["divisionsPerLane"].clone())
    };
    assert_eq!(bench_with("rt_TextureUV=0.5,0"), (2.into(), 0.0.into()));
    assert_eq!(bench_with("rt_TextureUV=3,0"), (2.into(), 4.0.into()));
    let every_fourth = r#"rt_TextureUV={"lanes": [[3,0], [0,0], [0,0], [0,0]]}"#;
    assert_eq!(bench_with(every_fourth), (3.into(), 1.0.into()));
    let range = r#"rt_TextureUV={"from": [2.5, 0], "to": [7, 1]}"#;
    assert_eq!(bench_with(range), (2.into(), 4.0.into()));
}

#[test]
fn bench_measures_variants() {
    let folder = Folder::new("bench-variants");
    folder.write("ball.rtsl", SPHERE);
    let bytes = |variant: &[&str]| {
        let arguments = ["ball.rtsl", "intersect", "--width", "8", "--shape", "packet"];
        bench(&folder, &[&arguments[..], variant].concat())[0]["bytesPerLane"].as_f64().unwrap()
    };
    let (general, reading) = (bytes(&[]), bytes(&["--reads", "rt_HitDistance"]));
    // The member is loaded once a call.
    assert_eq!(general - bytes(&["--specialise"]), 4.0 / 256.0);
    // The scratch is stored for rays that hit.
    assert!(reading < general, "{reading} of {general}");
}

#[test]
fn bench_prints_a_table() {
    let folder = Folder::new("bench-table");
    folder.write("ball.rtsl", SPHERE);
    let arguments = ["bench", "ball.rtsl", "intersect", "--width", "8", "--time", "1"];
    let table = folder.run(&arguments).exits(DONE).output();
    let lines: Vec<&str> = table.lines().collect();
    assert!(lines[0].starts_with("Ball.intersect: 256 rays a call, "), "{table}");
    let shapes = lines[2..].iter().map(|line| line.split_whitespace().next().unwrap());
    assert_eq!(
        shapes.collect::<Vec<_>>(),
        ["packet", "common-origin", "stream", "leaf", "single"],
        "{table}"
    );
    assert!(lines.iter().all(|line| line.len() < 110), "{table}");
    assert!(lines[1].starts_with("shape        width vector"), "{table}");
}

#[test]
fn bench_refuses_what_it_cannot_measure() {
    let folder = Folder::new("bench-errors");
    folder.write("rare.rtsl", RARE);
    folder.write(
        "endless.rtsl",
        "class Endless : rt_Texture;\nvoid lookup() { float x = rt_TextureUV.x; \
         while (x >= 0.0) x += 0.0 * rt_TextureUV.y; rt_FloatTextureValue = x; }\n",
    );
    for arguments in [
        &["--state", "rt_TextureVU=0,0"][..],
        &["--state", "rt_TextureUV=0"],
        &["--state", r#"rt_TextureUV={"lanes": []}"#],
        &["--state", r#"rt_TextureUV={"from": 0, "to": 1}"#],
        &["--state", "rt_TextureUV"],
        &["--lanes", "0"],
        &["--shape", "box"],
        &["--width", "3"],
        &["lukup"],
    ] {
        let ran = folder.run(&[&["bench", "rare.rtsl"], arguments].concat()).exits(WRONG_USAGE);
        assert!(ran.output().is_empty(), "{}", ran.output());
    }
    let unknown = folder.run(&["bench", "rare.rtsl", "--state", "rt_TextureVU=0,0"]);
    assert!(unknown.errors().contains("did you mean `rt_TextureUV`?"), "{}", unknown.errors());
    folder.run(&["bench", "rare.rtsl", "shade"]).exits(INPUT_AT_FAULT);
    folder.run(&["bench", "endless.rtsl", "--lanes", "16"]).fails_with("E0619");
}

#[test]
fn bench_measures_scenes() {
    let folder = Folder::new("bench-scene");
    let scene = "LookAt 0 0 -5  0 0 0  0 1 0\nCamera \"Pinhole\"\nWorldBegin\n\
                 LightSource \"SkyLight\"\nShape \"Sphere\"\n";
    folder.write("scene.pbrt", scene);
    let small = ["scene.pbrt", "--size", "16x16", "--repetitions", "1", "--threads", "1"];
    let lines = bench(&folder, &[&small[..], &["--width", "4", "--width", "8"]].concat());
    assert_eq!([&lines[0]["width"], &lines[1]["width"]], [4, 8]);
    assert!(lines.iter().all(|line| line["rays"][0]["rays"] == 256), "{lines:?}");
    let table = folder.run(&[&["bench"], &small[..]].concat()).exits(DONE);
    assert!(table.output().contains("\nsecondary "), "{}", table.output());
    folder.run(&["bench", "scene.pbrt", "shade"]).exits(WRONG_USAGE);
    folder.run(&["bench", "scene.pbrt", "--shape", "leaf"]).exits(WRONG_USAGE);
    folder.run(&["bench", "none.pbrt"]).fails_with("E0601");
}

#[test]
fn the_lines_of_a_scene_have_costs() {
    let folder = Folder::new("scene-lines");
    folder.write("wave.rtsl", WAVE);
    folder.write("ball.pbrt", BALL);
    let bench = |arguments: &[&str]| {
        let all = [&["bench", "ball.pbrt", "--lines"], arguments].concat();
        folder.run(&all).exits(DONE).output()
    };
    let table = bench(&[]);
    assert!(table.starts_with("ball.pbrt: 64 paths, 8 rays at a time; about "), "{table}");
    assert!(table.contains("%  (renderer)\n") && table.contains("%  wave.rtsl\n"), "{table}");
    let root = |line: &&str| line.ends_with("    6      rt_FloatTextureValue = sqrt(x);");
    assert!(table.lines().find(root).is_some_and(|line| !line.starts_with("   0.0%")), "{table}");
    let json = bench(&["--width", "4", "--json"]);
    let lines = json.lines().map(|line| serde_json::from_str(line).unwrap());
    let lines: Vec<serde_json::Value> = lines.collect();
    assert!(lines.iter().all(|it| it["scene"] == "ball.pbrt" && it["width"] == 4), "{json}");
    let sum: f64 = lines.iter().map(|it| it["cost"].as_f64().unwrap()).sum();
    assert!((sum - 1.0).abs() < 1e-6, "{sum}");
}
