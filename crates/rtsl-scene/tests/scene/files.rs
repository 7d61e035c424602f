//! Directives across files: includes, imports, and compressed files.

use std::io::Write;
use std::path::{Path, PathBuf};

use expect_test::expect;
use flate2::Compression;
use flate2::write::GzEncoder;
use rtsl::{Diagnostics, SourceMap};
use rtsl_memory::{Amount, InputBudget};
use rtsl_scene::Description;
use rtsl_scene::reader::{Digest, DiskFiles, MemoryFiles, RecordedFiles, read_scene_within};
use rtsl_scene::{LoadOptions, SceneSource, load_scene};

type Files = MemoryFiles<Vec<u8>>;

fn in_memory(files: &[(&str, &[u8])]) -> Files {
    MemoryFiles(files.iter().map(|(path, bytes)| (PathBuf::from(path), bytes.to_vec())).collect())
}

fn compressed(bytes: &[u8]) -> Vec<u8> {
    let mut encoder = GzEncoder::new(Vec::new(), Compression::default());
    encoder.write_all(bytes).unwrap();
    encoder.finish().unwrap()
}

fn read_within(main: &str, files: &Files, budget: &InputBudget) -> (Description, String) {
    let (mut map, mut diagnostics) = (SourceMap::new(), Diagnostics::new());
    let description = read_scene_within(Path::new(main), files, budget, &mut map, &mut diagnostics);
    (description, rtsl::render::all_to_text(&map, diagnostics.iter(), false))
}

fn read(main: &str, files: &[(&str, &[u8])]) -> (Description, String) {
    read_within(main, &in_memory(files), &InputBudget::new(Some(Amount(64 << 20))))
}

fn classes(description: &Description) -> Vec<&str> {
    description.entities.iter().map(|entity| entity.class.as_str()).collect()
}

#[test]
fn includes_are_relative_to_the_main_file_or_to_the_one_that_names_them() {
    let files: [(&str, &[u8]); 5] = [
        ("s/main.pbrt", b"WorldBegin Include \"parts/all.pbrt\""),
        (
            "s/parts/all.pbrt",
            b"Include \"parts/one.pbrt\" Include \"two.pbrt\" Include \"both.pbrt\"",
        ),
        ("s/parts/one.pbrt", b"Shape \"One\""),
        ("s/parts/two.pbrt", b"Shape \"Two\""),
        ("s/both.pbrt", b"Shape \"BesideMain\""),
    ];
    let (description, messages) = read("s/main.pbrt", &files);
    assert_eq!((classes(&description), messages.as_str()), (vec!["One", "Two", "BesideMain"], ""));
    let (_, messages) = read("s/main.pbrt", &files[..2]);
    assert!(messages.contains("cannot read `s/parts/one.pbrt`"), "{messages}");
}

#[test]
fn parameters_follow_the_file_that_ends_before_them() {
    let files: [(&str, &[u8]); 4] = [
        ("main.pbrt", b"WorldBegin Include \"outer.pbrt\" \"float c\" 3 Shape \"Last\""),
        ("outer.pbrt", b"Shape \"First\" Include \"inner.pbrt\" \"float b\" 2"),
        ("inner.pbrt", b"Shape \"Second\" \"float a\" 1"),
        ("end.pbrt", b"WorldBegin Include \"inner.pbrt\""),
    ];
    let (description, messages) = read("main.pbrt", &files);
    assert_eq!((classes(&description), messages.as_str()), (vec!["First", "Second", "Last"], ""));
    let names = |index: usize| {
        let parameters = &description.entities[index].parameters;
        parameters.iter().map(|it| it.name.as_str()).collect::<Vec<_>>()
    };
    assert_eq!((names(0), names(1)), (vec![], vec!["a", "b", "c"]));
    assert_eq!(classes(&read("end.pbrt", &files).0), ["Second"]);
    let (_, messages) = read(
        "x.pbrt",
        &[("x.pbrt", b"WorldBegin Include \"y\" \"float a\" 1"), ("y", b"Identity")],
    );
    assert!(messages.contains("found a quoted string, expected a directive"), "{messages}");
}

#[test]
fn an_import_leaves_the_graphics_state_alone() {
    let main = b"WorldBegin Translate 1 0 0 Import \"part.pbrt\" Shape \"Outside\"";
    let (description, messages) = read(
        "main.pbrt",
        &[("main.pbrt", main), ("part.pbrt", b"Translate 2 0 0 AttributeBegin Shape \"Inside\"")],
    );
    let places: Vec<f64> =
        description.entities.iter().map(|entity| entity.transform.point([0.0; 3])[0]).collect();
    assert_eq!((classes(&description), places), (vec!["Inside", "Outside"], vec![3.0, 1.0]));
    assert_eq!(messages.matches("error[").count(), 1, "{messages}");
    assert!(messages.contains("`AttributeBegin` without its `AttributeEnd`"), "{messages}");
}

