//! Loops that test before each iteration.
//!
//! Loops of the representation test after each iteration, and an `if` in front of them tests the initial values: this
//! is the lowering of a `while` in the source. This pass reverses it for readability: the loop's body becomes one `if`,
//! whose condition is that of the next iteration. Results are unchanged.

use std::collections::{HashMap, HashSet};

use rtsl_ir::{
    CompareOp, Constant, Effect, Function, Op, OpKind, Region, Scalar, Value, Values, Variable,
};

/// The greatest size of a condition that is moved.
const MAX_CONDITION: usize = 12;

/// A loop's body in `while` form: `head`, then `round` while `condition` is true.
pub(crate) struct WhileForm<'a> {
    pub head: &'a [Op],
    pub condition: Value,
    pub round: &'a Region,
    /// The next carried values.
    pub next: &'a [Value],
}

/// Returns the `while` form of a body rewritten by [`run`].
pub(crate) fn while_form(body: &Region) -> Option<WhileForm<'_>> {
    let (last, head) = body.ops.split_last()?;
    let OpKind::If { condition, then, otherwise } = &last.kind else { return None };
    let is_whole = body.yields.iter().copied().eq(last.results.iter());
    let (again, next) = then.yields.split_first()?;
    let (over, kept) = otherwise.yields.split_first()?;
    let is_while = is_whole
        && kept == body.params
        && is_constant(then, *again, true)
        && is_constant(otherwise, *over, false);
    is_while.then_some(WhileForm { head, condition: *condition, round: then, next })
}

fn is_constant(region: &Region, value: Value, is: bool) -> bool {
    let defines = |op: &Op| op.results.iter().any(|result| result == value);
    region.ops.iter().any(|op| defines(op) && op.kind == OpKind::Constant(Constant::Bool(is)))
}

/// Rewrites the loops of `function` where possible.
pub(crate) fn run(function: &mut Function) {
    let mut definitions = HashMap::new();
    function.body.for_each_op(&mut |op| {
        if op.results.count == 1 && is_pure(op, &function.variables) {
            definitions.insert(op.results.get(0), op.kind.clone());
        }
    });
    let mut body = std::mem::take(&mut function.body);
    let mut rotation = Rotation { function, definitions, substitutes: HashMap::new() };
    rotation.region(&mut body);
    let substitutes = rotation.substitutes;
    body.for_each_use_mut(&mut |value| {
        while let Some(substitute) = substitutes.get(value) {
            *value = *substitute;
        }
    });
    function.body = body;
}

fn is_pure(op: &Op, variables: &[Variable]) -> bool {
    op.kind.regions().next().is_none() && op.kind.effect(variables) == Effect::None
}

struct Rotation<'a> {
    function: &'a mut Function,
    /// The definitions of values without effects and regions.
    definitions: HashMap<Value, OpKind>,
    substitutes: HashMap<Value, Value>,
}

/// A loop that tests after each iteration.
struct Round<'a> {
    initial: &'a [Value],
    body: &'a Region,
    inside: HashSet<Value>,
}

