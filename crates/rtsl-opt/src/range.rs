//! Range analysis of integers: removes clamps and tests that known bounds make redundant.
//!
//! Every integer and bool has an [`Interval`], found forward over the structured code by interval arithmetic (Harrison,
//! "Compiler Analysis of the Value Ranges for Variables", 1977). Inside an `if` the condition narrows the values it
//! compares, and the condition of a loop narrows the carried values. Carried values and locals are iterated to a
//! fixpoint: a bound that keeps moving jumps to the next constant of the function or the type's limit (widening) and is
//! then refined from there (narrowing).
//!
//! Where intervals permit it,
//! - integers and bools with one possible value become constants, `min` and `max` become one of their operands, and a
//!   mask that keeps all bits is removed;
//! - division of a non-negative value by a power of two becomes a shift, the remainder a mask;
//! - a u32 below 2^31 is converted to f32 through i32, for which machines have an instruction.

use std::collections::{BTreeMap, HashMap};

use rtsl_ir::{
    BinaryOp, CompareOp, Constant, ConstantPool, Effect, Function, IndexVec, Interval, Op, OpKind,
    Region, Scalar, UnaryOp, Value, VariableId, VariableKind,
};

use crate::conditions::Conditions;
use crate::substitution::Substitution;

/// The number of rounds before moving bounds are widened.
const ROUNDS_BEFORE_WIDENING: u32 = 3;

/// The number of rounds after which every bound that still moves, in all loops and locals, becomes the type's limit.
const MAX_ROUNDS: u32 = 12;

/// The number of rounds that refine widened bounds.
const NARROWING_ROUNDS: u32 = 2;

/// Applies range analysis to `function`.
pub fn run(function: &mut Function) {
    run_knowing(function, &BTreeMap::new());
}

/// Applies range analysis to `function` with known scalars of members.
pub fn run_knowing(function: &mut Function, known: &BTreeMap<(VariableId, u32), Constant>) {
    let ranges = Ranges::find(function, known);
    let mut pool = ConstantPool::of(function);
    let mut body = std::mem::take(&mut function.body);
    let mut use_ = Use { ranges, pool: &mut pool, function, substitution: Substitution::default() };
    use_.region(&mut body);
    use_.substitution.keep_names(&mut use_.function.names);
    function.body = body;
    pool.define_in(function);
}

/// The ranges of the values of a function.
struct Ranges {
    /// The range of each value; `None` for f32 and for unreachable values.
    of: IndexVec<Value, Option<Interval>>,
    scalars: IndexVec<Value, Scalar>,
    /// For each variable, the range of a load.
    variables: IndexVec<VariableId, Option<Interval>>,
    /// For each local, the union of the values stored in the current round.
    stored: IndexVec<VariableId, Option<Interval>>,
    /// The ranges of the carried values of each loop, by its first parameter.
    params: HashMap<Value, Vec<Option<Interval>>>,
    conditions: Conditions,
    /// The integer constants of the function, in order: most loops are bounded by one of them.
    limits: Vec<i64>,
    phase: Phase,
    changed: bool,
}

#[derive(Clone, Copy, PartialEq, Eq)]
enum Phase {
    /// Bounds may move outward.
    Growing,
    /// Bounds that move jump to the next constant.
    Widening,
    /// Bounds that move become the type's limits.
    GivingUp,
    /// Bounds move inward.
    Narrowing,
}

