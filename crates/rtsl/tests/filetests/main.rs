//! Runs the tests of the folder `tests/` in the repository's root, one file each: input, mode and
//! expectation stand in one file. `UPDATE_EXPECT=1` writes the expectations. See `tests/README.md`.
//!
//! A separate test program, since it has its own harness.

mod file;
mod modes;

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use libtest_mimic::{Arguments, Failed, Trial};

use file::TestFile;

fn main() -> ExitCode {
    let arguments = Arguments::from_args();
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../tests");
    let mut paths = Vec::new();
    find_tests(&root, &mut paths);
    paths.sort();
    let trials = paths.into_iter().map(|path| {
        let name = path.strip_prefix(&root).unwrap_or(&path).display().to_string();
        Trial::test(name, move || run(&path))
    });
    libtest_mimic::run(&arguments, trials.collect()).exit_code()
}

/// The folder with scenes and pictures, which the tests of `rtsl-render` compare.
const GALLERY: &str = "gallery";

/// All files below `folder`, the texts about tests and the gallery excepted.
fn find_tests(folder: &Path, paths: &mut Vec<PathBuf>) {
    let entries = std::fs::read_dir(folder).expect("the folder of tests can be read");
    for entry in entries {
        let path = entry.expect("the folder of tests can be read").path();
        if path.is_dir() {
            if !path.ends_with(GALLERY) {
                find_tests(&path, paths);
            }
        } else if path.extension().is_some_and(|extension| extension != "md") {
            paths.push(path);
        }
    }
}

fn run(path: &Path) -> Result<(), Failed> {
    let text = std::fs::read_to_string(path)?;
    let test = TestFile::parse(&text)?;
    let mode = modes::find(&test.mode).ok_or_else(|| {
        let known: Vec<&str> = modes::MODES.iter().map(|mode| mode.name).collect();
        format!("unknown mode `{}`; the modes are {}", test.mode, known.join(", "))
    })?;
    let actual = (mode.run)(&test)?;
    if std::env::var_os("UPDATE_EXPECT").is_some() {
        let blessed = test.with_expectation(&actual);
        if blessed != text {
            std::fs::write(path, blessed)?;
        }
        return Ok(());
    }
    test.compare(&actual)
}
