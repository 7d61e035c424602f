//! The reader of PNG pictures of any bit depth and colour type.

use std::io::Cursor;

use exr::prelude::f16;
use png::{BitDepth, ColorType, Transformations};
use rtsl_memory::{Amount, Held, InputBudget, filled};

use super::encoding::Encoding;
use super::picture::{Picture, PictureError, Samples};
use super::picture_file::hold;
use super::texel_format::{Depth, TexelFormat};

/// The opacity that pictures keep.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Opacity {
    /// That beside red, green and blue, as in pbrt-v4.
    OfColors,
    /// That of greys and palettes, too, which become colours.
    Any,
}

/// Reads a picture. Pictures of 16 bits become halves, others bytes; palettes are expanded to colours.
pub fn read(
    bytes: &[u8],
    encoding: Encoding,
    opacity: Opacity,
    budget: &InputBudget,
) -> Result<(Picture, Held), PictureError> {
    let mut decoder = png::Decoder::new(Cursor::new(bytes));
    decoder.set_transformations(Transformations::EXPAND);
    let mut reader = decoder.read_info()?;
    let info = reader.info();
    let (width, height) = (info.width as usize, info.height as usize);
    let has_opacity = info.trns.is_some()
        || matches!(info.color_type, ColorType::GrayscaleAlpha | ColorType::Rgba);
    let kept = match info.color_type {
        _ if has_opacity && opacity == Opacity::Any => 4,
        ColorType::Grayscale | ColorType::GrayscaleAlpha => 1,
        ColorType::Rgb | ColorType::Indexed => 3,
        ColorType::Rgba => 4,
    };
    let is_grey = matches!(info.color_type, ColorType::Grayscale | ColorType::GrayscaleAlpha);
    let is_deep = info.bit_depth == BitDepth::Sixteen;
    let depth = if is_deep { Depth::Half } else { Depth::Byte };
    let held = hold((width, height), TexelFormat { channels: kept, depth }, budget)?;
    let size = reader.output_buffer_size().ok_or("it is too large")?;
    let is_spread = kept == 4 && is_grey;
    let of_decoder = budget.hold(Amount(size as u64).times(if is_spread { 3 } else { 1 }))?;
    let mut buffer = filled(size, 0)?;
    let decoded = reader.next_frame(&mut buffer)?;
    let mut channels = decoded.color_type.samples();
    buffer.truncate(width * height * channels * if is_deep { 2 } else { 1 });
    if buffer.len() < width * height * channels * if is_deep { 2 } else { 1 } {
        return Err("it ends too early".into());
    }
    if is_spread {
        buffer = spread_greys(&buffer, if is_deep { 2 } else { 1 })?;
        channels = kept;
    }
    let samples = if is_deep {
        let table = decoded_words(encoding)?;
        let words = buffer.as_chunks::<2>().0.iter().map(|pair| u16::from_be_bytes(*pair));
        let mut halves = rtsl_memory::reserved(width * height * channels)?;
        halves.extend(words.map(|word| table[usize::from(word)]));
        Samples::Halves(halves)
    } else {
        Samples::Bytes(buffer)
    };
    drop(of_decoder);
    let mut picture = Picture { width, height, channels, samples, encoding };
    if kept < channels {
        picture.keep_channels(kept);
    }
    Ok((picture, held))
}

/// Greys of so many bytes, each beside its opacity, as red, green, blue and opacity.
fn spread_greys(greys: &[u8], bytes: usize) -> Result<Vec<u8>, PictureError> {
    let mut colors = rtsl_memory::reserved(2 * greys.len())?;
    for texel in greys.chunks_exact(2 * bytes) {
        let (grey, opacity) = texel.split_at(bytes);
        [grey, grey, grey, opacity].iter().for_each(|part| colors.extend_from_slice(part));
    }
    Ok(colors)
}

/// The linear values of all words of 16 bits.
fn decoded_words(encoding: Encoding) -> Result<Vec<f16>, PictureError> {
    let values = (0..=u16::MAX).map(|it| encoding.decode(f64::from(it) / 65_535.0));
    Ok(rtsl_memory::collected(1 << 16, values.map(|value| f16::from_f32(value as f32)))?)
}
