//! Expressions of variables.

use expect_test::expect;

use crate::common::{frame, replay};

#[test]
fn expressions() {
    let mut replay = replay(
        "struct Hit { float t; vec3 n; };
class Expressed : rt_Texture;
public float scale = 0.5;
void lookup() {
    Hit hits[2];
    hits[1].t = 4.0;
    hits[1].n = vec3(3.0, 4.0, 0.0);
    int k = 1;
    uint bits = 7u;
    bool isSet = true;
    mat3 m = mat3(2.0);
    float table[3];
    table[2] = 1.5;
    color c = color(0.25, 0.5, 1.0);
    rt_TextureColor = c * hits[k].t * scale * float(bits) * m[0][0] * table[2] * (isSet ? 1.0 : 0.0);
}",
    );
    replay.jump(usize::MAX);
    let call = frame(&replay);
    let texts = [
        "k",
        "hits[1].n.y",
        "hits[k].n.yx",
        "table[2]",
        "m[1]",
        "c.r",
        "rt_TextureUV",
        "rt_TextureUV.x + scale",
        "length(hits[1].n) * hits[k].t",
        "k + int(bits)",
        "isSet && k > 0",
        "m * vec3(1.0, 0.0, 0.0)",
        "table[k + 1]",
        "luminance(c)",
        "noise(vec3(0.5))",
        "c == c",
        // Errors.
        "missing",
        "missing + 1.0",
        "hits[1].x",
        "hits",
        "hits[1] + 1.0",
        "k +",
        "1.0); discard(",
        "(k",
        "",
        "k = 2",
        "square(2.0)",
        "k; k",
    ];
    let shown = texts.iter().map(|text| match replay.evaluate(text, &call) {
        Ok(value) => format!("{text} -> {value}"),
        Err(error) => format!("{text} -> error: {error}"),
    });
    expect![[r#"
        k -> 1
        hits[1].n.y -> 4.0
        hits[k].n.yx -> (4.0, 3.0)
        table[2] -> 1.5
        m[1] -> (0.0, 2.0, 0.0)
        c.r -> 0.25
        rt_TextureUV -> (0.0, 0.0)
        rt_TextureUV.x + scale -> 0.5
        length(hits[1].n) * hits[k].t -> 20.0
        k + int(bits) -> 8
        isSet && k > 0 -> true
        m * vec3(1.0, 0.0, 0.0) -> (2.0, 0.0, 0.0)
        table[k + 1] -> 1.5
        luminance(c) -> 0.48295
        noise(vec3(0.5)) -> 0.1206125
        c == c -> true
        missing -> error: `missing` can't be evaluated: there is no `missing` here
        missing + 1.0 -> error: `missing + 1.0` can't be evaluated: there is no `missing` here
        hits[1].x -> error: `hits[1]` has no part `x`
        hits -> [{t = 0.0, n = (0.0, 0.0, 0.0)}, {t = 4.0, n = (3.0, 4.0, 0.0)}]
        hits[1] + 1.0 -> error: `hits[1]` is a struct: an expression can have its fields only
        k + -> error: `k +` can't be evaluated: expected an expression, found `)`
        1.0); discard( -> error: the brackets of the expression don't match
        (k -> error: the brackets of the expression don't match
         -> error: the expression is empty
        k = 2 -> error: an expression can't set a variable: what has run stays as it is
        square(2.0) -> error: `square(2.0)` can't be evaluated: there is no function `square`
        k; k -> error: an expression can't have `;`"#]]
    .assert_eq(&shown.collect::<Vec<_>>().join("\n"));
}