impl Ranges {
    fn find(function: &Function, known: &BTreeMap<(VariableId, u32), Constant>) -> Ranges {
        let variables = (0..).map(VariableId).zip(&function.variables);
        let mut ranges = Ranges {
            of: IndexVec::filled(function.values.len(), None),
            scalars: function.values.iter().copied().collect(),
            variables: variables
                .map(|(id, variable)| match variable.kind {
                    VariableKind::Local => {
                        Interval::all(variable.scalar).map(|_| Interval::point(0))
                    }
                    _ => known_range(id, variable.len, known).or(Interval::all(variable.scalar)),
                })
                .collect(),
            stored: IndexVec::filled(function.variables.len(), None),
            params: HashMap::new(),
            conditions: Conditions::default(),
            limits: limits(&function.body),
            phase: Phase::Growing,
            changed: true,
        };
        let mut round = 0;
        while std::mem::take(&mut ranges.changed) {
            round += 1;
            ranges.phase = match round {
                0..=ROUNDS_BEFORE_WIDENING => Phase::Growing,
                _ if round < MAX_ROUNDS => Phase::Widening,
                _ => Phase::GivingUp,
            };
            ranges.round(function);
        }
        ranges.phase = Phase::Narrowing;
        for _ in 0..NARROWING_ROUNDS {
            ranges.round(function);
        }
        ranges
    }

    fn round(&mut self, function: &Function) {
        self.region(&function.body);
        for variable in (0..self.stored.len() as u32).map(VariableId) {
            if let Some(stored) = self.stored[variable].take() {
                let scalar = function.variable(variable).scalar;
                let next = self.variables[variable].map(|_| stored.hull(Interval::point(0)));
                self.variables[variable] = self.moved(scalar, self.variables[variable], next);
            }
        }
    }

    fn region(&mut self, region: &Region) {
        for op in &region.ops {
            self.op(op);
        }
    }

    fn op(&mut self, op: &Op) {
        match &op.kind {
            OpKind::If { condition, then, otherwise } => {
                self.assuming(*condition, true, |ranges| ranges.region(then));
                self.assuming(*condition, false, |ranges| ranges.region(otherwise));
                for (index, result) in op.results.iter().enumerate() {
                    let sides = [then.yields[index], otherwise.yields[index]];
                    let sides = sides.map(|value| self.get(value));
                    self.set(result, sides[0].zip(sides[1]).map(|(a, b)| a.hull(b)));
                }
            }
            OpKind::Loop { initial, body } => {
                self.run_loop(initial, body);
                for (result, next) in op.results.iter().zip(&body.yields[1..]) {
                    self.set(result, self.get(*next));
                }
            }
            kind => {
                if let OpKind::Store(variable, _, value) = kind {
                    self.store(*variable, *value);
                }
                self.plain(op);
            }
        }
    }

    /// Computes the ranges of an operation without regions.
    fn plain(&mut self, op: &Op) {
        let Some(result) = op.results.iter().next() else { return };
        self.conditions.remember(op);
        for result in op.results.iter() {
            self.set(result, Interval::all(self.scalar(result)));
        }
        if let Some(range) = self.computed(&op.kind) {
            self.set(result, Some(range));
        }
    }

    fn computed(&self, kind: &OpKind) -> Option<Interval> {
        match *kind {
            OpKind::Constant(constant) => Interval::of(constant),
            OpKind::Unary(op, a) => Interval::unary(op, self.scalar(a), self.get(a)?),
            OpKind::Binary(op, a, b) => {
                Interval::binary(op, self.scalar(a), self.get(a)?, self.get(b)?)
            }
            OpKind::Compare(op, a, b) => Some(Interval::compare(op, self.get(a)?, self.get(b)?)),
            OpKind::Select(_, a, b) => Some(self.get(a)?.hull(self.get(b)?)),
            OpKind::Convert(to, a) => Interval::convert(self.scalar(a), to, self.get(a)),
            OpKind::Load(variable, _) => self.variables[variable],
            OpKind::Length(_) | OpKind::LightCount => {
                Some(Interval { low: 0, high: i64::from(i32::MAX) })
            }
            _ => None,
        }
    }

    fn store(&mut self, variable: VariableId, value: Value) {
        let range = self.get(value);
        let stored = &mut self.stored[variable];
        *stored = stored.map_or(range, |stored| range.map(|range| stored.hull(range)));
    }

