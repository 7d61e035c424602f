//! The program draws the picture of the one in C, whose test pins it too, and finds the hits of a loop without Embree.

use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use expect_test::expect_file;

/// As in the test of the program in C.
/// The test in C has the other sizes of packets.
const SCENE: &str = "Torus majorRadius=1.1 minorRadius=0.3 HEART size=0.6 center=0,0.55,0 \
    Sphere center=1.1,0.45,0.5 radius=0.25 Sphere center=-0.9,0.5,-0.75 radius=0.2";

#[test]
fn packets_draw_the_picture() {
    if !has_embree() {
        return;
    }
    for width in ["4", "8"] {
        let picture = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join(format!("heart-{width}.png"));
        let scene = SCENE.replace("HEART", folder().join("heart.rtsl").to_str().expect("UTF-8"));
        let mut run = program();
        run.args(["--width", width, "--size", "96", "--check"])
            .args(scene.split(' '))
            .arg(&picture);
        let output = run.output().expect("the program runs");
        assert!(output.status.success(), "{}{}", text(&output.stdout), text(&output.stderr));
        let sum = format!("{:08x}\n", sum(&pixels(&picture)));
        expect_file!["../../picture.txt"].assert_eq(&sum);
    }
}

#[test]
fn mistakes_are_told() {
    let told = |arguments: &[&str], environment: Option<&str>| {
        let mut run = program();
        run.args(arguments).arg("/nowhere/none.png");
        if let Some(library) = environment {
            run.env("EMBREE", library);
        }
        let Output { status, stderr, .. } = run.output().expect("the program runs");
        (status.code(), text(&stderr))
    };
    let (code, message) = told(&["Sphere"], Some("/nowhere/libembree3.so"));
    assert_eq!(code, Some(1));
    assert!(message.starts_with("error: EMBREE names a library that can't be loaded"), "{message}");
    assert_eq!(told(&["--width", "3", "Sphere"], None).0, Some(2));
    if has_embree() {
        let (code, message) = told(&["Spere"], None);
        assert_eq!(code, Some(1));
        assert!(message.contains("did you mean `Sphere`?"), "{message}");
        let (code, message) = told(&["Sphere", "radus=1"], None);
        assert_eq!(code, Some(1));
        assert!(message.contains("radus"), "{message}");
        let (code, message) = told(&["Plane"], None);
        assert_eq!(code, Some(1));
        assert!(message.contains("`Plane` has no method `computeBounds`"), "{message}");
    }
}

/// True if there is an Embree.
///
/// # Panics
/// If there is none, and `RTSL_REQUIRE_EMBREE` is set.
fn has_embree() -> bool {
    let mut run = program();
    // That there is no such class is found after Embree.
    let output = run.args(["NoSuchClass", "none.png"]).output().expect("the program runs");
    let is_missing = text(&output.stderr).contains("Embree was not found");
    let is_required = std::env::var_os("RTSL_REQUIRE_EMBREE").is_some();
    assert!(!(is_missing && is_required), "there is no Embree, and RTSL_REQUIRE_EMBREE is set");
    if is_missing {
        eprintln!("left out: there is no Embree");
    }
    !is_missing
}

fn program() -> Command {
    Command::new(env!("CARGO_BIN_EXE_rtsl-embree"))
}

fn folder() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..")
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).into_owned()
}

fn pixels(path: &Path) -> Vec<u8> {
    let file = std::io::BufReader::new(std::fs::File::open(path).expect("it was written"));
    let mut reader = png::Decoder::new(file).read_info().expect("a picture");
    let mut pixels = vec![0; reader.output_buffer_size().expect("a size")];
    reader.next_frame(&mut pixels).expect("it can be read");
    pixels
}

/// Fowler, Noll and Vo's hash (FNV-1a, 32 bits).
fn sum(bytes: &[u8]) -> u32 {
    let step = |sum: u32, byte: &u8| (sum ^ u32::from(*byte)).wrapping_mul(0x0100_0193);
    bytes.iter().fold(0x811c_9dc5, step)
}
