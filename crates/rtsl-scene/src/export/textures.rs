//! Textures: images with what glTF applies to them, as files of their own where pbrt-v4 has nothing like it.

use std::collections::BTreeMap;
use std::path::Path;

use rtsl_image::{ByteCode, Encoding, Picture, PictureError, encode_png};
use rtsl_memory::InputBudget;

use super::Exporter;
use super::text::Parameters;
use super::values::{boolean, numbers};
use crate::description::{Entity, EntityId};
use crate::reader::{FileSource, SceneFiles};

/// The value that an exported texture has, by the colour of the image.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Taken {
    /// Its colour, scaled.
    Color(f64),
    /// Its number, scaled.
    Number(f64),
    /// The square of a channel of its colour, scaled before: widths of highlights.
    SquareOf(usize, f64),
    /// The square of its number.
    Square,
    /// A channel of its colour, scaled.
    Channel(usize, f64),
}

/// The images that were written.
#[derive(Default)]
pub struct Images {
    decoded: BTreeMap<String, Option<(Picture, Vec<u8>)>>,
    /// The names of files, by the image and what is taken of it.
    files: BTreeMap<String, String>,
    /// The names of textures, by the entity and what is taken of it.
    textures: BTreeMap<String, String>,
}

/// A texture of a glTF file: the image, and what is made of it.
struct Lookup {
    /// The entity of the image; `None` if only the colours of vertices count.
    image: Option<EntityId>,
    factor: [f64; 4],
    channel: usize,
    base: f64,
    cutoff: Option<f64>,
    to_s: [f64; 3],
    to_t: [f64; 3],
    wrap: [f64; 2],
}

impl Lookup {
    fn of(exporter: &Exporter<'_, '_>, entity: &Entity) -> Self {
        let is_opacity = entity.class == "GltfOpacity";
        let image = exporter.names.referred(entity, "image");
        let has_opacity = boolean(entity, "hasOpacity") == Some(true);
        Lookup {
            image: image.filter(|_| !is_opacity || has_opacity),
            factor: numbers(entity, "factor").unwrap_or([1.0; 4]),
            channel: match entity.number("channel") {
                _ if is_opacity => 3,
                Some(channel) => (channel as usize).min(2),
                None => 0,
            },
            base: entity.number("base").unwrap_or(0.0),
            cutoff: entity.number("cutoff"),
            to_s: numbers(entity, "toS").unwrap_or([1.0, 0.0, 0.0]),
            to_t: numbers(entity, "toT").unwrap_or([0.0, 1.0, 0.0]),
            wrap: numbers(entity, "wrap").unwrap_or_default(),
        }
    }

    /// The linear colour for a texel of the image.
    fn color(&self, texel: [f32; 4]) -> [f64; 3] {
        std::array::from_fn(|part| f64::from(texel[part]) * self.factor[part])
    }

    fn number(&self, texel: [f32; 4]) -> f64 {
        let value = f64::from(texel[self.channel]) * self.factor[self.channel] + self.base;
        match self.cutoff {
            Some(cutoff) if value < cutoff => 0.0,
            Some(_) => 1.0,
            None => value,
        }
    }

    fn taken(&self, taken: Taken, texel: [f32; 4]) -> [f64; 3] {
        match taken {
            Taken::Color(scale) => self.color(texel).map(|part| scale * part),
            Taken::Number(scale) => [scale * self.number(texel); 3],
            Taken::Square => [square(self.number(texel)); 3],
            Taken::Channel(channel, scale) => [scale * self.color(texel)[channel]; 3],
            Taken::SquareOf(channel, scale) => [square(scale * self.color(texel)[channel]); 3],
        }
    }
}

/// A value that is one number everywhere, or the name of a texture.
pub enum Exported {
    Constant([f64; 3]),
    Texture(String),
}

impl Exporter<'_, '_> {
    /// Writes what is taken of a texture. Images that cannot be read count as white.
    pub fn texture(&mut self, texture: EntityId, taken: Taken) -> Exported {
        let key = format!("{} {taken:?}", texture.0);
        if let Some(name) = self.images.textures.get(&key) {
            return Exported::Texture(name.clone());
        }
        let entity = &self.description.entities[texture.0];
        let lookup = Lookup::of(self, entity);
        let title = entity.name.clone().unwrap_or_default();
        if entity.number("colors").is_some() {
            self.lose("colours of vertices", &title);
        }
        if entity.number("set").is_some() {
            self.lose("second texture coordinates", &title);
        }
        let white = |lookup: &Lookup| lookup.taken(taken, [1.0; 4]);
        let Some(image) = lookup.image else { return Exported::Constant(white(&lookup)) };
        let Some(file) = self.image_file(image, &lookup, taken) else {
            return Exported::Constant(white(&lookup));
        };
        let is_color = matches!(taken, Taken::Color(_));
        let mut parameters = Parameters::default().text("filename", &file);
        if !is_color {
            parameters = parameters.text("encoding", "linear");
        }
        parameters = self.placed(parameters, &lookup, image, &title);
        let name = match taken {
            Taken::Color(_) | Taken::Number(_) => title,
            Taken::Square | Taken::SquareOf(..) => format!("{title} width"),
            Taken::Channel(..) => format!("{title} part"),
        };
        let name = self.unique(&name);
        let kind = if is_color { "spectrum" } else { "float" };
        self.text.directive("Texture", &[&name, kind, "imagemap"], parameters);
        self.images.textures.insert(key, name.clone());
        Exported::Texture(name)
    }

