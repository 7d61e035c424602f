//! Unchanged outputs: removes outputs that store the value the variable already has.
//!
//! A camera that does not change the ray's greatest distance, for example, is lowered to yield the value it loaded.
//!
//! This is valid if a kernel stores to the lane that it reads. It is not if all lanes read one lane and store to
//! separate ones: there [`restore`] makes them outputs again, so that the stored values do not depend on the
//! optimisations applied.

use std::collections::HashSet;

use rtsl_ir::{Function, Index, OpKind, Output, Value, Variable, VariableKind};

/// A scalar of a variable, identified independently of the variable's index in a function.
pub type VariableScalar = (Variable, u32);

/// Returns the outputs of a function.
pub fn outputs(function: &Function) -> impl Iterator<Item = VariableScalar> {
    function.outputs.iter().map(|it| (function.variable(it.variable).clone(), it.component))
}

/// Makes scalars of variables outputs that yield their current values.
pub fn restore<'a>(function: &mut Function, scalars: impl IntoIterator<Item = &'a VariableScalar>) {
    let mut loads = Vec::new();
    for (variable, component) in scalars {
        let (scalar, component) = (variable.scalar, *component);
        let variable = function.intern_variable(variable.clone());
        let load = OpKind::Load(variable, Index::Constant(component));
        let value = function.push(&mut loads, scalar, load);
        function.outputs.push(Output { variable, component });
        function.body.yields.push(value);
    }
    function.body.ops.splice(0..0, loads);
}

/// Removes unchanged outputs of state and scratch.
pub fn run(function: &mut Function) {
    let mut loaded: HashSet<(Value, Output)> = HashSet::new();
    function.body.for_each_op(&mut |op| {
        if let OpKind::Load(variable, Index::Constant(component)) = op.kind {
            loaded.insert((op.results.get(0), Output { variable, component }));
        }
    });
    let yields = std::mem::take(&mut function.body.yields);
    let outputs = std::mem::take(&mut function.outputs);
    let (outputs, yields) = outputs
        .into_iter()
        .zip(yields)
        .filter(|(output, value)| {
            let kind = function.variable(output.variable).kind;
            let is_kept = matches!(kind, VariableKind::State | VariableKind::Scratch);
            !(is_kept && loaded.contains(&(*value, *output)))
        })
        .unzip();
    function.outputs = outputs;
    function.body.yields = yields;
}

#[cfg(test)]
mod tests {
    use expect_test::expect;

    use crate::testing::{check_preserves, transformed};

    #[test]
    fn only_unchanged_outputs_are_removed() {
        let text = "
            %a: f32 = load scratch:f@0 %b: f32 = load scratch:f@1 %m: f32 = load member:m@0
            return scratch:f@0 = %a, scratch:f@1 = %a, scratch:f@2 = %b, member:m@0 = %m";
        expect![[r#"
            %2: f32 = load member:m@0
            return scratch:f@1 = %0, scratch:f@2 = %1, member:m@0 = %2
        "#]]
        .assert_eq(&transformed(text, super::run));
    }

    #[test]
    fn removed_outputs_are_restored() {
        let text = "
            %a: f32 = load scratch:f@0 %m: f32 = load member:m@0
            return scratch:f@0 = %a, scratch:f@1 = %m";
        expect![[r#"
            %1: f32 = load member:m@0
            return scratch:f@1 = %1, scratch:f@0 = %0
        "#]]
        .assert_eq(&transformed(text, |function| {
            let set: Vec<_> = super::outputs(function).collect();
            super::run(function);
            crate::dce::run(function);
            let left: Vec<_> = super::outputs(function).collect();
            super::restore(function, set.iter().filter(|it| !left.contains(it)));
        }));
    }

    #[test]
    fn keeps_results() {
        check_preserves(super::run);
    }
}
