//! The reader of BMP pictures.

use rtsl_memory::{Held, InputBudget, filled};
use zune_bmp::{BmpDecoder, BmpDecoderErrors};
use zune_core::bytestream::ZCursor;
use zune_core::options::DecoderOptions;

use super::encoding::Encoding;
use super::picture::{Picture, PictureError, Samples};
use super::picture_file::hold;
use super::texel_format::{Depth, TexelFormat};

/// Reads a picture as grey or as red, green and blue; opacity is dropped.
pub fn read(bytes: &[u8], budget: &InputBudget) -> Result<(Picture, Held), PictureError> {
    let options = DecoderOptions::default().set_max_width(1 << 26).set_max_height(1 << 26);
    let mut decoder = BmpDecoder::new_with_options(ZCursor::new(bytes), options);
    decoder.decode_headers().map_err(malformed)?;
    let (width, height) = decoder.dimensions().ok_or("it has no size")?;
    let colors = decoder.colorspace().ok_or("it has no colours")?;
    let channels = colors.num_components();
    // Decoding takes another byte for a pixel.
    let format = TexelFormat { channels: channels + 1, depth: Depth::Byte };
    let held = hold((width, height), format, budget)?;
    let mut samples = filled(width * height * channels, 0)?;
    decoder.decode_into(&mut samples).map_err(malformed)?;
    let samples = Samples::Bytes(samples);
    let mut picture = Picture { width, height, channels, samples, encoding: Encoding::Srgb };
    match channels {
        1 | 3 => {}
        2 => picture.keep_channels(1),
        _ => picture.keep_channels(3),
    }
    Ok((picture, held))
}

fn malformed(error: BmpDecoderErrors) -> PictureError {
    PictureError::Malformed(format!("{error:?}"))
}
