//! Values at the edges, by GLSL's formulas.

use crate::prelude::evaluate::{evaluate_with, value};

#[test]
fn edges_follow_the_formulas() {
    for (expression, wanted) in [
        // y < x ? y : x and x < y ? y : x
        ("min(0.0 / x, 1.0)", f32::NAN),
        ("min(1.0, 0.0 / x)", 1.0),
        ("max(0.0 / x, 1.0)", f32::NAN),
        ("max(1.0, 0.0 / x)", 1.0),
        ("clamp(0.0 / x, 0.0, 1.0)", f32::NAN),
        ("clamp(3.0, 2.0, 1.0)", 1.0),
        ("sign(0.0 / x)", 0.0),
        ("sign(-2.0)", -1.0),
        ("step(1.0, 1.0)", 1.0),
        ("step(1.0, 0.0 / x)", 1.0),
        ("mix(1.0, 3.0, 0.25)", 1.5),
        ("mix(1.0, 3.0, true)", 3.0),
        ("mix(1.0, 0.0 / x, false)", 1.0),
        ("smoothstep(1.0, 3.0, 2.0)", 0.5),
        ("fract(-0.25)", 0.75),
        ("mod(-1.0, 3.0)", 2.0),
        ("mod(5.5, -2.0)", -0.5),
        ("round(2.5)", 2.0),
        ("roundEven(-3.5)", -4.0),
        ("trunc(-2.7)", -2.0),
        ("pow(0.0, 0.0)", 1.0),
        ("pow(0.0, 2.0)", 0.0),
        ("pow(0.0, -2.0)", f32::INFINITY),
        ("pow(-1.0, 2.0)", f32::NAN),
        ("pow(2.0, 128.0)", f32::INFINITY),
        ("pow(2.0, -127.0)", 0.0),
        ("pow(2.0, -126.0)", f32::MIN_POSITIVE),
        ("pow(0.5, 126.0)", f32::MIN_POSITIVE),
        ("pow(1.0e-45, 1.0)", 0.0),
        ("pow(1.0e-45, -0.5) == pow(1.0e-45 * 4194304.0, -0.5) * 2048.0 ? 1.0 : 0.0", 1.0),
        ("pow(1.0e-40, 0.0)", 1.0),
        ("pow(0.5, 1.0 / x)", 0.0),
        ("pow(0.5, -1.0 / x)", f32::INFINITY),
        ("pow(2.0, 1.0 / x)", f32::INFINITY),
        ("pow(2.0, -1.0 / x)", 0.0),
        ("pow(2.0, 1.0e38)", f32::INFINITY),
        ("pow(2.0, -1.0e38)", 0.0),
        ("pow(0.999, 3.0e38)", 0.0),
        ("pow(1.0, -1.0 / x)", 1.0),
        ("pow(2.0, 0.0 / x)", f32::NAN),
        ("pow(0.0 / x, 2.0)", f32::NAN),
        ("pow(0.0 / x, 0.0)", 1.0),
        ("pow(1.0 / x, 2.0)", f32::INFINITY),
        ("pow(1.0 / x, -2.0)", 0.0),
        ("exp(-88.0)", 0.0),
        ("exp2(-126.0)", f32::MIN_POSITIVE),
        ("exp2(-126.5)", 0.0),
        ("exp2(10.0)", 1024.0),
        ("log2(0.125)", -3.0),
        ("log(0.0)", f32::NEG_INFINITY),
        ("log(-1.0)", f32::NAN),
        ("asin(1.5)", f32::NAN),
        ("atan(0.0, -1.0)", std::f32::consts::PI),
        ("atan(0.0, 0.0)", 0.0),
        ("atan(1.0 / x, 1.0 / x)", std::f32::consts::FRAC_PI_4),
        ("atanh(1.0)", f32::INFINITY),
        ("ldexp(1.0, -149)", f32::from_bits(1)),
        ("ldexp(3.0, -150)", f32::from_bits(2)),
        ("ldexp(1.0, 1000)", f32::INFINITY),
        ("ldexp(1.0e-40, 130) == 1.0e-40 * exp2(65.0) * exp2(65.0) ? 1.0 : 0.0", 1.0),
        ("float(isnan(0.0 / x)) + 2.0 * float(isinf(1.0 / x))", 3.0),
        ("uintBitsToFloat(floatBitsToUint(-0.0))", -0.0),
        ("float(floatBitsToUint(0.0 / x) == 0x7fc00000u)", 1.0),
        ("float(floatBitsToInt(-1.0))", -1_082_130_432.0),
        ("normalize(-3.0)", -1.0),
        ("length(vec3(2.0, 3.0, 6.0))", 7.0),
        ("distance(vec2(1.0), vec2(4.0, 5.0))", 5.0),
        ("cross(vec3(1.0, 0.0, 0.0), vec3(0.0, 1.0, 0.0)).z", 1.0),
        ("faceforward(2.0, 1.0, 1.0)", -2.0),
        ("reflect(vec2(1.0, -1.0), vec2(0.0, 1.0)).y", 1.0),
        ("length(refract(vec2(0.8, -0.6), vec2(0.0, 1.0), 1.5))", 0.0),
        ("float(dominantAxis(vec3(-3.0, 3.0, 1.0)))", 0.0),
        ("float(dominantAxis(vec3(1.0, 2.0, -4.0)))", 2.0),
        ("luminance(color(1.0))", 1.0),
        ("rgb(pow(color(2.0), 3.0)).y", 8.0),
        ("rgb(mix(color(1.0), color(3.0), 0.5)).z", 2.0),
        ("rgb(step(1.0, color(0.5, 1.5, 2.0))).x", 0.0),
        ("float(lessThan(vec2(1.0, 3.0), vec2(2.0)).y)", 0.0),
        ("float(any(bvec3(false, false, true)) && !all(bvec2(true, false)))", 1.0),
    ] {
        // x is 0 but the compiler does not know it.
        check(expression, value(expression), wanted);
    }
}

