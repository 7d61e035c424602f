//! Expressions: operators, conversions, constructors, evaluation order, built-ins.

use rtsl_spec::Method;

use crate::harness::{class, count, eval, eval_with, text_of};

#[track_caller]
fn check(expression: &str, expected: f32) {
    assert_eq!(eval(&format!("result = {expression};"), 3.0), expected, "{expression}");
}

#[test]
fn arithmetic() {
    check("u * 2.0 + 1.0", 7.0);
    check("-u / 2.0", -1.5);
    check("float(int(u) % 2 + 7 / 2)", 4.0);
    check("float(~int(u) & 255)", 252.0);
    check("float((1u << int(u)) ^ 1u)", 9.0);
    check("float(-16 >> int(u))", -2.0);
    check("float(int(u) == 3 && !(u < 3.0))", 1.0);
    check("float(true ^^ u > 2.0)", 0.0);
}

#[test]
fn conversions_are_implicit_and_explicit() {
    check("1 + u", 4.0);
    check("float(uint(u) + 1)", 4.0);
    check("float(bool(u))", 1.0);
    check("float(int(2.9) + int(-2.9))", 0.0);
    check("float(vec2(1, 2).y)", 2.0);
}

#[test]
fn vectors_and_swizzles() {
    check("vec3(u, 1.0, 2.0).zyx.z", 3.0);
    check("dot(vec3(1.0, 2.0, 3.0), vec3(u))", 18.0);
    check("vec4(vec2(1.0, 2.0), u, 4.0).b", 3.0);
    check("vec2(vec4(1.0, 2.0, 3.0, 4.0)).y", 2.0);
    check("(vec2(1.0, 2.0) * u + 1.0).y", 7.0);
    check("float(vec2(1.0, u) == vec2(1.0, 3.0))", 1.0);
    check("float(vec2(1.0, u) != vec2(1.0, 3.0))", 0.0);
    assert_eq!(eval("vec3 v = vec3(1.0); v.zx = vec2(u, 5.0); result = v.x * v.z;", 3.0), 15.0);
    assert_eq!(eval("vec4 v; v.wzyx.xy.y = u; result = v.z;", 3.0), 3.0);
}

#[test]
fn matrices() {
    check("(mat2(1.0, 2.0, 3.0, 4.0) * vec2(u, 1.0)).y", 10.0);
    check("(vec2(u, 1.0) * mat2(1.0, 2.0, 3.0, 4.0)).y", 13.0);
    check("(mat2(1.0, 2.0, 3.0, 4.0) * mat2(u, 0.0, 0.0, 1.0))[0][1]", 6.0);
    check("(mat2x3(1.0, 2.0, 3.0, 4.0, 5.0, 6.0) * vec2(1.0, u)).z", 21.0);
    check("mat3(u)[2][2] + mat3(u)[1][2]", 3.0);
    check("mat3(mat2(u))[2][2] + mat2(mat3(u))[1][1]", 4.0);
    check("transpose(mat2x3(1.0, 2.0, 3.0, 4.0, 5.0, 6.0))[2][1]", 6.0);
    check("determinant(inverse(mat2(u, 0.0, 0.0, 2.0)))", 1.0 / 6.0);
    check("matrixCompMult(mat2(2.0), mat2(u))[1][1]", 6.0);
    check("(mat2(2.0) / 2.0 + 1.0)[0][1]", 1.0);
    assert_eq!(eval("mat2 m = mat2(u); m++; m[1] *= 2.0; result = m[1].x + m[1].y;", 3.0), 10.0);
}

#[test]
fn sums_of_products_are_from_the_left() {
    let text = "class T : rt_Texture;
        void lookup() {
            mat3 m = mat3(rt_TextureUV.x, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0);
            rt_FloatTextureValue = (m * rt_TextureUVW).x;
            rt_TextureColor = color(1.0);
        }";
    let text = text_of(&class(text), Method::Lookup);
    let order: Vec<&str> =
        text.split_whitespace().filter(|word| ["multiply", "add"].contains(word)).collect();
    assert!(order.ends_with(&["add"]) && order.len() > 4, "{text}");
}

#[test]
fn colors() {
    check("rgb(color(1.0, u, 2.0) * 2.0).y", 6.0);
    check("rgb(1.0 - color(vec3(u)) / color(2.0)).z", -0.5);
    check("float(color(u) == color(3.0))", 1.0);
    check("rgb(mix(color(1.0), color(u), 0.5)).x", 2.0);
}

