//! Samples of a tile's pixels.

use std::ops::Range;

use rtsl_bvh::{LANES, LaneMask};

use super::tile::Tile;

/// Successive samples of the pixels of a tile. They are ordered by pixel, so that the rays of a packet, and those of a
/// vector even more, are close to each other: they often meet the same surfaces.
#[derive(Clone, Copy, Debug)]
pub struct TileSamples {
    /// The tile.
    pub tile: Tile,
    /// The index of the first sample of each pixel.
    pub first: u32,
    /// The number of samples of each pixel, at least 1.
    pub count: u32,
}

/// Returns the packets of samples of some tiles, each with its index among those of its tile.
pub fn packets_of(samples: &[TileSamples]) -> impl Iterator<Item = (&TileSamples, usize)> {
    samples.iter().flat_map(|of| (0..of.packets()).map(move |packet| (of, packet)))
}

impl TileSamples {
    /// Returns the number of packets of samples.
    pub fn packets(&self) -> usize {
        self.count as usize
    }

    /// Returns the pixels of a packet, by their lanes in the tile, each with its lanes in the packet and the first of
    /// its samples there.
    pub fn of_packet(&self, packet: usize) -> impl Iterator<Item = (usize, Range<usize>, u32)> {
        let (first, count) = (self.first, self.count as usize);
        let begun = packet * LANES;
        let pixels = begun / count..(begun + LANES).div_ceil(count);
        pixels.map(move |pixel| {
            let start = (pixel * count).max(begun);
            let end = ((pixel + 1) * count).min(begun + LANES);
            (pixel, start - begun..end - begun, first + (start - pixel * count) as u32)
        })
    }

    /// Returns the pixel and the index of the sample in a lane of a packet: those of [`TileSamples::of_packet`], by
    /// operations that vectors have.
    #[inline(always)]
    pub fn in_lane(&self, packet: usize) -> impl Fn(u32) -> (u32, u32) {
        let (divisor, begun) = (Divisor::new(self.count), (packet * LANES) as u32);
        let TileSamples { first, count, .. } = *self;
        move |lane| {
            let pixel = divisor.quotient(begun + lane);
            (pixel, first + (begun + lane - pixel * count))
        }
    }

    /// Returns the rays of a packet whose pixels lie inside an image of this width and height.
    pub fn lanes(&self, packet: usize, (width, height): (usize, usize)) -> LaneMask {
        let inside = self.tile.lanes(width, height);
        if inside == LaneMask::MAX {
            return inside;
        }
        let pixels = self.of_packet(packet).filter(|(pixel, ..)| inside >> pixel & 1 != 0);
        pixels.flat_map(|(_, lanes, _)| lanes).fold(0, |mask, lane| mask | 1 << lane)
    }
}

/// Division of the indices of a tile's samples by the number of each pixel's.
struct Divisor {
    /// The reciprocal of the divisor, rounded up, times a power of two.
    factor: u32,
}

impl Divisor {
    const BITS: u32 = 24;

    fn new(divisor: u32) -> Self {
        // The error is at most `index / 2^24`, which is less than `1 / divisor` for every index below `LANES * divisor`.
        debug_assert!(
            (LANES as u64 * u64::from(divisor)) * u64::from(divisor) < 1 << Divisor::BITS
        );
        Divisor { factor: (1_u32 << Divisor::BITS).div_ceil(divisor) }
    }

    #[inline(always)]
    fn quotient(&self, index: u32) -> u32 {
        (index * self.factor) >> Divisor::BITS
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_pixel_has_its_samples() {
        for count in [1, 3, 7, 13, 16, 100, 511] {
            let samples = TileSamples { tile: Tile { x: 8, y: 0 }, first: 5, count };
            let mut all = Vec::new();
            for (pixel, lanes, first) in (0..samples.packets()).flat_map(|it| samples.of_packet(it))
            {
                all.extend(lanes.zip(first..).map(|(_, sample)| (pixel, sample)));
            }
            let expected = (0..LANES).flat_map(|pixel| (5..5 + count).map(move |it| (pixel, it)));
            assert!(all.iter().copied().eq(expected), "{count}");
            let by_lane = (0..samples.packets()).flat_map(|packet| {
                let in_lane = samples.in_lane(packet);
                (0..LANES as u32).map(in_lane)
            });
            assert!(by_lane.map(|(pixel, sample)| (pixel as usize, sample)).eq(all), "{count}");
        }
    }

    #[test]
    fn rays_of_pixels_outside_the_image_have_no_lanes() {
        let samples = TileSamples { tile: Tile { x: 8, y: 0 }, first: 0, count: 4 };
        // The image ends after the tile's first column and row.
        assert_eq!(samples.lanes(0, (9, 1)), 0b1111);
        assert_eq!(samples.lanes(1, (9, 1)), 0);
        assert_eq!(samples.lanes(3, (16, 8)), LaneMask::MAX);
    }
}
