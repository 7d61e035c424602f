//! Translation of pbrt parameters to those of a class, where they differ by more than their name.

use std::borrow::Cow;

use rtsl::{Class, Diagnostic, ParameterType as ClassType, Value, diagnostic_codes as codes};
use rtsl_image::{Encoding, Picture, PictureError};
use rtsl_math::sine_and_cosine_of_degrees;
use rtsl_memory::Amount;

use super::description::{Entity, EntityKind};
use super::standard_names::StandardName;
use crate::reader::{Parameter, ParameterType, ReferenceKind, SceneFiles, Values, unreadable};

/// Translates the parameters of an entity to those of its class.
pub fn translated<'e>(
    entity: &'e Entity,
    standard: &StandardName,
    class: &Class,
) -> Vec<Cow<'e, Parameter>> {
    let taken = entity.parameters.iter().filter(|it| effect(it, standard, class) == Effect::Given);
    let mut parameters: Vec<Cow<'e, Parameter>> = taken.map(Cow::Borrowed).collect();
    for parameter in &mut parameters {
        let name = standard.parameter(&parameter.name);
        if name != parameter.name {
            let name = name.to_owned();
            parameter.to_mut().name = name;
        }
    }
    split_materials(&mut parameters);
    join(&mut parameters, ["uscale", "vscale"], "repeat", 1.0);
    join(&mut parameters, ["udelta", "vdelta"], "offset", 0.0);
    apply_power(entity, &mut parameters);
    for (name, values) in standard.defaults() {
        if parameters.iter().all(|parameter| parameter.name != name) {
            parameters.push(Cow::Owned(made(entity, name, values.to_vec())));
        }
    }
    parameters
}

/// The parameters of an entity that have no effect, each with the reason.
pub fn without_effect<'e>(
    entity: &'e Entity,
    standard: &StandardName,
    class: &Class,
) -> impl Iterator<Item = (&'e Parameter, &'static str)> {
    entity.parameters.iter().filter_map(move |parameter| match effect(parameter, standard, class) {
        Effect::None(why) => Some((parameter, why)),
        Effect::Given | Effect::Image => None,
    })
}

