//! Weights of traced rays: bounds on the contribution of the answers, so that hosts can skip rays that contribute
//! little light.
//!
//! # The rule
//!
//! Every component of an answer has a bound: the sum over its uses, where a use is
//!
//! | use | bound |
//! |---|---|
//! | a product, also within an fma | `abs` of the factor, times the product's bound if all its uses are in this table |
//! | a negation, a choice of `select`, a yield of an `if` | the bound of the result |
//! | anything else | none |
//!
//! A factor counts once, however often it occurs: contraction repeats a product in each sum that it is part of. The
//! weight of a request is the greatest bound of its components, or remains 1 if a component has none. A factor must be
//! known before the request, and the use must not be in a further loop, which would repeat it. Operations that compute
//! a factor after the request are duplicated before it; [`gvn`](crate::gvn) merges the two. Requests whose weight is
//! not the constant 1 keep theirs.
//!
//! A NaN factor has the effect of `max`: the weight is NaN, for which no host skips a ray, or the bound of the other
//! components; the product is NaN with any answer.
//!
//! This pass runs before those that only make a function faster, and at every level, so that weights depend on the
//! source alone: they have the same bits at every level of optimisation and for every caller. Before it
//! [`mem2reg`](crate::mem2reg) and [`dce`] leave only the uses that count, and those of reports, which do not.

use rtsl_ir::{
    BinaryOp, Constant, Function, IndexVec, Op, OpKind, Region, Scalar, UnaryOp, Value, Values,
    Variable, VariableKind,
};

use crate::dce;

/// The greatest number of uses visited and operations copied per request; beyond it there is no bound.
const MAX_STEPS: u32 = 128;

/// Computes the weights of all requests of `function`.
pub fn run(function: &mut Function) {
    let needed = dce::needed_beside_reports(function);
    let mut body = std::mem::take(&mut function.body);
    let mut traces = false;
    body.for_each_op(&mut |op| traces |= matches!(op.kind, OpKind::Trace { .. }));
    if traces {
        let flow = Flow::of(function, &body, needed);
        let visible = IndexVec::filled(function.values.len(), false);
        Weighing { visible, function, flow }.region(&mut body);
    }
    function.body = body;
}

/// A use of a value.
#[derive(Clone, Copy)]
enum Use {
    /// As a factor of a product.
    Factor {
        /// The other factor.
        by: Value,
        /// The product, if nothing is added to it.
        product: Option<Value>,
    },
    /// Passed on, possibly negated, as this value.
    Passed(Value),
    Other,
}

impl Use {
    fn is_factor(self, value: Value) -> bool {
        matches!(self, Use::Factor { by, .. } if by == value)
    }
}

/// The definitions and uses of values.
struct Flow {
    /// For each value, the operation that defines it if it can be duplicated.
    definitions: IndexVec<Value, Option<Op>>,
    /// For each value its uses, with the index of the innermost loop.
    uses: IndexVec<Value, Vec<(Use, u32)>>,
    /// For each value, the index of the innermost loop around its definition; 0 for none.
    loops: IndexVec<Value, u32>,
    loop_count: u32,
    /// For each value, true if more than reports need it; `None` if all are needed.
    needed: Option<IndexVec<Value, bool>>,
}

impl Flow {
    fn of(function: &Function, body: &Region, needed: Option<IndexVec<Value, bool>>) -> Self {
        let count = function.values.len();
        let mut flow = Flow {
            definitions: IndexVec::filled(count, None),
            uses: IndexVec::filled(count, Vec::new()),
            loops: IndexVec::filled(count, 0),
            loop_count: 0,
            needed,
        };
        flow.region(&function.variables, body, 0, None);
        flow
    }

