//! Facts implied by the value of a bool.

use std::collections::HashMap;

use rtsl_ir::{BinaryOp, CompareOp, Op, OpKind, UnaryOp, Value};

/// The greatest number of bools concluded from one.
const MAX_CONCLUSIONS: usize = 32;

/// The definition of a bool, as far as it implies facts about other values.
#[derive(Clone, Copy)]
pub(crate) enum Condition {
    Compare(CompareOp, Value, Value),
    Same(Value),
    Not(Value),
    And(Value, Value),
    Or(Value, Value),
}

impl Condition {
    fn of(kind: &OpKind) -> Option<Condition> {
        match *kind {
            OpKind::Compare(op, a, b) => Some(Condition::Compare(op, a, b)),
            OpKind::Unary(UnaryOp::Seldom, a) => Some(Condition::Same(a)),
            OpKind::Unary(UnaryOp::Not, a) => Some(Condition::Not(a)),
            OpKind::Binary(BinaryOp::And, a, b) => Some(Condition::And(a, b)),
            OpKind::Binary(BinaryOp::Or, a, b) => Some(Condition::Or(a, b)),
            _ => None,
        }
    }
}

/// The definitions of the bools of a function.
#[derive(Default)]
pub(crate) struct Conditions {
    of: HashMap<Value, Condition>,
}

impl Conditions {
    /// Records an operation that computes a bool.
    pub fn remember(&mut self, op: &Op) {
        if let Some(condition) = Condition::of(&op.kind) {
            self.of.insert(op.results.get(0), condition);
        }
    }

    /// Returns the comparison that defines a bool.
    pub fn comparison(&self, value: Value) -> Option<(CompareOp, Value, Value)> {
        match self.of.get(&value)? {
            Condition::Compare(op, a, b) => Some((*op, *a, *b)),
            Condition::Same(_) | Condition::Not(_) | Condition::And(..) | Condition::Or(..) => None,
        }
    }

    /// Returns the bools that are implied by `value` being `truth`, at most [`MAX_CONCLUSIONS`].
    pub fn conclusions(&self, value: Value, truth: bool) -> Vec<(Value, bool)> {
        let mut truths = vec![(value, truth)];
        let mut next = 0;
        while let Some((value, truth)) = truths.get(next).copied() {
            match self.of.get(&value).copied() {
                Some(Condition::Same(a)) => truths.push((a, truth)),
                Some(Condition::Not(a)) => truths.push((a, !truth)),
                Some(Condition::And(a, b)) if truth => truths.extend([(a, true), (b, true)]),
                Some(Condition::Or(a, b)) if !truth => truths.extend([(a, false), (b, false)]),
                Some(Condition::Compare(..) | Condition::And(..) | Condition::Or(..)) | None => {}
            }
            truths.truncate(MAX_CONCLUSIONS);
            next += 1;
        }
        truths
    }
}