    fn run_loop(&mut self, initial: &[Value], body: &Region) {
        let Some(first) = body.params.first() else {
            return self.region(body);
        };
        let initial: Vec<_> = initial.iter().map(|value| self.get(*value)).collect();
        let params = self.params.entry(*first).or_insert_with(|| initial.clone()).clone();
        for (param, range) in body.params.iter().zip(&params) {
            self.set(*param, *range);
        }
        self.region(body);
        let next = self.carried_on(body);
        let params = params.iter().zip(initial).zip(next).zip(&body.params);
        let params = params
            .map(|(((old, initial), next), param)| {
                let new = initial.zip(next).map(|(initial, next)| initial.hull(next));
                self.moved(self.scalar(*param), *old, new)
            })
            .collect();
        self.params.insert(*first, params);
    }

    /// Returns the next carried values of a loop that repeats; `None` for f32.
    fn carried_on(&mut self, body: &Region) -> Vec<Option<Interval>> {
        let (again, next) = body.yields.split_first().expect("a loop's body yields a bool");
        let truths = self.conditions.conclusions(*again, true);
        let sides: HashMap<Value, Value> =
            body.ops.iter().flat_map(|op| taken(op, &truths)).collect();
        let next: Vec<Value> =
            next.iter().map(|value| *sides.get(value).unwrap_or(value)).collect();
        self.assuming(*again, true, |ranges| next.iter().map(|value| ranges.get(*value)).collect())
    }

    /// Runs `work` under the assumption that a bool is `truth`.
    fn assuming<T>(&mut self, value: Value, truth: bool, work: impl FnOnce(&mut Self) -> T) -> T {
        let before = self.assume(value, truth);
        let result = work(self);
        self.restore(before);
        result
    }

    /// Narrows ranges under the assumption that a bool is `truth`; returns the previous ranges.
    fn assume(&mut self, value: Value, truth: bool) -> Vec<(Value, Option<Interval>)> {
        let mut before = Vec::new();
        for (value, truth) in self.conditions.conclusions(value, truth) {
            before.push((value, self.get(value)));
            self.set(value, Some(Interval::point(i64::from(truth))));
            if let Some((op, a, b)) = self.conditions.comparison(value) {
                let op = if truth { op } else { opposite(op) };
                self.narrow(op, a, b, &mut before);
            }
        }
        before
    }

    fn restore(&mut self, before: Vec<(Value, Option<Interval>)>) {
        for (value, range) in before.into_iter().rev() {
            self.set(value, range);
        }
    }

    fn narrow(
        &mut self,
        op: CompareOp,
        a: Value,
        b: Value,
        before: &mut Vec<(Value, Option<Interval>)>,
    ) {
        let (Some(left), Some(right)) = (self.get(a), self.get(b)) else { return };
        // If it cannot hold, the region is never executed.
        let Some((left, right)) = Interval::where_holds(op, left, right) else { return };
        for (value, range) in [(a, left), (b, right)] {
            before.push((value, self.get(value)));
            self.set(value, Some(range));
        }
    }

    /// Combines the previous and the new range of a value according to the phase.
    fn moved(
        &mut self,
        scalar: Scalar,
        old: Option<Interval>,
        new: Option<Interval>,
    ) -> Option<Interval> {
        let (old, new, all) = (old?, new?, Interval::all(scalar)?);
        if self.phase == Phase::Narrowing {
            return Some(old.intersection(new).unwrap_or(old));
        }
        let hull = old.hull(new);
        if hull == old {
            return Some(old);
        }
        self.changed = true;
        Some(match self.phase {
            Phase::Growing | Phase::Narrowing => hull,
            Phase::Widening => Interval {
                low: if hull.low < old.low { self.limit_below(hull.low, all) } else { old.low },
                high: if hull.high > old.high {
                    self.limit_above(hull.high, all)
                } else {
                    old.high
                },
            },
            Phase::GivingUp => all,
        })
    }

    /// Returns the greatest limit not above `value`.
    fn limit_below(&self, value: i64, all: Interval) -> i64 {
        let found = self.limits[..self.limits.partition_point(|limit| *limit <= value)].last();
        found.copied().unwrap_or(all.low).max(all.low)
    }

    /// Returns the least limit not below `value`.
    fn limit_above(&self, value: i64, all: Interval) -> i64 {
        let found = self.limits.get(self.limits.partition_point(|limit| *limit < value));
        found.copied().unwrap_or(all.high).min(all.high)
    }