    /// Collects a region in this loop, whose yields become these results.
    fn region(
        &mut self,
        variables: &[Variable],
        region: &Region,
        within: u32,
        results: Option<Values>,
    ) {
        for op in &region.ops {
            self.op(variables, op, within);
        }
        for (position, value) in region.yields.iter().enumerate() {
            // The first yield of a loop is its condition.
            let target = match results {
                Some(results) => Some(results.get(position as u32)),
                None => position.checked_sub(1).and_then(|it| region.params.get(it)).copied(),
            };
            if target.is_some_and(|target| !self.is_needed(target)) {
                continue;
            }
            let passed = results.and(target).map(Use::Passed);
            self.add(*value, passed.unwrap_or(Use::Other), within);
        }
    }

    fn op(&mut self, variables: &[Variable], op: &Op, within: u32) {
        for result in op.results.iter() {
            self.loops[result] = within;
        }
        if can_be_copied(&op.kind, variables) {
            self.definitions[op.results.get(0)] = Some(op.clone());
        }
        self.operands(op, within);
        match &op.kind {
            OpKind::If { condition: _, then, otherwise } => {
                self.region(variables, then, within, Some(op.results));
                self.region(variables, otherwise, within, Some(op.results));
            }
            OpKind::Loop { initial: _, body } => {
                self.loop_count += 1;
                self.region(variables, body, self.loop_count, None);
            }
            _ => {}
        }
    }

    fn is_needed(&self, value: Value) -> bool {
        self.needed.as_ref().is_none_or(|needed| needed[value])
    }

    fn operands(&mut self, op: &Op, within: u32) {
        let is_reported = matches!(op.kind, OpKind::Report(..));
        let is_pure = op.results.count > 0 && op.kind.regions().next().is_none();
        let is_unneeded = is_pure && op.results.iter().all(|result| !self.is_needed(result));
        if is_reported || is_unneeded && !matches!(op.kind, OpKind::Trace { .. }) {
            return;
        }
        let result = op.results.iter().next();
        let mut product = |a, b, product| {
            self.add(a, Use::Factor { by: b, product }, within);
            self.add(b, Use::Factor { by: a, product }, within);
        };
        match op.kind {
            OpKind::Binary(BinaryOp::Multiply, a, b) => product(a, b, result),
            OpKind::Fma(a, b, c) => {
                product(a, b, None);
                self.add(c, Use::Other, within);
            }
            OpKind::Unary(UnaryOp::Negate, a) => {
                self.add(a, result.map_or(Use::Other, Use::Passed), within);
            }
            OpKind::Select(condition, a, b) => {
                self.add(condition, Use::Other, within);
                self.add(a, result.map_or(Use::Other, Use::Passed), within);
                self.add(b, result.map_or(Use::Other, Use::Passed), within);
            }
            OpKind::Loop { ref initial, ref body } => {
                for (initial, param) in initial.iter().zip(&body.params) {
                    if self.is_needed(*param) {
                        self.add(*initial, Use::Other, within);
                    }
                }
            }
            _ => op.kind.for_each_operand(|value| self.add(value, Use::Other, within)),
        }
    }

    fn add(&mut self, value: Value, how: Use, within: u32) {
        self.uses[value].push((how, within));
    }
}

/// True if the operation depends on its operands only and is cheap enough to duplicate.
pub(crate) fn can_be_copied(kind: &OpKind, variables: &[Variable]) -> bool {
    match kind {
        OpKind::Constant(_)
        | OpKind::Unary(..)
        | OpKind::Binary(..)
        | OpKind::Compare(..)
        | OpKind::Select(..)
        | OpKind::Fma(..)
        | OpKind::Convert(..)
        | OpKind::Bitcast(..)
        | OpKind::Length(_) => true,
        OpKind::Load(variable, _) => variables[variable.0 as usize].kind != VariableKind::Local,
        OpKind::Store(..)
        | OpKind::If { .. }
        | OpKind::Loop { .. }
        | OpKind::Trace { .. }
        | OpKind::Occluded { .. }
        | OpKind::LightCount
        | OpKind::LightSample { .. }
        | OpKind::Ambient
        | OpKind::Rand
        | OpKind::Query(..)
        | OpKind::Seed(_)
        | OpKind::Derivative(..)
        | OpKind::ChainRule(..)
        | OpKind::ReferenceCall(_)
        | OpKind::IsSet(..)
        | OpKind::ReferenceCount(_)
        | OpKind::Report(..)
        | OpKind::ReportBudget => false,
    }
}

