//! Extents of bounding boxes, from which rounding errors of hits are bounded.

use rtsl_bvh::Bounds;

/// The side lengths of a box, rounded up to powers of two, in four bytes, because meshes have one for each face.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Extent([u8; 4]);

impl Extent {
    /// The extent of a box; infinite for unbounded shapes.
    fn of(bounds: Option<Bounds>) -> Self {
        let Some(Bounds { min, max }) = bounds else { return Extent::default() };
        let [x, y, z] = [0, 1, 2].map(|axis: usize| exponent_above(max[axis] - min[axis]));
        Extent([x, y, z, 0])
    }

    /// Returns the side lengths.
    #[inline(always)]
    pub fn lengths(self) -> [f32; 3] {
        let [x, y, z, _] = self.0;
        [x, y, z].map(|exponent| f32::from_bits(u32::from(exponent) << MANTISSA_BITS))
    }
}

const MANTISSA_BITS: u32 = f32::MANTISSA_DIGITS - 1;

/// The biased exponent of the least power of two that is not less than a number, which is not negative; 0 for 0.
fn exponent_above(length: f32) -> u8 {
    const BELOW_ONE: u32 = (1 << MANTISSA_BITS) - 1;
    (length.to_bits().saturating_add(BELOW_ONE) >> MANTISSA_BITS).min(254) as u8
}

/// The extents of all objects, or of their elements, in the spaces of their groups.
#[derive(Clone, Debug, Default)]
pub struct Extents {
    extents: Vec<Extent>,
    /// For each object the index of its own extent, or that of its first element.
    first: Vec<u32>,
}

impl Extents {
    /// Computes the extents of the boxes of each object, or of its elements.
    pub fn new(bounds: &[Vec<Option<Bounds>>]) -> Self {
        let mut all = Extents::default();
        for bounds in bounds {
            all.first.push(all.extents.len() as u32);
            all.extents.extend(bounds.iter().map(|bounds| Extent::of(*bounds)));
        }
        all
    }

    /// Returns the side lengths of an object's box, or of its element's.
    #[inline(always)]
    pub fn lengths(&self, object: u32, element: u32) -> [f32; 3] {
        let index = self.first[object as usize] as usize + element as usize;
        self.extents.get(index).copied().unwrap_or_default().lengths()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn lengths(of: [f32; 3]) -> [f32; 3] {
        Extent::of(Bounds::new([0.0; 3], of)).lengths()
    }

    #[test]
    fn lengths_are_rounded_up_to_powers_of_two() {
        assert_eq!(lengths([0.0, 1.0, 1.1]), [0.0, 1.0, 2.0]);
        assert_eq!(lengths([1e-3, 8.0, 1e17]), [1.0 / 512.0, 8.0, 144_115_188_075_855_872.0]);
        let tiny = lengths([1e-44; 3]);
        assert!(tiny[0] >= 1e-44 && tiny[0] < 1e-37);
        assert_eq!(Extent::of(None).lengths(), [0.0; 3]);
    }

    #[test]
    fn elements_have_their_own() {
        let bounds = |length: f32| Bounds::new([0.0; 3], [length; 3]);
        let extents = Extents::new(&[vec![bounds(1.0)], vec![], vec![bounds(2.0), bounds(4.0)]]);
        assert_eq!(extents.lengths(0, 0), [1.0; 3]);
        assert_eq!(extents.lengths(2, 0), [2.0; 3]);
        assert_eq!(extents.lengths(2, 1), [4.0; 3]);
    }
}
