//! The state of rays.
//!
//! The state of a call is a [`LaneBlock`] with an array for each component of each state variable;
//! `rt_RayOrigin` is the three arrays that start at its variable's
//! [`first_component`](rtsl_spec::StateVariable::first_component). The same block serves
//! methods of all roles.

use rtsl_abi::LaneBlock;
use rtsl_spec::{Default as StateDefault, Role, lookup_state, rows, state_component_count};

/// State for `lanes` rays, all zero.
pub fn new_state(lanes: usize) -> LaneBlock {
    LaneBlock::new(state_component_count() as usize, lanes)
}

/// Sets the state that a role's methods read to its defaults, the constants of the table of state variables. Variables
/// whose default is another variable's value are left alone.
///
/// ```
/// use rtsl::{Role, lookup_state};
///
/// let mut state = rtsl::new_state(4);
/// rtsl::set_defaults(&mut state, Role::Primitive);
/// let distance = lookup_state("rt_HitDistance").expect("the table has it").first_component;
/// assert_eq!(state.floats(distance as usize), [f32::INFINITY; 4]);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn set_defaults(state: &mut LaneBlock, role: Role) {
    for (component, value) in default_components(role) {
        state.floats_mut(component as usize).fill(value);
    }
}

/// Returns the components of the state that [`set_defaults`] sets for a role, with their values.
pub fn default_components(role: Role) -> impl Iterator<Item = (u32, f32)> {
    let of_role = rows().iter().filter(move |row| row.role.is_none_or(|it| it == role));
    of_role.flat_map(|row| {
        let variable = lookup_state(row.name);
        let components = variable.map_or(0, |variable| variable.ty.components());
        let first = variable.map_or(0, |variable| variable.first_component);
        (0..components).filter_map(move |component| {
            let value = match row.default {
                StateDefault::Constant(value) => value,
                StateDefault::Components(values) => values[component as usize],
                StateDefault::Variable(_)
                | StateDefault::Grey(_)
                | StateDefault::Luminance(_)
                | StateDefault::Tangent(_) => return None,
            };
            Some((first + component, value))
        })
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn defaults_are_those_of_the_role() {
        let mut state = new_state(5);
        set_defaults(&mut state, Role::Primitive);
        let first = |name| lookup_state(name).unwrap().first_component as usize;
        assert_eq!(state.floats(first("rt_HitDistance")), [f32::INFINITY; 5]);
        assert_eq!(state.floats(first("rt_RayDirection") + 2), [1.0; 5]);
        assert_eq!(state.floats(first("rt_RayOrigin")), [0.0; 5]);
    }
}
