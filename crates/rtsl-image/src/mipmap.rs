//! Mipmaps in the storage that shaders read.

use std::io;
use std::sync::Arc;

use exr::prelude::f16;
use rtsl_memory::{Amount, OutOfMemory, SharedWords, reserved};

use super::encoding::{ByteCode, Encoding};
use super::picture::Picture;
use super::texel_format::{Depth, TexelFormat};

/// A picture and its levels down to one texel, one after the other, each half the size of the previous one, rounded
/// down, or the picture alone.
///
/// The levels are means of linear values, each of the unrounded level before; the numbers of a level are rounded to the
/// nearest that its format has: bytes to the nearest code in the encoded scale, halves to even.
#[derive(Clone, Debug)]
pub struct Mipmap {
    /// Columns of the first level.
    pub width: usize,
    /// Rows of the first level.
    pub height: usize,
    /// The format of the texels.
    pub format: TexelFormat,
    /// The encoding of bytes.
    pub encoding: Encoding,
    /// The texels, see [`TexelFormat::words`]. The first number of a word is in its lowest bits.
    pub words: SharedWords,
}

impl Mipmap {
    /// Makes all levels.
    ///
    /// # Errors
    /// If there is not enough memory.
    pub fn new(picture: Picture) -> Result<Mipmap, OutOfMemory> {
        let sizes: Vec<(usize, usize)> = level_sizes(picture.width, picture.height).collect();
        let texels = sizes.iter().map(|(width, height)| width * height).sum();
        Mipmap::written(&picture, texels, |writer| {
            writer.copy(&picture);
            let mut finer: Option<Vec<[f32; 4]>> = None;
            for pair in sizes.windows(2) {
                let grid = Grid { fine: pair[0], coarse: pair[1] };
                let level = match &finer {
                    None => grid.means(|index| picture.components(&writer.code, index)),
                    Some(texels) => grid.means(|index| texels[index]),
                }?;
                level.iter().for_each(|texel| writer.push(*texel));
                finer = Some(level);
            }
            Ok(())
        })
    }

    /// Makes the first level alone.
    ///
    /// # Errors
    /// If there is not enough memory.
    pub fn flat(picture: &Picture) -> Result<Mipmap, OutOfMemory> {
        Mipmap::written(picture, picture.width * picture.height, |writer| {
            writer.copy(picture);
            Ok(())
        })
    }

    /// Makes a mipmap of so many texels.
    fn written(
        picture: &Picture,
        texels: usize,
        write: impl FnOnce(&mut Writer<'_>) -> Result<(), OutOfMemory>,
    ) -> Result<Mipmap, OutOfMemory> {
        let format = picture.format();
        // The length is known, so that the words are allocated once, where they stay.
        let mut words: Arc<[u32]> = std::iter::repeat_n(0, format.words(texels)).collect();
        if let Some(words) = Arc::get_mut(&mut words) {
            let code = ByteCode::new(picture.encoding);
            write(&mut Writer { format, code, words, count: 0 })?;
        }
        let Picture { width, height, encoding, .. } = *picture;
        Ok(Mipmap { width, height, format, encoding, words: words.into() })
    }
}

impl Mipmap {
    /// Returns the size of the texels, in memory or in a file.
    pub fn size(&self) -> Amount {
        Amount::of::<u32>(self.words.len())
    }

    /// Moves the texels to a temporary file.
    ///
    /// # Errors
    /// If the file cannot be written.
    pub fn into_file(self) -> io::Result<Mipmap> {
        Ok(Mipmap { words: SharedWords::in_file(&self.words)?, ..self })
    }

    /// Returns the texels of the first level as linear red, green and blue.
    pub fn colors(&self) -> impl Iterator<Item = [f32; 3]> {
        let code = ByteCode::new(self.encoding);
        (0..self.width * self.height).map(move |index| self.color(&code, index))
    }

