//! Hoisting of common operations: computes operations that both sides of an `if` share before it.
//!
//! - An operation that occurs on both sides with the same operands moves in front of the `if`.
//! - Two expensive ones that differ in operands become one, whose operands are selected by the condition: `c ? a / b :
//!   b / a` is one division. A packet whose rays diverge then divides once instead of twice, and the remaining sides
//!   are more often short enough to need no branch.
//!
//! Operands must be defined before the `if`, or have been moved there. One of the sides is always executed, so no
//! computation is wasted.

use std::collections::{HashMap, HashSet};

use rtsl_ir::{
    BinaryOp, Effect, Function, Index, Op, OpKind, Region, Scalar, UnaryOp, Value, VariableId,
};

use crate::gvn::{Key, key};
use crate::substitution::Substitution;

/// The greatest number of passes over the sides of an `if`; a moved operation may allow its users to move.
const MAX_ROUNDS: u32 = 8;

/// Hoists the common operations of `function`.
pub fn run(function: &mut Function) {
    let mut body = std::mem::take(&mut function.body);
    let mut merging = Merging { function, substitution: Substitution::default() };
    merging.region(&mut body);
    merging.substitution.keep_names(&mut merging.function.names);
    function.body = body;
}

struct Merging<'a> {
    function: &'a mut Function,
    substitution: Substitution,
}

/// Operations that are worth a select between operands.
#[derive(Clone, Copy, PartialEq, Eq, Hash)]
enum Expensive {
    Unary(UnaryOp),
    Binary(BinaryOp, Scalar),
    Load(VariableId),
}

impl Merging<'_> {
    fn region(&mut self, region: &mut Region) {
        let mut ops = Vec::with_capacity(region.ops.len());
        for mut op in std::mem::take(&mut region.ops) {
            self.substitution.apply_to_operands(&mut op.kind);
            for region in op.kind.regions_mut() {
                self.region(region);
            }
            if let OpKind::If { condition, then, otherwise } = &mut op.kind {
                for _ in 0..MAX_ROUNDS {
                    if !self.merge(*condition, then, otherwise, &mut ops) {
                        break;
                    }
                }
            }
            ops.push(op);
        }
        region.ops = ops;
        self.substitution.apply_to_yields(region);
    }

    /// Moves the operations common to both sides to `before`; returns true if there were any.
    fn merge(
        &mut self,
        condition: Value,
        then: &mut Region,
        otherwise: &mut Region,
        before: &mut Vec<Op>,
    ) -> bool {
        let mut others = Others::new(self, otherwise, &defined_in(otherwise));
        let inside = defined_in(then);
        let mut kept = Vec::with_capacity(then.ops.len());
        for op in std::mem::take(&mut then.ops) {
            let partner = if self.is_movable(&op, &inside) { others.take(self, &op) } else { None };
            match partner {
                Some(other) => self.move_out(condition, op, &other, before),
                None => kept.push(op),
            }
        }
        then.ops = kept;
        if others.taken.is_empty() {
            return false;
        }
        otherwise.ops.retain(|op| !others.has_taken(op));
        self.substitute(then);
        self.substitute(otherwise);
        true
    }

    /// Replaces two operations, the second on the other side, by one before the `if`.
    fn move_out(&mut self, condition: Value, mut op: Op, other: &Op, before: &mut Vec<Op>) {
        let mut others = Vec::new();
        other.kind.for_each_operand(|operand| others.push(operand));
        let mut others = others.into_iter();
        let function = &mut *self.function;
        op.kind.for_each_operand_mut(|operand| {
            let other = others.next().unwrap_or(*operand);
            if *operand != other {
                let kind = OpKind::Select(condition, *operand, other);
                *operand = function.push(before, function.scalar(*operand), kind);
            }
        });
        self.substitution.set_all(other.results, op.results.iter());
        before.push(op);
    }

    fn substitute(&self, region: &mut Region) {
        region.for_each_use_mut(&mut |value| *value = self.substitution.get(*value));
    }

    /// True if an operation may move before the `if` in which these values are defined.
    fn is_movable(&self, op: &Op, inside: &HashSet<Value>) -> bool {
        let mut is_available = true;
        op.kind.for_each_operand(|operand| is_available &= !inside.contains(&operand));
        is_available
            && op.results.count == 1
            && key(&op.kind).is_some()
            && op.kind.effect(&self.function.variables) == Effect::None
    }

    fn expensive(&self, kind: &OpKind) -> Option<Expensive> {
        match *kind {
            OpKind::Unary(
                op @ (UnaryOp::Sqrt
                | UnaryOp::ApproximateReciprocal
                | UnaryOp::ApproximateInverseSqrt
                | UnaryOp::ApproximateSqrt),
                _,
            ) => Some(Expensive::Unary(op)),
            OpKind::Binary(op @ (BinaryOp::Divide | BinaryOp::Remainder), a, _) => {
                Some(Expensive::Binary(op, self.function.scalar(a)))
            }
            OpKind::Load(variable, Index::Dynamic(_)) => Some(Expensive::Load(variable)),
            _ => None,
        }
    }
}

/// The movable operations of the other side.
struct Others {
    equal: HashMap<(Key, bool), Op>,
    /// In reverse order of the text.
    alike: HashMap<(Expensive, bool), Vec<Op>>,
    /// The results of the operations that have moved.
    taken: HashSet<Value>,
}

