//! Textures.

use super::images;
use super::name::{Names, PbrtName};
use super::translation::Translation;
use crate::description::EntityKind;

pub static NAMES: Names = Names {
    kind: EntityKind::Texture,
    implemented: &[
        texture("constant", "Constant"),
        texture("imagemap", "Image").made_by(images::texture, images::PARAMETERS),
        texture("scale", "Scale").renaming(&[("tex", "texture"), ("scale", "factor")]),
        texture("mix", "MixTexture").renaming(&[("tex1", "first"), ("tex2", "second")]),
        texture("checkerboard", "Checkerboard")
            .renaming(&[("tex1", "even"), ("tex2", "odd")])
            .without(&["dimension", "udelta", "vdelta"]),
        texture("fbm", "Fbm").renaming(&[("roughness", "gain")]),
        texture("marble", "Marble").without(&["roughness", "variation"]),
        replaced("bilerp"),
        replaced("directionmix"),
        replaced("dots"),
        replaced("ptex"),
        replaced("windy"),
        replaced("wrinkled"),
    ],
    left_out: &[],
    without_effect: &["mapping", "v1", "v2"],
    choose: |_| None,
};

const fn texture(name: &'static str, class: &'static str) -> PbrtName {
    PbrtName::new(EntityKind::Texture, name, class).translated_by(join_coordinates)
}

/// A texture that is not supported: a constant grey takes its place.
const fn replaced(name: &'static str) -> PbrtName {
    PbrtName::replacing(EntityKind::Texture, name, "Constant").with_defaults(&[("value", &[0.5])])
}

/// Joins the scale and the offset of texture coordinates into vectors.
fn join_coordinates(texture: &mut Translation<'_>) {
    texture.join(["uscale", "vscale"], "repeat", 1.0);
    texture.join(["udelta", "vdelta"], "offset", 0.0);
}
