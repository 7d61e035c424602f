//! The rules of the language, one by one: texts that are accepted without diagnostics, and texts
//! with the codes of their errors.

use rtsl_testing::checked::{codes, diagnostics};

fn texture(body: &str) -> String {
    format!("class C : rt_Texture;\nvoid lookup() {{ {body} }}\n")
}

fn accepted(texts: impl IntoIterator<Item = String>) {
    let report: String = texts
        .into_iter()
        .map(|text| (diagnostics(&text), text))
        .filter(|(said, _)| !said.is_empty())
        .map(|(said, text)| format!("{text}\n{said}\n"))
        .collect();
    assert!(report.is_empty(), "{report}");
}

fn refused<'t>(texts: impl IntoIterator<Item = (&'t str, String)>) {
    let report: String = texts
        .into_iter()
        .filter(|(expected, text)| codes(text).join(" ") != *expected)
        .map(|(expected, text)| format!("expected {expected}:\n{text}\n{}\n", diagnostics(&text)))
        .collect();
    assert!(report.is_empty(), "{report}");
}

/// Converts `value` to the float that the texture returns, whatever its type.
fn value(setup: &str, value: &str) -> String {
    texture(&format!("{setup} rt_FloatTextureValue = float({value});"))
}

#[test]
fn expressions_of_glsl() {
    let vectors = "vec2 a = rt_TextureUV; vec3 b = rt_TextureUVW; ivec2 i = ivec2(a); uvec3 u = uvec3(b); \
                   bvec2 t = bvec2(true, false); mat2 m = mat2(1); mat3x2 n = mat3x2(2.0); float f = 0.5; \
                   b += vec3(u); t = not(t); n *= float(i.x); m[0] = a; f += n[2].y;";
    accepted(
        [
            "1 + 2u",
            "1u * 2.0",
            "1 - 2.0",
            "7 % 3",
            "7u % 3",
            "1 << 2u",
            "1u >> 2",
            "~1 & 3 | 4 ^ 5",
            "-1",
            "+1.0",
            "!true",
            "true ^^ false",
            "true && false || true",
            "1 < 2.0",
            "1u >= 2u",
            "(i % 3).x",
            "(i << 1).y",
            "(i & ivec2(1, 2)).x",
            "(u | 1u).z",
            "(a * 2).x",
            "(2 / a).x",
            "(a + a * f - a / a).x",
            "(m * a).x",
            "(a * m).y",
            "(n * b).x",
            "(a * n).z",
            "(m * n)[2].y",
            "(m + m)[0].x",
            "(m / 2.0)[0].x",
            "(2 * m)[1].y",
            "(-m)[0].x",
            "a == a",
            "m != m",
            "i == ivec2(1)",
            "ivec2(1) == vec2(1.0)",
            "a.yx.x",
            "b.zyx.xy.y",
            "b.rgb.r",
            "b.stp.p",
            "f.x",
            "f.xxx.y",
            "b.xxyy.w",
            "f > 0.5 ? 1 : 2.0",
            "(t.x ? a : a.yx).x",
            "(f++, 2.0)",
            "a[0]",
            "b[i.x]",
            "m[1][0]",
            "n[u.x].y",
            "f++",
            "--f",
            "a++ .x",
            "(m++)[0].x",
            "i.x--",
            "b.xy++ .x",
            "f = 2.0",
            "f += 1",
            "(a *= 2).x",
            "(a *= m).x",
            "(m *= m)[0].x",
            "i.x <<= 1u",
            "i.x %= 2",
            "(b.zx = a).x",
            "b.z += 1.0",
            "a.length()",
            "m.length()",
            "n.length() + b.length()",
            "float(a)",
            "int(2.5)",
            "bool(1)",
            "uint(-1)",
            "vec2(b).x",
            "vec3(a, 1).x",
            "vec4(a, a).w",
            "vec4(m).w",
            "vec2(t).x",
            "ivec3(b).z",
            "bvec3(b).x",
            "mat2(a, a)[0].x",
            "mat2(1, 2, 3, 4)[1].y",
            "mat3(m)[2].z",
            "mat2(n)[0].x",
            "mat4(1.0)[3].w",
            "mat2x3(b, b)[1].z",
            "vec3(1)[2]",
            "color(1) == color(1, 0u, 0)",
            "rgb(color(b) * 2 + color(a.x)).g",
            "luminance(-color(b) / 2.0)",
            "luminance(f * color(f))",
            "rgb(mix(color(f), 1.0, 0.5)).x",
            "rgb(clamp(color(f), 0.0, 1.0)).x",
            "rgb(pow(color(f), 2.0)).x",
            "rgb(max(color(f), color(1))).x",
            "int(0xFFu) + 017",
            "min(1, 2u)",
            "max(a, 0.5).x",
            "mix(a, a, t).x",
            "mod(a, 2.0).x",
            "clamp(i, 0, 1).x",
            "sign(-3)",
            "abs(i).x",
            "dot(f, f)",
            "length(f)",
            "cross(b, b).x",
            "sqrt(2)",
            "pow(2, 3)",
            "any(lessThan(a, a))",
            "all(equal(i, i))",
            "transpose(n)[1].z",
            "inverse(m)[0].x",
            "determinant(m)",
            "outerProduct(a, b)[0].x",
            "matrixCompMult(m, m)[0].x",
            "noise(b)",
            "fbm(a)",
            "hash(1u)",
            "floatBitsToInt(f)",
            "bitCount(i).x",
            "findMSB(7)",
            "packUnorm2x16(a)",
            "unpackHalf2x16(1u).x",
            "perpendicularTo(b).x",
            "dominantAxis(b)",
            "rand()",
        ]
        .map(|text| value(vectors, text)),
    );
}

