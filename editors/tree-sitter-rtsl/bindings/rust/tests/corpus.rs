//! The corpus: texts with their trees, in the format of `tree-sitter test`, which writes the trees.

use super::{files, folder, parse, read};

#[test]
fn texts_have_the_trees_of_the_corpus() {
    let mut cases = 0;
    for path in files(&folder().join("test/corpus"), "txt") {
        for case in cases_of(&read(&path)) {
            let found = parse(&case.text).root_node().to_sexp();
            assert_eq!(found, case.tree, "{}: {}", path.display(), case.name);
            cases += 1;
        }
    }
    assert!(cases > 50, "only {cases} cases were found");
}

struct Case {
    name: String,
    text: String,
    /// The tree on one line.
    tree: String,
}

/// The cases of a file: a title between lines of `=`, the text, a line of `-`, and the tree.
fn cases_of(file: &str) -> Vec<Case> {
    let is_bar = |line: &str, of: char| line.len() > 70 && line.chars().all(|it| it == of);
    let mut cases: Vec<Case> = Vec::new();
    let mut lines = file.lines();
    let mut in_tree = false;
    while let Some(line) = lines.next() {
        if is_bar(line, '=') {
            let name = lines.next().unwrap_or_default().to_owned();
            assert!(lines.next().is_some_and(|line| is_bar(line, '=')), "{name}");
            cases.push(Case { name, text: String::new(), tree: String::new() });
            in_tree = false;
        } else if let Some(case) = cases.last_mut() {
            match is_bar(line, '-') {
                true => in_tree = true,
                false if in_tree => add_words(&mut case.tree, line),
                false => {
                    case.text.push_str(line);
                    case.text.push('\n');
                }
            }
        }
    }
    cases
}

fn add_words(tree: &mut String, line: &str) {
    for word in line.split_whitespace() {
        if !tree.is_empty() {
            tree.push(' ');
        }
        tree.push_str(word);
    }
}
