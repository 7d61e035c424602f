//! `rtsl import`: programs of Shadertoy, and their errors.

use expect_test::{Expect, expect};

use crate::command::{Folder, INPUT_AT_FAULT, WRONG_USAGE};

/// Programs that become classes, each with the state of a call of `lookup` and its result.
const PROGRAMS: [(&str, &str, [f32; 3]); 13] = [
    (
        "gradient",
        "void mainImage(out vec4 fragColor, in vec2 fragCoord) {
            vec2 uv = fragCoord / iResolution.xy;
            fragColor = vec4(uv, 0.5, 1.0);
        }",
        [0.5, 0.25, 0.5],
    ),
    (
        "time",
        "void mainImage( out vec4 o, vec2 u ) { o = vec4(iTime, iTimeDelta * 0.0, iFrame == 0 ? 1.0 : 0.0, 1.0); }",
        [0.0, 0.0, 1.0],
    ),
    (
        "globals and macros",
        "#define PI 3.14159265
        #define T (iTime + 1.0)
        #ifdef GL_ES
        precision mediump float;
        #endif
        float glow = 0.0;
        const vec3 tint = vec3(1.0, 0.5, 0.25);
        float map(vec3 p) { float d = length(p) - 1.0; glow += 0.25; return d * T; }
        void mainImage(out vec4 c, in vec2 p) { map(vec3(2.0)); map(vec3(3.0)); c = vec4(tint * glow, 1.0); }",
        [0.5, 0.25, 0.125],
    ),
    (
        "out parameters",
        "void split(in vec2 p, out float a, inout float b) { a = p.x; b += p.y; }
        void mainImage(out vec4 fragColor, in vec2 fragCoord) {
            float a, b = 0.25;
            split(fragCoord / iResolution.xy, a, b);
            fragColor.xy = vec2(a, b);
            fragColor.z = 1.0;
        }",
        [0.5, 0.5, 1.0],
    ),
    (
        "channels",
        "vec3 paint(sampler2D s, vec2 uv) { return texture(s, uv).rgb + texture(s, uv, -1.0).rgb; }
        void mainImage(out vec4 fragColor, in vec2 fragCoord) {
            fragColor = vec4(paint(iChannel0, fragCoord) + textureLod(iChannel1, fragCoord, 2.0).xyz, 1.0);
            fragColor += texture(iChannel2, vec3(0.0, 1.0, 0.0)) - 1.0;
        }",
        [0.0, 0.0, 0.0],
    ),
    (
        "texels",
        "void mainImage(out vec4 fragColor, in vec2 fragCoord) {
            ivec2 size = textureSize(iChannel0, 1);
            fragColor = texelFetch(iChannel0, ivec2(fragCoord) % size, 0);
            fragColor.rgb += vec3(size.x == 128, textureGrad(iChannel0, vec2(0), vec2(1), vec2(1)).a, iChannelResolution[1].x / 256.0);
        }",
        [1.0, 1.0, 1.0],
    ),
    (
        "names of methods and keywords",
        "float lookup(float x) { return x * 0.5; }
        float private(float scratch) { return scratch; }
        float noise(vec2 p) { return 0.25; }
        float hash(float n) { return 1.0; }
        void mainImage(out vec4 color, in vec2 uv) {
            float constructor = lookup(1.0);
            vec3 emission = vec3(constructor, private(noise(uv)), hash(2.0));
            color = vec4(emission, 1.0);
        }",
        [0.5, 0.25, 1.0],
    ),
    (
        "loops and structs",
        "struct Ray { vec3 o; vec3 d; };
        const int STEPS = 4;
        float march(Ray r) { float t = 0.0; for (int i = 0; i < STEPS; i++) { t += 0.0625; if (t > 10.0) break; } return t; }
        void mainImage(out vec4 o, in vec2 u) { o = vec4(march(Ray(vec3(0), vec3(0, 0, 1)))); }",
        [0.25, 0.25, 0.25],
    ),
    (
        "golfed",
        "void mainImage(out vec4 O,vec2 U){O=vec4(0);for(float i=0.;i++<4.;O+=.125);O.a=U.x*0.;}",
        [0.5, 0.5, 0.5],
    ),
    (
        "own uniforms",
        "uniform vec3 iResolution = vec3(1.0); uniform highp float iTime = 0.0; uniform sampler2D iChannel0;
        void mainImage(out vec4 fragColor, in vec2 fragCoord) {
            fragColor = vec4(iTime + 0.25) + 0.0 * texture(iChannel0, fragCoord) * iResolution.x;
        }",
        [0.25, 0.25, 0.25],
    ),
    (
        "macros of any name",
        "#define fragColor O
        #define color vec3
        #define rgb bgr
        #define pow(x, y) broken
        #define vec3(x) vec3(x, x, x)
        #define R iResolution
        void mainImage(out vec4 fragColor, in vec2 U) { U /= R.xy; fragColor = color(U.x).rgbb; }",
        [0.5, 0.5, 0.5],
    ),
    (
        "comments and dead code",
        "/* void mainImage(out vec4 a) iChannel3 */ // iMouse
        #if 0
        float broken = dFdx(1.0)
        #endif
        mat2 rot(float a) { float c = cos(a), s = sin(a); return mat2(c, -s, s, c); }
        void mainImage(out vec4 fragColor, in vec2 fragCoord) { fragColor = vec4(rot(0.0) * vec2(0.5, 1.0), 0.0, 0.0); }",
        [0.5, 1.0, 0.0],
    ),
    (
        "colours beyond the screen",
        "void mainImage(out vec4 fragColor, in vec2 fragCoord) { fragColor = vec4(2.0, -1.0, 1.0, 0.0); }
        // The last line has no end",
        [1.0, 0.0, 1.0],
    ),
];

