//! Mistakes that compile: the exact warnings, and similar text that is correct and gives none.

use expect_test::{Expect, expect};

fn check(text: &str, expected: &Expect) {
    expected.assert_eq(&rtsl_testing::checked::diagnostics(text));
}

/// Asserts that the texts give no diagnostics.
fn quiet(texts: &[&str]) {
    for text in texts {
        assert_eq!(rtsl_testing::checked::diagnostics(text), "", "{text}");
    }
}

/// A texture whose `lookup` has these statements after `x`, `i` and `v`.
fn statements(text: &str) -> String {
    format!(
        "class C : rt_Texture;\nfloat next(float x) {{ return x + 1.0; }}\nvoid lookup() {{\nfloat x = rt_TextureUV.x; int i = 0; vec2 v = rt_TextureUV;\n{text}\nrt_FloatTextureValue = x + float(i) + v.x; }}\n"
    )
}

#[test]
fn statements_without_effect() {
    check(
        &statements(
            "x == 2.0;\nv.x + 1.0;\nsin(x);\nx > 0.5 ? v : -v;\ni = 1, i == 2;\nfor (i == 0; i < 3; i + 1) x += 1.0;",
        ),
        &expect![[r#"
            warning[W0245]: this has no effect
              ┌─ shader.rtsl:5:1
              │
            5 │ x == 2.0;
              │ ^^^^^^^^ its value is not used
              │
              = help: `==` compares; to assign, write `=`

            warning[W0245]: this has no effect
              ┌─ shader.rtsl:6:1
              │
            6 │ v.x + 1.0;
              │ ^^^^^^^^^ its value is not used

            warning[W0245]: this has no effect
              ┌─ shader.rtsl:7:1
              │
            7 │ sin(x);
              │ ^^^^^^ its value is not used

            warning[W0245]: this has no effect
              ┌─ shader.rtsl:8:1
              │
            8 │ x > 0.5 ? v : -v;
              │ ^^^^^^^^^^^^^^^^ its value is not used

            warning[W0245]: this has no effect
              ┌─ shader.rtsl:9:8
              │
            9 │ i = 1, i == 2;
              │        ^^^^^^ its value is not used
              │
              = help: `==` compares; to assign, write `=`

            warning[W0245]: this has no effect
               ┌─ shader.rtsl:10:6
               │
            10 │ for (i == 0; i < 3; i + 1) x += 1.0;
               │      ^^^^^^ its value is not used
               │
               = help: `==` compares; to assign, write `=`

            warning[W0245]: this has no effect
               ┌─ shader.rtsl:10:21
               │
            10 │ for (i == 0; i < 3; i + 1) x += 1.0;
               │                     ^^^^^ its value is not used

        "#]],
    );
}

#[test]
fn bodies_that_are_a_semicolon() {
    check(
        &statements(
            "if (x > 0.5);\nfor (int n = 0; n < 10; n++); { x += 1.0; }\nwhile (x < 5.0);\nfor (int n = 0; n < 3; n++);\nwhile (i++ < 3); { x += 1.0; }",
        ),
        &expect![[r#"
            warning[W0245]: this loop has an empty body
              ┌─ shader.rtsl:6:29
              │
            6 │ for (int n = 0; n < 10; n++); { x += 1.0; }
              │                             ^ ------------- the block is not part of it, and runs once
              │                             │  
              │                             the loop ends here
              │
              = help: remove the `;`

            warning[W0245]: this loop has an empty body
              ┌─ shader.rtsl:9:16
              │
            9 │ while (i++ < 3); { x += 1.0; }
              │                ^ ------------- the block is not part of it, and runs once
              │                │  
              │                the loop ends here
              │
              = help: remove the `;`

            warning[W0245]: this `if` has an empty body
              ┌─ shader.rtsl:5:13
              │
            5 │ if (x > 0.5);
              │             ^ nothing depends on the condition
              │
              = help: remove the `;`

            warning[W0245]: this loop does nothing, or never ends
              ┌─ shader.rtsl:7:16
              │
            7 │ while (x < 5.0);
              │                ^ its body is empty
              │
              = note: nothing that the condition depends on changes

            warning[W0245]: this loop has no effect
              ┌─ shader.rtsl:8:28
              │
            8 │ for (int n = 0; n < 3; n++);
              │                            ^ its body is empty

        "#]],
    );
}

#[test]
fn statements_with_an_effect() {
    let effects = [
        "next(x);",
        "rand();",
        "modf(x, x);",
        "i++;",
        "x > 0.5 ? x = 1.0 : 2.0;",
        "i = 1, x = 2.0;",
        "v[i++];",
        ";",
        "{ }",
        "if (x > 0.5) { }",
        "if (x > 0.5)\n    ;",
        "if (x > 0.5) NOTHING(x);",
        "if (x > 0.5) i = 1; else ;",
        "for (int n = 0; n < 3; n++) { }",
        "for (; v[i] < x; i++);",
        "for (int n = 0; n < 3; n++, i += n);",
        "for (i = 3; i < 3;);",
        "while (i++ < 3);",
        "while (next(x) < 2.0);",
        "while (i++ < 3);\nx = 2.0;",
        "while (i++ < 3)\n    ;\n{ x = 2.0; }",
    ];
    for text in effects {
        quiet(&[&format!("#define NOTHING(x)\n{}", statements(text))]);
    }
}

#[test]
fn constants_that_are_not_numbers() {
    check(
        &statements(
            "x = sqrt(-1.0) + acos(2.0);\nx += pow(-2.0, 2.0) + 0.0 / 0.0;\nv = log(vec2(-1.0, 1.0));\nconst float one = 1.0; x = inversesqrt(one - 2.0);",
        ),
        &expect![[r#"
            warning[W0246]: this `sqrt` is not a number
              ┌─ shader.rtsl:5:5
              │
            5 │ x = sqrt(-1.0) + acos(2.0);
              │     ^^^^^^^^^^ always NaN
              │
              = note: if NaN is intended, write `uintBitsToFloat(0x7FC00000u)`
              = help: its argument must not be negative

            warning[W0246]: this `acos` is not a number
              ┌─ shader.rtsl:5:18
              │
            5 │ x = sqrt(-1.0) + acos(2.0);
              │                  ^^^^^^^^^ always NaN
              │
              = note: if NaN is intended, write `uintBitsToFloat(0x7FC00000u)`
              = help: its argument must lie between -1 and 1

            warning[W0246]: this `pow` is not a number
              ┌─ shader.rtsl:6:6
              │
            6 │ x += pow(-2.0, 2.0) + 0.0 / 0.0;
              │      ^^^^^^^^^^^^^^ always NaN
              │
              = note: if NaN is intended, write `uintBitsToFloat(0x7FC00000u)`
              = help: its first argument must not be negative; for integer powers, multiply

            warning[W0246]: this quotient is not a number
              ┌─ shader.rtsl:6:23
              │
            6 │ x += pow(-2.0, 2.0) + 0.0 / 0.0;
              │                       ^^^^^^^^^ always NaN
              │
              = note: if NaN is intended, write `uintBitsToFloat(0x7FC00000u)`

            warning[W0246]: this `log` is not a number
              ┌─ shader.rtsl:7:5
              │
            7 │ v = log(vec2(-1.0, 1.0));
              │     ^^^^^^^^^^^^^^^^^^^^ always NaN
              │
              = note: if NaN is intended, write `uintBitsToFloat(0x7FC00000u)`
              = help: its argument must be positive

            warning[W0246]: this `inversesqrt` is not a number
              ┌─ shader.rtsl:8:28
              │
            8 │ const float one = 1.0; x = inversesqrt(one - 2.0);
              │                            ^^^^^^^^^^^^^^^^^^^^^^ always NaN
              │
              = note: if NaN is intended, write `uintBitsToFloat(0x7FC00000u)`
              = help: its argument must not be negative

        "#]],
    );
    check(
        "const float root = sqrt(-4.0);\nclass C : rt_Texture;\npublic float angle = asin(-1.5);\nvoid lookup() { rt_FloatTextureValue = angle * root; }\n",
        &expect![[r#"
            warning[W0246]: this `sqrt` is not a number
              ┌─ shader.rtsl:1:20
              │
            1 │ const float root = sqrt(-4.0);
              │                    ^^^^^^^^^^ always NaN
              │
              = note: if NaN is intended, write `uintBitsToFloat(0x7FC00000u)`
              = help: its argument must not be negative

            warning[W0246]: this `asin` is not a number
              ┌─ shader.rtsl:3:22
              │
            3 │ public float angle = asin(-1.5);
              │                      ^^^^^^^^^^ always NaN
              │
              = note: if NaN is intended, write `uintBitsToFloat(0x7FC00000u)`
              = help: its argument must lie between -1 and 1

        "#]],
    );
}

#[test]
fn constants_that_are_numbers() {
    for text in [
        "x = 1.0 / 0.0;",
        "x = uintBitsToFloat(0x7FC00000u);",
        "x = sqrt(uintBitsToFloat(0x7FC00000u));",
        "x = sqrt(x - 5.0);",
        "x = sqrt(0.0) + acos(-1.0) + pow(-2.0, x);",
        "i = isnan(x) ? 1 : 2 / 0;",
        "x = normalize(v).x;",
    ] {
        quiet(&[&statements(text)]);
    }
}

/// The search for NaN leaves long constants alone, while required constants are evaluated all the
/// same.
#[test]
fn the_search_for_nan_is_bounded() {
    let deep = format!("{}1.0{}", "sin(".repeat(120), ")".repeat(120));
    let many = format!("x += {deep};\n").repeat(60);
    let text =
        statements(&format!("{many}float table[int(2.0 + sin(1.0))]; table[0] = x; x = table[0];"));
    quiet(&[&text]);
}

#[test]
fn state_that_gets_lost() {
    check(
        "class L : rt_Light;\nvoid emission() { rt_LightColor = color(1.0); }\nclass P : rt_Primitive;\nvoid facing() { rt_GeometricNormal = vec3(1.0, 0.0, 0.0); }\nvoid intersect() { if (hit(1.0)) facing(); rt_TextureUV.x = 0.5; }\n",
        &expect![[r#"
            warning[W0335]: `rt_LightColor` is written in `emission`, and the value is discarded
              ┌─ shader.rtsl:2:19
              │
            2 │ void emission() { rt_LightColor = color(1.0); }
              │                   ^^^^^^^^^^^^^ lost when the method returns
              │
              = note: `emission` passes out `rt_EmissionColor`
              = help: set it in `illumination`

            warning[W0335]: `rt_TextureUV` is written in `intersect`, and the value is discarded
              ┌─ shader.rtsl:5:44
              │
            5 │ void intersect() { if (hit(1.0)) facing(); rt_TextureUV.x = 0.5; }
              │                                            ^^^^^^^^^^^^ lost when the method returns
              │
              = note: `intersect` passes out `rt_HitDistance`
              = help: set it in `computeTextureCoordinates`
              = help: a `scratch` member carries a value to the methods after `intersect`

            warning[W0335]: `rt_GeometricNormal` is written in `intersect`, and the value is discarded
              ┌─ shader.rtsl:4:17
              │
            4 │ void facing() { rt_GeometricNormal = vec3(1.0, 0.0, 0.0); }
              │                 ^^^^^^^^^^^^^^^^^^ lost when the method returns
              │
              = note: `intersect` passes out `rt_HitDistance`
              = note: `intersect` reaches this through `facing`
              = help: set it in `computeNormal` and `generateSample`
              = help: a `scratch` member carries a value to the methods after `intersect`

        "#]],
    );
}

#[test]
fn state_that_does_not_get_lost() {
    quiet(&[
        // The method reads it.
        "class M : rt_Material;\nvoid shade() { rt_BSDFValue = color(0.5); rt_SampleColor = rt_BSDFValue; }\n",
        // One of the methods that reach the helper passes the variable out.
        "class P : rt_Primitive;\nvoid facing() { rt_GeometricNormal = vec3(1.0); }\nvoid intersect() { hit(1.0); facing(); }\nvoid computeNormal() { facing(); }\n",
        // One method calls another for a part of the values that it passes out.
        "class M : rt_Material;\nvoid sampleBSDF() { rt_LightDirection = rt_ShadingNormal; rt_PDF = 1.0; rt_BSDFValue = color(0.5); }\nvoid shade() { sampleBSDF(); rt_SampleColor = trace(rt_HitPoint, rt_LightDirection); }\n",
        // Another shader may read it.
        "class M : rt_Material;\npublic rt_Material base;\nvoid shade() { rt_LightDirection = rt_ShadingNormal; rt_SampleColor = base.BSDF(); }\n",
        // The class has two roles, one of which has the variable.
        "class B : rt_Primitive, rt_Material { void intersect() { hit(1.0); } void emission() { rt_EmissionColor = color(1.0); } };\n",
    ]);
}

#[test]
fn primitives_that_no_ray_hits() {
    check(
        "class A : rt_Primitive;\nvoid intersect() { rt_HitDistance = 1.0; }\nclass B : rt_Primitive;\nscratch float t;\nvoid intersect() { t = 1.0; }\n",
        &expect![[r#"
            warning[W0336]: this `intersect` never calls `hit`
              ┌─ shader.rtsl:2:1
              │
            2 │ void intersect() { rt_HitDistance = 1.0; }
              │ ^^^^^^^^^^^^^^^^ no ray meets this primitive
              │
              = note: setting `rt_HitDistance` does not accept a hit
              = help: offer the distance: `hit(t)`

            warning[W0336]: this `intersect` never calls `hit`
              ┌─ shader.rtsl:5:1
              │
            5 │ void intersect() { t = 1.0; }
              │ ^^^^^^^^^^^^^^^^ no ray meets this primitive
              │
              = help: offer the distance: `hit(t)`

        "#]],
    );
    quiet(&[
        "class A : rt_Primitive;\nvoid intersect() { }\n",
        "class A : rt_Primitive;\nvoid offer(float t) { hit(t); }\nvoid intersect() { offer(1.0); }\n",
    ]);
    // The reported mistake may be the cause.
    assert_eq!(
        rtsl_testing::checked::codes("class A : rt_Primitive;\nvoid intersect() { hitt(1.0); }\n"),
        ["E0201"]
    );
}

#[test]
fn constructors_as_in_cpp() {
    check(
        "class Ball : rt_Primitive;\nprivate float squared;\nvoid Ball(float r) { squared = r * r; }\nvoid intersect() { hit(squared); }\n",
        &expect![[r#"
            warning[W0337]: `Ball` is an ordinary function, and is never called
              ┌─ shader.rtsl:3:6
              │
            3 │ void Ball(float r) { squared = r * r; }
              │      ^^^^ the class's name has no special meaning
              │
              = help: the function that initializes an instance is called: `constructor`

        "#]],
    );
    check(
        "class Ball : rt_Primitive;\nBall(float r) { }\nfree() { }\n",
        &expect![[r#"
            error[E0101]: function `Ball` has no result type
              ┌─ shader.rtsl:2:1
              │
            2 │ Ball(float r) { }
              │ ^^^^ expected a type before the name
              │
              = help: the function that initializes an instance is called: `constructor`

            error[E0101]: function `free` has no result type
              ┌─ shader.rtsl:3:1
              │
            3 │ free() { }
              │ ^^^^ expected a type before the name
              │
              = help: for a function without result: `void `

            warning[W0340]: `Ball` is a primitive without `intersect`
              ┌─ shader.rtsl:1:1
              │
            1 │ class Ball : rt_Primitive;
              │ ^^^^^^^^^^^^^^^^^^^^^^^^^^ no ray meets it
              │
              = help: write `void intersect()`

        "#]],
    );
    quiet(&[
        "class Ball : rt_Texture;\nfloat Ball(float r) { return r * r; }\nvoid lookup() { rt_FloatTextureValue = Ball(2.0); }\n",
        "float Ball(float r) { return r * r; }\nclass C : rt_Texture;\nvoid lookup() { rt_FloatTextureValue = Ball(2.0); }\n",
    ]);
}

#[test]
fn angles_in_degrees() {
    let shade = |angle: &str| {
        format!(
            "class M : rt_Material;\npublic float spread = 90.0;\nvoid shade() {{ illuminance(rt_HitPoint, rt_ShadingNormal, {angle}) {{ rt_SampleColor += rt_LightColor * spread; }} }}\n"
        )
    };
    check(
        &shade("90"),
        &expect![[r#"
            warning[W0338]: `illuminance` takes an angle in radians, and 90 is more than a full turn
              ┌─ shader.rtsl:3:59
              │
            3 │ void shade() { illuminance(rt_HitPoint, rt_ShadingNormal, 90) { rt_SampleColor += rt_LightColor * spread; } }
              │                                                           ^^ every light is within this angle
              │
              = help: if the angle is in degrees: `radians(90.0)`

        "#]],
    );
    quiet(&[&shade("3.2"), &shade("6.2832"), &shade("radians(90.0)"), &shade("spread")]);
}
