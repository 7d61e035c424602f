//! Properties: formatting keeps the tree and the comments, and formatting twice is formatting once.

use std::path::{Path, PathBuf};

use proptest::prelude::*;
use rtsl_source::{Diagnostics, SourceMap};
use rtsl_syntax::raw::{RawKind, raw_tokens};
use rtsl_syntax::{NoIncludes, parse, print};

use super::formatted;

/// The tree of a text as `--emit ast` prints it. Files that cannot be read are errors on both sides.
fn tree(text: &str) -> String {
    let mut sources = SourceMap::new();
    let file = sources.add("test.rtsl", text);
    let unit = parse(&mut sources, file, &mut NoIncludes, &mut Diagnostics::default());
    print::print(&unit)
}

/// The comments and directives of a text, without the white space at the beginnings of their lines.
fn comments(text: &str) -> Vec<String> {
    let kinds = [RawKind::LineComment, RawKind::BlockComment, RawKind::Directive];
    let raw = raw_tokens(text).into_iter().filter(|token| kinds.contains(&token.kind));
    let lines = |text: &str| text.lines().map(str::trim).collect::<Vec<_>>().join("\n");
    raw.map(|token| lines(&text[token.range])).collect()
}

fn check(text: &str, name: &str) {
    let once = formatted(text);
    assert_eq!(tree(&once), tree(text), "{name}: the tree changes");
    assert_eq!(comments(&once), comments(text), "{name}: comments change");
    assert_eq!(formatted(&once), once, "{name}: formatting again changes the text");
    for line in once.lines() {
        assert!(line.trim_end() == line, "{name}: blanks at the end of {line:?}");
    }
}

/// The shaders below a folder of the repository.
fn shaders(folder: &str) -> Vec<PathBuf> {
    files_below(folder, "rtsl")
}

/// The files with this ending below a folder of the repository.
fn files_below(folder: &str, ending: &str) -> Vec<PathBuf> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..").join(folder);
    let mut folders = vec![root];
    let mut files = Vec::new();
    while let Some(folder) = folders.pop() {
        for entry in std::fs::read_dir(&folder).expect("a folder").flatten() {
            let path = entry.path();
            if path.is_dir() {
                folders.push(path);
            } else if path.extension().is_some_and(|it| it == ending) {
                files.push(path);
            }
        }
    }
    files
}

#[test]
fn the_library_keeps_its_trees() {
    let mut count = 0;
    for folder in ["shaders", "prelude", "scenes", "bench", "tests"] {
        for path in shaders(folder) {
            let Ok(text) = std::fs::read_to_string(&path) else { continue };
            // Some tests have texts with errors on purpose.
            if rtsl_format::format(rtsl_source::FileId(0), &text).is_ok() {
                check(&text, &path.display().to_string());
                count += 1;
            }
        }
    }
    assert!(count > 200, "only {count} files");
}

/// White space and comments to put between tokens.
fn separators() -> impl Strategy<Value = Vec<u8>> {
    prop::collection::vec(any::<u8>(), 1..200)
}

/// The texts of the library that parse without other files.
fn sources() -> Vec<String> {
    let paths = ["shaders/primitives", "shaders/textures", "prelude", "tests/glsl", "tests/types"];
    let texts = paths.iter().flat_map(|folder| shaders(folder));
    let texts = texts.filter_map(|path| std::fs::read_to_string(path).ok());
    texts.filter(|text| rtsl_format::format(rtsl_source::FileId(0), text).is_ok()).collect()
}

/// Writes the tokens of a text with other white space and further comments between them.
fn scattered(text: &str, choices: &[u8]) -> String {
    let mut out = String::new();
    let raw = raw_tokens(text);
    for (index, token) in raw.iter().enumerate() {
        out.push_str(&text[token.range.clone()]);
        let ends_line = matches!(token.kind, RawKind::LineComment | RawKind::Directive);
        let before_directive =
            raw.get(index + 1).is_some_and(|next| next.kind == RawKind::Directive);
        if ends_line || before_directive {
            out.push('\n');
            continue;
        }
        out.push_str(match choices[index % choices.len()] {
            0..8 => "\n",
            8..11 => "\n\n\n",
            11..13 => " // note\n",
            13..15 => " /* note */ ",
            15..17 => "\n/* note\n * more */\n",
            17..18 => "\n// note\n\n",
            18..20 => "\t\t",
            20..22 => "\r\n",
            22..23 => " \\\n ",
            _ => " ",
        });
    }
    out
}

fn cases() -> u32 {
    if rtsl_testing::turns::is_long_run() { 2000 } else { 40 }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: cases(), failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn white_space_and_comments_may_be_anywhere(choices in separators(), start in any::<prop::sample::Index>()) {
        let sources = sources();
        let text = start.get(&sources);
        let text = scattered(text, &choices);
        prop_assume!(rtsl_format::format(rtsl_source::FileId(0), &text).is_ok());
        check(&text, "a scattered text");
    }

    #[test]
    fn any_text_is_formatted_or_refused(text in "([a-z(){}\\[\\];,?:=+*/<-]| |\n|if|else|for|struct|enum|#if|#endif|//|/\\*|\\*/|\"){0,120}") {
        if let Ok(once) = rtsl_format::format(rtsl_source::FileId(0), &text) {
            prop_assert_eq!(formatted(&once), once);
        }
    }
}

#[test]
fn the_examples_of_the_manual_keep_their_trees() {
    let mut count = 0;
    for folder in ["docs/src", "crates/rtsl-source/src/explain"] {
        for path in files_below(folder, "md") {
            let page = std::fs::read_to_string(&path).expect("a page");
            for part in page.split("```rtsl").skip(1) {
                let text = part.split_once('\n').and_then(|(_, text)| text.split("```").next());
                let Some(text) = text else { continue };
                if rtsl_format::format(rtsl_source::FileId(0), text).is_ok() {
                    check(text, &path.display().to_string());
                    count += 1;
                }
            }
        }
    }
    assert!(count > 200, "only {count} examples");
}
