//! Textures and their images.

use std::sync::Arc;

use gltf::json::Texture;
use gltf::json::texture::{Info, MagFilter, MinFilter, Sampler, WrappingMode};
use gltf::json::validation::Checked;
use rtsl_image::has_opacity;
use rtsl_math::{Transform, sine_and_cosine_of_degrees};
use rtsl_memory::Amount;

use super::builder::{Builder, Parameters};
use super::extension::{Extension, extension};
use super::outline::Kind;
use crate::description::EntityKind;
use crate::mesh::gltf::contents;
use crate::pbrt::CONVENTION;
use crate::reader::{ReferenceKind, file_start, resolve};

/// A use of a texture by a material.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TextureUse {
    /// The index of the texture.
    pub texture: usize,
    /// The set of texture coordinates.
    pub set: u32,
    offset: [f64; 2],
    rotation: f64,
    scale: [f64; 2],
}

/// An image that can be read.
#[derive(Clone, Debug)]
pub struct ImageFile {
    /// The name of its file, or of its bytes in the description.
    name: String,
    has_opacity: bool,
}

/// An image of a texture, and how its sampler reads it.
struct SampledImage {
    /// The index of the image.
    image: usize,
    /// The wrap mode of the image's entity.
    wrap: &'static str,
    /// The filter of the image's entity.
    filter: &'static str,
    /// The modes of wrapping along both sides, as the class `GltfTexture` counts them.
    modes: [f64; 2],
    has_opacity: bool,
}

/// An image entity: the image, true for colours, and the names of wrap mode and filter.
pub type ImageKey = (usize, bool, &'static str, &'static str);

/// The part of a texture's value that a parameter takes, and what is made of it.
#[derive(Clone, Copy, Debug)]
pub struct Sample {
    /// True for colours, which images have in sRGB.
    pub is_color: bool,
    /// Scales red, green, blue and opacity.
    pub factor: [f64; 4],
    /// The channel of a number.
    pub channel: u32,
    /// Added to the number.
    pub base: f64,
    /// The least number that counts as 1, if others count as 0.
    pub cutoff: Option<f64>,
    /// The packing of vertices' colours that scale it; 0 for none.
    pub colors: u32,
}

/// The index of the channel of opacity.
const OPACITY: u32 = 3;

impl Sample {
    /// The values of images as they are.
    pub const PLAIN: Sample = Sample {
        is_color: false,
        factor: [1.0; 4],
        channel: OPACITY,
        base: 0.0,
        cutoff: None,
        colors: 0,
    };
}

/// The extensions for images in further formats.
pub const SUPPORTED: [&str; 2] = ["EXT_texture_webp", "KHR_texture_basisu"];

const TRANSFORM: &str = "KHR_texture_transform";

impl TextureUse {
    /// The use of the library's type.
    pub fn of(info: &Info) -> Self {
        Self::new(info.index.value(), info.tex_coord, extension!(info, TRANSFORM))
    }

    /// The use by an object's member `name`.
    pub fn member(object: Extension<'_>, name: &str) -> Option<Self> {
        let info = object.object(name)?;
        let transform = info.object("extensions").and_then(|it| it.object(TRANSFORM));
        Some(Self::new(info.index("index")?, set(info).unwrap_or(0), transform))
    }

    /// The use of a texture by coordinates of a set, transformed by an extension.
    pub fn new(texture: usize, own: u32, transform: Option<Extension<'_>>) -> Self {
        TextureUse {
            texture,
            set: transform.and_then(set).unwrap_or(own),
            offset: transform.and_then(|it| it.numbers("offset")).unwrap_or_default(),
            rotation: transform.map_or(0.0, |it| it.number("rotation", 0.0)),
            scale: transform.and_then(|it| it.numbers("scale")).unwrap_or([1.0; 2]),
        }
    }

    /// The rows of the matrix from the coordinates of shapes to places in the image. Both count from the bottom, and
    /// those in the file from the top.
    fn rows(&self) -> [[f64; 3]; 2] {
        let (sine, cosine) = sine_and_cosine_of_degrees(self.rotation.to_degrees());
        let ([u, v], [x, y]) = (self.scale, self.offset);
        [[cosine * u, -sine * v, x + sine * v], [sine * u, cosine * v, 1.0 - cosine * v - y]]
    }
}

