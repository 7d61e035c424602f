//! The C header of the kernel interface.

use std::fmt::Write;

use rtsl_abi::offsets;
use rtsl_spec::{
    COLOR_COMPONENTS, Default as StateDefault, Direction, Row, StateVariable, rows,
    state_component_count, state_variables,
};

/// Returns the declarations that C and C++ hosts need to call kernels: structs, constants, and some functions that most
/// hosts would write themselves. The text is the same for all libraries of one version of the interface.
pub fn kernel_header() -> String {
    let text = include_str!("rtsl_kernel.h");
    let numbers = [
        ("@ABI@", offsets::VERSION.to_string()),
        ("@COLOR_COMPONENTS@", COLOR_COMPONENTS.to_string()),
        ("@STATE_COMPONENTS@", state_component_count().to_string()),
        ("@STATE@", state_constants()),
        ("@STATE_DEFAULTS@", state_defaults()),
    ];
    numbers.iter().fold(text.to_owned(), |text, (name, value)| text.replace(name, value))
}

/// Returns the enumerators of the state components.
fn state_constants() -> String {
    let mut text = String::new();
    for variable in state_variables() {
        let name = constant_name(variable);
        let first = variable.first_component;
        let (ty, doc) = (variable.ty.name(), documentation(variable));
        let _ = writeln!(text, "    {name} = {first}, /* {ty}: {doc} */");
    }
    text.pop();
    text
}

/// Returns `RTSL_STATE_RayOrigin` for `rt_RayOrigin`.
fn constant_name(variable: &StateVariable) -> String {
    format!("RTSL_STATE_{}", variable.name.trim_start_matches("rt_"))
}

/// Returns the variable's documentation for the first role that has it.
fn documentation(variable: &StateVariable) -> &'static str {
    rows().iter().find(|row| row.name == variable.name).map_or("", |row| row.doc)
}

/// Returns initialisers of all components with the defaults for hosts that do not set them.
fn state_defaults() -> String {
    let mut text = String::new();
    for variable in state_variables() {
        let values = (0..variable.ty.components()).map(|index| number(default(variable, index)));
        let values: Vec<String> = values.collect();
        let _ = write!(text, "\\\n    {}, ", values.join(", "));
    }
    text.truncate(text.trim_end_matches([' ', ',']).len());
    text
}

/// Returns the constant default of a component: that of the first role in which methods read it as an input.
fn default(variable: &StateVariable, component: u32) -> f32 {
    let is_set = |row: &&Row| {
        let direction = |direction| matches!(direction, Direction::In | Direction::InOut);
        row.name == variable.name && row.access.iter().any(|access| direction(access.direction))
    };
    match rows().iter().find(is_set).map(|row| row.default) {
        Some(StateDefault::Constant(value)) => value,
        Some(StateDefault::Components(values)) => values[component as usize],
        Some(
            StateDefault::Variable(_)
            | StateDefault::Grey(_)
            | StateDefault::Luminance(_)
            | StateDefault::Tangent(_),
        )
        | None => 0.0,
    }
}

fn number(value: f32) -> String {
    if value.is_infinite() {
        return if value > 0.0 { "INFINITY" } else { "-INFINITY" }.to_owned();
    }
    format!("{value:?}f")
}