#[test]
fn logical_operators_evaluate_what_is_needed() {
    let helper = "private float calls; bool yes() { calls += 1.0; return true; }";
    for (expression, calls) in [
        ("u > 1.0 && yes()", 1.0),
        ("u < 1.0 && yes()", 0.0),
        ("u > 1.0 || yes()", 0.0),
        ("u < 1.0 || yes()", 1.0),
        ("u < 1.0 ? yes() : false", 0.0),
        ("yes() ^^ yes()", 2.0),
    ] {
        let body = format!("bool b = {expression}; result = calls;");
        assert_eq!(eval_with(helper, &body, 3.0), calls, "{expression}");
    }
}

#[test]
fn evaluation_is_from_left_to_right() {
    let helper = "private float log; float note(float x) { log = log * 10.0 + x; return x; }
        float three(float a, float b, float c) { return a * b * c; }";
    for (expression, log) in [
        ("note(1.0) + note(2.0) * note(3.0)", 123.0),
        ("three(note(3.0), note(1.0), note(2.0))", 312.0),
        ("vec3(note(1.0), note(2.0), note(3.0)).x", 123.0),
        ("(note(2.0), note(1.0))", 21.0),
    ] {
        let body = format!("float x = {expression}; result = log;");
        assert_eq!(eval_with(helper, &body, 0.0), log, "{expression}");
    }
    // The left operand has the value from before the change by the right one.
    assert_eq!(eval("result = u + u++ * 2.0;", 3.0), 9.0);
    assert_eq!(eval("result = 1.0; result += (result = 5.0);", 0.0), 6.0);
}

#[test]
fn assignments_and_steps_have_values() {
    assert_eq!(eval("float a; float b; a = b = u; result = a + b;", 3.0), 6.0);
    assert_eq!(eval("result = u++ * 10.0 + u;", 3.0), 34.0);
    assert_eq!(eval("result = --u * 10.0 + u;", 3.0), 22.0);
    assert_eq!(eval("int i = 7; i <<= 2u; i |= 1; i %= 10; result = float(i);", 0.0), 9.0);
    assert_eq!(eval("vec2 v = vec2(u); v *= mat2(2.0); v.x -= 1.0; result = v.x;", 3.0), 5.0);
}

#[test]
fn structs_are_values() {
    let helper = "struct Inner { vec2 a; int b; }; struct Outer { Inner x; Inner y[2]; float z; };";
    let body = "Outer o = Outer(Inner(vec2(1.0, u), 2), Inner[2](Inner(vec2(4.0), 5), \
                Inner(vec2(6.0, 7.0), 8)), 9.0);
        Outer p = o;
        p.y[1].a.y += 1.0;
        result = p.y[1].a.y + o.x.a.y * 10.0 + float(o.y[1].b) * 100.0 + o.z * 1000.0
            + (o == p ? 10000.0 : 0.0);";
    assert_eq!(eval_with(helper, body, 3.0), 8.0 + 30.0 + 800.0 + 9000.0);
}

#[test]
fn builtins_on_scalars_and_vectors() {
    check("max(vec2(u, 1.0), 2.0).y", 2.0);
    check("sqrt(vec2(4.0, u * u)).y", 3.0);
    check("float(any(lessThan(vec2(u, 1.0), vec2(2.0))))", 1.0);
    check("float(all(lessThan(vec2(u, 1.0), vec2(2.0))))", 0.0);
    check("float(floatBitsToInt(1.0) == 1065353216)", 1.0);
    check("fma(u, 2.0, 1.0)", 7.0);
    check("length(vec2(u, 4.0))", 5.0);
    assert_eq!(eval("float whole; result = modf(u + 0.25, whole) + whole * 10.0;", 3.0), 30.25);
    assert_eq!(
        eval("vec2 whole; result = modf(vec2(u, 2.5), whole).y + whole.x * 10.0;", 3.0),
        30.5
    );
    assert_eq!(eval("int e; result = frexp(u, e) * 8.0 + float(e);", 3.0), 8.0);
}

#[test]
fn precise_marks_what_contributes() {
    let text = "class T : rt_Texture;
        float square(float x) { return x * x; }
        void lookup() {
            float a = rt_TextureUV.x * 3.0;
            float b = rt_TextureUV.x / 5.0;
            precise float c = square(a) + 1.0;
            rt_FloatTextureValue = b - c;
            rt_TextureColor = color(1.0);
        }";
    let text = text_of(&class(text), Method::Lookup);
    let precise: Vec<&str> = text.lines().filter(|line| line.contains("precise")).collect();
    assert_eq!(precise.len(), 4, "load, two products and a sum:\n{text}");
    assert!(
        text.lines().any(|line| line.contains("divide") && !line.contains("precise")),
        "{text}"
    );
    assert_eq!(count(&text, "subtract"), 1, "{text}");
}
