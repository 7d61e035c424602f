//! The state that a method reads or writes.

use rtsl_abi::ComponentSet;
use rtsl_ir::{Function, Index, OpKind, VariableId, VariableKind};
use rtsl_spec::lookup_state;

/// Returns the state components that a linked method loads or stores, whose arrays its kernels need.
pub(crate) fn state_components(function: &Function) -> ComponentSet {
    let mut components = ComponentSet::default();
    let mut touch = |place: VariableId, indices: std::ops::Range<u32>| {
        let place = function.variable(place);
        if place.kind == VariableKind::State
            && let Some(variable) = lookup_state(&place.name)
        {
            indices.for_each(|index| components.insert(variable.first_component + index));
        }
    };
    function.body.for_each_op(&mut |op| {
        let OpKind::Load(place, index) = op.kind else { return };
        match index {
            Index::Constant(index) => touch(place, index..index + 1),
            Index::Dynamic(_) => touch(place, 0..function.variable(place).len),
        }
    });
    for output in &function.outputs {
        touch(output.variable, output.component..output.component + 1);
    }
    components
}

/// Returns all components of the state variables that a linked method touches: recordings have whole variables.
pub(crate) fn recorded_state_components(function: &Function) -> ComponentSet {
    let touched = state_components(function);
    let mut components = ComponentSet::default();
    for place in function.variables.iter().filter(|it| it.kind == VariableKind::State) {
        let Some(variable) = lookup_state(&place.name) else { continue };
        let whole = variable.first_component..variable.first_component + place.len;
        if whole.clone().any(|component| touched.contains(component)) {
            whole.for_each(|component| components.insert(component));
        }
    }
    components
}
