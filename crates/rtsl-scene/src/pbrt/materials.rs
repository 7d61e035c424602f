//! Materials.

use std::borrow::Cow;

use super::measured;
use super::name::{Names, PbrtName};
use super::subsurface;
use super::translation::Translation;
use crate::description::EntityKind;
use crate::reader::{Parameter, Values};

pub static NAMES: Names = Names {
    kind: EntityKind::Material,
    implemented: &[
        material("diffuse", "Lambertian").renaming(&[("reflectance", "kd")]),
        material("conductor", "Conductor").renaming(ROUGHNESS),
        material("dielectric", "Dielectric").renaming(ROUGHNESS),
        material("thindielectric", "ThinDielectric"),
        material("coateddiffuse", "CoatedDiffuse")
            .renaming(&[
                ("uroughness", "roughnessU"),
                ("vroughness", "roughnessV"),
                ("remaproughness", "remapRoughness"),
                ("maxdepth", "maxDepth"),
                ("nsamples", "samples"),
            ])
            .with_defaults(LAYER),
        material("coatedconductor", "CoatedConductor")
            .renaming(&[
                ("conductor.eta", "eta"),
                ("conductor.k", "k"),
                ("conductor.roughness", "roughness"),
                ("conductor.uroughness", "roughnessU"),
                ("conductor.vroughness", "roughnessV"),
                ("interface.eta", "coatEta"),
                ("interface.roughness", "coatRoughness"),
                ("interface.uroughness", "coatRoughnessU"),
                ("interface.vroughness", "coatRoughnessV"),
                ("remaproughness", "remapRoughness"),
                ("maxdepth", "maxDepth"),
                ("nsamples", "samples"),
            ])
            .with_defaults(LAYER),
        material("diffusetransmission", "DiffuseTransmission"),
        material("mix", "Mix")
            .splitting(&[("materials", "first"), ("materials", "second")])
            .translated_by(split_materials),
        material("hair", "Hair")
            .renaming(&[
                ("sigma_a", "sigmaA"),
                ("color", "reflectance"),
                ("beta_m", "betaM"),
                ("beta_n", "betaN"),
                ("alpha", "tilt"),
            ])
            .translated_by(choose_melanins),
        material("measured", "Measured").made_by(measured::values, measured::PARAMETERS),
        material("subsurface", "Subsurface")
            .renaming(&[
                ("sigma_a", "sigmaA"),
                ("sigma_s", "sigmaS"),
                ("uroughness", "roughnessU"),
                ("vroughness", "roughnessV"),
                ("remaproughness", "remapRoughness"),
            ])
            .made_by(subsurface::values, subsurface::PARAMETERS)
            .translated_by(subsurface::choose_medium)
            .simplifying("light leaves its surface where it enters it"),
    ],
    // Boundaries of media, which are invisible, by their name and by former names.
    left_out: &["interface", "none", ""],
    without_effect: &[],
    choose: |_| None,
};

const ROUGHNESS: &[(&str, &str)] = &[
    ("uroughness", "roughnessU"),
    ("vroughness", "roughnessV"),
    ("remaproughness", "remapRoughness"),
];

/// The layer between a coat and its base.
const LAYER: &[(&str, &[f64])] = &[("thickness", &[0.01]), ("maxDepth", &[10.0])];

const fn material(name: &'static str, class: &'static str) -> PbrtName {
    PbrtName::new(EntityKind::Material, name, class)
}

/// Sets the melanin of hair that is not given to 0, where the other is.
fn choose_melanins(hair: &mut Translation<'_>) {
    let given = ["eumelanin", "pheomelanin"].map(|name| hair.find(name).is_some());
    if given == [false, true] {
        hair.set("eumelanin", vec![0.0]);
    }
}

/// Splits `"string materials" ["a" "b"]` of mixtures into the first and the second material.
fn split_materials(translation: &mut Translation<'_>) {
    let Some(materials) = translation.find("materials") else { return };
    let Values::Texts(names) = &materials.values else { return };
    let [first, second] = names.as_slice() else { return };
    let pair = [("first", first.clone()), ("second", second.clone())];
    let Some(both) = translation.take("materials").map(Cow::into_owned) else { return };
    for (name, material) in pair {
        let values = Values::Texts(vec![material]);
        translation.push(Parameter { name: name.to_owned(), values, ..both.clone() });
    }
}
