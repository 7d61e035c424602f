//! Tests that no text makes the parser panic, hang, overflow a small stack or use disproportionate
//! memory.

use rtsl_source::{Diagnostics, SourceMap, diagnostic_codes as codes};
use rtsl_syntax::{MemoryLoader, NoIncludes, parse, print};

/// Parses `text` on a stack of 2 MB. Returns the printed tree and the codes of the diagnostics.
fn parse_small(text: String) -> (String, Vec<&'static str>) {
    let run = move || {
        let mut map = SourceMap::new();
        let file = map.add("test.rtsl", text);
        let mut diagnostics = Diagnostics::new();
        let unit = parse(&mut map, file, &mut NoIncludes, &mut diagnostics);
        let codes = diagnostics.iter().map(|each| each.code.as_str()).collect();
        (print::print(&unit), codes)
    };
    std::thread::Builder::new().stack_size(2 << 20).spawn(run).unwrap().join().unwrap()
}

fn only_code(text: String, code: rtsl_source::Code) {
    let (_, codes) = parse_small(text);
    assert_eq!(codes, [code.as_str()]);
}

#[test]
fn deep_nesting_is_one_error() {
    let deep = |open: &str, close: &str| {
        format!("float f() {{ x = {}1{}; }}", open.repeat(10_000), close.repeat(10_000))
    };
    for (open, close) in [
        ("(", ")"),
        ("-", ""),
        ("a[", "]"),
        ("f(", ")"),
        ("a ? b : ", ""),
        ("1 + (", ")"),
        ("(1 * ", " + 1)"),
        ("a = ", ""),
        ("!", ""),
    ] {
        only_code(deep(open, close), codes::NESTED_TOO_DEEPLY);
    }
    for statement in
        ["{", "if (a) ", "for (;;) ", "while (a) ", "do ", "illuminance ", "switch (1) { case 0: "]
    {
        let text = format!("void f() {{ {}", statement.repeat(10_000));
        only_code(text, codes::NESTED_TOO_DEEPLY);
    }
    only_code(
        format!("void f() {{ {} ; }}", "if (a) ; else ".repeat(10_000)),
        codes::NESTED_TOO_DEEPLY,
    );
    only_code(format!("float a = {};", "{".repeat(10_000)), codes::NESTED_TOO_DEEPLY);
    only_code(format!("float a{};", "[1]".repeat(10_000)), codes::NESTED_TOO_DEEPLY);
    only_code(format!("float a = b{};", ".x".repeat(10_000)), codes::NESTED_TOO_DEEPLY);
    only_code(format!("float a = b{};", "++".repeat(10_000)), codes::NESTED_TOO_DEEPLY);
    only_code(format!("#if {}1\n#endif", "(".repeat(10_000)), codes::INVALID_CONDITION);
    only_code(format!("#if {}1\n#endif", "!".repeat(10_000)), codes::INVALID_CONDITION);
}

#[test]
fn nesting_within_the_limit_is_fine() {
    for (open, close) in [
        ("(", ")"),
        ("-", ""),
        ("a[", "]"),
        ("f(", ")"),
        ("a ? b : ", ""),
        ("1 + (", ")"),
        ("(1 * ", " + 1)"),
        ("a = ", ""),
    ] {
        let (open, close) = (open.repeat(1_000), close.repeat(1_000));
        let text = format!("float f() {{ return {open}1{close}; }}");
        assert_eq!(parse_small(text).1, [""; 0], "{open}");
    }
    let text = format!("void f() {{ {} ; }}", "if (a) ; else ".repeat(1_000));
    assert_eq!(parse_small(text).1, [""; 0]);
    let text = format!("void f() {{ {} {} }}", "{".repeat(1_000), "}".repeat(1_000));
    assert_eq!(parse_small(text).1, [""; 0]);
}

/// Chains do not nest, however long they are: parsing, cloning, printing and dropping them does not
/// recurse.
#[test]
fn chains_have_any_length() {
    for (link, printed) in [(" + 1", " + 1)"), (" == b", " == b)"), (", b", ", b)")] {
        let text = format!("float f() {{ return (a{}); }}", link.repeat(30_000));
        let (tree, codes) = parse_small(text);
        assert_eq!(codes, [""; 0], "{link}");
        let expected = format!("return {}a{}\n", "(".repeat(30_000), printed.repeat(30_000));
        assert!(tree.contains(&expected), "{link}");
    }
    // The size is copied for each declarator.
    let text = format!("float[1{}] a, b;", " + 1".repeat(30_000));
    assert_eq!(parse_small(text).1, [""; 0]);
    let compared = "a < 1 && b >= 2 || ".repeat(20_000);
    assert_eq!(parse_small(format!("bool f() {{ return {compared} c; }}")).1, [""; 0]);
}

