//! Limits of reading scenes, and the texts of files within them.

use std::io;

/// The greatest depth of nested includes.
pub const MAX_INCLUDE_DEPTH: usize = 64;

/// The bytes of the memory budget that allow one directive from a file that was included before: files that include one
/// another twice would otherwise expand without bound.
pub const BYTES_OF_REPEATED_DIRECTIVE: u64 = 64;

/// The memory of a file's text, as a multiple of its length: the text itself and the index of its lines.
pub const TEXT_EXPANSION: usize = 5;

/// The greatest length of a text; spans are 32-bit byte offsets.
const MAX_TEXT: usize = 1 << 30;

/// The text of a file. Bytes that are not UTF-8, which files of older programs have in comments, are replaced.
pub fn text_of(bytes: Vec<u8>) -> io::Result<String> {
    if bytes.len() > MAX_TEXT {
        return Err(io::Error::other("larger than 1 GiB"));
    }
    Ok(String::from_utf8(bytes)
        .unwrap_or_else(|error| String::from_utf8_lossy(error.as_bytes()).into_owned()))
}
