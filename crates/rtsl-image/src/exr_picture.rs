//! The reader of EXR pictures. The crate `exr` parses headers and decompresses blocks. It allocates memory by numbers
//! in the file, and a failed allocation aborts the process, so this module checks these numbers first: the size of the
//! picture and of its blocks, that blocks lie within the file, and the counters in blocks of DWA compression.

use std::io::{Cursor, Read};

use exr::block::UncompressedBlock;
use exr::block::chunk::{
    Chunk, CompressedBlock, CompressedScanLineBlock, CompressedTileBlock, TileCoordinates,
};
use exr::compression::Compression;
use exr::math::Vec2;
use exr::meta::attribute::{ChannelDescription, SampleType};
use exr::meta::header::Header;
use exr::meta::{BlockDescription, MetaData};
use exr::prelude::f16;
use rayon::prelude::*;
use rtsl_memory::{Amount, Held, InputBudget, filled, on_all_processors};

use super::encoding::Encoding;
use super::guarded::guarded;
use super::picture::{Picture, PictureError, Samples};
use super::picture_file::hold;
use super::texel_format::{Depth, TexelFormat};

/// The greatest length of a header, which may contain thumbnails. The parsed attributes take a limited multiple of
/// their bytes.
const MAX_HEADER_BYTES: u64 = 4 << 20;
const HEADER_EXPANSION: usize = 32;

/// The memory for decompressing a block, as a multiple of its size: DWA converts half floats to floats, and also stores
/// blocks of coefficients.
const BLOCK_EXPANSION: usize = 12;

/// Reads a part of a file at its full resolution: the first that has red, green and blue, on their own or in a named
/// layer, else the first that has a luminance `Y` or a single channel.
pub fn read_exr(bytes: &[u8], budget: &InputBudget) -> Result<(Picture, Held), PictureError> {
    let header_memory = Amount(MAX_HEADER_BYTES.min(bytes.len() as u64)).times(HEADER_EXPANSION);
    let of_header = budget.hold(header_memory)?;
    let (meta_data, tables) = guarded(|| read_header(bytes))?;
    let find = |choose: fn(&Header) -> Option<Channels>| {
        let parts = meta_data.headers.iter().enumerate();
        parts.into_iter().find_map(|(layer, header)| Some((layer, header, choose(header)?)))
    };
    let (layer, header, channels) = find(Channels::colors)
        .or_else(|| find(Channels::grey))
        .ok_or("it has neither red, green and blue of one resolution nor a single channel")?;
    let Vec2(width, height) = header.layer_size;
    let held = hold((width, height), channels.format(), budget)?;
    let numbers = width * height * channels.list.len();
    let samples = match channels.format().depth {
        Depth::Half => Samples::Halves(filled(numbers, f16::ZERO)?),
        Depth::Byte | Depth::Float => Samples::Floats(filled(numbers, 0.0)?),
    };
    let (encoding, count) = (Encoding::Linear, channels.list.len());
    let mut picture = Picture { width, height, channels: count, samples, encoding };
    let blocks = Blocks { bytes, meta_data: &meta_data, layer, header };
    let group = blocks.group(budget)?;
    let offsets = blocks.offsets(tables)?;
    for offsets in offsets.chunks(8 * group.count) {
        let offsets = offsets.as_chunks().0;
        let decode = |at: &[u8; 8]| blocks.decode(u64::from_le_bytes(*at));
        let decoded: Vec<_> = on_all_processors(|| offsets.par_iter().map(decode).collect());
        for block in decoded {
            if let Some(block) = block? {
                channels.copy(&block, &mut picture);
            }
        }
    }
    drop((of_header, group));
    Ok((picture, held))
}

/// Returns the header and the position of the offset tables.
fn read_header(bytes: &[u8]) -> Result<(MetaData, usize), PictureError> {
    let mut cursor = Cursor::new(bytes);
    let meta_data = MetaData::read_from_buffered(cursor.by_ref().take(MAX_HEADER_BYTES), false)?;
    MetaData::validate(&meta_data.headers, false)?;
    Ok((meta_data, cursor.position() as usize))
}

/// The compressed blocks of a part.
struct Blocks<'a> {
    bytes: &'a [u8],
    meta_data: &'a MetaData,
    layer: usize,
    header: &'a Header,
}

/// A number of blocks that are decoded together, and their memory.
struct Group {
    count: usize,
    _held: Held,
}

impl<'a> Blocks<'a> {
    /// Returns the columns and rows of a block, none of which lie outside the part.
    fn block_size(&self) -> (usize, usize) {
        let (Vec2(width, height), Vec2(columns, rows)) =
            (self.header.layer_size, self.header.max_block_pixel_size());
        (columns.min(width), rows.min(height))
    }