fn set(object: Extension<'_>) -> Option<u32> {
    object.index("texCoord").and_then(|set| u32::try_from(set).ok())
}

/// The mapping of coordinates beyond the edges, as the class `GltfTexture` counts them. An image whose sides differ in
/// this is repeated by the texture, and the other side's edge continues.
fn wrap(sampler: &Sampler) -> ([f64; 2], &'static str) {
    let sides = [&sampler.wrap_s, &sampler.wrap_t];
    let modes = sides.map(|mode| match mode {
        Checked::Valid(WrappingMode::ClampToEdge) => 1.0,
        Checked::Valid(WrappingMode::MirroredRepeat) => 2.0,
        Checked::Valid(WrappingMode::Repeat) | Checked::Invalid => 0.0,
    });
    if modes == [0.0, 0.0] {
        return (modes, "repeat");
    }
    (modes.map(|mode| if mode == 0.0 { 3.0 } else { mode }), "clamp")
}

fn filter(sampler: &Sampler) -> &'static str {
    match (&sampler.mag_filter, &sampler.min_filter) {
        (Some(Checked::Valid(MagFilter::Nearest)), _) => "point",
        (None, Some(Checked::Valid(MinFilter::Nearest))) => "point",
        _ => "bilinear",
    }
}

impl Builder<'_> {
    /// Adds the entity of a texture's sample and returns its name; `None` if the texture has no image that can be read
    /// and nothing else scales it.
    pub fn texture(
        &mut self,
        use_: Option<(TextureUse, usize)>,
        sample: Sample,
        owner: Parameters,
        name: &str,
    ) -> Option<String> {
        let mut parameters = owner;
        let image = use_.and_then(|(use_, place)| Some((use_, place, self.image_of(use_)?)));
        if image.is_none() && sample.colors == 0 {
            return None;
        }
        if let Some((use_, place, image)) = image {
            let entity = self.image_entity(&image, sample.is_color, use_.texture);
            let [to_s, to_t] = use_.rows();
            parameters = parameters.reference(ReferenceKind::Texture, "image", &entity);
            if place > 0 {
                parameters = parameters.numbers("set", &[1.0]);
            }
            if [to_s, to_t] != [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]] {
                parameters = parameters.numbers("toS", &to_s).numbers("toT", &to_t);
            }
            if image.modes != [0.0, 0.0] {
                parameters = parameters.numbers("wrap", &image.modes);
            }
            if image.has_opacity && sample.channel == OPACITY {
                parameters = parameters.boolean("hasOpacity", true);
            }
        }
        if sample.factor != [1.0; 4] {
            parameters = parameters.numbers("factor", &sample.factor);
        }
        if sample.channel > 0 && sample.channel < OPACITY {
            parameters = parameters.numbers("channel", &[sample.channel.into()]);
        }
        if sample.base != 0.0 {
            parameters = parameters.numbers("base", &[sample.base]);
        }
        if let Some(cutoff) = sample.cutoff {
            parameters = parameters.numbers("cutoff", &[cutoff.max(0.0)]);
        }
        if sample.colors != 0 {
            parameters = parameters.numbers("colors", &[sample.colors.into()]);
        }
        let class = if sample.channel == OPACITY { "GltfOpacity" } else { "GltfTexture" };
        let transform = Transform::IDENTITY;
        let id = self.add(EntityKind::Texture, class, Some(name), parameters, transform);
        Some(self.name_of(id))
    }

    /// The image of a texture.
    fn image_of(&mut self, use_: TextureUse) -> Option<SampledImage> {
        let span = self.outline.span(Kind::Texture, use_.texture);
        let Some(texture) = self.file.root.textures.get(use_.texture) else {
            let message = format!("texture {} does not exist: it is left out", use_.texture);
            self.warn(message, span);
            return None;
        };
        let sampler = texture.sampler.and_then(|it| self.file.root.samplers.get(it.value()));
        let sampler = sampler.cloned().unwrap_or_default();
        let (modes, wrap) = wrap(&sampler);
        let sources = self.sources(texture);
        let texture = texture.clone();
        let mut problems = Vec::new();
        for image in sources {
            match self.image(image) {
                Ok(file) => {
                    let (filter, has_opacity) = (filter(&sampler), file.has_opacity);
                    return Some(SampledImage { image, wrap, filter, modes, has_opacity });
                }
                Err(problem) => problems.push(format!("image {image} is left out: {problem}")),
            }
        }
        if problems.is_empty() {
            problems.extend(unreadable_source(&texture));
        }
        problems.into_iter().for_each(|problem| self.warn(problem, span));
        None
    }

    /// The images that a texture names for the formats that are read: that of glTF without extensions is the first.
    fn sources(&self, texture: &Texture) -> Vec<usize> {
        let plain = Some(texture.source.value()).filter(|it| *it < self.file.root.images.len());
        let [webp, basis] = SUPPORTED.map(|name| {
            let extension = texture.extensions.as_ref()?.others.get(name)?;
            Extension(extension).index("source")
        });
        [plain, webp, basis].into_iter().flatten().collect()
    }

    /// An image, which is read at its first use.
    fn image(&mut self, image: usize) -> Result<ImageFile, String> {
        if let Some(known) = self.images.get(&image) {
            return known.clone();
        }
        let found = self.read_image(image);
        self.images.insert(image, found.clone());
        found
    }

    /// The name of an image's entity, which is made at its first use.
    fn image_entity(&mut self, image: &SampledImage, is_color: bool, texture: usize) -> String {
        let SampledImage { image, wrap, filter, modes: _, has_opacity: _ } = *image;
        let key = (image, is_color, wrap, filter);
        if let Some(name) = self.image_entities.get(&key) {
            return name.clone();
        }
        let file = self.images.get(&image).and_then(|found| found.as_ref().ok()).cloned();
        let parameters = self
            .parameters(Kind::Texture, texture)
            .text("filename", &file.map_or(String::new(), |file| file.name))
            .text("encoding", if is_color { "sRGB" } else { "linear" })
            .text(CONVENTION, "gltf")
            .text("wrap", wrap)
            .text("filter", filter);
        let name = format!("image {image}");
        let transform = Transform::IDENTITY;
        let id = self.add(EntityKind::Texture, "imagemap", Some(&name), parameters, transform);
        let name = self.name_of(id);
        self.image_entities.insert(key, name.clone());
        name
    }

    /// Finds the bytes of an image, and puts those that are in the file among the description's.
    fn read_image(&mut self, index: usize) -> Result<ImageFile, String> {
        let image = self.file.root.images.get(index).ok_or("it does not exist")?;
        let path = self.path;
        let external = image.uri.as_deref().filter(|uri| !uri.starts_with("data:"));
        if let Some(uri) = external {
            if uri.contains("://") {
                return Err(format!("it is at `{uri}`, expected a file"));
            }
            let name = percent_encoding::percent_decode_str(uri).decode_utf8_lossy().into_owned();
            let start = file_start(self.files, &resolve(self.path, &name))?;
            return Ok(ImageFile { name, has_opacity: has_opacity(&start)? });
        }
        let no_files = |_: &str| Err(std::io::ErrorKind::NotFound.into());
        let bytes: Arc<[u8]> = match (&image.uri, image.buffer_view) {
            (Some(uri), _) => contents(uri, &no_files).map_err(|error| error.to_string())?.into(),
            (None, Some(view)) => {
                let bytes = self.file.buffers.view(&self.file.root, view);
                bytes.map_err(|problem| format!("its buffer view {problem}"))?.into()
            }
            (None, None) => return Err("it has no contents".to_owned()),
        };
        let has_opacity = has_opacity(&bytes)?;
        let amount = Amount::of::<u8>(bytes.len());
        self.budget.hold(amount).map_err(|error| format!("it {error}"))?.keep(amount);
        let file = path.file_name().unwrap_or_default().to_string_lossy();
        let name = format!("{file}#images[{index}]");
        self.description.embedded.insert(resolve(path, &name), bytes);
        Ok(ImageFile { name, has_opacity })
    }
}

/// The problem of a texture without an image in a format that is read.
fn unreadable_source(texture: &Texture) -> Option<String> {
    let named = texture.extensions.iter().flat_map(|it| it.others.keys());
    let unread = named.filter(|name| !SUPPORTED.contains(&name.as_str()));
    unread
        .map(|name| {
            format!("a texture is left out: its image needs `{name}`, which is not supported")
        })
        .next()
}
