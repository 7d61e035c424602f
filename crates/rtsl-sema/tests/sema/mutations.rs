//! Shaders of the library with words exchanged: the checker always answers, and a tree without
//! reported errors contains none.

use std::path::Path;

use proptest::prelude::*;
use rtsl_sema::print;
use rtsl_source::Diagnostic;

/// Texts that use every feature, split into words and the text between them.
fn words() -> Vec<Vec<String>> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
    let mut texts = vec![EVERYTHING.to_owned()];
    for name in ["materials/ward", "primitives/torus", "textures/marble", "lights/spot_light"] {
        texts.push(std::fs::read_to_string(root.join(format!("shaders/{name}.rtsl"))).unwrap());
    }
    texts.iter().map(|text| split(text)).collect()
}

const EVERYTHING: &str = r"
struct S { vec3 p[2]; float w; };
const float W[3] = { 1, 2, 3 };
const S s0 = S(vec3[](vec3(1), vec3(2)), W[1]);
float f(inout vec2 v, out int n, const float x) { n = int(v.x); v = v.yx * x; return x; }
class A : rt_Material, rt_Texture {
    public rt_Texture kd; public rt_Material layers[2]; public vec3 points[]; scratch S s; private mat3 m;
    const int N = int(max(2.0, sqrt(9.0)));
    constructor(float r = 1.0, color c = color(1)) { m = mat3(r); }
    void BSDF() { rt_BSDFValue = color(s.p[N - 2] * m); }
    void shade() {
        for (int i = 0; i < N; ++i) { switch (i) { case 1 + 1: continue; default: break; } }
        illuminance(rt_HitPoint, rt_ShadingNormal, 1) rt_SampleColor += rt_LightColor * rgb(color(0.5)).x;
        if (isSet(kd) && !inside()) rt_SampleColor *= kd.lookup(vec2(1)) + layers[N - 2].shade() * ambient();
        while (bool more = m[0].x > rand()) { m[0].x -= 1.0; }
    }
    void lookup() { vec2 v = rt_TextureUV; int n; rt_FloatTextureValue = f(v, n, 2.0) + float(n << 1 | 3) + noise(points[n]); }
};
class B : A { void lookup() { rt_TextureColor = s0.w > 1.0 ? color(s0.p[1]) : color(W[2]); } };
";

fn split(text: &str) -> Vec<String> {
    let mut words: Vec<String> = Vec::new();
    let mut inside = false;
    for letter in text.chars() {
        let is_word = letter.is_ascii_alphanumeric() || letter == '_';
        match words.last_mut() {
            Some(last) if is_word && inside => last.push(letter),
            _ => words.push(letter.to_string()),
        }
        inside = is_word;
    }
    words
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(300))]

    #[test]
    fn exchanged_words_never_panic(
        which in 0..5_usize,
        changes in prop::collection::vec((any::<prop::sample::Index>(), any::<prop::sample::Index>(), 0..3_u8), 1..6),
    ) {
        let mut words = words().swap_remove(which);
        for (at, from, kind) in changes {
            let (at, from) = (at.index(words.len()), from.index(words.len()));
            match kind {
                0 => words[at] = words[from].clone(),
                1 => words.swap(at, from),
                _ => words[at].clear(),
            }
        }
        let (module, _, said) = rtsl_testing::checked::check(&words.concat());
        if !said.iter().any(Diagnostic::is_error) {
            for class in &module.classes {
                let printed = print::class(&module, class);
                prop_assert!(!printed.contains("<error>"), "{}\n{}", words.concat(), printed);
            }
        }
    }
}
