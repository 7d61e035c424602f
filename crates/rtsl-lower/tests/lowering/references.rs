//! Calls of referenced instances: overrides and results.

use expect_test::{Expect, expect};
use rtsl_spec::Method;

use crate::harness::{class, text_of};

/// The lines of a method's text about references and random numbers, and its result.
fn check(text: &str, method: Method, expected: Expect) {
    let text = text_of(&class(text), method);
    let shown = text
        .lines()
        .filter(|line| ["call ", "set ", "rand", "return"].iter().any(|word| line.contains(word)));
    let shown: String = shown.map(|line| format!("{}\n", line.trim())).collect();
    expected.assert_eq(&shown);
}

#[test]
fn the_callee_sees_what_the_caller_has() {
    check(
        "class M : rt_Material; public rt_Texture kd;
        void BSDF() { rt_BSDFValue = kd.lookup(); }",
        Method::Bsdf,
        expect![[r#"
            %3: f32, %4: f32, %5: f32 = call texture.lookup of kd (rt_dsdu@0 = %2, rt_dsdv@0 = %1, rt_dtdu@0 = %1, rt_dtdv@0 = %2) gives (rt_TextureColor@0, rt_TextureColor@1, rt_TextureColor@2)
            return state:rt_BSDFValue@0 = %3, state:rt_BSDFValue@1 = %4, state:rt_BSDFValue@2 = %5
        "#]],
    );
}

#[test]
fn arguments_replace_the_coordinates() {
    check(
        "class T : rt_Texture; public rt_Texture a; public rt_Texture b[3];
        void lookup() {
            rt_FloatTextureValue = a.lookupFloat(rt_TextureUV * 2.0)
                + b[int(rt_TextureUV.x)].lookupFloat(rt_TextureUVW + 1.0);
            rt_TextureColor = b[1].lookup();
        }",
        Method::Lookup,
        expect![[r#"
            %7: f32 = call texture.lookup of a (rt_TextureUV@0 = %5, rt_TextureUV@1 = %6) gives (rt_FloatTextureValue@0)
            %21: f32 = call texture.lookup of b@%13 (rt_TextureUVW@0 = %18, rt_TextureUVW@1 = %19, rt_TextureUVW@2 = %20) gives (rt_FloatTextureValue@0)
            %25: f32, %26: f32, %27: f32 = call texture.lookup of b@%24 () gives (rt_TextureColor@0, rt_TextureColor@1, rt_TextureColor@2)
            return state:rt_TextureColor@0 = %25, state:rt_TextureColor@1 = %26, state:rt_TextureColor@2 = %27, state:rt_FloatTextureValue@0 = %22
        "#]],
    );
}

#[test]
fn the_light_sample_and_written_state_are_overrides() {
    check(
        "class M : rt_Material; public rt_Material base;
        void shade() { illuminance { rt_SampleColor += base.BSDF() * rt_LightColor; } }",
        Method::Shade,
        expect![[r#"
            %24: f32, %25: f32, %26: f32 = call material.BSDF of base (rt_LightDirection@0 = %16, rt_LightDirection@1 = %17, rt_LightDirection@2 = %18) gives (rt_BSDFValue@0, rt_BSDFValue@1, rt_BSDFValue@2)
            return state:rt_SampleColor@0 = %44, state:rt_SampleColor@1 = %45, state:rt_SampleColor@2 = %46
        "#]],
    );
}

#[test]
fn sampling_sets_the_callers_direction_and_density() {
    check(
        "class M : rt_Material; public rt_Material base;
        void sampleBSDF() { rt_BSDFValue = base.sampleBSDF(); }",
        Method::SampleBsdf,
        expect![[r#"
            %3: f32, %4: f32, %5: f32, %6: f32, %7: f32, %8: f32, %9: f32, %10: f32 = call material.sampleBSDF of base () gives (rt_BSDFValue@0, rt_BSDFValue@1, rt_BSDFValue@2, rt_LightDirection@0, rt_LightDirection@1, rt_LightDirection@2, rt_PDF@0, rt_RelativeIndex@0)
            return state:rt_PDF@0 = %9, state:rt_LightDirection@0 = %6, state:rt_LightDirection@1 = %7, state:rt_LightDirection@2 = %8, state:rt_BSDFValue@0 = %3, state:rt_BSDFValue@1 = %4, state:rt_BSDFValue@2 = %5, state:rt_RelativeIndex@0 = %10
        "#]],
    );
}

#[test]
fn a_caller_without_a_seed_draws_one() {
    check(
        "class M : rt_Material; public rt_Material base;
        void shade() { rt_SampleColor = base.sampleBSDF() * rt_PDF + color(rt_LightDirection.x); }",
        Method::Shade,
        expect![[r#"
            %3: f32 = rand
            %4: f32 = rand
            %5: f32 = rand
            %6: f32, %7: f32, %8: f32, %9: f32, %10: f32, %11: f32, %12: f32, %13: f32 = call material.sampleBSDF of base (rt_BSDFSeed@0 = %3, rt_BSDFSeed@1 = %4, rt_BSDFSeed@2 = %5) gives (rt_BSDFValue@0, rt_BSDFValue@1, rt_BSDFValue@2, rt_LightDirection@0, rt_LightDirection@1, rt_LightDirection@2, rt_PDF@0, rt_RelativeIndex@0)
            return state:rt_SampleColor@0 = %17, state:rt_SampleColor@1 = %18, state:rt_SampleColor@2 = %19
        "#]],
    );
}

#[test]
fn is_set_tests_references() {
    check(
        "class M : rt_Material; public rt_Texture map; public rt_Texture maps[2];
        void emission() {
            if (isSet(map)) rt_EmissionColor = map.lookup();
            for (int i = 0; i < 2; i++) if (isSet(maps[i])) rt_EmissionColor += maps[i].lookup();
        }",
        Method::Emission,
        expect![[r#"
            %2: bool = is_set map
            %4: f32, %5: f32, %6: f32 = call texture.lookup of map (rt_dsdu@0 = %3, rt_dsdv@0 = %1, rt_dtdu@0 = %1, rt_dtdv@0 = %3) gives (rt_TextureColor@0, rt_TextureColor@1, rt_TextureColor@2)
            %20: bool = is_set maps@%19
            %23: f32, %24: f32, %25: f32 = call texture.lookup of maps@%22 (rt_dsdu@0 = %3, rt_dsdv@0 = %1, rt_dtdu@0 = %1, rt_dtdv@0 = %3) gives (rt_TextureColor@0, rt_TextureColor@1, rt_TextureColor@2)
            return state:rt_EmissionColor@0 = %35, state:rt_EmissionColor@1 = %36, state:rt_EmissionColor@2 = %37
        "#]],
    );
}