struct Weighing<'a> {
    function: &'a mut Function,
    flow: Flow,
    /// For each value, true if it can be used at the current position.
    visible: IndexVec<Value, bool>,
}

impl Weighing<'_> {
    fn region(&mut self, region: &mut Region) {
        self.show(region.params.iter().copied(), true);
        let mut ops = Vec::with_capacity(region.ops.len());
        for mut op in std::mem::take(&mut region.ops) {
            for region in op.kind.regions_mut() {
                self.region(region);
            }
            if self.is_unweighed(&op.kind) {
                self.weigh(&mut op, &mut ops);
            }
            self.show(op.results.iter(), true);
            ops.push(op);
        }
        ops.iter().for_each(|op| self.show(op.results.iter(), false));
        self.show(region.params.iter().copied(), false);
        region.ops = ops;
    }

    /// Marks values as visible; only values of the original function are queried.
    fn show(&mut self, values: impl Iterator<Item = Value>, visible: bool) {
        for value in values {
            if let Some(entry) = self.visible.get_mut(value) {
                *entry = visible;
            }
        }
    }

    fn is_unweighed(&self, kind: &OpKind) -> bool {
        let OpKind::Trace { weight, .. } = kind else { return false };
        let definition = &self.flow.definitions[*weight];
        let one = OpKind::Constant(Constant::F32(1.0));
        definition.as_ref().is_some_and(|op| op.kind == one)
    }

    /// Computes the weight of a request; the operations are appended to `before`.
    fn weigh(&mut self, op: &mut Op, before: &mut Vec<Op>) {
        let within = self.flow.loops[op.results.get(0)];
        let code = Code::default();
        let mut bounds = Bounds { weighing: self, within, code, steps: MAX_STEPS };
        let found = bounds.greatest(op.results);
        let code = bounds.code;
        if let (Some(found), OpKind::Trace { weight, .. }) = (found, &mut op.kind) {
            before.extend(code.ops);
            *weight = found;
        }
    }
}

/// The operations before a request that compute its weight.
#[derive(Default)]
struct Code {
    ops: Vec<Op>,
    /// Pairs of a copied value and its copy.
    copies: Vec<(Value, Value)>,
}

/// The bounds of one request's components.
struct Bounds<'w, 'f> {
    weighing: &'w mut Weighing<'f>,
    /// The loop that contains the request.
    within: u32,
    code: Code,
    /// The number of uses and operations that may still be visited.
    steps: u32,
}

impl Bounds<'_, '_> {
    fn greatest(&mut self, components: Values) -> Option<Value> {
        let mut greatest = None;
        // An unused component has the bound 0, which never exceeds the others.
        let used = |component: &Value| !self.weighing.flow.uses[*component].is_empty();
        let used: Vec<Value> = components.iter().filter(used).collect();
        for component in used {
            let bound = self.bound(component)?;
            greatest = Some(match greatest {
                None => bound,
                Some(before) => self.push(OpKind::Binary(BinaryOp::Max, before, bound)),
            });
        }
        Some(greatest.unwrap_or_else(|| self.zero()))
    }

    fn bound(&mut self, value: Value) -> Option<Value> {
        let uses = self.weighing.flow.uses[value].clone();
        let mut sum = None;
        for (position, (how, within)) in uses.iter().enumerate() {
            self.steps = self.steps.checked_sub(1)?;
            if *within != self.within {
                return None;
            }
            let bound = match *how {
                Use::Factor { by, product } => {
                    let is_same = |other: &(Use, u32)| other.0.is_factor(by);
                    if uses[..position].iter().any(is_same) {
                        continue;
                    }
                    let is_repeated = uses[position + 1..].iter().any(is_same);
                    self.product(by, product.filter(|_| !is_repeated))?
                }
                Use::Passed(to) => self.bound(to)?,
                Use::Other => return None,
            };
            sum = Some(match sum {
                None => bound,
                Some(before) => self.push(OpKind::Binary(BinaryOp::Add, before, bound)),
            });
        }
        Some(sum.unwrap_or_else(|| self.zero()))
    }

