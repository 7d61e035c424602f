//! Programs that are valid but too large.

use crate::harness::{lower, try_parsed};

#[track_caller]
fn check(text: &str, code: &str) {
    let errors = lower(text).err().unwrap_or_else(|| panic!("lowers:\n{text}"));
    let codes: Vec<&str> = errors.iter().map(|error| error.code.as_str()).collect();
    assert_eq!(codes, [code]);
}

/// `count` functions; `body` makes the body of each from the index of the one before.
fn chain(count: u32, body: impl Fn(u32) -> String) -> String {
    (1..count).map(|i| format!("float f{i}(float x) {{ {} }}\n", body(i - 1))).collect()
}

fn texture(helpers: &str, value: &str) -> String {
    format!("{helpers}\nclass T : rt_Texture;\nvoid lookup() {{ rt_FloatTextureValue = {value}; }}")
}

#[test]
fn doubling_functions() {
    let double = chain(40, |i| format!("return f{i}(x) + f{i}(x * 2.0);"));
    check(
        &texture(&format!("float f0(float x) {{ return x; }} {double}"), "f39(rt_TextureUV.x)"),
        "E0451",
    );
}

#[test]
fn doubling_functions_without_operations() {
    let double = chain(40, |i| format!("f{i}(x); f{i}(x); return x;"));
    check(
        &texture(&format!("float f0(float x) {{ return x; }} {double}"), "f39(rt_TextureUV.x)"),
        "E0451",
    );
}

#[test]
fn a_long_chain_of_functions() {
    let chain = chain(1000, |i| format!("return f{i}(x) + 1.0;"));
    check(
        &texture(&format!("float f0(float x) {{ return x; }} {chain}"), "f999(rt_TextureUV.x)"),
        "E0452",
    );
}

#[test]
fn deep_but_allowed_nesting_fits_the_stack() {
    // Tests run on stacks of 2 MB without optimisation. Calls in loops in branches have the largest
    // frames.
    let chain = chain(28, |i| {
        format!(
            "float s = 0.0; for (int j = 0; j < 2; j++) if (x > 0.0) s += -(x * f{i}(x)); return s;"
        )
    });
    let text =
        texture(&format!("float f0(float x) {{ return x; }} {chain}"), "f27(rt_TextureUV.x)");
    lower(&text).unwrap_or_else(|errors| panic!("{errors:?}"));
    let chain = self::chain(300, |i| {
        format!(
            "float s = 0.0; for (int j = 0; j < 2; j++) if (x > 0.0) s += -(x * f{i}(x)); return s;"
        )
    });
    check(
        &texture(&format!("float f0(float x) {{ return x; }} {chain}"), "f299(rt_TextureUV.x)"),
        "E0452",
    );
}

#[test]
fn large_members() {
    let text = "class T : rt_Texture; private float a[600000]; private float b[600000];
        void lookup() { rt_FloatTextureValue = a[1] + b[2]; }";
    check(text, "E0453");
}

#[test]
fn large_scratch() {
    let text = "class T : rt_Texture; scratch float a[40000]; scratch float b[40000];
        void lookup() { rt_FloatTextureValue = a[3] + b[4]; }";
    check(text, "E0453");
}

#[test]
fn large_variables() {
    let text = texture("", "0.0; float a[60000]; a[int(rt_TextureUV.x)] = 1.0");
    check(&text, "E0453");
}

#[test]
fn many_arrays_of_one_name() {
    let blocks = "{ float t[2]; t[i] = x; x += t[i + 1]; }\n".repeat(1000);
    let text = format!(
        "class T : rt_Texture; void lookup() {{ float x = 0.0; int i = int(rt_TextureUV.x); \
         {blocks} rt_FloatTextureValue = x; }}"
    );
    lower(&text).unwrap_or_else(|errors| panic!("{errors:?}"));
}

#[test]
fn deep_trees_are_lowered_or_refused() {
    let nest = |depth: usize, open: &str, inner: &str, close: &str| {
        format!("{}{inner}{}", open.repeat(depth), close.repeat(depth))
    };
    for depth in [40, 100, 180, 240] {
        for (open, inner, close) in [
            ("(u + ", "u", ")"),
            ("sin(", "u", ")"),
            ("max(u, f(", "u", "))"),
            ("(u > 0.5 ? u++ : ", "u", ")"),
            ("float(u > 1.0 && bool(u += ", "u", "))"),
            ("float(u > 1.0 || bool(f(", "u", ")))"),
            ("vec2(u, ", "u", ").y"),
            ("mix(u, 1.0, ", "u", ")"),
            ("float[2](u, ", "u", ")[int(u)]"),
            ("-", "u", ""),
            ("u = ", "u", ""),
            ("u * u + ", "u", ""),
        ] {
            let value = nest(depth, open, inner, close);
            try_lower(&format!("float u = rt_TextureUV.x; rt_FloatTextureValue = {value};"));
        }
        for (open, close) in [
            ("if (u > 0.0) {", "}"),
            ("if (u > 0.0) u += 1.0; else ", ""),
            ("for (int i = 0; i < 2; i++) {", "}"),
            ("while (f(u) > 0.0) {", "}"),
            ("switch (int(u)) { case 1: ", " break; }"),
            ("{", "}"),
            ("do {", "} while (u > 0.0);"),
        ] {
            let body = nest(depth, open, "u += 1.0;", close);
            try_lower(&format!("float u = rt_TextureUV.x; {body} rt_FloatTextureValue = u;"));
        }
    }
}

/// Lowers a body if the parser accepts it.
fn try_lower(body: &str) {
    let text = format!(
        "float f(float x) {{ if (x > 3.0) return 1.0; return x; }}\nclass T : rt_Texture;\nvoid lookup() {{ {body} }}"
    );
    if let Some(Err(errors)) = try_parsed(&text) {
        assert!(["E0451", "E0452"].contains(&errors[0].code.as_str()), "{errors:?}");
    }
}

/// With a look at all fields for each of them, this would take minutes.
#[test]
fn structs_with_many_fields() {
    let fields =
        |count: usize| -> String { (0..count).map(|index| format!("float f{index};\n")).collect() };
    let reads: String = (0..60_000).map(|index| format!("sum += whole.f{index};\n")).collect();
    let text = format!(
        "struct Whole {{ {} }};\nclass T : rt_Texture;\npublic Whole whole;\n\
         void lookup() {{ float sum = 0.0;\n{reads}rt_FloatTextureValue = sum; }}",
        fields(60_000)
    );
    lower(&text).unwrap_or_else(|errors| panic!("{errors:?}"));
    // Those of a variable are locals.
    let written: String =
        (0..2_000).map(|index| format!("s.f{index} = float({index});\n")).collect();
    let text = format!(
        "struct S {{ {} }};\nclass T : rt_Texture;\n\
         void lookup() {{ S s;\n{written}rt_FloatTextureValue = s.f0 + s.f1999; }}",
        fields(2_000)
    );
    lower(&text).unwrap_or_else(|errors| panic!("{errors:?}"));
}
