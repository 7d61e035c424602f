//! Surfaces of closures.

use expect_test::expect;

use crate::text_of;

/// A document with a surface of this closure.
fn with_closure(elements: &str, closure: &str) -> String {
    crate::with_material(&format!(
        "{elements}\n<surface name=\"surface\" type=\"surfaceshader\">\n\
         <input name=\"bsdf\" type=\"BSDF\" nodename=\"{closure}\"/>\n</surface>"
    ))
}

#[test]
fn a_layer_scales_the_lobe_below() {
    let text = with_closure(
        r#"<sheen_bsdf name="fibres" type="BSDF"/>
           <oren_nayar_diffuse_bsdf name="matte" type="BSDF"/>
           <layer name="all" type="BSDF">
             <input name="top" type="BSDF" nodename="fibres"/>
             <input name="base" type="BSDF" nodename="matte"/>
           </layer>"#,
        "all",
    );
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
        let elements = format!(
            "<dielectric_bsdf name=\"d\" type=\"BSDF\">\
             <input name=\"scatter_mode\" type=\"string\" value=\"{mode}\"/></dielectric_bsdf>"
        );
        text_of(&with_closure(&elements, "d"))
    };
    let (reflecting, both) = (dielectric("R"), dielectric("RT"));
    assert!(reflecting.contains("vec2(0.05), false, ") && !reflecting.contains("bending"));
    assert!(both.contains("vec2(0.05), true, ") && both.contains("mxClosures.bending("));
    assert!(!both.contains('$'), "{both}");
}

#[test]
fn closures_without_counterpart_are_errors() {
    let text = with_closure("<chiang_hair_bsdf name=\"hair\" type=\"BSDF\"/>", "hair");
    expect![[r#"
        import shaders.materialx.hair as mxHair;

        /// `m` of `test.mtlx`, translated from MaterialX.
        class M : Hair;

        public texture float eta = 1.55;

        color absorption(float azimuthal) {
            return color(max(vec3(0.0), vec3(0.0)));
        }

        Strand strandHere() {
            return strandOfLobes(mxHair.usable(vec2(0.1)), mxHair.usable(vec2(0.05)), mxHair.usable(vec2(0.2)), radians(90.0 - 180.0 * 0.5));
        }
    "#]]
    .assert_eq(&text_of(&text));
}

#[test]
fn a_surface_may_be_empty() {
    let text = text_of(&crate::with_material("<surface name=\"surface\" type=\"surfaceshader\"/>"));
    assert!(text.contains("class M : rt_Material") && !text.contains("error"), "{text}");
}

/// Closures that are connected in a circle.
#[test]
fn circles_of_closures_are_refused() {
    let text = with_closure(
        "<multiply name=\"a\" type=\"BSDF\"><input name=\"in1\" type=\"BSDF\" nodename=\"b\"/></multiply>\n\
         <multiply name=\"b\" type=\"BSDF\"><input name=\"in1\" type=\"BSDF\" nodename=\"a\"/></multiply>",
        "a",
    );
    assert!(text_of(&text).contains("E0632"));
}