    fn product(&mut self, by: Value, product: Option<Value>) -> Option<Value> {
        let factor = self.copy(by)?;
        let factor = self.push(OpKind::Unary(UnaryOp::Abs, factor));
        let (ops, copies) = (self.code.ops.len(), self.code.copies.len());
        match product.and_then(|product| self.bound(product)) {
            Some(bound) => Some(self.push(OpKind::Binary(BinaryOp::Multiply, factor, bound))),
            None => {
                self.code.ops.truncate(ops);
                self.code.copies.truncate(copies);
                Some(factor)
            }
        }
    }

    /// Returns a copy of a value before the request.
    fn copy(&mut self, value: Value) -> Option<Value> {
        if self.weighing.visible[value] {
            return Some(value);
        }
        if let Some((_, copy)) = self.code.copies.iter().find(|(of, _)| *of == value) {
            return Some(*copy);
        }
        let mut op = self.weighing.flow.definitions[value].clone()?;
        self.steps = self.steps.checked_sub(1)?;
        let mut operands = Vec::new();
        op.kind.for_each_operand(|operand| operands.push(operand));
        let mut copied = Vec::with_capacity(operands.len());
        for operand in operands {
            copied.push(self.copy(operand)?);
        }
        let mut copied = copied.into_iter();
        op.kind.for_each_operand_mut(|operand| *operand = copied.next().unwrap_or(*operand));
        op.results = self.weighing.function.new_values(&[self.weighing.function.scalar(value)]);
        let copy = op.results.get(0);
        self.code.ops.push(op);
        self.code.copies.push((value, copy));
        Some(copy)
    }

    fn zero(&mut self) -> Value {
        self.push(OpKind::Constant(Constant::F32(0.0)))
    }

    fn push(&mut self, kind: OpKind) -> Value {
        self.weighing.function.push(&mut self.code.ops, Scalar::F32, kind)
    }
}

#[cfg(test)]
mod tests {
    use expect_test::expect;

    use crate::testing::{check_preserves, function_of, transformed};

    /// Runs the pass on a trace with this continuation: `%r`, `%g`, `%b` are the answer; `%a` to `%d` are known before
    /// it.
    fn weighed(rest: &str) -> String {
        let text = format!(
            "%a: f32 = load scratch:f@0 %b: f32 = load scratch:f@1 %c: f32 = load scratch:f@2
            %d: f32 = load scratch:f@3 %t: bool = load scratch:b@0 %one: f32 = constant 1
            %red: f32, %green: f32, %blue: f32 = trace %a, %a, %a, %a, %a, %a, %a, %one
            {rest}"
        );
        transformed(&text, |function| {
            crate::dce::run(function);
            super::run(function);
        })
    }

