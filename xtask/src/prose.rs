//! Rules for prose that a program can check: the length of lines, and the openings of titles and of comments.

use std::fmt::Write;

use crate::shell::{self, Failure, Result};

/// Columns of a line of Markdown or of a comment. Tables and lines of one long word, such as an address, may be longer.
const MAX_COLUMNS: usize = 120;

/// Characters of a title. The titles of diagnostics are one-line descriptions, and may be longer.
const MAX_TITLE: usize = 60;

/// A title names its content, and a comment its subject: neither opens with a question.
const QUESTIONS: [&str; 8] = ["What", "Which", "Whether", "How", "Where", "Who", "Why", "When"];

/// Folders whose comments are not checked: those of `rtsl-capi` are the comments of `rtsl.h`, which changes only with a
/// version of the interface.
const EXEMPT: [&str; 1] = ["crates/rtsl-capi/src/"];

/// Checks all Markdown and all Rust that Git tracks.
///
/// # Errors
///
/// If a line breaks a rule; the message lists each with its place.
pub fn check() -> Result<()> {
    let mut findings = String::new();
    for path in shell::tracked_files(&["*.md", "*.rs"])? {
        let text =
            std::fs::read_to_string(&path).map_err(|error| Failure(format!("{path}: {error}")))?;
        let found = match path.ends_with(".md") {
            true => markdown(&text),
            false if EXEMPT.iter().any(|it| path.starts_with(it)) => Vec::new(),
            false => comments(&text),
        };
        for (line, problem) in found {
            writeln!(findings, "{path}:{line}: {problem}").expect("strings take all text");
        }
    }
    match findings.is_empty() {
        true => Ok(()),
        false => Err(Failure(format!("prose:\n{findings}"))),
    }
}

/// The problems of a page, each with its line.
fn markdown(text: &str) -> Vec<(usize, String)> {
    let mut found = Vec::new();
    let mut in_code = false;
    for (line, number) in text.lines().zip(1..) {
        if line.trim_start().starts_with("```") {
            in_code = !in_code;
        }
        if in_code {
            continue;
        }
        let is_code = line.starts_with("    ");
        found.extend((!is_code).then(|| long(line)).flatten().map(|it| (number, it)));
        found.extend(title(line).and_then(title_problem).map(|it| (number, it)));
    }
    found
}

/// The problems of the comments of a Rust file, each with its line.
fn comments(text: &str) -> Vec<(usize, String)> {
    let mut found = Vec::new();
    let mut in_documentation = false;
    for (line, number) in text.lines().zip(1..) {
        let line = line.trim_start();
        let documentation = line.strip_prefix("///").or_else(|| line.strip_prefix("//!"));
        if line.starts_with("//") {
            found.extend(long(line).map(|it| (number, it)));
        }
        if let Some(opening) = documentation.filter(|_| !in_documentation).and_then(question) {
            let problem = format!("the comment opens with `{opening}`: open with its subject");
            found.push((number, problem));
        }
        in_documentation = documentation.is_some();
    }
    found
}

/// The text of a line that is a title.
fn title(line: &str) -> Option<&str> {
    let text = line.trim_start_matches('#');
    (text.len() < line.len()).then(|| text.strip_prefix(' ')).flatten()
}

fn title_problem(title: &str) -> Option<String> {
    if let Some(opening) = question(title) {
        return Some(format!("the title opens with `{opening}`: name its content"));
    }
    if title.ends_with(['.', '?', '!', ':']) {
        return Some("the title ends with a punctuation mark".to_owned());
    }
    let is_diagnostic = title.starts_with(['E', 'W']) && title.get(5..6) == Some(":");
    let length = title.chars().count();
    (length > MAX_TITLE && !is_diagnostic)
        .then(|| format!("the title has {length} characters; {MAX_TITLE} fit"))
}

/// The question word that a text opens with. "How-to" is the name of a part of the manual.
fn question(text: &str) -> Option<&str> {
    let text = text.trim_start();
    let end = text.find(|c: char| !c.is_alphabetic() && c != '-').unwrap_or(text.len());
    QUESTIONS.contains(&&text[..end]).then(|| &text[..end])
}

fn long(line: &str) -> Option<String> {
    let columns = line.chars().count();
    let text = line.trim_start_matches(['/', '!', '#', '-', '*', ' ']);
    let can_be_wrapped = text.contains(' ') && !text.starts_with('|');
    (columns > MAX_COLUMNS && can_be_wrapped)
        .then(|| format!("the line has {columns} columns; {MAX_COLUMNS} fit"))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn lines(found: &[(usize, String)]) -> Vec<usize> {
        found.iter().map(|(line, _)| *line).collect()
    }

    #[test]
    fn titles_name_their_content() {
        let text = "# Masks\n## What masks are\n## How-to\n### It ends.\n```\n# Which\n```\n#tag\n";
        assert_eq!(lines(&markdown(text)), [2, 4]);
        let long = format!("# {}", "a ".repeat(40));
        assert_eq!(lines(&markdown(&long)), [1]);
        let diagnostic = format!("# E0123: {}", "a ".repeat(40));
        assert_eq!(markdown(&diagnostic), []);
    }

    #[test]
    fn lines_fit() {
        let words = "word ".repeat(30);
        let address = format!("- {}", "x".repeat(150));
        let text = format!("{words}\n| {words} |\n{address}\n```\n{words}\n```\n");
        assert_eq!(lines(&markdown(&text)), [1]);
        assert_eq!(lines(&comments(&format!("// {words}\nlet text = \"{words}\";"))), [1]);
    }

    #[test]
    fn comments_open_with_their_subject() {
        let text = "/// Whether it is.\nfn f();\n/// Masks.\n/// Which are many.\n// What follows\n//! Howard";
        assert_eq!(lines(&comments(text)), [1]);
    }
}
