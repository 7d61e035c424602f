//! The table of state variables, by the identifiers of the typed tree.

use rtsl_ir::Scalar;
use rtsl_sema::hir::{StateId, Type};
use rtsl_spec::{Role, StateType, StateVariable};

/// The variables that hold the light's sample inside `illuminance`.
pub(crate) fn light_states() -> impl Iterator<Item = StateId> {
    let lit = |variable: &&StateVariable| {
        Role::Material.row(variable.name).is_some_and(|row| row.illuminance)
    };
    rtsl_spec::state_variables().iter().filter(lit).map(|variable| StateId(variable.index))
}

/// The entry of the table's list of distinct variables.
pub(crate) fn entry(id: StateId) -> &'static StateVariable {
    &rtsl_spec::state_variables()[id.0 as usize]
}

/// The variable called `name`.
///
/// # Panics
/// If the table has none.
pub(crate) fn state_id(name: &str) -> StateId {
    let variable = rtsl_spec::lookup_state(name);
    StateId(variable.unwrap_or_else(|| panic!("the table has {name}")).index)
}

/// The type of a state variable.
pub(crate) fn type_of(ty: StateType) -> Type {
    match ty {
        StateType::Float => Type::Scalar(Scalar::F32),
        StateType::Vec2 => Type::Vector(Scalar::F32, 2),
        StateType::Vec3 => Type::Vector(Scalar::F32, 3),
        StateType::Color => Type::Color,
        StateType::Floats(count) => Type::Array(Box::new(Type::Scalar(Scalar::F32)), count),
    }
}
