//! The formatter: one style for the white space and the line breaks of RTSL text.
//!
//! The result has the tokens, comments and directives of the text, in their order. Formatting it again changes nothing.
//! The formatter reads the text before preprocessing, so files that cannot be parsed alone, such as headers for
//! `#include`, are formatted too; it needs paired brackets and no more.
//!
//! # Style
//!
//! - Lines have at most 120 columns and are indented by four columns for each block; `case` stands below `switch`.
//! - Statements that fit on a line are on one line. `layout` has the rules for others.
//! - Blocks and bodies of control statements stay on one line where their author wrote them on one, if they fit.
//! - At most one blank line stands between lines, and none at the ends of blocks.
//! - Comments are kept as they are and indented like what follows them; those at the ends of consecutive lines are
//!   aligned. Directives begin in the first column and are kept as they are.
//!
//! # Source
//!
//! `token` splits the text, `balance` checks its brackets, `item` finds statements and `node` the structure of
//! each; `printer` writes items, `layout` what does not fit on a line, and `lines` keeps the result.

mod balance;
mod item;
mod layout;
mod lines;
mod node;
mod printer;
mod token;

use rtsl_source::{Diagnostic, FileId, Span, deep_stack, diagnostic_codes as codes};
use rtsl_syntax::raw::first_lexical_error;

/// The greatest number of columns of a line.
pub const MAX_WIDTH: usize = 120;
/// The number of columns by which a block is indented.
pub const INDENT: usize = 4;

/// Formats `text`, the text of `file`.
///
/// # Errors
/// If a piece of the text is not a token, if brackets do not pair, and if the text is nested more deeply than the
/// compiler accepts.
pub fn format(file: FileId, text: &str) -> Result<String, Box<Diagnostic>> {
    if let Some(error) = first_lexical_error(file, text) {
        return Err(Box::new(error));
    }
    deep_stack::run(|| {
        let tokens = token::tokens(text);
        balance::check_balance(file, &tokens)?;
        let printed = item::items(&tokens).and_then(|items| printer::print(&tokens, &items));
        let formatted = printed.ok_or_else(|| too_deep(file))?;
        match has_same_tokens(&tokens, &formatted) {
            true => Ok(formatted),
            false => Err(Box::new(changes_tokens(file))),
        }
    })
}

/// True if `formatted` has these tokens.
fn has_same_tokens(tokens: &[token::Token<'_>], formatted: &str) -> bool {
    let after = token::tokens(formatted);
    let same = |(left, right): (&token::Token<'_>, &token::Token<'_>)| left.text == right.text;
    tokens.len() == after.len() && tokens.iter().zip(&after).all(same)
}

fn too_deep(file: FileId) -> Diagnostic {
    let message = format!("nested more than {} deep", deep_stack::MAX_DEPTH);
    Diagnostic::new(codes::NESTED_TOO_DEEPLY, message).at(Span::new(file, 0, 0), "in this file")
}

/// A fault of the formatter, told instead of damaging a file.
fn changes_tokens(file: FileId) -> Diagnostic {
    Diagnostic::new(codes::UNFORMATTABLE, "the formatter would change more than white space")
        .at(Span::new(file, 0, 0), "in this file")
        .help("this is a fault of the formatter; please report it with the text")
}
