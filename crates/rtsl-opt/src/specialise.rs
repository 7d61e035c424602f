//! Specialisation: replaces members of known value by constants.

use std::collections::BTreeMap;

use rtsl_ir::{Constant, Function, Index, OpKind, Region, VariableId};

/// Replaces loads of these scalars of variables by their values. Loads at dynamic indices remain.
///
/// The values must have the types of their variables; folding then propagates them.
pub fn run(function: &mut Function, known: &BTreeMap<(VariableId, u32), Constant>) {
    region(&mut function.body, known);
}

fn region(region_: &mut Region, known: &BTreeMap<(VariableId, u32), Constant>) {
    for op in &mut region_.ops {
        if let OpKind::Load(variable, Index::Constant(index)) = op.kind
            && let Some(constant) = known.get(&(variable, index))
        {
            op.kind = OpKind::Constant(*constant);
        }
        op.kind.regions_mut().for_each(|inner| region(inner, known));
    }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeMap;

    use expect_test::expect;
    use rtsl_ir::{Constant, VariableKind};

    use crate::testing::transformed;

    #[test]
    fn known_members_become_constants() {
        let text = "
            %c: bool = load scratch:b@0
            %a: f32 = load member:m@0
            %b: f32 = if %c { %x: f32 = load member:m@1 yield %x } else { yield %a }
            return scratch:f@0 = %b";
        let specialised = transformed(text, |function| {
            let variable = function.find_variable(VariableKind::Member, "m").unwrap();
            let known = BTreeMap::from([((variable, 1), Constant::F32(2.5))]);
            super::run(function, &known);
        });
        expect![[r#"
            %1: f32 = load member:m@0
            %2: f32 = if %0 {
              %3: f32 = constant 2.5
              yield %3
            } else {
              yield %1
            }
            return scratch:f@0 = %2
        "#]]
        .assert_eq(&specialised);
    }
}
