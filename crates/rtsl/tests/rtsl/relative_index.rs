//! `rt_RelativeIndex` of the library's materials: the index of refraction beyond the surface, over that before it.

use rtsl::{Method, Value};

use crate::relief::{VIEW, call, component, of_library};

/// The relative index of a sample, of which the third number of the seed chooses between the lobes.
fn relative_index(material: &str, arguments: Vec<(&str, Value)>, view: [f32; 3], seed: f32) -> f32 {
    let material = of_library(material, arguments);
    let seed: &[(&str, &[f32])] = &[("rt_BSDFSeed", &[0.3, 0.6, seed])];
    call(&material, Method::SampleBsdf, view, seed).floats(component("rt_RelativeIndex"))[0]
}

/// Seeds of what is reflected, and of what is refracted.
const REFLECTED: f32 = 0.0;
const REFRACTED: f32 = 0.99;

fn glass() -> Value {
    of_library("Dielectric", vec![("eta", 1.25.into())]).into()
}

#[test]
fn refraction_has_the_index_beyond_the_surface() {
    let inside = VIEW.map(|it| -it);
    for rough in [0.0, 0.3] {
        let of = |view, seed| {
            let arguments = vec![("eta", 1.25.into()), ("roughness", rough.into())];
            relative_index("Dielectric", arguments, view, seed)
        };
        let all = [of(VIEW, REFLECTED), of(VIEW, REFRACTED), of(inside, REFRACTED)];
        assert_eq!(all, [1.0, 1.25, 0.8], "{rough}");
    }
    let clear = |seed| {
        let arguments = vec![("eta", 1.25.into()), ("specularTransmission", 1.0.into())];
        relative_index("Principled", arguments, VIEW, seed)
    };
    assert_eq!([clear(REFLECTED), clear(0.9)], [1.0, 1.25]);
}

#[test]
fn what_is_not_refracted_has_one_index() {
    for material in ["Lambertian", "Mirror", "ThinDielectric", "SchlickDielectric"] {
        assert_eq!(relative_index(material, vec![], VIEW, REFRACTED), 1.0, "{material}");
    }
}

#[test]
fn materials_on_top_of_others_keep_their_index() {
    let of =
        |material, argument| relative_index(material, vec![(argument, glass())], VIEW, REFRACTED);
    assert_eq!([of("TwoSided", "front"), of("Bump", "base"), of("NormalMap", "base")], [1.25; 3]);
    let mixed = |amount: f32| {
        let arguments = vec![("first", glass()), ("second", glass()), ("amount", amount.into())];
        relative_index("Mix", arguments, VIEW, REFRACTED)
    };
    assert_eq!([mixed(0.0), mixed(1.0)], [1.25; 2]);
}