    /// Returns a group of as many blocks as there are threads, or as fit the memory budget.
    fn group(&self, budget: &InputBudget) -> Result<Group, PictureError> {
        let (columns, rows) = self.block_size();
        // DWA channels are stored in whole squares of 8 by 8 pixels.
        let pixels = columns.next_multiple_of(8).saturating_mul(rows.next_multiple_of(8));
        let block = Amount(pixels as u64).times(self.header.channels.bytes_per_pixel);
        let each = block.times(BLOCK_EXPANSION);
        let threads = on_all_processors(rayon::current_num_threads);
        let several = budget.branch().hold(each.times(threads)).is_ok();
        let count = if several { threads } else { 1 };
        Ok(Group { count, _held: budget.hold(each.times(count))? })
    }

    /// Returns the part's offset table as bytes.
    fn offsets(&self, tables: usize) -> Result<&'a [u8], PictureError> {
        let of = |header: &Header| header.chunk_count.saturating_mul(8);
        let before = self.meta_data.headers[..self.layer].iter().map(of);
        let start = before.fold(tables, usize::saturating_add);
        let table = self.bytes.get(start..start.saturating_add(of(self.header)));
        table.ok_or_else(|| "it ends within its table of offsets".into())
    }

    /// Decodes the block at an offset; returns `None` for a block of a lower resolution.
    fn decode(&self, offset: u64) -> Result<Option<UncompressedBlock>, PictureError> {
        let Some(block) = self.compressed(offset).ok_or("it ends within a block")? else {
            return Ok(None);
        };
        guarded(|| {
            self.check_counters(&block)?;
            let chunk = Chunk { layer_index: self.layer, compressed_block: block };
            Ok(Some(UncompressedBlock::decompress_chunk(chunk, self.meta_data, false)?))
        })
    }

    /// Returns the compressed block at an offset; `None` if it does not lie within the file.
    fn compressed(&self, offset: u64) -> Option<Option<CompressedBlock>> {
        let mut rest = self.bytes.get(usize::try_from(offset).ok()?..)?;
        let mut number = || {
            let (bytes, after) = rest.split_first_chunk::<4>()?;
            rest = after;
            Some(i32::from_le_bytes(*bytes))
        };
        if self.meta_data.requirements.has_multiple_layers {
            number().filter(|layer| usize::try_from(*layer) == Ok(self.layer))?;
        }
        let mut index = || number().and_then(|number| usize::try_from(number).ok());
        let place = match self.header.blocks {
            BlockDescription::ScanLines => None,
            BlockDescription::Tiles(_) => {
                let tile_index = Vec2(index()?, index()?);
                Some(TileCoordinates { tile_index, level_index: Vec2(index()?, index()?) })
            }
        };
        let y_coordinate = if place.is_none() { number()? } else { 0 };
        let length = usize::try_from(number()?).ok()?;
        let compressed_pixels_le = rest.get(..length)?;
        if place.is_some_and(|place| place.level_index != Vec2(0, 0)) {
            return Some(None);
        }
        let compressed_pixels_le = compressed_pixels_le.to_vec();
        Some(Some(match place {
            Some(coordinates) => {
                CompressedBlock::Tile(CompressedTileBlock { coordinates, compressed_pixels_le })
            }
            None => CompressedBlock::ScanLine(CompressedScanLineBlock {
                y_coordinate,
                compressed_pixels_le,
            }),
        }))
    }

    /// Checks the eleven counters at the start of a DWA block, by some of which the library allocates memory: the
    /// inflated sizes of parts of the block and the number of coefficients. None may exceed twice the bytes of the
    /// block rounded up to whole squares.
    fn check_counters(&self, block: &CompressedBlock) -> Result<(), PictureError> {
        const BYTES: [usize; 3] = [1, 6, 7];
        const COEFFICIENTS: [usize; 2] = [8, 9];
        let is_dwa = matches!(self.header.compression, Compression::DWAA(_) | Compression::DWAB(_));
        let (CompressedBlock::ScanLine(CompressedScanLineBlock {
            compressed_pixels_le: bytes,
            ..
        })
        | CompressedBlock::Tile(CompressedTileBlock { compressed_pixels_le: bytes, .. })) = block
        else {
            return Ok(());
        };
        let Some(counters) = bytes.get(..88).filter(|_| is_dwa) else { return Ok(()) };
        let place = self.header.get_block_data_indices(block)?;
        let Vec2(columns, rows) = self.header.get_absolute_block_pixel_coordinates(place)?.size;
        let pixel = self.header.channels.bytes_per_pixel;
        // A block that compression would not shrink is stored uncompressed, without counters.
        if bytes.len() == columns * rows * pixel {
            return Ok(());
        }
        let squares = columns.next_multiple_of(8) * rows.next_multiple_of(8);
        let most = (2 * squares * pixel + 4096) as u64;
        let counters = counters.as_chunks::<8>().0;
        let sizes = BYTES.map(|at| (at, 1)).into_iter().chain(COEFFICIENTS.map(|at| (at, 2)));
        for (at, each) in sizes {
            if u64::from_le_bytes(counters[at]).saturating_mul(each) > most {
                return Err("a block claims to be larger than the picture".into());
            }
        }
        Ok(())
    }
}

