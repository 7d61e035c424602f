//! The reader of KTX 2.0 files with textures compressed by Basis Universal, as glTF's `KHR_texture_basisu` has them.

use basisu::{DecodeFlags, TargetFormat, Transcoder};
use rtsl_memory::{Amount, Held, InputBudget, filled};

use super::encoding::Encoding;
use super::picture::{Picture, PictureError, Samples};
use super::picture_file::hold;
use super::texel_format::{Depth, TexelFormat};

const MAGIC: &[u8] = b"\xabKTX 20\xbb\r\n\x1a\n";

/// The colour models of the descriptor.
const ETC1S: u8 = 163;
const UASTC: u8 = 166;

/// The size of a descriptor with two samples: colour and opacity.
const TWO_SAMPLES: u32 = 60;

/// The bytes of a compressed block of 4 by 4 texels.
const BLOCK_BYTES: u64 = 16;

/// The greatest memory of the transcoder's tables: two lists of 2^14 entries, and tables of codes.
const TABLES: Amount = Amount(4 << 20);

/// The parts of a header that tell a picture's memory.
struct Header {
    width: usize,
    height: usize,
    has_opacity: bool,
    /// The bytes of the first level under a general compression, which is decoded first.
    unpacked: u64,
}

/// True if a file begins as a KTX 2.0 file.
pub fn is_ktx2(bytes: &[u8]) -> bool {
    bytes.starts_with(MAGIC)
}

/// True if the picture whose file begins with `bytes` has opacity.
pub fn has_opacity(bytes: &[u8]) -> Result<bool, &'static str> {
    Ok(Header::read(bytes)?.has_opacity)
}

/// Reads the first level as red, green and blue, with opacity if it has any.
pub fn read(
    bytes: &[u8],
    encoding: Encoding,
    budget: &InputBudget,
) -> Result<(Picture, Held), PictureError> {
    const DAMAGED: &str = "it is damaged";
    let Header { width, height, has_opacity, unpacked } = Header::read(bytes)?;
    let channels = if has_opacity { 4 } else { 3 };
    let held = hold((width, height), TexelFormat { channels, depth: Depth::Byte }, budget)?;
    let blocks = width.div_ceil(4) as u64 * height.div_ceil(4) as u64;
    if unpacked > blocks * BLOCK_BYTES {
        return Err(DAMAGED.into());
    }
    let colors = Amount::of::<[u8; 4]>(width * height);
    let of_blocks = Amount(BLOCK_BYTES * blocks);
    let of_transcoder = budget.hold(TABLES + of_blocks + Amount(unpacked) + colors)?;
    let transcoder = Transcoder::new(bytes).map_err(|_| DAMAGED)?;
    let mut samples = filled(4 * width * height, 0)?;
    let texels = TargetFormat::Rgba32;
    transcoder.transcode_into(0, texels, DecodeFlags::NONE, &mut samples).map_err(|_| DAMAGED)?;
    drop(transcoder);
    let samples = Samples::Bytes(samples);
    let mut picture = Picture { width, height, channels: 4, samples, encoding };
    if channels < 4 {
        picture.keep_channels(channels);
    }
    drop(of_transcoder);
    Ok((picture, held))
}

impl Header {
    /// Reads the start of a file.
    fn read(bytes: &[u8]) -> Result<Header, &'static str> {
        const SHORT: &str = "it ends within its header";
        let word = |place: usize| -> Option<u32> {
            Some(u32::from_le_bytes(bytes.get(place..place.checked_add(4)?)?.try_into().ok()?))
        };
        let long = |place: usize| -> Option<u64> {
            Some(u64::from_le_bytes(bytes.get(place..place.checked_add(8)?)?.try_into().ok()?))
        };
        let size = |place: usize| word(place).map(|it| it as usize).ok_or(SHORT);
        let (width, height) = (size(20)?, size(24)?);
        let [depth, layers, faces] = [size(28)?, size(32)?, size(36)?];
        if depth > 0 || layers > 1 || faces != 1 {
            return Err("it has several pictures, expected one");
        }
        let descriptor = size(48)?;
        let model = *bytes.get(descriptor.saturating_add(12)).ok_or(SHORT)?;
        let channel = *bytes.get(descriptor.saturating_add(31)).ok_or(SHORT)? & 15;
        let has_opacity = match model {
            ETC1S => word(52) == Some(TWO_SAMPLES),
            // All four channels, or red alone with opacity.
            UASTC => matches!(channel, 3 | 5),
            _ => return Err("its texels are not compressed by Basis Universal as ETC1S or UASTC"),
        };
        let unpacked = long(96).ok_or(SHORT)?;
        Ok(Header { width, height, has_opacity, unpacked })
    }
}
