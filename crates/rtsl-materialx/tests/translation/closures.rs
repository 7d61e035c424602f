//! Surfaces of closures.

use expect_test::expect;

use crate::{input, link, node, text_of, with_closure};

#[test]
fn a_layer_scales_the_lobe_below() {
    let layers = link("top", "BSDF", "fibres") + &link("base", "BSDF", "matte");
    let elements = [
        node("sheen_bsdf", "fibres", "BSDF", ""),
        node("oren_nayar_diffuse_bsdf", "matte", "BSDF", ""),
        node("layer", "all", "BSDF", &layers),
    ];
    let text = with_closure(&elements.concat(), "all");
    expect![[r#"
        import shaders.materialx.closures as mxClosures;

        /// `m` of `test.mtlx`, translated from MaterialX.
        class M : rt_Material;

        struct Lobes {
            mxClosures.Lobe lobe0;
            mxClosures.Lobe lobe1;
        };

        Lobes gather() {
            Lobes it;
            it.lobe0 = mxClosures.scaled(mxClosures.sheen(1.0, vec3(1.0), 0.3, rt_ShadingNormal, rt_dPdu, rt_RayDirection),
                vec3(1.0), rt_Regularization);
            it.lobe1 = mxClosures.scaled(mxClosures.matte(1.0, vec3(0.18), 0.0, rt_ShadingNormal, rt_dPdu, rt_RayDirection),
                vec3(1.0), rt_Regularization);
            return it;
        }

        vec3 passed0(Lobes it, vec3 d) { return mxClosures.passed(it.lobe0, d); }

        vec3 valueOf(Lobes it, vec3 light) {
            vec3 view = -normalize(rt_RayDirection);
            return mxClosures.value(it.lobe0, light)
                + mxClosures.value(it.lobe1, light) * min(passed0(it, view), passed0(it, light));
        }

        float share0(Lobes it) { return mxClosures.share(it.lobe0); }

        float share1(Lobes it) { return mxClosures.share(it.lobe1) * dot(passed0(it, -normalize(rt_RayDirection)), vec3(1.0 / 3.0)); }

        float densityOf(Lobes it, vec3 light) {
            float sum = share0(it) + share1(it);
            return sum > 0.0 ? (share0(it) * mxClosures.density(it.lobe0, light)
                + share1(it) * mxClosures.density(it.lobe1, light)) / sum : 0.0;
        }

        void BSDF() { rt_BSDFValue = color(valueOf(gather(), rt_LightDirection)); }

        void evaluatePDF() { rt_PDF = densityOf(gather(), rt_LightDirection); }

        void sampleBSDF() {
            float choice = rt_BSDFSeed.z;
            Lobes it = gather();
            choice *= (share0(it) + share1(it));
            vec3 light = vec3(0.0);
            float beyond = 1.0;
            if (choice < share0(it)) {
                light = mxClosures.sampled(it.lobe0, rt_BSDFSeed.xy);
                beyond = mxClosures.indexBeyond(it.lobe0);
            } else {
                light = mxClosures.sampled(it.lobe1, rt_BSDFSeed.xy);
                beyond = mxClosures.indexBeyond(it.lobe1);
            }
            if (light == vec3(0.0)) return;
            rt_LightDirection = light;
            if (beyond != 1.0) rt_RelativeIndex = beyond;
            rt_BSDFValue = color(valueOf(it, light));
            rt_PDF = densityOf(it, light);
        }
    "#]].assert_eq(&text_of(&text));
}

#[test]
fn boundaries_have_an_inside_if_light_passes_them() {
    let dielectric = |mode: &str| {
        let elements = node("dielectric_bsdf", "d", "BSDF", &input("scatter_mode", "string", mode));
        text_of(&with_closure(&elements, "d"))
    };
    let (reflecting, both) = (dielectric("R"), dielectric("RT"));
    assert!(reflecting.contains("vec2(0.05), false, ") && !reflecting.contains("bending"));
    assert!(both.contains("vec2(0.05), true, ") && both.contains("mxClosures.bending("));
    assert!(!both.contains('$'), "{both}");
}

#[test]
fn closures_without_counterpart_are_errors() {
    let text = text_of(&with_closure(&node("velvet_bsdf", "velvet", "BSDF", ""), "velvet"));
    expect![[r#"
        error[E0632]: the closure `velvet_bsdf` is not supported
          ┌─ test.mtlx:2:1
          │
        2 │ <velvet_bsdf name="velvet" type="BSDF"></velvet_bsdf>
          │ ^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^

    "#]]
    .assert_eq(&text);
}

#[test]
fn a_surface_may_be_empty() {
    let text = text_of(&crate::with_material("<surface name=\"surface\" type=\"surfaceshader\"/>"));
    assert!(text.contains("class M : rt_Material") && !text.contains("error"), "{text}");
}

/// Closures that are connected in a circle.
#[test]
fn circles_of_closures_are_refused() {
    let dark = |name: &str, of: &str| node("multiply", name, "BSDF", &link("in1", "BSDF", of));
    let text = with_closure(&(dark("a", "b") + &dark("b", "a")), "a");
    assert!(text_of(&text).contains("E0632"));
}

/// Each sum has the next one twice.
#[test]
fn closures_that_double_are_refused() {
    let sum = |index: usize| {
        let next = format!("s{}", index + 1);
        let inputs = link("in1", "BSDF", &next) + &link("in2", "BSDF", &next);
        node("add", &format!("s{index}"), "BSDF", &inputs)
    };
    let sums: String = (0..40).map(sum).collect();
    let text = text_of(&with_closure(&(sums + &node("add", "s40", "BSDF", "")), "s0"));
    assert!(text.contains("E0632") && text.contains("too many nodes"), "{text}");
}
