//! Tiles of an image.

use rtsl_bvh::{LANES, LaneMask};

/// The side of a tile in pixels: a packet is one sample of each of its pixels.
pub const TILE: usize = 8;

/// A tile of the image. Lanes follow a Z-order curve through its pixels, so that the lanes of one vector, of any width,
/// are close to square: adjacent pixels often hit the same object.
#[derive(Clone, Copy, Debug)]
pub struct Tile {
    /// Its first column.
    pub x: usize,
    /// Its first row, from the top.
    pub y: usize,
}

impl Tile {
    /// The column and the row of each lane's pixel, from the tile's first.
    pub const PLACES: [[u32; 2]; LANES] = {
        let mut places = [[0; 2]; LANES];
        let mut lane = 0;
        while lane < LANES {
            places[lane] = Tile::place(lane as u32);
            lane += 1;
        }
        places
    };

    /// Returns the column and the row of a lane's pixel, from the tile's first.
    #[inline(always)]
    pub const fn place(lane: u32) -> [u32; 2] {
        [every_other_bit(lane), every_other_bit(lane >> 1)]
    }

    /// Returns the pixel of a lane.
    pub fn pixel(&self, lane: usize) -> (usize, usize) {
        let [x, y] = Tile::place(lane as u32);
        (self.x + x as usize, self.y + y as usize)
    }

    /// Returns the lane of the pixel (x, y) in its tile.
    pub fn lane(x: usize, y: usize) -> usize {
        let spread = |place: usize| place & 1 | (place & 2) << 1 | (place & 4) << 2;
        spread(x) | spread(y) << 1
    }

    /// Returns the lanes whose pixels lie inside the image.
    pub fn lanes(&self, width: usize, height: usize) -> LaneMask {
        if self.x + TILE <= width && self.y + TILE <= height {
            return LaneMask::MAX;
        }
        let inside = |lane: &usize| {
            let (x, y) = self.pixel(*lane);
            x < width && y < height
        };
        (0..LANES).filter(inside).fold(0, |mask, lane| mask | 1 << lane)
    }
}

/// Bits 0, 2 and 4 of a lane, adjacent.
#[inline(always)]
const fn every_other_bit(lane: u32) -> u32 {
    lane & 1 | lane >> 1 & 2 | lane >> 2 & 4
}

/// Returns the tiles of an image, row by row from the top.
pub fn tiles_of(width: usize, height: usize) -> Vec<Tile> {
    let rows = (0..height).step_by(TILE);
    rows.flat_map(|y| (0..width).step_by(TILE).map(move |x| Tile { x, y })).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_pixel_has_a_lane() {
        let tile = Tile { x: 16, y: 8 };
        for lane in 0..LANES {
            let (x, y) = tile.pixel(lane);
            assert_eq!(Tile::lane(x, y), lane);
        }
        assert_eq!((tile.pixel(1), tile.pixel(2), tile.pixel(63)), ((17, 8), (16, 9), (23, 15)));
    }
}
