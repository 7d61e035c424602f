//! Text that compiles and does nothing, or not what was meant: the exact warnings, and similar text without one.

use expect_test::{Expect, expect};
use rtsl_testing::checked::{codes, diagnostics};

fn check(text: &str, expected: &Expect) {
    expected.assert_eq(&diagnostics(text));
}

/// Asserts that each text gives this warning and no other.
fn warns(code: &str, texts: &[&str]) {
    for text in texts {
        assert_eq!(codes(text), [code], "{text}\n{}", diagnostics(text));
    }
}

/// Asserts that the texts give no diagnostics.
fn quiet(texts: &[&str]) {
    for text in texts {
        assert_eq!(diagnostics(text), "", "{text}");
    }
}

#[test]
fn classes_without_the_method_of_their_role() {
    check(
        "class Empty : rt_Material;\n",
        &expect![[r#"
            warning[W0340]: `Empty` is a material without `BSDF`, `emission` or `shade`
              ┌─ shader.rtsl:1:1
              │
            1 │ class Empty : rt_Material;
              │ ^^^^^^^^^^^^^^^^^^^^^^^^^^ it is black
              │
              = help: write `void BSDF()`

        "#]],
    );
    check(
        "class Black : rt_Material;\nvoid sampleBSDF() { rt_LightDirection = rt_ShadingNormal; rt_BSDFValue = color(1.0); }\nvoid evaluatePDF() { rt_PDF = 1.0; }\n",
        &expect![[r#"
            warning[W0340]: `Black` is a material without `BSDF`
              ┌─ shader.rtsl:1:1
              │
            1 │ class Black : rt_Material;
              │ ^^^^^^^^^^^^^^^^^^^^^^^^^^ it is black
              │
              = note: `sampleBSDF` and `evaluatePDF` choose directions for a `BSDF`
              = help: write `void BSDF()`; it may leave `rt_BSDFValue` black if all light is scattered by deltas

        "#]],
    );
    warns(
        "W0340",
        &[
            "class A : rt_Integrator;",
            "class A : rt_Texture;",
            "class A : rt_Light;",
            "class A : rt_Camera;",
            "class A : rt_Primitive; void computeBounds() { rt_BoundMin = vec3(0.0); rt_BoundMax = vec3(1.0); }",
        ],
    );
    quiet(&[
        "class A : rt_Material; void emission() { rt_EmissionColor = color(1.0); }",
        "class A : rt_Primitive; void intersect() { }",
        // A class below has the method.
        "class A : rt_Texture { public float a; }; class B : A { void lookup() { rt_FloatTextureValue = a; } };",
    ]);
}

#[test]
fn defaults_outside_of_their_range() {
    check(
        "class A : rt_Texture;\n[[min 0, max 1]] public float a = 2.0;\nvoid lookup() { rt_FloatTextureValue = a; }\n",
        &expect![[r#"
            warning[W0341]: the default of `a` is outside of its range
              ┌─ shader.rtsl:2:35
              │
            2 │ [[min 0, max 1]] public float a = 2.0;
              │                                   ^^^ 2, where the range is 0 to 1
              │
              = help: scenes that set this value are refused; change the default or the range

        "#]],
    );
    warns(
        "W0341",
        &[
            "class A : rt_Texture; private float b; constructor([[max 1]] float a = 2.0) { b = a; } void lookup() { rt_FloatTextureValue = b; }",
        ],
    );
    let with = |member: &str| {
        format!(
            "class A : rt_Texture; {member} void lookup() {{ rt_FloatTextureValue = float(a.x); }}"
        )
    };
    for member in [
        "[[min 1]] public vec3 a = vec3(2.0, 0.5, 2.0);",
        "[[max -1]] public vec2 a = vec2(0.0);",
        "[[min 0]] public ivec2 a = ivec2(0, -1);",
    ] {
        warns("W0341", &[&with(member)]);
    }
    for member in
        ["[[min 0.1, max 0.3]] public vec2 a = vec2(0.1, 0.3);", "[[min 0]] public vec2 a;"]
    {
        quiet(&[&with(member)]);
    }
}

#[test]
fn loops_without_an_end() {
    check(
        "class A : rt_Texture;\nvoid lookup() { while (true) { rt_FloatTextureValue = 1.0; } }\n",
        &expect![[r#"
            warning[W0342]: this loop never ends
              ┌─ shader.rtsl:2:17
              │
            2 │ void lookup() { while (true) { rt_FloatTextureValue = 1.0; } }
              │                 ^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^ its condition is always true, and nothing in it leaves it
              │
              = help: leave it by `break` or `return`, or give it a condition that becomes false

        "#]],
    );
    let loops = |text: &str| {
        format!(
            "class A : rt_Texture; void lookup() {{ int i = 0; {text} rt_FloatTextureValue = 1.0; }}"
        )
    };
    for text in [
        "for (;;) { i++; switch (i) { case 3: break; } }",
        "do { for (int k = 0; k < 3; k++) { if (k > 1) break; i += k; } } while (1 < 2);",
    ] {
        let found = codes(&loops(text));
        assert!(found.contains(&"W0342"), "{text}: {found:?}");
    }
    for text in [
        "for (;;) { i++; if (i > 3) break; }",
        "while (true) { if (i++ > 3) { switch (i) { case 3: return; } } if (i > 9) break; }",
        "while (i < 3) i++;",
    ] {
        quiet(&[&loops(text)]);
    }
}

#[test]
fn members_that_nothing_reads() {
    check(
        "class A : rt_Texture;\npublic float forgotten = 1.0;\nprivate float b;\nvoid lookup() { rt_FloatTextureValue = 1.0; }\n",
        &expect![[r#"
            warning[W0343]: nothing reads the parameter `forgotten`
              ┌─ shader.rtsl:2:14
              │
            2 │ public float forgotten = 1.0;
              │              ^^^^^^^^^^^^^^^ without effect
              │
              = help: read it in a method, or remove it

            warning[W0343]: nothing reads the member `b`
              ┌─ shader.rtsl:3:15
              │
            3 │ private float b;
              │               ^ without effect
              │
              = help: read it in a method, or remove it

        "#]],
    );
    let constructed = |parameter: &str, body: &str| {
        format!(
            "class A : rt_Texture; private float b; constructor({parameter}) {{ b = {body}; }} void lookup() {{ rt_FloatTextureValue = b; }}"
        )
    };
    check(
        &constructed("float a, float c = 1.0", "c"),
        &expect![[r#"
        warning[W0343]: nothing reads the parameter `a`
          ┌─ shader.rtsl:1:52
          │
        1 │ class A : rt_Texture; private float b; constructor(float a, float c = 1.0) { b = c; } void lookup() { rt_FloatTextureValue = b; }
          │                                                    ^^^^^^^ without effect
          │
          = help: read it in a method, or remove it

    "#]],
    );
    // Words of a description mean nothing.
    warns(
        "W0343",
        &[
            "class A : rt_Texture; [[doc \"Has no effect.\"]] public float a; void lookup() { rt_FloatTextureValue = 1.0; }",
        ],
    );
    quiet(&[&constructed("[[unused]] float a", "1.0"), &constructed("float a", "a")]);
    quiet(&[
        "class A : rt_Texture; [[unused]] public float a; void lookup() { rt_FloatTextureValue = 1.0; }",
        "class A : rt_Primitive; public float height = 1.0; void intersect() { }",
        "class A : rt_Texture; public rt_Texture a; void lookup() { rt_FloatTextureValue = isSet(a) ? 1.0 : 0.5; }",
        "class A : rt_Texture; public float a[]; void lookup() { rt_FloatTextureValue = float(a.length()); }",
    ]);
}

#[test]
fn quotients_of_integers() {
    check(
        "class A : rt_Texture;\nvoid lookup() { rt_FloatTextureValue = float(1 / 2) + 3 / 4 * rt_TextureUV.x; }\n",
        &expect![[r#"
            warning[W0344]: this quotient is 0
              ┌─ shader.rtsl:2:55
              │
            2 │ void lookup() { rt_FloatTextureValue = float(1 / 2) + 3 / 4 * rt_TextureUV.x; }
              │                                                       ^^^^^ the quotient of integers is rounded towards 0
              │
              = help: divide floats: `1.0 / 2.0`

            warning[W0344]: this quotient is 0
              ┌─ shader.rtsl:2:46
              │
            2 │ void lookup() { rt_FloatTextureValue = float(1 / 2) + 3 / 4 * rt_TextureUV.x; }
              │                                              ^^^^^ the quotient of integers is rounded towards 0
              │
              = help: divide floats: `1.0 / 2.0`

        "#]],
    );
    check(
        "class A : rt_Texture;\nvoid lookup() { rt_FloatTextureValue = 3 / -2 * rt_TextureUV.x; }\n",
        &expect![[r#"
            warning[W0344]: this quotient is -1
              ┌─ shader.rtsl:2:40
              │
            2 │ void lookup() { rt_FloatTextureValue = 3 / -2 * rt_TextureUV.x; }
              │                                        ^^^^^^ the quotient of integers is rounded towards 0
              │
              = help: divide floats: `1.0 / 2.0`
              = help: convert the quotient if it is meant: `float(3 / 2)`

        "#]],
    );
    let quotient = |text: &str| {
        format!(
            "class A : rt_Texture; const int N = 7; void lookup() {{ float a = {text}; rt_FloatTextureValue = a * float(9 / 3); }}"
        )
    };
    for text in ["N / 2", "1 + 5 / 2", "vec2(5 / 2).x"] {
        warns("W0344", &[&quotient(text)]);
    }
    for text in
        ["float(N / 2)", "N / 2 * 2", "6 / 2", "int(rt_TextureUV.x) / 2", "vec2(float(5 / 2)).x"]
    {
        quiet(&[&quotient(text)]);
    }
    quiet(&[
        "class A : rt_Texture; void lookup() { float a[5 / 2]; a[1 / 2] = 1.0; rt_FloatTextureValue = a[0] + float(4 / 2); }",
        "class A : rt_Texture; void lookup() { rt_FloatTextureValue = float(0 / 2) + 1.0 / 2.0; }",
    ]);
}

#[test]
fn bounds_without_extent() {
    let bounds = |least: &str, greatest: &str| {
        format!(
            "class A : rt_Primitive;\nvoid intersect() {{ hit(1.0); }}\nvoid computeBounds() {{ rt_BoundMin = {least}; rt_BoundMax = {greatest}; }}\n"
        )
    };
    check(
        &bounds("vec3(1.0)", "vec3(-1.0)"),
        &expect![[r#"
        warning[W0345]: no ray meets this box
          ┌─ shader.rtsl:3:38
          │
        3 │ void computeBounds() { rt_BoundMin = vec3(1.0); rt_BoundMax = vec3(-1.0); }
          │                                      ^^^^^^^^^                ---------- that of the greatest corner
          │                                      │                         
          │                                      a coordinate of the least corner is beyond
          │
          = help: exchange them: renderers test only rays that meet the box

    "#]],
    );
    let sized = |member: &str| {
        let text = bounds("vec3(size)", "vec3(1.0, 1.0, -size)");
        text.replace("Primitive;", &format!("Primitive; {member}"))
    };
    check(
        &sized("public float size = 1.0;"),
        &expect![[r#"
        warning[W0345]: no ray meets this box
          ┌─ shader.rtsl:3:38
          │
        3 │ void computeBounds() { rt_BoundMin = vec3(size); rt_BoundMax = vec3(1.0, 1.0, -size); }
          │                                      ^^^^^^^^^^                --------------------- that of the greatest corner
          │                                      │                          
          │                                      a coordinate of the least corner is beyond
          │
          = note: this is so where the parameters have their defaults
          = help: exchange them: renderers test only rays that meet the box

    "#]],
    );
    quiet(&[
        &sized("public float size = -1.0;"),
        &sized("public float size;"),
        &sized("private float size = 1.0;"),
        &sized("public float size = 1.0; constructor() { size = -size; }"),
        &bounds("vec3(-1.0)", "vec3(1.0)"),
        &bounds("vec3(0.0)", "vec3(1.0, 1.0, 0.0)"),
        &bounds("vec3(1.0)", "vec3(2.0); rt_BoundMin = vec3(-1.0)"),
    ]);
}

#[test]
fn changes_that_are_always_zero() {
    check(
        "class A : rt_Material;\nattribute vec3 corner = vec3(1.0);\nvoid BSDF() { rt_BSDFValue = color(fwidth(corner)); }\n",
        &expect![[r#"
            warning[W0346]: this `fwidth` is always 0
              ┌─ shader.rtsl:3:43
              │
            3 │ void BSDF() { rt_BSDFValue = color(fwidth(corner)); }
              │                                           ^^^^^^ the same over the width of the filter
              │
              = note: changes are known of what is computed from `rt_TextureUV`, `rt_TextureUVW` and `rt_HitPoint`
              = note: members and attributes are constants in this respect

        "#]],
    );
    let texture = |value: &str| {
        format!(
            "class A : rt_Texture; public texture float a = 1.0; public float b = 1.0; void lookup() {{ float x = b; rt_FloatTextureValue = a + b + x + {value}; }}"
        )
    };
    for value in ["dFdx(b)", "dFdy(rt_du)", "fwidth(2.0 * rt_ShadingNormal.x)"] {
        warns("W0346", &[&texture(value)]);
    }
    for value in ["dFdx(rt_TextureUV.x)", "fwidth(a)", "fwidth(x)", "fwidth(rt_HitPoint.x * b)"] {
        quiet(&[&texture(value)]);
    }
}

#[test]
fn outputs_that_nobody_keeps() {
    check(
        "class A : rt_Texture;\noutput float height;\nvoid lookup() { height = 1.0; rt_TextureColor = color(height); }\n",
        &expect![[r#"
            warning[W0347]: the output `height` is never kept
              ┌─ shader.rtsl:2:14
              │
            2 │ output float height;
              │              ^^^^^^ images are made of the outputs of integrators
              │
              = help: make it `scratch`, or a variable of the method

        "#]],
    );
    quiet(&["class A : rt_Integrator; output float a; void radiance() { a = 1.0; }"]);
}

#[test]
fn functions_that_nobody_calls() {
    check(
        "class A : rt_Material;\nvoid displace() { rt_HitPoint += 0.1 * rt_ShadingNormal; }\nvoid BSDF() { rt_BSDFValue = color(0.1); }\n",
        &expect![[r#"
            warning[W0348]: `displace` is not an interface method, and is never called
              ┌─ shader.rtsl:2:1
              │
            2 │ void displace() { rt_HitPoint += 0.1 * rt_ShadingNormal; }
              │ ^^^^^^^^^^^^^^^ what it sets is lost
              │
              = note: hosts call `shade`, `BSDF`, `sampleBSDF`, `evaluatePDF`, `emission` and `presence`
              = help: call it in a method, or remove it

        "#]],
    );
    quiet(&[
        "class A : rt_Texture; void set() { rt_FloatTextureValue = 1.0; } void lookup() { set(); }",
        "class A : rt_Texture { void set() { rt_FloatTextureValue = 1.0; } }; class B : A { void lookup() { set(); } };",
    ]);
}
