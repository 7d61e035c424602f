//! Values of Python as those of parameters.

use numpy::{PyArrayDyn, PyArrayMethods};
use pyo3::exceptions::PyTypeError;
use pyo3::prelude::*;
use pyo3::types::{PyBool, PyDict, PyFloat, PyInt, PyList, PyString, PyTuple};
use rtsl::{Numbers, Scalar, Value};

use crate::instance::PyInstance;

/// The greatest nesting of lists.
const DEPTH_LIMIT: usize = 32;

/// Returns the value that an object is. Arrays have the type of their numbers; the Python files made them contiguous.
pub fn value_of(object: &Bound<'_, PyAny>) -> PyResult<Value> {
    nested_value(object, 0)
}

fn nested_value(object: &Bound<'_, PyAny>, depth: usize) -> PyResult<Value> {
    if depth > DEPTH_LIMIT {
        return Err(PyTypeError::new_err("lists are nested too deeply"));
    }
    if let Ok(instance) = object.cast::<PyInstance>() {
        return Ok(Value::Instance(instance.get().instance.clone()));
    }
    if let Ok(value) = object.cast::<PyBool>() {
        return Ok(Value::Bool(value.is_true()));
    }
    if object.is_instance_of::<PyInt>() {
        return whole_number(object);
    }
    if let Ok(value) = object.cast::<PyFloat>() {
        return Ok(Value::Float(value.extract::<f64>()? as f32));
    }
    if let Ok(text) = object.cast::<PyString>() {
        return Ok(Value::Text(text.extract()?));
    }
    if let Some(numbers) = numbers_of(object) {
        return Ok(Value::Numbers(numbers));
    }
    if object.is_instance_of::<PyList>() || object.is_instance_of::<PyTuple>() {
        let each = object.try_iter()?.map(|it| nested_value(&it?, depth + 1));
        return Ok(Value::List(each.collect::<PyResult<_>>()?));
    }
    if let Ok(fields) = object.cast::<PyDict>() {
        let each = fields
            .iter()
            .map(|(name, value)| Ok((name.extract()?, nested_value(&value, depth + 1)?)));
        return Ok(Value::Struct(each.collect::<PyResult<_>>()?));
    }
    let name = object.get_type().name()?;
    Err(PyTypeError::new_err(format!("a value of type `{name}` is no value of a parameter")))
}

/// Returns an integer, which converts to any type of the language.
fn whole_number(object: &Bound<'_, PyAny>) -> PyResult<Value> {
    if let Ok(value) = object.extract::<i32>() {
        return Ok(Value::Int(value));
    }
    if let Ok(value) = object.extract::<u32>() {
        return Ok(Value::Uint(value));
    }
    Ok(Value::Float(object.extract::<f64>()? as f32))
}

/// Returns the numbers of an array of one of the types of the language.
fn numbers_of(object: &Bound<'_, PyAny>) -> Option<Numbers> {
    fn words<T: numpy::Element + Copy>(
        object: &Bound<'_, PyAny>,
        word: impl Fn(T) -> u32,
    ) -> Option<Vec<u32>> {
        let array = object.cast::<PyArrayDyn<T>>().ok()?.try_readonly().ok()?;
        Some(array.as_slice().ok()?.iter().map(|value| word(*value)).collect())
    }
    let floats = || Some((Scalar::F32, words(object, f32::to_bits)?));
    let ints = || Some((Scalar::I32, words(object, i32::cast_unsigned)?));
    let uints = || Some((Scalar::U32, words(object, |value: u32| value)?));
    let bools = || Some((Scalar::Bool, words(object, |value: bool| u32::from(value))?));
    let (scalar, words) = floats().or_else(ints).or_else(uints).or_else(bools)?;
    Some(Numbers::from_words(scalar, words))
}
