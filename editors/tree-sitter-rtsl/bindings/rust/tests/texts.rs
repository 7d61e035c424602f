//! Every RTSL text of the repository that the compiler can parse.

use std::path::Path;

use rtsl_source::{Diagnostics, Severity, SourceMap};
use rtsl_syntax::{IncludeError, IncludeLoader, IncludedFile};
use tree_sitter::Node;

use super::{files, folder, parse, read};

/// Texts that the grammar can't parse. The words are part of each: macros that are neither names nor calls, which the
/// grammar does not expand, functions in functions, which the checker refuses and not the parser, and declarations
/// with a comma before the first name, which nobody writes.
const LEFT_OUT: [&str; 5] = [
    "JOIN(sq, uare) + JOIN(1, 2)",
    "const float TWICE(ab)",
    "TEN(;)",
    "    int whole() { }\n",
    "const float, HALF",
];

#[test]
fn files_are_parsed() {
    let found = files(&folder().join("../.."), "rtsl");
    check(found.iter().map(|path| (path.display().to_string(), read(path))).collect(), 200);
}

#[test]
fn texts_of_pages_are_parsed() {
    let pages = files(&folder().join("../.."), "md");
    check(pages.iter().flat_map(|path| blocks(path)).collect(), 300);
}

/// Asserts that the trees of those texts that the compiler can parse, at least so many, have no errors.
fn check(texts: Vec<(String, String)>, least: usize) {
    let mut checked = 0;
    for (name, text) in texts {
        if LEFT_OUT.iter().any(|part| text.contains(part)) || !compiler_parses(&name, &text) {
            continue;
        }
        if let Some(error) = first_error(parse(&text).root_node()) {
            let place = error.start_position();
            panic!("{name}:{}:{}: {}", place.row + 1, place.column + 1, error.to_sexp());
        }
        checked += 1;
    }
    assert!(checked >= least, "only {checked} texts were found");
}

fn first_error(node: Node<'_>) -> Option<Node<'_>> {
    if node.is_error() || node.is_missing() {
        return Some(node);
    }
    if !node.has_error() {
        return None;
    }
    let mut cursor = node.walk();
    node.children(&mut cursor).find_map(first_error)
}

fn compiler_parses(name: &str, text: &str) -> bool {
    let mut map = SourceMap::new();
    let file = map.add(name, text);
    let mut diagnostics = Diagnostics::default();
    rtsl_syntax::parse(&mut map, file, &mut Nothing, &mut diagnostics);
    diagnostics.iter().all(|diagnostic| diagnostic.severity != Severity::Error)
}

/// Finds an empty file for each `#include`, since the grammar reads none.
struct Nothing;

impl IncludeLoader for Nothing {
    fn load(&mut self, path: &str, _including: &str) -> Result<IncludedFile, IncludeError> {
        Ok(IncludedFile { name: path.to_owned(), text: String::new() })
    }
}

/// The blocks of RTSL on a page, each with its place.
fn blocks(page: &Path) -> Vec<(String, String)> {
    let mut found: Vec<(String, String)> = Vec::new();
    let mut inside = false;
    for (line, number) in read(page).lines().zip(1..) {
        if let Some(info) = line.strip_prefix("```") {
            inside = !inside && info.starts_with("rtsl");
            if inside {
                found.push((format!("{}:{number}", page.display()), String::new()));
            }
        } else if let Some((_, text)) = found.last_mut().filter(|_| inside) {
            text.push_str(line);
            text.push('\n');
        }
    }
    found
}
