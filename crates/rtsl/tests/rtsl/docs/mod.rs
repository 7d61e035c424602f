//! Checks of the documentation: shader texts compile, links lead somewhere, tables agree with their data.

mod links;
mod markdown;
mod shaders;
mod tables;

use std::path::{Path, PathBuf};

/// The root of the repository.
fn root() -> PathBuf {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
    root.canonicalize().expect("the repository is there")
}

/// The Markdown files in a folder and its subfolders, but for hidden folders and build outputs.
fn markdown_files(folder: &Path) -> Vec<PathBuf> {
    let mut files = Vec::new();
    let mut folders = vec![folder.to_path_buf()];
    while let Some(folder) = folders.pop() {
        for entry in std::fs::read_dir(&folder).expect("the folder is there") {
            let path = entry.expect("it can be read").path();
            let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
            let made = ["target", "book", "node_modules"].contains(&name.as_str());
            if path.is_dir() {
                if !name.starts_with('.') && !made {
                    folders.push(path);
                }
            } else if name.ends_with(".md") {
                files.push(path);
            }
        }
    }
    files.sort();
    files
}

/// The pages of the book, without its table of contents.
fn book_pages() -> Vec<PathBuf> {
    let mut pages = markdown_files(&root().join("docs/src"));
    pages.retain(|page| !page.ends_with("SUMMARY.md"));
    pages
}

fn read(path: &Path) -> String {
    let text = std::fs::read_to_string(path);
    text.unwrap_or_else(|error| panic!("{}: {error}", path.display()))
}
