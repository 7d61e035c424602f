//! Texts that are deep, long or make each other longer: each gives an answer soon, on a small stack.

mod support;

use std::fmt::Write;

use rtsl_sema::hir::ClassId;
use rtsl_sema::lower::lower_class;
use support::{PRELUDE, check, codes};

/// Checks a text on a stack of 2 MB.
fn on_small_stack(text: String) -> Vec<&'static str> {
    let thread = std::thread::Builder::new().stack_size(2 << 20);
    thread.spawn(move || codes(&text)).unwrap().join().unwrap()
}

/// Checks and lowers a text on such a stack, and drops its tree there.
fn lowered_on_small_stack(text: String) -> Vec<&'static str> {
    let lower = move || {
        let (module, _, mut said) = check(&text);
        if said.is_empty() {
            for index in PRELUDE.module().classes.len()..module.classes.len() {
                said.extend(lower_class(&module, ClassId(index as u32)).err().unwrap_or_default());
            }
        }
        said.iter().map(|diagnostic| diagnostic.code.as_str()).collect()
    };
    std::thread::Builder::new().stack_size(2 << 20).spawn(lower).unwrap().join().unwrap()
}

fn method(body: &str) -> String {
    format!("class C : rt_Texture;\nvoid lookup() {{\n{body}\n}}\n")
}

/// As deep as the parser lets pass.
const DEEP: usize = 1_000;

fn nested(open: &str, inner: &str, close: &str, depth: usize) -> String {
    open.repeat(depth) + inner + &close.repeat(depth)
}

#[test]
fn deep_expressions_pass() {
    for (open, inner, close) in [
        ("(", "1.0", ")"),
        ("- ", "rt_TextureUV.x", ""),
        ("1.0 + ", "2.0", ""),
        ("sin(", "0.5", ")"),
        ("max(1.0, ", "0.5", ")"),
        ("float(", "0.5", ")"),
        ("true ? 1.0 : ", "0.5", ""),
    ] {
        let text = method(&format!("rt_FloatTextureValue = {};", nested(open, inner, close, DEEP)));
        assert_eq!(lowered_on_small_stack(text), [""; 0], "{open}");
    }
    let indexed = nested("a[", "0", "]", DEEP);
    let text = method(&format!("int a[1] = {{ 0 }}; rt_FloatTextureValue = float({indexed});"));
    assert_eq!(lowered_on_small_stack(text), [""; 0]);
    let calls = nested("f(", "0.0", ")", DEEP);
    let text = "float f(float x) { return x; }\n".to_owned()
        + &method(&format!("rt_FloatTextureValue = {calls};"));
    assert_eq!(lowered_on_small_stack(text), [""; 0]);
    let constant = nested("sin(", "0.5", ")", DEEP);
    let text = format!("const float x = {constant};\n") + &method("rt_FloatTextureValue = x;");
    assert_eq!(lowered_on_small_stack(text), [""; 0]);
}

/// Nothing that checks, folds, lowers, copies or drops a chain recurses.
#[test]
fn chains_of_operators_have_any_length() {
    let varying = "rt_TextureUV.x";
    for (first, link, result) in [
        (varying, " + 1.0", "float(CHAIN)"),
        ("int(rt_TextureUV.x)", " + 1 - int(rt_TextureUV.y) * 2", "float(CHAIN)"),
        ("rt_TextureUV.x > 0.5", " == rt_TextureUV.y > 0.5", "float(CHAIN)"),
        (
            "rt_TextureUV.x > 0.5",
            " && rt_TextureUV.y > 0.5 || rt_TextureUV.x < 0.1",
            "float(CHAIN)",
        ),
        ("rt_TextureUV.x > 0.5", " && rand() > 0.5", "float(CHAIN)"),
        ("rand()", ", rand()", "(CHAIN)"),
        ("1", " + 1u", "float(CHAIN)"),
        ("1.0", " * 0.5 + 1.0", "CHAIN"),
    ] {
        let chain = first.to_owned() + &link.repeat(5_000);
        let text = method(&format!("rt_FloatTextureValue = {};", result.replace("CHAIN", &chain)));
        assert_eq!(lowered_on_small_stack(text), [""; 0], "{link}");
    }
    let constant = "1".to_owned() + &" + 1".repeat(20_000);
    let text = format!("const int n = {constant};\n") + &method("rt_FloatTextureValue = float(n);");
    assert_eq!(lowered_on_small_stack(text), [""; 0]);
    let wrong = "true".to_owned() + &" + 1".repeat(30_000);
    assert_eq!(
        lowered_on_small_stack(method(&format!("rt_FloatTextureValue = {wrong};"))),
        ["E0205"]
    );
    let unknown = "1".to_owned() + &" + 1".repeat(30_000) + " + unknown";
    assert_eq!(
        lowered_on_small_stack(method(&format!("rt_FloatTextureValue = {unknown};"))),
        ["E0201"]
    );
}

#[test]
fn deep_statements_pass() {
    for (open, close) in [
        ("{", "}"),
        ("if (rt_TextureUV.x > 0.5) {", "}"),
        ("for (int i = 0; i < 2; i++) ", ""),
        ("while (rt_TextureUV.x > 0.5) ", ""),
        ("switch (1) { case 1: ", "}"),
    ] {
        let body = nested(open, "rt_FloatTextureValue = 1.0;", close, DEEP / 2);
        let found = on_small_stack(method(&body));
        assert_eq!(found, [""; 0], "{open}");
    }
}

