//! Materials.

use super::context::{Context, Target};
use super::parameters::Parameters;

/// A material of earlier versions.
struct Old {
    name: &'static str,
    /// The material of pbrt-v4.
    class: &'static str,
    /// Parameters with other names in pbrt-v4.
    renamed: &'static [(&'static str, &'static str)],
    /// Parameters that pbrt-v4 does not have, with the value that changes nothing.
    dropped: &'static [(&'static str, f64)],
    then: Option<fn(&mut Parameters<'_>, &mut Context) -> Change>,
}

/// Changes that depend on the values of parameters.
#[derive(Default)]
struct Change {
    /// Another class than that of the table.
    class: Option<&'static str>,
    opacity: Option<Opacity>,
    /// True if the class is a substitute that looks different.
    is_replaced: bool,
}

/// The part of a surface that is there, where it is not all of it.
#[derive(Clone, Debug, PartialEq)]
pub enum Opacity {
    Number(f64),
    /// The name of a texture for numbers.
    Texture(String),
}

const fn old(name: &'static str, class: &'static str) -> Old {
    Old { name, class, renamed: &[], dropped: &[], then: None }
}

impl Old {
    const fn renaming(self, renamed: &'static [(&'static str, &'static str)]) -> Self {
        Old { renamed, ..self }
    }

    const fn dropping(self, dropped: &'static [(&'static str, f64)]) -> Self {
        Old { dropped, ..self }
    }

    const fn then(self, then: fn(&mut Parameters<'_>, &mut Context) -> Change) -> Self {
        Old { then: Some(then), ..self }
    }
}

const DIFFUSE: &[(&str, &str)] = &[("Kd", "reflectance")];
const DIFFUSE_AND_INDEX: &[(&str, &str)] = &[("Kd", "reflectance"), ("index", "eta")];

static MATERIALS: [Old; 23] = [
    old("matte", "diffuse").renaming(DIFFUSE).dropping(&[("sigma", 0.0)]),
    old("plastic", "coateddiffuse").renaming(DIFFUSE).then(drop_highlight),
    old("substrate", "coateddiffuse").renaming(DIFFUSE).dropping(&[("Ks", 1.0)]),
    old("uber", "coateddiffuse")
        .renaming(DIFFUSE_AND_INDEX)
        .dropping(&[("Kr", 0.0), ("Kt", 0.0)])
        .then(uber),
    old("glass", "dielectric").renaming(&[("index", "eta")]).dropping(&[("Kr", 1.0), ("Kt", 1.0)]),
    old("metal", "conductor").dropping(&[("Kr", 1.0)]),
    old("shinymetal", "conductor").renaming(&[("Kr", "reflectance")]).dropping(&[("Ks", 1.0)]),
    old("mirror", "conductor").dropping(&[("Kr", 0.9)]).then(silver),
    old("translucent", "diffusetransmission").renaming(&[("Kd", "transmittance")]).dropping(&[
        ("reflect", 0.0),
        ("transmit", 1.0),
        ("Ks", 0.0),
        ("roughness", 0.0),
    ]),
    old("kdsubsurface", "subsurface")
        .renaming(DIFFUSE_AND_INDEX)
        .dropping(&[("Kr", 1.0), ("Kt", 1.0)]),
    old("subsurface", "subsurface")
        .renaming(&[("sigma_prime_s", "sigma_s"), ("index", "eta")])
        .dropping(&[("Kr", 1.0), ("Kt", 1.0)]),
    old("hair", "hair").renaming(&[("color", "reflectance")]),
    old("mix", "mix").then(mixture),
    old("disney", "diffuse").renaming(&[("color", "reflectance")]).then(disney),
    old("fourier", "diffuse").then(replaced),
    old("measured", "diffuse").then(replaced),
    old("none", "interface"),
    old("", "interface"),
    // Fits of measurements by the first version.
    old("bluepaint", "diffuse").then(|it, _| matte(it, [0.09, 0.18, 0.3])),
    old("clay", "diffuse").then(|it, _| matte(it, [0.38, 0.24, 0.16])),
    old("felt", "diffuse").then(|it, _| matte(it, [0.03, 0.11, 0.13])),
    old("primer", "diffuse").then(|it, _| matte(it, [0.12, 0.12, 0.12])),
    old("skin", "diffuse").then(|it, _| matte(it, [0.43, 0.22, 0.17])),
];

/// Names that pbrt-v4 has, too.
const SHARED: [&str; 7] = ["subsurface", "hair", "mix", "measured", "none", "", "skin"];

/// True if only earlier versions have a material of this name.
pub fn is_old_material(name: &str) -> bool {
    !SHARED.contains(&name) && MATERIALS.iter().any(|it| it.name == name)
}

