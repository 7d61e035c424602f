//! The camera, the film, the pixel filter, the sampler and the integrator.

use super::context::{Context, Target};
use super::parameters::Parameters;

/// Integrators of earlier versions that find their light by methods that pbrt-v4 does not have.
const PATHS: [&str; 13] = [
    "whitted",
    "photonmap",
    "exphotonmap",
    "irradiancecache",
    "igi",
    "dipolesubsurface",
    "glossyprt",
    "diffuseprt",
    "useprobes",
    "bidirectional",
    "surfacepoints",
    "createprobes",
    "debug",
];

/// The formats of pictures that pbrt-v4 writes.
const PICTURES: [&str; 4] = [".exr", ".png", ".pfm", ".qoi"];

/// Returns the name of a camera.
pub fn camera(name: &str, parameters: &mut Parameters<'_>) -> String {
    parameters.remove(&["simpleweighting", "hither", "yon"]);
    if let Some(half) = parameters.take("halffov").and_then(|it| it.first_number())
        && half > 0.0
    {
        parameters.set_number("fov", 2.0 * half);
    }
    // A shutter that did not open made no difference to anything that does not move.
    let opens = parameters.number("shutteropen").unwrap_or(0.0);
    if parameters.number("shutterclose").is_some_and(|closes| closes <= opens) {
        parameters.remove(&["shutteropen", "shutterclose"]);
    }
    match name {
        "environment" => {
            parameters.set_text("mapping", "equirectangular");
            "spherical".to_owned()
        }
        other => other.to_owned(),
    }
}

/// Returns the name of a film.
pub fn film(name: &str, parameters: &mut Parameters<'_>) -> String {
    parameters.remove(&["display", "writefrequency", "premultiplyalpha", "reverse_gamma"]);
    parameters.rename("maxsampleluminance", "maxcomponentvalue");
    if let Some(scale) = parameters.take("scale").and_then(|it| it.first_number()) {
        parameters.set_number("iso", 100.0 * scale);
    }
    if let Some(picture) = parameters.text("filename").map(str::to_owned)
        && !PICTURES.iter().any(|ending| picture.ends_with(ending))
    {
        let stem = picture.rsplit_once('.').map_or(picture.as_str(), |(stem, _)| stem);
        parameters.set_text("filename", &format!("{stem}.exr"));
    }
    match name {
        "image" | "multifilm" => "rgb".to_owned(),
        other => other.to_owned(),
    }
}

/// Upgrades a pixel filter.
pub fn filter(name: &str, parameters: &mut Parameters<'_>) -> String {
    parameters.rename("xwidth", "xradius");
    parameters.rename("ywidth", "yradius");
    if let Some(alpha) = parameters.take("alpha").and_then(|it| it.first_number())
        && name == "gaussian"
        && alpha > 0.0
    {
        parameters.set_number("sigma", 1.0 / (2.0 * alpha).sqrt());
    }
    name.to_owned()
}

/// Returns the name of a sampler.
pub fn sampler(name: &str, parameters: &mut Parameters<'_>) -> String {
    parameters.remove(&["dimensions", "samplepixelcenter", "minsamples", "method"]);
    parameters.rename("maxsamples", "pixelsamples");
    match name {
        "lowdiscrepancy" | "02sequence" | "bestcandidate" | "adaptive" => "paddedsobol",
        "maxmindist" => "pmj02bn",
        "random" => "independent",
        other => other,
    }
    .to_owned()
}

/// Returns the name of an integrator.
pub fn integrator(name: &str, parameters: &mut Parameters<'_>, context: &mut Context) -> String {
    parameters.remove(&["rrthreshold", "imagewritefrequency", "strategy", "nsamples"]);
    if let Some(iterations) = parameters.take("numiterations") {
        let message = "`numiterations` has no effect: the sampler gives the number of samples";
        context.note(message, iterations.declaration);
    }
    if let Some(strategy) = parameters.take("lightsamplestrategy")
        && let Some(strategy) = strategy.first_text()
        && matches!(name, "path" | "volpath")
    {
        parameters.set_text("lightsampler", if strategy == "spatial" { "bvh" } else { strategy });
    }
    let new = match name {
        "directlighting" => {
            if !parameters.has("maxdepth") {
                parameters.set_integers("maxdepth", vec![1.0]);
            }
            "path"
        }
        "metropolis" => "mlt",
        other if PATHS.contains(&other) => "path",
        other => other,
    };
    if new != name {
        context.note_substitute("integrator", name, new, parameters.span());
    }
    new.to_owned()
}

/// Returns the name of an accelerator; `None` if pbrt-v4 has none like it.
pub fn accelerator(name: &str, parameters: &mut Parameters<'_>, target: Target) -> Option<String> {
    match name {
        "grid" | "none" => None,
        _ => {
            // `cornell` and others of courses have parameters that nothing knows.
            let known = ["splitmethod", "maxnodeprims", "intersectcost", "traversalcost"];
            let more = ["emptybonus", "maxprims", "maxdepth"];
            if target == Target::Pbrt {
                parameters.remove_unless(|it| {
                    known.contains(&it.name.as_str()) || more.contains(&it.name.as_str())
                });
            }
            matches!(name, "bvh" | "kdtree").then(|| name.to_owned())
        }
    }
}
