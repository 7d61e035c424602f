//! Lights and area lights.

use std::f64::consts::PI;

use rtsl_math::sine_and_cosine_of_degrees;

use super::ies;
use super::image_lights;
use super::name::{Names, PbrtName};
use super::portal;
use super::translation::Translation;
use crate::description::EntityKind;

pub static NAMES: Names = Names {
    kind: EntityKind::Light,
    implemented: &[
        light("infinite", "ConstantSky")
            .renaming(&[("L", "radiance"), ("scale", "strength")])
            .translated_by(|light| scale_to(light, "illuminance", PI)),
        light("distant", "DirectionalLight")
            .renaming(&[
                ("from", "origin"),
                ("to", "direction"),
                ("L", "irradiance"),
                ("scale", "strength"),
            ])
            .with_defaults(&[("direction", &[0.0, 0.0, 1.0])])
            .translated_by(|light| scale_to(light, "illuminance", 1.0)),
        light("point", "PointLight")
            .renaming(&[("from", "position"), ("I", "intensity"), ("scale", "strength")])
            .translated_by(|light| scale_to(light, "power", 4.0 * PI)),
        light("spot", "SpotLight")
            .renaming(&[
                ("from", "position"),
                ("to", "target"),
                ("I", "intensity"),
                ("scale", "strength"),
                ("coneangle", "coneAngle"),
                ("conedeltaangle", "softness"),
            ])
            .with_defaults(&[("target", &[0.0, 0.0, 1.0])])
            .translated_by(|light| scale_to(light, "power", spot_power(light))),
        light("goniometric", "GoniometricLight")
            .renaming(&[("I", "intensity"), ("scale", "strength")])
            .made_by(image_lights::goniometric, image_lights::LIGHT)
            .with_image("image"),
        light("projection", "ProjectionLight")
            .renaming(&[("scale", "strength")])
            .made_by(image_lights::projection, image_lights::LIGHT)
            .with_image("image"),
    ],
    left_out: &[],
    without_effect: &[],
    choose: |entity| match entity.class.as_str() {
        "infinite" if entity.parameter("portal").is_some() => Some(&PORTAL_SKY),
        "infinite" if entity.parameter("filename").is_some() => Some(&IMAGE_SKY),
        "IesLight" if entity.parameter("filename").is_some() => Some(&IES),
        _ => None,
    },
};

pub static AREA_LIGHTS: Names = Names {
    kind: EntityKind::AreaLight,
    implemented: &[PbrtName::new(EntityKind::AreaLight, "diffuse", "Emissive")
        .renaming(&[("L", "radiance"), ("scale", "strength"), ("twosided", "twoSided")])
        .made_by(image_lights::glow, image_lights::GLOW)
        .with_image("image")],
    left_out: &[],
    without_effect: &[],
    choose: |_| None,
};

/// `infinite` with the file of an image.
static IMAGE_SKY: PbrtName = light("infinite", "ImageSky")
    .renaming(&[("scale", "strength")])
    .made_by(image_lights::sky, image_lights::SKY);

/// `IesLight`, a class of the library, with a photometric file.
static IES: PbrtName = light("IesLight", "IesLight").made_by(ies::values, ies::PARAMETERS);

/// `infinite` with a portal.
static PORTAL_SKY: PbrtName = light("infinite", "PortalSky")
    .renaming(&[("L", "radiance"), ("scale", "strength")])
    .made_by(portal::sky, portal::PARAMETERS);

const fn light(name: &'static str, class: &'static str) -> PbrtName {
    PbrtName::new(EntityKind::Light, name, class)
}

/// Scales a light to the value of its parameter `name`, a power or an illuminance, which is `unscaled` without it.
fn scale_to(light: &mut Translation<'_>, name: &str, unscaled: f64) {
    if let Some(given) = light.take_number(name) {
        light.multiply("strength", given.unwrap_or(unscaled) / unscaled);
    }
}

/// The power of a spot light whose intensity along the axis is 1. The soft edge counts half, because its falloff is a
/// curve in the cosine that is symmetric about its middle.
fn spot_power(light: &Translation<'_>) -> f64 {
    let edge = light.number("coneAngle", 30.0);
    let full = edge - light.number("softness", 5.0);
    let cosine = |degrees: f64| sine_and_cosine_of_degrees(degrees).1;
    2.0 * PI * (1.0 - 0.5 * (cosine(edge) + cosine(full)))
}
