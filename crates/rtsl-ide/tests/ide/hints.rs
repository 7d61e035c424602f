//! Hints between the characters: conversions, uniform variables, contracted operations.

use expect_test::expect;
use rtsl_ide::hints;

use crate::{DISC, document};

/// The lines of a text that have hints, with these in them.
fn hinted(text: &str) -> String {
    let document = document(text);
    let mut shown = text.to_owned();
    for hint in hints(&document).iter().rev() {
        shown.insert_str(hint.offset as usize, &format!("‹{}›", hint.label));
    }
    let lines: Vec<&str> =
        shown.lines().filter(|line| line.contains('‹')).map(str::trim_start).collect();
    lines.join("\n")
}

#[test]
fn the_disc_has_hints() {
    expect![[r#"
            it.place = o.xy + it.distance * d.xy‹fma›;
            int steps‹: uniform› = 3;
            float offset‹: uniform› = radius * ‹float(›steps‹)›;
            float far = dot(at.place, at.place)‹fma› * LIMIT;
            if (far < squared + offset‹fma› && hit(at.distance)) where = at.place;"#]]
    .assert_eq(&hinted(DISC));
}

#[test]
fn what_branches_of_some_rays_assign_is_varying() {
    let text = "class A : rt_Texture;
public float scale = 1.0;
public int count = 3;
float own() { return 2.0 * scale; }
float ray() { return rt_TextureUV.x; }
void lookup() {
    float a = scale;
    float b = own();
    float c = ray();
    float d = a;
    if (rt_TextureUV.x > 0.5) d = 1.0;
    float e = 0.0;
    for (int i = 0; i < count; ++i) e += a;
    float f = 0.0;
    for (int i = 0; i < count; ++i) {
        if (rt_TextureUV.y > float(i)) break;
        f += a;
    }
    float g[2];
    g[0] = 1.0;
    g[int(rt_TextureUV.x)] = 2.0;
    precise float h = a * b + c;
    rt_FloatTextureValue = a * b + c * d - (e + f + g[1] + h);
}
";
    expect![[r#"
            float a‹: uniform› = scale;
            float b‹: uniform› = own();
            float e‹: uniform› = 0.0;
            for (int i‹: uniform› = 0; i < count; ++i) e += a;
            rt_FloatTextureValue = a * b + c * d‹fma› - (e + f + g[1] + h);"#]]
    .assert_eq(&hinted(text));
}

/// Each function calls the next a hundred times, and each variable has the value of the one after it: neither the
/// number of paths through the calls nor the length of the chain multiplies the work.
#[test]
fn calls_and_chains_of_variables_are_looked_at_once() {
    let mut text = "class A : rt_Texture;\nfloat f0() { return rt_TextureUV.x; }\n".to_owned();
    for level in 1..=9 {
        let calls = format!("f{}() + ", level - 1).repeat(100);
        text += &format!("float f{level}() {{ return {calls}0.0; }}\n");
    }
    let count = 1_000;
    text += "void lookup() {\n";
    text += &(0..=count).map(|i| format!("float a{i} = 0.0;\n")).collect::<String>();
    text += "for (int i = 0; i < 3; ++i) {\n";
    text += &(0..count).map(|i| format!("a{i} = a{};\n", i + 1)).collect::<String>();
    text += &format!("a{count} = f9();\n}}\nrt_FloatTextureValue = a0;\n}}\n");
    expect!["for (int i‹: uniform› = 0; i < 3; ++i) {"].assert_eq(&hinted(&text));
}
