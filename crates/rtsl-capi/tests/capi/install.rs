//! C programs build with the files that the script installs: by pkg-config, with versioned symbols and nothing else.

use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use rtsl_testing::turns::is_long_run;

use crate::compiler::{has_compiler, repository, static_library};

#[test]
fn an_installed_library_serves_programs() {
    if !has_compiler() {
        return;
    }
    let prefix = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join("prefix");
    let script = repository().join("crates/rtsl-capi/install.sh");
    let mut install = Command::new("bash");
    install.arg(&script);
    if is_long_run() {
        install.args(["--profile", "dev"]);
    } else {
        // Cargo would build it again, with the features that this package needs alone.
        install.arg("--archive").arg(static_library());
    }
    run(install.arg(&prefix));
    assert_eq!(Command::new("bash").arg(&script).output().unwrap().status.code(), Some(2));

    let library = prefix.join("lib/librtsl.so");
    if let Ok(symbols) =
        Command::new("nm").args(["-D", "--with-symbol-versions"]).arg(&library).output()
    {
        check_symbols(&String::from_utf8_lossy(&symbols.stdout));
    }
    let flags = flags(&prefix);
    let program = prefix.join("ray_tracer");
    let source = repository().join("integrations/hosts/ray_tracer.c");
    run(Command::new("cc").arg(source).args(flags).args(["-lm", "-o"]).arg(&program));
    let usage = Command::new(program).env("LD_LIBRARY_PATH", prefix.join("lib")).output().unwrap();
    assert_eq!(usage.status.code(), Some(2), "{}", String::from_utf8_lossy(&usage.stderr));
}

/// All that is shown is the interface.
fn check_symbols(symbols: &str) {
    let defined = symbols.lines().filter(|line| line.contains(" T "));
    let mut count = 0;
    for line in defined {
        let name = line.split_whitespace().last().unwrap_or_default();
        assert!(name.starts_with("rtsl_") && name.ends_with("@@RTSL_1"), "{line}");
        count += 1;
    }
    assert!(count > 30, "{count} functions");
}

/// Of pkg-config, or where there is none, what it would say.
fn flags(prefix: &Path) -> Vec<String> {
    let folder = prefix.join("lib/pkgconfig");
    let asked = Command::new("pkg-config")
        .env("PKG_CONFIG_PATH", folder)
        .args(["--cflags", "--libs", "rtsl"])
        .output();
    match asked {
        Ok(output) if output.status.success() => {
            let text = String::from_utf8_lossy(&output.stdout).into_owned();
            text.split_whitespace().map(str::to_owned).collect()
        }
        _ => {
            let prefix = prefix.display();
            vec![format!("-I{prefix}/include"), format!("-L{prefix}/lib"), "-lrtsl".to_owned()]
        }
    }
}

fn run(command: &mut Command) -> Output {
    let output = command.output().expect("it runs");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    output
}
