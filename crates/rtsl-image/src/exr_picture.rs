//! Pictures of EXR files. The crate `exr` reads headers and decompresses blocks; what it trusts is checked here before:
//! how large the picture and its blocks are, that blocks lie within the file, and what blocks of DWA compression say of
//! themselves. It allocates by these numbers, and an allocation that fails ends the process.

use std::io::{Cursor, Read};
use std::panic::{AssertUnwindSafe, catch_unwind};

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
use rtsl_memory::{Amount, Held, InputBudget, filled};

use super::picture::{Picture, PictureError, check_size};

/// No header is longer: small pictures for file managers are in it. What its attributes take in memory is more than
/// their bytes, but no more than so many times.
const MAX_HEADER_BYTES: u64 = 4 << 20;
const HEADER_EXPANSION: usize = 32;

/// What decompressing a block takes at most, in sizes of the block: DWA turns half floats into floats, and holds
/// blocks of coefficients besides.
const BLOCK_EXPANSION: usize = 12;

/// Reads the first part of a file that has red, green and blue, at its greatest resolution.
pub fn read_exr(bytes: &[u8], budget: &InputBudget) -> Result<(Picture, Held), PictureError> {
    let header_memory = Amount(MAX_HEADER_BYTES.min(bytes.len() as u64)).times(HEADER_EXPANSION);
    let of_header = budget.hold(header_memory)?;
    let (meta_data, tables) = guarded(|| read_header(bytes))?;
    let (layer, header, colors) = meta_data
        .headers
        .iter()
        .enumerate()
        .find_map(|(layer, header)| Some((layer, header, Colors::of(header)?)))
        .ok_or("it has no red, green and blue channels of one resolution")?;
    let Vec2(width, height) = header.layer_size;
    check_size(width, height)?;
    let held = budget.hold(Picture::memory(width, height))?;
    let mut picture =
        Picture { width, height, texels: filled(width * height, [0.0, 0.0, 0.0, 1.0])? };
    let blocks = Blocks { bytes, meta_data: &meta_data, layer, header };
    let group = blocks.group(budget)?;
    let offsets = blocks.offsets(tables)?;
    for offsets in offsets.chunks(8 * group.count) {
        let decoded: Vec<_> = offsets
            .as_chunks()
            .0
            .par_iter()
            .map(|at| blocks.decode(u64::from_le_bytes(*at)))
            .collect();
        for block in decoded {
            if let Some(block) = block? {
                colors.copy(&block, &mut picture);
            }
        }
    }
    drop((of_header, group));
    Ok((picture, held))
}

/// The header, and where the tables of offsets begin.
fn read_header(bytes: &[u8]) -> Result<(MetaData, usize), PictureError> {
    let mut cursor = Cursor::new(bytes);
    let meta_data = MetaData::read_from_buffered(cursor.by_ref().take(MAX_HEADER_BYTES), false)?;
    MetaData::validate(&meta_data.headers, false)?;
    Ok((meta_data, cursor.position() as usize))
}

/// Calls the library, some of whose checks are assertions: a file that fails them is malformed as others are.
fn guarded<T>(call: impl FnOnce() -> Result<T, PictureError>) -> Result<T, PictureError> {
    let damaged = |_| Err("it is damaged".into());
    catch_unwind(AssertUnwindSafe(call)).unwrap_or_else(damaged)
}

/// The compressed blocks of a part.
struct Blocks<'a> {
    bytes: &'a [u8],
    meta_data: &'a MetaData,
    layer: usize,
    header: &'a Header,
}

/// Blocks that are decoded at a time, and their memory.
struct Group {
    count: usize,
    _held: Held,
}

impl<'a> Blocks<'a> {
    /// The columns and rows of a block, none of which lie outside the part.
    fn block_size(&self) -> (usize, usize) {
        let (Vec2(width, height), Vec2(columns, rows)) =
            (self.header.layer_size, self.header.max_block_pixel_size());
        (columns.min(width), rows.min(height))
    }

    /// As many blocks as there are threads, or as there is memory for.
    fn group(&self, budget: &InputBudget) -> Result<Group, PictureError> {
        let (columns, rows) = self.block_size();
        // A channel of DWA takes whole squares of 8 by 8.
        let pixels = columns.next_multiple_of(8).saturating_mul(rows.next_multiple_of(8));
        let block = Amount(pixels as u64).times(self.header.channels.bytes_per_pixel);
        let each = block.times(BLOCK_EXPANSION);
        let threads = rayon::current_num_threads();
        let several = budget.branch().hold(each.times(threads)).is_ok();
        let count = if several { threads } else { 1 };
        Ok(Group { count, _held: budget.hold(each.times(count))? })
    }