#[test]
fn out_arguments_of_built_in_functions() {
    accepted([
        value("int e = 0; float x = frexp(8.0, e); x += float(e);", "x"),
        value("vec2 w = vec2(0.0); vec2 x = modf(rt_TextureUV, w); x += w;", "x"),
        value("uint c = 0u; uint x = uaddCarry(1u, 2u, c);", "x + c"),
        value("uint h, l; umulExtended(3u, 4u, h, l);", "h + l"),
        // The int that the function returns is converted to a float afterwards.
        value("float e; float x = frexp(8.0, e);", "x + e"),
    ]);
    refused([
        (
            "E0211",
            value(
                "uint e = 0u; bool b = true; float x = frexp(8.0, b); x += float(e); b = !b;",
                "x",
            ),
        ),
        ("E0210", value("float x = modf(1.5, 2.0);", "x")),
        ("E0210", value("vec2 v = vec2(1.0); vec2 x = modf(v, v.xx);", "x")),
    ]);
}

#[test]
fn statements_of_glsl() {
    accepted(
        [
            "int n = 0; for (int i = 0, j = 1; i < 4; i++, j *= 2) { if (i == 2) continue; n += j; } rt_FloatTextureValue = float(n);",
            "int n = 0; while (n < 4) ++n; rt_FloatTextureValue = float(n);",
            "int n = 0; while (bool more = n < 4) { if (!more) break; ++n; }",
            "int n = 0; do { n++; } while (n < 4);",
            "int n = 0; while (bool more = n++ < 4) { }",
            "float x = 1.0; { float x = x; x += 1.0; rt_FloatTextureValue = x; }",
            "vec3 v; v.x = 1.0; v.yz = vec2(2.0); rt_FloatTextureValue = v.z;",
            "vec2 a[2] = vec2[2](vec2(0), vec2(1)), b[2] = a; rt_FloatTextureValue = float(a == b) + (true ? a : b)[1].x;",
            "float a = 1.0, b = a * 2.0; rt_FloatTextureValue = b;",
            "for (;;) { if (rand() > 0.5) break; }",
            "switch (int(rt_TextureUV.x)) { case 0: case 1: rt_FloatTextureValue = 1.0; case 2: break; default: return; }",
            "switch (1u) { case 1: break; }",
            "float x = 1.0; { float x = 2.0; rt_FloatTextureValue = x; } rt_FloatTextureValue += x;",
            "struct P { vec2 a; float b; } p = P(rt_TextureUV, 1.0); p.b += p.a.x; rt_FloatTextureValue = p.b;",
            "struct { float x; } p; p.x = 1.0; rt_FloatTextureValue = p.x;",
            "const int n = 2; float a[n] = float[n](1.0, 2.0); const float b[] = { 1, 2, 3 }; a[1] = b[2]; rt_FloatTextureValue = a[0] + float(b.length());",
            "float a[2][3] = { { 1, 2, 3 }, { 4, 5, 6 } }; a[1][2] = 7.0; float b[3] = a[0]; rt_FloatTextureValue = b[1] + float(a.length() * a[0].length());",
            "float[3] a[2]; a[0] = float[3](1.0, 2.0, 3.0); rt_FloatTextureValue = a[0][2];",
            "float a[][2] = float[][](float[](1.0, 2.0), float[](3.0, 4.0)); rt_FloatTextureValue = a[1][1];",
            "vec2 v = { 1.0, 2.0 }; mat2 m = { { 1, 0 }, { 0, 1 } }; rt_FloatTextureValue = (m * v).x;",
            "precise float x = 1.0; highp float y = 2.0; rt_FloatTextureValue = x * y;",
            "const float x = rt_TextureUV.x; rt_FloatTextureValue = x;",
            "float x; if (rt_TextureUV.x > 0.5) x = 1.0; else x = 2.0; rt_FloatTextureValue = x;",
            "float previous; for (int i = 0; i < 3; i++) { if (i > 0) rt_FloatTextureValue += previous; previous = float(i); }",
            "int i = 0; int a[4] = int[](1, 2, 3, 4); a[i++] += 2; rt_FloatTextureValue = float(a[i]);",
            "if (rt_TextureUV.x > 0.0) ; else return;",
        ]
        .map(texture),
    );
}

