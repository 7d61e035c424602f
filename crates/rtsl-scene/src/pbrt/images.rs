//! Images that entities name, as values of classes.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use rtsl::{Diagnostic, Numbers, Scalar, Value, diagnostic_codes as codes};
use rtsl_image::{Depth, Encoding, Mipmap, Picture, PictureError};
use rtsl_memory::{Amount, OutOfMemory};

use crate::description::Entity;
use crate::reader::{Input, Parameter, SceneFiles, Values, unreadable};

/// The parameters by which pbrt describes images, which [`texture`] and [`sky`] read.
pub const PARAMETERS: &[&str] = &["filename", "encoding", "filter", "maxanisotropy", "wrap"];

/// The values of wrap modes in the class.
const WRAP_MODES: [(&str, i32); 4] =
    [("repeat", 0), ("clamp", 1), ("black", 2), ("octahedralsphere", 3)];

/// The values of filters in the class, where every filter but `point` interpolates between texels and levels.
const FILTERS: [(&str, i32); 5] =
    [("point", 1), ("bilinear", 0), ("trilinear", 0), ("ewa", 0), ("EWA", 0)];

/// The images of a scene. Each is decoded once, although many entities name it, and its texels are shared.
#[derive(Debug, Default)]
pub struct Images {
    /// The digests of files that were read.
    digests: BTreeMap<PathBuf, blake3::Hash>,
    converted: BTreeMap<Key, Vec<(String, Value)>>,
    /// The linear values of bytes, by encoding.
    tables: BTreeMap<EncodingKey, Arc<[u32]>>,
}

/// The contents of a file, and what is made of it.
type Key = ([u8; 32], Use, EncodingKey);

/// An encoding with an order.
type EncodingKey = (u8, u64);

/// The use of an image.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
enum Use {
    Texture,
    Sky,
}

/// The values of a sky from the image that an entity names.
pub fn sky(
    entity: &Entity,
    files: SceneFiles<'_>,
    images: &mut Images,
) -> Result<Vec<(String, Value)>, Box<Diagnostic>> {
    images.values_of(entity, files, Use::Sky)
}

/// The values of a texture from the image that an entity names.
pub fn texture(
    entity: &Entity,
    files: SceneFiles<'_>,
    images: &mut Images,
) -> Result<Vec<(String, Value)>, Box<Diagnostic>> {
    let mut values = images.values_of(entity, files, Use::Texture)?;
    let mut choose = |name: &str, ours: &str, known: &[(&str, i32)]| {
        let value = choice(entity, name, known)?;
        values.extend(value.map(|value| (ours.to_owned(), Value::Int(value))));
        Ok::<(), Box<Diagnostic>>(())
    };
    choose("wrap", "wrap", &WRAP_MODES)?;
    choose("filter", "filtering", &FILTERS)?;
    Ok(values)
}

/// The text of a parameter.
fn text<'e>(entity: &'e Entity, name: &str) -> Option<(&'e str, &'e Parameter)> {
    let parameter = entity.parameters.iter().find(|it| it.name == name)?;
    match &parameter.values {
        Values::Texts(texts) => texts.first().map(|text| (text.as_str(), parameter)),
        Values::Numbers(_) | Values::Booleans(_) => None,
    }
}

/// The value of a parameter that takes one of several names.
fn choice(
    entity: &Entity,
    name: &str,
    known: &[(&str, i32)],
) -> Result<Option<i32>, Box<Diagnostic>> {
    let Some((given, parameter)) = text(entity, name) else { return Ok(None) };
    match known.iter().find(|(other, _)| *other == given) {
        Some((_, value)) => Ok(Some(*value)),
        None => {
            let names: Vec<&str> = known.iter().map(|(name, _)| *name).collect();
            let message = format!("`{name}` is `{given}`, expected one of {}", names.join(", "));
            Err(wrong(parameter, message))
        }
    }
}

fn encoding(entity: &Entity) -> Result<Encoding, Box<Diagnostic>> {
    let Some((given, parameter)) = text(entity, "encoding") else { return Ok(Encoding::Srgb) };
    let mut words = given.split_ascii_whitespace();
    let exponent = |text: &str| text.parse().ok().filter(|it| (0.01..=100.0).contains(it));
    match [words.next(), words.next(), words.next()] {
        [Some("sRGB"), None, None] => Ok(Encoding::Srgb),
        [Some("linear"), None, None] => Ok(Encoding::Linear),
        [Some("gamma"), Some(number), None] if exponent(number).is_some() => {
            Ok(Encoding::Gamma(exponent(number).unwrap_or(1.0)))
        }
        _ => {
            let message = format!(
                "`encoding` is `{given}`, expected `sRGB`, `linear`, or `gamma` and a number from 0.01 to 100"
            );
            Err(wrong(parameter, message))
        }
    }
}

fn wrong(parameter: &Parameter, message: String) -> Box<Diagnostic> {
    Box::new(Diagnostic::new(codes::WRONG_VALUE, message).at(parameter.values_span, ""))
}

