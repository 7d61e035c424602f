//! Image files that scenes name: linear texels, levels for textures, sums for skies.

use std::io::Cursor;

use crate::film::srgb_decode;

/// More texels are refused: they would take 1 GiB.
const MOST_TEXELS: usize = 1 << 26;

/// An image in memory.
#[derive(Clone, Debug, PartialEq)]
pub struct Picture {
    /// Columns.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// Linear red, green and blue, and what the texel counts as a number: its opacity, or where all is opaque the
    /// mean of the three. Rows from the top.
    pub texels: Vec<[f32; 4]>,
}

/// How the numbers of an 8-bit or 16-bit file stand for light.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Encoding {
    /// By the transfer function of sRGB.
    Srgb,
    /// In proportion.
    Linear,
}

impl Picture {
    /// Reads a PNG or an EXR file, which its first bytes tell apart.
    pub fn read(bytes: &[u8], encoding: Encoding) -> Result<Picture, String> {
        let mut picture = match bytes {
            [0x76, 0x2f, 0x31, 0x01, ..] => read_exr(bytes)?,
            [0x89, b'P', b'N', b'G', ..] => read_png(bytes, encoding)?,
            _ => return Err("it is neither a PNG nor an EXR file".to_owned()),
        };
        if picture.texels.iter().all(|texel| texel[3] == 1.0) {
            for texel in &mut picture.texels {
                texel[3] = (texel[0] + texel[1] + texel[2]) / 3.0;
            }
        }
        Ok(picture)
    }

    /// This and ever smaller ones down to one texel, each half the size of the one before, rounded down.
    pub fn levels(self) -> Vec<Picture> {
        let mut levels = vec![self];
        while let Some(last) = levels.last().filter(|last| last.width.max(last.height) > 1) {
            levels.push(last.halved());
        }
        levels
    }

    fn halved(&self) -> Picture {
        let (width, height) = ((self.width / 2).max(1), (self.height / 2).max(1));
        let part =
            |place: usize, count: usize, of: usize| place * of / count..(place + 1) * of / count;
        let mean = |row: usize, column: usize| {
            let mut sum = [0.0; 4];
            let (rows, columns) = (part(row, height, self.height), part(column, width, self.width));
            let count = (rows.len() * columns.len()) as f32;
            for row in rows {
                for texel in &self.texels[row * self.width..][columns.clone()] {
                    for (sum, value) in sum.iter_mut().zip(texel) {
                        *sum += value;
                    }
                }
            }
            sum.map(|sum| sum / count)
        };
        let places = (0..height).flat_map(|row| (0..width).map(move |column| (row, column)));
        let texels = places.map(|(row, column)| mean(row, column)).collect();
        Picture { width, height, texels }
    }

    /// For each row what part of a sky's light comes from those above, and the same for the columns of each
    /// row, each list ending with 1. `row_weight` is the solid angle of a row's texels, to any scale.
    pub fn sums(&self, row_weight: impl Fn(usize) -> f64) -> (Vec<f32>, Vec<f32>) {
        let luminance = |texel: &[f32; 4]| {
            let [red, green, blue, _] = texel.map(f64::from);
            (0.2126 * red + 0.7152 * green + 0.0722 * blue).max(0.0)
        };
        let brightness: Vec<f64> = self.texels.iter().map(luminance).collect();
        let mut columns = Vec::with_capacity((self.width + 1) * self.height);
        let mut totals = Vec::with_capacity(self.height);
        for (row, line) in brightness.chunks(self.width).enumerate() {
            columns.extend(running(line));
            totals.push(line.iter().sum::<f64>() * row_weight(row));
        }
        (running(&totals), columns)
    }
}

/// The parts of the whole before each number, and 1. Where all are 0 they count alike.
fn running(numbers: &[f64]) -> Vec<f32> {
    let total: f64 = numbers.iter().sum();
    let mut sum = 0.0;
    let mut parts = vec![0.0];
    for (index, number) in numbers.iter().enumerate() {
        sum += number;
        let part =
            if total > 0.0 { sum / total } else { (index + 1) as f64 / numbers.len() as f64 };
        parts.push(part.min(1.0) as f32);
    }
    if let Some(last) = parts.last_mut() {
        *last = 1.0;
    }
    parts
}

