//! Range analysis of floats: uses known signs, bounds and NaN flags to remove special cases.
//!
//! Every f32 has a [`FloatInterval`], found forward in one pass: by interval arithmetic with the rounding of the
//! operations themselves, and inside an `if` by its condition. A local holds one of the constants stored to it, if
//! nothing else is stored. Carried values of loops and inputs from callers are unbounded.
//!
//! Where intervals permit it,
//! - floats and comparisons with one possible value become constants;
//! - `min` and `max` become one of their operands;
//! - `abs` of a non-negative value, and the sum of 0 and a value other than -0, become the operand.
//!
//! A quotient by a power of two becomes a product, which has the same bits.
//!
//! For example, the exponential of a negative square loses its clamp against overflow.

use rtsl_ir::{
    BinaryOp, Constant, ConstantPool, Effect, FloatInterval, Function, IndexVec, Interval, Op,
    OpKind, Region, Scalar, UnaryOp, Value, VariableId, VariableKind,
};

use crate::conditions::Conditions;
use crate::substitution::Substitution;

/// Applies range analysis to the floats of `function`.
pub fn run(function: &mut Function) {
    let mut pool = ConstantPool::of(function);
    let mut body = std::mem::take(&mut function.body);
    let floats = Floats::new(function, &body);
    let mut use_ = Use { floats, pool: &mut pool, function, substitution: Substitution::default() };
    use_.region(&mut body);
    use_.substitution.keep_names(&mut use_.function.names);
    function.body = body;
    pool.define_in(function);
}

/// The intervals of the floats of a function.
struct Floats {
    /// The interval of each value; unbounded for other types.
    of: IndexVec<Value, FloatInterval>,
    scalars: IndexVec<Value, Scalar>,
    /// For each variable, the interval of a load.
    variables: IndexVec<VariableId, FloatInterval>,
    conditions: Conditions,
}

impl Floats {
    fn new(function: &Function, body: &Region) -> Floats {
        let variables = function.variables.iter().map(|variable| match variable.kind {
            VariableKind::Local => FloatInterval::of(0.0),
            VariableKind::State
            | VariableKind::Member
            | VariableKind::Parameter
            | VariableKind::Scratch
            | VariableKind::Buffer
            | VariableKind::Accepted => FloatInterval::ALL,
        });
        let mut floats = Floats {
            of: IndexVec::filled(function.values.len(), FloatInterval::ALL),
            scalars: function.values.iter().copied().collect(),
            variables: variables.collect(),
            conditions: Conditions::default(),
        };
        floats.store_constants(body);
        floats
    }

    /// Finds the constants that locals may hold.
    fn store_constants(&mut self, region: &Region) {
        for op in &region.ops {
            match op.kind {
                OpKind::Constant(Constant::F32(value)) => {
                    self.of[op.results.get(0)] = FloatInterval::of(value);
                }
                OpKind::Store(variable, _, value) => {
                    self.variables[variable] = self.variables[variable].hull(self.get(value));
                }
                _ => op.kind.regions().for_each(|region| self.store_constants(region)),
            }
        }
    }

    fn get(&self, value: Value) -> FloatInterval {
        self.of[value]
    }

    fn scalar(&self, value: Value) -> Scalar {
        self.scalars[value]
    }

    /// Computes the interval of an operation without regions.
    fn plain(&mut self, op: &Op) {
        let Some(result) = op.results.iter().next() else { return };
        self.conditions.remember(op);
        if self.scalar(result) == Scalar::F32 {
            self.of[result] = self.computed(&op.kind);
        }
    }