#[test]
fn wrong_statements() {
    refused([
        ("E0204", texture("if (1) return;")),
        ("E0204", texture("while (rt_TextureUV.x) { }")),
        ("E0204", texture("for (int i = 0; i; ) { }")),
        ("E0219", texture("continue;")),
        ("E0219", texture("switch (1) { default: continue; }")),
        ("E0204", texture("switch (1.0) { default: break; }")),
        ("E0204", texture("switch (1) { case 1.0: break; }")),
        ("E0401", texture("int n = 1; switch (1) { case n: break; }")),
        ("E0220", texture("switch (1) { default: break; default: break; }")),
        ("E0220", texture("switch (1u) { case 1: break; case 1u: break; }")),
        ("W0244 W0342", texture("for (;;) { } rt_FloatTextureValue = 1.0;")),
        (
            "W0244",
            texture("if (rand() > 0.5) { return; } else { return; } rt_FloatTextureValue = 1.0;"),
        ),
        ("W0241", texture("float x; rt_FloatTextureValue = x;")),
        ("W0241", texture("vec3 x; x += 1.0; rt_FloatTextureValue = x.x;")),
        (
            "W0241",
            texture(
                "float x; for (int i = 0; i < 4; i++) { if (i == 3) rt_FloatTextureValue += x; }",
            ),
        ),
        ("W0242", texture("float x;")),
        ("E0203", texture("float x = 1.0; float x = 2.0; rt_FloatTextureValue = x;")),
        ("E0215", texture("const float x; rt_FloatTextureValue = x;")),
        ("E0210", texture("const float x = rand(); x = 2.0;")),
        ("E0202", texture("vex3 x = vec3(1.0);")),
        ("E0227", texture("float x[]; x[0] = 1.0;")),
        ("E0223", texture("void x;")),
        ("E0229", texture("rt_Texture t;")),
        ("E0230", texture("float f(float x) { return x; }")),
        ("E0217", texture("return 1.0;")),
        ("E0240", texture("[[label \"x\"]] float x = 1.0; rt_FloatTextureValue = x;")),
    ]);
}

