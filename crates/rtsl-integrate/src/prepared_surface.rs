//! Surfaces whose properties a renderer prepares before a stage runs: the stage is not linked with their shapes.
//!
//! A stage that asks for the properties of one surface, on all ways through it, reads them from arrays instead: then it
//! needs no host, and a renderer computes them for many paths together.

use std::collections::BTreeMap;

use rtsl_ir::{
    Function, Index, Op, OpKind, Query, Region, Scalar, Value, Values, Variable, VariableKind,
};
use rtsl_opt::dce;

use crate::next_stages::defined;

/// The number of properties of a surface.
pub fn property_count() -> usize {
    Query::SurfaceProperties.result_scalars().count()
}

/// Returns the name of the scratch array with a property of the surface.
pub fn property_column(index: usize) -> String {
    format!("property.{index}")
}

/// The surface that a renderer prepares for a stage.
#[derive(Clone, Debug)]
pub struct PreparedSurface {
    /// The operands of the query, in order.
    pub operands: Vec<Operand>,
    /// The indices of the properties that the stage reads.
    pub properties: Vec<usize>,
}

/// An operand that a renderer knows.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Operand {
    /// That in the scratch array with this name.
    Column(String),
    /// The same bits for all paths.
    Constant(u32),
}

/// Replaces the query for the properties of a surface by loads; `None` if there is none, if there are several, or if
/// its operands are computed.
pub fn prepare(function: &mut Function) -> Option<PreparedSurface> {
    let is_query = |op: &Op| matches!(op.kind, OpKind::Query(Query::SurfaceProperties, _));
    let mut count = 0;
    function.body.for_each_op(&mut |op| count += usize::from(is_query(op)));
    let at = function.body.ops.iter().position(is_query).filter(|_| count == 1)?;
    let OpKind::Query(_, operands) = &function.body.ops[at].kind else { return None };
    let operands = operands.iter().map(|value| operand(function, *value));
    let operands = operands.collect::<Option<Vec<Operand>>>()?;
    let results = function.body.ops[at].results;
    let mut body = std::mem::take(&mut function.body);
    let properties = load_properties(function, &mut body, at, results);
    function.body = body;
    dce::run(function);
    function.renumber();
    Some(PreparedSurface { operands, properties })
}

/// Replaces an operation by loads of those of its results that are used; returns their indices.
fn load_properties(
    function: &mut Function,
    body: &mut Region,
    at: usize,
    results: Values,
) -> Vec<usize> {
    let mut used: BTreeMap<Value, Option<Value>> = results.iter().map(|it| (it, None)).collect();
    let mut loads = Vec::new();
    body.for_each_use_mut(&mut |value| {
        let Some(load) = used.get_mut(value) else { return };
        let index = results.iter().position(|result| result == *value).unwrap_or(0);
        *value = *load.get_or_insert_with(|| load_of(function, index, &mut loads));
    });
    body.ops.splice(at..=at, loads);
    let is_used = |(index, result): (usize, Value)| used[&result].map(|_| index);
    results.iter().enumerate().filter_map(is_used).collect()
}

fn load_of(function: &mut Function, index: usize, loads: &mut Vec<Op>) -> Value {
    let scalar = Query::SurfaceProperties.result_scalars().nth(index).unwrap_or(Scalar::F32);
    let (kind, name) = (VariableKind::Scratch, property_column(index));
    let column = function.intern_variable(Variable { kind, name, scalar, len: 1 });
    function.push(loads, scalar, OpKind::Load(column, Index::Constant(0)))
}

/// Returns an operand; `None` if the function computes it.
fn operand(function: &Function, value: Value) -> Option<Operand> {
    match &defined(function, value)?.0.kind {
        OpKind::Constant(constant) => Some(Operand::Constant(constant.bits())),
        OpKind::Load(variable, Index::Constant(0)) => {
            let variable = function.variable(*variable);
            let is_column = variable.kind == VariableKind::Scratch && variable.len == 1;
            is_column.then(|| Operand::Column(variable.name.clone()))
        }
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use expect_test::expect;

    use super::*;

    const QUERY: &str =
        "query surface_properties %i, %i, %i, %x, %y, %x, %x, %x, %x, %x, %x, %x, %x, %x";

    fn function(body: &str) -> Function {
        let mut body = body.to_owned();
        for name in ["r", "s"] {
            let scalars = (0..property_count()).map(|it| format!("%{name}{it}: f32"));
            let query = format!("{} = {QUERY}", scalars.collect::<Vec<String>>().join(", "));
            body = body.replacen("QUERY", &query, 1);
        }
        let x = if body.contains("%x: f32") { "%z" } else { "%x" };
        let text = format!(
            "function f scratch answer.1: i32[1] scratch frame.0: f32[1] scratch out: f32[1] {{
                %t: bool = constant true %y: f32 = constant 1.0
                %i: i32 = load scratch:answer.1@0 {x}: f32 = load scratch:frame.0@0
                {body} return scratch:out@0 = %s
            }}"
        );
        text.parse().unwrap_or_else(|error| panic!("{error}\n{text}"))
    }

    #[test]
    fn properties_that_are_used_are_loaded() {
        let mut function = function("QUERY %s: f32 = add %r0, %r5");
        let prepared = prepare(&mut function).expect("the operands are loads");
        assert_eq!(prepared.properties, [0, 5]);
        let column = |name: &str| Operand::Column(name.to_owned());
        let expected =
            [column("answer.1"), column("frame.0"), Operand::Constant(1.0_f32.to_bits())];
        assert_eq!(prepared.operands[2..5], expected);
        expect![[r#"
            function f
            scratch answer.1: i32[1]
            scratch frame.0: f32[1]
            scratch out: f32[1]
            scratch property.0: f32[1]
            scratch property.5: f32[1]
            {
              %0: f32 = load scratch:property.0@0
              %1: f32 = load scratch:property.5@0
              %2: f32 = add %0, %1
              return scratch:out@0 = %2
            }
        "#]]
        .assert_eq(&function.to_string());
    }

    #[test]
    fn other_queries_stay() {
        for body in [
            "%s: f32 = add %x, %x",
            "%s: f32 = if %t { QUERY yield %r0 } else { yield %x }",
            "QUERY %s: f32 = if %t { QUERY yield %r0 } else { yield %x }",
            "%x: f32 = add %y, %y QUERY %s: f32 = add %r0, %y",
        ] {
            let mut function = function(body);
            let before = function.to_string();
            assert!(prepare(&mut function).is_none());
            assert_eq!(function.to_string(), before);
        }
    }
}
