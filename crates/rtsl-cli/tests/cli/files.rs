//! Targets of `-o` and `--checkpoint`: real files, links, pipes and processes.

use std::path::Path;
use std::process::{Child, Command, Output, Stdio};

use crate::command::{Folder, ball_scene, rtsl};

/// A folder with a scene.
fn scene_folder(name: &str) -> Folder {
    let folder = Folder::new(name);
    folder.write("scene.pbrt", ball_scene([24, 16], 32));
    folder
}

/// A render by the interpreter, which starts at once.
fn render(folder: &Folder, output: &str) -> Command {
    let mut command = rtsl();
    command.arg("render").arg(folder.path("scene.pbrt")).arg("-o").arg(folder.path(output));
    command.args(["--threads", "1", "--backend", "interp"]);
    command.stdout(Stdio::null()).stderr(Stdio::piped());
    command
}

/// The same with a checkpoint that is written after every wave.
fn kept(folder: &Folder, output: &str, checkpoint: &str) -> Command {
    let mut command = render(folder, output);
    command.arg("--checkpoint").arg(folder.path(checkpoint)).args(["--checkpoint-every", "0"]);
    command
}

fn run(command: &mut Command) -> (Option<i32>, String) {
    let output = command.output().expect("it runs");
    (output.status.code(), text(&output))
}

