//! Branches and loops: real ones if all rays agree, masks if they may diverge.

use rtsl_abi::CallMode;
use rtsl_ir::{Constant, Scalar, Value};

use super::cost::AGREED_SPECULATION_LIMIT;
use super::{LowerError, Lowering};
use crate::kernel::{Op, OpKind, Region, Type};

/// The lanes that take a side of a branch.
#[derive(Clone, Copy)]
enum Wanted {
    /// Those where the condition is true.
    True,
    /// Those where the condition is true, with unspecified results in the other lanes.
    TrueAlone,
    /// Those where the condition is false.
    False,
}

impl Lowering<'_> {
    /// True if rays may diverge at this condition. One ray never does.
    fn diverges(&self, condition: Value) -> bool {
        self.kernel.width > 1 && self.uniformity.varies(condition)
    }

    // Branches.

    pub(super) fn lower_if(
        &mut self,
        op: &rtsl_ir::Op,
        condition: Value,
        then: &rtsl_ir::Region,
        otherwise: &rtsl_ir::Region,
    ) -> Result<(), LowerError> {
        let diverges = self.diverges(condition);
        let seldom = self.seldom.contains(&condition);
        let condition = self.value(condition);
        let is_single = self.kernel.mode == CallMode::Single;
        let limit = match diverges || is_single {
            true => self.speculation_limit(),
            false => AGREED_SPECULATION_LIMIT,
        };
        let is_short = |side| self.speculation_cost(side).is_some_and(|cost| cost <= limit);
        let mut results = match (is_short(then) && !seldom, is_short(otherwise)) {
            (true, true) => {
                let then = self.lower_ops(then)?;
                let otherwise = self.lower_ops(otherwise)?;
                self.select_each(condition, &then, &otherwise)
            }
            _ if !diverges => {
                self.rare_sides += u32::from(seldom);
                let then = self.lower_region(then)?;
                self.rare_sides -= u32::from(seldom);
                self.branch_agreed(op, condition, then, otherwise)?
            }
            (false, true) => {
                let otherwise = self.lower_ops(otherwise)?;
                self.branch_over(condition, then, &otherwise, Wanted::True)?
            }
            (true, false) => {
                let then = self.lower_ops(then)?;
                self.branch_over(condition, otherwise, &then, Wanted::False)?
            }
            (false, false) => {
                let nothing = self.unspecified_each(then);
                let then = self.branch_over(condition, then, &nothing, Wanted::TrueAlone)?;
                self.branch_over(condition, otherwise, &then, Wanted::False)?
            }
        };
        // A value from outside that both sides yield is the same for all rays.
        for (result, (a, b)) in results.iter_mut().zip(then.yields.iter().zip(&otherwise.yields)) {
            if a == b {
                *result = self.value(*a);
            }
        }
        self.set_results(op, &results);
        Ok(())
    }

    fn select_each(&mut self, condition: Value, a: &[Value], b: &[Value]) -> Vec<Value> {
        let pairs = a.iter().zip(b);
        pairs.map(|(a, b)| self.select(condition, *a, *b)).collect()
    }

    fn unspecified_each(&mut self, region: &rtsl_ir::Region) -> Vec<Value> {
        let scalars = region.yields.iter().map(|value| self.function.scalar(*value));
        let scalars: Vec<Scalar> = scalars.collect();
        scalars.into_iter().map(|scalar| self.pure(OpKind::Unspecified, scalar)).collect()
    }

    /// Lowers a branch that all rays take the same way.
    fn branch_agreed(
        &mut self,
        op: &rtsl_ir::Op,
        condition: Value,
        then: Region,
        otherwise: &rtsl_ir::Region,
    ) -> Result<Vec<Value>, LowerError> {
        let otherwise = self.lower_region(otherwise)?;
        if then.ops.is_empty() && otherwise.ops.is_empty() {
            return Ok(self.select_each(condition, &then.yields, &otherwise.yields));
        }
        let condition = self.any(condition);
        let types = self.types_of(op.results.iter());
        Ok(self.push_control(OpKind::If { condition, then, otherwise }, &types))
    }

    /// Runs `side` for the lanes that take it, if there are any; returns its values in those lanes and `others`
    /// elsewhere.
    fn branch_over(
        &mut self,
        condition: Value,
        side: &rtsl_ir::Region,
        others: &[Value],
        wanted: Wanted,
    ) -> Result<Vec<Value>, LowerError> {
        let wants = match wanted {
            Wanted::True | Wanted::TrueAlone => condition,
            Wanted::False => self.not(condition),
        };
        let mask = self.and(self.mask, wants);
        let any = self.any(mask);
        let outer_open = std::mem::take(&mut self.open);
        let outer_mask = std::mem::replace(&mut self.mask, mask);
        let outer_diverged = std::mem::replace(&mut self.diverged, true);
        self.depth += 1;
        let yields = self.lower_ops(side)?;
        self.depth -= 1;
        let merged = match wanted {
            Wanted::True => self.select_each(condition, &yields, others),
            Wanted::False => self.select_each(condition, others, &yields),
            Wanted::TrueAlone => yields,
        };
        let ops = std::mem::replace(&mut self.open, outer_open);
        self.mask = outer_mask;
        self.diverged = outer_diverged;
        Ok(self.join(any, ops, merged, others))
    }

    /// Adds an `if` that executes `ops` and gives `yields`, or `others` if it is not taken; values that are the same in
    /// both are omitted.
    fn join(
        &mut self,
        condition: Value,
        ops: Vec<Op>,
        yields: Vec<Value>,
        others: &[Value],
    ) -> Vec<Value> {
        let differ: Vec<bool> = yields.iter().zip(others).map(|(a, b)| a != b).collect();
        let pick = |values: &[Value]| -> Vec<Value> {
            let picked = values.iter().zip(&differ).filter(|(_, differ)| **differ);
            picked.map(|(value, _)| *value).collect()
        };
        let then = Region { params: Vec::new(), ops, yields: pick(&yields) };
        let otherwise = Region { yields: pick(others), ..Region::default() };
        let types: Vec<Type> =
            then.yields.iter().map(|value| Type::lanes(self.ty(*value).scalar)).collect();
        let results = if then.ops.is_empty() && then.yields.is_empty() {
            Default::default()
        } else {
            self.push(OpKind::If { condition, then, otherwise }, &types, false)
        };
        let mut joined = results.iter();
        let merged = yields.iter().zip(&differ);
        merged
            .map(|(value, differ)| if *differ { joined.next().expect("one each") } else { *value })
            .collect()
    }

    fn lower_region(&mut self, region: &rtsl_ir::Region) -> Result<Region, LowerError> {
        let outer = std::mem::take(&mut self.open);
        self.depth += 1;
        let yields = self.lower_ops(region)?;
        self.depth -= 1;
        let ops = std::mem::replace(&mut self.open, outer);
        Ok(Region { params: Vec::new(), ops, yields })
    }

    // Loops.

    pub(super) fn lower_loop(
        &mut self,
        op: &rtsl_ir::Op,
        initial: &[Value],
        body: &rtsl_ir::Region,
    ) -> Result<(), LowerError> {
        let initial = initial.iter().map(|value| self.value(*value)).collect();
        if self.diverges(body.yields[0]) {
            self.loop_while_any(op, initial, body)
        } else {
            self.loop_agreed(op, initial, body)
        }
    }

    /// Returns the packet types of values of the function, by the uniformity analysis.
    fn types_of(&self, values: impl Iterator<Item = Value>) -> Vec<Type> {
        let ty = |value| Type {
            scalar: self.function.scalar(value),
            lanes: self.uniformity.varies(value),
        };
        values.map(ty).collect()
    }

    /// Opens the body of a loop with carried values of these types; returns the region open before.
    fn open_loop(&mut self, body: &rtsl_ir::Region, params: &[Value]) -> Vec<Op> {
        for (param, value) in body.params.iter().zip(params) {
            self.values[*param] = Some(*value);
        }
        std::mem::take(&mut self.open)
    }

    /// Lowers a loop that all its rays leave together.
    fn loop_agreed(
        &mut self,
        op: &rtsl_ir::Op,
        initial: Vec<Value>,
        body: &rtsl_ir::Region,
    ) -> Result<(), LowerError> {
        let types = self.types_of(body.params.iter().copied());
        let params: Vec<Value> = self.new_values(&types).iter().collect();
        let outer = self.open_loop(body, &params);
        self.depth += 1;
        let mut yields = self.lower_ops(body)?;
        self.depth -= 1;
        yields[0] = self.any(yields[0]);
        let ops = std::mem::replace(&mut self.open, outer);
        let kind = OpKind::Loop { initial, body: Region { params, ops, yields } };
        // Values that are lanes only initially are uniform after the last iteration.
        let types = self.types_of(op.results.iter());
        let results = self.push_control(kind, &types);
        self.set_results(op, &results);
        Ok(())
    }

    /// Lowers a loop that rays leave at different times. It carries the mask of those still in it, the carried values,
    /// and for each uniform carried value that is read after the loop a copy in lanes, since there the rays differ.
    fn loop_while_any(
        &mut self,
        op: &rtsl_ir::Op,
        initial: Vec<Value>,
        body: &rtsl_ir::Region,
    ) -> Result<(), LowerError> {
        let types = self.types_of(body.params.iter().copied());
        let is_read: Vec<bool> = op.results.iter().map(|result| self.is_used(result)).collect();
        let copied: Vec<usize> =
            (0..types.len()).filter(|&index| is_read[index] && !types[index].lanes).collect();

        let mut all_types = vec![Type::MASK];
        all_types.extend_from_slice(&types);
        all_types.extend(copied.iter().map(|&index| Type::lanes(types[index].scalar)));
        let mut all_initial = vec![self.mask];
        all_initial.extend(initial);
        for &index in &copied {
            let unspecified = self.pure(OpKind::Unspecified, types[index].scalar);
            all_initial.push(unspecified);
        }
        let all_params: Vec<Value> = self.new_values(&all_types).iter().collect();
        let (live, params) = (all_params[0], &all_params[1..=types.len()]);
        let copies = &all_params[1 + types.len()..];

        let outer_open = self.open_loop(body, params);
        let outer_mask = std::mem::replace(&mut self.mask, live);
        let outer_diverged = std::mem::replace(&mut self.diverged, true);
        self.depth += 1;
        let yields = self.lower_ops(body)?;
        self.depth -= 1;
        let (again, next) = (yields[0], &yields[1..]);
        let still_live = self.and(live, again);
        let any = self.any(still_live);
        let mut all_yields = vec![any, still_live];
        for (index, (next, param)) in next.iter().zip(params).enumerate() {
            let keep = is_read[index] && types[index].lanes;
            all_yields.push(if keep { self.select(live, *next, *param) } else { *next });
        }
        for (&index, copy) in copied.iter().zip(copies) {
            let kept = self.select(live, next[index], *copy);
            all_yields.push(kept);
        }
        let ops = std::mem::replace(&mut self.open, outer_open);
        self.mask = outer_mask;
        self.diverged = outer_diverged;

        let region = Region { params: all_params, ops, yields: all_yields };
        let kind = OpKind::Loop { initial: all_initial, body: region };
        let all_results: Vec<Value> = self.push(kind, &all_types, false).iter().collect();
        let mut results = all_results[1..=types.len()].to_vec();
        for (&index, copy) in copied.iter().zip(&all_results[1 + types.len()..]) {
            results[index] = *copy;
        }
        self.set_results(op, &results);
        Ok(())
    }

    /// Runs `body` once for each distinct value in the lanes of `index`, an i32, with that uniform value and under the
    /// mask of the lanes that have it. `body` returns lanes of `scalars`, which are combined.
    pub(super) fn for_each_distinct(
        &mut self,
        index: Value,
        scalars: &[Scalar],
        body: impl FnOnce(&mut Self, Value, Value) -> Vec<Value>,
    ) -> Vec<Value> {
        let mut types = vec![Type::MASK];
        types.extend(scalars.iter().map(|scalar| Type::lanes(*scalar)));
        let mut initial = vec![self.mask];
        initial.extend(scalars.iter().map(|scalar| self.constant(Constant::zero(*scalar))));
        let params: Vec<Value> = self.new_values(&types).iter().collect();
        let left = params[0];

        let outer_open = std::mem::take(&mut self.open);
        let first =
            self.push(OpKind::First(left, index), &[Type::uniform(Scalar::I32)], false).get(0);
        let same = self.compare(rtsl_ir::CompareOp::Equal, index, first);
        let mask = self.and(left, same);
        let values = body(self, first, mask);
        let differ = self.not(same);
        let still_left = self.and(left, differ);
        let any = self.any(still_left);
        let mut yields = vec![any, still_left];
        let merged = self.select_each(mask, &values, &params[1..]);
        yields.extend(merged);
        let ops = std::mem::replace(&mut self.open, outer_open);

        let kind = OpKind::Loop { initial, body: Region { params, ops, yields } };
        self.push(kind, &types, false).iter().skip(1).collect()
    }
}
