//! Lights from photometric files.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use proptest::prelude::*;
use rtsl::Instance;
use rtsl_memory::Amount;
use rtsl_scene::reader::MemoryFiles;
use rtsl_scene::{LoadOptions, load_scene};

/// A file of 1995 with two planes of three angles, candela times 2, the ballast factors 0.5 and 0.8.
const LAMP: &str = "IESNA:LM-63-1995
[TEST] 1234
[MANUFAC] A maker of lamps
TILT=NONE
1 1000 2 3 2 1 2 0.1 0.1 0.05
0.5 0.8 60
0 45 90
0 180
100 50 0
80 40.5 1e1
";

fn scene(parameters: &str) -> String {
    format!(
        "Camera \"perspective\"\nWorldBegin\nLightSource \"IesLight\" {parameters}\nShape \"sphere\"\n"
    )
}

const FILE: &str = "\"string filename\" \"lamp.ies\"";

fn try_light(file: &str, parameters: &str) -> Result<Arc<Instance>, String> {
    let files = [("scene.pbrt", scene(parameters)), ("lamp.ies", file.to_owned())];
    let files = MemoryFiles(files.map(|(path, text)| (PathBuf::from(path), text)).into());
    let loaded = load_scene(Path::new("scene.pbrt"), &files, &LoadOptions::default());
    let loaded = loaded.map_err(|messages| messages.to_text(false))?;
    assert!(loaded.warnings.is_empty(), "{}", loaded.warnings.to_text(false));
    Ok(loaded.scene.lights[0].light.clone())
}

fn light(file: &str, parameters: &str) -> Arc<Instance> {
    try_light(file, parameters).unwrap_or_else(|messages| panic!("{messages}"))
}

fn numbers(light: &Instance, name: &str) -> Vec<f32> {
    let words = light.buffer(name).expect("the class has it");
    words.iter().map(|word| f32::from_bits(*word)).collect()
}

#[test]
fn angles_and_candela_are_those_of_the_file() {
    let light = light(LAMP, &format!("{FILE} \"float strength\" 3"));
    assert_eq!(light.class().name, "IesLight");
    assert_eq!(numbers(&light, "verticals"), [0., 45., 90.]);
    assert_eq!(numbers(&light, "horizontals"), [0., 180.]);
    assert_eq!(numbers(&light, "candela"), [80., 40., 0., 64., 32.4, 8.]);
}

/// The mark of UTF-8 is no part of the version, on which the lamp's factor depends.
#[test]
fn a_byte_order_mark_is_skipped() {
    let marked = format!("\u{feff}TILT=NONE{}", LAMP.split_once("TILT=NONE").unwrap().1);
    assert_eq!(numbers(&light(&marked, FILE), "verticals"), [0., 45., 90.]);
}

#[test]
fn versions_differ_in_their_heads() {
    let candela = |file: &str| numbers(&light(file, FILE), "candela")[0];
    assert_eq!(candela(&LAMP.replace("IESNA:LM-63-1995", "IESNA91")), 80.0);
    // Of 1986, without a first line of its own.
    assert_eq!(candela(&LAMP.replace("IESNA:LM-63-1995\n[TEST] 1234\n", "A lamp\n")), 80.0);
    // The second factor is reserved, or tells how the file was made.
    assert_eq!(candela(&LAMP.replace("IESNA:LM-63-1995", "IESNA:LM-63-2002")), 100.0);
    assert_eq!(candela(&LAMP.replace("IESNA:LM-63-1995", "IES:LM-63-2019")), 100.0);
    // Lines end in several ways, and commas separate numbers, too.
    assert_eq!(candela(&LAMP.replace('\n', "\r\n")), 80.0);
    assert_eq!(candela(&LAMP.replace('\n', "\r")), 80.0);
    assert_eq!(candela(&LAMP.replace("0 45 90", "0, 45,90")), 80.0);
}

#[test]
fn light_may_depend_on_the_tilt() {
    let file = LAMP.replace("TILT=NONE", "TILT=INCLUDE\n1\n3\n0 20 90\n1 0.5 0.75");
    let candela = |tilt: &str| numbers(&light(&file, &format!("{FILE} {tilt}")), "candela")[0];
    assert_eq!(candela(""), 80.0);
    assert_eq!(candela("\"float tilt\" 10"), 60.0);
    assert_eq!(candela("\"float tilt\" 20"), 40.0);
    assert_eq!(candela("\"float tilt\" 120"), 60.0);
}

