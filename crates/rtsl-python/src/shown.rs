//! Values of the language as those of Python.

use numpy::{IntoPyArray, PyArrayDyn, PyArrayMethods};
use pyo3::IntoPyObjectExt;
use pyo3::prelude::*;
use pyo3::types::PyBool;
use rtsl::{Constant, ParameterType, Scalar};

/// Returns the words of a value as a number, or an array of the shape of its type; `None` for types without words.
pub fn shown<'py>(
    py: Python<'py>,
    ty: &ParameterType,
    words: &[u32],
) -> PyResult<Option<Bound<'py, PyAny>>> {
    if let (ParameterType::Scalar(scalar), [word]) = (ty, words) {
        return Ok(Some(number_of(py, Constant::from_bits(*scalar, *word))?));
    }
    let Some((scalar, mut shape)) = shape_of(ty) else { return Ok(None) };
    if let Some(first) = shape.iter_mut().find(|it| **it == OPEN) {
        *first = 1;
        let each = shape.iter().product::<usize>().max(1);
        shape[0] = words.len() / each;
    }
    if shape.iter().product::<usize>() != words.len() {
        return Ok(None);
    }
    numbers(py, scalar, words, &shape).map(Some)
}

/// Returns a number; of a float the shortest that rounds to it: 0.1, not 0.10000000149.
pub fn number_of(py: Python<'_>, constant: Constant) -> PyResult<Bound<'_, PyAny>> {
    match constant {
        Constant::F32(value) => {
            value.to_string().parse().unwrap_or(f64::from(value)).into_bound_py_any(py)
        }
        Constant::I32(value) => value.into_bound_py_any(py),
        Constant::U32(value) => value.into_bound_py_any(py),
        Constant::Bool(value) => Ok(PyBool::new(py, value).to_owned().into_any()),
    }
}

/// The size of a dimension that depends on the number of words.
const OPEN: usize = usize::MAX;

/// The type of a value's numbers and the shape of its array; `None` for structs and references.
fn shape_of(ty: &ParameterType) -> Option<(Scalar, Vec<usize>)> {
    match ty {
        ParameterType::Scalar(scalar) => Some((*scalar, Vec::new())),
        ParameterType::Vector(scalar, count) => Some((*scalar, vec![usize::from(*count)])),
        ParameterType::Matrix(columns, rows) => {
            Some((Scalar::F32, vec![usize::from(*columns), usize::from(*rows)]))
        }
        ParameterType::Color => Some((Scalar::F32, vec![rtsl::COLOR_COMPONENTS as usize])),
        ParameterType::Array(element, count) => {
            let (scalar, shape) = shape_of(element)?;
            Some((scalar, [vec![*count as usize], shape].concat()))
        }
        ParameterType::Buffer(element) => {
            let (scalar, shape) = shape_of(element)?;
            Some((scalar, [vec![OPEN], shape].concat()))
        }
        ParameterType::Textured(value) => shape_of(value),
        ParameterType::Struct(..) | ParameterType::Reference(_) => None,
    }
}

fn numbers<'py>(
    py: Python<'py>,
    scalar: Scalar,
    words: &[u32],
    shape: &[usize],
) -> PyResult<Bound<'py, PyAny>> {
    fn array<'py, T: numpy::Element>(
        py: Python<'py>,
        values: Vec<T>,
        shape: &[usize],
    ) -> PyResult<Bound<'py, PyAny>> {
        let shaped: Bound<'py, PyArrayDyn<T>> = values.into_pyarray(py).reshape(shape)?;
        Ok(shaped.into_any())
    }
    let words = words.iter().copied();
    match scalar {
        Scalar::F32 => array(py, words.map(f32::from_bits).collect(), shape),
        Scalar::I32 => array(py, words.map(u32::cast_signed).collect(), shape),
        Scalar::U32 => array(py, words.collect(), shape),
        Scalar::Bool => array(py, words.map(|word| word != 0).collect(), shape),
    }
}