#[test]
fn long_chains_of_calls_pass_and_cycles_through_them_are_found() {
    let mut text = String::from("float f0(float x) { return x; }\n");
    for index in 1..3_000 {
        let _ = writeln!(text, "float f{index}(float x) {{ return f{}(x); }}", index - 1);
    }
    let calling = text.clone() + &method("rt_FloatTextureValue = f2999(1.0);");
    assert_eq!(on_small_stack(calling), [""; 0]);
    let closed = text.replace(
        "float f0(float x) { return x; }",
        "float f2999(float x);\nfloat f0(float x) { return f2999(x); }",
    );
    assert_eq!(on_small_stack(closed + &method("")), ["E0216"]);
}

#[test]
fn chains_of_constants_and_structs_pass() {
    let mut text = String::from("class C : rt_Texture;\nconst int c2999 = 1;\n");
    for index in (0..2_999).rev() {
        let _ = writeln!(text, "const int c{index} = c{};", index + 1);
    }
    text += "void lookup() { rt_FloatTextureValue = float(c0); }";
    assert_eq!(on_small_stack(text), [""; 0]);
    let mut text = String::from("struct S0 { float x; };\n");
    for index in 1..3_000 {
        let _ = writeln!(text, "struct S{index} {{ S{} x; }};", index - 1);
    }
    assert!(on_small_stack(text + &method("")).iter().all(|code| *code == "E0404"));
    let dimensions = "[1]".repeat(DEEP);
    assert_eq!(codes(&method(&format!("float x{dimensions};"))), ["E0404"]);
}

#[test]
fn large_values_are_refused() {
    let text =
        "struct A { float x[60000]; };\nstruct B { A x[60000]; };\nstruct D { B x[60000]; };\n";
    assert_eq!(codes(&(text.to_owned() + &method(""))), ["E0404"]);
    let mut text = String::from("class C : rt_Texture;\n");
    for index in 0..100 {
        let _ = writeln!(text, "private float a{index}[60000];");
    }
    assert_eq!(codes(&(text + "void lookup() { }")), ["E0404"]);
}

/// Of an array that nothing but its size is asked of nothing is kept, so that the limits on variables do not count.
#[test]
fn sizes_of_large_arrays_are_known() {
    let text = method(
        "float a[40][40][40]; mat4 b[900][70]; float c[300][300];
        rt_FloatTextureValue = float(a.length() * a[0].length() + b[0].length() + c[1].length());
        float d[b[0].length() - 60]; d[0] = 1.0; rt_FloatTextureValue += d[0];",
    );
    assert_eq!(lowered_on_small_stack(text), [""; 0]);
    let text = "struct A { vec4 m[512][512]; };\nconst int N = A[1](A(vec4[512][512](".to_owned();
    let row = format!("vec4[512]({})", vec!["vec4(1)"; 512].join(", "));
    let rows = vec!["r"; 512].join(", ");
    let text = format!("const vec4 r[512] = {row};\n{text}{rows}))).length();\n");
    let text = text + &method("rt_FloatTextureValue = float(N);");
    assert_eq!(lowered_on_small_stack(text), [""; 0]);
}

#[test]
fn large_tables_used_often_are_shared() {
    let mut text =
        String::from("const float a[16] = { 1,2,3,4,5,6,7,8,9,10,11,12,13,14,15,16 };\n");
    let _ = writeln!(text, "const float b[16][16] = {{ {} }};", vec!["a"; 16].join(", "));
    let _ = writeln!(text, "const float c[16][16][16] = {{ {} }};", vec!["b"; 16].join(", "));
    let _ = writeln!(text, "const float d[16][16][16][16] = {{ {} }};", vec!["c"; 16].join(", "));
    let body = "rt_FloatTextureValue += d[i][i][i][i];\n".repeat(5_000);
    text += &method(&format!("int i = int(rt_TextureUV.x);\n{body}"));
    assert_eq!(on_small_stack(text), [""; 0]);
}

#[test]
fn many_unknown_names_are_answered_soon() {
    let mut body = String::new();
    for index in 0..4_000 {
        let _ = writeln!(body, "int known{index} = unknown{index};");
    }
    assert_eq!(codes(&method(&body)).len(), 200);
}

#[test]
fn inherited_text_is_bounded() {
    let body = "rt_FloatTextureValue += 1.0;\n".repeat(1_000);
    let mut text = format!("class A : rt_Texture {{ void lookup() {{ {body} }} }};\n");
    for index in 0..200 {
        let _ = writeln!(text, "class B{index} : A {{ }};");
    }
    assert!(codes(&text).contains(&"E0406"));
}

#[test]
fn implied_methods_are_bounded() {
    let mut text = String::new();
    for index in 0..3_000 {
        let _ = write!(text, "class A{index}:rt_Material{{void BSDF(){{}}}};");
    }
    assert!(codes(&text).contains(&"E0406"));
}

#[test]
fn long_lists_are_answered_soon() {
    let labels: String = (0..3_000).map(|value| format!("case {value}: ")).collect();
    assert_eq!(codes(&method(&format!("switch (1) {{ {labels} break; }}"))), [""; 0]);
    let bases = vec!["rt_Texture"; 3_000].join(", ");
    assert_eq!(codes(&format!("class A : {bases};")).len(), 200);
    let arguments = vec!["1.0"; 3_000].join(", ");
    assert_eq!(codes(&method(&format!("rt_FloatTextureValue = sin({arguments});"))), ["E0211"]);
}