#[test]
fn wrong_expressions() {
    let v =
        "vec2 a = rt_TextureUV; color c = color(a.x); float f = a.y; f += luminance(c); a += f;";
    let report = |code: &'static str, text: &str| (code, value(v, text));
    refused([
        report("E0201", "b"),
        report("E0201", "f1(a)"),
        report("E0204", "f = true"),
        report("E0204", "int(f) ? 1.0 : 2.0"),
        report("E0204", "true ? a : c"),
        report("E0205", "a + vec3(1.0)"),
        report("E0205", "true + 1"),
        report("E0205", "1.0 % 2.0"),
        report("E0205", "1.0 & 2"),
        report("E0205", "1 << 2.0"),
        report("E0205", "a < a"),
        report("E0205", "c + a"),
        report("E0205", "c < c"),
        report("E0205", "!1"),
        report("E0205", "!bvec2(true)"),
        report("E0205", "~1.0"),
        report("E0205", "-true"),
        report("E0205", "1 && true"),
        report("E0205", "a == vec3(1.0)"),
        report("E0205", "mat2(1) * vec3(1.0)"),
        report("E0205", "c++"),
        report("E0206", "mat2(1).x"),
        report("E0206", "a.size()"),
        report("E0206", "float[](1.0, 2.0).length"),
        report("E0207", "a.xg"),
        report("E0207", "a.xyxyx"),
        report("E0207", "f.y"),
        report("E0208", "c.r"),
        report("E0208", "c[0]"),
        report("E0208", "c.r = 1.0"),
        report("E0209", "f[0]"),
        report("E0210", "1 = 2"),
        report("E0210", "(f + 1.0)++"),
        report("E0210", "(a.xx = a).x"),
        report("E0204", "f = a"),
        report("E0204", "f *= a"),
        report("E0205", "f *= c * 1.0 == c"),
        report("E0204", "a[1.0]"),
        report("E0211", "sin()"),
        report("E0211", "sin(c)"),
        report("E0211", "dot(a, vec3(1.0))"),
        report("E0213", "f(1.0)"),
        report("E0214", "vec2()"),
        report("E0214", "vec2(a, f)"),
        report("E0214", "vec3(a)"),
        report("E0214", "vec3(c)"),
        report("E0214", "float(c)"),
        report("E0214", "mat2(mat2(1), 1.0)"),
        report("E0214", "mat2(1.0, 2.0)"),
        report("E0214", "float[2](1.0)"),
        report("E0214", "luminance(color(a))"),
        report("E0224", "vec2"),
        report("E0224", "sin + 1.0"),
        report("E0402", "a[2]"),
        report("E0402", "a[-1]"),
        report("E0402", "mat2(1)[2].x"),
    ]);
}

/// GLSL 4.60, 4.2.2: the body of a loop shares the scope of the header, but a block in it has a new
/// scope, and so has the body of `do`.
#[test]
fn loops_and_their_bodies_share_their_names() {
    let sum = "rt_FloatTextureValue += float(i);";
    let with = |text: &str| texture(&text.replace("SUM", sum));
    refused([
        ("E0203", with("for (int i = 0; i < 3; i++) { int i = 5; SUM }")),
        ("E0203", with("for (int i = 0, j = 1; i < j; i++) { SUM float j = 5.0; }")),
        ("E0203", with("for (int i = 0; bool j = i < 3; i++) { SUM bool j = true; }")),
        ("E0203", with("for (int i = 0; i < 3; i++) { SUM struct i { int a; }; }")),
        ("E0203", with("int i = 0; while (bool b = i < 3) { bool b = true; SUM i++; }")),
        (
            "E0203",
            with("for (struct S { int i; } s = S(0); s.i < 3; s.i++) { int i = 1, s = 2; SUM }"),
        ),
    ]);
    accepted([
        with("for (int i = 0; i < 3; i++) { { int i = 5; SUM } }"),
        with("for (int i = 0; i < 3; i++) for (int i = 0; i < 2; i++) { SUM }"),
        with("for (int i = 0; i < 3; i++) { if (i > 1) { int i = 5; SUM } }"),
        with("for (int i = 0; i < 3; i++) { int j = i; { int i = j; SUM } }"),
        with("int i = 0; while (i < 3) { int i = 5; SUM break; }"),
        with("int i = 0; do { int i = 5; SUM } while (i > 1);"),
        with("for (struct S { int i; } s = S(0); s.i < 3; s.i++) { int i = s.i; SUM }"),
    ]);
}

