//! Every shader text in the documentation compiles without a warning.
//!
//! A block that starts with ```` ```rtsl ```` is a whole file; with `append` after `file=NAME` it continues that file;
//! ```` ```rtsl,fails=CODE ```` gives that diagnostic.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use rtsl::Compiler;

struct Block {
    /// `rtsl`, and what follows it on the fence.
    info: String,
    text: String,
    line: usize,
}

fn blocks(page: &str) -> Vec<Block> {
    let mut found: Vec<Block> = Vec::new();
    let mut inside = false;
    for (index, line) in page.lines().enumerate() {
        if let Some(info) = line.strip_prefix("```") {
            inside = !inside;
            if inside {
                found.push(Block { info: info.to_string(), text: String::new(), line: index + 1 });
            }
        } else if inside && let Some(block) = found.last_mut() {
            block.text.push_str(line);
            block.text.push('\n');
        }
    }
    found
}

/// The pages of the book and the read-me file.
fn pages() -> Vec<PathBuf> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
    let mut pages = vec![root.join("README.md")];
    let mut folders = vec![root.join("docs/src")];
    while let Some(folder) = folders.pop() {
        for entry in std::fs::read_dir(folder).expect("the folder is there") {
            let path = entry.expect("it can be read").path();
            if path.is_dir() {
                folders.push(path);
            } else if path.extension().is_some_and(|extension| extension == "md")
                // The test `explain` compiles its texts.
                && !path.ends_with("reference/diagnostics.md")
            {
                pages.push(path);
            }
        }
    }
    pages.sort();
    pages
}

#[test]
fn shader_texts_compile() {
    let mut compiled = 0;
    for path in pages() {
        let page = std::fs::read_to_string(&path).unwrap_or_default();
        let mut files: BTreeMap<String, String> = BTreeMap::new();
        for block in blocks(&page) {
            let mut words = block.info.split([' ', ',']);
            if words.next() != Some("rtsl") {
                continue;
            }
            let words: Vec<&str> = words.collect();
            let value = |key: &str| words.iter().find_map(|word| word.strip_prefix(key));
            let mut text = block.text;
            if let Some(file) = value("file=") {
                if words.contains(&"append") {
                    text.insert_str(0, &files[file]);
                }
                files.insert(file.to_string(), text.clone());
            }
            let name = format!("{}:{}", path.display(), block.line);
            let compilation = Compiler::default().compile(&name, &text);
            match value("fails=") {
                None => {
                    assert!(compilation.diagnostics.is_empty(), "{}", compilation.report(false))
                }
                Some(code) => assert!(
                    compilation.diagnostics.iter().any(|found| found.code.as_str() == code),
                    "{name} does not give {code}:\n{}",
                    compilation.report(false)
                ),
            }
            compiled += 1;
        }
    }
    assert!(compiled > 10, "only {compiled} texts were found");
}
