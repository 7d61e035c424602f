//! Affine maps of eight lanes, each its own.

use fearless_simd::prelude::*;
use fearless_simd::{Simd, f32x8};

use crate::math::Affine;

use super::eight::{Eight, Vectors};

/// A map for each of eight lanes. What they do is what [`Affine`] does, in the same order of operations.
#[derive(Clone, Copy)]
pub struct LaneMaps<S: Simd> {
    columns: [Vectors<S>; 4],
}

impl<S: Simd> LaneMaps<S> {
    /// The same map for all.
    #[inline(always)]
    pub fn same(eight: Eight<S>, map: &Affine) -> Self {
        LaneMaps { columns: map.columns.map(|column| eight.splat_vector(column)) }
    }

    /// `map` says that of each lane of the packet or chunk.
    #[inline(always)]
    pub fn each(eight: Eight<S>, map: impl Fn(usize) -> Affine) -> Self {
        let mut words = [[0.0_f32; 8]; 12];
        for lane in 0..8 {
            let map = map(eight.start() + lane);
            for (word, component) in words.iter_mut().zip(map.columns.as_flattened()) {
                word[lane] = *component;
            }
        }
        let number = |index: usize| f32x8::from_slice(eight.simd(), &words[index]);
        let column = |first: usize| [number(first), number(first + 1), number(first + 2)];
        LaneMaps { columns: [column(0), column(3), column(6), column(9)] }
    }

    /// The points that `p` become.
    #[inline(always)]
    pub fn points(&self, p: &Vectors<S>) -> Vectors<S> {
        let v = self.vectors(p);
        let origin = &self.columns[3];
        [v[0] + origin[0], v[1] + origin[1], v[2] + origin[2]]
    }

    /// The vectors that `v` become.
    #[inline(always)]
    pub fn vectors(&self, v: &Vectors<S>) -> Vectors<S> {
        let [x, y, z, _] = &self.columns;
        [
            v[0] * x[0] + v[1] * y[0] + v[2] * z[0],
            v[0] * x[1] + v[1] * y[1] + v[2] * z[1],
            v[0] * x[2] + v[1] * y[2] + v[2] * z[2],
        ]
    }

    /// The vectors that `v` become under the transposed linear parts.
    #[inline(always)]
    pub fn transposed_vectors(&self, v: &Vectors<S>) -> Vectors<S> {
        let [x, y, z, _] = &self.columns;
        [
            v[0] * x[0] + v[1] * x[1] + v[2] * x[2],
            v[0] * y[0] + v[1] * y[1] + v[2] * y[2],
            v[0] * z[0] + v[1] * z[1] + v[2] * z[2],
        ]
    }
}
