//! The checker computes constant expressions as lowered code would, to the bit.

use crate::harness::eval_with;

#[test]
fn constants_match_computed_values() {
    let expressions = [
        "1.0 / 3.0 + 2.0 * 0.1",
        "float(7 / 2 + -7 % 3 + (1 << 33) + (-16 >> 2) + (5 / 0))",
        "float(7u * 3000000000u >> 3)",
        "float(int(3e9) + int(-2.7)) + float(uint(-1.5))",
        "float(bool(0.5)) + float(true ^^ false)",
        "float(1 < 2 && 2.0 >= 3.0 || !false)",
        "false ? 1.0 : 2",
        "vec4(1, vec2(2, 3), 4u).wzyx.y",
        "(vec3(1, 2, 3) * 2.0 - 1.0 / vec3(4)).z",
        "-vec2(ivec2(vec2(1.9, -1.9))).y",
        "float(vec2(1, 2) == vec2(1, 2)) + float(ivec2(1, 2) != ivec2(1, 3))",
        "(mat2(1, 2, 3, 4) * vec2(5, 6)).y",
        "(vec2(5, 6) * mat2(1, 2, 3, 4)).y",
        "(mat2x3(1, 2, 3, 4, 5, 6) * mat3x2(1, 2, 3, 4, 5, 6))[2][1]",
        "(mat3(2.0) + mat3(mat2(1, 2, 3, 4)))[1][0]",
        "mat3(mat4(7.0))[2][2] + mat4(mat2(3.0))[3][3]",
        "vec4(mat2(1, 2, 3, 4)).z",
        "float[](1.0, 2.0, 3.0)[1 + 1]",
        "float[2][2](float[](1.0, 2.0), float[](3.0, 4.0))[1][0]",
        "rgb(color(0.25) * 3 + color(1, 2, 3) / 2.0).z",
        "luminance(color(0.2, 0.4, 0.6))",
        "sin(1.0) + cos(2.0) * tan(0.5)",
        "pow(2.5, 3.5) + exp(1.5) - log(7.0) + exp2(0.3) - log2(0.7)",
        "sqrt(2.0) + inversesqrt(3.0)",
        "normalize(vec3(1, 2, 3)).y + length(vec2(3, 4)) + dot(vec3(1), vec3(2))",
        "cross(vec3(1, 2, 3), vec3(4, 5, 6)).x + reflect(vec2(1, -1), vec2(0, 1)).y",
        "mix(vec2(1), vec2(2), bvec2(true, false)).x + mix(1.0, 2.0, 0.25)",
        "clamp(ivec2(5, -5), 0, 3).x + sign(-2.0) + fract(-0.25) + mod(-1.0, 3.0)",
        "min(1.0, 0.0 / 0.0) + max(vec2(1), 2.0).x",
        "floor(-0.5) + ceil(0.5) + trunc(-1.5) + round(2.5) + roundEven(3.5)",
        "fma(1.1, 2.2, 3.3)",
        "transpose(mat2x3(1, 2, 3, 4, 5, 6))[2][0] + determinant(mat2(1, 2, 3, 4))",
        "inverse(mat3(2, 0, 1, 0, 3, 0, 1, 0, 4))[0][2]",
        "matrixCompMult(mat2(1, 2, 3, 4), mat2(5, 6, 7, 8))[1][0] + outerProduct(vec2(1, 2), vec2(3, 4))[1][0]",
        "float(any(lessThan(vec2(1, 2), vec2(2, 1)))) + float(all(not(bvec2(false))))",
        "float(floatBitsToInt(1.5)) + intBitsToFloat(0x3fc00000) + uintBitsToFloat(0x40000000u)",
        "float(bitCount(0xF0F0) + findMSB(1000) + findLSB(8u) + bitfieldExtract(0xABCD, 4, 8))",
        "float(packUnorm4x8(vec4(0.1, 0.2, 0.3, 0.4)) >> 8) + unpackHalf2x16(0x3C003555u).x",
        "ldexp(0.75, 3) + float(isnan(0.0 / 0.0)) + float(isinf(1.0 / 0.0))",
        "noise(vec3(1.5, 2.5, 3.25)) + fbm(vec2(0.3, 0.7), 3)",
        "float(hash(7u) >> 8) + perpendicularTo(vec3(1, 2, 3)).x + float(dominantAxis(vec3(1, -3, 2)))",
    ];
    for expression in expressions {
        // A `const` member must be constant; a variable is computed by code.
        let known = format!("const float known = {expression};");
        let body = format!(
            "precise float computed = {expression};\n\
             result = float(floatBitsToInt(known) == floatBitsToInt(computed));"
        );
        assert_eq!(eval_with(&known, &body, 0.0), 1.0, "{expression}");
    }
}
