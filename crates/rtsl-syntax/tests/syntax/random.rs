//! Tests that any bytes and any tokens give a tree.

use proptest::prelude::*;
use rtsl_source::{Diagnostics, SourceMap, render};
use rtsl_syntax::{MemoryLoader, parse, print};

const SOUP: &[&str] = &[
    "class",
    "A",
    ":",
    "rt_Texture",
    ";",
    "{",
    "}",
    "(",
    ")",
    "[",
    "]",
    "[[",
    "]]",
    ",",
    ".",
    "public",
    "private",
    "scratch",
    "const",
    "uniform",
    "precise",
    "in",
    "out",
    "inout",
    "void",
    "float",
    "vec3",
    "color",
    "struct",
    "constructor",
    "if",
    "else",
    "for",
    "while",
    "do",
    "switch",
    "case",
    "default",
    "break",
    "continue",
    "return",
    "illuminance",
    "true",
    "false",
    "+",
    "-",
    "*",
    "/",
    "%",
    "=",
    "==",
    "+=",
    "++",
    "--",
    "!",
    "~",
    "?",
    "<",
    ">",
    "<<",
    ">>=",
    "&&",
    "||",
    "^^",
    "&",
    "|",
    "^",
    "x",
    "y",
    "f",
    "1",
    "2u",
    "3.5",
    "12abc",
    "\"text\"",
    "\"",
    "layout",
    "sampler2D",
    "discard",
    "double",
    "precision",
    "highp",
    "#",
    "##",
    "\n#define M",
    "\n#define F(a, b) a##b",
    "F(",
    "M",
    "\n#if 1",
    "\n#if x",
    "\n#ifdef M",
    "\n#else",
    "\n#elif 1",
    "\n#endif",
    "\n#undef M",
    "\n",
    "\n#include \"a.rtsl\"",
    "\n#line 3",
    "__LINE__",
    "//",
    "/*",
    "*/",
    "\\\n",
    "é",
    "@",
];

fn parse_any(text: String) {
    let mut map = SourceMap::new();
    let file = map.add("test.rtsl", text);
    let mut loader = MemoryLoader::default();
    loader.files.insert("a.rtsl".into(), "int a;\n#include \"b.rtsl\"".into());
    loader.files.insert("b.rtsl".into(), "#if 1\n#include \"a.rtsl\"\n".into());
    let mut diagnostics = Diagnostics::new();
    let unit = parse(&mut map, file, &mut loader, &mut diagnostics);
    print::print(&unit);
    render::all_to_text(&map, diagnostics.iter(), false);
}

proptest! {
    #[test]
    fn any_text_parses(text in any::<Vec<u8>>()) {
        parse_any(String::from_utf8_lossy(&text).into_owned());
    }

    #[test]
    fn any_tokens_parse(tokens in prop::collection::vec(prop::sample::select(SOUP), 0..200)) {
        parse_any(tokens.join(" "));
    }
}
