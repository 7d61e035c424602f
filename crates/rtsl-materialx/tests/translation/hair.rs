//! Hair.

use expect_test::expect;

use crate::{input, link, node, text_of, with_closure, with_material};

#[test]
fn hair_is_that_of_the_library() {
    let roughness = |name: &str| {
        format!("<input name=\"{name}\" type=\"vector2\" nodename=\"r\" output=\"{name}\"/>")
    };
    let inputs = [
        roughness("roughness_R"),
        roughness("roughness_TRT"),
        link("absorption_coefficient", "vector3", "a"),
        input("tint_R", "color3", "0.9, 0.8, 0.7"),
        input("cuticle_angle", "float", "0.52"),
    ];
    let elements = [
        node("chiang_hair_roughness", "r", "multioutput", &input("longitudinal", "float", "0.3")),
        node("chiang_hair_absorption_from_color", "a", "vector3", ""),
        node("chiang_hair_bsdf", "hair", "BSDF", &inputs.concat()),
    ];
    expect![[r#"
        import shaders.materialx.hair as mxHair;

        /// `m` of `test.mtlx`, translated from MaterialX.
        class M : Hair;

        public texture float eta = 1.55;

        color absorption(float azimuthal) {
            vec3 n0 = mxHair.absorptionOfColor(vec3(1.0), 0.2);
            return color(max(n0, vec3(0.0)));
        }

        Strand strandHere() {
            vec2 n1 = mxHair.roughness(0.3, 0.2, 1.0);
            vec2 n2 = mxHair.roughness(0.3, 0.2, 2.0);
            return strandOfLobes(mxHair.usable(n1), mxHair.usable(vec2(0.05)), mxHair.usable(n2), radians(90.0 - 180.0 * 0.52));
        }

        void attenuations(Strand strand, vec2 view, vec2 within, out color parts[LOBES]) {
            super.attenuations(strand, view, within, parts);
            parts[0] *= color(max(vec3(0.9, 0.8, 0.7), vec3(0.0)));
        }
    "#]].assert_eq(&text_of(&with_closure(&elements.concat(), "hair")));
}

#[test]
fn inputs_without_effect_are_warnings() {
    let hair = node("chiang_hair_bsdf", "hair", "BSDF", &input("normal", "vector3", "0, 0, 1"));
    let text = text_of(&with_closure(&hair, "hair"));
    assert!(text.contains("W0605") && text.contains("`normal` has no effect on hair"), "{text}");
}

#[test]
fn hair_has_the_opacity_of_its_surface() {
    let inputs = [link("bsdf", "BSDF", "hair"), input("opacity", "float", "0.7")];
    let elements = [
        node("chiang_hair_bsdf", "hair", "BSDF", ""),
        node("surface", "surface", "surfaceshader", &inputs.concat()),
    ];
    let text = text_of(&with_material(&elements.concat()));
    assert!(
        text.contains("\nvoid presence() {\n    rt_Presence = clamp(0.7, 0.0, 1.0);\n}\n"),
        "{text}"
    );
}

#[test]
fn hair_is_no_part_of_other_closures() {
    let elements = [
        node("chiang_hair_bsdf", "hair", "BSDF", ""),
        node("multiply", "dark", "BSDF", &link("in1", "BSDF", "hair")),
    ];
    expect![[r#"
        error[E0632]: `chiang_hair_bsdf` is not the only closure of its surface
          ┌─ test.mtlx:2:1
          │
        2 │ <chiang_hair_bsdf name="hair" type="BSDF"></chiang_hair_bsdf>
          │ ^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^
          │
          = help: mix surfaces instead of closures

    "#]]
    .assert_eq(&text_of(&with_closure(&elements.concat(), "dark")));
}
