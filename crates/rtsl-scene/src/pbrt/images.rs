//! Images that entities name, as values of classes.

use rtsl::{Diagnostic, Value, diagnostic_codes as codes};
use rtsl_image::{Encoding, Picture, PictureError};
use rtsl_memory::{Amount, OutOfMemory};

use crate::description::Entity;
use crate::reader::{SceneFiles, Values, unreadable};

/// The parameters by which pbrt describes images.
pub const PARAMETERS: &[&str] =
    &["filename", "encoding", "filter", "maxanisotropy", "wrap", "mapping"];

/// The values of a sky from the image that an entity names.
pub fn sky(
    entity: &Entity,
    files: SceneFiles<'_>,
) -> Result<Vec<(String, Value)>, Box<Diagnostic>> {
    values_of(entity, files, |picture, _| Ok(sky_values(&picture)))
}

/// The values of a texture from the image that an entity names.
pub fn texture(
    entity: &Entity,
    files: SceneFiles<'_>,
) -> Result<Vec<(String, Value)>, Box<Diagnostic>> {
    values_of(entity, files, |picture, wrap| Ok(texture_values(picture.levels()?, wrap)))
}

/// Reads the image that an entity names, and makes values of it and of the parameter `wrap`.
fn values_of(
    entity: &Entity,
    files: SceneFiles<'_>,
    make: impl FnOnce(Picture, Option<&str>) -> Result<Vec<(String, Value)>, OutOfMemory>,
) -> Result<Vec<(String, Value)>, Box<Diagnostic>> {
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
    let mut values = make(picture, text("wrap").map(|(wrap, _)| wrap))
        .map_err(|error| named_here(unreadable(&path, &std::io::Error::other(error))))?;
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
