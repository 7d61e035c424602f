//! The reader of TGA pictures: colours, greys and palettes, plain or in runs. The format has no signature, so that a
//! file is recognised by a header whose numbers fit together.

use rtsl_memory::{Held, InputBudget, reserved};

use super::encoding::Encoding;
use super::picture::{Picture, PictureError, Samples};
use super::picture_file::hold;
use super::texel_format::{Depth, TexelFormat};

/// The length of a header.
const HEADER_BYTES: usize = 18;

/// The kind of a pixel.
#[derive(Clone, Copy, PartialEq)]
enum Kind {
    Palette,
    Color,
    Grey,
}

/// A header that is possible.
pub struct Header {
    kind: Kind,
    in_runs: bool,
    /// The index of the palette's first colour, their number, and the bits of each.
    palette: (usize, usize, usize),
    size: (usize, usize),
    /// Bits of a pixel.
    bits: usize,
    from_top: bool,
    from_right: bool,
    /// The position of the palette.
    start: usize,
}

impl Header {
    /// Reads a header; `None` if it is not that of a TGA file.
    pub fn read(bytes: &[u8]) -> Option<Header> {
        let header = bytes.first_chunk::<HEADER_BYTES>()?;
        let number = |at: usize| usize::from(u16::from_le_bytes([header[at], header[at + 1]]));
        let (kind, in_runs) = match header[2] {
            1 => (Kind::Palette, false),
            2 => (Kind::Color, false),
            3 => (Kind::Grey, false),
            9 => (Kind::Palette, true),
            10 => (Kind::Color, true),
            11 => (Kind::Grey, true),
            _ => return None,
        };
        let palette = (number(3), number(5), usize::from(header[7]));
        let (size, bits) = ((number(12), number(14)), usize::from(header[16]));
        let has_palette = header[1] == 1 && palette.1 > 0 && matches!(palette.2, 15 | 16 | 24 | 32);
        let fits = match kind {
            Kind::Palette => has_palette && matches!(bits, 8 | 16),
            Kind::Color => header[1] <= 1 && matches!(bits, 15 | 16 | 24 | 32),
            Kind::Grey => header[1] <= 1 && matches!(bits, 8 | 16),
        };
        (fits && size.0 > 0 && size.1 > 0).then_some(Header {
            kind,
            in_runs,
            palette: if header[1] == 1 { palette } else { (0, 0, 0) },
            size,
            bits,
            from_top: header[17] & 0x20 != 0,
            from_right: header[17] & 0x10 != 0,
            start: HEADER_BYTES + usize::from(header[0]),
        })
    }
}

/// Reads a picture as grey or as red, green and blue; opacity is dropped.
pub fn read(
    header: &Header,
    bytes: &[u8],
    budget: &InputBudget,
) -> Result<(Picture, Held), PictureError> {
    let (width, height) = header.size;
    let channels = if header.kind == Kind::Grey { 1 } else { 3 };
    // The rows are brought into order by way of a copy.
    let format = TexelFormat { channels: 2 * channels, depth: Depth::Byte };
    let held = hold(header.size, format, budget)?;
    let ends = || PictureError::from("it ends too early");
    let after = bytes.get(header.start..).ok_or_else(ends)?;
    let (_, colors, color_bits) = header.palette;
    let palette_bytes = colors * color_bits.div_ceil(8);
    let (palette, pixels) = after.split_at_checked(palette_bytes).ok_or_else(ends)?;
    let mut reader = Pixels { header, palette, rest: pixels };
    let mut samples = reserved(width * height * channels)?;
    while samples.len() < width * height * channels {
        let left = width * height - samples.len() / channels;
        reader.run(left, |color| samples.extend(&color[..channels]))?;
    }
    let row = width * channels;
    if !header.from_top {
        samples = samples.chunks_exact(row).rev().flatten().copied().collect();
    }
    if header.from_right {
        let mirrored = |row: &[u8]| row.chunks_exact(channels).rev().flatten().copied().collect();
        samples = samples.chunks_exact(row).flat_map::<Vec<u8>, _>(mirrored).collect();
    }
    let samples = Samples::Bytes(samples);
    Ok((Picture { width, height, channels, samples, encoding: Encoding::Srgb }, held))
}

/// The pixels that are left.
struct Pixels<'a> {
    header: &'a Header,
    palette: &'a [u8],
    rest: &'a [u8],
}

impl<'a> Pixels<'a> {
    /// Gives the pixels of the next packet, at most `left`; of plain files all.
    fn run(&mut self, left: usize, mut give: impl FnMut([u8; 3])) -> Result<(), PictureError> {
        let (count, repeats) = if self.header.in_runs {
            let packet = self.take(1)?[0];
            (usize::from(packet & 0x7f) + 1, packet & 0x80 != 0)
        } else {
            (left, false)
        };
        let count = count.min(left);
        if repeats {
            let color = self.pixel()?;
            (0..count).for_each(|_| give(color));
            return Ok(());
        }
        (0..count).try_for_each(|_| self.pixel().map(&mut give))
    }

