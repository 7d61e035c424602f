//! Limits of reading scenes, and the texts of files within them.

use std::io;
use std::path::{Path, PathBuf};

use rtsl::{Diagnostic, Span, diagnostic_codes as codes, encoding};
use rtsl_memory::{Amount, InputBudget};

use super::files::{FileSource, Input, resolve};

/// The greatest depth of nested includes.
pub const MAX_INCLUDE_DEPTH: usize = 64;

/// The bytes of the memory budget that allow one directive from a file that was included before: files that include one
/// another twice would otherwise expand without bound.
const BYTES_OF_REPEATED_DIRECTIVE: u64 = 64;

/// The memory of a file's text, as a multiple of its length: the text itself and the index of its lines.
const TEXT_EXPANSION: usize = 5;

/// The greatest length of a text; spans are 32-bit byte offsets.
const MAX_TEXT: usize = 1 << 30;

/// The text of a file. Bytes that are not UTF-8, which files of older programs have in comments, are replaced.
fn text_of(bytes: Vec<u8>) -> io::Result<String> {
    if bytes.len() > MAX_TEXT {
        return Err(io::Error::other("larger than 1 GiB"));
    }
    encoding::check_width(&bytes).map_err(io::Error::other)?;
    Ok(String::from_utf8(bytes)
        .unwrap_or_else(|error| String::from_utf8_lossy(error.as_bytes()).into_owned()))
}

/// Reads the text of a file, if the budget allows it.
///
/// # Errors
/// As for [`Input::read`], or if the text is too long.
pub fn read_text(files: &dyn FileSource, path: &Path, budget: &InputBudget) -> io::Result<String> {
    let Input { bytes, mut held } = Input::read(files, path, budget)?;
    let amount = Amount(bytes.len() as u64).times(TEXT_EXPANSION);
    held.grow_to(amount)?;
    held.keep(amount);
    text_of(bytes)
}

/// The path of an included file: relative to the folder of the main file as in pbrt, or if there is none, relative to
/// the file that includes it.
pub fn included_path(
    name: &str,
    main: &Path,
    including: Option<&PathBuf>,
    exists: impl Fn(&Path) -> bool,
) -> PathBuf {
    let beside = resolve(including.map_or(main, PathBuf::as_path), name);
    let main = resolve(main, name);
    if !exists(&main) && exists(&beside) { beside } else { main }
}

/// The number of directives from files that were included before.
#[derive(Default)]
pub struct RepeatedDirectives(u64);

impl RepeatedDirectives {
    /// Counts one more.
    ///
    /// # Errors
    /// If it is beyond the limit, with a diagnostic for the first one that is.
    pub fn count(&mut self, budget: &InputBudget, span: Span) -> Result<(), Option<Diagnostic>> {
        let limit = budget.limit().0 / BYTES_OF_REPEATED_DIRECTIVE;
        self.0 += 1;
        if self.0 <= limit {
            return Ok(());
        }
        let message = format!("files included more than once give more than {limit} directives");
        let diagnostic = Diagnostic::new(codes::SCENE_LIMIT, message)
            .at(span, "reading stops before this one")
            .help("place repeated parts with `ObjectInstance`");
        Err((self.0 == limit + 1).then_some(diagnostic))
    }
}