/// The colours that a class of the imported text gives, without decoding.
fn colours(folder: &Folder) -> Vec<f32> {
    let ran = folder.run(&[
        "eval",
        "out.rtsl",
        "lookup",
        "--param",
        "isEncoded=false",
        "--state",
        "rt_TextureUV=0.5,0.25",
        "--json",
        "--backend",
        "interp",
    ]);
    let ran = ran.exits(0);
    let answer: serde_json::Value = serde_json::from_str(&ran.output()).unwrap();
    let colour = &answer["state"]["rt_TextureColor"]["lanes"][0];
    colour
        .as_array()
        .unwrap_or_else(|| panic!("{answer}"))
        .iter()
        .map(|it| it.as_f64().unwrap() as f32)
        .collect()
}

#[test]
fn programs_become_classes_with_their_colours() {
    for (name, program, expected) in PROGRAMS {
        let folder = Folder::new("import");
        folder.write("in.glsl", program);
        let ran = folder.run(&["import", "in.glsl", "-o", "out.rtsl"]);
        assert_eq!((ran.code(), &*ran.errors()), (0, ""), "{name}");
        assert_eq!(colours(&folder), expected, "{name}");
        for form in ["material", "emission"] {
            folder.run(&["import", "in.glsl", "-o", "out.rtsl", "--as", form]).exits(0);
            folder.run(&["check", "out.rtsl"]).exits(0);
        }
    }
}