    fn pixel(&mut self) -> Result<[u8; 3], PictureError> {
        let bits = self.header.bits;
        let bytes = self.take(bits.div_ceil(8))?;
        match self.header.kind {
            Kind::Grey => Ok([bytes[0]; 3]),
            Kind::Color => Ok(color(bytes)),
            Kind::Palette => {
                let index = match *bytes {
                    [low, high, ..] => usize::from(u16::from_le_bytes([low, high])),
                    [index] => usize::from(index),
                    [] => 0,
                };
                let (first, _, bits) = self.header.palette;
                let each = bits.div_ceil(8);
                let place = index.checked_sub(first).map(|index| index * each);
                let entry = place.and_then(|place| self.palette.get(place..place + each));
                entry.map(color).ok_or_else(|| "a pixel is not in its palette".into())
            }
        }
    }

    fn take(&mut self, count: usize) -> Result<&'a [u8], PictureError> {
        let (taken, rest) = self.rest.split_at_checked(count).ok_or("it ends too early")?;
        self.rest = rest;
        Ok(taken)
    }
}

/// Red, green and blue of a pixel: 5 bits each, or bytes in reversed order.
fn color(bytes: &[u8]) -> [u8; 3] {
    match *bytes {
        [low, high] => {
            let word = u16::from_le_bytes([low, high]);
            [10, 5, 0].map(|place| (u32::from(word >> place & 31) * 255 / 31) as u8)
        }
        [blue, green, red, ..] => [red, green, blue],
        _ => [0; 3],
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A header of 2 by 2 pixels, and what follows.
    fn file(kind: u8, palette: [u8; 5], bits: u8, descriptor: u8, rest: &[u8]) -> Vec<u8> {
        let has_palette = u8::from(palette != [0; 5]);
        let mut file = vec![2, has_palette, kind];
        file.extend(palette);
        file.extend([0, 0, 0, 0, 2, 0, 2, 0, bits, descriptor]);
        file.extend(b"id");
        file.extend(rest);
        file
    }

    fn samples(file: &[u8]) -> (usize, Samples) {
        let (picture, _) = Picture::read(file, Encoding::Linear, &InputBudget::default()).unwrap();
        assert_eq!((picture.width, picture.height, picture.encoding), (2, 2, Encoding::Srgb));
        (picture.channels, picture.samples)
    }

    #[test]
    fn every_kind_is_read_from_each_corner() {
        const NONE: [u8; 5] = [0; 5];
        let greys = |descriptor| samples(&file(3, NONE, 8, descriptor, &[1, 2, 3, 4]));
        let expected = |bytes: &[u8]| (1, Samples::Bytes(bytes.to_vec()));
        assert_eq!(greys(0x20), expected(&[1, 2, 3, 4]));
        assert_eq!(greys(0), expected(&[3, 4, 1, 2]));
        assert_eq!(greys(0x30), expected(&[2, 1, 4, 3]));
        let runs = samples(&file(11, NONE, 8, 0x20, &[0x82, 9, 0, 5]));
        assert_eq!(runs, expected(&[9, 9, 9, 5]));
        let colors = (3, Samples::Bytes(vec![3, 2, 1, 3, 2, 1, 6, 5, 4, 9, 8, 7]));
        let plain = [1, 2, 3, 255, 1, 2, 3, 0, 4, 5, 6, 7, 7, 8, 9, 1];
        assert_eq!(samples(&file(2, NONE, 32, 0x28, &plain)), colors);
        let runs = [0x81, 1, 2, 3, 1, 4, 5, 6, 7, 8, 9];
        assert_eq!(samples(&file(10, NONE, 24, 0x20, &runs)), colors);
        let few = [0x00, 0x7c, 0xe0, 0x03, 0x1f, 0x00, 0xff, 0x7f];
        let primaries = vec![255, 0, 0, 0, 255, 0, 0, 0, 255, 255, 255, 255];
        assert_eq!(samples(&file(2, NONE, 16, 0x20, &few)), (3, Samples::Bytes(primaries)));
        let indices = [1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 10, 11, 12];
        assert_eq!(samples(&file(1, [10, 0, 3, 0, 24], 8, 0x20, &indices)), colors);
    }

    #[test]
    fn damage_is_reported() {
        let problem =
            |file: &[u8]| match Picture::read(file, Encoding::Srgb, &InputBudget::default())
                .unwrap_err()
            {
                PictureError::Malformed(problem) => problem,
                PictureError::OverBudget(error) => error.to_string(),
            };
        assert_eq!(problem(&file(2, [0; 5], 24, 0, &[1, 2, 3])), "it ends too early");
        let outside = file(1, [0, 0, 1, 0, 24], 8, 0, &[1, 2, 3, 0, 0, 0, 1]);
        assert_eq!(problem(&outside), "a pixel is not in its palette");
        let unknown = file(2, [0; 5], 23, 0, &[]);
        assert!(problem(&unknown).starts_with("it is not an image"));
    }
}
