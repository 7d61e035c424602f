//! Conversion between masks as bits and the masks of kernels, words of 0 and -1.

use fearless_simd::prelude::*;
use fearless_simd::{Simd, mask32x16, u32x16};
use rtsl::LaneMask as MaskBlock;
use rtsl_bvh::{LANES, LaneMask};

/// The number of lanes that are converted at once.
const STEP: usize = 16;

/// Returns the lanes of `lanes` that are in a mask of a packet.
#[inline(always)]
pub fn bits<S: Simd>(simd: S, mask: &MaskBlock, lanes: LaneMask) -> LaneMask {
    let words = mask.words();
    let mut bits = 0;
    for start in (0..LANES).step_by(STEP).filter(|start| lanes >> start & 0xFFFF != 0) {
        let step = u32x16::from_slice(simd, &words[start..start + STEP]);
        bits |= (!step.simd_eq(0)).to_bitmask() << start;
    }
    bits & lanes
}

/// Sets all lanes of a mask of a packet.
#[inline(always)]
pub fn set_bits<S: Simd>(simd: S, mask: &mut MaskBlock, lanes: LaneMask) {
    for (index, words) in mask.words_mut().chunks_exact_mut(STEP).enumerate() {
        let on = mask32x16::from_bitmask(simd, lanes >> (index * STEP) & 0xFFFF);
        let (all, none) = (u32x16::splat(simd, u32::MAX), u32x16::splat(simd, 0));
        on.select(all, none).store_slice(words);
    }
}

#[cfg(test)]
mod tests {
    use fearless_simd::{Level, dispatch};

    use super::*;

    #[test]
    fn bits_come_back_where_they_are_asked_for() {
        let mut mask = MaskBlock::new(LANES);
        let lanes = 0x8100_0000_00F0_0102;
        dispatch!(Level::new(), simd => set_bits(simd, &mut mask, lanes));
        assert!((0..LANES).all(|lane| mask.get(lane) == (lanes >> lane & 1 != 0)));
        let asked = 0x0100_0000_0030_0102;
        assert_eq!(dispatch!(Level::new(), simd => bits(simd, &mask, asked)), lanes & asked);
    }
}
