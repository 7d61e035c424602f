//! Pixel filters by importance sampling: the samples of a pixel are distributed like its filter and contribute to this
//! pixel only, so that sums have one order and tiles are independent (Ernst, Stamminger and Greiner, "Filter Importance
//! Sampling", 2006).
//!
//! All filters are products of an even function of x and one of y. A table inverts the integral of each function's
//! magnitude; it is computed by additions, multiplications and divisions of binary64 alone, so that it has the same
//! bits everywhere. `rt_filteredPlace` and `rt_filterWeight` of `prelude/renderer/camera.rtsl` read it.

use std::sync::Arc;

use crate::{exponential, sine_and_cosine_of_degrees};

/// The shape of a filter.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum FilterShape {
    /// Constant.
    Box,
    /// Linear, to zero at the radius: the tent.
    Triangle,
    /// A normal distribution, minus its value at the radius.
    Gaussian {
        /// The standard deviation in pixels.
        sigma: f64,
    },
    /// The cubic splines of Mitchell and Netravali, which have negative lobes.
    Mitchell {
        /// Their blur.
        b: f64,
        /// Their ringing.
        c: f64,
    },
    /// The window of Blackman and Harris with four terms.
    BlackmanHarris,
    /// The sinc function within the window of Lanczos, whose lobes change sign at whole pixels.
    Sinc {
        /// The distance in pixels at which the window first reaches zero.
        tau: f64,
    },
}

/// The filter of an image's pixels.
#[derive(Clone, Debug, PartialEq)]
pub struct PixelFilter {
    shape: FilterShape,
    radius: [f64; 2],
    /// For x and y; `None` if the filter does not change positions.
    tables: Option<Arc<[AxisTable; 2]>>,
}

impl PixelFilter {
    /// Creates a filter that extends so far, in pixels, to each side of a pixel's center.
    pub fn new(shape: FilterShape, radius: [f64; 2]) -> Self {
        if shape == FilterShape::Box && radius == [0.5; 2] {
            return Self::default();
        }
        let tables = radius.map(|radius| AxisTable::new(shape, radius));
        PixelFilter { shape, radius, tables: Some(Arc::new(tables)) }
    }

    /// Returns the shape.
    pub fn shape(&self) -> FilterShape {
        self.shape
    }

    /// Returns the radius along x and y.
    pub fn radius(&self) -> [f64; 2] {
        self.radius
    }

    /// Returns the tables for x and y; `None` if positions are the points themselves.
    pub fn tables(&self) -> Option<&[AxisTable; 2]> {
        self.tables.as_deref()
    }
}

impl Default for PixelFilter {
    /// The box filter over the pixel.
    fn default() -> Self {
        PixelFilter { shape: FilterShape::Box, radius: [0.5; 2], tables: None }
    }
}

/// The number of cells of a table. All cells have the same share of the filter's integral; within a cell, positions are
/// uniform.
const CELLS: usize = 512;
/// The number of steps of the numerical integral that a table inverts.
const STEPS: usize = 1 << 14;

/// The factor of a filter along one axis.
#[derive(Clone, Debug, PartialEq)]
pub struct AxisTable {
    /// Element `i` is the distance from the center within which `i` / CELLS of the magnitude's integral lies.
    distances: Box<[f32]>,
    /// The numbers of cells before each change of sign.
    sign_changes: Vec<f32>,
    magnitude: f32,
}

impl AxisTable {
    fn new(shape: FilterShape, radius: f64) -> Self {
        let width = radius / STEPS as f64;
        let values: Vec<f64> =
            (0..STEPS).map(|step| value(shape, radius, (step as f64 + 0.5) * width)).collect();
        let signed: f64 = values.iter().sum();
        let whole: f64 = values.iter().map(|value| value.abs()).sum();
        let mut distances = vec![0.0];
        let mut sign_changes = Vec::new();
        let mut below = 0.0;
        for (step, value) in values.iter().enumerate() {
            let part = value.abs();
            if (*value < 0.0) != (sign_changes.len() % 2 == 1) {
                sign_changes.push((below / whole * CELLS as f64) as f32);
            }
            // Any number of cells may end within a step.
            while distances.len() < CELLS {
                let wanted = whole * distances.len() as f64 / CELLS as f64;
                if below + part <= wanted {
                    break;
                }
                distances.push(((step as f64 + (wanted - below) / part) * width) as f32);
            }
            below += part;
        }
        distances.resize(CELLS + 1, radius as f32);
        let distances = distances.into_boxed_slice();
        AxisTable { distances, sign_changes, magnitude: (whole / signed) as f32 }
    }

    /// Returns the distances from the center within which each number of cells' shares of the magnitude's integral lie.
    pub fn distances(&self) -> &[f32] {
        &self.distances
    }

    /// Returns the numbers of cells before each change of sign.
    pub fn sign_changes(&self) -> &[f32] {
        &self.sign_changes
    }

    /// Returns the magnitude of weights: the integral of the magnitude, divided by that of the filter.
    pub fn magnitude(&self) -> f32 {
        self.magnitude
    }
}

/// The value of a filter, up to a constant factor, at a distance from the center not greater than the radius.
fn value(shape: FilterShape, radius: f64, distance: f64) -> f64 {
    match shape {
        FilterShape::Box => 1.0,
        FilterShape::Triangle => radius - distance,
        FilterShape::Gaussian { sigma } => {
            // The series is accurate down to exp(-44), which is negligible.
            let at = |x: f64| exponential((-0.5 * (x / sigma) * (x / sigma)).max(-44.0));
            (at(distance) - at(radius)).max(0.0)
        }
        FilterShape::Mitchell { b, c } => mitchell(b, c, 2.0 * distance / radius),
        FilterShape::BlackmanHarris => blackman_harris(distance / radius),
        FilterShape::Sinc { tau } => sinc(distance) * sinc(distance / tau),
    }
}

