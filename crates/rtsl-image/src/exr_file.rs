//! OpenEXR files with linear colours and AOVs, as layers of one part or as several parts.
//!
//! Channels have the usual names: `R`, `G`, `B`; `albedo.R`; `normal.X`; `Z` for the distance; that of an output with
//! one component. They are the same in one part and in several parts, which are named after the images.

use std::io::{self, BufWriter, Write};

use exr::prelude::{
    AnyChannel, AnyChannels, Encoding, FlatSamples, ImageAttributes, IntegerBounds, Layer,
    LayerAttributes, Text, Vec2, WritableImage, f16,
};
use rtsl_memory::{OutOfMemory, collected};

use super::{AovImage, AovType, Image, ImageMetadata};
use crate::atomic_write::Output;

/// Options for EXR files.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct ExrOptions {
    /// The precision of colours. All other channels have that of [`ExrPrecision::Float`]: indices and distances need
    /// it.
    pub precision: ExrPrecision,
    /// True if each image is a separate part, false if it is a layer of the only part.
    pub multi_part: bool,
}

/// The precision of colours.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum ExrPrecision {
    /// binary16: half the size, three decimal digits, at most 65504.
    Half,
    /// binary32
    #[default]
    Float,
}

/// Writes colours and AOVs of the same size.
pub fn write_exr(
    image: &Image,
    aovs: &[AovImage],
    options: ExrOptions,
    metadata: &ImageMetadata,
    file: &mut dyn Output,
) -> io::Result<()> {
    let size = Vec2(image.width, image.height);
    let color = Part {
        name: "color",
        channels: channels(&["R", "G", "B"], image.pixels.as_flattened(), options.precision)?,
    };
    let others = aovs.iter().map(|aov| {
        let is_color = aov.ty == AovType::Color;
        let precision = if is_color { options.precision } else { ExrPrecision::Float };
        let channels = channels(&aov.aov.channels(aov.ty), &aov.values, precision)?;
        Ok(Part { name: aov.aov.name(), channels })
    });
    let parts: Vec<Part> =
        std::iter::once(Ok(color)).chain(others).collect::<Result<_, OutOfMemory>>()?;
    let layer = |name: Option<&str>, channels: Vec<AnyChannel<FlatSamples>>| {
        let attributes = LayerAttributes {
            layer_name: name.map(Text::from),
            software_name: Some(Text::from(metadata.software().as_str())),
            comments: metadata.comment().map(|comment| Text::from(comment.as_str())),
            ..LayerAttributes::default()
        };
        // Blocks of 16 rows compressed by deflate, which every reader supports.
        Layer::new(size, attributes, Encoding::SMALL_LOSSLESS, AnyChannels::sort(channels.into()))
    };
    let layers: Vec<_> = if options.multi_part && parts.len() > 1 {
        parts.into_iter().map(|part| layer(Some(part.name), part.channels)).collect()
    } else {
        vec![layer(None, parts.into_iter().flat_map(|part| part.channels).collect())]
    };
    let attributes = ImageAttributes::new(IntegerBounds::from_dimensions(size));
    let file_image = exr::image::Image::from_layers(attributes, layers);
    // Single-threaded: several threads would write blocks in the order in which they finish, so the bytes of the file
    // would not be reproducible. Custom attributes would be ordered by a hash table; none are written.
    let mut buffered = BufWriter::new(file);
    let written = file_image.write().non_parallel().to_buffered(&mut buffered);
    written.map_err(|error| match error {
        exr::error::Error::Io(error) => error,
        other => io::Error::other(other.to_string()),
    })?;
    buffered.flush()
}

/// An image in the file.
struct Part<'a> {
    name: &'a str,
    channels: Vec<AnyChannel<FlatSamples>>,
}

/// Returns the channels of these names, of which `values` has one number after the other for each pixel.
fn channels(
    names: &[impl AsRef<str>],
    values: &[f32],
    precision: ExrPrecision,
) -> Result<Vec<AnyChannel<FlatSamples>>, OutOfMemory> {
    let count = values.len() / names.len();
    let channel = |(component, name): (usize, _)| {
        let name: &str = AsRef::as_ref(name);
        let values = values.iter().skip(component).step_by(names.len()).copied();
        let samples = match precision {
            ExrPrecision::Float => FlatSamples::F32(collected(count, values)?),
            ExrPrecision::Half => FlatSamples::F16(collected(count, values.map(half))?),
        };
        Ok(AnyChannel::new(name, samples))
    };
    names.iter().enumerate().map(channel).collect()
}

/// The nearest binary16 number. Finite values stay finite: an infinity would spread when the image is filtered.
fn half(value: f32) -> f16 {
    let greatest = f16::MAX.to_f32();
    let value = if value.is_finite() { value.clamp(-greatest, greatest) } else { value };
    f16::from_f32(value)
}
