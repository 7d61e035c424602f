//! The formatter: its style, and what holds for every text.

mod properties;
mod style;

use rtsl_source::{FileId, SourceMap, render};

/// Formats a text that has no errors.
fn formatted(text: &str) -> String {
    rtsl_format::format(FileId(0), text).unwrap_or_else(|error| panic!("{error:?}:\n{text}"))
}

/// Returns the error of a text that cannot be formatted, as the command prints it.
fn error_of(text: &str) -> String {
    let mut sources = SourceMap::new();
    let file = sources.add("test.rtsl", text);
    let error = rtsl_format::format(file, text).expect_err("it has an error");
    render::all_to_text(&sources, [&*error], false)
}
