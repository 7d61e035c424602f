//! Descriptions of methods: the state that they read and set.

use pyo3::prelude::*;
use pyo3::types::PyDict;
use rtsl::{LinkedMethod, Method, Program, Role, StateVariable, default_components, most_similar};

use crate::detached::detached;
use crate::error::Exception;

/// Returns the method of this name.
pub fn method_of_name(name: &str) -> PyResult<Method> {
    Method::from_name(name).ok_or_else(|| {
        let near = most_similar(name, Method::ALL.into_iter().map(Method::name));
        let help = near.map(|near| format!("; did you mean `{near}`?")).unwrap_or_default();
        Exception::Error.with_text(&format!("there is no method `{name}`{help}"))
    })
}

/// Describes the methods of a program, as dictionaries. Methods that cannot be linked have their error.
pub fn describe_methods<'py>(
    py: Python<'py>,
    program: &Program,
) -> PyResult<Vec<Bound<'py, PyDict>>> {
    let class = program.class();
    let methods = Method::ALL.into_iter().filter(|method| program.has(*method));
    let described = methods.map(|method| {
        let values = PyDict::new(py);
        values.set_item("name", method.name())?;
        let own = class.method_documentation.get(&method).map(String::as_str);
        values.set_item("doc", own.unwrap_or_else(|| method.doc()))?;
        let role = class.role_of(method).unwrap_or(Role::Primitive);
        values.set_item("role", role.name())?;
        match detached(py, || program.method(method))? {
            Ok(linked) => set_state(&values, &linked, role)?,
            Err(problem) => values.set_item("error", problem.message)?,
        }
        Ok(values)
    });
    described.collect()
}

fn set_state(values: &Bound<'_, PyDict>, linked: &LinkedMethod, role: Role) -> PyResult<()> {
    let describe = |list: &[&'static StateVariable]| -> PyResult<Vec<Bound<'_, PyDict>>> {
        let shown = list.iter().filter(|it| !it.is_hidden());
        shown.map(|it| describe_state(values.py(), it, role)).collect()
    };
    values.set_item("reads", describe(&linked.reads)?)?;
    values.set_item("sets", describe(&linked.writes)?)?;
    values.set_item("draws_numbers", linked.draws_numbers())?;
    values.set_item("asks_scene", linked.asks_scene())
}

fn describe_state<'py>(
    py: Python<'py>,
    variable: &StateVariable,
    role: Role,
) -> PyResult<Bound<'py, PyDict>> {
    let values = PyDict::new(py);
    values.set_item("name", variable.name)?;
    values.set_item("type", variable.ty.name())?;
    values.set_item("components", variable.ty.components())?;
    values.set_item("doc", role.row(variable.name).map_or("", |row| row.doc))?;
    let components = variable.first_component..variable.first_component + variable.ty.components();
    let defaults = default_components(role).filter(|(it, _)| components.contains(it));
    let defaults: Vec<f32> = defaults.map(|(_, value)| value).collect();
    values.set_item("default", (!defaults.is_empty()).then_some(defaults))?;
    Ok(values)
}

/// Returns the state variables of the role of this name with the numbers of their components.
#[pyfunction]
pub fn state_variables(role: &str) -> Vec<(&'static str, u32)> {
    let role = Role::ALL.into_iter().find(|it| it.name() == role);
    let of_role = rtsl::state_variables().iter().filter(|it| !it.is_hidden());
    let of_role = of_role.filter(|it| role.is_some_and(|role| role.row(it.name).is_some()));
    of_role.map(|it| (it.name, it.ty.components())).collect()
}