fn text(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

fn ended(child: Child) -> (Option<i32>, String) {
    let output = child.wait_with_output().expect("it ends");
    (output.status.code(), text(&output))
}

fn refused(command: &mut Command, expected: &[&str]) {
    let (code, said) = run(command);
    assert_eq!(code, Some(1), "{said}");
    for part in expected {
        assert!(said.contains(part), "expected {part:?} in\n{said}");
    }
}

#[test]
fn two_renders_of_a_scene_share_a_checkpoint() {
    let folder = scene_folder("shared");
    assert_eq!(run(&mut render(&folder, "whole.exr")).0, Some(0));
    for round in 0..3 {
        let spawn = |output| kept(&folder, output, "shared.checkpoint").spawn().expect("it runs");
        for (code, said) in [spawn("a.exr"), spawn("b.exr")].map(ended) {
            assert_eq!(code, Some(0), "round {round}: {said}");
        }
        let mut resumed = kept(&folder, "resumed.exr", "shared.checkpoint");
        assert_eq!(run(resumed.arg("--resume")), (Some(0), String::new()), "round {round}");
        assert!(folder.bytes("resumed.exr") == folder.bytes("whole.exr"), "round {round}");
    }
}

#[test]
fn of_two_different_renders_one_keeps_the_checkpoint() {
    let folder = scene_folder("contended");
    let spawn = |output: &str, seed: &str| {
        let mut command = kept(&folder, output, "contended.checkpoint");
        command.args(["--seed", seed]).spawn().expect("it runs")
    };
    let (first, second) = (spawn("1.exr", "1"), spawn("2.exr", "2"));
    let ends = [ended(first), ended(second)];
    let losers: Vec<&(Option<i32>, String)> =
        ends.iter().filter(|(code, _)| *code != Some(0)).collect();
    let [(code, said)] = losers[..] else { panic!("{ends:?}") };
    assert_eq!(*code, Some(1));
    assert!(said.contains("error[E0640]") && said.contains("seed"), "{said}");
    let winner = if ends[0].0 == Some(0) { "1" } else { "2" };
    let mut resumed = kept(&folder, "resumed.exr", "contended.checkpoint");
    assert_eq!(run(resumed.args(["--resume", "--seed", winner])).0, Some(0));
}

#[test]
fn what_is_not_the_renders_checkpoint_is_kept() {
    let folder = scene_folder("occupied");
    std::fs::write(folder.path("notes.txt"), "a year's work").expect("notes");
    let remedy = "delete it, or name another file with `--checkpoint`";
    refused(
        &mut kept(&folder, "a.exr", "notes.txt"),
        &["error[E0640]", "notes.txt` is not overwritten: it is not a checkpoint", remedy],
    );
    assert_eq!(folder.bytes("notes.txt"), b"a year's work");
    assert!(!folder.path("a.exr").exists(), "nothing was rendered");
    let (code, said) = run(kept(&folder, "a.exr", "a.checkpoint").args(["--seed", "1"]));
    assert_eq!(code, Some(0), "{said}");
    let first = folder.bytes("a.checkpoint");
    refused(
        kept(&folder, "b.exr", "a.checkpoint").args(["--seed", "2"]),
        &[
            "error[E0640]",
            "it is the checkpoint of another render: the checkpoint has seed 1, the render seed 2",
            remedy,
        ],
    );
    assert!(folder.bytes("a.checkpoint") == first);
    // Its own it may begin anew, and a file without bytes is nobody's.
    assert_eq!(run(kept(&folder, "a.exr", "a.checkpoint").args(["--seed", "1"])).0, Some(0));
    std::fs::write(folder.path("empty"), "").expect("an empty file");
    assert_eq!(run(&mut kept(&folder, "a.exr", "empty")).0, Some(0));
}

/// The checkpoint beside the picture is written only where a render ends early: it is warned of, and then missed.
#[test]
fn a_stale_checkpoint_beside_the_picture_is_said_first_and_kept() {
    let folder = scene_folder("stale");
    let early = |seed| {
        let mut command = render(&folder, "a.exr");
        command.args(["--time", "0", "--seed", seed]);
        command
    };
    assert_eq!(run(&mut early("1")).0, Some(0));
    let stale = folder.bytes("a.exr.checkpoint");
    refused(&mut early("2"), &["warning[W0640]", "seed", "error[E0640]"]);
    assert!(folder.bytes("a.exr.checkpoint") == stale);
    let (code, said) = run(render(&folder, "a.exr").args(["--seed", "2"]));
    assert!(code == Some(0) && said.contains("warning[W0640]"), "{said}");
    assert!(folder.bytes("a.exr.checkpoint") == stale);
}

#[cfg(unix)]
#[test]
fn links_are_followed_to_files() {
    let folder = scene_folder("links");
    std::fs::create_dir(folder.path("below")).expect("a folder");
    std::os::unix::fs::symlink("below/a.exr", folder.path("a.exr")).expect("a link");
    std::os::unix::fs::symlink("below/a.checkpoint", folder.path("a.checkpoint")).expect("a link");
    for _ in 0..2 {
        let (code, said) = run(&mut kept(&folder, "a.exr", "a.checkpoint"));
        assert_eq!(code, Some(0), "{said}");
        for name in ["a.exr", "a.checkpoint"] {
            assert!(folder.path(name).is_symlink() && folder.path("below").join(name).is_file());
        }
    }
}

#[cfg(unix)]
#[test]
fn pipes_take_pictures_and_no_checkpoints() {
    use std::os::unix::fs::FileTypeExt;
    let folder = scene_folder("pipes");
    assert_eq!(run(&mut render(&folder, "whole.exr")).0, Some(0));
    let pipe = folder.path("pipe.exr");
    let made = Command::new("mkfifo").arg(&pipe).status().expect("mkfifo runs");
    assert!(made.success());
    let is_pipe =
        |path: &Path| std::fs::metadata(path).is_ok_and(|metadata| metadata.file_type().is_fifo());
    let read = std::fs::File::create(folder.path("read")).expect("a file");
    let mut reader = Command::new("cat").arg(&pipe).stdout(read).spawn().expect("cat runs");
    assert_eq!(run(&mut render(&folder, "pipe.exr")), (Some(0), String::new()));
    if !is_pipe(&pipe) {
        // It waits for a writer that never comes.
        reader.kill().expect("it can be killed");
    }
    assert!(reader.wait().expect("it ends").success(), "the pipe was replaced");
    assert!(folder.bytes("read") == folder.bytes("whole.exr"));
    refused(
        &mut kept(&folder, "a.exr", "pipe.exr"),
        &["error[E0623]", "it is a device or a pipe, expected a file"],
    );
    assert!(is_pipe(&pipe), "the pipe is still one");
}

#[cfg(target_os = "linux")]
#[test]
fn results_go_to_devices_and_open_files() {
    let folder = scene_folder("devices");
    // By links: were they replaced, the machine would keep its devices.
    let link = |target: &str, name: &str| {
        std::os::unix::fs::symlink(target, folder.path(name)).expect("a link");
        folder.path(name)
    };
    let (stdout, full) = (link("/dev/stdout", "stdout"), link("/dev/full", "full"));
    let mut command = render(&folder, "a.exr");
    command.arg("--stats").arg(&stdout).stdout(Stdio::piped());
    let output = command.output().expect("it runs");
    let said = String::from_utf8_lossy(&output.stdout).into_owned();
    assert!(output.status.success() && said.contains("\"render_seconds\""), "{said}");
    // The shell's file gets it too, behind what stands there.
    let file = std::fs::File::create(folder.path("log")).expect("a file");
    let mut command = render(&folder, "a.exr");
    command.arg("--stats").arg(&stdout).stdout(file);
    assert_eq!(run(&mut command).0, Some(0));
    assert!(folder.bytes("log").starts_with(b"{"));
    assert!(stdout.is_symlink());
    let (code, said) = run(kept(&folder, "a.exr", "a.checkpoint").arg("--stats").arg(&full));
    assert!(code == Some(1) && said.contains("No space left"), "{said}");
}
