//! The ray state that the classes of a text use.

use std::collections::BTreeSet;

use rtsl_abi::description::LibraryDescription;
use rtsl_ir::{Function, OpKind, VariableKind};
use rtsl_spec::{Default as StateDefault, Role, Row, StateVariable, lookup_state, rows};

use crate::ClassCode;
use crate::comment::{sentence, write_documentation};
use crate::expression::INDENT;
use crate::identifier::identifier;
use crate::literal::literal;

/// Appends the struct `State`.
pub(crate) fn write_state(
    library: &LibraryDescription,
    classes: &[ClassCode<'_>],
    text: &mut String,
) {
    let mut variables: Vec<&StateVariable> = Vec::new();
    for variable in functions(classes).flat_map(|function| &function.variables) {
        if variable.kind == VariableKind::State {
            variables.extend(lookup_state(&variable.name));
        }
    }
    variables.sort_by_key(|variable| variable.index);
    variables.dedup_by_key(|variable| variable.index);
    let roles: BTreeSet<Role> =
        library.classes.iter().flat_map(|class| class.roles.clone()).collect();
    text.push_str("\n/// What a ray knows, as far as these classes use it.\nstruct State {\n");
    for variable in variables {
        let row = row(variable, &roles);
        write_documentation(&sentence(row.map_or("", |row| row.doc)), INDENT, text);
        let (name, components) = (identifier(variable.name), variable.ty.components());
        let value = initial(row, components);
        let dimension = if components == 1 { String::new() } else { format!("[{components}]") };
        text.push_str(&format!("    float {name}{dimension} = {value};\n"));
    }
    if has_budget(classes) {
        write_documentation(
            "Set where a method used up its budget of loop iterations.",
            INDENT,
            text,
        );
        text.push_str("    bool budget_exceeded = false;\n");
    }
    text.push_str("};\n");
}

/// True if a method requests anything from the host.
pub(crate) fn asks_host(classes: &[ClassCode<'_>]) -> bool {
    let mut asks = false;
    for function in functions(classes) {
        function.body.for_each_op(&mut |op| {
            asks |= matches!(
                op.kind,
                OpKind::Trace { .. }
                    | OpKind::Occluded { .. }
                    | OpKind::LightCount
                    | OpKind::LightSample { .. }
                    | OpKind::Ambient
                    | OpKind::Rand
            );
        });
    }
    asks
}

fn functions<'a>(classes: &'a [ClassCode<'a>]) -> impl Iterator<Item = &'a Function> {
    classes.iter().flat_map(|class| {
        let methods = class.methods.iter().map(|(_, function)| *function);
        methods.chain(class.constructors.iter().copied())
    })
}

/// True if a method may use up a budget of loop iterations.
pub(crate) fn has_budget(classes: &[ClassCode<'_>]) -> bool {
    let mut has = false;
    for (_, function) in classes.iter().flat_map(|class| &class.methods) {
        function.body.for_each_op(&mut |op| has |= matches!(op.kind, OpKind::ReportBudget));
    }
    has
}

/// Returns the variable's table row for one of these roles, else for any.
fn row(variable: &StateVariable, roles: &BTreeSet<Role>) -> Option<&'static Row> {
    let own = roles.iter().find_map(|role| role.row(variable.name));
    own.or_else(|| rows().iter().find(|row| row.name == variable.name))
}

fn initial(row: Option<&Row>, components: u32) -> String {
    let float = |value: f32| literal(rtsl_ir::Constant::F32(value));
    let all = |values: Vec<f32>| match &values[..] {
        [value] => float(*value),
        values if values.iter().all(|value| value.to_bits() == 0) => "{}".to_owned(),
        values => {
            let values: Vec<String> = values.iter().map(|value| float(*value)).collect();
            format!("{{{}}}", values.join(", "))
        }
    };
    match row.map(|row| row.default) {
        Some(StateDefault::Constant(value)) => all(vec![value; components as usize]),
        Some(StateDefault::Components(values)) => all(values.to_vec()),
        Some(
            StateDefault::Variable(_)
            | StateDefault::Grey(_)
            | StateDefault::Luminance(_)
            | StateDefault::Tangent(_),
        )
        | None => all(vec![0.0; components as usize]),
    }
}