    fn scalar(&self, value: Value) -> Scalar {
        self.scalars[value]
    }

    fn get(&self, value: Value) -> Option<Interval> {
        self.of[value]
    }

    fn set(&mut self, value: Value, range: Option<Interval>) {
        self.of[value] = range;
    }

    /// Adds the range of the function's next value.
    fn add(&mut self, scalar: Scalar, range: Option<Interval>) {
        self.scalars.push(scalar);
        self.of.push(range);
    }
}

/// Returns the integer constants in a region, in order.
fn limits(region: &Region) -> Vec<i64> {
    let mut limits = Vec::new();
    collect_limits(region, &mut limits);
    limits.sort_unstable();
    limits.dedup();
    limits
}

fn collect_limits(region: &Region, limits: &mut Vec<i64>) {
    for op in &region.ops {
        if let OpKind::Constant(constant) = op.kind
            && constant.scalar() != Scalar::Bool
        {
            limits.extend(Interval::of(constant).map(|interval| interval.low));
        }
        op.kind.regions().for_each(|region| collect_limits(region, limits));
    }
}

/// Returns the negation of a comparison of integers.
fn opposite(op: CompareOp) -> CompareOp {
    match op {
        CompareOp::Equal => CompareOp::NotEqual,
        CompareOp::NotEqual => CompareOp::Equal,
        CompareOp::Less => CompareOp::GreaterEqual,
        CompareOp::LessEqual => CompareOp::Greater,
        CompareOp::Greater => CompareOp::LessEqual,
        CompareOp::GreaterEqual => CompareOp::Less,
    }
}

/// For an `if` or select with a known condition, pairs each result with the value it equals.
fn taken(op: &Op, truths: &[(Value, bool)]) -> Vec<(Value, Value)> {
    let truth = |condition| truths.iter().find(|(value, _)| *value == condition).map(|it| it.1);
    match &op.kind {
        OpKind::If { condition, then, otherwise } => match truth(*condition) {
            Some(truth) => {
                let side = if truth { then } else { otherwise };
                op.results.iter().zip(side.yields.iter().copied()).collect()
            }
            None => Vec::new(),
        },
        OpKind::Select(condition, a, b) => match truth(*condition) {
            Some(truth) => vec![(op.results.get(0), if truth { *a } else { *b })],
            None => Vec::new(),
        },
        _ => Vec::new(),
    }
}

/// Returns the hull of the scalars of a variable, if all are known.
fn known_range(
    variable: VariableId,
    len: u32,
    known: &BTreeMap<(VariableId, u32), Constant>,
) -> Option<Interval> {
    let mut ranges =
        (0..len).map(|index| known.get(&(variable, index)).copied().and_then(Interval::of));
    let first = ranges.next()??;
    ranges.try_fold(first, |all, range| Some(all.hull(range?)))
}

/// Rewrites operations using the ranges.
struct Use<'a> {
    ranges: Ranges,
    pool: &'a mut ConstantPool,
    function: &'a mut Function,
    substitution: Substitution,
}

/// The replacement of an operation.
enum Rewritten {
    Value(Value),
    Kind(OpKind),
}