#[test]
fn out_arguments_are_set() {
    for (body, wanted) in [
        ("float w; float f = modf(-2.75, w); return w * 10.0 + f;", -20.75),
        ("vec2 w; vec2 f = modf(vec2(1.5, -0.25), w); return w.x + f.y;", 0.75),
        ("int e; float s = frexp(-12.0, e); return s + float(e);", 3.25),
        ("int e; float s = frexp(1.0e-40, e); return ldexp(s, e) * 1.0e30;", 1.0e-40 * 1.0e30),
        (
            "ivec3 e; vec3 s = frexp(vec3(0.0, 1.0, 8.0), e); return float(e.z * 100 + e.y) + s.x;",
            401.0,
        ),
        (
            "uint c; uint s = uaddCarry(0xffffffffu, 2u, c); return float(s) + 10.0 * float(c);",
            11.0,
        ),
        (
            "uint b; uint s = usubBorrow(1u, 2u, b); return float(s == 0xffffffffu) + 10.0 * float(b);",
            11.0,
        ),
        ("uint h; uint l; umulExtended(0x80000000u, 6u, h, l); return float(h) + float(l);", 3.0),
        ("int h; int l; imulExtended(-2, 3, h, l); return float(h * 10 + l);", -16.0),
    ] {
        let declarations = format!("float probe() {{ {body} }}");
        let found = evaluate_with(&declarations, "probe()", &[[0.0; 2]])[0];
        check(body, found, wanted);
    }
}