/// The positions of a pixel's numbers in a row of a block, which stores channel after channel, each with all columns.
struct Channels {
    bytes_per_pixel: usize,
    /// Grey; or red, green and blue, and opacity if there is some.
    list: Vec<Channel>,
}

#[derive(Clone, Copy)]
struct Channel {
    /// The bytes of the preceding channels for one pixel.
    offset: usize,
    kind: SampleType,
}

impl Channels {
    /// Returns red, green and blue, and opacity if there is some, of a part without subsampled channels: those without
    /// the name of a layer, else those of the first layer that has them.
    fn colors(header: &Header) -> Option<Self> {
        let named = named_channels(header)?;
        let layers = std::iter::once("").chain(named.iter().filter_map(|(name, _)| layer(name)));
        let mut found = layers.filter_map(|layer| {
            let find = |name: &str| {
                let full = |other: &str| other.strip_prefix(layer) == Some(name);
                named.iter().find(|(other, _)| full(other)).map(|(_, channel)| *channel)
            };
            let mut list = ["R", "G", "B"].map(find).into_iter().collect::<Option<Vec<_>>>()?;
            list.extend(find("A"));
            Some(list)
        });
        Some(Channels { bytes_per_pixel: header.channels.bytes_per_pixel, list: found.next()? })
    }

    /// Returns the luminance of a part without subsampled channels, or its only channel.
    fn grey(header: &Header) -> Option<Self> {
        let named = named_channels(header)?;
        let is_luminance = |name: &str| name == "Y" || name.ends_with(".Y");
        let (_, only) = named.iter().find(|(name, _)| is_luminance(name) || named.len() == 1)?;
        let bytes_per_pixel = header.channels.bytes_per_pixel;
        Some(Channels { bytes_per_pixel, list: vec![*only] })
    }

    fn format(&self) -> TexelFormat {
        let halves = self.list.iter().all(|channel| channel.kind == SampleType::F16);
        let depth = if halves { Depth::Half } else { Depth::Float };
        TexelFormat { channels: self.list.len(), depth }
    }

    /// Copies the pixels of a block to the picture.
    fn copy(&self, block: &UncompressedBlock, picture: &mut Picture) {
        let Vec2(x, y) = block.index.pixel_position;
        let Vec2(columns, _) = block.index.pixel_size;
        let rows = block.data.chunks_exact((columns * self.bytes_per_pixel).max(1));
        let count = self.list.len();
        for (row, bytes) in rows.enumerate() {
            let start = ((y + row) * picture.width + x) * count;
            let place = start..start + columns * count;
            for (index, channel) in self.list.iter().enumerate() {
                let bytes = &bytes[columns * channel.offset..];
                match &mut picture.samples {
                    Samples::Halves(halves) => {
                        let Some(line) = halves.get_mut(place.clone()) else { continue };
                        copy_halves(bytes, line.iter_mut().skip(index).step_by(count));
                    }
                    Samples::Floats(floats) => {
                        let Some(line) = floats.get_mut(place.clone()) else { continue };
                        channel.copy(bytes, line.iter_mut().skip(index).step_by(count));
                    }
                    Samples::Bytes(_) => {}
                }
            }
        }
    }
}

/// The channels of a part with their names; `None` if some are subsampled.
fn named_channels(header: &Header) -> Option<Vec<(String, Channel)>> {
    let list = &header.channels.list;
    if list.iter().any(|channel| channel.sampling != Vec2(1, 1)) {
        return None;
    }
    let mut offset = 0;
    let channels = list.iter().map(|channel: &ChannelDescription| {
        let kind = channel.sample_type;
        let here = Channel { offset, kind };
        offset += kind.bytes_per_sample();
        (channel.name.to_string(), here)
    });
    Some(channels.collect())
}

/// The name of a channel's layer, with its point.
fn layer(channel: &str) -> Option<&str> {
    channel.rfind('.').map(|point| &channel[..=point])
}

/// Copies halves.
fn copy_halves<'t>(bytes: &[u8], targets: impl Iterator<Item = &'t mut f16>) {
    for (target, pair) in targets.zip(bytes.as_chunks().0) {
        *target = f16::from_ne_bytes(*pair);
    }
}

impl Channel {
    /// Copies a channel as floats.
    fn copy<'t>(self, bytes: &[u8], targets: impl Iterator<Item = &'t mut f32>) {
        let (twos, fours) = (bytes.as_chunks().0.iter(), bytes.as_chunks().0.iter());
        match self.kind {
            SampleType::F16 => {
                let pairs = targets.zip(twos);
                pairs.for_each(|(target, it)| *target = f16::from_ne_bytes(*it).to_f32());
            }
            SampleType::F32 => {
                let pairs = targets.zip(fours);
                pairs.for_each(|(target, it)| *target = f32::from_ne_bytes(*it));
            }
            SampleType::U32 => {
                let pairs = targets.zip(fours);
                pairs.for_each(|(target, it)| *target = u32::from_ne_bytes(*it) as f32);
            }
        }
    }
}
