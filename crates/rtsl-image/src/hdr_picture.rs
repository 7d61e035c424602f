//! The reader of HDR pictures (Radiance, with a common exponent).

use rtsl_memory::{Amount, Held, InputBudget, filled};
use zune_core::bytestream::ZCursor;
use zune_core::options::DecoderOptions;
use zune_hdr::{HdrDecodeErrors, HdrDecoder};

use super::encoding::Encoding;
use super::picture::{Picture, PictureError, Samples};
use super::picture_file::hold;
use super::texel_format::{Depth, TexelFormat};

/// Reads a picture as linear red, green and blue.
pub fn read(bytes: &[u8], budget: &InputBudget) -> Result<(Picture, Held), PictureError> {
    let options = DecoderOptions::default().set_max_width(1 << 26).set_max_height(1 << 26);
    // The decoder copies the lines of the header.
    let of_header = budget.hold(Amount(bytes.len() as u64).times(2))?;
    let mut decoder = HdrDecoder::new_with_options(ZCursor::new(bytes), options);
    decoder.decode_headers().map_err(malformed)?;
    let (width, height) = decoder.dimensions().ok_or("it has no size")?;
    let held = hold((width, height), TexelFormat { channels: 3, depth: Depth::Float }, budget)?;
    let mut samples = filled(width * height * 3, 0.0)?;
    decoder.decode_into(&mut samples).map_err(malformed)?;
    drop(of_header);
    let samples = Samples::Floats(samples);
    Ok((Picture { width, height, channels: 3, samples, encoding: Encoding::Linear }, held))
}

fn malformed(error: HdrDecodeErrors) -> PictureError {
    PictureError::Malformed(format!("{error:?}"))
}
