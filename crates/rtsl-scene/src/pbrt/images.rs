//! Images that entities name, as values of classes.

use std::collections::btree_map::Entry;
use std::collections::{BTreeMap, BTreeSet};
use std::io;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use rayon::prelude::*;
use rtsl::{Diagnostic, Numbers, Scalar, Value, diagnostic_codes as codes};
use rtsl_image::{Depth, Encoding, Mipmap, NoLight, Picture, PictureError};
use rtsl_memory::{Amount, Held, InputBudget, OutOfMemory, on_all_processors, temporary_folder};

use super::image_lights;
use super::named_file::NamedFile;
use crate::description::{Entity, EntityKind};
use crate::reader::{Input, Parameter, SceneFiles, unreadable};

/// The parameters by which pbrt describes the images of textures.
pub const PARAMETERS: &[&str] =
    &["filename", "encoding", "filter", "maxanisotropy", "wrap", CONVENTION];

/// The parameter that has the value `gltf` if an image is read by the rules of glTF rather than those of pbrt-v4.
pub const CONVENTION: &str = "convention";

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
    converted: BTreeMap<Key, Arc<Converted>>,
    /// The texels in memory.
    in_memory: Amount,
    /// The linear values of bytes, by encoding.
    tables: BTreeMap<EncodingKey, Arc<[u32]>>,
    /// The names of textures that lights look up.
    of_lights: BTreeSet<String>,
    /// Warnings about images that are light.
    warnings: Vec<Diagnostic>,
}

/// An image, and the arguments of classes that have it.
#[derive(Debug)]
pub struct Converted {
    pub image: Mipmap,
    pub values: Vec<(String, Value)>,
    /// The numbers that are no light, if it is that of a light.
    no_light: NoLight,
}

/// An image that an entity names.
pub struct NamedImage<'e> {
    name: &'e str,
    reading: Reading,
    use_: Use,
}

/// The encoding of an image, and the rules by which its file is read.
#[derive(Clone, Copy)]
struct Reading {
    encoding: Encoding,
    /// True for the rules of glTF, false for those of pbrt-v4.
    of_gltf: bool,
}

/// The result of looking for an image.
enum Lookup {
    /// Its contents were decoded before.
    Known(Arc<Converted>),
    /// The file is to be decoded.
    New(Undecoded),
}

/// A file to be decoded.
struct Undecoded {
    key: Key,
    path: PathBuf,
    input: Input,
    reading: Reading,
}

/// A file, decoded.
struct Decoded {
    image: Mipmap,
    /// The memory of the picture.
    held: Held,
    /// The distributions of a sky.
    distributions: Vec<(String, Value)>,
    no_light: NoLight,
}

/// The place of an image's texels.
#[derive(Clone, Copy)]
enum Place {
    Memory,
    /// A temporary file.
    File,
}

/// The contents of a file, and what is made of it.
type Key = ([u8; 32], Use, EncodingKey, bool);

/// An encoding with an order.
type EncodingKey = (u8, u64);

/// The use of an image.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Use {
    Texture,
    /// A texture whose colours are light.
    Light,
    /// Light from all directions.
    Sky,
}

/// The values of a texture from the image that an entity names.
pub fn texture(
    entity: &Entity,
    files: SceneFiles<'_>,
    images: &mut Images,
) -> Result<Vec<(String, Value)>, Box<Diagnostic>> {
    let mut values = images.of(entity, files, images.use_of(entity))?.values.clone();
    let mut choose = |name: &str, ours: &str, known: &[(&str, i32)]| {
        let value = choice(entity, name, known)?;
        values.extend(value.map(|value| (ours.to_owned(), Value::Int(value))));
        Ok::<(), Box<Diagnostic>>(())
    };
    choose("wrap", "wrap", &WRAP_MODES)?;
    choose("filter", "filtering", &FILTERS)?;
    Ok(values)
}