fn check_size(width: usize, height: usize) -> Result<(), String> {
    match width.checked_mul(height) {
        Some(1..=MOST_TEXELS) => Ok(()),
        Some(_) | None => Err(format!("it has {width} x {height} texels, at most 2^26 are read")),
    }
}

fn read_exr(bytes: &[u8]) -> Result<Picture, String> {
    use exr::prelude::*;
    let image = read()
        .no_deep_data()
        .largest_resolution_level()
        .rgba_channels(
            |size, _| {
                (size.width(), size.height(), vec![[0.0_f32; 4]; size.area().min(MOST_TEXELS)])
            },
            |(width, _, texels), place, (red, green, blue, alpha): (f32, f32, f32, f32)| {
                let finite = |value: f32| if value.is_finite() { value } else { 0.0 };
                if let Some(texel) = texels.get_mut(place.y() * *width + place.x()) {
                    *texel = [red, green, blue, alpha].map(finite);
                }
            },
        )
        .first_valid_layer()
        .all_attributes()
        .from_buffered(Cursor::new(bytes))
        .map_err(|error| error.to_string())?;
    let (width, height, texels) = image.layer_data.channel_data.pixels;
    check_size(width, height)?;
    Ok(Picture { width, height, texels })
}

fn read_png(bytes: &[u8], encoding: Encoding) -> Result<Picture, String> {
    let mut decoder = png::Decoder::new(Cursor::new(bytes));
    decoder.set_transformations(png::Transformations::EXPAND);
    let mut reader = decoder.read_info().map_err(|error| error.to_string())?;
    let (width, height) = (reader.info().width as usize, reader.info().height as usize);
    check_size(width, height)?;
    let size = reader.output_buffer_size().ok_or("it is too large")?;
    let mut buffer = vec![0; size];
    let info = reader.next_frame(&mut buffer).map_err(|error| error.to_string())?;
    let channels = info.color_type.samples();
    let values: Vec<f64> = match info.bit_depth {
        png::BitDepth::Sixteen => {
            let (pairs, _) = buffer.as_chunks::<2>();
            pairs.iter().map(|pair| f64::from(u16::from_be_bytes(*pair)) / 65_535.0).collect()
        }
        _ => buffer.iter().map(|byte| f64::from(*byte) / 255.0).collect(),
    };
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
    let texels: Vec<[f32; 4]> = values.chunks(channels).take(width * height).map(texel).collect();
    if texels.len() < width * height {
        return Err("it ends too early".to_owned());
    }
    Ok(Picture { width, height, texels })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn picture(width: usize, height: usize) -> Picture {
        let texels = (0..width * height).map(|index| [index as f32, 1.0, 2.0, 1.0]).collect();
        Picture { width, height, texels }
    }

    #[test]
    fn levels_end_with_the_mean() {
        let levels = picture(8, 4).levels();
        let sizes: Vec<(usize, usize)> = levels.iter().map(|it| (it.width, it.height)).collect();
        assert_eq!(sizes, [(8, 4), (4, 2), (2, 1), (1, 1)]);
        assert_eq!(levels[3].texels, [[15.5, 1.0, 2.0, 1.0]]);
        assert_eq!(picture(6, 4).levels().last().map(|it| it.texels[0][0]), Some(11.5));
        assert_eq!(picture(5, 3).levels().len(), 3);
    }

    #[test]
    fn sums_rise_to_one() {
        let (rows, columns) = picture(3, 2).sums(|_| 1.0);
        assert_eq!((rows.len(), columns.len()), (3, 8));
        assert!(
            rows.is_sorted() && columns[..4].is_sorted() && rows[2] == 1.0 && columns[3] == 1.0
        );
        let dark = Picture { texels: vec![[0.0; 4]; 4], width: 2, height: 2 };
        assert_eq!(dark.sums(|_| 1.0).0, [0.0, 0.5, 1.0]);
    }

    #[test]
    fn what_is_no_image_is_refused() {
        for bytes in [&b"GIF89a"[..], b"", b"\x89PNG\r\n", b"\x76\x2f\x31\x01xx"] {
            assert!(Picture::read(bytes, Encoding::Srgb).is_err());
        }
    }
}
