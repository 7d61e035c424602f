//! Eight lanes of a packet at a time, in registers.
//!
//! Computations for a packet outside of kernels process eight lanes at a time in one loop with all steps in its body:
//! code stays short, and only results go through memory. The operations are those of the functions for one vector, in
//! the same order, so that the bits are the same.

use fearless_simd::prelude::*;
use fearless_simd::{Simd, f32x8, mask32x8};
use rtsl::LaneBlock;
use rtsl_bvh::Lanes;
use rtsl_math::{Affine, SIMD_LANES, USUAL_SQUARES};

/// A vector for each lane, component by component.
pub type LaneVectors = [Lanes; 3];

/// A vector for each of eight lanes.
pub type Vectors<S> = [f32x8<S>; 3];

/// Eight lanes.
#[derive(Clone, Copy)]
pub struct Eight<S: Simd> {
    simd: S,
    /// The first lane.
    start: usize,
}

/// Iterates over the groups of eight that contain the first `count` of any number of lanes, a multiple of eight; all
/// others are unused. Masks of a packet do not apply to them.
#[inline(always)]
pub fn eights_of<S: Simd>(simd: S, count: usize) -> FirstEights<S> {
    FirstEights { simd, start: 0, count }
}

/// See [`eights_of`].
pub struct FirstEights<S> {
    simd: S,
    /// The first lane not processed yet.
    start: usize,
    count: usize,
}

impl<S: Simd> Iterator for FirstEights<S> {
    type Item = Eight<S>;

    #[inline(always)]
    fn next(&mut self) -> Option<Eight<S>> {
        let FirstEights { simd, start, count } = *self;
        self.start += SIMD_LANES;
        (start < count).then_some(Eight { simd, start })
    }
}

impl<S: Simd> Eight<S> {
    /// Returns the SIMD instruction set.
    #[inline(always)]
    pub fn simd(self) -> S {
        self.simd
    }

    /// Returns the first lane.
    #[inline(always)]
    pub fn start(self) -> usize {
        self.start
    }

    /// Returns a vector with the same number in all lanes.
    #[inline(always)]
    pub fn splat(self, x: f32) -> f32x8<S> {
        f32x8::splat(self.simd, x)
    }

    /// Returns the same vector in all lanes.
    #[inline(always)]
    pub fn splat_vector(self, [x, y, z]: [f32; 3]) -> Vectors<S> {
        [self.splat(x), self.splat(y), self.splat(z)]
    }

    /// Loads the lanes' numbers.
    #[inline(always)]
    pub fn floats(self, lanes: &[f32]) -> f32x8<S> {
        f32x8::from_slice(self.simd, &lanes[self.start..self.start + SIMD_LANES])
    }

    /// Loads the lanes' vectors.
    #[inline(always)]
    pub fn vectors<const N: usize>(self, [x, y, z]: &[[f32; N]; 3]) -> Vectors<S> {
        [self.floats(x), self.floats(y), self.floats(z)]
    }

    /// Loads the numbers of a component of a block.
    #[inline(always)]
    pub fn load(self, block: &LaneBlock, component: usize) -> f32x8<S> {
        f32x8::load_array_ref(self.simd, block.floats_at(component, self.start))
    }

    /// Loads the vectors that start at a component of a block.
    #[inline(always)]
    pub fn load_vectors(self, block: &LaneBlock, first: usize) -> Vectors<S> {
        let [x, y, z] = block.vectors_at::<3, SIMD_LANES>(first, self.start);
        let load = |floats| f32x8::load_array_ref(self.simd, floats);
        [load(x), load(y), load(z)]
    }

    /// Stores the numbers in a component of a block.
    #[inline(always)]
    pub fn store(self, block: &mut LaneBlock, component: usize, value: f32x8<S>) {
        *block.floats_mut_at(component, self.start) = value.to_array();
    }

    /// Stores the vectors, starting at a component of a block.
    #[inline(always)]
    pub fn store_vectors(self, block: &mut LaneBlock, first: usize, value: &Vectors<S>) {
        let arrays = block.vectors_mut_at::<3, SIMD_LANES>(first, self.start);
        for (to, value) in arrays.into_iter().zip(value) {
            *to = value.to_array();
        }
    }

    /// Stores the lanes' numbers.
    #[inline(always)]
    pub fn put(self, value: f32x8<S>, to: &mut [f32]) {
        value.store_slice(&mut to[self.start..self.start + SIMD_LANES]);
    }

    /// Stores the lanes' vectors.
    #[inline(always)]
    pub fn put_vectors<const N: usize>(self, value: &Vectors<S>, to: &mut [[f32; N]; 3]) {
        self.put(value[0], &mut to[0]);
        self.put(value[1], &mut to[1]);
        self.put(value[2], &mut to[2]);
    }

    /// Applies [`normalize_or`](rtsl_math::normalize_or) to each.
    #[inline(always)]
    pub fn normalized_or(self, v: &Vectors<S>, otherwise: &Vectors<S>) -> Vectors<S> {
        let square = dots(v, v);
        let usual = square.simd_ge(self.splat(*USUAL_SQUARES.start()))
            & square.simd_le(self.splat(*USUAL_SQUARES.end()));
        let factor = self.splat(1.0) / square.sqrt();
        let normalized = scaled(v, factor);
        if usual.to_bitmask() == 0xFF {
            return normalized;
        }
        select(usual, &normalized, &self.normalized_by_parts(v, otherwise))
    }