    #[test]
    fn the_greatest_of_three_factors() {
        expect![[r#"
            %4: f32 = constant 1.0
            %5: f32 = abs %1
            %6: f32 = abs %2
            %7: f32 = max %5, %6
            %8: f32 = abs %3
            %9: f32 = max %7, %8
            %10: f32, %11: f32, %12: f32 = trace %0, %0, %0, %0, %0, %0, %0, %9
            %13: f32 = multiply %10, %1
            %14: f32 = multiply %2, %11
            %15: f32 = fma %3, %12, %0
            return scratch:f@0 = %13, scratch:f@1 = %14, scratch:f@2 = %15
        "#]]
        .assert_eq(&weighed(
            "%x: f32 = multiply %red, %b %y: f32 = multiply %c, %green
            %z: f32 = fma %d, %blue, %a
            return scratch:f@0 = %x, scratch:f@1 = %y, scratch:f@2 = %z",
        ));
    }

    /// Values that only reports need have no influence, nor have such results of branches and values of loops.
    #[test]
    fn reports_do_not_count() {
        expect![[r#"
            %4: f32 = constant 1.0
            %5: f32 = abs %1
            %6: f32 = abs %1
            %7: f32 = max %5, %6
            %8: f32 = abs %1
            %9: f32 = max %7, %8
            %10: f32, %11: f32, %12: f32 = trace %0, %0, %0, %0, %0, %0, %0, %9
            %13: f32 = multiply %10, %1
            %14: f32 = multiply %1, %11
            %15: f32 = multiply %1, %12
            report print %10
            %16: f32 = multiply %11, %2
            report assignment %16
            %17: f32 = if %3 {
              yield %12
            } else {
              yield %2
            }
            report print %17
            %18: f32 = loop (%19: f32 = %10) {
              %20: bool = constant false
              report print %19
              %21: f32 = add %19, %10
              repeat %20, %21
            }
            report return %18
            return scratch:f@0 = %13, scratch:f@1 = %14, scratch:f@2 = %15
        "#]]
        .assert_eq(&weighed(
            "%x: f32 = multiply %red, %b %y: f32 = multiply %b, %green %z: f32 = multiply %b, %blue
            report print %red %e: f32 = multiply %green, %c report assignment %e
            %f: f32 = if %t { yield %blue } else { yield %c } report print %f
            %g: f32 = loop (%h: f32 = %red) {
                %no: bool = constant false report print %h %k: f32 = add %h, %red repeat %no, %k
            }
            report return %g
            return scratch:f@0 = %x, scratch:f@1 = %y, scratch:f@2 = %z",
        ));
    }

    #[test]
    fn a_factor_from_behind_the_request_is_computed_in_front_of_it() {
        expect![[r#"
            %2: f32 = constant 1.0
            %3: f32 = load member:m@0
            %4: f32 = constant 0.25
            %5: f32 = multiply %3, %4
            %6: f32 = abs %5
            %7: f32, %8: f32, %9: f32 = trace %0, %0, %0, %0, %0, %0, %0, %6
            if %1 {
              %10: f32 = load member:m@0
              %11: f32 = constant 0.25
              %12: f32 = multiply %10, %11
              %13: f32 = multiply %7, %12
              store local:s@0, %13
              yield
            } else {
              yield
            }
            %14: f32 = load local:s@0
            return scratch:f@0 = %14
        "#]]
        .assert_eq(&weighed(
            "if %t {
                %m: f32 = load member:m@0 %quarter: f32 = constant 0.25
                %f: f32 = multiply %m, %quarter
                %x: f32 = multiply %red, %f
                store local:s@0, %x
                yield
            } else { yield }
            %s: f32 = load local:s@0
            return scratch:f@0 = %s",
        ));
    }

    #[test]
    fn uses_add_up_and_products_of_products_multiply() {
        expect![[r#"
            %4: f32 = constant 1.0
            %5: f32 = abs %1
            %6: f32 = abs %2
            %7: f32 = multiply %5, %6
            %8: f32 = abs %3
            %9: f32 = add %7, %8
            %10: f32, %11: f32, %12: f32 = trace %0, %0, %0, %0, %0, %0, %0, %9
            %13: f32 = multiply %10, %1
            %14: f32 = multiply %13, %2
            %15: f32 = negate %10
            %16: f32 = fma %15, %3, %14
            return scratch:f@0 = %16
        "#]]
        .assert_eq(&weighed(
            "%x: f32 = multiply %red, %b %y: f32 = multiply %x, %c
            %n: f32 = negate %red %z: f32 = fma %n, %d, %y
            return scratch:f@0 = %z",
        ));
    }

    #[test]
    fn a_product_that_contraction_repeats_counts_once() {
        expect![[r#"
            %4: f32 = constant 1.0
            %5: f32 = abs %1
            %6: f32, %7: f32, %8: f32 = trace %0, %0, %0, %0, %0, %0, %0, %5
            %9: f32 = multiply %6, %1
            %10: f32 = if %3 {
              %11: f32 = fma %6, %1, %2
              yield %11
            } else {
              yield %9
            }
            return scratch:f@0 = %10
        "#]]
        .assert_eq(&weighed(
            "%p: f32 = multiply %red, %b
            %x: f32 = if %t { %s: f32 = fma %red, %b, %c yield %s } else { yield %p }
            return scratch:f@0 = %x",
        ));
    }

    #[test]
    fn a_branch_result_counts_by_its_uses() {
        expect![[r#"
            %4: f32 = constant 1.0
            %5: f32 = abs %1
            %6: f32 = abs %2
            %7: f32 = max %5, %6
            %8: f32, %9: f32, %10: f32 = trace %0, %0, %0, %0, %0, %0, %0, %7
            %11: f32, %12: f32 = if %3 {
              yield %8, %9
            } else {
              yield %0, %1
            }
            %13: f32 = select %3, %12, %0
            %14: f32 = multiply %11, %1
            %15: f32 = multiply %13, %2
            return scratch:f@0 = %14, scratch:f@1 = %15
        "#]]
        .assert_eq(&weighed(
            "%p: f32, %q: f32 = if %t { yield %red, %green } else { yield %a, %b }
            %chosen: f32 = select %t, %q, %a
            %x: f32 = multiply %p, %b %y: f32 = multiply %chosen, %c
            return scratch:f@0 = %x, scratch:f@1 = %y",
        ));
    }

    #[test]
    fn other_uses_leave_the_weight_at_one() {
        let others = [
            // A sum, an output, and a factor that depends on the answer.
            "%x: f32 = add %red, %b return scratch:f@0 = %x",
            "%x: f32 = multiply %red, %b return scratch:f@0 = %x, scratch:f@1 = %red",
            "%x: f32 = multiply %red, %red return scratch:f@0 = %x",
            "%x: f32 = fma %red, %a, %red return scratch:f@0 = %x",
            // A random number drawn after the request.
            "%n: f32 = rand %x: f32 = multiply %red, %n return scratch:f@0 = %x",
            // The factor applies once per iteration.
            "%s: f32 = loop (%sum: f32 = %a) {
                %x: f32 = fma %red, %b, %sum %more: bool = less %x, %c repeat %more, %x
            } return scratch:f@0 = %s",
        ];
        for other in others {
            let text = weighed(other);
            assert!(text.lines().next().unwrap().contains("= constant 1.0"), "{text}");
            assert!(text.contains("trace %0, %0, %0, %0, %0, %0, %0, %"), "{text}");
            assert!(!text.contains("abs") && !text.contains("max"), "{text}");
        }
    }

    /// A long chain takes neither much time nor much of the stack.
    #[test]
    fn a_long_chain_has_no_bound() {
        let mut rest = String::from("%x0: f32 = multiply %red, %b %m0: f32 = sqrt %a");
        for i in 1..20_000 {
            rest +=
                &format!(" %m{i}: f32 = sqrt %m{p} %x{i}: f32 = multiply %x{p}, %x{p}", p = i - 1);
        }
        rest += " %y: f32 = multiply %green, %m19999
            return scratch:f@0 = %x19999, scratch:f@1 = %y";
        assert!(!weighed(&rest).contains("abs"));
    }

    /// Known weights are kept.
    #[test]
    fn runs_once() {
        let text = "
            %a: f32 = load scratch:f@0 %one: f32 = constant 1
            %red: f32, %green: f32, %blue: f32 = trace %a, %a, %a, %a, %a, %a, %a, %one
            %x: f32 = multiply %red, %a
            return scratch:f@0 = %x";
        let mut function = function_of(text);
        super::run(&mut function);
        let once = function.to_string();
        super::run(&mut function);
        assert_eq!(function.to_string(), once);
    }

    #[test]
    fn keeps_results() {
        check_preserves(super::run);
    }
}
