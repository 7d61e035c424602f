//! Affine maps of eight lanes, a different one for each.

use fearless_simd::Simd;
use rtsl_math::Affine;

use super::eight::{Eight, Vectors};
use super::fours::fours;
use super::surface_offset::sizes;

/// A map for each of eight lanes. The operations are those of [`Affine`], in the same order.
#[derive(Clone, Copy)]
pub struct LaneMaps<S: Simd> {
    columns: [Vectors<S>; 4],
}

impl<S: Simd> LaneMaps<S> {
    /// Uses the same map for all lanes.
    #[inline(always)]
    pub fn same(eight: Eight<S>, map: &Affine) -> Self {
        LaneMaps { columns: map.columns.map(|column| eight.splat_vector(column)) }
    }

    /// Computes the map of each lane of the packet or batch by `map`.
    #[inline(always)]
    pub fn each(eight: Eight<S>, map: impl Fn(usize) -> Affine) -> Self {
        let maps: [Affine; 8] = std::array::from_fn(|lane| map(eight.start() + lane));
        Self::gathered(eight, |lane| &maps[lane - eight.start()])
    }

    /// Gathers the map of each lane of the packet or batch from the reference returned by `map`.
    #[inline(always)]
    pub fn gathered<'a>(eight: Eight<S>, map: impl Fn(usize) -> &'a Affine) -> Self {
        let maps: [&Affine; 8] = std::array::from_fn(|lane| map(eight.start() + lane));
        let simd = eight.simd();
        let [a, b, c, d] = fours(simd, |lane| {
            let [x, y, ..] = &maps[lane].columns;
            [x[0], x[1], x[2], y[0]]
        });
        let [e, f, g, h] = fours(simd, |lane| {
            let [_, y, z, _] = &maps[lane].columns;
            [y[1], y[2], z[0], z[1]]
        });
        let [i, j, k, l] = fours(simd, |lane| {
            let [.., z, origin] = &maps[lane].columns;
            [z[2], origin[0], origin[1], origin[2]]
        });
        LaneMaps { columns: [[a, b, c], [d, e, f], [g, h, i], [j, k, l]] }
    }

    /// Returns the maps of magnitudes: [`Affine::of_sizes`].
    #[inline(always)]
    pub fn of_sizes(&self) -> Self {
        LaneMaps { columns: self.columns.map(|column| sizes(&column)) }
    }

    /// Transforms points.
    #[inline(always)]
    pub fn points(&self, p: &Vectors<S>) -> Vectors<S> {
        let v = self.vectors(p);
        let origin = &self.columns[3];
        [v[0] + origin[0], v[1] + origin[1], v[2] + origin[2]]
    }

    /// Transforms vectors.
    #[inline(always)]
    pub fn vectors(&self, v: &Vectors<S>) -> Vectors<S> {
        let [x, y, z, _] = &self.columns;
        [
            v[0] * x[0] + v[1] * y[0] + v[2] * z[0],
            v[0] * x[1] + v[1] * y[1] + v[2] * z[1],
            v[0] * x[2] + v[1] * y[2] + v[2] * z[2],
        ]
    }

    /// Applies the transposed linear parts to vectors.
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
