//! The reader of WebP pictures, lossy and lossless. Of an animation it reads the first picture.

use std::io::Cursor;

use image_webp::{DecodingError, WebPDecoder};
use rtsl_memory::{Amount, Held, InputBudget, filled};

use super::encoding::Encoding;
use super::picture::{Picture, PictureError, Samples};
use super::picture_file::hold;
use super::texel_format::{Depth, TexelFormat};

/// Bytes of the decoder for a pixel: a copy with opacity, and planes of luma and chroma or a picture before it is
/// transformed.
const DECODER_BYTES: usize = 12;

/// True if a file begins as a WebP picture.
pub fn is_webp(bytes: &[u8]) -> bool {
    bytes.starts_with(b"RIFF") && bytes.get(8..12) == Some(b"WEBP")
}

/// True if the picture whose file begins with `bytes` has opacity.
pub fn has_opacity(bytes: &[u8]) -> bool {
    let flags = |place: usize, flag: u8| bytes.get(place).is_some_and(|it| it & flag != 0);
    match bytes.get(12..16) {
        Some(b"VP8X") => flags(20, 0x10),
        Some(b"VP8L") => flags(24, 0x10),
        Some(_) | None => false,
    }
}

/// Reads a picture as red, green and blue, with opacity if it has any.
pub fn read(
    bytes: &[u8],
    encoding: Encoding,
    budget: &InputBudget,
) -> Result<(Picture, Held), PictureError> {
    let mut decoder = WebPDecoder::new(Cursor::new(bytes)).map_err(malformed)?;
    let (width, height) = decoder.dimensions();
    let (width, height) = (width as usize, height as usize);
    let channels = if decoder.has_alpha() { 4 } else { 3 };
    let held = hold((width, height), TexelFormat { channels, depth: Depth::Byte }, budget)?;
    let of_decoder = budget.hold(Amount(DECODER_BYTES as u64).times(width * height))?;
    let mut samples = filled(width * height * channels, 0)?;
    decoder.read_image(&mut samples).map_err(malformed)?;
    drop(of_decoder);
    Ok((Picture { width, height, channels, samples: Samples::Bytes(samples), encoding }, held))
}

fn malformed(error: DecodingError) -> PictureError {
    PictureError::Malformed(error.to_string())
}
