//! Every page of `rtsl explain` tells the truth: its failing text gives the page's code, its
//! other text compiles. Pages about what no text causes (scenes, machines) have no failing text.

use rtsl::{Code, Compilation, Compiler, MemoryLoader, Severity, codes};

/// The text of the first block of a page that is fenced with exactly `fence`.
fn block<'a>(page: &'a str, fence: &str) -> Option<&'a str> {
    let opening = format!("```{fence}\n");
    let start = page.find(&opening)? + opening.len();
    let length = page[start..].find("```")?;
    Some(&page[start..start + length])
}

fn compile(text: &str) -> Compilation {
    let mut loader = MemoryLoader::default();
    loader.files.insert("page.rtsl".into(), text.into());
    Compiler::default().compile_with("page.rtsl", text, &mut loader)
}

/// True if the text of a shader causes the diagnostic: all stages up to lowering.
fn is_of_texts(code: Code) -> bool {
    matches!(&code.as_str()[1..3], "00" | "01" | "02" | "03" | "04")
}

/// True if a single text shows the diagnostic. Modules take several.
fn is_of_one_text(code: Code) -> bool {
    is_of_texts(code) && !matches!(code.as_str(), "E0027" | "E0028" | "E0029")
}

#[test]
fn failing_texts_give_their_code() {
    let mut silent = Vec::new();
    for info in codes() {
        let Some(text) = block(info.explanation, "rtsl,fails") else {
            assert!(!is_of_one_text(info.code), "{} has no failing text", info.code);
            continue;
        };
        // Parameters are given by hosts, not by texts.
        if !is_of_texts(info.code) {
            continue;
        }
        let compilation = compile(text);
        let given: Vec<&str> =
            compilation.diagnostics.iter().map(|each| each.code.as_str()).collect();
        let is_only = given.iter().all(|code| *code == info.code.as_str())
            || info.code.severity() == Severity::Warning;
        if given.is_empty() || !given.contains(&info.code.as_str()) || !is_only {
            silent.push(format!("{} gives {given:?}\n{}", info.code, compilation.report(false)));
        }
    }
    assert!(silent.is_empty(), "{}", silent.join("\n"));
}

#[test]
fn other_texts_compile() {
    let mut broken = Vec::new();
    for info in codes() {
        let Some(text) = block(info.explanation, "rtsl") else {
            assert!(!is_of_one_text(info.code), "{} has no text that compiles", info.code);
            continue;
        };
        let compilation = compile(text);
        if compilation.unit.is_none() || has_code(&compilation, info.code) {
            broken.push(format!("{}\n{}", info.code, compilation.report(false)));
        }
    }
    assert!(broken.is_empty(), "{}", broken.join("\n"));
}

fn has_code(compilation: &Compilation, code: Code) -> bool {
    compilation.diagnostics.iter().any(|each| each.code == code)
}
