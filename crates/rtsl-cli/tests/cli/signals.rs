//! Signals that end a render: its picture and its checkpoint are written.

use std::os::unix::fs::PermissionsExt;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use crate::command::{Folder, INPUT_AT_FAULT, ball_scene, rtsl};

/// Starts the render by a command line of `sh`, in which `rtsl` is the program.
fn start(folder: &Folder, line: &str) -> Child {
    // It takes hours.
    folder.write("scene.pbrt", ball_scene([64, 64], 65536));
    let program = env!("CARGO_BIN_EXE_rtsl");
    let render = format!("{program} render scene.pbrt -o a.png --threads 1 --backend interp");
    let mut command = Command::new("sh");
    command.args(["-c", &line.replace("rtsl", &render)]).current_dir(&folder.0);
    command.stdout(Stdio::null()).stderr(Stdio::piped()).spawn().expect("it runs")
}

/// Waits until the process has a handler for `SIGTERM`, so that a signal does not come too early.
fn wait_for_handler(child: &Child) {
    let begun = Instant::now();
    loop {
        let status = std::fs::read_to_string(format!("/proc/{}/status", child.id()));
        let status = status.expect("the process is there");
        let caught = status.lines().find_map(|line| line.strip_prefix("SigCgt:")).unwrap_or("0");
        if u64::from_str_radix(caught.trim(), 16).is_ok_and(|caught| caught >> 14 & 1 == 1) {
            return;
        }
        assert!(begun.elapsed() < Duration::from_secs(60), "there is no handler");
        std::thread::sleep(Duration::from_millis(5));
    }
}

fn send(child: &Child, signal: &str) {
    let line = format!("kill -{signal} {}", child.id());
    assert!(Command::new("sh").args(["-c", &line]).status().expect("it runs").success());
}

/// Waits for the end, which leaves a picture and a checkpoint.
fn ends_in_order(folder: &Folder, child: Child) {
    let output = child.wait_with_output().expect("it ends");
    let said = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(INPUT_AT_FAULT), "{said}");
    assert!(said.contains("--resume"), "{said}");
    for name in ["a.png", "a.png.checkpoint"] {
        assert!(folder.0.path().join(name).exists(), "{name}: {said}");
        std::fs::remove_file(folder.0.path().join(name)).expect("it is there");
    }
}

/// `timeout` sends its signal twice: to the process, and to its group.
#[test]
fn signals_end_a_render_in_order() {
    let folder = Folder::new("signals");
    for signal in ["TERM", "HUP", "INT"] {
        let child = start(&folder, "exec env --default-signal=TERM,HUP,INT rtsl");
        wait_for_handler(&child);
        send(&child, signal);
        if signal != "INT" {
            send(&child, signal);
        }
        ends_in_order(&folder, child);
    }
}

/// A render under `nohup` goes on when its terminal is closed.
#[test]
fn a_signal_that_is_ignored_stays_ignored() {
    let folder = Folder::new("nohup");
    let mut child = start(&folder, "trap '' HUP; exec rtsl");
    wait_for_handler(&child);
    send(&child, "HUP");
    std::thread::sleep(Duration::from_millis(200));
    assert!(child.try_wait().expect("it is ours").is_none(), "it goes on");
    send(&child, "TERM");
    ends_in_order(&folder, child);
}

/// With `--cluster`, the interpreter takes the place of the command, so that signals reach it.
#[test]
fn signals_reach_the_interpreter_of_a_cluster() {
    let folder = Folder::new("cluster-signals");
    let path = |name: &str| folder.0.path().join(name);
    let version = env!("CARGO_PKG_VERSION");
    let script = format!(
        "#!/bin/sh\nif [ \"$1\" = -c ]; then printf '{version}\\n2.60.0\\n'; exit; fi\n\
         trap 'touch told; exit 1' TERM\ntouch started\nwhile :; do sleep 0.05; done\n"
    );
    folder.write("python", &script);
    let executable = std::fs::Permissions::from_mode(0o755);
    std::fs::set_permissions(path("python"), executable).expect("it is ours");
    let mut command = rtsl();
    command.args(["render", "scene.pbrt", "-o", "a.exr", "--cluster", "auto"]);
    command.current_dir(&folder.0).env("RTSL_PYTHON", path("python"));
    let mut child = command.spawn().expect("it runs");
    let begun = Instant::now();
    while !path("started").exists() {
        assert!(begun.elapsed() < Duration::from_secs(60), "the interpreter does not start");
        std::thread::sleep(Duration::from_millis(5));
    }
    send(&child, "TERM");
    assert_eq!(child.wait().expect("it ends").code(), Some(INPUT_AT_FAULT));
    assert!(path("told").exists());
}
