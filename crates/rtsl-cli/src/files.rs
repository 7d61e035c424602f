//! Results, written whole or not at all.

use std::io::Write;
use std::path::{Path, PathBuf};

use crate::commands::Failure;

/// Writes `contents` to `path`, or to standard output where there is none.
pub fn write_result(path: Option<&Path>, contents: &[u8]) -> Result<(), Failure> {
    match path {
        Some(path) => write_file(path, contents).map_err(|error| {
            let message = format!("`{}`: {error}", path.display());
            Failure::Output(std::io::Error::new(error.kind(), message))
        }),
        None => {
            let mut output = std::io::stdout().lock();
            output.write_all(contents).and_then(|()| output.flush()).map_err(Failure::Output)
        }
    }
}

/// Writes beside the file and renames, so that nobody ever finds half of it.
fn write_file(path: &Path, contents: &[u8]) -> std::io::Result<()> {
    // A device or a pipe can't be replaced.
    if path.exists() && !path.is_file() {
        return std::fs::write(path, contents);
    }
    let beside = name_beside(path);
    let written = std::fs::write(&beside, contents).and_then(|()| std::fs::rename(&beside, path));
    if written.is_err() {
        let _ = std::fs::remove_file(&beside);
    }
    written
}

fn name_beside(path: &Path) -> PathBuf {
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    path.with_file_name(format!(".{name}.{}", std::process::id()))
}
