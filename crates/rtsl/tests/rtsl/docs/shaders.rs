//! Every shader text in the documentation compiles without a warning.
//!
//! A block that starts with ```` ```rtsl ```` is a whole file; with `append` after `file=NAME` it continues that file,
//! which later blocks of the page can include and import; ```` ```rtsl,fails=CODE ```` gives that diagnostic.

use std::collections::BTreeMap;

use rtsl::{Compiler, FileLoader, IncludeError, IncludeLoader, IncludedFile, MemoryLoader};

use super::markdown::blocks;
use super::{book_pages, read, root};

#[test]
fn shader_texts_compile() {
    let mut compiled = 0;
    let mut pages = book_pages();
    // The test `explain` compiles the texts of this page.
    pages.retain(|page| !page.ends_with("reference/diagnostics.md"));
    pages.extend(
        ["README.md", "CONTRIBUTING.md", "crates/rtsl/README.md"].map(|page| root().join(page)),
    );
    for path in pages {
        let page = read(&path);
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
            let mut loader = PageLoader { page: MemoryLoader { files: files.clone() } };
            let compilation = Compiler::default().compile_with(&name, &text, &mut loader);
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

/// Loads the files of a page, then those of the standard library.
struct PageLoader {
    page: MemoryLoader,
}

impl IncludeLoader for PageLoader {
    fn load(&mut self, path: &str, including: &str) -> Result<IncludedFile, IncludeError> {
        let of_page = self.page.load(path, "");
        of_page.or_else(|_| FileLoader::default().load(path, including))
    }
}