#[test]
fn structs_and_their_variables() {
    let with = |body: &str| {
        format!(
            "struct S {{ float a; }};\nfloat outer(S s) {{ return s.a; }}\n\
             class C : rt_Texture;\nprivate struct T {{ float b; }}\n\nmember;\n\
             const struct U {{ float c; }}\nc = U(1.0);\nprivate S first;\n\
             void lookup() {{ {body} rt_FloatTextureValue += member.b + c.c + first.a; }}\n"
        )
    };
    accepted([
        with(
            "struct S { vec2 b; }; S s = S(vec2(1.0)); rt_FloatTextureValue = s.b.x + outer(first);",
        ),
        with(
            "struct S { vec2 b; S inner; } s; s.inner = first; rt_FloatTextureValue = outer(s.inner);",
        ),
        with(
            "struct S { vec2 b; }\ns = S(vec2(1.0)), t[2];\nt[0] = s; rt_FloatTextureValue = t[0].b.x;",
        ),
        with("S S = S(2.0); rt_FloatTextureValue = outer(S);"),
        with("{ struct S { vec3 b; }; } S s = S(1.0); rt_FloatTextureValue = outer(s);"),
    ]);
    refused([
        ("E0211", with("struct S { float a; }; rt_FloatTextureValue = outer(S(1.0));")),
        ("E0204", with("struct S { float a; }; S s = first; rt_FloatTextureValue = s.a;")),
        (
            "E0203",
            with(
                "struct S { float a; }; struct S { float b; } s; s.a = 1.0; rt_FloatTextureValue = s.a;",
            ),
        ),
        ("E0101", with("struct V { float a; }\nfloat x = 1.0; rt_FloatTextureValue = x;")),
        ("E0101", with("struct V { float a; }\nS x = first; rt_FloatTextureValue = x.a;")),
    ]);
    let two = diagnostics(&with("struct S { float a; }; S s = first; rt_FloatTextureValue = s.a;"));
    assert!(two.contains("two structs have this name"), "{two}");
}

/// GLSL 4.60, 6.2.
#[test]
fn labels_have_statements() {
    let with = |cases: &str| texture(&format!("switch (int(rt_TextureUV.x)) {{ {cases} }}"));
    refused([
        ("E0111", with("case 1:")),
        ("E0111", with("case 1: rt_FloatTextureValue = 1.0; default:")),
        ("E0111", with("case 1: case 2:")),
    ]);
    accepted([
        with(""),
        with("case 1: ;"),
        with("case 1: case 2: break;"),
        with("case 1: rt_FloatTextureValue = 1.0; case 2: default: { }"),
    ]);
}

#[test]
fn independent_errors_are_all_reported() {
    refused([(
        "E0201 E0205 E0211 E0202",
        texture(
            "float x = y; vec2 v = rt_TextureUV + true; v = dot(v); vec9 w = v; rt_FloatTextureValue = x + w.x;",
        ),
    )]);
}

