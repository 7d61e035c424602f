//! The words of the grammar are those of the compiler.

use super::{folder, language, read};

#[test]
fn keywords_and_types_are_those_of_the_compiler() {
    let language = language();
    let words = rtsl_syntax::keywords().map(str::to_owned).chain(rtsl_syntax::type_names());
    for word in words {
        assert_ne!(
            language.id_for_node_kind(&word, false),
            0,
            "`{word}` is missing in the grammar"
        );
    }
}

/// A test of the crate `rtsl` holds `words.json` to the compiler's tables; `npm run words` writes it to these files.
#[test]
fn words_of_the_language_are_highlighted() {
    let words = read(&folder().join("words.json"));
    let grammars = ["queries/highlights.scm", "../vscode/syntaxes/rtsl.tmLanguage.json"];
    for grammar in grammars {
        let text = read(&folder().join(grammar));
        for key in ["functions", "roles", "methods", "rayTypes", "namedTypes"] {
            for word in list(&words, key) {
                let found =
                    text.split(|it: char| !it.is_alphanumeric() && it != '_').any(|it| it == word);
                assert!(found, "{grammar} lacks `{word}`; `npm run words` renews it");
            }
        }
    }
}

/// The words of a list.
fn list<'a>(words: &'a str, key: &str) -> Vec<&'a str> {
    let start = words.find(&format!("\"{key}\"")).expect("the list is there");
    let (_, list) = words[start..].split_once('[').expect("it is a list");
    let (list, _) = list.split_once(']').expect("it ends");
    list.split('"').skip(1).step_by(2).collect()
}