/// The value of a parameter that takes one of several names.
fn choice(
    entity: &Entity,
    name: &str,
    known: &[(&str, i32)],
) -> Result<Option<i32>, Box<Diagnostic>> {
    let Some((given, parameter)) = entity.text(name) else { return Ok(None) };
    match known.iter().find(|(other, _)| *other == given) {
        Some((_, value)) => Ok(Some(*value)),
        None => {
            let names: Vec<&str> = known.iter().map(|(name, _)| *name).collect();
            let message = format!("`{name}` is `{given}`, expected one of {}", names.join(", "));
            Err(wrong(parameter, message))
        }
    }
}

fn reading(entity: &Entity) -> Result<Reading, Box<Diagnostic>> {
    let of_gltf = entity.text(CONVENTION).is_some_and(|(word, _)| word == "gltf");
    Ok(Reading { encoding: encoding(entity)?, of_gltf })
}

fn encoding(entity: &Entity) -> Result<Encoding, Box<Diagnostic>> {
    let Some((given, parameter)) = entity.text("encoding") else { return Ok(Encoding::Srgb) };
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
    /// The images of a scene in which lights look up textures of these names.
    pub fn new(of_lights: BTreeSet<String>) -> Images {
        Images { of_lights, ..Images::default() }
    }

    /// The use of the image of a texture.
    fn use_of(&self, texture: &Entity) -> Use {
        let is_light = texture.name.as_ref().is_some_and(|name| self.of_lights.contains(name));
        if is_light { Use::Light } else { Use::Texture }
    }

    /// Returns the warnings about images since the last call.
    pub fn take_warnings(&mut self) -> Vec<Diagnostic> {
        std::mem::take(&mut self.warnings)
    }

    /// The image that an entity names.
    pub fn of(
        &mut self,
        entity: &Entity,
        files: SceneFiles<'_>,
        use_: Use,
    ) -> Result<Arc<Converted>, Box<Diagnostic>> {
        let file = NamedFile::of(entity, files)?;
        let reading = reading(entity)?;
        let image = self.read(&file.path, reading, files, use_);
        let image = image.map_err(|diagnostic| file.at(diagnostic))?;
        if !image.no_light.is_none() {
            self.warnings.push(*file.at(no_light(&file.path, &image.no_light)));
        }
        Ok(image)
    }

    /// The texels of the image file that the scene calls `name`, without an encoding, as the class `Image` takes them.
    pub fn linear(
        &mut self,
        name: &str,
        files: SceneFiles<'_>,
    ) -> Result<Vec<(String, Value)>, Diagnostic> {
        let image = self.read(&files.path(name), Reading::LINEAR, files, Use::Texture)?;
        Ok(image.values.clone())
    }

    /// Decodes images before they are needed, on all processors. Of those that cannot be decoded, the first use reports
    /// the error.
    pub fn read_ahead(&mut self, wanted: &[NamedImage<'_>], files: SceneFiles<'_>) {
        // The files of a part are in memory together.
        let part = 2 * on_all_processors(rayon::current_num_threads);
        let mut pending: Vec<Undecoded> = Vec::new();
        let mut keys = BTreeSet::new();
        for (index, image) in wanted.iter().enumerate() {
            let file = self.find(&files.path(image.name), image.reading, files, image.use_);
            if let Ok(Lookup::New(undecoded)) = file
                && keys.insert(undecoded.key)
            {
                pending.push(undecoded);
            }
            if pending.len() < part && index + 1 < wanted.len() {
                continue;
            }
            self.decode_all(std::mem::take(&mut pending), files);
        }
    }

    /// Decodes images on all processors, and keeps those that can be decoded.
    fn decode_all(&mut self, undecoded: Vec<Undecoded>, files: SceneFiles<'_>) {
        let decode = |it: Undecoded| Some((it.key, it.decode(files.budget).ok()?));
        let decoded: Vec<(Key, Decoded)> =
            on_all_processors(|| undecoded.into_par_iter().filter_map(decode).collect());
        // The order, and not the time, decides which images are in memory.
        let place = |(_, decoded): &(Key, Decoded)| self.place(&decoded.image, files);
        let places: Vec<Place> = decoded.iter().map(place).collect();
        let moved = |((key, decoded), place): ((Key, Decoded), Place)| {
            Some((key, decoded.moved_to(place).ok()?))
        };
        let moved: Vec<(Key, Decoded)> =
            on_all_processors(|| decoded.into_par_iter().zip(places).filter_map(moved).collect());
        for (key, decoded) in moved {
            self.keep(key, decoded);
        }
    }

    /// Returns the place of an image's texels: in memory until textures take as much as they may.
    fn place(&mut self, image: &Mipmap, files: SceneFiles<'_>) -> Place {
        let Amount(budget) = files.budget.limit();
        let limit = files.texture_memory.unwrap_or(Amount(budget / 8));
        let total = self.in_memory + image.size();
        if total > limit {
            return Place::File;
        }
        self.in_memory = total;
        Place::Memory
    }

    /// An image file, which is decoded if none with the same contents was.
    fn read(
        &mut self,
        path: &Path,
        reading: Reading,
        files: SceneFiles<'_>,
        use_: Use,
    ) -> Result<Arc<Converted>, Diagnostic> {
        match self.find(path, reading, files, use_)? {
            Lookup::Known(converted) => Ok(converted),
            Lookup::New(undecoded) => {
                let key = undecoded.key;
                let decoded = undecoded.decode(files.budget)?;
                let place = self.place(&decoded.image, files);
                let moved = decoded.moved_to(place).map_err(|error| no_temporary_file(&error))?;
                Ok(self.keep(key, moved))
            }
        }
    }

    /// Returns an image whose contents were decoded before, or the file to be decoded.
    fn find(
        &mut self,
        path: &Path,
        reading: Reading,
        files: SceneFiles<'_>,
        use_: Use,
    ) -> Result<Lookup, Diagnostic> {
        let key = |digest: &blake3::Hash| {
            (*digest.as_bytes(), use_, key(reading.encoding), reading.of_gltf)
        };
        if let Some(known) = self.digests.get(path).and_then(|it| self.converted.get(&key(it))) {
            return Ok(Lookup::Known(known.clone()));
        }
        let input = files.read(path).map_err(|error| unreadable(path, &error))?;
        let digest = blake3::hash(&input.bytes);
        self.digests.insert(path.to_owned(), digest);
        if let Some(known) = self.converted.get(&key(&digest)) {
            return Ok(Lookup::Known(known.clone()));
        }
        Ok(Lookup::New(Undecoded { key: key(&digest), path: path.to_owned(), input, reading }))
    }

    /// Keeps an image for all entities that name it.
    fn keep(&mut self, key: Key, decoded: Decoded) -> Arc<Converted> {
        let Decoded { image, held, distributions, no_light } = decoded;
        let mut values = self.stored(&image);
        values.extend(distributions);
        held.keep(values.iter().map(|(_, value)| memory(value)).sum());
        let converted = Arc::new(Converted { image, values, no_light });
        match self.converted.entry(key) {
            Entry::Occupied(known) => known.get().clone(),
            Entry::Vacant(place) => place.insert(converted).clone(),
        }
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

impl Undecoded {
    fn decode(self, budget: &InputBudget) -> Result<Decoded, Diagnostic> {
        let Undecoded { key: (_, use_, ..), path, input, reading } = self;
        let Reading { encoding, of_gltf } = reading;
        let is_light = matches!(use_, Use::Light | Use::Sky);
        let read = match (of_gltf, is_light) {
            (true, _) => Picture::read_for_gltf,
            (false, true) => Picture::read_as_stored,
            (false, false) => Picture::read,
        };
        let read = read(&input.bytes, encoding, budget);
        let (mut picture, held) = read.map_err(|error| match error {
            PictureError::Malformed(problem) => unreadable(&path, &io::Error::other(problem))
                .help("convert the image to a PNG or an EXR file"),
            PictureError::OverBudget(error) => error.diagnostic(path.display()),
        })?;
        drop(input);
        let no_light = if is_light { picture.limit_to_light() } else { NoLight::default() };
        let (image, distributions) = match use_ {
            Use::Texture | Use::Light => (Mipmap::new(picture), Vec::new()),
            Use::Sky => (Mipmap::flat(&picture), image_lights::distributions(&picture).to_vec()),
        };
        let image =
            image.map_err(|error: OutOfMemory| unreadable(&path, &io::Error::other(error)))?;
        Ok(Decoded { image, held, distributions, no_light })
    }
}

impl Reading {
    const LINEAR: Reading = Reading { encoding: Encoding::Linear, of_gltf: false };
}

impl Decoded {
    /// Moves the texels.
    ///
    /// # Errors
    /// If a temporary file cannot be written.
    fn moved_to(self, place: Place) -> io::Result<Decoded> {
        match place {
            Place::Memory => Ok(self),
            Place::File => Ok(Decoded { image: self.image.into_file()?, ..self }),
        }
    }
}

impl<'e> NamedImage<'e> {
    /// Returns the images that an entity of one of pbrt's names uses. Those with a wrong encoding are left out: their
    /// use reports it.
    pub fn of(entity: &'e Entity, images: &Images) -> impl Iterator<Item = NamedImage<'e>> {
        let use_ = match entity.kind {
            EntityKind::Texture => Some(images.use_of(entity)),
            EntityKind::Light if entity.class == "infinite" => Some(Use::Sky),
            EntityKind::AreaLight | EntityKind::Light => Some(Use::Light),
            _ => None,
        };
        let file = entity.text("filename").zip(use_).zip(reading(entity).ok());
        let file = file.map(|(((name, _), use_), reading)| NamedImage { name, reading, use_ });
        let relief = entity.text("normalmap").filter(|_| entity.kind == EntityKind::Material);
        let relief = relief.map(|(name, _)| NamedImage {
            name,
            reading: Reading::LINEAR,
            use_: Use::Texture,
        });
        file.into_iter().chain(relief)
    }
}

/// The warning about an image of a light with numbers that are no light.
fn no_light(path: &Path, found: &NoLight) -> Diagnostic {
    let NoLight { negative, infinite, nan, greatest } = *found;
    let kinds = [(negative, "negative"), (infinite, "infinite"), (nan, "NaN")];
    let kinds = kinds.iter().filter(|(count, _)| *count > 0);
    let kinds: Vec<String> = kinds.map(|(count, kind)| format!("{count} {kind}")).collect();
    let message =
        format!("`{}` has numbers that are no light: {}", path.display(), kinds.join(", "));
    let diagnostic = Diagnostic::new(codes::NO_LIGHT, message);
    let diagnostic = if negative + nan > 0 {
        diagnostic.note("negative numbers and NaN count as 0")
    } else {
        diagnostic
    };
    if infinite > 0 {
        diagnostic.note(format!("infinite numbers count as {greatest}"))
    } else {
        diagnostic
    }
}

/// The error of texels that have no room in memory nor in a file.
fn no_temporary_file(error: &io::Error) -> Diagnostic {
    let folder = temporary_folder();
    let message = format!("cannot write texels to `{}`: {error}", folder.display());
    Diagnostic::new(codes::UNWRITABLE_FILE, message)
        .help("name another folder in the environment variable `TMPDIR`, or give more memory by `--texture-memory`")
}

/// Returns the memory of a class's argument.
fn memory(value: &Value) -> Amount {
    match value {
        Value::Numbers(numbers) if !numbers.words().is_in_file() => {
            Amount::of::<u32>(numbers.words().len())
        }
        _ => Amount(0),
    }
}
