//! The reader of image files that scenes refer to.

use std::io::Cursor;

use rtsl_memory::{Amount, Held, InputBudget, filled, reserved};

use super::exr_picture::read_exr;
use super::picture::{Picture, PictureError, check_size};
use crate::srgb_decode;

/// The encoding of 8-bit and 16-bit files.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Encoding {
    /// The transfer function of sRGB.
    Srgb,
    /// Linear.
    Linear,
}

impl Picture {
    /// Reads a PNG or an EXR file, distinguished by its first bytes. [`Picture::memory`] is held with it.
    ///
    /// # Errors
    /// If it is neither, is damaged, or takes more memory than is left in the budget.
    pub fn read(
        bytes: &[u8],
        encoding: Encoding,
        budget: &InputBudget,
    ) -> Result<(Picture, Held), PictureError> {
        let (mut picture, held) = match bytes {
            [0x76, 0x2f, 0x31, 0x01, ..] => read_exr(bytes, budget)?,
            [0x89, b'P', b'N', b'G', ..] => read_png(bytes, encoding, budget)?,
            _ => return Err("it is neither a PNG nor an EXR file".into()),
        };
        if picture.texels.iter().all(|texel| texel[3] == 1.0) {
            for texel in &mut picture.texels {
                texel[3] = (texel[0] + texel[1] + texel[2]) / 3.0;
            }
        }
        Ok((picture, held))
    }
}

fn read_png(
    bytes: &[u8],
    encoding: Encoding,
    budget: &InputBudget,
) -> Result<(Picture, Held), PictureError> {
    let mut decoder = png::Decoder::new(Cursor::new(bytes));
    decoder.set_transformations(png::Transformations::EXPAND);
    let mut reader = decoder.read_info()?;
    let (width, height) = (reader.info().width as usize, reader.info().height as usize);
    check_size(width, height)?;
    let held = budget.hold(Picture::memory(width, height))?;
    let size = reader.output_buffer_size().ok_or("it is too large")?;
    let of_decoder = budget.hold(Amount(size as u64))?;
    let mut buffer = filled(size, 0)?;
    let info = reader.next_frame(&mut buffer)?;
    let channels = info.color_type.samples();
    let light = |value: f64| match encoding {
        Encoding::Srgb => srgb_decode(value) as f32,
        Encoding::Linear => value as f32,
    };
    let texel = |values: &[f64]| match *values {
        [grey] => [light(grey), light(grey), light(grey), 1.0],
        [grey, alpha] => [light(grey), light(grey), light(grey), alpha as f32],
        [red, green, blue] => [light(red), light(green), light(blue), 1.0],
        [red, green, blue, alpha, ..] => [light(red), light(green), light(blue), alpha as f32],
        [] => [0.0; 4],
    };
    let is_deep = info.bit_depth == png::BitDepth::Sixteen;
    let mut texels = reserved(width * height)?;
    for bytes in buffer.chunks_exact(channels * if is_deep { 2 } else { 1 }).take(width * height) {
        let mut values = [0.0; 4];
        let values = &mut values[..channels];
        if is_deep {
            let pairs = bytes.as_chunks::<2>().0.iter().map(|pair| u16::from_be_bytes(*pair));
            values.iter_mut().zip(pairs).for_each(|(value, it)| *value = f64::from(it) / 65_535.0);
        } else {
            values.iter_mut().zip(bytes).for_each(|(value, it)| *value = f64::from(*it) / 255.0);
        }
        texels.push(texel(values));
    }
    if texels.len() < width * height {
        return Err("it ends too early".into());
    }
    drop(of_decoder);
    Ok((Picture { width, height, texels }, held))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_no_image_is_refused() {
        for bytes in [&b"GIF89a"[..], b"", b"\x89PNG\r\n", b"\x76\x2f\x31\x01xx"] {
            let read = Picture::read(bytes, Encoding::Srgb, &InputBudget::default());
            assert!(matches!(read, Err(PictureError::Malformed(_))));
        }
    }
}
