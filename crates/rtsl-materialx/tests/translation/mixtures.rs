//! Mixtures of surfaces.

use expect_test::expect;

use crate::{input, link, node, text_of, with_material};

/// A mixture of two surfaces, from the second to the first.
fn mix(name: &str, front: &str, back: &str, amount: &str) -> String {
    let inputs =
        [link("fg", "surfaceshader", front), link("bg", "surfaceshader", back), amount.to_owned()];
    node("mix", name, "surfaceshader", &inputs.concat())
}

fn gold(name: &str) -> String {
    node("standard_surface", name, "surfaceshader", &input("metalness", "float", "1"))
}

fn paint(name: &str) -> String {
    let color = input("base_color", "color3", "0.1, 0.2, 0.6");
    node("open_pbr_surface", name, "surfaceshader", &color)
}

fn quarter() -> String {
    input("mix", "float", "0.25")
}

#[test]
fn two_models_are_parts_of_a_mix() {
    let elements = [
        gold("gold"),
        paint("paint"),
        node("noise2d", "dirt", "float", ""),
        mix("surface", "gold", "paint", &link("mix", "float", "dirt")),
    ];
    expect![[r#"
        import shaders.materialx.noise as mxNoise;

        /// `paint` of `test.mtlx`, translated from MaterialX.
        class Paint : OpenPbr;

        public texture color baseColor = color(vec3(0.1, 0.2, 0.6));

        /// `gold` of `test.mtlx`, translated from MaterialX.
        class Gold : StandardSurface;

        public texture float metalness = 1.0;

        /// `m` of `test.mtlx`, translated from MaterialX.
        ///
        /// In it, `first` is a `Paint`, `second` is a `Gold`.
        class M : Mix;

        float amount() {
            vec2 n0 = rt_TextureUV;
            float n1 = mxNoise.perlin(n0) * 1.0 + 0.0;
            return n1;
        }
    "#]]
    .assert_eq(&text_of(&with_material(&elements.concat())));
}

#[test]
fn mixtures_of_mixtures_are_one_class() {
    let whole = input("opacity", "color3", "1, 1, 1");
    let elements = [
        gold("gold"),
        node("standard_surface", "paint", "surfaceshader", &whole),
        gold("silver"),
        mix("inner", "gold", "paint", &quarter()),
        mix("surface", "inner", "silver", &quarter()),
    ];
    let text = text_of(&with_material(&elements.concat()));
    let class = text.split("/// `m`").nth(1).unwrap();
    assert!(class.contains("`part1` is a `Silver`, `part2` is a `Paint`, `part3` is a `Gold`"));
    let [all, first, second] =
        ["", "(1.0 - clamp(amount1, 0.0, 1.0))", "clamp(amount1, 0.0, 1.0) * (1.0 - clamp(amount2"];
    for weight in [all, first, second] {
        assert!(class.contains(&format!("return {weight}")), "{weight}: {class}");
    }
    assert_eq!(class.matches(".sampleBSDF()").count(), 3);
    // No part has holes.
    assert!(!class.contains("presence"), "{class}");
}

#[test]
fn mixtures_ask_parts_with_holes_for_their_presence() {
    let holes = "<input name=\"opacity\" type=\"color3\" value=\"0.5, 0.5, 0.5\"/>";
    let elements = [
        gold("gold"),
        paint("paint"),
        node("standard_surface", "net", "surfaceshader", holes),
        mix("inner", "gold", "paint", &quarter()),
        mix("surface", "inner", "net", &quarter()),
    ];
    let text = text_of(&with_material(&elements.concat()));
    assert!(text.contains("void presence() { rt_Presence = clamp(whole(), 0.0, 1.0); }"), "{text}");
    assert!(text.contains("part1.BSDF() * part1Share()"), "{text}");
}

#[test]
fn closures_are_mixed_with_models_and_among_themselves() {
    let surface = |name: &str, closure: &str| {
        let closures = node(closure, &format!("{name}_closure"), "BSDF", "");
        let input = link("bsdf", "BSDF", &format!("{name}_closure"));
        closures + &node("surface", name, "surfaceshader", &input)
    };
    let both = [
        surface("a", "oren_nayar_diffuse_bsdf"),
        surface("b", "conductor_bsdf"),
        mix("surface", "a", "b", &quarter()),
    ];
    let text = text_of(&with_material(&both.concat()));
    assert!(text.contains("class M : rt_Material") && text.contains("struct Lobes"), "{text}");
    assert_eq!(text.matches("class ").count(), 1, "{text}");
    let with_model = [surface("a", "sheen_bsdf"), gold("b"), mix("surface", "a", "b", &quarter())];
    let text = text_of(&with_material(&with_model.concat()));
    for class in ["class A : rt_Material", "class B : StandardSurface", "class M : Mix"] {
        assert!(text.contains(class), "{text}");
    }
}

#[test]
fn parts_that_are_not_connected_are_black() {
    let half = node("mix", "surface", "surfaceshader", &link("fg", "surfaceshader", "gold"));
    let text = text_of(&with_material(&(gold("gold") + &half)));
    assert!(text.contains("the input `bg` of a mixture is not connected"), "{text}");
    assert!(text.contains("In it, `second` is a `Gold`."), "{text}");
}

#[test]
fn parts_have_names_of_their_own() {
    let elements = [gold("m"), paint("Mix"), mix("surface", "m", "Mix", &quarter())];
    let text = text_of(&with_material(&elements.concat()));
    for class in ["class M2 : StandardSurface", "class MixMaterial : OpenPbr", "class M : Mix"] {
        assert!(text.contains(class), "{text}");
    }
}

/// Each mixture has the next one twice.
#[test]
fn mixtures_that_double_are_refused() {
    let next = |index: usize| format!("m{}", index + 1);
    let chain = |last: &str| {
        let all = (0..40).map(|it| mix(&format!("m{it}"), &next(it), &next(it), "")).collect();
        let chain: String = all;
        with_material(&(chain + last + &mix("surface", "m0", "m0", "")))
    };
    let models = text_of(&chain(&gold("m40")));
    assert!(models.contains("E0632") && models.contains("may mix 32 surfaces"), "{models}");
    assert!(text_of(&chain(&node("surface", "m40", "surfaceshader", ""))).contains("E0632"));
}

/// The standard library has sums and products of surfaces besides mixtures.
#[test]
fn surfaces_of_closures_are_added_and_scaled() {
    let surface = |name: &str, closure: &str| {
        let glow = node("uniform_edf", &format!("{name}_glow"), "EDF", "");
        let closures = node(closure, &format!("{name}_closure"), "BSDF", "");
        let inputs = link("bsdf", "BSDF", &format!("{name}_closure"))
            + &link("edf", "EDF", &format!("{name}_glow"));
        glow + &closures + &node("surface", name, "surfaceshader", &inputs)
    };
    let half = link("in1", "surfaceshader", "a") + &input("in2", "float", "0.5");
    let sum = link("in1", "surfaceshader", "half") + &link("in2", "surfaceshader", "b");
    let elements = [
        surface("a", "oren_nayar_diffuse_bsdf"),
        surface("b", "conductor_bsdf"),
        node("multiply", "half", "surfaceshader", &half),
        node("add", "surface", "surfaceshader", &sum),
    ];
    let text = text_of(&with_material(&elements.concat()));
    let lines = |part: &str| -> String {
        text.lines().filter(|line| line.contains(part)).map(|line| format!("{line}\n")).collect()
    };
    expect![[r#"
                vec3(0.5), rt_Regularization);
            rt_EmissionColor = color(((vec3(1.0) * vec3(0.5)) + vec3(1.0)));
        class M : rt_Material;
            rt_EmissionColor = color(((vec3(1.0) * vec3(0.5)) + vec3(1.0)));
    "#]]
    .assert_eq(&(lines("vec3(0.5)") + &lines("class ") + &lines("rt_EmissionColor")));
}

#[test]
fn sums_of_models_and_of_surfaces_with_holes_are_refused() {
    let sum = |first: &str, second: &str| {
        let inputs = link("in1", "surfaceshader", first) + &link("in2", "surfaceshader", second);
        node("add", "surface", "surfaceshader", &inputs)
    };
    let holes = node("surface", "holes", "surfaceshader", &input("opacity", "float", "0.5"));
    let errors = text_of(&with_material(&(gold("gold") + &holes + &sum("gold", "holes"))))
        + &text_of(&with_material(&(holes.clone() + &sum("holes", "holes"))));
    expect![[r#"
        error[E0632]: `add` is not supported for surfaces other than `surface`
          ┌─ test.mtlx:4:1
          │
        4 │ <add name="surface" type="surfaceshader"><input name="in1" type="surfaceshader" nodename="gold"/><input name="in2" type="surfaceshader" nodename="holes"/></add>
          │ ^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^
          │
          = help: mix them, or use `add` on closures of one `surface`

        error[E0632]: `add` of surfaces with an opacity is not supported
          ┌─ test.mtlx:3:1
          │
        3 │ <add name="surface" type="surfaceshader"><input name="in1" type="surfaceshader" nodename="holes"/><input name="in2" type="surfaceshader" nodename="holes"/></add>
          │ ^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^
          │
          = help: give the opacity to the surface of their closures

    "#]]
    .assert_eq(&errors);
}