#[test]
fn compressed_files_are_read_whatever_their_names() {
    let main = compressed(b"WorldBegin Include \"part.pbrt\" Shape \"Third\"");
    let part = compressed(b"Shape \"First\" Include \"plain.pbrt.gz\"");
    let (description, messages) = read(
        "main.pbrt.gz",
        &[("main.pbrt.gz", &main), ("part.pbrt", &part), ("plain.pbrt.gz", b"Shape \"Second\"")],
    );
    assert_eq!((classes(&description), messages.as_str()), (vec!["First", "Second", "Third"], ""));
}

#[test]
fn compressed_meshes_are_read() {
    let ply = b"ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\n\
        property float z\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n\
        0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n";
    let text =
        b"Camera \"perspective\"\nWorldBegin\nShape \"plymesh\" \"string filename\" \"a.ply.gz\"\n";
    let (text, ply) = (compressed(text), compressed(ply));
    let files = in_memory(&[("main.pbrt.gz", &text), ("a.ply.gz", &ply)]);
    let mut source = SceneSource::read(Path::new("main.pbrt.gz"), &files, &LoadOptions::default());
    let loaded = source.load().unwrap_or_else(|messages| panic!("{}", messages.to_text(false)));
    assert_eq!(loaded.scene.objects.len(), 1);
    assert!(!source.text_changed(), "a compressed text is compared with what it expands to");
}

#[test]
fn a_bomb_is_an_error_of_memory() {
    let mut bomb = b"WorldBegin\n".to_vec();
    bomb.resize(64 << 20, b' ');
    let files = in_memory(&[("main.pbrt.gz", &compressed(&bomb))]);
    let budget = InputBudget::new(Some(Amount(16 << 20)));
    let (description, messages) = read_within("main.pbrt.gz", &files, &budget);
    assert!(description.entities.is_empty());
    assert!(messages.contains("for the scene's files"), "{messages}");
    let mut damaged = compressed(b"WorldBegin\n");
    damaged.truncate(15);
    let (_, messages) = read("main.pbrt.gz", &[("main.pbrt.gz", &damaged)]);
    assert!(messages.contains("cannot read `main.pbrt.gz`"), "{messages}");
}

#[test]
fn texts_of_other_encodings_are_read() {
    let main = b"\xef\xbb\xbf# caf\xe9\nWorldBegin Shape \"One\"";
    let (description, messages) = read("main.pbrt", &[("main.pbrt", main)]);
    assert_eq!((classes(&description), messages.as_str()), (vec!["One"], ""));
}

/// Wherever a scene's files come from, what its shaders include comes from there, too.
#[test]
fn files_that_shaders_include_are_those_of_the_source() {
    let scene = b"Camera \"Pinhole\"\nWorldBegin\nTexture \"t\" \"spectrum\" \"Stripes\"\n\
        Material \"Lambertian\" \"texture kd\" \"t\"\nShape \"Sphere\"\n";
    let stripes =
        b"#include \"tone.rtsl\"\n#include \"parts/more.rtsl\"\nclass Stripes : rt_Texture;\n\
        void lookup() { rt_TextureColor = tone(more()); }";
    let files: [(&str, &[u8]); 4] = [
        ("s/main.pbrt", scene),
        ("s/stripes.rtsl", stripes),
        ("s/parts/more.rtsl", b"float more() { return 0.5; }"),
        ("library/tone.rtsl", b"color tone(float x) { return color(x); }"),
    ];
    let load = |files: &Files| {
        let recorded = RecordedFiles::new(files);
        let options = LoadOptions { search_path: vec!["library".into()], ..LoadOptions::default() };
        let loaded = load_scene(Path::new("s/main.pbrt"), &recorded, &options);
        loaded.map(|_| recorded.digests(Path::new("s/main.pbrt")))
    };
    let names = |digests: &[(String, Digest)]| -> Vec<String> {
        digests.iter().map(|(name, _)| name.clone()).collect()
    };
    let digests = load(&in_memory(&files)).unwrap_or_else(|it| panic!("{}", it.to_text(false)));
    let expected = ["library/tone.rtsl", "main.pbrt", "parts/more.rtsl", "stripes.rtsl"];
    assert_eq!(names(&digests), expected);
    let changed =
        in_memory(&files).with("library/tone.rtsl", *b"color tone(float x) { return color(0); }");
    let changed = load(&changed).unwrap_or_else(|it| panic!("{}", it.to_text(false)));
    assert_eq!((names(&changed), changed != digests), (names(&digests), true));
    let missing = load(&in_memory(&files[..3])).unwrap_err().to_text(false);
    assert!(missing.contains("E0020"), "{missing}");
}