    /// The parameters that place an image on a surface.
    fn placed(
        &mut self,
        mut parameters: Parameters,
        lookup: &Lookup,
        image: EntityId,
        title: &str,
    ) -> Parameters {
        let entity = &self.description.entities[image.0];
        let text = |name: &str| entity.text(name).map(|(text, _)| text);
        let wrap = match lookup.wrap {
            [0.0, 0.0] => text("wrap").unwrap_or("repeat"),
            [1.0, 1.0] => "clamp",
            _ => "repeat",
        };
        if wrap != "repeat" {
            parameters = parameters.text("wrap", wrap);
        }
        if text("filter") == Some("point") {
            parameters = parameters.text("filter", "point");
        }
        let ([u, over_s, s], [over_t, v, t]) = (lookup.to_s, lookup.to_t);
        let names = ["uscale", "udelta", "vscale", "vdelta"];
        for (name, (value, default)) in
            names.into_iter().zip([(u, 1.0), (s, 0.0), (v, 1.0), (t, 0.0)])
        {
            if value != default {
                parameters = parameters.float(name, value);
            }
        }
        if over_s.abs() > 1e-6 || over_t.abs() > 1e-6 {
            self.lose("the rotation of textures", title);
        }
        if is_mixed(lookup.wrap) {
            self.lose("mirrored images, and those that are repeated along one side", title);
        }
        parameters
    }

    /// The name of the file of an image; `None` if it cannot be read.
    fn image_file(&mut self, image: EntityId, lookup: &Lookup, taken: Taken) -> Option<String> {
        let entity = &self.description.entities[image.0];
        let (source, _) = entity.text("filename")?;
        let encoding = match entity.text("encoding") {
            Some(("linear", _)) => Encoding::Linear,
            Some(_) | None => Encoding::Srgb,
        };
        let Lookup { factor, channel, base, cutoff, .. } = lookup;
        let of_number = (*channel, base.to_bits(), cutoff.map(f64::to_bits));
        let key = format!("{source} {encoding:?} {taken:?} {factor:?} {of_number:?}");
        if let Some(file) = self.images.files.get(&key) {
            return Some(file.clone());
        }
        let source = source.to_owned();
        self.decode(&source, encoding);
        let (picture, bytes) =
            self.images.decoded.get(&decoded_key(&source, encoding))?.as_ref()?;
        let is_plain = taken == Taken::Color(1.0) && factor[..3] == [1.0; 3];
        let extension = extension_of(bytes).filter(|_| is_plain && encoding == Encoding::Srgb);
        let contents = match extension {
            Some(_) => bytes.clone(),
            None => baked(picture, |texel| lookup.taken(taken, texel), taken)?,
        };
        let name = self.file_name(&source, extension.unwrap_or("png"));
        let file = self.write(&name, &contents);
        self.images.files.insert(key, file.clone());
        Some(file)
    }

    /// The file of a normal map, whose parts along the surface are scaled; `None` if the image cannot be read.
    pub fn normal_map(&mut self, texture: EntityId, scale: f64) -> Option<String> {
        let entity = &self.description.entities[texture.0];
        let lookup = Lookup::of(self, entity);
        let title = entity.name.clone().unwrap_or_default();
        let identity = ([1.0, 0.0, 0.0], [0.0, 1.0, 0.0]);
        if (lookup.to_s, lookup.to_t) != identity || lookup.wrap != [0.0; 2] {
            self.lose("the placement of normal maps", &title);
        }
        let (source, _) = self.description.entities[lookup.image?.0].text("filename")?;
        let source = source.to_owned();
        let key = format!("{source} normals {scale}");
        if let Some(file) = self.images.files.get(&key) {
            return Some(file.clone());
        }
        self.decode(&source, Encoding::Linear);
        let decoded = self.images.decoded.get(&decoded_key(&source, Encoding::Linear));
        let (picture, bytes) = decoded?.as_ref()?;
        let contents = match extension_of(bytes) {
            Some("png") if scale == 1.0 => bytes.clone(),
            _ => {
                let scaled = |texel: [f32; 4]| {
                    let [x, y, z] = [0, 1, 2].map(|part| 2.0 * f64::from(texel[part]) - 1.0);
                    let (x, y) = (scale * x, scale * y);
                    let length = (x * x + y * y + z * z).sqrt().max(1e-9);
                    [x, y, z].map(|part| 0.5 + 0.5 * part / length)
                };
                coded(picture, scaled, 3, Encoding::Linear)?
            }
        };
        let name = self.file_name(&source, "png");
        let file = self.write(&name, &contents);
        self.images.files.insert(key, file.clone());
        Some(file)
    }