impl Others {
    fn new(merging: &Merging<'_>, region: &Region, inside: &HashSet<Value>) -> Others {
        let mut others =
            Others { equal: HashMap::new(), alike: HashMap::new(), taken: HashSet::new() };
        for op in region.ops.iter().rev().filter(|op| merging.is_movable(op, inside)) {
            if let Some(key) = key(&op.kind) {
                others.equal.insert((key, op.precise), op.clone());
            }
            if let Some(expensive) = merging.expensive(&op.kind) {
                others.alike.entry((expensive, op.precise)).or_default().push(op.clone());
            }
        }
        others
    }

    /// Removes and returns the operation that matches `op`.
    fn take(&mut self, merging: &Merging<'_>, op: &Op) -> Option<Op> {
        let equal = key(&op.kind).and_then(|key| self.equal.remove(&(key, op.precise)));
        let equal = equal.filter(|other| !self.has_taken(other));
        let found = equal.or_else(|| {
            let key = (merging.expensive(&op.kind)?, op.precise);
            loop {
                let other = self.alike.get_mut(&key)?.pop()?;
                if !self.has_taken(&other) {
                    return Some(other);
                }
            }
        })?;
        self.taken.extend(found.results.iter());
        Some(found)
    }

    fn has_taken(&self, op: &Op) -> bool {
        op.results.iter().any(|result| self.taken.contains(&result))
    }
}

/// Returns the values that a region's operations define, without nested regions.
fn defined_in(region: &Region) -> HashSet<Value> {
    region.ops.iter().flat_map(|op| op.results.iter()).collect()
}

#[cfg(test)]
mod tests {
    use expect_test::expect;

    use crate::testing::{check_preserves, transformed};

    #[test]
    fn one_division_for_two() {
        let text = "
            %c: bool = load scratch:b@0 %a: f32 = load scratch:f@0 %b: f32 = load scratch:f@1
            %r: f32, %s: f32 = if %c {
                %m: f32 = load member:m@0 %p: f32 = multiply %m, %a
                %q: f32 = divide %a, %b %n: f32 = negate %q
                yield %n, %p
            } else {
                %m2: f32 = load member:m@0 %p2: f32 = multiply %m2, %a
                %q2: f32 = divide %b, %a %t: f32 = add %q2, %p2
                yield %t, %p2
            }
            return scratch:f@0 = %r, scratch:f@1 = %s";
        expect![[r#"
            %3: f32 = load member:m@0
            %4: f32 = select %0, %1, %2
            %5: f32 = select %0, %2, %1
            %6: f32 = divide %4, %5
            %7: f32 = multiply %3, %1
            %8: f32, %9: f32 = if %0 {
              %10: f32 = negate %6
              yield %10, %7
            } else {
              %11: f32 = add %6, %7
              yield %11, %7
            }
            return scratch:f@0 = %8, scratch:f@1 = %9
        "#]]
        .assert_eq(&transformed(text, super::run));
    }

    #[test]
    fn operations_with_inner_operands_or_effects_are_not_hoisted() {
        let text = "
            %c: bool = load scratch:b@0 %a: f32 = load scratch:f@0 %i: i32 = load scratch:i@0
            %r: f32 = if %c {
                %x: f32 = negate %a %q: f32 = divide %a, %x
                %u: f32 = rand %l: f32 = load local:s@%i
                store local:s@0, %u yield %q
            } else {
                %y: f32 = abs %a %q2: f32 = divide %a, %y
                %u2: f32 = rand %l2: f32 = load local:s@%i
                store local:s@0, %u2 yield %q2
            }
            return scratch:f@0 = %r";
        let unchanged = transformed(text, |_| ());
        assert_eq!(transformed(text, super::run), unchanged);
    }

    #[test]
    fn stores_stay_where_they_are() {
        let text = "
            %c: bool = load scratch:b@0 %a: f32 = load scratch:f@0
            if %c {
                store local:s@0, %a %x: f32 = negate %a store local:s@1, %x yield
            } else {
                store local:s@2, %a %y: f32 = negate %a store local:s@3, %y yield
            }
            return";
        expect![[r#"
            %2: f32 = negate %1
            if %0 {
              store local:s@0, %1
              store local:s@1, %2
              yield
            } else {
              store local:s@2, %1
              store local:s@3, %2
              yield
            }
            return
        "#]]
        .assert_eq(&transformed(text, super::run));
    }

    #[test]
    fn loads_choose_their_index() {
        let text = "
            %c: bool = load scratch:b@0 %i: i32 = load scratch:i@0 %j: i32 = load scratch:i@1
            %r: f32 = if %c {
                %x: f32 = load buffer:t@%i yield %x
            } else {
                %y: f32 = load buffer:t@%j %z: f32 = negate %y yield %z
            }
            return scratch:f@0 = %r";
        expect![[r#"
            %3: i32 = select %0, %1, %2
            %4: f32 = load buffer:t@%3
            %5: f32 = if %0 {
              yield %4
            } else {
              %6: f32 = negate %4
              yield %6
            }
            return scratch:f@0 = %5
        "#]]
        .assert_eq(&transformed(text, super::run));
    }

    #[test]
    fn keeps_results() {
        check_preserves(super::run);
    }
}
