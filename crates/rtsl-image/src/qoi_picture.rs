//! The reader of QOI pictures.

use rtsl_memory::{Held, InputBudget, filled};
use zune_core::bytestream::ZCursor;
use zune_core::options::DecoderOptions;
use zune_qoi::{QoiDecoder, QoiErrors};

use super::encoding::Encoding;
use super::picture::{Picture, PictureError, Samples};
use super::picture_file::hold;
use super::texel_format::{Depth, TexelFormat};

/// Reads a picture, which names its channels and its encoding.
pub fn read(bytes: &[u8], budget: &InputBudget) -> Result<(Picture, Held), PictureError> {
    let options = DecoderOptions::default().set_max_width(1 << 26).set_max_height(1 << 26);
    let (channels, encoding) = match bytes.get(12..14) {
        Some([channels @ (3 | 4), 0]) => (usize::from(*channels), Encoding::Srgb),
        Some([channels @ (3 | 4), 1]) => (usize::from(*channels), Encoding::Linear),
        Some(_) => return Err("its channels or its colour space are unknown".into()),
        None => return Err("it ends within its header".into()),
    };
    let mut decoder = QoiDecoder::new_with_options(ZCursor::new(bytes), options);
    decoder.decode_headers().map_err(malformed)?;
    let (width, height) = decoder.dimensions().ok_or("it has no size")?;
    let held = hold((width, height), TexelFormat { channels, depth: Depth::Byte }, budget)?;
    let mut samples = filled(width * height * channels, 0)?;
    decoder.decode_into(&mut samples).map_err(malformed)?;
    Ok((Picture { width, height, channels, samples: Samples::Bytes(samples), encoding }, held))
}

fn malformed(error: QoiErrors) -> PictureError {
    PictureError::Malformed(format!("{error:?}"))
}