    fn computed(&mut self, kind: &OpKind) -> FloatInterval {
        match *kind {
            OpKind::Constant(Constant::F32(value)) => FloatInterval::of(value),
            OpKind::Unary(op, a) => FloatInterval::unary(op, self.get(a)),
            OpKind::Binary(BinaryOp::Multiply, a, b) if a == b => {
                FloatInterval::square(self.get(a))
            }
            OpKind::Binary(op, a, b) => FloatInterval::binary(op, self.get(a), self.get(b)),
            OpKind::Fma(a, b, c) if a == b => {
                // The square does not depend on the sign.
                let size = FloatInterval::unary(UnaryOp::Abs, self.get(a));
                FloatInterval::fma(size, size, self.get(c))
            }
            OpKind::Fma(a, b, c) => FloatInterval::fma(self.get(a), self.get(b), self.get(c)),
            OpKind::Select(condition, a, b) => {
                let a = self.assuming(condition, true, |floats| floats.get(a));
                let b = self.assuming(condition, false, |floats| floats.get(b));
                a.hull(b)
            }
            OpKind::Convert(Scalar::F32, a) => match Interval::all(self.scalar(a)) {
                Some(integers) => FloatInterval::of_integer(integers),
                None => self.get(a),
            },
            OpKind::Load(variable, _) => self.variables[variable],
            _ => FloatInterval::ALL,
        }
    }

    /// Runs `work` under the assumption that a bool is `truth`.
    fn assuming<T>(&mut self, value: Value, truth: bool, work: impl FnOnce(&mut Self) -> T) -> T {
        let before = self.assume(value, truth);
        let result = work(self);
        self.restore(before);
        result
    }

    /// Narrows intervals under the assumption that a bool is `truth`; returns the previous intervals.
    fn assume(&mut self, value: Value, truth: bool) -> Vec<(Value, FloatInterval)> {
        let mut before = Vec::new();
        for (value, truth) in self.conditions.conclusions(value, truth) {
            if let Some((op, a, b)) = self.conditions.comparison(value)
                && self.scalar(a) == Scalar::F32
            {
                let (left, right) = FloatInterval::where_is(op, truth, self.get(a), self.get(b));
                for (value, interval) in [(a, left), (b, right)] {
                    before.push((value, self.get(value)));
                    self.of[value] = interval;
                }
            }
        }
        before
    }

    fn restore(&mut self, before: Vec<(Value, FloatInterval)>) {
        for (value, interval) in before.into_iter().rev() {
            self.of[value] = interval;
        }
    }
}

/// Rewrites operations using the intervals.
struct Use<'a> {
    floats: Floats,
    pool: &'a mut ConstantPool,
    function: &'a mut Function,
    substitution: Substitution,
}