#[test]
fn functions() {
    let call = |functions: &str, call: &str| format!("{functions}\n{}", value("", call));
    accepted([
        call(
            "float f(float x) { return x; } float f(vec2 x) { return x.x; }",
            "f(1) + f(rt_TextureUV)",
        ),
        call("float f(int x) { return 1.0; } float f(uint x) { return 2.0; }", "f(1) + f(1u)"),
        call("float f(float, int n) { return float(n); }", "f(1, 2)"),
        call("float f(in float x); float f(float x) { return x; }", "f(1)"),
        call("float f(const float x); float f(in const float y) { return y; }", "f(1)"),
        // Functions that differ in the size of an array are overloads; the first is never called.
        call("float f(float x[2]); float f(float x[3]) { return x[0]; }", "f(float[3](1, 2, 3))"),
        call(
            "void f(inout float x, out float y, const in float z) { x += z; y = x; }\nfloat g() { float a = 1.0, b; f(a, b, 2.0); return a + b; }",
            "g()",
        ),
        // A user's function hides a built-in one only for arguments that it accepts.
        call(
            "float max(vec3 v) { return max(max(v.x, v.y), v.z); }",
            "max(vec3(1.0)) + max(1.0, 2.0)",
        ),
        call(
            "float noise(vec2 p) { return fract(sin(dot(p, vec2(12.9898, 78.233))) * 43758.5453); }",
            "noise(rt_TextureUV)",
        ),
        call("float hash(float n) { return fract(sin(n) * 43758.5453); }", "hash(1)"),
        call(
            "float f(float x); float g(float x) { return f(x); } float f(float x) { return x; }",
            "g(1.0)",
        ),
        call("float[2] f() { return float[2](1.0, 2.0); }", "f()[1]"),
        call("struct S { float x; }; S f(S s) { s.x += 1.0; return s; }", "f(S(1.0)).x"),
        call("float f(float a[3]) { return a[0]; }", "f(float[](1.0, 2.0, 3.0))"),
        call("float f(bool b) { for (;;) { if (b) return 1.0; } }", "f(true)"),
        call("float f(int n) { switch (n) { case 0: return 1.0; default: return 2.0; } }", "f(1)"),
        call("float f() { if (true) return 1.0; else return 2.0; }", "f()"),
        call("precise float f(float x) { return x * x; }", "f(2.0)"),
    ]);
    refused([
        ("E0203", call("float f(float x) { return x; } float f(float y) { return y; }", "f(1)")),
        ("E0203", call("float f(float x) { return x; } int f(float y) { return 1; }", "f(1)")),
        ("E0203", call("float f(float x) { float x = 1.0; return x; }", "f(1)")),
        ("E0203", call("float f(const float x); float f(float x) { return x; }", "f(1)")),
        ("E0203", call("float f(float x); float f(const float x) { return x; }", "f(1)")),
        ("E0203", call("float[2] f(); float[3] f() { return float[3](1, 2, 3); }", "f()[0]")),
        ("E0212", call("float f(uint x) { return 1.0; } float f(float x) { return 2.0; }", "f(1)")),
        (
            "E0216",
            call(
                "float f(float x); float g(float x) { return f(x); } float f(float x) { return g(x); }",
                "f(1.0)",
            ),
        ),
        ("E0201", call("float g() { return f(); } float f() { return 1.0; }", "g()")),
        ("E0218", call("float f() { }", "f()")),
        ("W0243", call("float f(bool b) { if (b) return 1.0; }", "f(true)")),
        ("W0243", call("float f(int n) { switch (n) { case 0: return 1.0; } }", "f(1)")),
        ("E0217", call("float f(bool b) { if (b) return; return 1.0; }", "f(true)")),
        ("W0241", call("float f(out float x) { return x; }", "1.0")),
        ("E0221", call("float f();", "f()")),
        ("E0222", call("float f(const out float x) { x = 1.0; return x; }", "1.0")),
        ("E0225", call("float rt_f() { return 1.0; }", "1.0")),
        ("E0225", call("float a__b() { return 1.0; }", "1.0")),
        ("E0210", call("float f(const float x) { x = 1.0; return x; }", "1.0")),
        ("E0229", call("float f(rt_Texture t[2]) { return 1.0; }", "1.0")),
    ]);
}

