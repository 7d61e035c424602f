//! The classes of the standard library that the renderer itself needs.

use rtsl::Value;

use crate::settings::Settings;

/// The class of shapes without a material.
pub const DEFAULT_MATERIAL: &str = "Lambertian";

/// The integrator of scenes that name none, or one that paths take the place of.
pub const PATH_TRACER: &str = "Path";

/// The integrator that shows what `shade` of materials computes.
pub const WHITTED: &str = "Whitted";

/// Returns the parameters of the path tracer of a scene with these settings.
pub fn path_tracer_arguments(settings: &Settings) -> Vec<(&'static str, Value)> {
    vec![
        ("maxDepth", Value::Int(settings.max_depth as i32)),
        ("rouletteThreshold", Value::Float(settings.roulette_threshold)),
        ("regularize", Value::Bool(settings.regularize)),
    ]
}
