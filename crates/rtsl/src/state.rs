//! The state of rays.
//!
//! The state of a call is a [`LaneBlock`] with an array for each component of each state variable;
//! `rt_RayOrigin` is the three arrays that start at its variable's
//! [`first_component`](rtsl_spec::StateVariable::first_component). The same block serves
//! methods of all roles.

use rtsl_abi::LaneBlock;
use rtsl_spec::{
    Default as StateDefault, Direction, Method, Role, Row, StateVariable, lookup_state, rows,
    state_component_count,
};

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

/// The way in which hosts compute a component of the state from others. Each source is the number of a component.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Derivation {
    /// Its reciprocal.
    ReciprocalOf(u32),
    /// The point of a ray: origin, direction and distance.
    PointOn([u32; 3]),
    /// Its value.
    SameAs(u32),
}

impl Derivation {
    /// Returns the components that the value is computed from.
    pub fn sources(&self) -> &[u32] {
        match self {
            Derivation::ReciprocalOf(of) | Derivation::SameAs(of) => std::slice::from_ref(of),
            Derivation::PointOn(ray) => ray,
        }
    }

    /// Sets a component of the first `count` rays.
    pub fn set(&self, state: &mut LaneBlock, component: u32, count: usize) {
        for lane in 0..count {
            let get = |of: &u32| state.floats(*of as usize)[lane];
            let value = match self {
                Derivation::ReciprocalOf(of) => 1.0 / get(of),
                Derivation::PointOn(ray) => {
                    let [origin, direction, distance] = ray.each_ref().map(get);
                    origin + distance * direction
                }
                Derivation::SameAs(of) => get(of),
            };
            state.floats_mut(component as usize)[lane] = value;
        }
    }
}

/// Returns the components of the state that a host of a method computes from others, if it has no values of its own for
/// them: those of inverse directions, of the hit's point where its distance is given, and of variables whose default is
/// the value of another. Components come after those that they are computed from.
pub fn derived_components(
    role: Role,
    method: Method,
    is_given: impl Fn(&StateVariable) -> bool,
) -> Vec<(u32, Derivation)> {
    let is_input =
        |row: &Row| matches!(row.direction(method), Some(Direction::In | Direction::InOut));
    let input = |name: &str| {
        let row = role.row(name).filter(|row| is_input(row))?;
        lookup_state(row.name)
    };
    let free = |name: &str| input(name).filter(|it| !is_given(it));
    let mut derived = Vec::new();
    let mut derive = |of: &StateVariable, derivation: &dyn Fn(u32) -> Derivation| {
        let components = 0..of.ty.components();
        derived.extend(components.map(|it| (of.first_component + it, derivation(it))));
    };
    let (origin, direction) = (input("rt_RayOrigin"), input("rt_RayDirection"));
    if let (Some(inverse), Some(direction)) = (free("rt_InverseRayDirection"), direction) {
        derive(inverse, &|it| Derivation::ReciprocalOf(direction.first_component + it));
    }
    let distance = input("rt_HitDistance").filter(|it| is_given(it));
    let ray = (origin, direction, distance);
    if let (Some(point), (Some(origin), Some(direction), Some(distance))) =
        (free("rt_HitPoint"), ray)
    {
        let [origin, direction] = [origin, direction].map(|it| it.first_component);
        let distance = distance.first_component;
        derive(point, &|it| Derivation::PointOn([origin + it, direction + it, distance]));
    }
    for row in rows().iter().filter(|row| row.role == Some(role)) {
        let StateDefault::Variable(other) = row.default else { continue };
        if let (Some(variable), Some(other)) = (free(row.name), input(other)) {
            derive(variable, &|it| Derivation::SameAs(other.first_component + it));
        }
    }
    derived
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn hosts_derive_what_follows_from_other_state() {
        let first = |name| lookup_state(name).unwrap().first_component as usize;
        let derive = |method, given: &[&str], state: &mut LaneBlock| {
            let is_given = |it: &StateVariable| given.contains(&it.name);
            for (component, derivation) in derived_components(Role::Primitive, method, is_given) {
                derivation.set(state, component, 2);
            }
        };
        let mut state = new_state(2);
        set_defaults(&mut state, Role::Primitive);
        derive(Method::Intersect, &[], &mut state);
        let inverse = first("rt_InverseRayDirection");
        assert_eq!(state.floats(inverse), [f32::INFINITY; 2]);
        assert_eq!(state.floats(inverse + 2), [1.0; 2]);
        assert_eq!(state.floats(first("rt_HitPoint") + 2), [0.0; 2], "no method's input");
        state.floats_mut(first("rt_HitDistance")).copy_from_slice(&[3.0, 4.0]);
        state.floats_mut(first("rt_GeometricNormal")).fill(0.5);
        state.floats_mut(inverse).fill(7.0);
        let given = ["rt_HitDistance", "rt_GeometricNormal", "rt_InverseRayDirection"];
        derive(Method::ComputeDerivatives, &given, &mut state);
        for name in ["rt_HitPoint", "rt_TextureUVW"] {
            assert_eq!(state.floats(first(name) + 2), [3.0, 4.0], "{name}");
        }
        assert_eq!(state.floats(first("rt_ShadingNormal")), [0.5; 2]);
        assert_eq!(state.floats(inverse), [7.0; 2], "what is given stays");
    }

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
