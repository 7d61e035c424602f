//! A grid of the sphere: cells of equal solid angle.
#![allow(clippy::disallowed_methods, reason = "these numbers only test; no result depends on them")]

use std::f64::consts::TAU;

use glam::{DVec3, Vec3};

use crate::sampling::call::thinning;

const ROWS: usize = 20;
const COLUMNS: usize = 40;

/// Cells by the cosine with an axis and the angle around it.
pub struct Grid {
    axes: [DVec3; 3],
    least_cosine: f64,
}

impl Grid {
    pub const CELLS: usize = ROWS * COLUMNS;

    /// All directions. The plane at right angles to the axis lies between two rows.
    pub fn sphere(axis: Vec3) -> Grid {
        Grid::cap(axis, -1.0)
    }

    /// The directions that have at least this cosine with the axis.
    pub fn cap(axis: Vec3, least_cosine: f64) -> Grid {
        let axis = axis.as_dvec3().normalize();
        let (first, second) = axis.any_orthonormal_pair();
        Grid { axes: [first, second, axis], least_cosine }
    }

    /// The cell that a direction lies in, unless it lies outside of the grid.
    pub fn cell(&self, direction: Vec3) -> Option<usize> {
        let [x, y, z] = self.axes.map(|axis| axis.dot(direction.as_dvec3().normalize()));
        let height = (z - self.least_cosine) / (1.0 - self.least_cosine);
        // Directions at the very edge are rounded to either side.
        if height < -1e-3 {
            return None;
        }
        let turn = y.atan2(x).rem_euclid(TAU) / TAU;
        let index = |part: f64, count: usize| ((part * count as f64) as usize).min(count - 1);
        Some(index(height, ROWS) * COLUMNS + index(turn, COLUMNS))
    }

    /// The integral over each cell of a function that is given many directions at a time.
    pub fn integrate(&self, mut density: impl FnMut(&[Vec3]) -> Vec<f32>) -> Vec<f64> {
        let nodes = gauss_nodes();
        let area = TAU * (1.0 - self.least_cosine) / Grid::CELLS as f64;
        let cells = (0..Grid::CELLS).map(|cell| {
            let (row, column) = (cell / COLUMNS, cell % COLUMNS);
            let at = |height: &f64, turn: &f64| {
                self.direction(
                    (row as f64 + height) / ROWS as f64,
                    (column as f64 + turn) / COLUMNS as f64,
                )
            };
            let directions =
                nodes.iter().flat_map(|height| nodes.iter().map(move |it| at(height, it)));
            let values = density(&directions.collect::<Vec<_>>());
            values.iter().map(|it| f64::from(*it)).sum::<f64>() / values.len() as f64 * area
        });
        cells.collect()
    }

    fn direction(&self, height: f64, turn: f64) -> Vec3 {
        let z = self.least_cosine + height * (1.0 - self.least_cosine);
        let radius = (1.0 - z * z).max(0.0).sqrt();
        let (sine, cosine) = (turn * TAU).sin_cos();
        let [first, second, axis] = self.axes;
        (radius * (cosine * first + sine * second) + z * axis).as_vec3()
    }
}

/// Gauss's two points in each of some intervals of [0,1]; they have equal weights.
fn gauss_nodes() -> Vec<f64> {
    let intervals = if thinning() == 1 { 6 } else { 4 };
    let offset = 0.5 / 3.0_f64.sqrt();
    let nodes = (0..intervals).flat_map(|it| {
        let middle = f64::from(it) + 0.5;
        [middle - offset, middle + offset].map(|node| node / f64::from(intervals))
    });
    nodes.collect()
}