    /// The part's table of offsets, as bytes.
    fn offsets(&self, tables: usize) -> Result<&'a [u8], PictureError> {
        let of = |header: &Header| header.chunk_count.saturating_mul(8);
        let before = self.meta_data.headers[..self.layer].iter().map(of);
        let start = before.fold(tables, usize::saturating_add);
        let table = self.bytes.get(start..start.saturating_add(of(self.header)));
        table.ok_or_else(|| "it ends within its table of offsets".into())
    }

    /// Decodes the block at an offset; `None` where it is of a smaller resolution.
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

    /// The block at an offset, as it stands in the file; `None` in place of one that does not lie within it.
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

    /// Blocks of DWA begin with eleven counters, by some of which the library allocates: how many bytes parts of the
    /// block have when they are inflated, and how many coefficients there are. None has more than twice the bytes of
    /// the whole squares of the block.
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
        // What would not have become smaller stands there as it is, without counters.
        if bytes.len() == columns * rows * pixel {
            return Ok(());
        }
        let squares = columns.next_multiple_of(8) * rows.next_multiple_of(8);
        let most = (2 * squares * pixel + 4096) as u64;
        let counters = counters.as_chunks::<8>().0;
        let sizes = BYTES.map(|at| (at, 1)).into_iter().chain(COEFFICIENTS.map(|at| (at, 2)));
        for (at, each) in sizes {
            if u64::from_le_bytes(counters[at]).saturating_mul(each) > most {
                return Err("a block says that it has more than the picture".into());
            }
        }
        Ok(())
    }
}

/// Where the numbers of a pixel lie in a row of a block: channel after channel, each with all its columns.
struct Colors {
    bytes_per_pixel: usize,
    /// Red, green, blue and opacity, of which the last may be missing.
    channels: [Option<Channel>; 4],
}

struct Channel {
    /// The bytes of the channels before, for one pixel.
    offset: usize,
    kind: SampleType,
}

impl Colors {
    /// Those of a part that has red, green and blue, and no channel of fewer pixels.
    fn of(header: &Header) -> Option<Self> {
        let list = &header.channels.list;
        if list.iter().any(|channel| channel.sampling != Vec2(1, 1)) {
            return None;
        }
        let size = |channel: &ChannelDescription| channel.sample_type.bytes_per_sample();
        let find = |name: &str| {
            let place = list.iter().position(|channel| channel.name == *name)?;
            let offset = list[..place].iter().map(size).sum();
            Some(Channel { offset, kind: list[place].sample_type })
        };
        let channels = ["R", "G", "B", "A"].map(find);
        let is_complete = channels[..3].iter().all(Option::is_some);
        is_complete.then_some(Colors { bytes_per_pixel: header.channels.bytes_per_pixel, channels })
    }

    /// Copies the pixels of a block to their place.
    fn copy(&self, block: &UncompressedBlock, picture: &mut Picture) {
        let Vec2(x, y) = block.index.pixel_position;
        let Vec2(columns, _) = block.index.pixel_size;
        let rows = block.data.chunks_exact((columns * self.bytes_per_pixel).max(1));
        for (row, bytes) in rows.enumerate() {
            let start = (y + row) * picture.width + x;
            let Some(texels) = picture.texels.get_mut(start..start + columns) else { continue };
            for (component, channel) in self.channels.iter().enumerate() {
                if let Some(channel) = channel {
                    channel.copy(&bytes[columns * channel.offset..], texels, component);
                }
            }
        }
    }
}

impl Channel {
    /// Copies a number to a component of each texel; what is not finite is black.
    fn copy(&self, bytes: &[u8], texels: &mut [[f32; 4]], component: usize) {
        let finite = |value: f32| if value.is_finite() { value } else { 0.0 };
        let targets = texels.iter_mut().map(|texel| &mut texel[component]);
        let (twos, fours) = (bytes.as_chunks().0.iter(), bytes.as_chunks().0.iter());
        match self.kind {
            SampleType::F16 => {
                let pairs = targets.zip(twos);
                pairs.for_each(|(target, it)| *target = finite(f16::from_ne_bytes(*it).to_f32()));
            }
            SampleType::F32 => {
                let pairs = targets.zip(fours);
                pairs.for_each(|(target, it)| *target = finite(f32::from_ne_bytes(*it)));
            }
            SampleType::U32 => {
                let pairs = targets.zip(fours);
                pairs.for_each(|(target, it)| *target = u32::from_ne_bytes(*it) as f32);
            }
        }
    }
}