#[test]
fn constant_expressions() {
    accepted([
        "const int N = int(max(2.0, sqrt(9.0))) + 1;\nconst float T[N] = { 1, 2, 3, 4 };\n".to_owned()
            + &value("float a[int(T[2]) * 2]; a[5] = 1.0;", "a[5]"),
        "const vec3 V = normalize(vec3(3, 0, 4)) * mat3(2.0);\nconst int N = int(V.x * 10.0 + 0.5);\n"
            .to_owned()
            + &value("int a[N]; a[11] = 1;", "a[11]"),
        "struct S { int n; vec2 v[2]; };\nconst S s = S(2, vec2[2](vec2(1), vec2(2)));\n".to_owned()
            + &value("int a[s.n + int(s.v[1].y)]; a[3] = 1;", "a[3]"),
        "class C : rt_Texture;\npublic float w[N];\nconst int N = M * 2;\nconst int M = 3 << 1;\nvoid lookup() { rt_FloatTextureValue = w[11]; }\nconstructor() { w[11] = 1.0; }".to_owned(),
        value("const bool b = true && !false || 1 > 2; int a[b ? 3 : 1]; a[2] = 1;", "a[2]"),
        value("const int i = (1 / 0) + (7 % 0) + 1; int a[i]; a[0] = 1;", "a[0]"),
    ]);
    refused([
        ("E0309", format!("const float x = rand();\n{}", texture(""))),
        ("E0401", format!("float f() {{ return 1.0; }}\nconst float x = f();\n{}", texture(""))),
        ("E0403", value("float a[-1]; a[0] = 1.0;", "1.0")),
        ("E0204", value("float a[2.0]; a[0] = 1.0;", "1.0")),
        (
            "E0234",
            "class C : rt_Texture;\nconst int A = B;\nconst int B = A;\nvoid lookup() { }\n"
                .to_owned(),
        ),
    ]);
}

#[test]
fn parameters_may_have_default_values() {
    let calling = |functions: &str, call: &str| {
        format!(
            "class C : rt_Texture;\n{functions}\nvoid lookup() {{ rt_FloatTextureValue = {call}; }}\n"
        )
    };
    let two = "float f(float a, float b = 1.0) { return a + b; }";
    accepted([
        calling(two, "f(1) + f(1, 2)"),
        calling(
            "const int N = 2; float f(int a = N * 2, float b = sqrt(4.0)) { return b * float(a); }",
            "f() + f(3)",
        ),
        calling(
            "float f(float a, float b = 1.0); float f(float a, float b) { return a + b; }",
            "f(1.0)",
        ),
        // Without default values first, even if arguments are converted.
        calling(&format!("{two} float f(int a) {{ return float(a); }}"), "f(1) + f(1u)"),
        calling("float f(float[2] a = float[2](1.0, 2.0)) { return a[0]; }", "f()"),
    ]);
    refused([
        ("E0232", calling("float f(float a = 1.0, float b) { return a + b; }", "f(1.0, 2.0)")),
        (
            "E0401",
            "float g(float x); float f(float a = g(1.0)) { return a; } float g(float x) { return x + f(); }
            class C : rt_Texture; void lookup() { rt_FloatTextureValue = f(); }"
                .to_owned(),
        ),
        ("E0232", calling("float f(out float a = 1.0) { a = 2.0; return a; }", "f()")),
        ("E0232", calling("float f(float a); float f(float a = 1.0) { return a; }", "f(1.0)")),
        ("E0204", calling("float f(float a = true) { return a; }", "f()")),
        ("E0201", calling("float f(float a = missing) { return a; }", "f()")),
        ("E0211", calling(two, "f()")),
        ("E0211", calling(two, "f(1, 2, 3)")),
        (
            "E0212",
            calling(
                "float f(uint a, float b = 1.0) { return b; } float f(float a, int b = 1) { return a; }",
                "f(1)",
            ),
        ),
    ]);
}
