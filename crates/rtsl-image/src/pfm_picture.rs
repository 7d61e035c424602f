//! The reader of PFM pictures: a header of four words, then floats, rows from the bottom.

use rtsl_memory::{Held, InputBudget, reserved};

use super::encoding::Encoding;
use super::picture::{Picture, PictureError, Samples};
use super::picture_file::hold;
use super::texel_format::{Depth, TexelFormat};

/// Reads a picture of one channel (`Pf`) or three (`PF`). Its scale multiplies the numbers; they are little-endian if
/// it is negative.
pub fn read(bytes: &[u8], budget: &InputBudget) -> Result<(Picture, Held), PictureError> {
    let mut rest = bytes;
    let channels = if word(&mut rest)? == "PF" { 3 } else { 1 };
    let (width, height) = (side(&mut rest)?, side(&mut rest)?);
    let scale: f32 = word(&mut rest)?.parse().map_err(|_| "its scale is not a number")?;
    if scale == 0.0 || !scale.is_finite() {
        return Err(format!("its scale is {scale}").into());
    }
    let held = hold((width, height), TexelFormat { channels, depth: Depth::Float }, budget)?;
    let numbers = rest.as_chunks::<4>().0;
    if numbers.len() < width * height * channels {
        return Err("it ends too early".into());
    }
    let decode = if scale < 0.0 { f32::from_le_bytes } else { f32::from_be_bytes };
    let mut samples = reserved(width * height * channels)?;
    for row in numbers[..width * height * channels].chunks_exact(width * channels).rev() {
        samples.extend(row.iter().map(|bytes| decode(*bytes) * scale.abs()));
    }
    let samples = Samples::Floats(samples);
    Ok((Picture { width, height, channels, samples, encoding: Encoding::Linear }, held))
}

fn side(rest: &mut &[u8]) -> Result<usize, PictureError> {
    word(rest)?.parse().map_err(|_| "its size is not a number".into())
}

/// Takes the next word and the one blank after it.
fn word<'a>(rest: &mut &'a [u8]) -> Result<&'a str, PictureError> {
    let text = rest.trim_ascii_start();
    let length = text.iter().take(32).position(u8::is_ascii_whitespace);
    let (word, after) = text.split_at(length.ok_or("it ends within its header")?);
    *rest = after.get(1..).unwrap_or_default();
    std::str::from_utf8(word).map_err(|_| "its header is damaged".into())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_come_from_the_bottom_in_either_order_of_bytes() {
        let read = |scale: &str, encode: fn(f32) -> [u8; 4]| {
            let mut file = format!("PF\n1 2\n{scale}\n").into_bytes();
            file.extend([4.0, 5.0, f32::NAN, 1.0, 2.0, 3.0].map(encode).as_flattened());
            Picture::read(&file, Encoding::Srgb, &InputBudget::default()).unwrap().0
        };
        let little = read("-1.0", f32::to_le_bytes);
        assert_eq!((little.width, little.height, little.channels), (1, 2, 3));
        assert_eq!(little.samples, Samples::Floats(vec![1.0, 2.0, 3.0, 4.0, 5.0, 0.0]));
        let big = read("2", f32::to_be_bytes);
        assert_eq!(big.samples, Samples::Floats(vec![2.0, 4.0, 6.0, 8.0, 10.0, 0.0]));
        let grey = b"Pf 2 1 -1\n\0\0\0\0\0\0\x80\x3f";
        let (grey, _) = Picture::read(grey, Encoding::Srgb, &InputBudget::default()).unwrap();
        assert_eq!((grey.channels, grey.samples), (1, Samples::Floats(vec![0.0, 1.0])));
    }
}
