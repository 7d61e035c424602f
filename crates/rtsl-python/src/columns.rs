//! Columns of arrays of Python: one component of a value for each lane, read and written in place.
#![allow(unsafe_code, reason = "memory of Python is accessed through addresses")]

use std::marker::PhantomData;

use numpy::PyUntypedArrayMethods;
use numpy::{Element, PyArray2, PyArrayMethods, PyReadonlyArray2, PyReadwriteArray2};
use pyo3::prelude::*;

use crate::error::Exception;

/// The axis along which an array has its lanes.
#[derive(Clone, Copy, Debug)]
pub enum LaneAxis {
    /// A row for each lane.
    Rows,
    /// A column for each lane.
    Columns,
}

/// The lanes of one component, at any distance from each other.
struct Column<'a, T> {
    start: *mut u8,
    /// The distance of successive lanes, in bytes.
    stride: isize,
    lanes: usize,
    /// The array is borrowed as long as this lives.
    borrowed: PhantomData<&'a T>,
}

// Safety: a column has nothing but an address. What is read through it is borrowed for reading, and what is written
// belongs to the thread that writes.
unsafe impl<T> Send for Column<'_, T> {}
// Safety: as above.
unsafe impl<T> Sync for Column<'_, T> {}

impl<'a, T: Copy + Element> Column<'a, T> {
    fn all(array: &Bound<'_, PyArray2<T>>, axis: LaneAxis) -> Vec<Column<'a, T>> {
        let (lane, component) = match axis {
            LaneAxis::Rows => (0, 1),
            LaneAxis::Columns => (1, 0),
        };
        let (shape, strides) = (array.shape(), array.strides());
        let column = |index: usize| Column {
            start: array.data().cast::<u8>().wrapping_offset(index as isize * strides[component]),
            stride: strides[lane],
            lanes: shape[lane],
            borrowed: PhantomData,
        };
        (0..shape[component]).map(column).collect()
    }

    fn place(&self, lane: usize) -> *mut T {
        self.start.wrapping_offset(lane as isize * self.stride).cast()
    }

    fn check(&self, first: usize, count: usize) {
        assert!(first + count <= self.lanes, "an array has {} lanes", self.lanes);
    }
}

/// A column that is read.
pub struct Input<'a, T>(Column<'a, T>);

impl<'a, T: Copy + Element> Input<'a, T> {
    /// Returns the columns of an array.
    pub fn all(array: &'a PyReadonlyArray2<'_, T>, axis: LaneAxis) -> Vec<Input<'a, T>> {
        Column::all(array, axis).into_iter().map(Input).collect()
    }

    /// Returns the value of all lanes, if they are one place in memory.
    pub fn uniform(&self) -> Option<T> {
        let is_one = self.0.stride == 0 && self.0.lanes > 0;
        // Safety: the lane exists, and is borrowed for reading.
        is_one.then(|| unsafe { self.0.place(0).read_unaligned() })
    }

    /// Reads the lanes from `first` on.
    pub fn read(&self, first: usize, values: &mut [T]) {
        self.0.check(first, values.len());
        let start = self.0.place(first);
        if self.0.stride == size_of::<T>() as isize && start.is_aligned() {
            // Safety: the lanes exist, are adjacent and aligned, and are borrowed for reading.
            values.copy_from_slice(unsafe { std::slice::from_raw_parts(start, values.len()) });
            return;
        }
        for (index, value) in values.iter_mut().enumerate() {
            // Safety: the lane exists, and is borrowed for reading.
            *value = unsafe { self.0.place(first + index).read_unaligned() };
        }
    }
}

impl<'a> Input<'a, f32> {
    /// Returns three columns as vectors, if a row has their numbers side by side.
    pub fn vectors(columns: &[Input<'a, f32>]) -> Option<VectorInput<'a>> {
        let [x, y, z] = columns else { return None };
        let follows = |one: &Input<'a, f32>, other: &Input<'a, f32>| {
            let (one, other) = (&one.0, &other.0);
            one.stride == ROW as isize && one.start.addr() + size_of::<f32>() == other.start.addr()
        };
        let Input(Column { start, stride, lanes, borrowed }) = *x;
        let column = Column { start, stride, lanes, borrowed };
        let is_vector = follows(x, y) && follows(y, z) && column.place(0).is_aligned();
        is_vector.then_some(VectorInput(column))
    }
}

/// The bytes of a row of three numbers.
const ROW: usize = 3 * size_of::<f32>();

/// Rows of three numbers without gaps.
pub struct VectorInput<'a>(Column<'a, f32>);

impl VectorInput<'_> {
    /// Reads the rows from `first` on, component by component.
    pub fn read(&self, first: usize, count: usize, [x, y, z]: [&mut [f32]; 3]) {
        self.0.check(first, count);
        let start = self.0.place(first).cast::<[f32; 3]>();
        // Safety: the rows exist, are adjacent and aligned, and are borrowed for reading.
        let rows = unsafe { std::slice::from_raw_parts(start, count) };
        // In one loop, which becomes shuffles of vectors: a loop for each component takes twice as long.
        for (((row, x), y), z) in rows.iter().zip(x).zip(y).zip(z) {
            (*x, *y, *z) = (row[0], row[1], row[2]);
        }
    }
}

/// A column that is written.
pub struct Output<'a, T>(Column<'a, T>);

impl<'a, T: Copy + Element> Output<'a, T> {
    /// Returns the columns of an array.
    ///
    /// # Errors
    /// If elements of the array share memory.
    pub fn all(
        array: &'a PyReadwriteArray2<'_, T>,
        axis: LaneAxis,
    ) -> PyResult<Vec<Output<'a, T>>> {
        let (shape, strides) = (array.shape(), array.strides());
        // True if steps along an axis are at least so long, or there are none.
        let steps = |axis: usize, least: usize| {
            strides[axis].unsigned_abs() >= least.max(size_of::<T>()) || shape[axis] <= 1
        };
        let extent = |axis: usize| strides[axis].unsigned_abs() * shape[axis];
        let is_apart = |inner, outer| steps(inner, 0) && steps(outer, extent(inner));
        let is_empty = shape[0] == 0 || shape[1] == 0;
        if !(is_empty || is_apart(0, 1) || is_apart(1, 0)) {
            let message = "an array for results has elements that share memory";
            return Err(Exception::Error.with_text(message));
        }
        Ok(Column::all(array, axis).into_iter().map(Output).collect())
    }

    /// Writes the lanes from `first` on, which no other thread writes.
    pub fn write(&self, first: usize, values: &[T]) {
        self.0.check(first, values.len());
        let start = self.0.place(first);
        if self.0.stride == size_of::<T>() as isize && start.is_aligned() {
            // Safety: the lanes exist, are adjacent and aligned, are borrowed for writing, and belong to this thread.
            let lanes = unsafe { std::slice::from_raw_parts_mut(start, values.len()) };
            lanes.copy_from_slice(values);
            return;
        }
        for (index, value) in values.iter().enumerate() {
            // Safety: the lane exists, is borrowed for writing, and belongs to this thread.
            unsafe { self.0.place(first + index).write_unaligned(*value) };
        }
    }
}
