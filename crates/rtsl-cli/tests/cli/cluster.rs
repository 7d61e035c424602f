//! `rtsl render --cluster`, with interpreters of Python that are scripts. The tests of the Python package render.

use std::os::unix::fs::PermissionsExt;
use std::process::Output;

use crate::command::{DONE, Folder, INPUT_AT_FAULT, WRONG_USAGE, rtsl};

/// Runs the command with a script as the interpreter.
fn run(folder: &Folder, script: &str, arguments: &[&str]) -> Output {
    let python = folder.0.path().join("python");
    std::fs::write(&python, format!("#!/bin/sh\n{script}")).unwrap();
    std::fs::set_permissions(&python, std::fs::Permissions::from_mode(0o755)).unwrap();
    let mut command = rtsl();
    command.args(["render", "scene.pbrt", "-o", "a.exr", "--cluster", "auto"]).args(arguments);
    command.current_dir(&folder.0).env("RTSL_PYTHON", python).env_remove("RTSL_PATH");
    command.output().unwrap()
}

/// An interpreter with these versions of the packages, which writes its arguments to a file.
fn interpreter(own: &str, ray: &str) -> String {
    format!(
        "if [ \"$1\" = -c ]; then printf '{own}\\n{ray}\\n'; else printf '%s\\n' \"$@\" > arguments; fi\n"
    )
}

fn code(output: &Output) -> i32 {
    output.status.code().expect("the command was not killed")
}

#[test]
fn options_are_those_of_the_package() {
    let folder = Folder::new("cluster");
    let version = env!("CARGO_PKG_VERSION");
    let script = interpreter(version, "2.60.0");
    let given = ["--spp", "7", "--size", "30x20", "-D", "x.y=-1", "-I", "parts", "--resume"];
    let given = [&given[..], &["--aov", "distance,normal", "--time", "1.5", "--exr", "half"]];
    let ran = run(&folder, &script, &given.concat());
    assert_eq!(code(&ran), DONE, "{}", String::from_utf8_lossy(&ran.stderr));
    let arguments = std::fs::read_to_string(folder.0.path().join("arguments")).unwrap();
    let expected = format!(
        "-m rtsl.cluster --version-of-command {version} --output=a.exr --spp=7 --size=30x20 \
         --aov=distance,normal --define=x.y=-1 --include=parts --time=1.5 --checkpoint-every=30 --resume \
         --exposure=0 --view=standard --exr=half --backend=auto --math=contract -- auto scene.pbrt"
    );
    assert_eq!(arguments.lines().collect::<Vec<_>>().join(" "), expected);
    // The package says why it fails.
    let script = script.replace("> arguments", "> arguments; exit 1");
    assert_eq!(code(&run(&folder, &script, &[])), INPUT_AT_FAULT);
}

#[test]
fn what_is_missing_is_said() {
    let folder = Folder::new("cluster-missing");
    let version = env!("CARGO_PKG_VERSION");
    let says = |script: &str, expected: &str| {
        let ran = run(&folder, script, &[]);
        let errors = String::from_utf8_lossy(&ran.stderr);
        assert_eq!(code(&ran), INPUT_AT_FAULT, "{errors}");
        assert!(errors.contains("error[E0709]") && errors.contains(expected), "{errors}");
    };
    says(&interpreter("", "2.60.0"), "has no package `rtsl`");
    says(&interpreter("77.0.0", "2.60.0"), "has version 77.0.0 of the package `rtsl`");
    says(&interpreter(version, ""), "has no package `ray`");
    says("exit 3", "has no package `rtsl`");
    let mut command = rtsl();
    command.args(["render", "scene.pbrt", "-o", "a.exr", "--cluster", "auto"]);
    let ran = command.current_dir(&folder.0).env("RTSL_PYTHON", "no-such-python").output().unwrap();
    let errors = String::from_utf8_lossy(&ran.stderr);
    assert!(errors.contains("cannot start the interpreter `no-such-python`"), "{errors}");
}

#[test]
fn options_of_this_machine_are_refused() {
    let folder = Folder::new("cluster-refused");
    for option in [
        "--denoise",
        "--optimise=first",
        "--interleave=2",
        "--input-memory=1GiB",
        "--texture-memory=1GiB",
        "--pixel=1,1",
    ] {
        let arguments = ["render", "scene.pbrt", "--cluster", "auto", option];
        let output = if option.starts_with("--pixel") { &[][..] } else { &["-o", "a.exr"] };
        let ran = folder.run(&[&arguments[..], output].concat()).exits(WRONG_USAGE);
        let (name, errors) = (option.split('=').next().unwrap_or(option), ran.errors());
        assert!(errors.contains(name) && errors.contains("cannot be used with"), "{errors}");
    }
}
