//! The reader of image files that scenes refer to.

use rtsl_memory::{Held, InputBudget};

use super::encoding::Encoding;
use super::exr_picture::read_exr;
use super::guarded::guarded;
use super::picture::{Picture, PictureError, check_size};
use super::texel_format::TexelFormat;
use super::{
    bmp_picture, hdr_picture, jpeg_picture, ktx2_picture, pfm_picture, png_picture, qoi_picture,
    tga_picture, webp_picture,
};

/// The names of the formats that are read, for diagnostics.
const FORMATS: &str = "EXR, PNG, JPEG, WebP, TGA, HDR, PFM, BMP, QOI or KTX 2.0";

impl Picture {
    /// Reads an image file, whose format is recognised by its first bytes. [`Picture::memory`] is held with it.
    ///
    /// `encoding` is that of PNG, WebP and KTX 2.0 files. As in pbrt-v4, JPEG, TGA and BMP files are sRGB, QOI files
    /// name their encoding, and EXR, HDR and PFM files are linear. Opacity is read from EXR, QOI, WebP and KTX 2.0 files
    /// and from PNG files with red, green, blue and opacity. It is encoded as colours are, and dropped if it is 1
    /// everywhere; other files are opaque. Infinities and NaN become 0.
    ///
    /// # Errors
    /// If it is no such file, is damaged, or takes more memory than is left in the budget.
    pub fn read(
        bytes: &[u8],
        encoding: Encoding,
        budget: &InputBudget,
    ) -> Result<(Picture, Held), PictureError> {
        let (mut picture, held) = Picture::read_as_stored(bytes, encoding, budget)?;
        picture.make_finite();
        Ok((picture, held))
    }

    /// The same, with infinities and NaN.
    ///
    /// # Errors
    /// If it is no such file, is damaged, or takes more memory than is left in the budget.
    pub fn read_as_stored(
        bytes: &[u8],
        encoding: Encoding,
        budget: &InputBudget,
    ) -> Result<(Picture, Held), PictureError> {
        let (picture, held) = read(bytes, encoding, png_picture::Opacity::OfColors, budget)?;
        Ok((picture.without_full_opacity(), held))
    }

    /// Reads an image file of a glTF file: `encoding` is that of 8-bit files in every format, and all opacity is read
    /// and kept, so that a picture has it if [`has_opacity`](crate::has_opacity) finds it in its file.
    ///
    /// # Errors
    /// If it is no such file, is damaged, or takes more memory than is left in the budget.
    pub fn read_for_gltf(
        bytes: &[u8],
        encoding: Encoding,
        budget: &InputBudget,
    ) -> Result<(Picture, Held), PictureError> {
        let (mut picture, held) = read(bytes, encoding, png_picture::Opacity::Any, budget)?;
        if picture.bytes().is_some() {
            picture.encoding = encoding;
        }
        picture.make_finite();
        Ok((picture, held))
    }
}

/// Reads a file in any of the formats.
fn read(
    bytes: &[u8],
    encoding: Encoding,
    of_png: png_picture::Opacity,
    budget: &InputBudget,
) -> Result<(Picture, Held), PictureError> {
    match bytes {
        [0x76, 0x2f, 0x31, 0x01, ..] => read_exr(bytes, budget),
        [0x89, b'P', b'N', b'G', ..] => png_picture::read(bytes, encoding, of_png, budget),
        [0xff, 0xd8, 0xff, ..] => guarded(|| jpeg_picture::read(bytes, budget)),
        [b'B', b'M', ..] => guarded(|| bmp_picture::read(bytes, budget)),
        [b'q', b'o', b'i', b'f', ..] => guarded(|| qoi_picture::read(bytes, budget)),
        [b'#', b'?', ..] => guarded(|| hdr_picture::read(bytes, budget)),
        [b'P', b'F' | b'f', b' ' | b'\n' | b'\r' | b'\t', ..] => pfm_picture::read(bytes, budget),
        _ if webp_picture::is_webp(bytes) => {
            guarded(|| webp_picture::read(bytes, encoding, budget))
        }
        _ if ktx2_picture::is_ktx2(bytes) => {
            guarded(|| ktx2_picture::read(bytes, encoding, budget))
        }
        _ => match tga_picture::Header::read(bytes) {
            Some(header) => tga_picture::read(&header, bytes, budget),
            None => Err(format!("it is not an image in {FORMATS} format").into()),
        },
    }
}

/// Checks the size in a header and holds the memory of the picture.
pub fn hold(
    (width, height): (usize, usize),
    format: TexelFormat,
    budget: &InputBudget,
) -> Result<Held, PictureError> {
    check_size(width, height)?;
    Ok(budget.hold(Picture::memory(width, height, format))?)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_no_image_is_refused() {
        let files = [
            &b"GIF89a"[..],
            b"",
            b"\x89PNG\r\n",
            b"\x76\x2f\x31\x01xx",
            b"\xff\xd8\xff\xe0",
            b"BM\x3a\0",
            b"qoif\0",
            b"#?RADIANCE\n#",
            b"#?RADIANCE\n\n-Y 99999999999 +X 4\n",
            b"PF\n4 x\n",
            b"PF 2 2 0\n0123456789",
            b"RIFF\x08\0\0\0WEBP",
            b"RIFF\x10\0\0\0WEBPVP8L\x04\0\0\0\x2f\xff\xff\xff",
            b"\xabKTX 20\xbb\r\n\x1a\n",
            b"\0\0\x02\0\0\0\0\0\0\0\0\0\x02\0\x02\0\x18\0xy",
        ];
        for bytes in files {
            let read = Picture::read(bytes, Encoding::Srgb, &InputBudget::default());
            assert!(matches!(read, Err(PictureError::Malformed(_))), "{bytes:?}");
        }
    }
}
