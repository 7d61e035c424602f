//! The typed trees of source texts.

use expect_test::{Expect, expect};
use rtsl_sema::print;

/// Compares the tree of the last class of the text with `expected`.
fn check(text: &str, expected: &Expect) {
    let (module, _, said) = rtsl_testing::checked::check(text);
    assert!(said.is_empty(), "{}", rtsl_testing::checked::diagnostics(text));
    let class = module.classes.last().unwrap();
    let mut printed = print::class(&module, class);
    // The indices of functions depend on the prelude; those of the unit are shown from 0 on.
    let first = rtsl_sema::prelude::prelude().checked.module().functions.len();
    for index in first..module.functions.len() {
        printed = printed.replace(&format!("@{index}("), &format!("@{}(", index - first));
    }
    expected.assert_eq(&printed);
}

#[test]
fn conversions_are_written_out() {
    check(
        "class C : rt_Texture;\nvoid lookup() { int i = 3; uint u = i; vec2 v = ivec2(i); v += i; v = i * v; bool b = i < 2.5; rt_FloatTextureValue = b ? i : u; }",
        &expect![[r#"
            class C : texture
            void lookup@0() {
                int i#0 = 3;
                uint u#1 = uint<-(i#0);
                vec2 v#2 = vec2<-(ivec2(i#0));
                (v#2 += float<-(i#0));
                (v#2 = (float<-(i#0) * v#2));
                bool b#3 = (float<-(i#0) < 2.5);
                (rt_FloatTextureValue = float<-((b#3 ? uint<-(i#0) : u#1)));
            }
        "#]],
    );
}

#[test]
fn calls_name_their_functions() {
    check(
        "float f(float x) { return x; } float f(inout int n) { n++; return f(float(n)); }\nclass C : rt_Texture;\nvoid lookup() { int n = 1; float e; rt_FloatTextureValue = f(n) + frexp(8.0, e) + e; rt_TextureColor = color(sin(rt_TextureUVW)) + pow(color(0.5), 2); }",
        &expect![[r#"
            class C : texture
            void lookup@2() {
                int n#0 = 1;
                float e#1;
                (rt_FloatTextureValue = ((f@1(n#0) + frexp(8.0, e#1)) + e#1));
                (rt_TextureColor = (color(sin*(rt_TextureUVW)) + pow*(color(0.5), 2.0)));
            }
        "#]],
    );
}

#[test]
fn places() {
    check(
        "struct S { vec3 p[2]; float w; };\nclass C : rt_Texture;\npublic vec3 points[];\npublic rt_Texture t[2];\nscratch S s;\nconst float W[3] = { 1, 2, 3 };\nvoid lookup() { s.p[1].zx = points[points.length() - 1].xy; s.p[int(s.w)].y = W[2] + W[int(s.w)]; if (isSet(t[0])) rt_FloatTextureValue = t[1].lookupFloat(vec2(1)); s.w++; }",
        &expect![[r#"
            class C : texture
            public vec3[] points;
            public rt_Texture[2] t;
            scratch S s;
            void lookup@0() {
                (self.s.p[1].zx = self.points[(self.points.length() - 1)].xy);
                (self.s.p[int<-(self.s.w)].y = (3.0 + float[3]{1.0, 2.0, 3.0}[int<-(self.s.w)]));
                if (isSet(self.t[0])) {
                    (rt_FloatTextureValue = self.t[1].lookupFloat(rt_TextureUV = vec2(1)));
                }
                self.s.w++;
            }
        "#]],
    );
}

#[test]
fn control() {
    check(
        "class C : rt_Material;\npublic float x = 2 * 3;\nconstructor(float r = 1) { x += r; }\nvoid shade() { for (int i = 0; i < 4; ++i) { switch (i) { case 1 + 1: continue; default: break; } } while (bool more = x > 1.0) { if (more) break; else return; } do ; while (false); illuminance(rt_HitPoint, rt_ShadingNormal, 1) rt_SampleColor += rt_LightColor; }",
        &expect![[r#"
            class C : material
            public float x = float<-((2 * 3));
            void constructor@1(float r#0) {
                (self.x += r#0);
            }
            void shade@0() {
                    int i#0 = 0;
                while ((i#0 < 4); ++i#0) {
                    switch (i#0) {
                    case 2:
                        continue;
                    default:
                        break;
                    }
                }
                while (more#1 = (self.x > 1.0)) {
                    if (more#1) {
                        break;
                    } else {
                        return;
                    }
                }
                do while (false) {
                }
                illuminance(rt_HitPoint, rt_ShadingNormal, 1.0) {
                    (rt_SampleColor += rt_LightColor);
                }
            }
        "#]],
    );
}
