//! The program in C that draws primitives through Embree draws the picture that the one in Rust draws, whose test pins
//! it too, and finds the hits of a loop without Embree.

use std::path::{Path, PathBuf};
use std::process::Command;

use crate::compiler::{CProgram, has_compiler, repository};
use expect_test::expect_file;
use rtsl_testing::digest::fnv1a;

/// As in the test of the program in Rust.
/// The test in Rust has the other sizes of packets.
const SCENE: &str = "Torus majorRadius=1.1 minorRadius=0.3 HEART size=0.6 center=0,0.55,0 \
    Sphere center=1.1,0.45,0.5 radius=0.25 Sphere center=-0.9,0.5,-0.75 radius=0.2";

#[test]
fn packets_draw_the_picture() {
    if !has_compiler() {
        return;
    }
    let program = build("picture", &["embree", "rtsl_geometry"]);
    let small = program.with_file_name("small.ppm");
    let arguments = ["--size", "16", "Sphere", small.to_str().expect("UTF-8")];
    if !has_embree(&program, &arguments) {
        return;
    }
    for width in ["1", "16"] {
        let picture = program.with_file_name(format!("heart-{width}.ppm"));
        let heart = folder().join("heart.rtsl");
        let scene = SCENE.replace("HEART", heart.to_str().expect("UTF-8"));
        let mut run = Command::new(&program);
        run.args(["--width", width, "--size", "96", "--check"])
            .args(scene.split(' '))
            .arg(&picture);
        let output = run.output().expect("the program runs");
        assert!(output.status.success(), "{}{}", text(&output.stdout), text(&output.stderr));
        let file = std::fs::read(&picture).expect("it was written");
        let pixels = file.strip_prefix(b"P6\n96 96\n255\n").expect("a PPM file");
        expect_file!["../../../../integrations/embree/picture.txt"]
            .assert_eq(&format!("{:08x}\n", fnv1a(pixels)));
    }
}

#[test]
fn the_race_tells_mistakes() {
    if !has_compiler() {
        return;
    }
    let program = build("race", &["hand_sphere", "embree", "rtsl_geometry"]);
    let told = |arguments: &[&str], library: Option<&str>| {
        let mut run = Command::new(&program);
        run.args(arguments);
        if let Some(library) = library {
            run.env("EMBREE", library);
        }
        let output = run.output().expect("the program runs");
        (output.status.code(), text(&output.stderr), text(&output.stdout))
    };
    let (code, message, _) = told(&[], Some("/nowhere/libembree3.so"));
    assert_eq!(code, Some(1));
    assert!(message.starts_with("error: EMBREE names a library that can't be loaded"), "{message}");
    assert_eq!(told(&["--rounds", "0"], None).0, Some(2));
    if has_embree(&program, &["NoSuchClass"]) {
        let (code, message, _) = told(&["Spere"], None);
        assert_eq!(code, Some(1));
        assert!(message.contains("did you mean `Sphere`?"), "{message}");
    }
}

/// Compiles a program of the folder.
fn build(name: &str, others: &[&str]) -> PathBuf {
    let mut program = CProgram::of(&folder().join(format!("{name}.c"))).sanitized();
    for other in others {
        program = program.with(folder().join(format!("{other}.c")));
    }
    program.with_library().build()
}

/// True if the program finds an Embree with these arguments.
///
/// # Panics
/// If there is none, and `RTSL_REQUIRE_EMBREE` is set.
fn has_embree(program: &Path, arguments: &[&str]) -> bool {
    let output = Command::new(program).args(arguments).output();
    let is_missing =
        text(&output.expect("the program runs").stderr).contains("Embree was not found");
    let is_required = std::env::var_os("RTSL_REQUIRE_EMBREE").is_some();
    assert!(!(is_missing && is_required), "there is no Embree, and RTSL_REQUIRE_EMBREE is set");
    if is_missing {
        eprintln!("left out: there is no Embree");
    }
    !is_missing
}

fn folder() -> PathBuf {
    repository().join("integrations/embree")
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).into_owned()
}
