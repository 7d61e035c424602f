//! Result files, which are written completely or not at all.

use std::io::Write;
use std::path::Path;

use rtsl_image::atomic_write::replace_file;

use crate::outcome::Failure;

/// Writes `contents` to `path`, or to standard output if it is `None`.
pub fn write_result(path: Option<&Path>, contents: &[u8]) -> Result<(), Failure> {
    match path {
        Some(path) => replace_file(path, |file| file.write_all(contents)).map_err(|error| {
            let message = format!("`{}`: {error}", path.display());
            Failure::Output(std::io::Error::new(error.kind(), message))
        }),
        None => {
            let mut output = std::io::stdout().lock();
            output.write_all(contents).and_then(|()| output.flush()).map_err(Failure::Output)
        }
    }
}
