//! Textures.

use rtsl_math::Transform;

use super::images;
use super::name::{Names, PbrtName};
use super::translation::Translation;
use crate::description::EntityKind;
use crate::reader::Values;

/// The parameters of textures with two coordinates.
const MAPPING: &[&str] = &["mapping", "uscale", "vscale", "udelta", "vdelta", "v1", "v2"];

pub static NAMES: Names = Names {
    kind: EntityKind::Texture,
    implemented: &[
        texture("constant", "Constant").without(MAPPING),
        texture("imagemap", "Image")
            .translated_by(map_coordinates)
            .made_by(images::texture, images::PARAMETERS),
        texture("scale", "Scale").renaming(&[("tex", "texture")]).without(MAPPING),
        texture("mix", "MixTexture")
            .renaming(&[("tex1", "first"), ("tex2", "second")])
            .without(MAPPING),
        texture("directionmix", "DirectionMix")
            .renaming(&[("tex1", "first"), ("tex2", "second"), ("dir", "direction")])
            .translated_by(turn_direction)
            .without(MAPPING),
        texture("checkerboard", "Checkerboard")
            .renaming(&[("tex1", "even"), ("tex2", "odd")])
            .translated_by(map_coordinates),
        texture("bilerp", "Bilerp").translated_by(map_coordinates),
        // In pbrt-v4 `inside` is what lies between the dots.
        texture("dots", "Dots")
            .renaming(&[("inside", "outside"), ("outside", "inside")])
            .with_defaults(&[("inside", &[0.0]), ("outside", &[1.0])])
            .translated_by(map_coordinates),
        texture("fbm", "PerlinFbm").translated_by(place).without(MAPPING),
        texture("wrinkled", "Wrinkled").translated_by(place).without(MAPPING),
        texture("windy", "Windy").translated_by(place).without(MAPPING),
        texture("marble", "PerlinMarble").translated_by(place).without(MAPPING),
        PbrtName::replacing(EntityKind::Texture, "ptex", "Constant")
            .with_defaults(&[("value", &[0.5])]),
    ],
    left_out: &[],
    without_effect: &[],
    choose: |_| None,
};

const fn texture(name: &'static str, class: &'static str) -> PbrtName {
    PbrtName::new(EntityKind::Texture, name, class)
}

/// Translates the mapping of a texture with two coordinates, and joins scales and offsets into vectors.
fn map_coordinates(texture: &mut Translation<'_>) {
    texture.join(["uscale", "vscale"], "repeat", 1.0);
    texture.join(["udelta", "vdelta"], "offset", 0.0);
    let mapping = match texture.text("mapping") {
        Some("uv") => 0.0,
        Some("spherical") => 1.0,
        Some("cylindrical") => 2.0,
        Some("planar") => 3.0,
        // The class reports another value.
        Some(_) | None => return place(texture),
    };
    texture.replace("mapping", vec![mapping]);
    // Two mappings have no offset in the format.
    if mapping == 1.0 || mapping == 2.0 {
        texture.take("offset");
    }
    place(texture);
}

/// Gives the texture the transform from the world to its space, unless they are the same.
fn place(texture: &mut Translation<'_>) {
    let to_world = texture.to_world();
    if to_world != Transform::IDENTITY
        && let Some(inverse) = to_world.inverse()
    {
        texture.set("toTexture", inverse.columns().to_vec());
    }
}

/// Turns a direction from the space of the texture to the world's.
fn turn_direction(texture: &mut Translation<'_>) {
    if texture.find("direction").is_none() {
        texture.set("direction", vec![0.0, 1.0, 0.0]);
    }
    let direction = texture.find("direction").map(|parameter| &parameter.values);
    if let Some(Values::Numbers(numbers)) = direction
        && let [x, y, z] = numbers[..]
    {
        let to_world = texture.to_world();
        let (tip, origin) = (to_world.point([x, y, z]), to_world.point([0.0; 3]));
        let turned = tip.iter().zip(origin).map(|(tip, origin)| tip - origin).collect();
        texture.replace("direction", turned);
    }
}