/// Upgrades the parameters of a material. Returns its name in pbrt-v4, and its opacity if that is not 1.
pub fn material(
    name: &str,
    parameters: &mut Parameters<'_>,
    context: &mut Context,
) -> (String, Option<Opacity>) {
    parameters.rename("bumpmap", "displacement");
    let Some(old) = MATERIALS.iter().find(|it| it.name == name) else {
        return (name.to_owned(), None);
    };
    let change = old.then.map_or_else(Change::default, |then| then(parameters, context));
    for (before, after) in old.renamed {
        parameters.rename(before, after);
    }
    let class = change.class.unwrap_or(old.class);
    for (dropped, neutral) in old.dropped {
        let changes_nothing = parameters.grey(dropped) == Some(*neutral);
        let Some(parameter) = parameters.take(dropped) else { continue };
        if !changes_nothing {
            let message = format!("`{dropped}` of material `{name}` has no effect: it is left out");
            context.note(message, parameter.declaration);
        }
    }
    if change.is_replaced {
        context.note_substitute("material", name, class, parameters.span());
    }
    limit(parameters, context);
    (class.to_owned(), change.opacity)
}

/// Limits reflectances to 1: earlier versions let surfaces reflect more than they receive.
fn limit(parameters: &mut Parameters<'_>, context: &mut Context) {
    for name in ["reflectance", "transmittance"] {
        let Some(color) = parameters.color(name) else { continue };
        if color.iter().any(|part| *part > 1.0) {
            let span = parameters.find(name).map_or(parameters.span(), |it| it.values_span);
            context.note(format!("`{name}` is greater than 1: it is limited to that"), span);
            parameters.set_color(name, color.map(|part| part.min(1.0)));
        }
    }
}

/// Makes a surface without a highlight a diffuse one.
fn drop_highlight(parameters: &mut Parameters<'_>, context: &mut Context) -> Change {
    let highlight = parameters.grey("Ks");
    let given = parameters.take("Ks");
    if highlight == Some(0.0) {
        parameters.remove(&["roughness", "uroughness", "vroughness", "remaproughness"]);
        parameters.remove(&["index", "eta"]);
        return Change { class: Some("diffuse"), ..Change::default() };
    }
    if let Some(given) = given {
        let message = "`Ks` has no effect: the index of refraction determines the highlight";
        context.note(message, given.declaration);
    }
    Change::default()
}

fn uber(parameters: &mut Parameters<'_>, context: &mut Context) -> Change {
    let mut change = drop_highlight(parameters, context);
    let mean = parameters.color("opacity").map(|color| color.iter().sum::<f64>() / 3.0);
    let texture = parameters.texture("opacity").map(str::to_owned);
    parameters.take("opacity");
    change.opacity = match (texture, mean) {
        (Some(texture), _) => Some(Opacity::Texture(context.float_twin(&texture))),
        (None, Some(mean)) if mean < 1.0 => Some(Opacity::Number(mean.max(0.0))),
        (None, _) => None,
    };
    change
}

fn silver(parameters: &mut Parameters<'_>, _: &mut Context) -> Change {
    parameters.set_number("roughness", 0.0);
    parameters.set_spectrum("eta", "metal-Ag-eta");
    parameters.set_spectrum("k", "metal-Ag-k");
    Change::default()
}

fn replaced(_: &mut Parameters<'_>, _: &mut Context) -> Change {
    Change { is_replaced: true, ..Change::default() }
}

fn matte(parameters: &mut Parameters<'_>, color: [f64; 3]) -> Change {
    parameters.set_color("reflectance", color);
    Change { is_replaced: true, ..Change::default() }
}

/// Mixes materials by one number, and in the other order.
fn mixture(parameters: &mut Parameters<'_>, context: &mut Context) -> Change {
    if let Some(texture) = parameters.texture("amount").map(str::to_owned) {
        let twin = context.float_twin(&texture);
        parameters.set_texture("amount", &twin);
    } else if let Some(color) = parameters.color("amount") {
        parameters.set_number("amount", color.iter().sum::<f64>() / 3.0);
    } else if let Some(spectrum) = parameters.take("amount") {
        let message = "`amount` of material `mix` has no effect: it is a spectrum";
        context.note(message, spectrum.declaration);
    }
    let names = ["namedmaterial2", "namedmaterial1"].map(|name| parameters.take(name));
    if let [Some(second), Some(first)] = names
        && let (Some(second), Some(first)) = (second.first_text(), first.first_text())
    {
        let current = |name: &str| context.materials.current(name).to_owned();
        parameters.set_texts("materials", vec![current(second), current(first)]);
    }
    Change::default()
}

/// This program has a class like it; pbrt-v4 has not.
fn disney(parameters: &mut Parameters<'_>, context: &mut Context) -> Change {
    if context.target == Target::Pbrt {
        return Change { is_replaced: true, ..Change::default() };
    }
    for (before, after) in [
        ("color", "baseColor"),
        ("spectrans", "specularTransmission"),
        ("clearcoatgloss", "clearcoatRoughness"),
    ] {
        parameters.rename(before, after);
    }
    if let Some(gloss) = parameters.number("clearcoatRoughness") {
        parameters.set_number("clearcoatRoughness", (1.0 - gloss).clamp(0.0, 1.0));
    }
    if let Some(eta) = parameters.number("eta") {
        parameters.set_number("eta", eta.clamp(1.01, 4.0));
    }
    let dropped = ["speculartint", "sheentint", "scatterdistance", "flatness", "difftrans", "thin"];
    parameters.remove(&dropped);
    Change { class: Some("Principled"), is_replaced: true, ..Change::default() }
}