    fn color(&self, code: &ByteCode, index: usize) -> [f32; 3] {
        let word = |at: usize| self.words.get(at).copied().unwrap_or(0);
        let half = |bits: u32| f16::from_bits(bits as u16).to_f32();
        match (self.format.depth, self.format.channels) {
            (Depth::Byte, 1) => [code.decode(word(index / 4).to_le_bytes()[index % 4]); 3],
            (Depth::Byte, _) => {
                let [red, green, blue, _] = word(index).to_le_bytes();
                [red, green, blue].map(|it| code.decode(it))
            }
            (Depth::Half, 1) => [half(word(index / 2) >> (16 * (index % 2)) & 0xffff); 3],
            (Depth::Half, _) => {
                let (low, high) = (word(2 * index), word(2 * index + 1));
                [half(low & 0xffff), half(low >> 16), half(high & 0xffff)]
            }
            (Depth::Float, 1) => [f32::from_bits(word(index)); 3],
            (Depth::Float, channels) => {
                [0, 1, 2].map(|channel| f32::from_bits(word(channels * index + channel)))
            }
        }
    }
}

/// The sizes of the levels of a mipmap.
pub fn level_sizes(width: usize, height: usize) -> impl Iterator<Item = (usize, usize)> {
    let smaller = |(width, height): &(usize, usize)| {
        (width.max(height) > &1).then(|| ((width / 2).max(1), (height / 2).max(1)))
    };
    std::iter::successors(Some((width, height)), smaller)
}

/// The cells of a coarse level over a fine one.
struct Grid {
    fine: (usize, usize),
    coarse: (usize, usize),
}

impl Grid {
    fn means(&self, fine: impl Fn(usize) -> [f32; 4]) -> Result<Vec<[f32; 4]>, OutOfMemory> {
        let (columns, rows) = self.coarse;
        let mut level = reserved(columns * rows)?;
        for row in 0..rows {
            level.extend((0..columns).map(|column| self.mean((column, row), &fine)));
        }
        Ok(level)
    }

    /// The mean of the fine texels in one cell.
    fn mean(&self, (column, row): (usize, usize), fine: &impl Fn(usize) -> [f32; 4]) -> [f32; 4] {
        let part =
            |place: usize, count: usize, of: usize| place * of / count..(place + 1) * of / count;
        let (width, height) = self.fine;
        let rows = part(row, self.coarse.1, height);
        let columns = part(column, self.coarse.0, width);
        let count = (rows.len() * columns.len()) as f32;
        let mut sum = [0.0; 4];
        for row in rows {
            for column in columns.clone() {
                for (sum, value) in sum.iter_mut().zip(fine(row * width + column)) {
                    *sum += value;
                }
            }
        }
        sum.map(|sum| sum / count)
    }
}

/// Writes texels one after the other.
struct Writer<'w> {
    format: TexelFormat,
    code: ByteCode,
    words: &'w mut [u32],
    /// The texels written.
    count: usize,
}