#[test]
fn bits_of_integers() {
    for (expression, wanted) in [
        ("bitfieldExtract(0xabcdu, 4, 8)", 0xbc),
        ("uint(bitfieldExtract(0xf0, 4, 4))", 0xffff_ffff),
        ("uint(bitfieldExtract(-1, 3, 0))", 0),
        ("bitfieldExtract(0xabcdu, 0, 32)", 0xabcd),
        ("bitfieldInsert(0xffffffffu, 0u, 8, 8)", 0xffff_00ff),
        ("bitfieldInsert(5u, 9u, 3, 0)", 5),
        ("bitfieldReverse(0x00000005u)", 0xa000_0000),
        ("uint(bitCount(0xf0f0f0ffu))", 20),
        ("uint(bitCount(-1))", 32),
        ("uint(findLSB(0x00a0u))", 5),
        ("uint(findLSB(0))", 0xffff_ffff),
        ("uint(findMSB(0x00a0u))", 7),
        ("uint(findMSB(-1))", 0xffff_ffff),
        ("uint(findMSB(-129))", 7),
        ("uint(findMSB(0u))", 0xffff_ffff),
        ("packUnorm2x16(vec2(1.0, 0.5))", 0x8000_ffff),
        ("packSnorm2x16(vec2(-1.0, 2.0))", 0x7fff_8001),
        ("packUnorm4x8(vec4(0.0, 1.0, 0.5, -3.0))", 0x0080_ff00),
        ("packSnorm4x8(vec4(-1.0, 1.0, 0.0, 0.0))", 0x0000_7f81),
        ("packHalf2x16(vec2(1.0, -2.0))", 0xc000_3c00),
        ("packHalf2x16(vec2(65520.0, 6.0e-8))", 0x0001_7c00),
        ("packHalf2x16(vec2(65519.0, 2049.0))", 0x6800_7bff),
        ("packHalf2x16(unpackHalf2x16(0x83ff0001u))", 0x83ff_0001),
        ("packHalf2x16(unpackHalf2x16(0xfc007e00u))", 0xfc00_7e00),
        ("packUnorm4x8(unpackUnorm4x8(0x12345678u))", 0x1234_5678),
        ("packSnorm4x8(unpackSnorm4x8(0x12f4567fu))", 0x12f4_567f),
        ("packUnorm2x16(unpackUnorm2x16(0x12345678u))", 0x1234_5678),
        ("packSnorm2x16(unpackSnorm2x16(0x8001f678u))", 0x8001_f678),
    ] {
        let (low, high) =
            (format!("float({expression} & 0xffffu)"), format!("float({expression} >> 16)"));
        let found = value(&low) as u32 | (value(&high) as u32) << 16;
        assert_eq!(found, wanted, "{expression} is {found:#x}, wanted {wanted:#x}");
    }
}

#[test]
fn inverses_undo_matrices() {
    for (size, matrix, determinant) in [
        (2, "mat2(2.0, 1.0, 5.0, 3.0)", 1.0),
        (3, "mat3(2.0, 0.0, 1.0, 1.0, 3.0, 2.0, 1.0, 1.0, 4.0)", 18.0),
        (
            4,
            "mat4(2.0, 1.0, 0.0, 3.0, 0.0, 1.0, 4.0, 1.0, 5.0, 0.0, 1.0, 2.0, 1.0, 1.0, 1.0, 3.0)",
            16.0,
        ),
    ] {
        check(matrix, value(&format!("determinant({matrix})")), determinant);
        for column in 0..size {
            for row in 0..size {
                let entry = format!("({matrix} * inverse({matrix}))[{column}][{row}]");
                let wanted = if column == row { 1.0 } else { 0.0 };
                assert!((value(&entry) - wanted).abs() < 1e-5, "{entry} is {}", value(&entry));
            }
        }
    }
    check("outer", value("outerProduct(vec2(2.0, 3.0), vec3(5.0, 7.0, 11.0))[2][1]"), 33.0);
    check("transpose", value("transpose(mat2x3(1.0, 2.0, 3.0, 4.0, 5.0, 6.0))[1][1]"), 5.0);
    check("product", value("matrixCompMult(mat2(1.0, 2.0, 3.0, 4.0), mat2(3.0))[1][1]"), 12.0);
}

fn check(expression: &str, found: f32, wanted: f32) {
    let same = found == wanted || (found.is_nan() && wanted.is_nan());
    assert!(same, "{expression} is {found:e}, wanted {wanted:e}");
}