#[test]
fn long_texts_take_linear_time() {
    let long = 2 << 20;
    let linear: &[(&str, &str, &str, usize, &[&str])] = &[
        ("const int ", "a, ", "", long / 8, &["E0101"]),
        ("// ", "x", "", long, &[]),
        ("int ", "x", ";", long, &["E0007"]),
        ("const int a = ", "9", ";", long, &["E0006"]),
        ("", " ", "", long, &[]),
        ("int\\\n", "\\\n", "a;", long, &[]),
        ("#if 0\n", "} ", "\n#endif", long / 8, &[]),
        // Unclosed brackets in statement after statement.
        ("void f() { ", "a[;", "}", long / 16, &["E0101"]),
        ("void f() { ", "a[(;", "}", long / 16, &["E0101"]),
        ("", "}", "", long / 16, &["E0102"]),
        ("", "*/\nclass a;", "", long / 16, &["E0101"]),
        ("", "\"", "", long / 16, &["E0106"]),
        ("", "#if 1\n", "", long / 16, &["E0012"]),
        ("", "#include \"x\"\n", "", long / 16, &["E0020"]),
    ];
    for (start, repeated, end, length, expected) in linear {
        let text = format!("{start}{}{end}", repeated.repeat(length / repeated.len()));
        let (_, mut found) = parse_small(text);
        found.dedup();
        assert_eq!(found, *expected, "{start}{repeated}");
    }
}

#[test]
fn copies_of_long_types_are_limited() {
    let size = format!("f({})", "1,".repeat(10_000) + "1");
    let text = format!("float[{size}] {} a;", "a, ".repeat(10_000));
    only_code(text, codes::NESTED_TOO_DEEPLY);
    let documentation = format!("[[doc \"{}\"]]", "x".repeat(100_000));
    let text = format!("{documentation} float {} a;", "a, ".repeat(10_000));
    only_code(text, codes::NESTED_TOO_DEEPLY);
}

/// The codes of the diagnostics for a text that includes files.
fn codes_with(text: &str, files: impl IntoIterator<Item = (String, String)>) -> Vec<&'static str> {
    let mut map = SourceMap::new();
    let file = map.add("test.rtsl", text);
    let mut diagnostics = Diagnostics::new();
    let mut loader = MemoryLoader { files: files.into_iter().collect() };
    parse(&mut map, file, &mut loader, &mut diagnostics);
    diagnostics.iter().map(|each| each.code.as_str()).collect()
}

#[test]
fn includes_have_a_budget() {
    let file = |name: &str, text: String| (name.to_owned(), text);
    let long = "float f(float x) { return x; }\n".repeat(10_000);
    let include = "#include \"a\"\n";
    // A cycle gives one error, however long its files are and however often they include each
    // other.
    for text in [
        include.to_owned(),
        include.repeat(2),
        format!("{long}{include}"),
        format!("#ifdef NEVER\n{long}#endif\n{}", include.repeat(10)),
    ] {
        assert_eq!(codes_with(include, [file("a", text)]), ["E0021"]);
    }
    let doubling = (0..40).map(|level| {
        let next = format!("#include \"{}\"\n", level + 1);
        file(&level.to_string(), next.repeat(2))
    });
    let doubling = doubling.chain([file("40", "int a;\n".to_owned())]);
    assert_eq!(codes_with("#include \"0\"", doubling), ["E0019"]);
    let chain =
        (0..100).map(|level| file(&level.to_string(), format!("#include \"{}\"\n", level + 1)));
    assert_eq!(codes_with("#include \"0\"", chain), ["E0019"]);
    // Tokens that include guards skip cost little, and `#pragma once` costs none.
    let guarded = format!("#ifndef A\n#define A\n{}#endif\n", &long[..31 * 500]);
    assert_eq!(codes_with(&include.repeat(2_000), [file("a", guarded)]), [""; 0]);
    let once = format!("#pragma once\n{long}");
    assert_eq!(codes_with(&include.repeat(5_000), [file("a", once)]), [""; 0]);
    let again = codes_with(&include.repeat(20), [file("a", long)]);
    assert_eq!(again, ["E0019"]);
}

#[test]
fn macros_have_a_budget() {
    let mut laughs = "#define A0 int a;\n".to_string();
    for level in 1..=64 {
        laughs += &format!("#define A{level} A{0} A{0} A{0} A{0}\n", level - 1);
    }
    only_code(laughs + "A64\n", codes::EXPANSION_LIMIT);

    let doubling = format!("#define D(x) x x\n{}int a;{}", "D(".repeat(40), ")".repeat(40));
    only_code(doubling, codes::EXPANSION_LIMIT);

    let nested = format!("#define I(x) x\n{}1{}", "I(".repeat(10_000), ")".repeat(10_000));
    only_code(nested, codes::EXPANSION_LIMIT);

    let mut pasted = "#define P0 aaaaaaaa\n".to_string();
    for level in 1..=40 {
        pasted += &format!("#define J{level}(x) K{level}(x, x)\n#define K{level}(x, y) x##y\n");
        pasted += &format!("#define P{level} J{level}(P{})\n", level - 1);
    }
    only_code(pasted + "P40\n", codes::EXPANSION_LIMIT);

    let mut chain = String::new();
    for link in 0..20_000 {
        chain += &format!("#define C{link} C{}\n", link + 1);
    }
    assert_eq!(parse_small(chain + "const int a = C0;").1, [""; 0]);
}
