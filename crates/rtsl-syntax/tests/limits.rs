//! No text makes the parser panic, hang, overflow a small stack or use memory out of proportion.

use rtsl_source::{Diagnostics, SourceMap, diagnostic_codes as codes};
use rtsl_syntax::{NoIncludes, parse, print};

/// Parses `text` on a stack of 2 MB. Gives the printed tree and the codes of the diagnostics.
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
    for (open, close) in
        [("(", ")"), ("-", ""), ("a[", "]"), ("f(", ")"), ("a ? b : ", ""), ("1 + ", ""), ("!", "")]
    {
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
    let text = format!("float f() {{ return {}1{}; }}", "(".repeat(200), ")".repeat(200));
    assert_eq!(parse_small(text).1, [""; 0]);
    let text = format!("float f() {{ return {}1; }}", "1 + ".repeat(200));
    assert_eq!(parse_small(text).1, [""; 0]);
    let text = format!("void f() {{ {} ; }}", "if (a) ; else ".repeat(200));
    assert_eq!(parse_small(text).1, [""; 0]);
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
