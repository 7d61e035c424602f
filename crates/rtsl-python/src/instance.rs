//! Instances.

use std::sync::Arc;

use pyo3::prelude::*;
use pyo3::types::PyDict;
use rtsl::{Instance, ParameterTarget};

use crate::class::PyClassHandle;
use crate::detached::detached;
use crate::engine::PyEngine;
use crate::error::Exception;
use crate::method::describe_methods;
use crate::shown::shown;

/// An instance, which does not change.
#[pyclass(name = "Instance", module = "rtsl._rtsl", frozen)]
pub struct PyInstance {
    pub instance: Arc<Instance>,
}

#[pymethods]
impl PyInstance {
    /// Its class.
    #[getter]
    fn class_handle(&self) -> PyClassHandle {
        PyClassHandle { class: self.instance.class().clone() }
    }

    /// The value of a parameter as a number or an array; `None` if it is none, or of a parameter of the constructor.
    fn value<'py>(&self, py: Python<'py>, name: &str) -> PyResult<Option<Bound<'py, PyAny>>> {
        let parameters = &self.instance.class().parameters;
        let parameter = parameters.iter().find(|it| it.name == name);
        let is_member = |target| target == ParameterTarget::Member;
        let Some(parameter) = parameter.filter(|it| is_member(it.target)) else { return Ok(None) };
        let ty = parameter.ty.value_type();
        if let Some(words) = self.instance.member(name) {
            return shown(py, ty, words);
        }
        match self.instance.buffer(name) {
            Some(words) => shown(py, ty, words),
            None => Ok(None),
        }
    }

    /// Warnings about values outside of the ranges of their parameters.
    #[getter]
    fn warnings(&self) -> Vec<String> {
        let outside = self.instance.outside_range().iter();
        outside.map(|it| format!("{}: {}", it.warning.code, it.warning.message)).collect()
    }

    /// The number of its elements, such as the triangles of a mesh.
    #[getter]
    fn element_count(&self) -> Option<u32> {
        self.instance.element_count()
    }

    /// The methods, as dictionaries.
    fn methods<'py>(
        &self,
        py: Python<'py>,
        engine: &PyEngine,
    ) -> PyResult<Vec<Bound<'py, PyDict>>> {
        describe_methods(py, &engine.program(&self.instance))
    }

    /// The values that a call of the method passes: the state that it reads and sets, the scratch arrays, and whether it
    /// leaves scratch to the host.
    fn call_plan<'py>(
        &self,
        py: Python<'py>,
        engine: &PyEngine,
        method: &str,
    ) -> PyResult<Bound<'py, PyDict>> {
        let method = crate::method::method_of_name(method)?;
        let program = engine.program(&self.instance);
        let linked = detached(py, || program.method(method))?;
        let linked = linked.map_err(|problem| Exception::Error.of_diagnostic(&problem))?;
        let refused = program.refuse_questions(method, "calls for arrays");
        refused.map_err(|problem| Exception::Error.of_diagnostic(&problem))?;
        let plan = PyDict::new(py);
        let names = |list: &[&'static rtsl::StateVariable]| -> Vec<(&str, u32)> {
            let shown = list.iter().filter(|it| !it.is_hidden());
            shown.map(|it| (it.name, it.ty.components())).collect()
        };
        plan.set_item("reads", names(&linked.reads))?;
        plan.set_item("sets", names(&linked.writes))?;
        plan.set_item("reads_scratch", linked.reads_scratch)?;
        plan.set_item("leaves_scratch", linked.sets_scratch && method.leaves_scratch())?;
        plan.set_item("scratch_arrays", program.layout().scratch_arrays)?;
        let places = program.scratch().iter().filter_map(|place| {
            let first = program.layout().scratch.get(&place.name)?;
            Some((place.name.clone(), *first, place.len, rtsl::scalar_name(place.scalar)))
        });
        plan.set_item("scratch", places.collect::<Vec<_>>())?;
        plan.set_item("program", Arc::as_ptr(&program).addr())?;
        Ok(plan)
    }
}