fn key(encoding: Encoding) -> EncodingKey {
    match encoding {
        Encoding::Srgb => (0, 0),
        Encoding::Linear => (1, 0),
        Encoding::Gamma(gamma) => (2, gamma.to_bits()),
    }
}

impl Images {
    /// The values of the image that an entity names.
    fn values_of(
        &mut self,
        entity: &Entity,
        files: SceneFiles<'_>,
        use_: Use,
    ) -> Result<Vec<(String, Value)>, Box<Diagnostic>> {
        let Some((name, parameter)) = text(entity, "filename") else {
            let message = format!("`{}` names no file", entity.class);
            let diagnostic = Diagnostic::new(codes::MISSING_PARAMETER, message);
            return Err(Box::new(
                diagnostic.at(entity.class_span, "expected `\"string filename\"`"),
            ));
        };
        let encoding = encoding(entity)?;
        self.read(&files.path(name), encoding, files, use_)
            .map_err(|diagnostic| Box::new(diagnostic.at(parameter.values_span, "named here")))
    }

    /// The values of an image file, which is read if none with the same contents was.
    fn read(
        &mut self,
        path: &Path,
        encoding: Encoding,
        files: SceneFiles<'_>,
        use_: Use,
    ) -> Result<Vec<(String, Value)>, Diagnostic> {
        let known = |digest: &blake3::Hash| (*digest.as_bytes(), use_, key(encoding));
        if let Some(values) = self.digests.get(path).and_then(|it| self.converted.get(&known(it))) {
            return Ok(values.clone());
        }
        let input = files.read(path).map_err(|error| unreadable(path, &error))?;
        let digest = blake3::hash(&input.bytes);
        self.digests.insert(path.to_owned(), digest);
        if let Some(values) = self.converted.get(&known(&digest)) {
            return Ok(values.clone());
        }
        let values = self.convert(path, input, encoding, files, use_)?;
        self.converted.insert(known(&digest), values.clone());
        Ok(values)
    }

    fn convert(
        &mut self,
        path: &Path,
        input: Input,
        encoding: Encoding,
        files: SceneFiles<'_>,
        use_: Use,
    ) -> Result<Vec<(String, Value)>, Diagnostic> {
        let read = Picture::read(&input.bytes, encoding, files.budget);
        let (picture, held) = read.map_err(|error| match error {
            PictureError::Malformed(problem) => unreadable(path, &std::io::Error::other(problem))
                .help("convert the image to a PNG or an EXR file"),
            PictureError::OverBudget(error) => error.diagnostic(path.display()),
        })?;
        drop(input);
        let values = match use_ {
            Use::Texture => self.texture_values(picture),
            Use::Sky => Ok(self.sky_values(&picture)),
        };
        let values = values.map_err(|error| unreadable(path, &std::io::Error::other(error)))?;
        held.keep(values.iter().map(|(_, value)| memory(value)).sum());
        Ok(values)
    }

    fn texture_values(&mut self, picture: Picture) -> Result<Vec<(String, Value)>, OutOfMemory> {
        Ok(self.stored(&Mipmap::new(picture)?))
    }

    /// Square images are octahedral maps, others latitude-longitude maps.
    fn sky_values(&mut self, picture: &Picture) -> Vec<(String, Value)> {
        let latitudes = picture.width != picture.height;
        let height = picture.height as f64;
        // A parabola through both poles and the equator approximates the sine; it only affects the sampling density.
        let width_of = |row: usize| {
            let down = (row as f64 + 0.5) / height;
            if latitudes { 4.0 * down * (1.0 - down) } else { 1.0 }
        };
        let (rows, columns) = picture.sums(width_of);
        let mut values = self.stored(&Mipmap::flat(picture));
        values.push(("rows".to_owned(), Value::Numbers(Numbers::floats(rows))));
        values.push(("columns".to_owned(), Value::Numbers(Numbers::floats(columns))));
        values.push(("latitudes".to_owned(), Value::Bool(latitudes)));
        values
    }

    /// The texels of an image and their format, as the classes `Image` and `ImageSky` take them.
    fn stored(&mut self, image: &Mipmap) -> Vec<(String, Value)> {
        let words = Value::Numbers(Numbers::from_words(Scalar::U32, image.words.clone()));
        let size = [image.width as i32, image.height as i32].map(Value::Int).to_vec();
        let mut values = vec![
            ("words".to_owned(), words),
            ("channels".to_owned(), Value::Int(image.format.channels as i32)),
            ("bits".to_owned(), Value::Int(image.format.depth.bits() as i32)),
            ("size".to_owned(), Value::List(size)),
        ];
        if image.format.depth == Depth::Byte {
            let decoded = self
                .tables
                .entry(key(image.encoding))
                .or_insert_with(|| image.encoding.decoded_bytes().map(f32::to_bits).into());
            let decoded = Value::Numbers(Numbers::from_words(Scalar::F32, decoded.clone()));
            values.push(("decoded".to_owned(), decoded));
        }
        values
    }
}

/// The memory of a class's argument.
fn memory(value: &Value) -> Amount {
    match value {
        Value::Numbers(numbers) => Amount::of::<u32>(numbers.words().len()),
        _ => Amount(0),
    }
}
