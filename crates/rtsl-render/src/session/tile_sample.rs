//! One sample of every pixel of a tile, and sums of such samples.

use rtsl_bvh::{LANES, LaneMask, Lanes, lanes_of};

/// One sample of every pixel of a tile.
pub struct TileSample {
    /// The lanes whose pixels lie inside the image.
    pub lanes: LaneMask,
    /// The colour of each; may be infinite or NaN.
    pub colors: [Lanes; 3],
}

/// Sums of the samples of a tile's pixels.
pub type TileSums = [[f64; 3]; LANES];

/// Returns the mean of a pixel from the sum of so many samples.
pub fn mean(sum: [f64; 3], taken: u32) -> [f32; 3] {
    sum.map(|channel| (channel / f64::from(taken)) as f32)
}

impl TileSample {
    /// Adds the colours that are finite, and returns the lanes of the others, which count as black.
    pub fn add_to(&self, sums: &mut TileSums) -> LaneMask {
        let mut dropped = 0;
        for lane in lanes_of(self.lanes) {
            let color = [0, 1, 2].map(|channel: usize| self.colors[channel][lane]);
            if color.iter().all(|channel| channel.is_finite()) {
                (0..3).for_each(|channel| sums[lane][channel] += f64::from(color[channel]));
            } else {
                dropped |= 1 << lane;
            }
        }
        dropped
    }
}
