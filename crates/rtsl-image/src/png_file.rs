//! PNG files with 8 bits per channel.

use std::io::{self, BufWriter, Write};

use super::{ImageMetadata, ViewTransform};
use crate::atomic_write::Output;

/// Writes bytes of red, green and blue. `view` determines the colour space recorded in the file.
pub fn write_png(
    (width, height): (usize, usize),
    bytes: &[u8],
    view: ViewTransform,
    metadata: &ImageMetadata,
    file: &mut dyn Output,
) -> io::Result<()> {
    let mut buffered = BufWriter::new(file);
    let mut encoder = png::Encoder::new(&mut buffered, width as u32, height as u32);
    encoder.set_color(png::ColorType::Rgb);
    encoder.set_depth(png::BitDepth::Eight);
    match view {
        ViewTransform::Standard | ViewTransform::Filmic => {
            encoder.set_source_srgb(png::SrgbRenderingIntent::Perceptual);
        }
        ViewTransform::Raw => encoder.set_source_gamma(png::ScaledFloat::new(1.0)),
    }
    encoder.add_text_chunk("Software".to_owned(), metadata.software())?;
    if let Some(comment) = metadata.comment() {
        encoder.add_text_chunk("Comment".to_owned(), comment)?;
    }
    let mut writer = encoder.write_header()?;
    writer.write_image_data(bytes)?;
    writer.finish()?;
    buffered.flush()
}

/// Returns a PNG file of 8 bits a channel: grey for one channel, red, green and blue for three.
///
/// # Errors
/// If the size is not that of the bytes.
pub fn encode_png(
    (width, height): (usize, usize),
    channels: usize,
    bytes: &[u8],
) -> io::Result<Vec<u8>> {
    let mut file = Vec::new();
    let mut encoder = png::Encoder::new(&mut file, width as u32, height as u32);
    encoder.set_color(if channels == 1 { png::ColorType::Grayscale } else { png::ColorType::Rgb });
    encoder.set_depth(png::BitDepth::Eight);
    encoder.set_compression(png::Compression::Fast);
    let mut writer = encoder.write_header()?;
    writer.write_image_data(bytes)?;
    writer.finish()?;
    Ok(file)
}
