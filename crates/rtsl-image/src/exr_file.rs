//! OpenEXR: colours and what else is known of pixels, linear, as layers of one part or as parts.
//!
//! Channels have the names by which other programs know them: `R`, `G`, `B`; `albedo.R`; `normal.X`; `Z` for the
//! distance. They are the same in one part and in several, whose parts are named as the images.

use std::io::{self, BufWriter, Write};

use exr::prelude::{
    AnyChannel, AnyChannels, Encoding, FlatSamples, ImageAttributes, IntegerBounds, Layer,
    LayerAttributes, Text, Vec2, WritableImage, f16,
};
use rtsl_memory::{OutOfMemory, collected};

use super::{AovImage, Image, ImageMetadata};
use crate::atomic_write::Output;

/// How an EXR keeps its numbers.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct ExrOptions {
    /// The precision of colours. All else has that of [`ExrPrecision::Float`]: numbers of objects and distances
    /// would not survive less.
    pub precision: ExrPrecision,
    /// Each image is a part of its own, else a layer of the one part.
    pub multi_part: bool,
}

/// The precision of colours.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum ExrPrecision {
    /// binary16: half the space, three decimal digits, at most 65504.
    Half,
    /// binary32
    #[default]
    Float,
}

/// Writes colours and other images of the same size.
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
        channels: channels(&["R", "G", "B"], &image.pixels, options.precision)?,
    };
    let others = aovs.iter().map(|aov| {
        let precision = if aov.aov.is_color() { options.precision } else { ExrPrecision::Float };
        let channels = channels(aov.aov.channels(), &aov.pixels, precision)?;
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
        // Blocks of 16 rows by deflate: what every reader knows.
        Layer::new(size, attributes, Encoding::SMALL_LOSSLESS, AnyChannels::sort(channels.into()))
    };
    let layers: Vec<_> = if options.multi_part && parts.len() > 1 {
        parts.into_iter().map(|part| layer(Some(part.name), part.channels)).collect()
    } else {
        vec![layer(None, parts.into_iter().flat_map(|part| part.channels).collect())]
    };
    let attributes = ImageAttributes::new(IntegerBounds::from_dimensions(size));
    let file_image = exr::image::Image::from_layers(attributes, layers);
    // On one thread: several would order the blocks of the file as they finish, so that the same image gave
    // other bytes from run to run. Attributes of our own making would be ordered by a hash table; there are none.
    let mut buffered = BufWriter::new(file);
    let written = file_image.write().non_parallel().to_buffered(&mut buffered);
    written.map_err(|error| match error {
        exr::error::Error::Io(error) => error,
        other => io::Error::other(other.to_string()),
    })?;
    buffered.flush()
}

/// An image in a file.
struct Part {
    name: &'static str,
    channels: Vec<AnyChannel<FlatSamples>>,
}

fn channels(
    names: &[&str],
    pixels: &[[f32; 3]],
    precision: ExrPrecision,
) -> Result<Vec<AnyChannel<FlatSamples>>, OutOfMemory> {
    let channel = |(component, name): (usize, &&str)| {
        let values = pixels.iter().map(|pixel| pixel[component]);
        let samples = match precision {
            ExrPrecision::Float => FlatSamples::F32(collected(pixels.len(), values)?),
            ExrPrecision::Half => FlatSamples::F16(collected(pixels.len(), values.map(half))?),
        };
        Ok(AnyChannel::new(*name, samples))
    };
    names.iter().enumerate().map(channel).collect()
}

/// The nearest of binary16. What is finite stays so: an infinity would spread when the image is filtered.
fn half(value: f32) -> f16 {
    let greatest = f16::MAX.to_f32();
    let value = if value.is_finite() { value.clamp(-greatest, greatest) } else { value };
    f16::from_f32(value)
}
