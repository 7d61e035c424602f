//! `rtsl fmt`: files, folders, standard input, and what `--check` prints.

use expect_test::expect;

use crate::command::{DONE, Folder, INPUT_AT_FAULT, WRONG_USAGE};

const LOOSE: &str = "float twice( float x ){return 2.0*x;}\n";
const NEAT: &str = "float twice(float x) { return 2.0 * x; }\n";

#[test]
fn files_and_folders_are_formatted_in_place() {
    let folder = Folder::new("fmt");
    std::fs::create_dir_all(folder.0.path().join("inner/.hidden")).unwrap();
    for name in ["a.rtsl", "inner/b.rtsl", "inner/c.txt", "inner/.hidden/d.rtsl", "named.glsl"] {
        folder.write(name, LOOSE);
    }
    let ran = folder.run(&["fmt", "a.rtsl", "inner", "named.glsl"]).exits(DONE);
    assert_eq!((ran.output(), ran.errors()), (String::new(), String::new()));
    let text = |name: &str| std::fs::read_to_string(folder.0.path().join(name)).unwrap();
    for name in ["a.rtsl", "inner/b.rtsl", "named.glsl"] {
        assert_eq!(text(name), NEAT, "{name}");
    }
    for name in ["inner/c.txt", "inner/.hidden/d.rtsl"] {
        assert_eq!(text(name), LOOSE, "{name}");
    }
    folder.run(&["fmt", "--check", "."]).exits(DONE);
}

#[test]
fn checks_change_nothing() {
    let folder = Folder::new("fmt-check");
    folder.write("a.rtsl", LOOSE);
    let ran = folder.run(&["fmt", "--check", "a.rtsl"]).exits(INPUT_AT_FAULT);
    expect![[r#"
        --- a.rtsl
        +++ a.rtsl (formatted)
        @@ -1 +1 @@
        -float twice( float x ){return 2.0*x;}
        +float twice(float x) { return 2.0 * x; }
    "#]]
    .assert_eq(&ran.output());
    assert_eq!(std::fs::read_to_string(folder.0.path().join("a.rtsl")).unwrap(), LOOSE);
}

#[test]
fn standard_input_is_formatted_to_standard_output() {
    let folder = Folder::new("fmt-input");
    assert_eq!(folder.run_with(&["fmt", "-"], LOOSE).exits(DONE).output(), NEAT);
}

#[test]
fn files_with_errors_stay_and_others_are_formatted() {
    let folder = Folder::new("fmt-errors");
    folder.write("bad.rtsl", "float f( {\n");
    folder.write("good.rtsl", LOOSE);
    folder.write("latin.rtsl", b"// \xe9\n");
    folder.run(&["fmt", "bad.rtsl", "good.rtsl"]).exits(INPUT_AT_FAULT).fails_with("E0102");
    assert_eq!(std::fs::read_to_string(folder.0.path().join("bad.rtsl")).unwrap(), "float f( {\n");
    assert_eq!(std::fs::read_to_string(folder.0.path().join("good.rtsl")).unwrap(), NEAT);
    folder.run(&["fmt", "latin.rtsl"]).exits(INPUT_AT_FAULT).fails_with("E0601");
    folder.run(&["fmt", "missing.rtsl"]).exits(INPUT_AT_FAULT).fails_with("E0601");
    folder.run(&["fmt"]).exits(WRONG_USAGE);
}
