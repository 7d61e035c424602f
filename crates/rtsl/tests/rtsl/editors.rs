//! The words that grammars of editors highlight are printed from the tables that drive the compiler.
//!
//! `UPDATE_EXPECT=1 cargo test -p rtsl --test rtsl editors::` renews the list; `npm run words` in
//! `editors/tree-sitter-rtsl` then renews the files that are made from it.

use std::collections::BTreeSet;
use std::path::Path;

use rtsl_spec::builtins::{self, Chapter, SpecStruct, SpecType};
use rtsl_spec::{Method, RayType, Role};
use rtsl_syntax::{keywords, qualifiers, type_names};

const FILE: &str = "editors/tree-sitter-rtsl/words.json";

#[test]
fn words_are_current() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..").join(FILE);
    let expected = words();
    if std::env::var_os("UPDATE_EXPECT").is_some() {
        std::fs::write(&path, &expected).unwrap();
    }
    let found = std::fs::read_to_string(&path).unwrap_or_default();
    assert!(found == expected, "{FILE} is stale; run this test with UPDATE_EXPECT=1");
}

fn words() -> String {
    let lists: [(&str, Vec<String>); 8] = [
        ("keywords", owned(keywords())),
        ("qualifiers", owned(qualifiers())),
        ("types", type_names().collect()),
        ("namedTypes", named_types()),
        ("roles", owned(Role::ALL.into_iter().map(Role::class))),
        ("methods", owned(Method::ALL.into_iter().map(Method::name))),
        ("rayTypes", owned(RayType::ALL.into_iter().map(RayType::name))),
        ("functions", functions()),
    ];
    let lists = lists.map(|(key, words)| format!("  \"{key}\": [{}\n  ]", lines(&words)));
    format!("{{\n{}\n}}\n", lists.join(",\n"))
}

/// The types that are no keywords, without the generic ones.
fn named_types() -> Vec<String> {
    let structs = SpecStruct::ALL.into_iter().map(|each| each.name().to_owned());
    std::iter::once(SpecType::Color.to_string()).chain(structs).collect()
}

/// The functions that shaders call; those of the prelude alone have names that begin with `rt_`.
fn functions() -> Vec<String> {
    let all = builtins::all().filter(|each| each.chapter != Chapter::Intrinsic);
    owned(all.map(|each| each.name).collect::<BTreeSet<_>>())
}

fn owned<'a>(words: impl IntoIterator<Item = &'a str>) -> Vec<String> {
    words.into_iter().map(str::to_owned).collect()
}

/// The words in quotes, in lines of at most 120 columns.
fn lines(words: &[String]) -> String {
    let mut text = String::new();
    let mut column = usize::MAX;
    for (index, word) in words.iter().enumerate() {
        let item = format!("\"{word}\"{}", if index + 1 == words.len() { "" } else { "," });
        if column.saturating_add(1 + item.len()) > 120 {
            text.push_str("\n    ");
            column = 4;
        } else {
            text.push(' ');
            column += 1;
        }
        text.push_str(&item);
        column += item.len();
    }
    text
}
