//! Fuzzes the parser and the verifier: no text makes them panic.

use proptest::prelude::*;
use rtsl_ir::Function;
use rtsl_ir::verify::verify;

/// Words that get past the first checks of the parser.
const WORDS: &[&str] = &[
    "function",
    "f",
    "state",
    "local",
    "member",
    "rt_RayOrigin",
    "s",
    ":",
    "f32[3]",
    "i32[1]",
    "{",
    "}",
    "(",
    ")",
    "=",
    ",",
    "@",
    "%a",
    "%b",
    "f32",
    "i32",
    "bool",
    "constant",
    "1",
    "-1.5",
    "0x7f",
    "add",
    "sqrt",
    "less",
    "load",
    "store",
    "if",
    "else",
    "loop",
    "yield",
    "repeat",
    "return",
    "precise",
    "call",
    "texture.lookup",
    "of",
    "gives",
    "is_set",
    "//",
    "\n",
    "ü",
];

fn read(text: &str) {
    if let Ok(function) = text.parse::<Function>() {
        let _ = verify(&function);
        let _ = function.to_string();
    }
}

proptest! {
    #[test]
    fn any_text(text in ".{0,200}") {
        read(&text);
    }

    #[test]
    fn any_words(words in prop::collection::vec(prop::sample::select(WORDS), 0..80)) {
        read(&words.join(" "));
        read(&format!("function f member s: f32[3] {{ {}", words.join(" ")));
    }
}
