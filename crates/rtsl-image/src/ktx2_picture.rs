//! The reader of KTX 2.0 files with textures compressed by Basis Universal, as glTF's `KHR_texture_basisu` has them, or
//! with bytes for each channel.

use std::io::Read;

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
    texels: Texels,
    /// The place and the length of the first level.
    level: [u64; 2],
    /// The bytes of the first level under a general compression, which is decoded first.
    unpacked: u64,
    /// True if that compression is Zstandard.
    is_packed: bool,
}

#[derive(Clone, Copy, PartialEq, Eq)]
enum Texels {
    /// Blocks of Basis Universal.
    Blocks { has_opacity: bool },
    /// Bytes, so many for each texel.
    Bytes(usize),
}

/// True if a file begins as a KTX 2.0 file.
pub fn is_ktx2(bytes: &[u8]) -> bool {
    bytes.starts_with(MAGIC)
}

/// True if the picture whose file begins with `bytes` has opacity.
pub fn has_opacity(bytes: &[u8]) -> Result<bool, &'static str> {
    let texels = Header::read(bytes)?.texels;
    Ok(matches!(texels, Texels::Blocks { has_opacity: true } | Texels::Bytes(4)))
}

const DAMAGED: &str = "it is damaged";

/// Reads the first level as grey or as red, green and blue, with opacity if it has any.
pub fn read(
    bytes: &[u8],
    encoding: Encoding,
    budget: &InputBudget,
) -> Result<(Picture, Held), PictureError> {
    let header = Header::read(bytes)?;
    let channels = match header.texels {
        Texels::Blocks { has_opacity: true } => 4,
        Texels::Bytes(channels @ (1 | 4)) => channels,
        Texels::Blocks { has_opacity: false } | Texels::Bytes(_) => 3,
    };
    let size = (header.width, header.height);
    let held = hold(size, TexelFormat { channels, depth: Depth::Byte }, budget)?;
    let samples = match header.texels {
        Texels::Blocks { .. } => blocks(bytes, &header, channels, encoding, budget)?,
        Texels::Bytes(count) => plain(bytes, &header, count, budget)?,
    };
    let Header { width, height, .. } = header;
    Ok((Picture { width, height, channels, samples: Samples::Bytes(samples), encoding }, held))
}

/// The texels of blocks.
fn blocks(
    bytes: &[u8],
    header: &Header,
    channels: usize,
    encoding: Encoding,
    budget: &InputBudget,
) -> Result<Vec<u8>, PictureError> {
    let Header { width, height, unpacked, .. } = *header;
    let blocks = width.div_ceil(4) as u64 * height.div_ceil(4) as u64;
    if unpacked > blocks * BLOCK_BYTES {
        return Err(DAMAGED.into());
    }
    let colors = Amount::of::<[u8; 4]>(width * height);
    let of_blocks = Amount(BLOCK_BYTES * blocks);
    let _of_transcoder = budget.hold(TABLES + of_blocks + Amount(unpacked) + colors)?;
    let transcoder = Transcoder::new(bytes).map_err(|_| DAMAGED)?;
    let mut samples = filled(4 * width * height, 0)?;
    let texels = TargetFormat::Rgba32;
    transcoder.transcode_into(0, texels, DecodeFlags::NONE, &mut samples).map_err(|_| DAMAGED)?;
    let samples = Samples::Bytes(samples);
    let mut picture = Picture { width, height, channels: 4, samples, encoding };
    if channels < 4 {
        picture.keep_channels(channels);
    }
    match picture.samples {
        Samples::Bytes(samples) => Ok(samples),
        Samples::Halves(_) | Samples::Floats(_) => Err(DAMAGED.into()),
    }
}

/// The texels of `count` bytes each. Two of them are red and green.
fn plain(
    bytes: &[u8],
    header: &Header,
    count: usize,
    budget: &InputBudget,
) -> Result<Vec<u8>, PictureError> {
    let size = header.width * header.height * count;
    let _of_copy = budget.hold(Amount::of::<u8>(2 * size))?;
    let [start, length] = header.level.map(|it| usize::try_from(it).unwrap_or(usize::MAX));
    let data = bytes.get(start..start.saturating_add(length)).ok_or(DAMAGED)?;
    let mut texels = filled(size, 0)?;
    if header.is_packed {
        let mut decoder = ruzstd::StreamingDecoder::new(data).map_err(|_| DAMAGED)?;
        decoder.read_exact(&mut texels).map_err(|_| DAMAGED)?;
    } else {
        texels.copy_from_slice(data.get(..size).ok_or(DAMAGED)?);
    }
    if count == 2 {
        let pairs = texels.as_chunks::<2>().0;
        return Ok(pairs.iter().flat_map(|[red, green]| [*red, *green, 0]).collect());
    }
    Ok(texels)
}

const SHORT: &str = "it ends within its header";

impl Header {
    /// Reads the start of a file.
    fn read(bytes: &[u8]) -> Result<Header, &'static str> {
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
        const UNKNOWN: &str =
            "its texels are neither compressed by Basis Universal as ETC1S or UASTC nor bytes";
        let texels = match (size(12)?, size(44)?) {
            (9 | 15, 0 | 2) => Texels::Bytes(1),
            (16 | 22, 0 | 2) => Texels::Bytes(2),
            (23 | 29, 0 | 2) => Texels::Bytes(3),
            (37 | 43, 0 | 2) => Texels::Bytes(4),
            (0, _) => Header::blocks(bytes)?.ok_or(UNKNOWN)?,
            _ => return Err(UNKNOWN),
        };
        let level = [long(80).ok_or(SHORT)?, long(88).ok_or(SHORT)?];
        let unpacked = long(96).ok_or(SHORT)?;
        let is_packed = word(44) == Some(2);
        Ok(Header { width, height, texels, level, unpacked, is_packed })
    }

    /// The texels that a descriptor tells; `None` for those of other codecs.
    fn blocks(bytes: &[u8]) -> Result<Option<Texels>, &'static str> {
        let word = |place: usize| -> Option<u32> {
            Some(u32::from_le_bytes(bytes.get(place..place.checked_add(4)?)?.try_into().ok()?))
        };
        let descriptor = word(48).ok_or(SHORT)? as usize;
        let model = *bytes.get(descriptor.saturating_add(12)).ok_or(SHORT)?;
        let channel = *bytes.get(descriptor.saturating_add(31)).ok_or(SHORT)? & 15;
        let has_opacity = match model {
            ETC1S => word(52) == Some(TWO_SAMPLES),
            // All four channels, or red alone with opacity.
            UASTC => matches!(channel, 3 | 5),
            _ => return Ok(None),
        };
        Ok(Some(Texels::Blocks { has_opacity }))
    }
}