    /// The same for vectors whose squared lengths would overflow or underflow.
    #[inline(always)]
    fn normalized_by_parts(self, v: &Vectors<S>, otherwise: &Vectors<S>) -> Vectors<S> {
        let largest = larger(larger(v[0].abs(), v[1].abs()), v[2].abs());
        let scaled = [v[0] / largest, v[1] / largest, v[2] / largest];
        let length = dots(&scaled, &scaled).sqrt();
        // A vector has no direction if a component is NaN or infinite, or all are 0: NaN fails the comparison.
        let has_length =
            length.simd_ge(self.splat(1.0)) & largest.simd_lt(self.splat(f32::INFINITY));
        let normalized = [scaled[0] / length, scaled[1] / length, scaled[2] / length];
        select(has_length, &normalized, otherwise)
    }

    /// Applies `Affine::point` to each.
    #[inline(always)]
    pub fn point(self, map: &Affine, p: &Vectors<S>) -> Vectors<S> {
        let v = self.vector(map, p);
        let origin = &map.columns[3];
        [v[0] + origin[0], v[1] + origin[1], v[2] + origin[2]]
    }

    /// Applies `Affine::vector` to each.
    #[inline(always)]
    pub fn vector(self, map: &Affine, v: &Vectors<S>) -> Vectors<S> {
        let [x, y, z, _] = &map.columns;
        [
            v[0] * x[0] + v[1] * y[0] + v[2] * z[0],
            v[0] * x[1] + v[1] * y[1] + v[2] * z[1],
            v[0] * x[2] + v[1] * y[2] + v[2] * z[2],
        ]
    }

    /// Applies `Affine::transposed_vector` to each.
    #[inline(always)]
    pub fn transposed_vector(self, map: &Affine, v: &Vectors<S>) -> Vectors<S> {
        let [x, y, z, _] = &map.columns;
        [
            v[0] * x[0] + v[1] * x[1] + v[2] * x[2],
            v[0] * y[0] + v[1] * y[1] + v[2] * y[2],
            v[0] * z[0] + v[1] * z[1] + v[2] * z[2],
        ]
    }
}

#[inline(always)]
fn larger<S: Simd>(a: f32x8<S>, b: f32x8<S>) -> f32x8<S> {
    a.simd_gt(b).select(a, b)
}

/// Returns the scalar products.
#[inline(always)]
pub fn dots<S: Simd>(a: &Vectors<S>, b: &Vectors<S>) -> f32x8<S> {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// Returns the vectors multiplied by numbers.
#[inline(always)]
pub fn scaled<S: Simd>(v: &Vectors<S>, factor: f32x8<S>) -> Vectors<S> {
    [v[0] * factor, v[1] * factor, v[2] * factor]
}

/// Returns the differences.
#[inline(always)]
pub fn difference<S: Simd>(a: &Vectors<S>, b: &Vectors<S>) -> Vectors<S> {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

/// Returns `one` where the mask is set, elsewhere `other`.
#[inline(always)]
pub fn select<S: Simd>(mask: mask32x8<S>, one: &Vectors<S>, other: &Vectors<S>) -> Vectors<S> {
    [mask.select(one[0], other[0]), mask.select(one[1], other[1]), mask.select(one[2], other[2])]
}

/// Returns a mask of the colours with a channel that is not 0.
#[inline(always)]
pub fn is_lit<S: Simd>(color: &Vectors<S>) -> mask32x8<S> {
    let is_dark = color[0].simd_eq(0.0) & color[1].simd_eq(0.0) & color[2].simd_eq(0.0);
    !is_dark
}

#[cfg(test)]
mod tests {
    use fearless_simd::{Level, dispatch};
    use proptest::prelude::*;

    use rtsl_bvh::LANES;
    use rtsl_math::normalize_or;

    use super::*;

    fn component() -> impl Strategy<Value = f32> {
        prop_oneof![-2.0_f32..2.0, any::<f32>(), Just(0.0), Just(f32::INFINITY), Just(f32::NAN)]
    }

    fn normalized(v: &LaneVectors) -> LaneVectors {
        let mut all = [[0.0; LANES]; 3];
        dispatch!(Level::new(), simd => {
            for eight in eights_of(simd, LANES) {
                let up = eight.splat_vector([0.0, 0.0, 1.0]);
                let normalized = eight.normalized_or(&eight.vectors(v), &up);
                eight.put_vectors(&normalized, &mut all);
            }
        });
        all
    }

    proptest! {
        #[test]
        fn lanes_are_normalised_as_single_vectors_are(
            x in component(), y in component(), z in component(), lane in 0..LANES,
        ) {
            let mut v = [[1.0; LANES]; 3];
            (v[0][lane], v[1][lane], v[2][lane]) = (x, y, z);
            let normalised = normalized(&v);
            let expected = normalize_or([x, y, z], [0.0, 0.0, 1.0]);
            for axis in 0..3 {
                prop_assert_eq!(normalised[axis][lane].to_bits(), expected[axis].to_bits());
            }
        }
    }
}
