//! The opacity of pictures by the first bytes of their files.

use super::{ktx2_picture, webp_picture};

/// Returns true if a picture that a glTF file may use has opacity, and false if it is opaque. The first 2^16 bytes of
/// its file suffice.
///
/// # Errors
/// If its format is not one of those.
pub fn has_opacity(bytes: &[u8]) -> Result<bool, &'static str> {
    match bytes {
        [0x89, b'P', b'N', b'G', ..] => Ok(of_png(bytes)),
        [0xff, 0xd8, 0xff, ..] => Ok(false),
        _ if webp_picture::is_webp(bytes) => Ok(webp_picture::has_opacity(bytes)),
        _ if ktx2_picture::is_ktx2(bytes) => ktx2_picture::has_opacity(bytes),
        [b'D', b'D', b'S', b' ', ..] => Err("DDS is not supported"),
        [_, _, _, _, b'f', b't', b'y', b'p', b'a', b'v', b'i', ..] => Err("AVIF is not supported"),
        _ => Err("it is not a PNG, a JPEG, a WebP or a KTX 2.0 file"),
    }
}

/// True for the colour types with opacity, and those with a chunk `tRNS`, which comes before the texels.
fn of_png(bytes: &[u8]) -> bool {
    if matches!(bytes.get(25), Some(4 | 6)) {
        return true;
    }
    let mut at = 8_usize;
    while let Some(header) = bytes.get(at..at.saturating_add(8)) {
        let length = u32::from_be_bytes([header[0], header[1], header[2], header[3]]);
        match &header[4..8] {
            b"tRNS" => return true,
            b"IDAT" => return false,
            _ => at = at.saturating_add(12).saturating_add(length as usize),
        }
    }
    false
}