#[derive(PartialEq)]
enum Effect {
    /// Passed on to the class.
    Given,
    /// Controls how an image is read.
    Image,
    None(&'static str),
}

fn effect(parameter: &Parameter, standard: &StandardName, class: &Class) -> Effect {
    let name = parameter.name.as_str();
    let ours = standard.parameter(name);
    let own = class.parameters.iter().find(|it| it.name == ours);
    let textured = parameter.kind == ParameterType::Reference(ReferenceKind::Texture);
    match own {
        _ if standard.reads_image() && IMAGE.contains(&name) => Effect::Image,
        Some(own) if textured && !matches!(own.ty, ClassType::Reference(_)) => {
            Effect::None("it is constant over the surface and cannot be a texture")
        }
        Some(_) => Effect::Given,
        None if standard.has_no_effect(name) => Effect::None("it is left out"),
        None => Effect::Given,
    }
}

/// The parameters by which pbrt describes images.
const IMAGE: &[&str] = &["filename", "encoding", "filter", "maxanisotropy", "wrap", "mapping"];

fn made(entity: &Entity, name: &str, values: Vec<f64>) -> Parameter {
    Parameter {
        kind: ParameterType::Given,
        name: name.to_owned(),
        declaration: entity.class_span,
        values: Values::Numbers(values),
        values_span: entity.class_span,
    }
}

/// Splits `"string materials" ["a" "b"]` of mixtures into the first and the second material.
fn split_materials(parameters: &mut Vec<Cow<'_, Parameter>>) {
    let Some(place) = parameters.iter().position(|it| it.name == "materials") else { return };
    let Values::Texts(names) = &parameters[place].values else { return };
    let [first, second] = names.as_slice() else { return };
    let pair = [("first", first.clone()), ("second", second.clone())];
    let both = parameters.remove(place).into_owned();
    for (name, material) in pair {
        let values = Values::Texts(vec![material]);
        parameters.push(Cow::Owned(Parameter { name: name.to_owned(), values, ..both.clone() }));
    }
}

/// Joins two numbers of the format into one vector.
fn join(parameters: &mut Vec<Cow<'_, Parameter>>, names: [&str; 2], joined: &str, default: f64) {
    let Some(first) = parameters.iter().find(|it| names.contains(&it.name.as_str())).cloned()
    else {
        return;
    };
    let values = Values::Numbers(names.map(|name| number(parameters, name, default)).into());
    parameters.retain(|it| !names.contains(&it.name.as_str()));
    let kind = ParameterType::Given;
    let name = joined.to_owned();
    parameters.push(Cow::Owned(Parameter { kind, name, values, ..first.into_owned() }));
}

/// Scales lights by their power or illuminance.
fn apply_power(entity: &Entity, parameters: &mut Vec<Cow<'_, Parameter>>) {
    use std::f64::consts::PI;
    let unit = match (entity.kind, entity.class.as_str()) {
        (EntityKind::Light, "point") => ("power", 4.0 * PI),
        (EntityKind::Light, "spot") => ("power", spot_power(parameters)),
        (EntityKind::Light, "infinite") => ("illuminance", PI),
        (EntityKind::Light, "distant") => ("illuminance", 1.0),
        _ => return,
    };
    let Some(place) = parameters.iter().position(|it| it.name == unit.0) else { return };
    let Values::Numbers(given) = parameters.remove(place).into_owned().values else { return };
    let factor = given.first().copied().unwrap_or(unit.1) / unit.1;
    match parameters.iter_mut().find(|it| it.name == "strength") {
        Some(strength) => {
            if let Values::Numbers(values) = &mut strength.to_mut().values {
                values.iter_mut().for_each(|value| *value *= factor);
            }
        }
        None => parameters.push(Cow::Owned(made(entity, "strength", vec![factor]))),
    }
}

/// The power of a spot light whose intensity along the axis is 1. The soft edge counts half, because its falloff is a
/// curve in the cosine that is symmetric about its middle.
fn spot_power(parameters: &[Cow<'_, Parameter>]) -> f64 {
    let edge = number(parameters, "coneAngle", 30.0);
    let full = (edge - number(parameters, "softness", 5.0)).max(0.0);
    let cosine = |degrees: f64| sine_and_cosine_of_degrees(degrees).1;
    2.0 * std::f64::consts::PI * (1.0 - 0.5 * (cosine(edge) + cosine(full)))
}

fn number(parameters: &[Cow<'_, Parameter>], name: &str, default: f64) -> f64 {
    match parameters.iter().find(|it| it.name == name).map(|it| &it.values) {
        Some(Values::Numbers(values)) => values.first().copied().unwrap_or(default),
        Some(Values::Booleans(_) | Values::Texts(_)) | None => default,
    }
}

/// The values that a class gets from the image that an entity names; none if its class takes no image.
pub fn image_values(
    entity: &Entity,
    standard: &StandardName,
    files: SceneFiles<'_>,
) -> Result<Vec<(String, Value)>, Box<Diagnostic>> {
    if !standard.reads_image() {
        return Ok(Vec::new());
    }
    let text = |name: &str| {
        let parameter = entity.parameters.iter().find(|it| it.name == name)?;
        match &parameter.values {
            Values::Texts(texts) => texts.first().map(|text| (text.as_str(), parameter)),
            Values::Numbers(_) | Values::Booleans(_) => None,
        }
    };
    let Some((name, parameter)) = text("filename") else {
        let message = format!("`{}` names no file", entity.class);
        let diagnostic = Diagnostic::new(codes::MISSING_PARAMETER, message);
        return Err(Box::new(diagnostic.at(entity.class_span, "expected `\"string filename\"`")));
    };
    let path = files.path(name);
    let named_here =
        |diagnostic: Diagnostic| Box::new(diagnostic.at(parameter.values_span, "named here"));
    let encoding = match text("encoding") {
        Some(("linear", _)) => Encoding::Linear,
        Some(_) | None => Encoding::Srgb,
    };
    let input = files.read(&path).map_err(|error| named_here(unreadable(&path, &error)))?;
    let read = Picture::read(&input.bytes, encoding, files.budget);
    let (picture, held) = read.map_err(|error| {
        named_here(match error {
            PictureError::Malformed(problem) => unreadable(&path, &std::io::Error::other(problem)),
            PictureError::OverBudget(error) => error.diagnostic(path.display()),
        })
    })?;
    drop(input);
    let size = [picture.width as i32, picture.height as i32].map(Value::Int).to_vec();
    let mut values = match entity.kind {
        EntityKind::Light => sky_values(&picture),
        _ => {
            let levels = picture.levels();
            let levels = levels
                .map_err(|error| named_here(unreadable(&path, &std::io::Error::other(error))))?;
            texture_values(levels, text("wrap").map(|(wrap, _)| wrap))
        }
    };
    held.keep(values.iter().map(|(_, value)| memory(value)).sum());
    values.push(("size".to_owned(), Value::List(size)));
    Ok(values)
}

/// The bits of `count` numbers.
fn bits<'t>(count: usize, numbers: impl IntoIterator<Item = &'t f32>) -> Value {
    let mut bits: Vec<u32> = Vec::with_capacity(count);
    bits.extend(numbers.into_iter().map(|number| number.to_bits()));
    Value::Numbers(rtsl::Numbers::from_words(rtsl::Scalar::F32, bits))
}

/// The memory of a class's argument.
fn memory(value: &Value) -> Amount {
    match value {
        Value::Numbers(numbers) => Amount::of::<u32>(numbers.words().len()),
        _ => Amount(0),
    }
}

fn texture_values(levels: Vec<[f32; 4]>, wrap: Option<&str>) -> Vec<(String, Value)> {
    // This replaces the texels: a float has the size of its bits.
    let words: Vec<u32> = levels.into_flattened().into_iter().map(f32::to_bits).collect();
    let texels = Value::Numbers(rtsl::Numbers::from_words(rtsl::Scalar::F32, words));
    let wrap = match wrap {
        Some("clamp") => 1,
        Some("black") => 2,
        Some(_) | None => 0,
    };
    vec![("texels".to_owned(), texels), ("wrap".to_owned(), Value::Int(wrap))]
}

/// Square images are octahedral maps, others latitude-longitude maps.
fn sky_values(picture: &Picture) -> Vec<(String, Value)> {
    let latitudes = picture.width != picture.height;
    let height = picture.height as f64;
    // A parabola through both poles and the equator approximates the sine; it only affects the sampling density.
    let width_of = |row: usize| {
        let down = (row as f64 + 0.5) / height;
        if latitudes { 4.0 * down * (1.0 - down) } else { 1.0 }
    };
    let (rows, columns) = picture.sums(width_of);
    let colors = picture.texels.iter().flat_map(|texel| &texel[..3]);
    let texels = bits(3 * picture.texels.len(), colors);
    vec![
        ("texels".to_owned(), texels),
        ("rows".to_owned(), bits(rows.len(), &rows)),
        ("columns".to_owned(), bits(columns.len(), &columns)),
        ("latitudes".to_owned(), Value::Bool(latitudes)),
    ]
}