impl Use<'_> {
    fn region(&mut self, region: &mut Region) {
        let mut ops = Vec::with_capacity(region.ops.len());
        for mut op in std::mem::take(&mut region.ops) {
            self.substitution.apply_to_operands(&mut op.kind);
            match &mut op.kind {
                OpKind::If { condition, then, otherwise } => {
                    let condition = *condition;
                    let sides = [(then, true), (otherwise, false)];
                    let yields = sides.map(|(side, truth)| self.side(condition, truth, side));
                    let [then, otherwise] = yields;
                    for (result, (a, b)) in op.results.iter().zip(then.into_iter().zip(otherwise)) {
                        self.floats.of[result] = a.hull(b);
                    }
                }
                OpKind::Loop { body, .. } => self.region(body),
                _ => {
                    self.floats.plain(&op);
                    if let Some(value) = self.same(&op) {
                        self.substitution.set(op.results.get(0), value);
                        continue;
                    }
                    if let Some(kind) = self.product(&op.kind) {
                        op.kind = kind;
                    }
                }
            }
            ops.push(op);
        }
        region.ops = ops;
        self.substitution.apply_to_yields(region);
    }

    /// Rewrites a region of an `if`; returns the intervals of its yields.
    fn side(&mut self, condition: Value, truth: bool, side: &mut Region) -> Vec<FloatInterval> {
        let before = self.floats.assume(condition, truth);
        self.region(side);
        let yields = side.yields.iter().map(|value| self.floats.get(*value)).collect();
        self.floats.restore(before);
        yields
    }

    /// Returns the value that an operation always equals.
    fn same(&mut self, op: &Op) -> Option<Value> {
        let result = op.results.iter().next()?;
        if matches!(op.kind, OpKind::Constant(_)) {
            return None;
        }
        if let Some(constant) = self.constant(&op.kind, result)
            && op.kind.effect(&self.function.variables) == Effect::None
        {
            return Some(self.interned(constant));
        }
        match op.kind {
            OpKind::Unary(UnaryOp::Abs, a) if self.is_float(a) => {
                self.floats.get(a).is_positive().then_some(a)
            }
            OpKind::Binary(op, a, b) if self.is_float(a) => self.operand(op, a, b),
            _ => None,
        }
    }

    /// Returns the product that is equivalent to a quotient.
    fn product(&mut self, kind: &OpKind) -> Option<OpKind> {
        match *kind {
            OpKind::Binary(BinaryOp::Divide, a, b) if self.is_float(a) => {
                let divisor = self.floats.get(b).constant()?;
                let inverse = Constant::F32(power_of_two_inverse(divisor)?);
                Some(OpKind::Binary(BinaryOp::Multiply, a, self.interned(inverse)))
            }
            _ => None,
        }
    }

    fn interned(&mut self, constant: Constant) -> Value {
        let value = self.pool.intern(&mut self.function.values, constant);
        if self.floats.of.get(value).is_none() {
            self.floats.scalars.push(constant.scalar());
            self.floats.of.push(FloatInterval::ALL);
        }
        if let Constant::F32(number) = constant {
            self.floats.of[value] = FloatInterval::of(number);
        }
        value
    }

    fn is_float(&self, value: Value) -> bool {
        self.floats.scalar(value) == Scalar::F32
    }

    /// Returns the only possible value of a float or a comparison of floats.
    fn constant(&self, kind: &OpKind, result: Value) -> Option<Constant> {
        match *kind {
            OpKind::Compare(op, a, b) if self.is_float(a) => {
                let truth = FloatInterval::compare(op, self.floats.get(a), self.floats.get(b));
                truth.constant(Scalar::Bool)
            }
            _ => self.floats.get(result).constant().map(Constant::F32),
        }
    }

    /// Returns the operand that the operation always equals.
    fn operand(&self, op: BinaryOp, a: Value, b: Value) -> Option<Value> {
        let (left, right) = (self.floats.get(a), self.floats.get(b));
        let is_zero = |it: FloatInterval| it.constant().map(f32::to_bits) == Some(0);
        let numbers = !left.nan && !right.nan;
        // The first operand is the result if both are equal or either is a NaN.
        let first = match op {
            BinaryOp::Min => left.high <= right.low,
            BinaryOp::Max => left.low >= right.high,
            BinaryOp::Add => is_zero(right) && !left.contains(-0.0),
            _ => return None,
        };
        let second = match op {
            BinaryOp::Min => numbers && right.high < left.low,
            BinaryOp::Max => numbers && right.low > left.high,
            _ => is_zero(left) && !right.contains(-0.0),
        };
        if first { Some(a) } else { second.then_some(b) }
    }
}

/// Returns the inverse of a power of two, if it is a normal number.
fn power_of_two_inverse(value: f32) -> Option<f32> {
    let has_one_bit = value.to_bits().trailing_zeros() >= f32::MANTISSA_DIGITS - 1;
    (has_one_bit && value.is_normal() && value.recip().is_normal()).then(|| value.recip())
}

#[cfg(test)]
mod tests {
    use expect_test::{Expect, expect};

    use rtsl_testing::functions::Entropy;

    use super::*;
    use crate::testing::{check_preserves, function_of, outcome, transformed};

    /// Applies range analysis and dead code elimination.
    fn check(text: &str, expected: Expect) {
        let found = transformed(text, |function| {
            run(function);
            crate::dce::run(function);
        });
        expected.assert_eq(&found);
    }