impl Use<'_> {
    fn region(&mut self, region: &mut Region) {
        let mut ops = Vec::with_capacity(region.ops.len());
        for mut op in std::mem::take(&mut region.ops) {
            self.substitution.apply_to_operands(&mut op.kind);
            self.op(op, &mut ops);
        }
        region.ops = ops;
        self.substitution.apply_to_yields(region);
    }

    fn op(&mut self, mut op: Op, ops: &mut Vec<Op>) {
        match &mut op.kind {
            OpKind::If { condition, then, otherwise } => {
                let condition = *condition;
                self.assuming(condition, true, |use_| use_.region(then));
                self.assuming(condition, false, |use_| use_.region(otherwise));
            }
            OpKind::Loop { body, .. } => {
                let params = body.params.first().and_then(|first| self.ranges.params.get(first));
                for (param, range) in body.params.iter().zip(params.cloned().unwrap_or_default()) {
                    self.ranges.set(*param, range);
                }
                self.region(body);
            }
            _ => {
                self.ranges.plain(&op);
                match self.rewritten(&op, ops) {
                    Some(Rewritten::Value(value)) => {
                        return self.substitution.set(op.results.get(0), value);
                    }
                    Some(Rewritten::Kind(kind)) => op.kind = kind,
                    None => {}
                }
            }
        }
        ops.push(op);
    }

    /// Runs `work` under the assumption that a bool is `truth`.
    fn assuming(&mut self, value: Value, truth: bool, work: impl FnOnce(&mut Self)) {
        let before = self.ranges.assume(value, truth);
        work(self);
        self.ranges.restore(before);
    }

    /// Returns the replacement of an operation; operations that it needs are appended to `before`.
    fn rewritten(&mut self, op: &Op, before: &mut Vec<Op>) -> Option<Rewritten> {
        let result = op.results.iter().next()?;
        let scalar = self.ranges.scalar(result);
        if matches!(op.kind, OpKind::Constant(_)) {
            return None;
        }
        if let Some(constant) = self.ranges.get(result).and_then(|it| it.constant(scalar))
            && op.kind.effect(&self.function.variables) == Effect::None
        {
            return Some(Rewritten::Value(self.constant(constant)));
        }
        match op.kind {
            OpKind::Unary(UnaryOp::Abs, a) if self.ranges.get(a)?.low >= 0 => {
                Some(Rewritten::Value(a))
            }
            OpKind::Binary(operator, a, b) => self.rewritten_binary(operator, scalar, a, b),
            OpKind::Convert(Scalar::F32, a) if self.ranges.scalar(a) == Scalar::U32 => {
                if self.ranges.get(a)?.high > i64::from(i32::MAX) {
                    return None;
                }
                let kind = OpKind::Convert(Scalar::I32, a);
                let signed = self.function.push(before, Scalar::I32, kind);
                self.ranges.add(Scalar::I32, self.ranges.get(a));
                Some(Rewritten::Kind(OpKind::Convert(Scalar::F32, signed)))
            }
            _ => None,
        }
    }

    fn rewritten_binary(
        &mut self,
        op: BinaryOp,
        scalar: Scalar,
        a: Value,
        b: Value,
    ) -> Option<Rewritten> {
        let (left, right) = (self.ranges.get(a)?, self.ranges.get(b)?);
        let power = (left.low >= 0).then(|| power_of_two(right)).flatten();
        match op {
            BinaryOp::Min if left.high <= right.low => Some(Rewritten::Value(a)),
            BinaryOp::Min if right.high <= left.low => Some(Rewritten::Value(b)),
            BinaryOp::Max if left.low >= right.high => Some(Rewritten::Value(a)),
            BinaryOp::Max if right.low >= left.high => Some(Rewritten::Value(b)),
            BinaryOp::And if keeps_all_bits(left, right) => Some(Rewritten::Value(a)),
            BinaryOp::And if keeps_all_bits(right, left) => Some(Rewritten::Value(b)),
            BinaryOp::Remainder if left.low >= 0 && left.high < right.low => {
                Some(Rewritten::Value(a))
            }
            BinaryOp::Remainder => {
                let mask = self.constant(Constant::from_bits(scalar, (1 << power?) - 1));
                Some(Rewritten::Kind(OpKind::Binary(BinaryOp::And, a, mask)))
            }
            BinaryOp::Divide => {
                let count = self.constant(Constant::from_bits(scalar, power?));
                Some(Rewritten::Kind(OpKind::Binary(BinaryOp::ShiftRight, a, count)))
            }
            _ => None,
        }
    }

    fn constant(&mut self, constant: Constant) -> Value {
        let value = self.pool.intern(&mut self.function.values, constant);
        if self.ranges.of.get(value).is_none() {
            self.ranges.add(constant.scalar(), None);
        }
        self.ranges.set(value, Interval::of(constant));
        value
    }
}

