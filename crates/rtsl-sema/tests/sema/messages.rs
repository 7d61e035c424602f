//! The exact text of diagnostics whose wording matters most.

use expect_test::{Expect, expect};

fn check(text: &str, expected: &Expect) {
    expected.assert_eq(&rtsl_testing::checked::diagnostics(text));
}

#[test]
fn state_of_another_role() {
    check(
        "class Pinhole : rt_Camera;\nvoid generateRay() {\n    rt_RayOrigin = vec3(rt_TextureUV, 0.0);\n}\n",
        &expect![[r#"
            error[E0305]: camera cannot access a state variable of primitive, texture or material
              ┌─ shader.rtsl:3:25
              │
            3 │     rt_RayOrigin = vec3(rt_TextureUV, 0.0);
              │                         ^^^^^^^^^^^^ `rt_TextureUV` is not a state variable of camera
              │
              = note: the class `Pinhole` is a camera
              = note: `rt_TextureUV` is a state variable of primitive, texture and material

        "#]],
    );
}

#[test]
fn method_of_another_role() {
    check(
        "class Pinhole : rt_Camera;\nvoid shade() { }\n",
        &expect![[r#"
        error[E0303]: camera cannot have an interface method of material
          ┌─ shader.rtsl:2:6
          │
        2 │ void shade() { }
          │      ^^^^^ `shade` is a method of material
          │
          = note: the class `Pinhole` is a camera
          = note: its methods are `generateRay`

    "#]],
    );
}

#[test]
fn recursion_shows_the_cycle() {
    check(
        "float odd(int n);\nfloat even(int n) { return n == 0 ? 1.0 : odd(n - 1); }\nfloat odd(int n) { return n == 0 ? 0.0 : even(n - 1); }\n",
        &expect![[r#"
            error[E0216]: `odd` calls itself
              ┌─ shader.rtsl:2:43
              │
            2 │ float even(int n) { return n == 0 ? 1.0 : odd(n - 1); }
              │                                           ^^^^^^^^^^ `even` calls `odd` here
            3 │ float odd(int n) { return n == 0 ? 0.0 : even(n - 1); }
              │                                          ----------- `odd` calls `even` here
              │
              = note: functions cannot call themselves, directly or through others
              = note: the calls are `odd` → `even` → `odd`
              = help: use a loop

        "#]],
    );
}

#[test]
fn did_you_mean() {
    check(
        "struct Cell { vec2 corner; };\nclass Tiles : rt_Textur { };\nclass Wood : rt_Texture;\npublic float roughness = 0.1;\nvoid lookup() {\n    Cel cell = Cell(rt_TextureUv);\n    rt_FloatTextureValue = rouhgness + smothstep(0.0, 1.0, Cell(vec2(1)).croner.x);\n}\nvoid lookUp() { }\n",
        &expect![[r#"
            error[E0301]: there is no class `rt_Textur`
              ┌─ shader.rtsl:2:15
              │
            2 │ class Tiles : rt_Textur { };
              │               ^^^^^^^^^ unknown class
              │
              = note: the roles are `rt_Camera`, `rt_Primitive`, `rt_Texture`, `rt_Light`, `rt_Material` and `rt_Integrator`
              = help: did you mean: `rt_Texture`

            error[E0202]: there is no type `Cel`
              ┌─ shader.rtsl:6:5
              │
            6 │     Cel cell = Cell(rt_TextureUv);
              │     ^^^ unknown type
              │
              = help: did you mean: `Cell`

            error[E0201]: there is no `rt_TextureUv` here
              ┌─ shader.rtsl:6:21
              │
            6 │     Cel cell = Cell(rt_TextureUv);
              │                     ^^^^^^^^^^^^ unknown name
              │
              = help: did you mean: `rt_TextureUV`

            error[E0201]: there is no `rouhgness` here
              ┌─ shader.rtsl:7:28
              │
            7 │     rt_FloatTextureValue = rouhgness + smothstep(0.0, 1.0, Cell(vec2(1)).croner.x);
              │                            ^^^^^^^^^ unknown name
              │
              = help: did you mean: `roughness`

            error[E0206]: `Cell` has no field `croner`
              ┌─ shader.rtsl:7:74
              │
            7 │     rt_FloatTextureValue = rouhgness + smothstep(0.0, 1.0, Cell(vec2(1)).croner.x);
              │                                                                          ^^^^^^ unknown field
              │
              = note: it has `corner`
              = help: did you mean: `corner`

            error[E0201]: there is no function `smothstep`
              ┌─ shader.rtsl:7:40
              │
            7 │     rt_FloatTextureValue = rouhgness + smothstep(0.0, 1.0, Cell(vec2(1)).croner.x);
              │                                        ^^^^^^^^^ unknown function
              │
              = help: did you mean: `smoothstep`

            warning[W0334]: `lookUp` is not an interface method, and is never called
              ┌─ shader.rtsl:9:6
              │
            9 │ void lookUp() { }
              │      ^^^^^^ never called
              │
              = help: did you mean: `lookup`

        "#]],
    );
}

#[test]
fn overloads() {
    check(
        "float f(uint x, float y) { return 1.0; }\nfloat f(float x, uint y) { return 2.0; }\nclass A : rt_Texture;\nvoid lookup() { rt_FloatTextureValue = f(1, 2) + f(true) + dot(color(1), color(2)); }\n",
        &expect![[r#"
            error[E0212]: `f(int, int)` could mean several functions
              ┌─ shader.rtsl:4:40
              │
            4 │ void lookup() { rt_FloatTextureValue = f(1, 2) + f(true) + dot(color(1), color(2)); }
              │                                        ^^^^^^^
              │
              = note: it could be `float f(uint x, float y)`
              = note: or `float f(float x, uint y)`
              = help: convert the arguments, so that one of them fits exactly

            error[E0211]: no `f` takes `(bool)`
              ┌─ shader.rtsl:4:50
              │
            4 │ void lookup() { rt_FloatTextureValue = f(1, 2) + f(true) + dot(color(1), color(2)); }
              │                                                  ^^^^^^^
              │                                                    │
              │                                                    this is `bool`
              │
              = note: there is `float f(uint x, float y)`
              = note: there is `float f(float x, uint y)`

            error[E0211]: no `dot` takes `(color, color)`
              ┌─ shader.rtsl:4:60
              │
            4 │ void lookup() { rt_FloatTextureValue = f(1, 2) + f(true) + dot(color(1), color(2)); }
              │                                                            ^^^^^^^^^^^^^^^^^^^^^^^
              │                                                                │         │
              │                                                                │         this is `color`
              │                                                                this is `color`
              │
              = note: there is `float dot(float a, float b)`
              = note: there is `float dot(vec2 a, vec2 b)`
              = note: there is `float dot(vec3 a, vec3 b)`
              = note: there is `float dot(vec4 a, vec4 b)`
              = help: `rgb(c)` gives a color as a `vec3`

        "#]],
    );
}

#[test]
fn helpers_name_the_method_that_reaches_them() {
    check(
        "class A : rt_Primitive;\nvoid offer(float t) { hit(t); }\nvoid intersect() { offer(1.0); }\nvoid computeBounds() { offer(2.0); }\n",
        &expect![[r#"
            error[E0309]: `hit` is only for `intersect`, not for `computeBounds`
              ┌─ shader.rtsl:2:23
              │
            2 │ void offer(float t) { hit(t); }
              │                       ^^^^^^ not possible here
              │
              = note: `computeBounds` reaches this through `offer`

        "#]],
    );
}

#[test]
fn names_of_glsl() {
    check(
        "class A : rt_Texture;\nvoid lookup() { rt_FloatTextureValue = gl_FragCoord.x + texture(0, rt_TextureUV).x + dFdxFine(1.0); }\n",
        &expect![[r#"
            error[E0201]: there is no `gl_FragCoord` here
              ┌─ shader.rtsl:2:40
              │
            2 │ void lookup() { rt_FloatTextureValue = gl_FragCoord.x + texture(0, rt_TextureUV).x + dFdxFine(1.0); }
              │                                        ^^^^^^^^^^^^ unknown name
              │
              = help: what GLSL passes in `gl_` variables, RTSL passes in the state variables of roles

            error[E0201]: there is no function `texture`
              ┌─ shader.rtsl:2:57
              │
            2 │ void lookup() { rt_FloatTextureValue = gl_FragCoord.x + texture(0, rt_TextureUV).x + dFdxFine(1.0); }
              │                                                         ^^^^^^^ unknown function
              │
              = help: textures are other shaders: call `lookup(uv)` of a `public rt_Texture` member

            error[E0201]: there is no function `dFdxFine`
              ┌─ shader.rtsl:2:86
              │
            2 │ void lookup() { rt_FloatTextureValue = gl_FragCoord.x + texture(0, rt_TextureUV).x + dFdxFine(1.0); }
              │                                                                                      ^^^^^^^^ unknown function
              │
              = help: write instead: `dFdx`

        "#]],
    );
}

#[test]
fn functions_of_other_languages() {
    let calls = [
        "frac(x)",
        "lerp(x, x, x)",
        "rsqrt(x)",
        "atan2(x, x)",
        "saturate(x)",
        "mul(m, x)",
        "log10(x)",
        "fmod(x, x)",
        "ddx(x)",
        "fabs(x)",
        "sqrtf(x)",
        "printf(x)",
        "tex2D(x, x)",
        "half4(x)",
        "float3x3(x)",
    ];
    let mut helps = String::new();
    for call in calls {
        let text = format!(
            "class A : rt_Texture;\nvoid lookup() {{ float x = rt_TextureUV.x; mat2 m = mat2(x); float y = {call}; rt_FloatTextureValue = m[0].x; }}\n"
        );
        let said = rtsl_testing::checked::diagnostics(&text);
        assert_eq!(rtsl_testing::checked::codes(&text), ["E0201"], "{said}");
        let help = said.lines().find(|line| line.contains("help")).unwrap_or("nothing");
        helps += &format!("{call}: {}\n", help.trim());
    }
    expect![[r#"
        frac(x): = help: write instead: `fract`
        lerp(x, x, x): = help: write instead: `mix`
        rsqrt(x): = help: write instead: `inversesqrt`
        atan2(x, x): = help: write instead: `atan`
        saturate(x): = help: write `clamp(x, 0.0, 1.0)`
        mul(m, x): = help: write `a * b`, which multiplies matrices and vectors
        log10(x): = help: write `log(x) / log(10.0)`
        fmod(x, x): = help: write `x - y * trunc(x / y)`; `mod(x, y)` differs where x is negative
        ddx(x): = help: write instead: `dFdx`
        fabs(x): = help: write instead: `abs`
        sqrtf(x): = help: write instead: `sqrt`
        printf(x): = help: write `print("x = {}", x);`, which `rtsl eval` and `rtsl render --pixel` show
        tex2D(x, x): = help: textures are other shaders: call `lookup(uv)` of a `public rt_Texture` member
        half4(x): = help: write instead: `vec4`
        float3x3(x): = help: write instead: `mat3`
    "#]].assert_eq(&helps);
}

#[test]
fn types_of_other_languages() {
    let mut helps = String::new();
    for ty in [
        "float3", "half4", "int2", "bool1", "float4x4", "float3x4", "Vec3f", "vector", "point",
        "normal", "string", "Spectrum", "vec3f", "flaot",
    ] {
        let text = format!("class A : rt_Texture;\nvoid lookup() {{ {ty} x; x = {ty}(1.0); }}\n");
        let said = rtsl_testing::checked::diagnostics(&text);
        assert_eq!(rtsl_testing::checked::codes(&text)[0], "E0202", "{said}");
        let help = said.lines().find(|line| line.contains("help")).unwrap_or("nothing");
        helps += &format!("{ty}: {}\n", help.trim());
    }
    expect![[r#"
        float3: = help: write instead: `vec3`
        half4: = help: write instead: `vec4`
        int2: = help: write instead: `ivec2`
        bool1: = help: write instead: `bool`
        float4x4: = help: write instead: `mat4`
        float3x4: = help: write instead: `mat4x3`
        Vec3f: = help: write instead: `vec3`
        vector: = help: write instead: `vec3`
        point: = help: write instead: `vec3`
        normal: = help: write instead: `vec3`
        string: = help: there is no type for text; an `int` or a `bool` can choose between variants
        Spectrum: = help: write instead: `color`
        vec3f: = help: write instead: `vec3`
        flaot: = help: did you mean: `float`
    "#]]
    .assert_eq(&helps);
}

#[test]
fn texts_and_printing() {
    check(
        "class A : rt_Texture;\nvoid lookup() { printf(\"%f\", rt_TextureUV.x); }\n",
        &expect![[r#"
            error[E0106]: expected an expression, found double-quoted text
              ┌─ shader.rtsl:2:24
              │
            2 │ void lookup() { printf("%f", rt_TextureUV.x); }
              │                        ^^^^ expected an expression
              │
              = note: RTSL has no type for text; text is allowed in annotations, directives and `print` only
              = help: write `print("x = {}", x);`, with `{}` for each value

        "#]],
    );
}

#[test]
fn assignment_as_condition() {
    check(
        "class A : rt_Texture;\nvoid lookup() { float x = 1.0; if (x = 2.0) x = 3.0; rt_FloatTextureValue = x; }\n",
        &expect![[r#"
            error[E0204]: a condition must be `bool`, but this assignment is `float`
              ┌─ shader.rtsl:2:36
              │
            2 │ void lookup() { float x = 1.0; if (x = 2.0) x = 3.0; rt_FloatTextureValue = x; }
              │                                    ^^^^^^^ expected `bool`, found `float`
              │
              = help: `=` assigns; to compare, write `==`

        "#]],
    );
}

#[test]
fn initial_values_of_scratch() {
    check(
        "class A : rt_Texture;\nscratch float x = 5.0;\nvoid lookup() { rt_FloatTextureValue = x; x = 1.0; }\n",
        &expect![[r#"
            error[E0215]: scratch members have no initial value
              ┌─ shader.rtsl:2:15
              │
            2 │ scratch float x = 5.0;
              │               ^^^^^^^ belongs to a ray, and is zero at first
              │
              = help: assign it in the method that runs first, or make it `private` or `const`

        "#]],
    );
}

/// An error suppresses warnings that are its consequence, such as about a variable that the
/// erroneous statement would have used or set.
#[test]
fn errors_bring_no_warnings_about_variables() {
    check(
        "class A : rt_Texture;\nvoid lookup() {\n    float unused = frac(rt_TextureUV.x);\n    float set; split(rt_TextureUV, set);\n    vec3 other = 1;\n    float used = 2.0; { float inner = used.q; }\n    rt_FloatTextureValue = set;\n}\nfloat fine(float x) { float unused = x; return x; }\n",
        &expect![[r#"
            error[E0201]: there is no function `frac`
              ┌─ shader.rtsl:3:20
              │
            3 │     float unused = frac(rt_TextureUV.x);
              │                    ^^^^ unknown function
              │
              = help: write instead: `fract`

            error[E0201]: there is no function `split`
              ┌─ shader.rtsl:4:16
              │
            4 │     float set; split(rt_TextureUV, set);
              │                ^^^^^ unknown function

            error[E0204]: the initial value must be `vec3`, but this is `int`
              ┌─ shader.rtsl:5:18
              │
            5 │     vec3 other = 1;
              │                  ^ expected `vec3`, found `int`
              │
              = help: convert it with `vec3(...)`

            error[E0207]: a `float` has no component `q`
              ┌─ shader.rtsl:6:44
              │
            6 │     float used = 2.0; { float inner = used.q; }
              │                                            ^ its components are `s`

            warning[W0242]: `unused` is never used
              ┌─ shader.rtsl:9:29
              │
            9 │ float fine(float x) { float unused = x; return x; }
              │                             ^^^^^^ declared here and never named again

        "#]],
    );
}
