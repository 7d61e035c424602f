//! The stages that may follow a stage.

use std::collections::BTreeSet;

use rtsl_ir::{Constant, Function, Op, OpKind, Output, Value};
use rtsl_stages::Port;

/// The stages that may follow a function.
pub enum NextStages {
    /// Any stage.
    Any,
    /// One of these, or none.
    Of(BTreeSet<usize>),
}

impl NextStages {
    /// Returns the stages that may follow, as far as constants tell.
    pub fn of(function: &Function) -> NextStages {
        let is_next =
            |output: &Output| Port::of(function.variable(output.variable)) == Some(Port::Next);
        let outputs = function.outputs.iter().zip(&function.body.yields);
        let mut stages = BTreeSet::new();
        for (_, value) in outputs.filter(|(output, _)| is_next(output)) {
            let known = constants(function, *value, MAX_WAYS);
            let Some(known) = known else { return NextStages::Any };
            stages.extend(known.into_iter().filter_map(|stage| usize::try_from(stage).ok()));
        }
        NextStages::Of(stages)
    }

    /// True if this stage may follow.
    pub fn may_be(&self, stage: i32) -> bool {
        match self {
            NextStages::Any => true,
            NextStages::Of(stages) => {
                usize::try_from(stage).is_ok_and(|stage| stages.contains(&stage))
            }
        }
    }

    /// True if none but these stages may follow, or none at all.
    pub fn is_among(&self, others: &BTreeSet<i32>) -> bool {
        let is_other = |stage: &usize| i32::try_from(*stage).is_ok_and(|it| others.contains(&it));
        match self {
            NextStages::Any => false,
            NextStages::Of(stages) => stages.iter().all(is_other),
        }
    }
}

/// The greatest number of nested choices of a constant.
const MAX_WAYS: u32 = 64;

/// Returns the operation that defines a value, and the value's index among its results.
pub(crate) fn defined(function: &Function, value: Value) -> Option<(&Op, usize)> {
    let mut found = None;
    function.body.for_each_op(&mut |op| {
        if let Some(index) = op.results.iter().position(|result| result == value) {
            found = Some((op, index));
        }
    });
    found
}

/// Returns the constants that a value may be; `None` if it may be others.
fn constants(function: &Function, value: Value, limit: u32) -> Option<BTreeSet<i32>> {
    let limit = limit.checked_sub(1)?;
    let (op, index) = defined(function, value)?;
    let both = |one: Value, other: Value| {
        let mut all = constants(function, one, limit)?;
        all.extend(constants(function, other, limit)?);
        Some(all)
    };
    match &op.kind {
        OpKind::Constant(Constant::I32(value)) => Some(BTreeSet::from([*value])),
        OpKind::Select(_, one, other) => both(*one, *other),
        OpKind::If { then, otherwise, .. } => both(then.yields[index], otherwise.yields[index]),
        _ => None,
    }
}
