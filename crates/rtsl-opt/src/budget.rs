//! Budgets: ends loops that run too long.
//!
//! A budget is the number of loop iterations that a ray may run in a call, over all loops together. The loop that
//! exceeds it ends after that iteration, and so does every later loop: each body runs once, as it always does. At its
//! end the function then reports that the budget was used up. So the work of a call is bounded, and results within the
//! budget are the same as without one.
//!
//! Loops that other passes have removed or unrolled do not count. Those passes therefore run whenever there is a
//! budget, at every level of optimisation: exhaustion of the budget is part of the result and the same at all levels.

use rtsl_ir::{
    BinaryOp, CompareOp, Constant, ConstantPool, Function, Index, Op, OpKind, Region, Scalar,
    Value, Variable, VariableId, VariableKind,
};

use crate::mem2reg;

/// The greatest budget: low enough that the last iterations do not overflow an i32.
pub const MAX_BUDGET: u32 = 1 << 30;

/// Bounds the loop iterations of `function`; a budget above [`MAX_BUDGET`] is reduced to it.
pub fn run(function: &mut Function, budget: u32) {
    if !has_loop(&function.body) {
        return;
    }
    let counter = function.intern_variable(Variable {
        kind: VariableKind::Local,
        name: "#budget".to_owned(),
        scalar: Scalar::I32,
        len: 1,
    });
    let mut constants = ConstantPool::of(function);
    let one = constants.intern(&mut function.values, Constant::I32(1));
    let limit = Constant::I32(budget.min(MAX_BUDGET) as i32);
    let limit = constants.intern(&mut function.values, limit);
    let mut body = std::mem::take(&mut function.body);
    let mut instrumentation = Instrumentation { function, counter, one, limit };
    instrumentation.region(&mut body);
    instrumentation.report(&mut body);
    function.body = body;
    constants.define_in(function);
    // Promotion turns the counter into a value and removes its variable, which is the last.
    mem2reg::promote(function, &[counter]);
    function.variables.pop();
}

fn has_loop(region: &Region) -> bool {
    let mut found = false;
    region.for_each_op(&mut |op| found |= matches!(op.kind, OpKind::Loop { .. }));
    found
}

struct Instrumentation<'a> {
    function: &'a mut Function,
    counter: VariableId,
    one: Value,
    limit: Value,
}

impl Instrumentation<'_> {
    fn region(&mut self, region: &mut Region) {
        for op in &mut region.ops {
            for region in op.kind.regions_mut() {
                self.region(region);
            }
            if let OpKind::Loop { body, .. } = &mut op.kind {
                self.count(body);
            }
        }
    }

    /// Counts an iteration at the start of a loop's body. The comparison with the budget is at its end, when nested
    /// loops have counted theirs.
    fn count(&mut self, body: &mut Region) {
        let mut start = Vec::new();
        let count = self.load(&mut start);
        let kind = OpKind::Binary(BinaryOp::Add, count, self.one);
        let next = self.function.push(&mut start, Scalar::I32, kind);
        let kind = OpKind::Store(self.counter, Index::Constant(0), next);
        start.push(Op { results: Default::default(), precise: false, kind });
        body.ops.splice(0..0, start);

        let count = self.load(&mut body.ops);
        let kind = OpKind::Compare(CompareOp::LessEqual, count, self.limit);
        let within = self.function.push(&mut body.ops, Scalar::Bool, kind);
        let kind = OpKind::Binary(BinaryOp::And, body.yields[0], within);
        body.yields[0] = self.function.push(&mut body.ops, Scalar::Bool, kind);
    }

    fn report(&mut self, body: &mut Region) {
        let count = self.load(&mut body.ops);
        let kind = OpKind::Compare(CompareOp::Greater, count, self.limit);
        let condition = self.function.push(&mut body.ops, Scalar::Bool, kind);
        let report = Op { results: Default::default(), precise: false, kind: OpKind::ReportBudget };
        let then = Region { ops: vec![report], ..Region::default() };
        let kind = OpKind::If { condition, then, otherwise: Region::default() };
        body.ops.push(Op { results: Default::default(), precise: false, kind });
    }

    fn load(&mut self, ops: &mut Vec<Op>) -> Value {
        self.function.push(ops, Scalar::I32, OpKind::Load(self.counter, Index::Constant(0)))
    }
}

#[cfg(test)]
mod tests {
    use expect_test::expect;

    use crate::testing::{check_preserves, function_of, outcome, transformed};

    #[test]
    fn the_counter_goes_through_loops_and_ifs() {
        let text = "
            %c: bool = load scratch:b@0
            if %c {
                loop () {
                    repeat %c
                }
                yield
            } else { yield }
            return";
        expect![[r#"
            %0: i32 = constant 0
            %1: i32 = constant 1
            %2: i32 = constant 7
            %4: i32 = if %3 {
              %5: i32 = loop (%6: i32 = %0) {
                %7: i32 = add %6, %1
                %8: bool = less_equal %7, %2
                %9: bool = and %3, %8
                repeat %9, %7
              }
              yield %5
            } else {
              yield %0
            }
            %10: bool = greater %4, %2
            if %10 {
              report_budget
              yield
            } else {
              yield
            }
            return
        "#]]
        .assert_eq(&transformed(text, |function| super::run(function, 7)));
    }

    #[test]
    fn an_endless_loop_ends_and_reports() {
        let text = "
            %t: bool = constant true %0: i32 = constant 0 %1: i32 = constant 1
            %n: i32 = loop (%i: i32 = %0) {
                loop () { repeat %t }
                %next: i32 = add %i, %1
                repeat %t, %next
            }
            %m: i32 = loop (%i2: i32 = %0) { %next2: i32 = add %i2, %1 repeat %t, %next2 }
            return scratch:i@0 = %n, scratch:i@1 = %m";
        let mut function = function_of(text);
        super::run(&mut function, 100);
        let (variables, outcome) = outcome(&function, &[]);
        assert!(outcome.budget_exceeded);
        assert_eq!(variables[1][..2], [rtsl_ir::Constant::I32(1), rtsl_ir::Constant::I32(1)]);
    }

    #[test]
    fn a_budget_that_is_just_enough_is_no_report() {
        let text = "
            %0: i32 = constant 0 %1: i32 = constant 1 %10: i32 = constant 10
            %n: i32 = loop (%i: i32 = %0) {
                %next: i32 = add %i, %1
                %again: bool = less %next, %10
                repeat %again, %next
            }
            return scratch:i@0 = %n";
        for (budget, exceeded, count) in [(10, false, 10), (9, true, 10), (3, true, 4)] {
            let mut function = function_of(text);
            super::run(&mut function, budget);
            let (variables, outcome) = outcome(&function, &[]);
            assert_eq!(outcome.budget_exceeded, exceeded, "{budget}");
            assert_eq!(variables[1][0], rtsl_ir::Constant::I32(count), "{budget}");
        }
    }

    #[test]
    fn keeps_results_within_the_budget() {
        check_preserves(|function| super::run(function, 100_000));
    }
}