    /// The file of an image that a shape gives off, and what scales it.
    pub fn glow(&mut self, texture: EntityId) -> Option<(String, f64)> {
        let entity = &self.description.entities[texture.0];
        let lookup = Lookup::of(self, entity);
        let greatest = lookup.factor[..3].iter().copied().fold(0.0, f64::max);
        if greatest <= 0.0 {
            return None;
        }
        // An image has no numbers above 1.
        let file = self.image_file(lookup.image?, &lookup, Taken::Color(1.0 / greatest))?;
        Some((file, greatest))
    }

    /// The mean colour of a texture.
    pub fn mean(&mut self, texture: EntityId) -> [f64; 3] {
        let entity = &self.description.entities[texture.0];
        let lookup = Lookup::of(self, entity);
        let source = lookup.image.and_then(|it| self.description.entities[it.0].text("filename"));
        let mean = source.map(|(source, _)| source.to_owned()).and_then(|source| {
            self.decode(&source, Encoding::Srgb);
            let decoded = self.images.decoded.get(&decoded_key(&source, Encoding::Srgb));
            let (picture, _) = decoded?.as_ref()?;
            let mut sum = [0.0; 3];
            for color in picture.colors() {
                (0..3).for_each(|part| sum[part] += f64::from(color[part]));
            }
            Some(sum.map(|part| part / (picture.width * picture.height) as f64))
        });
        let mean = mean.unwrap_or([1.0; 3]);
        std::array::from_fn(|part| mean[part] * lookup.factor[part])
    }

    /// Decodes an image at its first use. The problem of one that cannot be read is said.
    fn decode(&mut self, source: &str, encoding: Encoding) {
        let key = decoded_key(source, encoding);
        if self.images.decoded.contains_key(&key) {
            return;
        }
        let read = self.read_picture(source, encoding);
        let read = match read {
            Ok(read) => Some(read),
            Err(problem) => {
                self.warn(format!("`{source}` is left out: {problem}"));
                None
            }
        };
        // The decoded image before is not needed again: textures of one material follow each other.
        self.images.decoded.retain(|other, _| other.starts_with(&format!("{source} ")));
        self.images.decoded.insert(key, read);
    }

    fn read_picture(&self, source: &str, encoding: Encoding) -> Result<(Picture, Vec<u8>), String> {
        let budget = InputBudget::new(self.input_memory);
        let files = SceneFiles {
            scene: self.path,
            files: self.files as &dyn FileSource,
            embedded: &self.description.embedded,
            budget: &budget,
            texture_memory: None,
        };
        let input = files.read(&files.path(source)).map_err(|error| error.to_string())?;
        let read = Picture::read_for_gltf(&input.bytes, encoding, &budget);
        let (picture, _held) = read.map_err(|error| match error {
            PictureError::Malformed(problem) => problem,
            PictureError::OverBudget(error) => format!("it {error}"),
        })?;
        Ok((picture, input.bytes))
    }

    /// A file's name that no other has, after that of an image.
    fn file_name(&mut self, source: &str, extension: &str) -> String {
        let stem = match source.split_once('#') {
            Some((_, part)) => part.replace(['[', ']'], ""),
            None => {
                let stem = Path::new(source).file_stem().unwrap_or_default();
                stem.to_string_lossy().into_owned()
            }
        };
        self.unique_file(&stem, extension)
    }
}

fn decoded_key(source: &str, encoding: Encoding) -> String {
    format!("{source} {encoding:?}")
}

/// True for modes of wrapping that pbrt-v4 does not have.
fn is_mixed(wrap: [f64; 2]) -> bool {
    wrap.contains(&2.0) || (wrap.contains(&1.0) && wrap.contains(&3.0))
}

fn square(number: f64) -> f64 {
    number * number
}

/// The extension of a file that pbrt-v4 reads as it is.
fn extension_of(bytes: &[u8]) -> Option<&'static str> {
    match bytes {
        [0x89, b'P', b'N', b'G', ..] => Some("png"),
        [0xff, 0xd8, 0xff, ..] => Some("jpg"),
        _ => None,
    }
}

/// A PNG file of what is taken of each texel.
fn baked(picture: &Picture, value: impl Fn([f32; 4]) -> [f64; 3], taken: Taken) -> Option<Vec<u8>> {
    match taken {
        Taken::Color(_) => coded(picture, value, 3, Encoding::Srgb),
        _ => coded(picture, value, 1, Encoding::Linear),
    }
}

fn coded(
    picture: &Picture,
    value: impl Fn([f32; 4]) -> [f64; 3],
    channels: usize,
    encoding: Encoding,
) -> Option<Vec<u8>> {
    let (from, to) = (ByteCode::new(picture.encoding), ByteCode::new(encoding));
    let texels = picture.width * picture.height;
    let mut bytes = rtsl_memory::reserved(channels * texels).ok()?;
    for index in 0..texels {
        let color = value(picture.components(&from, index));
        bytes.extend(color[..channels].iter().map(|part| to.encode(*part as f32)));
    }
    encode_png((picture.width, picture.height), channels, &bytes).ok()
}