    #[test]
    fn the_exponent_of_a_highlight_is_not_positive() {
        let text = "
            %x: f32 = load scratch:f@0 %y: f32 = load scratch:f@1 %88: f32 = constant 88.7
            %m: f32 = constant -88
            %yy: f32 = multiply %y, %y %s: f32 = fma %x, %x, %yy %n: f32 = negate %s
            %q: f32 = divide %n, %yy
            %low: f32 = max %q, %m %bounded: f32 = min %low, %88 %other: f32 = min %88, %low
            return scratch:f@0 = %bounded, scratch:f@1 = %other";
        check(
            text,
            expect![[r#"
            %2: f32 = constant 88.7
            %3: f32 = constant -88.0
            %4: f32 = multiply %1, %1
            %5: f32 = fma %0, %0, %4
            %6: f32 = negate %5
            %7: f32 = divide %6, %4
            %8: f32 = max %7, %3
            %9: f32 = min %2, %8
            return scratch:f@0 = %8, scratch:f@1 = %9
        "#]],
        );
    }

    #[test]
    fn conditions_determine_signs() {
        let text = "
            %x: f32 = load scratch:f@0 %0: f32 = constant 0 %1: f32 = constant 1
            %c: bool = greater %x, %0
            %r: f32, %s: f32 = if %c {
                %a: f32 = abs %x %m: f32 = max %x, %0 %p: f32 = add %m, %0
                %d: bool = less %p, %0 %t: f32 = select %d, %1, %a
                yield %t, %p
            } else {
                %a2: f32 = abs %x %d2: bool = greater %x, %1 %t2: f32 = select %d2, %1, %a2
                yield %t2, %0
            }
            %k: f32 = max %s, %0
            return scratch:f@0 = %r, scratch:f@1 = %k";
        check(
            text,
            expect![[r#"
            %0: bool = constant false
            %2: f32 = constant 0.0
            %3: f32 = constant 1.0
            %4: bool = greater %1, %2
            %5: f32, %6: f32 = if %4 {
              %7: f32 = select %0, %3, %1
              yield %7, %1
            } else {
              %8: f32 = abs %1
              %9: f32 = select %0, %3, %8
              yield %9, %2
            }
            return scratch:f@0 = %5, scratch:f@1 = %6
        "#]],
        );
    }

    #[test]
    fn zeros_and_nans_stay() {
        let text = "
            %x: f32 = load scratch:f@0 %0: f32 = constant 0 %n: f32 = constant -0.0
            %1: f32 = constant 1
            %z: f32 = abs %x %m: f32 = max %n, %z %k: f32 = min %m, %0
            %u: f32 = min %1, %x %c: bool = less_equal %u, %1
            %nan: bool = not_equal %z, %z
            %p: f32 = add %x, %0
            return scratch:f@0 = %k, scratch:f@1 = %p, scratch:b@0 = %c, scratch:b@1 = %nan";
        check(
            text,
            expect![[r#"
            %0: bool = constant true
            %2: f32 = constant 0.0
            %3: f32 = constant -0.0
            %4: f32 = abs %1
            %5: f32 = max %3, %4
            %6: f32 = min %5, %2
            %7: bool = not_equal %4, %4
            %8: f32 = add %1, %2
            return scratch:f@0 = %6, scratch:f@1 = %8, scratch:b@0 = %0, scratch:b@1 = %7
        "#]],
        );
    }

    #[test]
    fn quotients_by_powers_of_two_are_products() {
        let text = "
            %x: f32 = load scratch:f@0 %4: f32 = constant -4 %3: f32 = constant 3
            %small: f32 = constant 5.877472e-39 %large: f32 = constant 1.7014118e38
            %a: f32 = divide %x, %4 %b: f32 = divide %x, %3 %c: f32 = divide %x, %small
            %d: f32 = divide %x, %large
            return scratch:f@0 = %a, scratch:f@1 = %b, scratch:f@2 = %c, scratch:f@3 = %d";
        check(
            text,
            expect![[r#"
            %0: f32 = constant -0.25
            %2: f32 = constant 3.0
            %3: f32 = constant 5.877472e-39
            %4: f32 = constant 1.7014118e38
            %5: f32 = multiply %1, %0
            %6: f32 = divide %1, %2
            %7: f32 = divide %1, %3
            %8: f32 = divide %1, %4
            return scratch:f@0 = %5, scratch:f@1 = %6, scratch:f@2 = %7, scratch:f@3 = %8
        "#]],
        );
    }

    #[test]
    fn tables_of_constants_have_bounds() {
        let text = "
            %i: i32 = load scratch:i@0 %x: f32 = load scratch:f@0
            %2: f32 = constant 2 %3: f32 = constant 3
            store local:s@0, %2 store local:s@1, %3
            %a: f32 = load local:s@%i %b: f32 = min %a, %3 %c: f32 = abs %b
            store local:q@0, %2 store local:q@1, %x
            %d: f32 = load local:q@%i %e: f32 = min %d, %3
            return scratch:f@0 = %c, scratch:f@1 = %e";
        check(
            text,
            expect![[r#"
            %2: f32 = constant 2.0
            %3: f32 = constant 3.0
            store local:s@0, %2
            store local:s@1, %3
            %4: f32 = load local:s@%0
            store local:q@0, %2
            store local:q@1, %1
            %5: f32 = load local:q@%0
            %6: f32 = min %5, %3
            return scratch:f@0 = %4, scratch:f@1 = %6
        "#]],
        );
    }

    /// Generates a function of floats only, with bounds, signs and conditions at every step.
    fn expression(random: &mut Entropy<'_>) -> String {
        let constants = ["0", "-0.0", "1", "-1", "88.7", "1e-40", "-3e38"].iter().enumerate();
        let constants = constants.map(|(i, value)| format!("%{}: f32 = constant {value} ", i + 4));
        let loads = (0..4).map(|index| format!("%{index}: f32 = load scratch:f@{index} "));
        let mut text: String = loads.chain(constants).collect();
        for count in 11..36 {
            text += &step(random, count);
        }
        text + "return scratch:f@0 = %35, scratch:f@1 = %34, scratch:f@2 = %33, scratch:f@3 = %32"
    }

    /// Generates an operation on some of the first `count` values, and its result.
    fn step(random: &mut Entropy<'_>, count: usize) -> String {
        let [a, b, c] = std::array::from_fn(|_| random.below(count));
        let unary = random.choose(&["abs", "negate", "sqrt", "floor", "ceil", "round_even"]);
        let binary = random.choose(&["add", "subtract", "multiply", "divide"]);
        let bound = random.choose(&["min", "max"]);
        let compare = random.choose(&["less", "less_equal", "greater", "equal", "not_equal"]);
        let condition = format!("%c{count}: bool = {compare} %{a}, %{b} %{count}: f32 =");
        match random.below(8) {
            0 => format!("%{count}: f32 = {unary} %{a} "),
            1 | 2 => format!("%{count}: f32 = {bound} %{a}, %{b} "),
            3 => format!("%{count}: f32 = {binary} %{a}, %{b} "),
            4 => format!("%{count}: f32 = fma %{a}, %{a}, %{b} "),
            5 => format!("%{count}: f32 = fma %{a}, %{b}, %{c} "),
            6 => format!("{condition} select %c{count}, %{a}, %{c} "),
            _ => format!(
                "{condition} if %c{count} {{ %i{count}: f32 = {unary} %{a} yield %i{count} }}
                 else {{ %j{count}: f32 = {bound} %{b}, %{a} yield %j{count} }} "
            ),
        }
    }

    #[test]
    fn expressions_of_floats_keep_their_bits() {
        let mut changed = 0;
        for seed in 0..400 {
            let before = function_of(&expression(&mut Entropy::new(&Entropy::bytes(seed, 800))));
            let mut after = before.clone();
            run(&mut after);
            changed += u32::from(before.to_string() != after.to_string());
            for inputs in 0..20 {
                let inputs = Entropy::bytes(seed ^ (inputs << 40), 600);
                let (expected, found) = (outcome(&before, &inputs), outcome(&after, &inputs));
                assert_eq!(expected, found, "seed {seed}\n{before}\n{after}");
            }
        }
        assert!(changed > 200, "{changed} changed");
    }

    #[test]
    fn keeps_results() {
        check_preserves(run);
    }
}
