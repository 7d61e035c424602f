//! `cargo xtask python`: the tests of the Python package, with a build of this checkout, and those of the benchmarks
//! that are written in Python.

use std::ffi::OsString;
use std::path::{Path, PathBuf};

use crate::shell::{Command, Failure, Result, root, say};

/// The packages that the tests use, besides that of this repository.
const PACKAGES: &[&str] = &[
    "maturin>=1.9,<2",
    "numpy",
    "pytest",
    "nbclient",
    "nbformat",
    "ipykernel",
    "ipywidgets",
    "scipy",
    "mitsuba",
];

/// Those that need not have wheels for the interpreter. Tests that use them say that they are skipped.
const OPTIONAL_PACKAGES: &[&str] = &["ray>=2.9"];

/// The argument that makes the virtual environment and runs nothing: that takes a network rather than processors, so
/// other work can go on meanwhile.
const ENVIRONMENT: &str = "--environment";

/// Builds the package into a virtual environment, which is made once, and runs its tests and notebooks.
///
/// # Errors
///
/// If there is no Python, the build fails, or a test does.
pub fn run(arguments: &[String]) -> Result<()> {
    let folder = target().join("python");
    let python = environment(&folder)?;
    if arguments == [ENVIRONMENT] {
        return Ok(());
    }
    say("build of the Python package");
    // As users install it, but with the profile and features of tests, whose crates are built already.
    let install = ["-m", "pip", "install", "--quiet", "--disable-pip-version-check", "--no-deps"];
    let options = ["--no-build-isolation", "--force-reinstall", "./python"];
    let install = Command::new(&python).args(install).args(options);
    let install = install.env("MATURIN_PEP517_ARGS", "--profile dev --features rtsl-features");
    // Where pip finds maturin.
    install.env("PATH", path_with(python.parent().unwrap_or(&folder))?).run()?;
    say("tests of the Python package");
    // From the root, so that the installed package is tested and not the files in `python`.
    let all = &["python/tests", "--pyargs", "rtsl"].map(str::to_owned);
    let chosen = if arguments.is_empty() { all.as_slice() } else { arguments };
    let test = ["-m", "pytest", "-c", "python/pyproject.toml", "--rootdir", "python"];
    Command::new(&python).args(test).args(chosen).toolchain_llvm().run()?;
    if !arguments.is_empty() {
        return Ok(());
    }
    say("tests of the comparison with Mitsuba");
    let test = ["-m", "pytest", "-q", "-p", "no:cacheprovider", "bench/public/tests"];
    Command::new(&python).args(test).run()?;
    say("notebooks");
    let execute = ["python/examples/execute.py", "--check"];
    Command::new(&python).args(execute).toolchain_llvm().run()
}

/// Returns the folders of programs with one before them.
fn path_with(first: &Path) -> Result<OsString> {
    let others = std::env::var_os("PATH").unwrap_or_default();
    let folders = [first.to_owned()].into_iter().chain(std::env::split_paths(&others));
    std::env::join_paths(folders).map_err(|error| Failure(format!("PATH: {error}")))
}

/// The folder of builds.
fn target() -> PathBuf {
    std::env::var_os("CARGO_TARGET_DIR").map_or_else(|| root().join("target"), PathBuf::from)
}

/// Returns the Python of the virtual environment in a folder, which is made if it is not there.
fn environment(folder: &Path) -> Result<PathBuf> {
    let python = folder.join(if cfg!(windows) { "Scripts/python.exe" } else { "bin/python" });
    // Written at the end, so that an environment that was interrupted, or has other packages, is made again.
    let complete = folder.join("complete");
    let packages = [PACKAGES, OPTIONAL_PACKAGES].concat().join("\n");
    if std::fs::read_to_string(&complete).ok().as_ref() != Some(&packages) {
        say("virtual environment");
        let system = if cfg!(windows) { "python" } else { "python3" };
        Command::new(system).args(["-m", "venv"]).args([folder]).run()?;
        let install = ["-m", "pip", "install", "--quiet", "--disable-pip-version-check"];
        Command::new(&python).args(install).args(PACKAGES).run()?;
        if let Err(Failure(error)) =
            Command::new(&python).args(install).args(OPTIONAL_PACKAGES).run()
        {
            say(&format!("without {}: {error}", OPTIONAL_PACKAGES.join(", ")));
        }
        std::fs::write(&complete, packages)
            .map_err(|error| Failure(format!("{}: {error}", complete.display())))?;
    }
    Ok(python)
}
