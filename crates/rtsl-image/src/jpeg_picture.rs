//! The reader of JPEG pictures, baseline and progressive.

use rtsl_memory::{Held, InputBudget, filled};
use zune_core::bytestream::ZCursor;
use zune_core::colorspace::ColorSpace;
use zune_core::options::DecoderOptions;
use zune_jpeg::JpegDecoder;
use zune_jpeg::errors::DecodeErrors;

use super::encoding::Encoding;
use super::picture::{Picture, PictureError, Samples};
use super::picture_file::hold;
use super::texel_format::{Depth, TexelFormat};

/// The greatest side that the format allows.
const MAX_SIDE: usize = u16::MAX as usize;

/// Bytes of the decoder for a pixel: the coefficients of four channels of a progressive picture, with their padding.
const DECODER_BYTES: usize = 16;

/// Reads a picture as grey or as red, green and blue.
pub fn read(bytes: &[u8], budget: &InputBudget) -> Result<(Picture, Held), PictureError> {
    let options = DecoderOptions::default().set_max_width(MAX_SIDE).set_max_height(MAX_SIDE);
    let mut decoder = JpegDecoder::new_with_options(ZCursor::new(bytes), options);
    decoder.decode_headers().map_err(malformed)?;
    let (width, height) = decoder.dimensions().ok_or("it has no size")?;
    let (channels, colors) = match decoder.input_colorspace() {
        Some(ColorSpace::Luma) => (1, ColorSpace::Luma),
        _ => (3, ColorSpace::RGB),
    };
    decoder.set_options(options.jpeg_set_out_colorspace(colors));
    let format = TexelFormat { channels, depth: Depth::Byte };
    let held = hold((width, height), format, budget)?;
    let padded = width.next_multiple_of(64) * height.next_multiple_of(64);
    let of_decoder = budget.hold(rtsl_memory::Amount(DECODER_BYTES as u64).times(padded))?;
    let mut samples = filled(width * height * channels, 0)?;
    decoder.decode_into(&mut samples).map_err(malformed)?;
    drop(of_decoder);
    let samples = Samples::Bytes(samples);
    Ok((Picture { width, height, channels, samples, encoding: Encoding::Srgb }, held))
}

fn malformed(error: DecodeErrors) -> PictureError {
    PictureError::Malformed(error.to_string())
}
