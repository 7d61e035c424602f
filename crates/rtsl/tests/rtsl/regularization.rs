//! `rt_Regularization`, by which materials widen highlights.

use rtsl::{Method, Value};

use crate::relief::{VIEW, call, component, of_library};

/// A light beside the mirrored view, where a highlight shows its width.
const BESIDE: [f32; 3] = [0.1, -0.55, 0.829_16];

/// The highlight of a class with facets of this roughness.
fn highlight(class: &str, alpha: f32, regularization: f32) -> f32 {
    let arguments: Vec<(&str, Value)> = match class {
        // Roughness is its square root.
        "Principled" | "GltfPbr" => {
            vec![("roughness", alpha.sqrt().into()), ("metallic", 1.0.into())]
        }
        "CoatedConductor" => {
            let (roughness, coat) = (alpha.into(), 0.4.into());
            vec![
                ("roughness", roughness),
                ("coatRoughness", coat),
                ("remapRoughness", false.into()),
            ]
        }
        "Coat" => {
            let black = of_library("Lambertian", vec![("kd", 0.0.into())]);
            vec![("roughness", alpha.into()), ("base", black.into())]
        }
        _ => vec![("roughness", alpha.into()), ("remapRoughness", false.into())],
    };
    let material = of_library(class, arguments);
    let inputs: &[(&str, &[f32])] =
        &[("rt_LightDirection", &BESIDE), ("rt_Regularization", &[regularization])];
    call(&material, Method::Bsdf, VIEW, inputs).floats(component("rt_BSDFValue"))[0]
}

#[test]
fn highlights_are_widened_up_to_a_width() {
    for class in ["Conductor", "Dielectric"] {
        for (alpha, wider) in [(0.02, 0.1), (0.07, 0.14), (0.2, 0.3), (0.4, 0.4)] {
            let [regular, plain] = [highlight(class, alpha, 0.3), highlight(class, wider, 0.0)];
            assert!((regular - plain).abs() < 1e-5 * plain, "{class} {alpha}: {regular} {plain}");
        }
        assert_eq!(highlight(class, 0.0, 0.0), 0.0, "a mirror's light is a delta");
        assert!(highlight(class, 0.0, 0.3) > 0.0, "a mirror is widened, too");
    }
}

#[test]
fn every_material_with_facets_is_regularized() {
    for class in [
        "Conductor",
        "Dielectric",
        "CoatedDiffuse",
        "CoatedConductor",
        "Principled",
        "GltfPbr",
        "Coat",
    ] {
        let [regular, plain] = [0.3, 0.0].map(|widest| highlight(class, 0.05, widest));
        assert!((regular - plain).abs() > 0.01 * plain, "{class}: {regular} {plain}");
        assert_eq!(highlight(class, 0.5, 0.3), highlight(class, 0.5, 0.0), "{class}");
    }
}
