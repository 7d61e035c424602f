//! Materials with one mistake each: the contract that it breaks finds it, and the report says so.

use expect_test::expect;
use rtsl::{Compiler, Engine, Instance};
use rtsl_contract::{Contract, Options, Outcome, check, engine_options};

use crate::common::finds;

/// A matte surface with parts to be replaced.
fn matte(value: &str, sample: &str, density: &str) -> String {
    format!(
        "class Matte : rt_Material;
        const float PI = 3.14159265;
        vec3 up() {{ return faceforward(rt_ShadingNormal, rt_RayDirection, rt_ShadingNormal); }}
        void BSDF() {{
            vec3 n = up();
            vec3 view = -normalize(rt_RayDirection);
            float light = dot(n, rt_LightDirection);
            if (light > 0.0) rt_BSDFValue = color({value});
        }}
        void sampleBSDF() {{
            rt_LightDirection = toWorld(makeFrame(up()), {sample});
            BSDF();
            evaluatePDF();
        }}
        void evaluatePDF() {{
            float cosine = dot(up(), rt_LightDirection);
            rt_PDF = cosine > 0.0 ? {density} : 0.0;
        }}"
    )
}

const COSINE: &str = "sampleCosineHemisphere(rt_BSDFSeed.xy)";

#[test]
fn a_matte_surface_is_right() {
    finds(
        &matte("0.8 / PI", COSINE, "cosine / PI"),
        expect![[r#"
        keeps all
    "#]],
    );
}

#[test]
fn a_density_that_is_too_large() {
    finds(
        &matte("0.8 / PI", COSINE, "1.1 * cosine / PI"),
        expect![[r#"
            breaks
              BROKEN  the density integrates to the part of samples that have one
                      seen 0 degrees from the normal: the density's integral is 1.1000, where 1.0000 of the samples have a density
                      (7 of 7 tests)
                      inputs of evaluatePDF: rt_RayDirection=-0.5151778,-1.3738074,0.85862964 rt_ShadingNormal=0.30304575,0.80812204,-0.5050763 rt_LightDirection=0.29906592,0.9246375,0.2358072
                      look at: a constant factor of the density, shares of lobes that do not add up to 1, or directions that evaluatePDF counts and sampleBSDF never makes
        "#]],
    );
}

#[test]
fn a_density_of_other_samples() {
    finds(
        &matte("0.8 / PI", COSINE, "0.5 / PI"),
        expect![[r#"
            breaks
              BROKEN  samples are distributed as evaluatePDF says
                      seen 0 degrees from the normal: chi-square is 4709 in 285 cells, where chance stays below 436; around (-0.907, 0.369, -0.202) there are 50 samples instead of 234.4
                      (7 of 7 tests)
                      inputs of evaluatePDF: rt_RayDirection=-0.5151778,-1.3738074,0.85862964 rt_ShadingNormal=0.30304575,0.80812204,-0.5050763 rt_LightDirection=-0.90733093,0.368925,-0.20160592
                      look at: the density of what sampleBSDF really does: the Jacobian of its map, the shares of its lobes, its frame
              BROKEN  no more light is scattered than arrives
                      seen 27 degrees from the normal, from behind: of white light, 1.0706 is reflected and 0.0000 goes through; chance explains 0.0171
                      (21 of 21 tests)
                      look at: a missing division by pi, a lobe without its normalisation, or lobes whose weights add up to more than 1
        "#]],
    );
}

#[test]
fn samples_of_another_density() {
    let sample = "sampleUniformHemisphere(rt_BSDFSeed.yx).yxz";
    finds(
        &matte("0.8 / PI", sample, "cosine / PI"),
        expect![[r#"
            breaks
              BROKEN  samples are distributed as evaluatePDF says
                      seen 0 degrees from the normal: chi-square is 15307 in 257 cells, where chance stays below 401; around (-0.566, 0.625, 0.537) there are 573 samples instead of 73.2
                      (7 of 7 tests)
                      inputs of evaluatePDF: rt_RayDirection=-0.5151778,-1.3738074,0.85862964 rt_ShadingNormal=0.30304575,0.80812204,-0.5050763 rt_LightDirection=-0.56604826,0.62533534,0.5371639
                      look at: the density of what sampleBSDF really does: the Jacobian of its map, the shares of its lobes, its frame
        "#]],
    );
}

#[test]
fn a_surface_that_shines_by_itself() {
    finds(
        &matte("1.2 / PI", COSINE, "cosine / PI"),
        expect![[r#"
            breaks
              BROKEN  no more light is scattered than arrives
                      seen 72 degrees from the normal: of white light, 1.2000 is reflected and 0.0000 goes through; chance explains 0.0020
                      (21 of 21 tests)
                      look at: a missing division by pi, a lobe without its normalisation, or lobes whose weights add up to more than 1
        "#]],
    );
}

#[test]
fn light_that_takes_another_way_back() {
    finds(
        &matte("0.8 * light / PI", COSINE, "cosine / PI"),
        expect![[r#"
            breaks
              BROKEN  light takes the same way back
                      towards light [0.75342655, 0.08764391, -0.65166473] from viewer [0.68439126, 0.4895895, -0.5402876] BSDF is [0.15999275, 0.15999275, 0.15999275], with both exchanged [0.22305536, 0.22305536, 0.22305536]
                      (756 of 778 tests)
                      inputs of BSDF: rt_RayDirection=-0.68439126,-0.4895895,0.5402876 rt_ShadingNormal=0.30304575,0.80812204,-0.5050763 rt_LightDirection=0.75342655,0.08764391,-0.65166473
                      look at: BSDF must not change where viewer and light change places; light that comes through may, by one factor
        "#]],
    );
}

#[test]
fn a_direction_that_is_too_long() {
    let sample = format!("1.01 * {COSINE}");
    finds(
        &matte("0.8 / PI", &sample, "cosine / PI"),
        expect![[r#"
            breaks
              BROKEN  sampled directions have unit length
                      seen 0 degrees from the normal: sampleBSDF gives direction [-0.63735384, 0.76884854, -0.15083732], whose length is 1.01
                      (140000 of 140000 tests)
                      inputs of sampleBSDF: rt_RayDirection=-0.5151778,-1.3738074,0.85862964 rt_ShadingNormal=0.30304575,0.80812204,-0.5050763 rt_BSDFSeed=0.06680465,0.22599244,0.464198
                      look at: sampleBSDF sets rt_LightDirection; is something left to normalize?
              BROKEN  tilted shading normals do no harm
                      sampleBSDF gives direction [-0.5306166, 0.84786296, 0.14026554], value [0.2546479, 0.2546479, 0.2546479] and density 0.30599982
                      (2048 of 8192 tests)
                      inputs of sampleBSDF: rt_RayDirection=-0.382341,-0.8909857,0.24486697 rt_ShadingNormal=0.7106479,-0.7002818,0.06771272 rt_BSDFSeed=0.5100044,0.34665382,0.7861301
                      look at: return black and a density of 0 where view or light lie on the wrong side; guard divisions by cosines
              BROKEN  extreme rays do no harm
                      sampleBSDF gives direction [-0.35708895, 0.87468565, 0.35708892], value [0.2546479, 0.2546479, 0.2546479] and density 0.27842107
                      (1574 of 8192 tests)
                      inputs of sampleBSDF: rt_RayDirection=0.6,-0.0000001,0.8 rt_ShadingNormal=0,1,0 rt_BSDFSeed=0.25,0.25,0.0000001
                      look at: return black and a density of 0 where view or light lie on the wrong side; guard divisions by cosines
        "#]],
    );
}

#[test]
fn a_value_that_is_no_number() {
    let value = "sqrt(0.9 - light * light) / PI";
    finds(
        &matte(value, COSINE, "cosine / PI"),
        expect![[r#"
            breaks
              BROKEN  values are finite and not negative
                      seen 0 degrees from the normal: sampleBSDF gives value [NaN, NaN, NaN], density 0.30583516
                      (14003 of 1079405 tests)
                      inputs of sampleBSDF: rt_RayDirection=-0.5151778,-1.3738074,0.85862964 rt_ShadingNormal=0.30304575,0.80812204,-0.5050763 rt_BSDFSeed=0.45529586,0.36139506,0.24717242
                      look at: a division by a cosine that may be 0, the root or logarithm of a number below 0, or a weight below 0
              BROKEN  light takes the same way back
                      towards light [0.75342655, 0.08764391, -0.65166473] from viewer [0.68439126, 0.4895895, -0.5402876] BSDF is [0.226258, 0.226258, 0.226258], with both exchanged [0.11596943, 0.11596943, 0.11596943]
                      (629 of 678 tests)
                      inputs of BSDF: rt_RayDirection=-0.68439126,-0.4895895,0.5402876 rt_ShadingNormal=0.30304575,0.80812204,-0.5050763 rt_LightDirection=0.75342655,0.08764391,-0.65166473
                      look at: BSDF must not change where viewer and light change places; light that comes through may, by one factor
              BROKEN  tilted shading normals do no harm
                      BSDF gives [NaN, NaN, NaN]
                      (281 of 8192 tests)
                      inputs of BSDF: rt_RayDirection=0.33053738,-0.94115186,0.07055676 rt_ShadingNormal=0.53997123,0.23195188,0.8090917 rt_LightDirection=-0.4318557,0.017728932,-0.90176845
                      look at: return black and a density of 0 where view or light lie on the wrong side; guard divisions by cosines
              BROKEN  extreme rays do no harm
                      BSDF gives [NaN, NaN, NaN]
                      (367 of 8192 tests)
                      inputs of BSDF: rt_RayDirection=1,0,0 rt_ShadingNormal=0,1,0 rt_LightDirection=0,-1,0
                      look at: return black and a density of 0 where view or light lie on the wrong side; guard divisions by cosines
        "#]],
    );
}

/// Nobody can say how much light it scatters.
#[test]
fn a_value_that_is_never_a_number() {
    finds(
        &matte("0.0 / (light - light)", COSINE, "cosine / PI"),
        expect![[r#"
        breaks
          BROKEN  values are finite and not negative
                  seen 0 degrees from the normal: sampleBSDF gives value [NaN, NaN, NaN], density 0.15895337
                  (140000 of 1079405 tests)
                  inputs of sampleBSDF: rt_RayDirection=-0.5151778,-1.3738074,0.85862964 rt_ShadingNormal=0.30304575,0.80812204,-0.5050763 rt_BSDFSeed=0.06680465,0.22599244,0.464198
                  look at: a division by a cosine that may be 0, the root or logarithm of a number below 0, or a weight below 0
          BROKEN  tilted shading normals do no harm
                  BSDF gives [NaN, NaN, NaN]
                  (3098 of 8192 tests)
                  inputs of BSDF: rt_RayDirection=-0.382341,-0.8909857,0.24486697 rt_ShadingNormal=0.7106479,-0.7002818,0.06771272 rt_LightDirection=-0.832943,-0.42627722,-0.3528366
                  look at: return black and a density of 0 where view or light lie on the wrong side; guard divisions by cosines
          BROKEN  extreme rays do no harm
                  BSDF gives [NaN, NaN, NaN]
                  (2306 of 8192 tests)
                  inputs of BSDF: rt_RayDirection=0.6,-0.0000001,0.8 rt_ShadingNormal=0,1,0 rt_LightDirection=0.6,0.0000001,0.8
                  look at: return black and a density of 0 where view or light lie on the wrong side; guard divisions by cosines
    "#]],
    );
    let text = matte("0.0 / (light - light)", COSINE, "cosine / PI");
    let unit = Compiler::default().compile("wrong.rtsl", &text).unit.expect("it compiles");
    let instance = Instance::new(&unit.classes()[0], []).expect("it needs no parameters");
    let (engine, _) = Engine::new(engine_options()).expect("an engine");
    let report = check(&engine, &instance, &Options::default()).expect("it has code");
    let energy = report.findings.iter().find(|it| it.contract == Contract::Energy);
    let reason = "no sample has a value to measure".to_owned();
    assert_eq!(energy.map(|it| &it.outcome), Some(&Outcome::NotApplicable(reason)));
}

#[test]
fn a_quotient_of_cosines() {
    finds(
        &matte("0.1 / max(light, dot(n, view))", COSINE, "cosine / PI"),
        expect![[r#"
        keeps all
    "#]],
    );
    finds(
        &matte("0.1 / dot(n, view)", COSINE, "cosine / PI"),
        expect![[r#"
            breaks
              BROKEN  no more light is scattered than arrives
                      seen 85 degrees from the normal: of white light, 3.3383 is reflected and 0.0000 goes through; chance explains 0.0020
                      (9 of 21 tests)
                      look at: a missing division by pi, a lobe without its normalisation, or lobes whose weights add up to more than 1
              BROKEN  light takes the same way back
                      towards light [0.75342655, 0.08764391, -0.65166473] from viewer [0.68439126, 0.4895895, -0.5402876] BSDF is [0.11416354, 0.11416354, 0.11416354], with both exchanged [0.15916213, 0.15916213, 0.15916213]
                      (756 of 778 tests)
                      inputs of BSDF: rt_RayDirection=-0.68439126,-0.4895895,0.5402876 rt_ShadingNormal=0.30304575,0.80812204,-0.5050763 rt_LightDirection=0.75342655,0.08764391,-0.65166473
                      look at: BSDF must not change where viewer and light change places; light that comes through may, by one factor
              BROKEN  extreme rays do no harm
                      BSDF gives [inf, inf, inf]
                      (449 of 8192 tests)
                      inputs of BSDF: rt_RayDirection=1,0,0 rt_ShadingNormal=0,1,0 rt_LightDirection=0,-1,0
                      look at: return black and a density of 0 where view or light lie on the wrong side; guard divisions by cosines
        "#]],
    );
}

#[test]
fn a_loop_without_end() {
    let value = "0.0); float t = light; while (t >= 0.0) t = t * 0.5; rt_BSDFValue = color(t";
    finds(
        &matte(value, COSINE, "cosine / PI"),
        expect![[r#"
            breaks
              BROKEN  every call comes to its end
                      sampleBSDF ran past its budget of loop iterations
                      (1 of 1 tests)
                      look at: the condition of a loop, above all for NaN and infinity
        "#]],
    );
}