impl Rotation<'_> {
    fn region(&mut self, region: &mut Region) {
        let mut ops = Vec::with_capacity(region.ops.len());
        for mut op in std::mem::take(&mut region.ops) {
            op.kind.regions_mut().for_each(|region| self.region(region));
            match self.rotated(&op) {
                Some(rotated) => ops.extend(rotated),
                None => ops.push(op),
            }
        }
        region.ops = ops;
    }

    fn rotated(&mut self, op: &Op) -> Option<Vec<Op>> {
        match &op.kind {
            OpKind::If { condition, then, otherwise } => {
                self.guarded(op.results, *condition, then, otherwise)
            }
            OpKind::Loop { initial, body } => {
                let round = Round::new(initial, body);
                if !self.begins(&round) {
                    return None;
                }
                let body = self.rotate(&round, None)?;
                let kind = OpKind::Loop { initial: initial.clone(), body };
                Some(vec![Op { kind, ..op.clone() }])
            }
            _ => None,
        }
    }

    /// Matches an `if` around a loop that yields the loop's results, or its initial values.
    fn guarded(
        &mut self,
        results: Values,
        condition: Value,
        then: &Region,
        otherwise: &Region,
    ) -> Option<Vec<Op>> {
        let (inner, before) = then.ops.split_last()?;
        let OpKind::Loop { initial, body } = &inner.kind else { return None };
        let mut moved = before.iter().chain(&otherwise.ops);
        if !moved.all(|op| is_pure(op, &self.function.variables)) {
            return None;
        }
        let begun = |value: Value| {
            let carried = inner.results.iter().position(|result| result == value);
            carried.map_or(value, |carried| initial[carried])
        };
        let mut yields = then.yields.iter().zip(&otherwise.yields);
        if !yields.all(|(a, b)| self.is_same(begun(*a), *b)) {
            return None;
        }
        let body = self.rotate(&Round::new(initial, body), Some(condition))?;
        for (result, value) in results.iter().zip(&then.yields) {
            self.function.names.keep(result, *value);
            self.substitutes.insert(result, *value);
        }
        let kind = OpKind::Loop { initial: initial.clone(), body };
        let rotated = Op { kind, ..inner.clone() };
        Some(before.iter().chain(&otherwise.ops).cloned().chain([rotated]).collect())
    }

    /// Returns the body that tests first, where the test of the initial values is `start`, or is known to be true.
    fn rotate(&mut self, round: &Round<'_>, start: Option<Value>) -> Option<Region> {
        let (again, next) = round.body.yields.split_first()?;
        let mut head = Vec::new();
        let condition = self.condition(round, *again, start, &mut head)?;
        let constant = |function: &mut Function, ops: &mut Vec<Op>, is| {
            function.push(ops, Scalar::Bool, OpKind::Constant(Constant::Bool(is)))
        };
        let mut ops = round.body.ops.clone();
        let more = constant(self.function, &mut ops, true);
        let yields = [more].into_iter().chain(next.iter().copied()).collect();
        let mut then = Region { params: Vec::new(), ops, yields };
        remove_unused(&mut then, &self.function.variables);
        let mut ops = Vec::new();
        let over = constant(self.function, &mut ops, false);
        let yields = [over].into_iter().chain(round.body.params.iter().copied()).collect();
        let otherwise = Region { params: Vec::new(), ops, yields };
        let scalars = then.yields.iter().map(|value| self.function.scalar(*value));
        let scalars: Vec<Scalar> = scalars.collect();
        let results = self.function.new_values(&scalars);
        let kind = OpKind::If { condition, then, otherwise };
        head.push(Op { results, precise: false, kind });
        let params = round.body.params.clone();
        Some(Region { params, ops: head, yields: results.iter().collect() })
    }

    /// Returns the loop's condition in terms of its carried values; `None` if it differs from that of the initial
    /// values.
    fn condition(
        &mut self,
        round: &Round<'_>,
        again: Value,
        start: Option<Value>,
        to: &mut Vec<Op>,
    ) -> Option<Value> {
        let is_start = |rotation: &Self, value| start.is_none_or(|it| rotation.is_same(it, value));
        let carried = round.carried(again).find(|index| is_start(self, round.initial[*index]));
        if let Some(index) = carried {
            return Some(round.body.params[index]);
        }
        if !round.inside.contains(&again) {
            return is_start(self, again).then_some(again);
        }
        let mut kind = self.definitions.get(&again)?.clone();
        let mut starts = Vec::new();
        if let Some(start) = start {
            let start = self.definitions.get(&start)?;
            let asked = [start.clone(), mirrored(start)];
            let is_same = |it: &&OpKind| without_operands(it) == without_operands(&kind);
            asked.iter().find(is_same)?.for_each_operand(|operand| starts.push(operand));
        }
        let mut operands = Vec::new();
        kind.for_each_operand(|operand| operands.push(operand));
        let mut mapped = Vec::new();
        for (index, operand) in operands.into_iter().enumerate() {
            mapped.push(self.condition(round, operand, starts.get(index).copied(), to)?);
        }
        if to.len() >= MAX_CONDITION {
            return None;
        }
        let mut mapped = mapped.into_iter();
        kind.for_each_operand_mut(|operand| *operand = mapped.next().unwrap_or(*operand));
        Some(self.function.push(to, self.function.scalar(again), kind))
    }

    /// True if the condition holds for the initial values, as far as comparisons of constants determine it.
    fn begins(&self, round: &Round<'_>) -> bool {
        let first = |value: Value| {
            let carried = round.carried(value).next();
            match self.definitions.get(&carried.map_or(value, |index| round.initial[index]))? {
                OpKind::Constant(Constant::I32(value)) => Some(i64::from(*value)),
                OpKind::Constant(Constant::U32(value)) => Some(i64::from(*value)),
                _ => None,
            }
        };
        let Some(OpKind::Compare(op, a, b)) = self.definitions.get(&round.body.yields[0]) else {
            return false;
        };
        let (Some(a), Some(b)) = (first(*a), first(*b)) else { return false };
        match op {
            CompareOp::Equal => a == b,
            CompareOp::NotEqual => a != b,
            CompareOp::Less => a < b,
            CompareOp::LessEqual => a <= b,
            CompareOp::Greater => a > b,
            CompareOp::GreaterEqual => a >= b,
        }
    }

    /// True for one value, or equal constants.
    fn is_same(&self, a: Value, b: Value) -> bool {
        let constant = |value: Value| match self.definitions.get(&value) {
            Some(OpKind::Constant(constant)) => Some(*constant),
            _ => None,
        };
        a == b || constant(a).is_some_and(|a| constant(b) == Some(a))
    }
}

impl<'a> Round<'a> {
    fn new(initial: &'a [Value], body: &'a Region) -> Round<'a> {
        let mut inside: HashSet<Value> = body.params.iter().copied().collect();
        body.for_each_op(&mut |op| inside.extend(op.results.iter()));
        Round { initial, body, inside }
    }

    /// Returns the indices of the carried values whose next value this is.
    fn carried(&self, value: Value) -> impl Iterator<Item = usize> + '_ {
        let next = self.body.yields.iter().skip(1).enumerate();
        next.filter(move |(_, next)| **next == value).map(|(index, _)| index)
    }
}

/// Returns a comparison with exchanged operands; other operations unchanged.
fn mirrored(kind: &OpKind) -> OpKind {
    match *kind {
        OpKind::Compare(op, a, b) => OpKind::Compare(op.mirrored(), b, a),
        _ => kind.clone(),
    }
}

fn without_operands(kind: &OpKind) -> OpKind {
    let mut kind = kind.clone();
    kind.for_each_operand_mut(|operand| *operand = Value(0));
    kind
}

/// Removes unused operations of the region.
fn remove_unused(region: &mut Region, variables: &[Variable]) {
    let mut used: HashSet<Value> = region.yields.iter().copied().collect();
    let mut kept = Vec::with_capacity(region.ops.len());
    for op in std::mem::take(&mut region.ops).into_iter().rev() {
        if is_pure(&op, variables) && !op.results.iter().any(|result| used.contains(&result)) {
            continue;
        }
        op.kind.for_each_operand(|operand| {
            used.insert(operand);
        });
        op.kind.regions().for_each(|region| {
            region.for_each_use(&mut |value| {
                used.insert(value);
            })
        });
        kept.push(op);
    }
    kept.reverse();
    region.ops = kept;
}
