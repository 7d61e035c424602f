//! Memory that cannot be had is an error with a code, never an end by a signal: child processes under `ulimit -v`.
#![cfg(target_os = "linux")]

use std::path::PathBuf;
use std::process::Command;

use tempfile::TempDir;

/// A folder that goes with the test.
struct Folder(TempDir);

impl Folder {
    fn new(name: &str) -> Self {
        let folder = tempfile::Builder::new().prefix(name).tempdir();
        Folder(folder.expect("a folder for the test"))
    }

    fn path(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    fn write(&self, name: &str, contents: impl AsRef<[u8]>) {
        std::fs::write(self.path(name), contents).expect("a file for the test");
    }

    /// Runs `rtsl` with these words in this folder, where addresses end after so many MiB. Returns the exit code, which
    /// there is none of after a signal, and what was said.
    fn run(&self, mebibytes: u64, words: &[&str]) -> (Option<i32>, String) {
        let mut command = Command::new("sh");
        let script = format!("ulimit -v {} && exec \"$@\"", mebibytes << 10);
        command.args(["-c", &script, "sh", env!("CARGO_BIN_EXE_rtsl")]).args(words);
        // A thread of the allocator takes 64 MiB of addresses else.
        command.current_dir(&self.0).env("MALLOC_ARENA_MAX", "1");
        let output = command.output().expect("it runs");
        (output.status.code(), String::from_utf8_lossy(&output.stderr).into_owned())
    }
}

const SCENE: &str = "Camera \"Pinhole\"\nWorldBegin\nLightSource \"infinite\"\nShape \"Sphere\"\n";

fn render<'a>(words: &[&'a str]) -> Vec<&'a str> {
    let common = ["render", "scene.pbrt", "-o", "a.exr", "--threads", "1", "--backend", "interp"];
    [&common, words].concat()
}

#[test]
fn a_picture_too_large_for_the_memory_is_refused_before_the_work() {
    let folder = Folder::new("size");
    folder.write("scene.pbrt", SCENE);
    for (limit, words, takes) in [
        (7812, &["--renderer", "batch", "--size", "16384x16384"][..], "11."),
        (5000, &["--renderer", "interactive", "--size", "16384x16384"], "11."),
        (6000, &["--renderer", "batch", "--size", "8192x8192", "--aov", "albedo,normal"], "7."),
        (3000, &["--renderer", "interactive", "--size", "8192x8192", "--aov", "normal"], "5."),
    ] {
        let (code, said) = folder.run(limit, &render(words));
        assert_eq!(code, Some(1), "{said}");
        let size = words[3].replace('x', " by ");
        let expected = format!("error[E0641]: an image of {size} pixels takes about {takes}");
        assert!(said.starts_with(&expected), "expected {expected:?} in\n{said}");
        assert!(said.contains("(`ulimit -v`)") && said.contains("`--size`"), "{said}");
        assert!(!folder.path("a.exr").exists());
    }
}

#[test]
fn a_window_too_large_for_the_memory_is_refused() {
    let folder = Folder::new("window");
    folder.write("scene.pbrt", SCENE);
    let words = ["view", "scene.pbrt", "--size", "16384x16384", "--threads", "1"];
    let (code, said) = folder.run(5000, &words);
    assert!(code == Some(1) && said.starts_with("error[E0641]"), "{said}");
}

/// Small files that stand for much: an image of one colour, and a mesh of polygons with many corners.
#[test]
fn files_of_a_scene_take_no_more_than_they_are_allowed() {
    let folder = Folder::new("inputs");
    folder.write("scene.pbrt", SCENE);
    let picture = ["render", "scene.pbrt", "-o", "sky.exr", "--backend", "interp", "--spp", "1"];
    let (code, said) = folder.run(2500, &[&picture[..], &["--size", "192x192"]].concat());
    assert_eq!(code, Some(0), "{said}");
    let light = "LightSource \"infinite\" \"string filename\" \"sky.exr\"\n";
    folder.write("image.pbrt", format!("{SCENE}{light}"));
    let polygon = format!("100 {}\n", "0 ".repeat(100)).repeat(3000);
    let header = "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\n\
        property float z\nelement face 3000\nproperty list uchar int vertex_indices\nend_header\n";
    folder.write("mesh.ply", format!("{header}0 0 0\n1 0 0\n0 1 0\n{polygon}"));
    let shape = "Shape \"plymesh\" \"string filename\" \"mesh.ply\"\n";
    folder.write("mesh.pbrt", format!("{SCENE}{shape}"));
    for (scene, file, takes) in
        [("image.pbrt", "sky.exr", "1.2 MiB"), ("mesh.pbrt", "mesh.ply", "1.0 MiB")]
    {
        let words = ["render", scene, "-o", "a.exr", "--size", "8x8", "--spp", "1"];
        let limits = ["--threads", "1", "--backend", "interp", "--input-memory", "1MiB"];
        let (code, said) = folder.run(2500, &[&words[..], &limits].concat());
        assert_eq!(code, Some(1), "{said}");
        let message = format!("error[E0642]: `{file}` takes about {takes} of memory");
        assert!(said.contains(&message), "expected {message:?} in\n{said}");
        assert!(said.contains("allow more with `--input-memory 1GiB`"), "{said}");
    }
}

#[test]
fn what_there_is_memory_for_is_rendered() {
    let folder = Folder::new("enough");
    folder.write("scene.pbrt", SCENE);
    for renderer in ["batch", "interactive"] {
        let words = ["--renderer", renderer, "--size", "64x64", "--spp", "1"];
        let (code, said) = folder.run(1500, &render(&words));
        assert_eq!((code, said), (Some(0), String::new()), "{renderer}");
    }
}
