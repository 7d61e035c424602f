//! `cargo xtask python`: the tests of the Python package, with a build of this checkout.

use std::path::{Path, PathBuf};

use crate::shell::{Command, Failure, Result, root, say};

/// What the tests use, besides the package.
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

/// Builds the package into a virtual environment, which is made once, and runs its tests and notebooks.
///
/// # Errors
///
/// If there is no Python, the build fails, or a test does.
pub fn run(arguments: &[String]) -> Result<()> {
    let folder = target().join("python");
    let python = environment(&folder)?;
    say("build of the Python package");
    let wheels = folder.join("wheels");
    let _ = std::fs::remove_dir_all(&wheels);
    let manifest = root().join("crates/rtsl-python/Cargo.toml");
    let build = ["-m", "maturin", "build", "--quiet", "--profile", "dev", "--manifest-path"];
    Command::new(&python).args(build).args([&manifest]).args(["--out"]).args([&wheels]).run()?;
    let wheel = only_wheel(&wheels)?;
    let install = ["-m", "pip", "install", "--quiet", "--no-deps", "--force-reinstall"];
    Command::new(&python).args(install).args([&wheel]).run()?;
    say("tests of the Python package");
    // From the root, so that the installed package is tested and not the files in `python`.
    let all: &[String] = &["python/tests".to_owned()];
    let chosen = if arguments.is_empty() { all } else { arguments };
    let test = ["-m", "pytest", "-c", "python/pyproject.toml", "--rootdir", "python"];
    Command::new(&python).args(test).args(chosen).toolchain_llvm().run()?;
    if !arguments.is_empty() {
        return Ok(());
    }
    say("notebooks");
    let execute = ["python/examples/execute.py", "--check"];
    Command::new(&python).args(execute).toolchain_llvm().run()
}

/// The folder of builds.
fn target() -> PathBuf {
    std::env::var_os("CARGO_TARGET_DIR").map_or_else(|| root().join("target"), PathBuf::from)
}

/// Returns the Python of the virtual environment in a folder, which is made if it is not there.
fn environment(folder: &Path) -> Result<PathBuf> {
    let python = folder.join(if cfg!(windows) { "Scripts/python.exe" } else { "bin/python" });
    // Written at the end, so that an environment that was interrupted is made again.
    let complete = folder.join("complete");
    if !complete.exists() {
        say("virtual environment");
        let system = if cfg!(windows) { "python" } else { "python3" };
        Command::new(system).args(["-m", "venv"]).args([folder]).run()?;
        let install = ["-m", "pip", "install", "--quiet", "--disable-pip-version-check"];
        Command::new(&python).args(install).args(PACKAGES).run()?;
        std::fs::write(&complete, PACKAGES.join("\n"))
            .map_err(|error| Failure(format!("{}: {error}", complete.display())))?;
    }
    Ok(python)
}

/// Returns the wheel that was built.
fn only_wheel(folder: &Path) -> Result<PathBuf> {
    let files = std::fs::read_dir(folder);
    let files = files.map_err(|error| Failure(format!("{}: {error}", folder.display())))?;
    let mut wheels = files.flatten().map(|file| file.path());
    wheels.next().ok_or_else(|| Failure(format!("{} has no wheel", folder.display())))
}
