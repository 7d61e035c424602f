//! Texts that are deep or long: each is lowered quickly, on a small stack.

use rtsl_lower::lower_class;
use rtsl_sema::hir::ClassId;
use rtsl_sema::prelude::prelude;
use rtsl_testing::checked::{check, nested, texture};

/// Checks and lowers a text on a stack of 2 MB, and drops its tree there.
fn lowered_on_small_stack(text: String) -> Vec<&'static str> {
    let lower = move || {
        let (module, _, mut said) = check(&text);
        if said.is_empty() {
            for index in prelude().checked.module().classes.len()..module.classes.len() {
                said.extend(
                    lower_class(&module, ClassId(index as u32), None).err().unwrap_or_default(),
                );
            }
        }
        said.iter().map(|diagnostic| diagnostic.code.as_str()).collect()
    };
    std::thread::Builder::new().stack_size(2 << 20).spawn(lower).unwrap().join().unwrap()
}

/// Nearly the deepest nesting that the parser accepts.
const DEEP: usize = 1_000;

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
        let text =
            texture(&format!("rt_FloatTextureValue = {};", nested(open, inner, close, DEEP)));
        assert_eq!(lowered_on_small_stack(text), [""; 0], "{open}");
    }
    let indexed = nested("a[", "0", "]", DEEP);
    let text = texture(&format!("int a[1] = {{ 0 }}; rt_FloatTextureValue = float({indexed});"));
    assert_eq!(lowered_on_small_stack(text), [""; 0]);
    let calls = nested("f(", "0.0", ")", DEEP);
    let text = "float f(float x) { return x; }\n".to_owned()
        + &texture(&format!("rt_FloatTextureValue = {calls};"));
    assert_eq!(lowered_on_small_stack(text), [""; 0]);
    let constant = nested("sin(", "0.5", ")", DEEP);
    let text = format!("const float x = {constant};\n") + &texture("rt_FloatTextureValue = x;");
    assert_eq!(lowered_on_small_stack(text), [""; 0]);
}

/// Checking, folding, lowering, cloning and dropping a chain does not recurse.
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
        let text = texture(&format!("rt_FloatTextureValue = {};", result.replace("CHAIN", &chain)));
        assert_eq!(lowered_on_small_stack(text), [""; 0], "{link}");
    }
    let constant = "1".to_owned() + &" + 1".repeat(20_000);
    let text =
        format!("const int n = {constant};\n") + &texture("rt_FloatTextureValue = float(n);");
    assert_eq!(lowered_on_small_stack(text), [""; 0]);
    let wrong = "true".to_owned() + &" + 1".repeat(30_000);
    assert_eq!(
        lowered_on_small_stack(texture(&format!("rt_FloatTextureValue = {wrong};"))),
        ["E0205"]
    );
    let unknown = "1".to_owned() + &" + 1".repeat(30_000) + " + unknown";
    assert_eq!(
        lowered_on_small_stack(texture(&format!("rt_FloatTextureValue = {unknown};"))),
        ["E0201"]
    );
}

/// An array of which only the size is used is not stored, so that the limits on variables do not
/// apply.
#[test]
fn sizes_of_large_arrays_are_known() {
    let text = texture(
        "float a[40][40][40]; mat4 b[900][70]; float c[300][300];
        rt_FloatTextureValue = float(a.length() * a[0].length() + b[0].length() + c[1].length());
        float d[b[0].length() - 60]; d[0] = 1.0; rt_FloatTextureValue += d[0];",
    );
    assert_eq!(lowered_on_small_stack(text), [""; 0]);
    let text = "struct A { vec4 m[512][512]; };\nconst int N = A[1](A(vec4[512][512](".to_owned();
    let row = format!("vec4[512]({})", vec!["vec4(1)"; 512].join(", "));
    let rows = vec!["r"; 512].join(", ");
    let text = format!("const vec4 r[512] = {row};\n{text}{rows}))).length();\n");
    let text = text + &texture("rt_FloatTextureValue = float(N);");
    assert_eq!(lowered_on_small_stack(text), [""; 0]);
}
