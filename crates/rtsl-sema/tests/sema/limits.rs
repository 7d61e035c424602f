//! Texts that are deep, long or multiply each other's length: each is answered quickly, on a small
//! stack.

use std::fmt::Write;

use rtsl_testing::checked::{codes, nested, texture};

/// Checks a text on a stack of 2 MB.
fn on_small_stack(text: String) -> Vec<&'static str> {
    let thread = std::thread::Builder::new().stack_size(2 << 20);
    thread.spawn(move || codes(&text)).unwrap().join().unwrap()
}

/// Nearly the deepest nesting that the parser accepts.
const DEEP: usize = 1_000;

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
        let found = on_small_stack(texture(&body));
        assert_eq!(found, [""; 0], "{open}");
    }
}

#[test]
fn long_chains_of_calls_pass_and_cycles_through_them_are_found() {
    let mut text = String::from("float f0(float x) { return x; }\n");
    for index in 1..3_000 {
        let _ = writeln!(text, "float f{index}(float x) {{ return f{}(x); }}", index - 1);
    }
    let calling = text.clone() + &texture("rt_FloatTextureValue = f2999(1.0);");
    assert_eq!(on_small_stack(calling), [""; 0]);
    let closed = text.replace(
        "float f0(float x) { return x; }",
        "float f2999(float x);\nfloat f0(float x) { return f2999(x); }",
    );
    assert_eq!(on_small_stack(closed + &texture("")), ["E0216"]);
}

#[test]
fn chains_of_constants_and_structs_are_accepted() {
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
    assert!(on_small_stack(text + &texture("")).iter().all(|code| *code == "E0404"));
    let dimensions = "[1]".repeat(DEEP);
    assert_eq!(codes(&texture(&format!("float x{dimensions};"))), ["E0404"]);
}

#[test]
fn large_values_are_refused() {
    let text =
        "struct A { float x[60000]; };\nstruct B { A x[60000]; };\nstruct D { B x[60000]; };\n";
    assert_eq!(codes(&(text.to_owned() + &texture(""))), ["E0404"]);
    let mut text = String::from("class C : rt_Texture;\n");
    for index in 0..100 {
        let _ = writeln!(text, "private float a{index}[60000];");
    }
    assert_eq!(codes(&(text + "void lookup() { }")), ["E0404"]);
}

#[test]
fn large_tables_used_often_are_shared() {
    let mut text =
        String::from("const float a[16] = { 1,2,3,4,5,6,7,8,9,10,11,12,13,14,15,16 };\n");
    let _ = writeln!(text, "const float b[16][16] = {{ {} }};", vec!["a"; 16].join(", "));
    let _ = writeln!(text, "const float c[16][16][16] = {{ {} }};", vec!["b"; 16].join(", "));
    let _ = writeln!(text, "const float d[16][16][16][16] = {{ {} }};", vec!["c"; 16].join(", "));
    let body = "rt_FloatTextureValue += d[i][i][i][i];\n".repeat(5_000);
    text += &texture(&format!("int i = int(rt_TextureUV.x);\n{body}"));
    assert_eq!(on_small_stack(text), [""; 0]);
}

#[test]
fn many_unknown_names_are_answered_soon() {
    let mut body = String::new();
    for index in 0..4_000 {
        let _ = writeln!(body, "int known{index} = unknown{index};");
    }
    assert_eq!(codes(&texture(&body)).len(), 200);
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
    assert_eq!(codes(&texture(&format!("switch (1) {{ {labels} break; }}"))), [""; 0]);
    let bases = vec!["rt_Texture"; 3_000].join(", ");
    assert_eq!(codes(&format!("class A : {bases};")).len(), 200);
    let arguments = vec!["1.0"; 3_000].join(", ");
    assert_eq!(codes(&texture(&format!("rt_FloatTextureValue = sin({arguments});"))), ["E0211"]);
}

#[test]
fn chains_of_generic_functions_pass() {
    let mut text = String::from("genType f0(genType x) { return x; }\n");
    for index in 1..1_000 {
        let _ = writeln!(text, "genType f{index}(genType x) {{ return f{}(x); }}", index - 1);
    }
    let calls = "rt_FloatTextureValue = f999(1.0) + f999(rt_TextureUV).x + f999(vec4(1.0)).y;";
    assert_eq!(on_small_stack(text + &texture(calls)), [""; 0]);
}

#[test]
fn choices_that_parameters_carry_are_bounded() {
    let choices: Vec<String> = (0..5_000).map(|index| format!("Choice{index}")).collect();
    let mut text = format!("enum Long {{ {} }};\nclass T : rt_Texture;\n", choices.join(", "));
    let (few, many) = (10, 1_000);
    let mut add = |members: std::ops::Range<usize>| {
        for index in members {
            let _ = writeln!(text, "public Long p{index} = Choice7;");
        }
        let mut codes = on_small_stack(text.clone());
        // Nothing reads the members.
        codes.retain(|code| !["W0340", "W0343"].contains(code));
        codes
    };
    assert_eq!(add(0..few), [""; 0]);
    let refused = add(few..many);
    assert!(refused.len() > 100 && refused.iter().all(|code| *code == "E0235"), "{refused:?}");
}

#[test]
fn assertions_that_never_end_are_answered_soon() {
    let text = "static_assert(".repeat(50_000);
    assert!(!on_small_stack(text.clone()).is_empty());
    assert!(!on_small_stack(format!("class T : rt_Texture; void lookup() {{ {text}")).is_empty());
}
