//! Lights and area lights.

use super::context::{Context, Target};
use super::parameters::Parameters;

/// The light that a light emits.
const LIGHT: [&str; 2] = ["I", "L"];

/// Returns the name of a light.
pub fn light(name: &str, parameters: &mut Parameters<'_>, context: &mut Context) -> String {
    parameters.remove(&["samples", "nsamples", "shadowbias"]);
    let name = match name {
        "exinfinite" | "infinitesample" => "infinite",
        "goniophotometric" => "goniometric",
        other => other,
    };
    let mut scale = take_scale(parameters) * take_blackbody_scale(parameters);
    if let Some(map) = parameters.take("mapname") {
        if name != "goniometric" {
            scale *= take_tint(parameters, context);
        }
        let is_picture = map.first_text().is_some_and(|file| !file.is_empty());
        if is_picture {
            parameters.put("filename", map);
        }
        if is_picture && name == "infinite" && context.target == Target::Pbrt {
            let message = "pbrt-v4 needs a sky of equal areas: `imgtool makeequiarea` makes one";
            context.note(message, parameters.span());
        }
    }
    set_scale(parameters, scale);
    name.to_owned()
}

/// Returns the name of an area light.
pub fn area_light(name: &str, parameters: &mut Parameters<'_>) -> String {
    parameters.remove(&["samples", "nsamples"]);
    let scale = take_scale(parameters) * take_blackbody_scale(parameters);
    set_scale(parameters, scale);
    if name == "area" { "diffuse".to_owned() } else { name.to_owned() }
}

fn set_scale(parameters: &mut Parameters<'_>, scale: f64) {
    if scale != 1.0 {
        parameters.set_number("scale", scale);
    }
}

/// Takes the scale. One that is coloured goes to the light, if that is a colour too.
fn take_scale(parameters: &mut Parameters<'_>) -> f64 {
    let grey = parameters.grey("scale");
    let color = parameters.color("scale");
    parameters.take("scale");
    if let Some(grey) = grey {
        return grey;
    }
    let Some(scale) = color else { return 1.0 };
    let has_map = parameters.has("mapname");
    let given = LIGHT.into_iter().find(|name| parameters.has(name));
    let light = given.map_or(Some([1.0; 3]), |name| parameters.color(name));
    match light {
        Some(light) if !has_map => {
            let name = given.unwrap_or("L");
            parameters.set_color(name, [0, 1, 2].map(|it| light[it] * scale[it]));
            1.0
        }
        _ => luminance(scale),
    }
}

/// Takes the second number of a black body, by which it is scaled.
fn take_blackbody_scale(parameters: &mut Parameters<'_>) -> f64 {
    let mut scale = 1.0;
    for parameter in parameters.iter_mut().filter(|it| LIGHT.contains(&it.name.as_str())) {
        scale *= parameter.take_blackbody_scale().unwrap_or(1.0);
    }
    scale
}

/// Takes the colour of a light with a map, which is one number in pbrt-v4.
fn take_tint(parameters: &mut Parameters<'_>, context: &mut Context) -> f64 {
    let mut scale = 1.0;
    for name in LIGHT {
        let (grey, color) = (parameters.grey(name), parameters.color(name));
        let Some(parameter) = parameters.take(name) else { continue };
        scale *= grey.or(color.map(luminance)).unwrap_or(1.0);
        if grey.is_none() {
            let message = format!("the colour of `{name}` has no effect on a light with a map");
            context.note(message, parameter.declaration);
        }
    }
    scale
}

fn luminance([red, green, blue]: [f64; 3]) -> f64 {
    0.2126 * red + 0.7152 * green + 0.0722 * blue
}