#[test]
fn faults_are_said_with_their_line() {
    let check = |from: &str, to: &str, expected: &[&str]| {
        assert!(LAMP.contains(from), "{from}");
        let found = try_light(&LAMP.replacen(from, to, 1), FILE).expect_err("it is wrong");
        for expected in expected {
            assert!(found.contains(expected), "{expected}\n{found}");
        }
    };
    check("2 3 2 1 2", "2 3 2 2 2", &["E0601", "`lamp.ies`, line 5: ", "type B", "convert"]);
    check("2 3 2 1 2", "2 3 2 3 2", &["photometry of type A"]);
    check("2 3 2 1 2", "2 3 2 4 2", &["is 4, which is none of 1, 2 and 3"]);
    check("TILT=NONE\n", "", &["line 9: the file has no line `TILT=`", "IES LM-63"]);
    check("TILT=NONE", "TILT=lamp.tlt", &["line 4: `TILT=lamp.tlt` names a file", "INCLUDE"]);
    check("TILT=NONE", "TILT=INCLUDE\n7\n", &["line 5: the geometry of lamp and luminaire is 7"]);
    check("2 3 2 1 2", "2 three 2 1 2", &["line 5: the number of vertical angles is `three`"]);
    check("2 3 2 1 2", "2 3.5 2 1 2", &["the number of vertical angles is 3.5"]);
    check("2 3 2 1 2", "2 30000 30000 1 2", &["line 6: 900060000 numbers should follow"]);
    check("2 3 2 1 2", "2 3 99999 1 2", &["expected a whole number from 1 to 32768"]);
    check("0 45 90\n", "0 95 90\n", &["line 7: vertical angle 3 is 90, after 95", "ascending"]);
    check("0 45 90\n", "-45 45 90\n", &["vertical angle 1 is -45, not within 0 to 180"]);
    check("0 180", "0 120", &["line 8: the horizontal angles go from 0 to 120 degrees"]);
    check("40.5", "-40.5", &["line 10: intensity 5 is -40.5"]);
    check("40.5", "nan", &["intensity 5 is `nan`", "expected a number"]);
    check("40.5", "1e39", &["intensity 5 times its multipliers is too great"]);
    check("40.5 1e1\n", "", &["line 10: the file ends before intensity 5", "cut off"]);
    let found = try_light(LAMP, "\"string filename\" \"lamb.ies\"").expect_err("it is missing");
    assert!(found.contains("cannot read `lamb.ies`"), "{found}");
    let found = try_light(LAMP, &format!("{FILE} \"float verticals\" [0 90]"));
    assert!(found.expect_err("it is given twice").contains("E0611"));
    let found = try_light(LAMP, &format!("{FILE} \"string tilt\" \"steep\""));
    assert!(found.expect_err("it is no number").contains("`tilt` takes a number of degrees"));
    let found = try_light(LAMP, &format!("{FILE} \"float strenght\" 2"));
    assert!(found.expect_err("it is a slip").contains("did you mean `strength`?"));
}

#[test]
fn files_count_in_the_budget() {
    let text = format!("{LAMP}{}", " ".repeat(1 << 20));
    let files = [("scene.pbrt", scene(FILE)), ("lamp.ies", text)];
    let files = MemoryFiles(files.map(|(path, text)| (PathBuf::from(path), text)).into());
    let few = LoadOptions { input_memory: Some(Amount(2 << 20)), ..LoadOptions::default() };
    let failed = load_scene(Path::new("scene.pbrt"), &files, &few).expect_err("it is too large");
    assert!(failed.to_text(false).contains("E0642"), "{}", failed.to_text(false));
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(60))]

    /// Any change of the file is read to finite numbers, or refused.
    #[test]
    fn any_file_is_read_or_refused(
        at in 0..LAMP.len(),
        length in 0_usize..9,
        new in "[-0-9. eE,\n\rTILT=]{0,8}|\\PC{0,8}",
        cut in 0..2 * LAMP.len(),
    ) {
        let mut text = LAMP.to_owned();
        text.replace_range(at..(at + length).min(LAMP.len()), &new);
        let end = (0..=cut.min(text.len())).rev().find(|at| text.is_char_boundary(*at));
        text.truncate(end.unwrap_or(0));
        if let Ok(light) = try_light(&text, FILE) {
            let [verticals, horizontals, candela] =
                ["verticals", "horizontals", "candela"].map(|name| numbers(&light, name));
            prop_assert_eq!(candela.len(), verticals.len() * horizontals.len());
            let all = [&verticals, &horizontals, &candela];
            prop_assert!(all.iter().all(|it| it.iter().all(|number| number.is_finite())));
        }
    }
}
