//! The queries name nodes and fields that exist.

use tree_sitter::Query;

use super::{files, folder, language, read};

#[test]
fn queries_fit_the_grammar() {
    let mut checked = 0;
    for folder in [folder(), &folder().join("../neovim"), &folder().join("../helix")] {
        for path in files(folder, "scm") {
            if let Err(error) = Query::new(&language(), &read(&path)) {
                panic!("{}: {error}", path.display());
            }
            checked += 1;
        }
    }
    assert!(checked >= 15, "only {checked} queries were found");
}
