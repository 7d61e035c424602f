//! Texts that commands read, and result files, which are written completely or not at all.

use std::io::{Read, Write};
use std::path::Path;

use rtsl::{Diagnostic, diagnostic_codes as codes, encoding};
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

/// Reads a text of at most `limit` bytes.
///
/// # Errors
/// If the file cannot be read, is longer, or is not UTF-8.
pub fn read_text(path: &Path, limit: u64) -> Result<String, Failure> {
    let opened = std::fs::File::open(path);
    text_of(opened.map_err(|error| unreadable(path, &error.to_string()))?, path, limit)
}

/// Reads a text of at most `limit` bytes; diagnostics call it `path`.
///
/// # Errors
/// As [`read_text`].
pub fn text_of(input: impl Read, path: &Path, limit: u64) -> Result<String, Failure> {
    let mut bytes = Vec::new();
    let length = input.take(limit + 1).read_to_end(&mut bytes);
    let length = length.map_err(|error| unreadable(path, &error.to_string()))?;
    if length as u64 > limit {
        return Err(unreadable(path, &format!("it is longer than {limit} bytes")));
    }
    encoding::utf8(bytes).map_err(|problem| unreadable(path, problem))
}

/// The diagnostic of a file or folder that cannot be read.
pub fn unreadable(path: &Path, reason: &str) -> Failure {
    let message = format!("`{}` cannot be read: {reason}", path.display());
    Failure::from(Diagnostic::new(codes::UNREADABLE_FILE, message))
}