/// Classes of the library are the same whatever files a scene has.
#[test]
fn files_of_the_library_are_included_before_those_beside_the_scene() {
    let scene = b"Camera \"Pinhole\"\nWorldBegin\nMaterial \"Lambertian\"\nShape \"trianglemesh\" \
                  \"integer indices\" [0 1 2] \"point3 P\" [0 0 0  1 0 0  0 1 0]\nShape \"sphere\"\n";
    let files: [(&str, &[u8]); 3] = [
        ("s/scene.pbrt", scene),
        ("s/triangle_test.rtsl", b"int this is no triangle test("),
        (
            "s/hit_errors.rtsl",
            b"bool isOff(float number, float wanted, float size) { return true; }",
        ),
    ];
    let loaded = load_scene(Path::new("s/scene.pbrt"), &in_memory(&files), &LoadOptions::default());
    let loaded = loaded.unwrap_or_else(|messages| panic!("{}", messages.to_text(false)));
    assert_eq!(loaded.scene.objects.len(), 2);
}

/// The message is the same whether the link leads to a shader or to nothing.
#[cfg(unix)]
#[test]
fn shaders_behind_links_that_leave_the_folder_are_not_read() {
    use std::os::unix::fs::symlink;

    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name);
    let shader = "class Stars : rt_Material; void BSDF() { rt_BSDFValue = color(1.0); }";
    std::fs::create_dir_all(path("scene")).unwrap();
    std::fs::create_dir_all(path("outside")).unwrap();
    std::fs::write(path("outside/stars.rtsl"), shader).unwrap();
    let scene = "Camera \"Pinhole\"\nWorldBegin\nMaterial \"Stars\"\nShape \"Sphere\"\n";
    std::fs::write(path("scene/scene.pbrt"), scene).unwrap();
    let load = |search_path: &[PathBuf]| {
        let options = LoadOptions { search_path: search_path.to_owned(), ..LoadOptions::default() };
        let loaded = load_scene(&path("scene/scene.pbrt"), &DiskFiles, &options);
        let messages = loaded.map_or_else(|messages| messages, |loaded| loaded.warnings);
        messages.to_text(false).replace(&folder.path().display().to_string(), "FOLDER")
    };
    let mut texts = ["outside/stars.rtsl", "outside/absent.rtsl"].map(|target| {
        symlink(path(target), path("scene/stars.rtsl")).unwrap();
        let text = load(&[]);
        let named = load(&[path("outside")]);
        std::fs::remove_file(path("scene/stars.rtsl")).unwrap();
        (text, named)
    });
    assert_eq!(texts[0].0, texts[1].0);
    let (text, named) = std::mem::take(&mut texts[0]);
    assert!(text.starts_with("warning[W0632]: `FOLDER/scene/stars.rtsl` is not read"), "{text}");
    assert!(text.contains("error[E0609]"), "{text}");
    assert!(!named.contains("error") && !named.contains("W0632"), "{named}");
    // A link within the folder is one name more.
    std::fs::write(path("scene/sky.rtsl"), shader).unwrap();
    symlink("sky.rtsl", path("scene/stars.rtsl")).unwrap();
    assert!(!load(&[]).contains("error"), "{}", load(&[]));
}

/// Nothing is read for them: neither the picture that is there, which is none, nor the mesh.
#[test]
fn missing_files_hide_no_other_errors() {
    let scene = b"Camera \"perspective\" \"float fo\" 40\nWorldBegin\n\
        Texture \"there\" \"spectrum\" \"imagemap\" \"string filename\" \"there.png\"\n\
        Texture \"gone\" \"spectrum\" \"imagemap\" \"string filename\" \"gone.png\"\n\
        LightSource \"ambient\" \"rgb L\" [1 1 1]\n\
        Material \"diffuse\" \"texture reflectance\" \"there\"\nShape \"sphere\" \"float radiu\" 2\n\
        Material \"diffuse\" \"texture reflectance\" \"gone\"\nShape \"disk\"\n\
        Material \"diffuse\" \"texture reflectance\" \"unknown\"\n\
        Shape \"plymesh\" \"string filename\" \"gone.ply\"\n\
        Shape \"plymesh\" \"string filename\" \"there.ply\"\nShape \"Blob\"\n";
    let files: [(&str, &[u8]); 3] =
        [("s.pbrt", scene), ("there.png", b"no picture"), ("there.ply", b"no mesh")];
    let loaded = load_scene(Path::new("s.pbrt"), &in_memory(&files), &LoadOptions::default());
    let messages = loaded.expect_err("errors").to_text(false);
    let heads: String = messages.split_inclusive('\n').filter(|it| it.contains("[E")).collect();
    expect![[r#"
        error[E0601]: cannot read `gone.png`: entity not found
        error[E0601]: cannot read `gone.ply`: entity not found
        error[E0608]: camera `perspective` has no parameter `fo`
        error[E0608]: shape `sphere` has no parameter `radiu`
        error[E0610]: unknown texture `unknown`
        error[E0609]: unknown shape class `Blob`
    "#]]
    .assert_eq(&heads);
}
