//! Textures.

use rtsl::Span;

use super::context::{Context, Target};
use super::parameters::{Parameters, color_of, texture_of};
use crate::reader::parameter::Parameter;
use crate::reader::parser::Command;

/// The textures of earlier versions.
const CLASSES: [&str; 12] = [
    "constant",
    "scale",
    "mix",
    "bilerp",
    "imagemap",
    "uv",
    "checkerboard",
    "dots",
    "fbm",
    "wrinkled",
    "marble",
    "windy",
];

/// True if earlier versions have a texture of this name.
pub fn is_old_texture(class: &str) -> bool {
    CLASSES.contains(&class) || class == "ptex"
}

/// Upgrades a definition of a texture.
pub fn texture(command: &mut Command, context: &mut Context) {
    let [name, kind, class] = &mut command.texts[..] else { return };
    let is_float = kind.text == "float";
    if kind.text == "color" {
        "spectrum".clone_into(&mut kind.text);
    }
    context.use_textures(&mut command.parameters, is_float);
    name.text = context.define_texture(&name.text, is_float);
    let mut parameters = Parameters::new(&mut command.parameters, class.span);
    parameters.remove(&["aamode"]);
    match class.text.as_str() {
        "imagemap" | "ptex" => image(&mut parameters),
        "scale" if is_float => {
            parameters.rename("tex1", "tex");
            parameters.rename("tex2", "scale");
        }
        "scale" => class.text = scale(&mut parameters, context).to_owned(),
        "uv" => {
            "bilerp".clone_into(&mut class.text);
            coordinates(&mut parameters, is_float);
        }
        "fbm" | "wrinkled" | "windy" if !is_float => {
            color_noise(command, context);
            return;
        }
        _ => {}
    }
    if !is_float {
        context.record_texture(command);
    }
}

/// Makes a texture of noise, which pbrt-v4 has for numbers alone, one for colours: a mixture of black and white.
fn color_noise(command: &mut Command, context: &mut Context) {
    let mut noise = command.clone();
    "float".clone_into(&mut noise.texts[1].text);
    let span = command.texts[2].span;
    let mut parameters = Parameters::new(&mut noise.parameters, span);
    parameters.remove_unless(|it| ["octaves", "roughness"].contains(&it.name.as_str()));
    "mix".clone_into(&mut command.texts[2].text);
    command.parameters.clear();
    context.record_texture(command);
    let noise = context.define_twin(&command.texts[0].text, noise);
    let mut parameters = Parameters::new(&mut command.parameters, span);
    parameters.set_color("tex1", [0.0; 3]);
    parameters.set_color("tex2", [1.0; 3]);
    parameters.set_texture("amount", &noise);
}

/// Gives an image the filter and the encoding that older parameters mean.
fn image(parameters: &mut Parameters<'_>) {
    if let Some(trilinear) = parameters.boolean("trilinear") {
        parameters.take("trilinear");
        parameters.set_text("filter", if trilinear { "trilinear" } else { "bilinear" });
    }
    let encoding = match (parameters.number("gamma"), parameters.boolean("gamma")) {
        (Some(exponent), _) if exponent > 0.0 => Some(format!("gamma {exponent}")),
        (_, Some(true)) => Some("sRGB".to_owned()),
        (_, Some(false)) => Some("linear".to_owned()),
        _ => None,
    };
    parameters.take("gamma");
    if let Some(encoding) = encoding {
        parameters.set_text("encoding", &encoding);
    }
}

/// The texture coordinates as red and green, which the interpolation of four colours gives.
fn coordinates(parameters: &mut Parameters<'_>, is_float: bool) {
    // The fractional part of the coordinates is shown, which for mirrored ones is what they are moved to.
    for (scale, offset) in [("uscale", "udelta"), ("vscale", "vdelta")] {
        if parameters.number(scale) == Some(-1.0) && !parameters.has(offset) {
            parameters.set_number(offset, 1.0);
        }
    }
    for (name, [red, green]) in
        [("v00", [0.0, 0.0]), ("v01", [0.0, 1.0]), ("v10", [1.0, 0.0]), ("v11", [1.0, 1.0])]
    {
        match is_float {
            true => parameters.set_number(name, (red + green) / 3.0),
            false => parameters.set_color(name, [red, green, 0.0]),
        }
    }
}

/// A factor of a product of colours.
enum Factor {
    Grey(f64),
    Color([f64; 3]),
    Texture(Parameter),
}

impl Factor {
    fn of(parameter: Parameter) -> Self {
        match color_of(&parameter) {
            Some([red, green, blue]) if red == green && green == blue => Factor::Grey(red),
            Some(color) => Factor::Color(color),
            None => Factor::Texture(parameter),
        }
    }
}

/// Splits the product of two colours into a colour and a number, as pbrt-v4 has it. Returns the name of the texture.
fn scale(parameters: &mut Parameters<'_>, context: &mut Context) -> &'static str {
    let Some(span) = parameters.find("tex1").or(parameters.find("tex2")).map(|it| it.declaration)
    else {
        return "scale";
    };
    let mut factor = |name: &str| parameters.take(name).map_or(Factor::Grey(1.0), Factor::of);
    match (factor("tex1"), factor("tex2")) {
        (Factor::Grey(first), Factor::Grey(second)) => {
            parameters.set_color("value", [first * second; 3]);
            "constant"
        }
        (Factor::Color(first), Factor::Color(second)) => {
            parameters.set_color("value", [0, 1, 2].map(|it| first[it] * second[it]));
            "constant"
        }
        (Factor::Color(color), Factor::Grey(scale))
        | (Factor::Grey(scale), Factor::Color(color)) => {
            parameters.set_color("value", color.map(|it| it * scale));
            "constant"
        }
        (Factor::Texture(texture), Factor::Grey(scale))
        | (Factor::Grey(scale), Factor::Texture(texture)) => {
            parameters.put("tex", texture);
            parameters.set_number("scale", scale);
            "scale"
        }
        (Factor::Texture(texture), Factor::Color(color))
        | (Factor::Color(color), Factor::Texture(texture)) => {
            tint(parameters, texture, color, span, context)
        }
        (Factor::Texture(first), Factor::Texture(second)) => {
            multiply(parameters, first, second, span, context)
        }
    }
}

/// The product of a texture and a colour. In pbrt-v4 this is a mixture of black and the colour, for a texture that is
/// grey.
fn tint(
    parameters: &mut Parameters<'_>,
    texture: Parameter,
    color: [f64; 3],
    span: Span,
    context: &mut Context,
) -> &'static str {
    if context.target == Target::Rtsl {
        parameters.put("tex", texture);
        parameters.set_color("factor", color);
        return "scale";
    }
    context.note(
        "a colour times a texture is mixed from black and the colour by the texture's mean",
        span,
    );
    parameters.set_color("tex1", [0.0; 3]);
    parameters.set_color("tex2", color);
    if let Some(name) = texture_of(&texture) {
        let twin = context.float_twin(name);
        parameters.set_texture("amount", &twin);
    }
    "mix"
}

/// The product of two textures, of which the second gives one number in pbrt-v4.
fn multiply(
    parameters: &mut Parameters<'_>,
    first: Parameter,
    second: Parameter,
    span: Span,
    context: &mut Context,
) -> &'static str {
    parameters.put("tex", first);
    if context.target == Target::Rtsl {
        parameters.put("factor", second);
        return "scale";
    }
    context.note("a texture times a texture is scaled by the mean of the second one", span);
    if let Some(name) = texture_of(&second) {
        let twin = context.float_twin(name);
        parameters.set_texture("scale", &twin);
    }
    "scale"
}
