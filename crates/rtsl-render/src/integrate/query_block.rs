//! The arrays of kernels that answer queries.

use std::ops::Range;

use rtsl::{LaneBlock, QueryColumns};
use rtsl_math::Affine;

use super::rows::BATCH_LANES;

/// The scratch of shapes and lights, then the [columns](QueryColumns) through which kernels that answer queries about
/// them meet the renderer.
pub struct QueryBlock {
    /// All arrays.
    pub block: LaneBlock,
    /// The first array of the columns.
    first: usize,
}

impl QueryBlock {
    /// Allocates the arrays for shaders with at most so many scratch arrays.
    pub fn new(scratch_arrays: usize) -> QueryBlock {
        let block = LaneBlock::new(scratch_arrays + QueryColumns::COUNT, BATCH_LANES);
        QueryBlock { block, first: scratch_arrays }
    }

    /// Returns the numbers of a column.
    pub fn column(&self, column: usize) -> &[f32] {
        self.block.floats(self.first + column)
    }

    /// Returns the numbers of a column.
    pub fn column_mut(&mut self, column: usize) -> &mut [f32] {
        self.block.floats_mut(self.first + column)
    }

    /// Returns a lane's vector in the three columns from `first` on.
    pub fn vector(&self, first: usize, lane: usize) -> [f32; 3] {
        [0, 1, 2].map(|axis| self.column(first + axis)[lane])
    }

    /// Sets a lane's vector in the three columns from `first` on.
    pub fn set_vector(&mut self, first: usize, lane: usize, vector: [f32; 3]) {
        (first..).zip(vector).for_each(|(column, number)| self.column_mut(column)[lane] = number);
    }

    /// Sets the map of some lanes in the twelve columns from `first` on.
    pub fn set_map(&mut self, first: usize, lanes: Range<usize>, map: &Affine) {
        for (column, number) in (first..).zip(map.columns.as_flattened()) {
            self.column_mut(column)[lanes.clone()].fill(*number);
        }
    }
}