#[test]
fn the_class_has_the_name_of_the_file_and_the_inputs_that_are_named() {
    let folder = Folder::new("import");
    let program =
        "void mainImage(out vec4 o, in vec2 u) {\n    o = texture(iChannel1, u) * iMouse;\n}\n";
    folder.write("2-warped noise.glsl", program);
    let found = folder.run(&["import", "2-warped noise.glsl"]).exits(0).output();
    expect![[r#"
        /// A program of Shadertoy.
        class Imported2WarpedNoise : rt_Texture;

        [[doc "Pixels of the image that the program draws: width, height, and the shape of a pixel."]] public vec3 iResolution = vec3(800.0, 450.0, 1.0);
        [[doc "The pointer in pixels."]] public vec4 iMouse = vec4(0.0);
        [[doc "True if the program's colours are meant for a screen, and not linear."]] public bool isEncoded = true;
        public rt_Texture iChannel1;

        vec4 texture(rt_Texture channel, vec2 uv, float bias = 0.0) { return vec4(rgb(channel.lookup(uv)), 1.0); }
        vec4 texture(rt_Texture channel, vec3 at, float bias = 0.0) { return vec4(rgb(channel.lookup(at)), 1.0); }

        color importedColor() {
            vec4 fragColor;
            mainImage(fragColor, rt_TextureUV * iResolution.xy);
            vec3 rgb = clamp(fragColor.rgb, 0.0, 1.0);
            return color(isEncoded ? pow(rgb, vec3(2.2)) : rgb);
        }

        void lookup() { rt_TextureColor = importedColor(); }

        #define HW_PERFORMANCE 1
        #define sampler2D rt_Texture
        #define samplerCube rt_Texture

        // The program.
        void mainImage(out vec4 o, in vec2 u) {
            o = texture(iChannel1, u) * iMouse;
        }
    "#]].assert_eq(&found);
    let named =
        folder.run(&["import", "2-warped noise.glsl", "--name", "Other", "--as", "emission"]);
    assert!(named.exits(0).output().contains("class Other : rt_Material;\n"));
}

fn refused(program: &str, expected: Expect) {
    let folder = Folder::new("import");
    folder.write("in.glsl", program);
    let ran = folder.run(&["import", "in.glsl", "-o", "out.rtsl"]).exits(INPUT_AT_FAULT);
    expected.assert_eq(&ran.errors());
    assert!(!folder.0.path().join("out.rtsl").exists());
}

#[test]
fn errors_have_their_places_in_the_program() {
    refused(
        "float edge(float d) { return d / noise1(d); }\nvoid mainImage(out vec4 o, in vec2 u) { o = vec4(edge(u.x)); }\n",
        expect![[r#"
            error[E0201]: there is no function `noise1`
              ┌─ in.glsl:1:34
              │
            1 │ float edge(float d) { return d / noise1(d); }
              │                                  ^^^^^^ unknown function
              │
              = help: did you mean: `noise`

        "#]],
    );
    refused(
        "void mainImage(out vec4 o, in vec2 u) {\n    if (u.x < 0.5) discard;\n    o = vec4(1);\n}",
        expect![[r#"
            error[E0103]: `discard` is a reserved word of GLSL that RTSL does not use
              ┌─ in.glsl:2:20
              │
            2 │     if (u.x < 0.5) discard;
              │                    ^^^^^^^ not available here
              │
              = help: to reject a hit, return from `intersect()` without calling `hit()`; elsewhere `return` leaves the method

        "#]],
    );
    refused(
        "float f(float x) { return f(x); }\nvoid mainImage(out vec4 o, in vec2 u) { o = vec4(f(u.x)); }",
        expect![[r#"
            error[E0216]: `f` calls itself
              ┌─ in.glsl:1:27
              │
            1 │ float f(float x) { return f(x); }
              │                           ^^^^ `f` calls `f` here
              │
              = note: functions cannot call themselves, directly or through others
              = help: use a loop

        "#]],
    );
    refused(
        "void mainImage(out vec3 o, in vec2 u) { o = vec3(1); }",
        expect![[r#"
        error[E0211]: no `mainImage` takes `(vec4, vec2)`
          ┌─ in.glsl:1:6
          │
        1 │ void mainImage(out vec3 o, in vec2 u) { o = vec3(1); }
          │      ^^^^^^^^^
          │
          = note: there is `void mainImage(out vec3 o, vec2 u)`

    "#]],
    );
    refused(
        "void mainImage(out vec4 o, in vec2 u) { o = vec4(1);",
        expect![[r#"
        error[E0102]: expected `}`, found the end of the text
          ┌─ in.glsl:1:6
          │
        1 │ void mainImage(out vec4 o, in vec2 u) { o = vec4(1);
          │      ^^^^^^^^^                        - to close this `{`
          │      │                                 
          │      expected `}`

    "#]],
    );
}

#[test]
fn programs_without_an_image_are_refused() {
    refused(
        "vec2 mainSound(int samp, float time) { return vec2(sin(time)); }",
        expect![[r#"
        error[E0626]: the program has no `mainImage`
          ┌─ in.glsl:1:6
          │
        1 │ vec2 mainSound(int samp, float time) { return vec2(sin(time)); }
          │      ^^^^^^^^^ `mainSound` draws no image
          │
          = help: import the pass that has `mainImage`; sounds have no counterpart

    "#]],
    );
    refused(
        "void main() { gl_FragColor = vec4(1); }",
        expect![[r#"
        error[E0626]: the program has no `mainImage`
          ┌─ in.glsl:1:6
          │
        1 │ void main() { gl_FragColor = vec4(1); }
          │      ^^^^ `main` draws no image
          │
          = help: name the function `void mainImage(out vec4 fragColor, in vec2 fragCoord)`

    "#]],
    );
    refused(
        "// mainImage()\nfloat f() { return 1.0; }",
        expect![[r#"
        error[E0626]: the program has no `mainImage`
          ┌─ in.glsl:1:1
          │
        1 │ // mainImage()
          │ ^ nothing here draws an image
          │
          = help: add `void mainImage(out vec4 fragColor, in vec2 fragCoord) { ... }`

    "#]],
    );
    refused(
        "",
        expect![[r#"
        error[E0626]: the program has no `mainImage`
          ┌─ in.glsl:1:1
          │
        1 │ 
          │ ^ nothing here draws an image
          │
          = help: add `void mainImage(out vec4 fragColor, in vec2 fragCoord) { ... }`

    "#]],
    );
}

#[test]
fn files_that_are_no_text_are_refused() {
    let folder = Folder::new("import");
    folder.write("in.glsl", [0xff, 0xfe, 0x00]);
    folder.run(&["import", "in.glsl"]).fails_with("E0601");
    folder.run(&["import", "missing.glsl"]).fails_with("E0601");
    folder.run(&["import"]).exits(WRONG_USAGE);
    folder.write("in.glsl", "void mainImage(out vec4 o, in vec2 u) { o = vec4(1); }");
    folder.run(&["import", "in.glsl", "--name", "Two words"]).exits(WRONG_USAGE);
}
