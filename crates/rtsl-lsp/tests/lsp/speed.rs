//! Long texts: that they have answers at all. `cargo test -p rtsl-lsp --release speed -- --nocapture` prints times.

use std::time::Instant;

use serde_json::json;

use crate::client::{Client, position_of};

/// A class of 2,000 lines.
fn long_text() -> String {
    let mut text = "class Long : rt_Texture;\npublic float scale = 1.0;\n".to_owned();
    for index in 0..199 {
        text.push_str(&format!(
            "// Function {index}.
float part{index}(vec2 p, float x) {{
    float sum = 0.0;
    for (int i = 0; i < 4; ++i) {{
        vec2 q = p * float(i) + vec2(x, scale);
        if (length(q) > 1.0) sum += sin(q.x) * cos(q.y) + x;
        else sum -= mix(q.x, q.y, 0.5);
    }}
    return sum;
}}
"
        ));
    }
    text.push_str("void lookup() {\n    float v = 0.0;\n");
    for index in 0..5 {
        text.push_str(&format!("    v += part{index}(rt_TextureUV, v);\n"));
    }
    text.push_str("    rt_FloatTextureValue = v;\n}\n");
    text
}

#[test]
fn answers_for_long_texts() {
    ask_everything(&long_text(), "part3(|rt_TextureUV");
}

/// The times are in proportion to the number of functions.
#[test]
fn answers_for_many_functions() {
    ask_everything(&functions(600, "\n"), "f3(|rt_TextureUV");
}

/// The times are those of functions on lines of their own.
#[test]
fn answers_for_long_lines() {
    ask_everything(&functions(600, " "), "f3(|rt_TextureUV");
}

/// A search of the text or of all declarations for each entry of the outline would take minutes.
#[test]
fn outlines_of_very_long_lines() {
    const COUNT: usize = 100_000;
    let constants: String =
        (0..COUNT).map(|index| format!("const float c{index} = 1.0; ")).collect();
    let text = constants + "class One : rt_Texture; void lookup() { rt_FloatTextureValue = c7; }";
    let mut client = Client::new(&[]);
    assert_eq!(client.open("long.rtsl", &text), json!([]));
    let document = json!({"textDocument": {"uri": client.uri("long.rtsl")}});
    let entries = client.ask("textDocument/documentSymbol", document);
    assert_eq!(entries.as_array().map(Vec::len), Some(COUNT + 1));
    let last = text.find(&format!("c{} ", COUNT - 1));
    let of_last = &entries[COUNT - 1]["selectionRange"]["start"];
    assert_eq!(of_last, &json!({"line": 0, "character": last}));
}

/// A class of functions with a separator between them.
fn functions(count: usize, separator: &str) -> String {
    let function = |index| {
        format!("float f{index}(float x) {{ float y = 2 * x + 1.0; return y; }}{separator}")
    };
    let functions: String = (0..count).map(function).collect();
    let lookup = "void lookup() { rt_FloatTextureValue = f3(rt_TextureUV.x); }";
    format!("class Many : rt_Texture;{separator}{functions}{lookup}\n")
}

/// Asks all requests about a text, some at a place in it, and prints their times.
fn ask_everything(text: &str, place_text: &str) {
    let mut client = Client::new(&[]);
    assert_eq!(client.open("long.rtsl", text), json!([]));
    let document = json!({"textDocument": {"uri": client.uri("long.rtsl")}});
    let place = position_of(text, place_text);
    let mut timed = |what: &str, ask: &mut dyn FnMut(&mut Client)| {
        let start = Instant::now();
        ask(&mut client);
        println!("{what}: {:.1} ms", start.elapsed().as_secs_f64() * 1e3);
    };
    let here = json!({"start": place, "end": place});
    timed("diagnostics after a change", &mut |client| {
        assert_eq!(client.change("long.rtsl", here.clone(), ""), json!([]));
    });
    for method in ["hover", "definition", "completion", "signatureHelp", "documentHighlight"] {
        timed(method, &mut |client| {
            let found =
                client.ask_at(&format!("textDocument/{method}"), "long.rtsl", text, place_text);
            assert!(found.get("error").is_none(), "{method}: {found}");
        });
    }
    timed("references", &mut |client| {
        let asked = json!({
            "textDocument": document["textDocument"], "position": place,
            "context": {"includeDeclaration": true},
        });
        assert!(!client.ask("textDocument/references", asked).is_null());
    });
    for method in ["documentSymbol", "foldingRange", "semanticTokens/full", "codeLens"] {
        timed(method, &mut |client| {
            let found = client.ask(&format!("textDocument/{method}"), document.clone());
            assert!(!found.is_null() && found.get("error").is_none(), "{method}");
        });
    }
    timed("inlayHint", &mut |client| {
        let whole =
            json!({"start": {"line": 0, "character": 0}, "end": {"line": 9999, "character": 0}});
        let found = client.ask(
            "textDocument/inlayHint",
            json!({"textDocument": document["textDocument"], "range": whole}),
        );
        assert!(found.as_array().is_some_and(|hints| !hints.is_empty()));
    });
    timed("formatting", &mut |client| {
        let options = json!({"tabSize": 4, "insertSpaces": true});
        let asked = json!({"textDocument": document["textDocument"], "options": options});
        assert!(client.ask("textDocument/formatting", asked).is_array());
    });
}
