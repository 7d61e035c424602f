//! Every page of `rtsl explain` tells the truth: its failing text gives the page's code, its
//! other text compiles.

use rtsl_source::{CodeInfo, Diagnostics, SourceMap, codes, render};
use rtsl_syntax::{MemoryLoader, parse};

/// The text of the first block of a page that is fenced with exactly `fence`.
fn block<'a>(page: &'a str, fence: &str) -> Option<&'a str> {
    let opening = format!("```{fence}\n");
    let start = page.find(&opening)? + opening.len();
    let length = page[start..].find("```")?;
    Some(&page[start..start + length])
}

fn diagnose(text: &str) -> (SourceMap, Diagnostics) {
    let mut map = SourceMap::new();
    let file = map.add("page.rtsl", text);
    let mut loader = MemoryLoader::default();
    loader.files.insert("page.rtsl".into(), text.into());
    let mut diagnostics = Diagnostics::new();
    parse(&mut map, file, &mut loader, &mut diagnostics);
    (map, diagnostics)
}

/// Whether the parser or what comes before it gives the code.
fn is_syntactic(info: &CodeInfo) -> bool {
    matches!(&info.code.as_str()[1..3], "00" | "01")
}

#[test]
fn failing_texts_fail_with_their_code_and_no_other() {
    for info in codes().iter().filter(|info| is_syntactic(info)) {
        let text = block(info.explanation, "rtsl,fails")
            .unwrap_or_else(|| panic!("{} has no failing text", info.code));
        let (map, diagnostics) = diagnose(text);
        let shown = render::all_to_text(&map, diagnostics.iter(), false);
        assert!(!diagnostics.is_empty(), "{} compiles", info.code);
        assert!(diagnostics.iter().all(|each| each.code == info.code), "{}\n{shown}", info.code);
    }
}

#[test]
fn other_texts_compile() {
    for info in codes().iter().filter(|info| is_syntactic(info)) {
        let text = block(info.explanation, "rtsl")
            .unwrap_or_else(|| panic!("{} has no text that compiles", info.code));
        let (map, diagnostics) = diagnose(text);
        let shown = render::all_to_text(&map, diagnostics.iter(), false);
        assert!(diagnostics.is_empty(), "{}\n{shown}", info.code);
    }
}
