//! Classes and their parameters.

use std::sync::Arc;

use pyo3::prelude::*;
use pyo3::types::PyDict;
use rtsl::{
    AnnotationValue, Class, Constant, Method, Parameter, ParameterType, Role, default_value,
    type_name,
};

use crate::engine::PyEngine;
use crate::error::Exception;
use crate::instance::PyInstance;
use crate::method::describe_methods;
use crate::shown::{number_of, shown};
use crate::value::value_of;

/// A class.
#[pyclass(name = "Class", module = "rtsl._rtsl", frozen)]
pub struct PyClassHandle {
    pub class: Arc<Class>,
}

#[pymethods]
impl PyClassHandle {
    /// Its name.
    #[getter]
    fn name(&self) -> &str {
        &self.class.name
    }

    /// Its documentation comment.
    #[getter]
    fn doc(&self) -> Option<&str> {
        self.class.documentation.as_deref()
    }

    /// The names of its roles, such as `primitive`.
    #[getter]
    fn roles(&self) -> Vec<&'static str> {
        self.class.roles.iter().map(|role| role.name()).collect()
    }

    /// The parameters, as dictionaries.
    fn parameters<'py>(&self, py: Python<'py>) -> PyResult<Vec<Bound<'py, PyDict>>> {
        self.class.parameters.iter().map(|it| describe(py, &self.class, it)).collect()
    }

    /// The names of its methods, in the order of the roles.
    fn method_names(&self) -> Vec<&'static str> {
        let has = |method: &Method| self.class.methods.contains_key(method);
        Method::ALL.into_iter().filter(has).map(Method::name).collect()
    }

    /// The methods, as dictionaries; references are not set.
    fn methods<'py>(
        &self,
        py: Python<'py>,
        engine: &PyEngine,
    ) -> PyResult<Vec<Bound<'py, PyDict>>> {
        let program = engine.engine.program_of_class(&self.class);
        describe_methods(py, &program)
    }

    /// The names of its scratch members, with their types.
    fn scratch(&self) -> Vec<(String, String)> {
        let members = self.class.scratch_types.iter();
        members.map(|(name, ty)| (name.clone(), type_name(ty))).collect()
    }

    /// Makes an instance with the values of a dictionary.
    fn instance(&self, values: &Bound<'_, PyDict>) -> PyResult<PyInstance> {
        let mut arguments = Vec::new();
        for (name, value) in values {
            let name: String = name.extract()?;
            let value = value_of(&value).map_err(|error| named(&name, error, values.py()))?;
            arguments.push((name, value));
        }
        let given = arguments.iter().map(|(name, value)| (name.as_str(), value.clone()));
        match rtsl::Instance::new(&self.class, given) {
            Ok(instance) => Ok(PyInstance { instance }),
            Err(problems) => Err(Exception::Parameter.of_values(&problems)),
        }
    }
}

/// Adds the name of a parameter to the error of its value.
fn named(name: &str, error: PyErr, py: Python<'_>) -> PyErr {
    Exception::Parameter.with_text(&format!("parameter `{name}`: {}", error.value(py)))
}

fn describe<'py>(
    py: Python<'py>,
    class: &Class,
    parameter: &Parameter,
) -> PyResult<Bound<'py, PyDict>> {
    let values = PyDict::new(py);
    values.set_item("name", &parameter.name)?;
    values.set_item("type", type_name(&parameter.ty))?;
    values.set_item("required", parameter.required)?;
    values.set_item("takes", role_of(&parameter.ty).map(Role::name))?;
    let default = default_value(class, parameter);
    let default = default.map(|words| shown(py, parameter.ty.value_type(), &words)).transpose()?;
    values.set_item("default", default.flatten())?;
    let annotations = PyDict::new(py);
    for annotation in &parameter.annotations {
        match &annotation.value {
            AnnotationValue::None => annotations.set_item(&annotation.key, true)?,
            AnnotationValue::Text(text) => annotations.set_item(&annotation.key, text)?,
            AnnotationValue::Constant(Constant::Bool(value)) => {
                annotations.set_item(&annotation.key, value)?;
            }
            AnnotationValue::Constant(value) => {
                annotations.set_item(&annotation.key, number_of(py, *value)?)?;
            }
        }
    }
    values.set_item("annotations", annotations)?;
    values.set_item("choices", parameter.choices())?;
    Ok(values)
}

/// The role of the instances that a parameter takes.
fn role_of(ty: &ParameterType) -> Option<Role> {
    match ty {
        ParameterType::Reference(role) => Some(*role),
        ParameterType::Textured(_) => Some(Role::Texture),
        ParameterType::Array(element, _) | ParameterType::Buffer(element) => role_of(element),
        ParameterType::Scalar(_)
        | ParameterType::Vector(..)
        | ParameterType::Matrix(..)
        | ParameterType::Color
        | ParameterType::Struct(..) => None,
    }
}