/// Returns the base-2 logarithm of the single value of the interval, if it is a power of two.
fn power_of_two(interval: Interval) -> Option<u32> {
    let value = u32::try_from(interval.low).ok()?;
    (interval.low == interval.high && value.is_power_of_two()).then(|| value.trailing_zeros())
}

/// True if a mask with this single value keeps all bits of the interval.
fn keeps_all_bits(interval: Interval, mask: Interval) -> bool {
    let used = u64::MAX.checked_shr(interval.high.leading_zeros()).unwrap_or(0) as i64;
    mask.low == mask.high && interval.low >= 0 && mask.low & used == used
}

#[cfg(test)]
mod tests {
    use expect_test::{Expect, expect};

    use crate::testing::{check_preserves, transformed};

    /// Applies range analysis and dead code elimination.
    fn check(text: &str, expected: Expect) {
        let found = transformed(text, |function| {
            super::run(function);
            crate::dce::run(function);
        });
        expected.assert_eq(&found);
    }

    #[test]
    fn masks_make_clamps_unnecessary() {
        let text = "
            %i: i32 = load scratch:i@0 %u: u32 = load scratch:u@0
            %255: i32 = constant 255 %0: i32 = constant 0 %1: i32 = constant 1
            %300: i32 = constant 300
            %masked: i32 = and %i, %255 %next: i32 = add %masked, %1
            %low: i32 = max %next, %0 %clamped: i32 = min %low, %300
            %a: f32 = load member:m@%clamped
            %free: i32 = min %i, %300
            %b: f32 = load member:m@%free
            return scratch:f@0 = %a, scratch:f@1 = %b";
        check(
            text,
            expect![[r#"
                %1: i32 = constant 255
                %2: i32 = constant 1
                %3: i32 = constant 300
                %4: i32 = and %0, %1
                %5: i32 = add %4, %2
                %6: f32 = load member:m@%5
                %7: i32 = min %0, %3
                %8: f32 = load member:m@%7
                return scratch:f@0 = %6, scratch:f@1 = %8
            "#]],
        );
    }

    #[test]
    fn counters_stay_below_their_limit() {
        let text = "
            %x: f32 = load scratch:f@0 %n: i32 = load scratch:i@0
            %0: i32 = constant 0 %1: i32 = constant 1 %99: i32 = constant 99 %100: i32 = constant 100
            %i: i32, %s: f32 = loop (%j: i32 = %0, %sum: f32 = %x) {
                %c: bool = less %j, %100
                %j2: i32, %sum2: f32 = if %c {
                    %low: i32 = max %j, %0 %clamped: i32 = min %low, %99
                    %e: f32 = load buffer:t@%clamped
                    %t: f32 = add %sum, %e
                    %next: i32 = add %j, %1
                    yield %next, %t
                } else { yield %j, %sum }
                repeat %c, %j2, %sum2
            }
            return scratch:f@0 = %s, scratch:i@0 = %i";
        check(
            text,
            expect![[r#"
                %1: i32 = constant 0
                %2: i32 = constant 1
                %3: i32 = constant 100
                %4: i32, %5: f32 = loop (%6: i32 = %1, %7: f32 = %0) {
                  %8: bool = less %6, %3
                  %9: i32, %10: f32 = if %8 {
                    %11: f32 = load buffer:t@%6
                    %12: f32 = add %7, %11
                    %13: i32 = add %6, %2
                    yield %13, %12
                  } else {
                    yield %6, %7
                  }
                  repeat %8, %9, %10
                }
                return scratch:f@0 = %5, scratch:i@0 = %4
            "#]],
        );
    }

    #[test]
    fn counters_of_loops_that_may_be_left_stay_below_their_limit() {
        let text = "
            %c: bool = load scratch:b@0 %0: i32 = constant 0 %1: i32 = constant 1
            %4: i32 = constant 4 %5: i32 = constant 5 %7: i32 = constant 7
            %i: i32 = loop (%j: i32 = %0) {
                %low: i32 = max %j, %0 %clamped: i32 = min %low, %5
                %e: f32 = load buffer:t@%clamped
                store local:s@%clamped, %e
                %next: i32 = add %j, %1 %below: bool = less %next, %5
                %again: bool = and %c, %below
                repeat %again, %next
            }
            %last: i32 = min %i, %7 %f: f32 = load local:s@%last
            return scratch:f@0 = %f, scratch:i@0 = %last";
        check(
            text,
            expect![[r#"
            %1: i32 = constant 0
            %2: i32 = constant 1
            %3: i32 = constant 5
            %4: i32 = loop (%5: i32 = %1) {
              %6: f32 = load buffer:t@%5
              store local:s@%5, %6
              %7: i32 = add %5, %2
              %8: bool = less %7, %3
              %9: bool = and %0, %8
              repeat %9, %7
            }
            %10: f32 = load local:s@%4
            return scratch:f@0 = %10, scratch:i@0 = %4
        "#]],
        );
    }

    #[test]
    fn tables_have_known_entries() {
        let text = "
            %i: i32 = load scratch:i@0 %0: i32 = constant 0 %3: i32 = constant 3
            %4: i32 = constant 4 %6: i32 = constant 6 %2: i32 = constant 2
            store local:r@0, %2 store local:r@1, %3 store local:r@2, %4
            %a: i32 = load local:r@%i
            %b: i32 = add %a, %2
            %low: i32 = max %b, %0 %clamped: i32 = min %low, %6
            return scratch:i@0 = %clamped";
        check(
            text,
            expect![[r#"
                %1: i32 = constant 3
                %2: i32 = constant 4
                %3: i32 = constant 2
                store local:r@0, %3
                store local:r@1, %1
                store local:r@2, %2
                %4: i32 = load local:r@%0
                %5: i32 = add %4, %3
                return scratch:i@0 = %5
            "#]],
        );
    }

    #[test]
    fn division_by_powers_of_two_where_nothing_is_negative() {
        let text = "
            %i: i32 = load scratch:i@0 %u: u32 = load scratch:u@0 %8: u32 = constant 8
            %four: i32 = constant 4
            %a: u32 = divide %u, %8 %b: u32 = remainder %u, %8
            %c: i32 = divide %i, %four
            %f: f32 = convert %a %g: f32 = convert %u
            return scratch:u@0 = %a, scratch:u@1 = %b, scratch:i@0 = %c, scratch:f@0 = %f,
                scratch:f@1 = %g";
        check(
            text,
            expect![[r#"
                %0: u32 = constant 3
                %1: u32 = constant 7
                %4: i32 = constant 4
                %5: u32 = shift_right %3, %0
                %6: u32 = and %3, %1
                %7: i32 = divide %2, %4
                %8: i32 = convert %5
                %9: f32 = convert %8
                %10: f32 = convert %3
                return scratch:u@0 = %5, scratch:u@1 = %6, scratch:i@0 = %7, scratch:f@0 = %9, scratch:f@1 = %10
            "#]],
        );
    }

    #[test]
    fn conditions_decide_others() {
        let text = "
            %i: i32 = load scratch:i@0 %n: i32 = load scratch:i@1 %5: i32 = constant 5
            %9: i32 = constant 9 %0: i32 = constant 0
            %c: bool = less %i, %5 %d: bool = greater %i, %0 %both: bool = and %c, %d
            %r: i32 = if %both {
                %always: bool = less %i, %9 %s: i32 = select %always, %i, %n
                %positive: i32 = abs %s
                yield %positive
            } else { yield %n }
            return scratch:i@0 = %r";
        check(
            text,
            expect![[r#"
                %0: bool = constant true
                %3: i32 = constant 5
                %4: i32 = constant 0
                %5: bool = less %1, %3
                %6: bool = greater %1, %4
                %7: bool = and %5, %6
                %8: i32 = if %7 {
                  %9: i32 = select %0, %1, %2
                  %10: i32 = abs %9
                  yield %10
                } else {
                  yield %2
                }
                return scratch:i@0 = %8
            "#]],
        );
    }

    #[test]
    fn keeps_results() {
        check_preserves(super::run);
    }
}
