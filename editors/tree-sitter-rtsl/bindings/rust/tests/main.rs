//! The grammar accepts what the compiler accepts, and gives the trees of its corpus.

mod corpus;
mod queries;
mod texts;
mod words;

use std::path::{Path, PathBuf};

use tree_sitter::{Language, Parser, Tree};

/// The folder of the grammar.
fn folder() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

fn language() -> Language {
    tree_sitter_rtsl::LANGUAGE.into()
}

fn parse(text: &str) -> Tree {
    let mut parser = Parser::new();
    parser.set_language(&language()).expect("the version of the grammar is known");
    parser.parse(text, None).expect("parsing is never cancelled")
}

fn read(path: &Path) -> String {
    std::fs::read_to_string(path).unwrap_or_else(|error| panic!("{}: {error}", path.display()))
}

/// The files with this extension in a folder and its subfolders, but for hidden folders and what programs made there.
fn files(folder: &Path, extension: &str) -> Vec<PathBuf> {
    let mut found = Vec::new();
    let mut folders = vec![folder.to_path_buf()];
    while let Some(folder) = folders.pop() {
        for entry in std::fs::read_dir(&folder).expect("the folder is there") {
            let path = entry.expect("it can be read").path();
            let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
            let made = ["target", "node_modules", "book"].contains(&name.as_str());
            if path.is_dir() {
                if !name.starts_with('.') && !made {
                    folders.push(path);
                }
            } else if path.extension().is_some_and(|it| it == extension) {
                found.push(path);
            }
        }
    }
    found.sort();
    found
}
