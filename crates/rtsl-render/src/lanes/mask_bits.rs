//! Conversion between masks as bits and the masks of kernels, words of 0 and -1.

use fearless_simd::prelude::*;
use fearless_simd::{Simd, mask32x8, u32x8};
use rtsl::LaneMask as MaskBlock;
use rtsl_bvh::{LANES, LaneMask};
use rtsl_math::SIMD_LANES;

/// Returns the lanes of `lanes` that are in a mask of a packet.
#[inline(always)]
pub fn bits<S: Simd>(simd: S, mask: &MaskBlock, lanes: LaneMask) -> LaneMask {
    let words = mask.words();
    let mut bits = 0;
    for start in (0..LANES).step_by(SIMD_LANES).filter(|start| lanes >> start & 0xFF != 0) {
        let step = u32x8::from_slice(simd, &words[start..start + SIMD_LANES]);
        bits |= (!step.simd_eq(0)).to_bitmask() << start;
    }
    bits & lanes
}

/// Sets all lanes of a mask of a packet.
#[inline(always)]
pub fn set_bits<S: Simd>(simd: S, mask: &mut MaskBlock, lanes: LaneMask) {
    for (index, words) in mask.words_mut().chunks_exact_mut(SIMD_LANES).enumerate() {
        let on = mask32x8::from_bitmask(simd, lanes >> (index * SIMD_LANES) & 0xFF);
        let (all, none) = (u32x8::splat(simd, u32::MAX), u32x8::splat(simd, 0));
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