/// The splines on [0, 2].
fn mitchell(b: f64, c: f64, x: f64) -> f64 {
    if x < 1.0 {
        ((12.0 - 9.0 * b - 6.0 * c) * x + (-18.0 + 12.0 * b + 6.0 * c)) * x * x + (6.0 - 2.0 * b)
    } else {
        (((-b - 6.0 * c) * x + (6.0 * b + 30.0 * c)) * x + (-12.0 * b - 48.0 * c)) * x
            + (8.0 * b + 24.0 * c)
    }
}

/// The window on [0, 1], from its center to its end.
fn blackman_harris(x: f64) -> f64 {
    let wave = |harmonic: f64| sine_and_cosine_of_degrees(180.0 * harmonic * x).1;
    0.35875 + 0.48829 * wave(1.0) + 0.14128 * wave(2.0) + 0.01168 * wave(3.0)
}

/// The sine of pi times x over pi times x.
fn sinc(x: f64) -> f64 {
    let angle = std::f64::consts::PI * x;
    if angle < 1e-9 { 1.0 } else { sine_and_cosine_of_degrees(180.0 * x).0 / angle }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SHAPES: [FilterShape; 8] = [
        FilterShape::Box,
        FilterShape::Triangle,
        FilterShape::Gaussian { sigma: 0.5 },
        FilterShape::Mitchell { b: 1.0 / 3.0, c: 1.0 / 3.0 },
        FilterShape::Mitchell { b: 0.0, c: 1.0 },
        FilterShape::Mitchell { b: 1.0, c: 0.0 },
        FilterShape::BlackmanHarris,
        FilterShape::Sinc { tau: 3.0 },
    ];

    #[test]
    fn the_mean_over_the_pixel_leaves_numbers_alone() {
        assert_eq!(PixelFilter::default().tables(), None);
        assert_eq!(PixelFilter::new(FilterShape::Box, [0.5; 2]), PixelFilter::default());
    }

    /// Each cell has the same share of the magnitude's integral, and the sign of the filter there.
    #[test]
    fn cells_are_distributed_as_the_filter() {
        const PARTS: u32 = 64;
        let radius = 1.75;
        for shape in SHAPES {
            let table = AxisTable::new(shape, radius);
            let mean = |from: f64, to: f64| {
                let place =
                    |part: u32| from + (f64::from(part) + 0.5) / f64::from(PARTS) * (to - from);
                let values = (0..PARTS).map(|part| value(shape, radius, place(part)).abs());
                values.sum::<f64>() / f64::from(PARTS)
            };
            let cells: Vec<[f64; 2]> =
                table.distances.windows(2).map(|it| [it[0].into(), it[1].into()]).collect();
            let shares: Vec<f64> =
                cells.iter().map(|[from, to]| mean(*from, *to) * (to - from)).collect();
            let whole: f64 = shares.iter().sum();
            for (cell, share) in shares.iter().enumerate() {
                let error = (share / whole * CELLS as f64 - 1.0).abs();
                assert!(error < 0.02, "{shape:?}, {cell}: {error}");
            }
            let sign_of = |cell: usize| {
                let changes = table.sign_changes.iter();
                changes.filter(|change| cell as f32 + 0.5 > **change).count() % 2 == 1
            };
            for (cell, [from, to]) in cells.iter().enumerate() {
                let is_changing =
                    table.sign_changes.iter().any(|it| (it - cell as f32 - 0.5).abs() < 1.0);
                let is_negative = value(shape, radius, 0.5 * (from + to)) < 0.0;
                assert!(is_changing || is_negative == sign_of(cell), "{shape:?}, {cell}");
            }
        }
    }

    #[test]
    fn weights_are_one_on_average_and_exactly_so_without_negative_parts() {
        for shape in SHAPES {
            let table = AxisTable::new(shape, 2.0);
            let mut ends = table.sign_changes.clone();
            ends.push(CELLS as f32);
            let (mut signed, mut begin) = (0.0, 0.0);
            for (index, end) in ends.into_iter().enumerate() {
                signed += if index % 2 == 0 { end - begin } else { begin - end };
                begin = end;
            }
            let mean = table.magnitude * signed / CELLS as f32;
            assert!((mean - 1.0).abs() < 1e-6, "{shape:?}: {mean}");
            let has_negative = match shape {
                FilterShape::Mitchell { c, .. } => c > 0.0,
                FilterShape::Sinc { .. } => true,
                _ => false,
            };
            assert_eq!(!table.sign_changes.is_empty(), has_negative, "{shape:?}");
            assert_eq!(table.magnitude != 1.0, has_negative, "{shape:?}");
        }
    }

    /// Tables have these bits on every machine.
    #[test]
    fn tables_are_pinned() {
        let digest = |shape| {
            let distances = AxisTable::new(shape, 1.5).distances;
            distances[..=CELLS]
                .iter()
                .fold(0, |digest, it| crate::sampling::hash(digest, it.to_bits()))
        };
        expect_test::expect![
            "[076d7f2f, db94cd83, ddae9a8e, cea1e3ff, ac5f64e0, 8196671c, 4826c591, 58e564ed]"
        ]
        .assert_eq(&format!("{:08x?}", SHAPES.map(digest)));
    }

    #[test]
    fn distances_grow_to_the_radius() {
        for shape in SHAPES {
            for radius in [0.1, 0.5, 1.75, 8.0] {
                let distances = AxisTable::new(shape, radius).distances;
                assert!(distances.is_sorted(), "{shape:?}, {radius}");
                assert_eq!([distances[0], distances[CELLS]], [0.0, radius as f32], "{shape:?}");
            }
        }
    }
}