impl Writer<'_> {
    /// Copies the texels of a picture; bytes stay as they are.
    fn copy(&mut self, picture: &Picture) {
        let channels = self.format.channels;
        match picture.bytes() {
            Some(bytes) => {
                for texel in bytes.chunks_exact(channels) {
                    let mut codes = [255; 4];
                    codes[..channels].copy_from_slice(texel);
                    self.push_bytes(codes);
                }
            }
            None => (0..picture.width * picture.height).for_each(|index| {
                let texel = picture.components(&self.code, index);
                self.push(texel);
            }),
        }
    }

    fn push(&mut self, texel: [f32; 4]) {
        match self.format.depth {
            Depth::Byte => {
                let codes = texel.map(|value| self.code.encode(value));
                self.push_bytes(codes);
            }
            Depth::Half => self.push_halves(texel.map(|value| f16::from_f32(value).to_bits())),
            Depth::Float => self.push_floats(texel),
        }
    }

    fn push_bytes(&mut self, codes: [u8; 4]) {
        let (at, word) = match self.format.channels {
            1 => (self.count / 4, u32::from(codes[0]) << (8 * (self.count % 4))),
            _ => (self.count, u32::from_le_bytes(codes)),
        };
        self.put(at, word);
        self.count += 1;
    }

    fn push_halves(&mut self, halves: [u16; 4]) {
        let pair = |low: usize| u32::from(halves[low]) | u32::from(halves[low + 1]) << 16;
        match self.format.channels {
            1 => self.put(self.count / 2, u32::from(halves[0]) << (16 * (self.count % 2))),
            _ => {
                self.put(2 * self.count, pair(0));
                self.put(2 * self.count + 1, pair(2));
            }
        }
        self.count += 1;
    }

    fn push_floats(&mut self, texel: [f32; 4]) {
        let channels = self.format.channels;
        for (channel, value) in texel[..channels].iter().enumerate() {
            self.put(self.count * channels + channel, value.to_bits());
        }
        self.count += 1;
    }

    /// Sets bits of a word that are 0.
    fn put(&mut self, at: usize, bits: u32) {
        if let Some(word) = self.words.get_mut(at) {
            *word |= bits;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::picture::Samples;
    use super::*;

    fn picture((width, height): (usize, usize), channels: usize, samples: Samples) -> Picture {
        Picture { width, height, channels, samples, encoding: Encoding::Linear }
    }

    fn floats(width: usize, height: usize) -> Picture {
        let samples = (0..width * height).flat_map(|index| [index as f32, 1.0, 2.0]).collect();
        picture((width, height), 3, Samples::Floats(samples))
    }

    #[test]
    fn levels_end_with_the_mean() {
        assert!(level_sizes(8, 4).eq([(8, 4), (4, 2), (2, 1), (1, 1)]));
        assert!(level_sizes(5, 3).eq([(5, 3), (2, 1), (1, 1)]));
        let levels = Mipmap::new(floats(8, 4)).unwrap();
        let texel = |index: usize| {
            std::array::from_fn(|channel| f32::from_bits(levels.words[3 * index + channel]))
        };
        assert_eq!(levels.words.len(), 3 * 43);
        assert_eq!((texel(32)[0], texel(40)[0], texel(42)), (4.5, 13.5, [15.5, 1.0, 2.0]));
        let odd = Mipmap::new(floats(6, 4)).unwrap();
        assert_eq!(odd.words[odd.words.len() - 3], 11.5_f32.to_bits());
        assert_eq!(Mipmap::new(floats(1, 1)).unwrap().words.len(), 3);
    }

    #[test]
    fn bytes_stay_as_they_are_and_their_means_are_rounded() {
        let colors = Samples::Bytes(vec![10, 20, 30, 11, 20, 33]);
        let levels = Mipmap::new(picture((2, 1), 3, colors)).unwrap();
        assert_eq!(&levels.words[..], [0xff1e_140a, 0xff21_140b, 0xff20_140b]);
        let opacities = Samples::Bytes(vec![0, 0, 0, 4, 0, 0, 0, 8]);
        let levels = Mipmap::new(picture((2, 1), 4, opacities)).unwrap();
        assert_eq!(&levels.words[..], [0x0400_0000, 0x0800_0000, 0x0600_0000]);
        let greys = Samples::Bytes(vec![1, 3, 5, 7]);
        let levels = Mipmap::new(picture((2, 2), 1, greys)).unwrap();
        assert_eq!(&levels.words[..], [0x0705_0301, 0x0000_0004]);
        let encoded = Picture {
            encoding: Encoding::Srgb,
            ..picture((2, 1), 1, Samples::Bytes(vec![0, 255]))
        };
        // The code of half the light, not half the code.
        assert_eq!(Mipmap::new(encoded).unwrap().words[0], 188 << 16 | 255 << 8);
    }

    #[test]
    fn colors_come_back_from_every_format() {
        let half = f16::from_f32;
        for (channels, samples) in [
            (1, Samples::Bytes(vec![0, 51, 255])),
            (3, Samples::Bytes(vec![0, 51, 255, 1, 2, 3, 255, 0, 51])),
            (4, Samples::Bytes(vec![0, 51, 255, 9, 1, 2, 3, 9, 255, 0, 51, 9])),
            (1, Samples::Halves([1.0, 2.0, 0.5].map(half).to_vec())),
            (3, Samples::Halves((1..10).map(|it| half(it as f32)).collect())),
            (1, Samples::Floats(vec![1.0, 2.0, 0.1])),
            (3, Samples::Floats((1..10).map(|it| it as f32 / 7.0).collect())),
            (4, Samples::Floats((1..13).map(|it| it as f32 / 7.0).collect())),
        ] {
            let picture = picture((3, 1), channels, samples);
            assert!(Mipmap::flat(&picture).unwrap().colors().eq(picture.colors()), "{picture:?}");
        }
    }

    #[test]
    fn halves_take_two_bytes_a_channel() {
        let half = |value: f32| f16::from_f32(value);
        let greys = Samples::Halves(vec![half(1.0), half(2.0)]);
        let levels = Mipmap::new(picture((2, 1), 1, greys)).unwrap();
        assert_eq!(&levels.words[..], [0x4000_3c00, 0x0000_3e00]);
        let colors = Samples::Halves(vec![half(1.0), half(2.0), half(0.0)]);
        let flat = Mipmap::flat(&picture((1, 1), 3, colors)).unwrap();
        assert_eq!(&flat.words[..], [0x4000_3c00, 0x3c00_0000]);
    }
}
