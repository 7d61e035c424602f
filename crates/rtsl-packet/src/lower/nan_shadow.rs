//! Analysis of the observability of NaN payloads.
//!
//! The bits of a number usually have no effect if it is a NaN: a value computed from the bits is multiplied with
//! another NaN, or a comparison with the NaN selects another value. So this analysis assumes that the value is a NaN,
//! and propagates that assumption to all other values. The payload is hidden if no observable value depends on it.

use rtsl_ir::{
    BinaryOp, CompareOp, Constant, Function, Index, IndexVec, Op, OpKind, Region, Scalar, UnaryOp,
    Value,
};

use super::sign_bit::is_sign;

/// The state of a value under the assumption that another is a NaN.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Supposed {
    /// The same for every NaN.
    Same,
    /// A NaN with any payload.
    Nan,
    /// This bool.
    Is(bool),
    /// An integer with the bits of some NaN.
    NanBits,
    /// It may depend on the payload.
    Tells,
}

use Supposed::{Is, Nan, NanBits, Same, Tells};

impl Supposed {
    fn tells(self) -> bool {
        match self {
            NanBits | Tells => true,
            Same | Nan | Is(_) => false,
        }
    }

    /// Joins two states that are selected by a condition independent of the payload.
    fn or(self, other: Supposed) -> Supposed {
        if self == other {
            self
        } else if self.tells() || other.tells() {
            Tells
        } else {
            Same
        }
    }

    /// Combines the states of two operands.
    fn with(self, other: Supposed) -> Supposed {
        if self.tells() || other.tells() { Tells } else { Same }
    }
}

/// The error for an observable payload.
struct Seen;

/// The analysis, run for one value at a time.
pub struct Shadow<'a> {
    function: &'a Function,
    definitions: &'a IndexVec<Value, Option<&'a OpKind>>,
    values: IndexVec<Value, Supposed>,
    /// The number of operations that may still be visited, which keeps the work linear in the function's size.
    budget: usize,
}

/// The greatest number of visits of the whole function; the remaining bitcasts keep their comparison and select.
const MAX_ROUNDS: usize = 64;

impl<'a> Shadow<'a> {
    /// Returns an analysis of `function`, given the operations that define its values.
    pub fn new(
        function: &'a Function,
        definitions: &'a IndexVec<Value, Option<&'a OpKind>>,
    ) -> Self {
        let budget = function.values.len().saturating_mul(MAX_ROUNDS);
        Shadow { function, definitions, values: IndexVec::default(), budget }
    }

    /// True if the payload of `value`, an f32, is unobservable when its bits are used directly.
    pub fn hides(&mut self, value: Value) -> bool {
        let Some(value) = self.origin(value) else { return true };
        self.values = IndexVec::filled(self.function.values.len(), Same);
        self.values[value] = Nan;
        self.region(&self.function.body, value).is_ok()
            && !self.function.body.yields.iter().any(|value| self.at(*value).tells())
    }

    /// Returns the earliest value that is a NaN whenever this one is; `None` if it never is.
    fn origin(&self, value: Value) -> Option<Value> {
        let definition = self.definitions[value];
        let earlier = match definition {
            Some(OpKind::Constant(Constant::F32(number))) if !number.is_nan() => return None,
            Some(OpKind::Convert(_, a)) if self.function.scalar(*a) != Scalar::F32 => return None,
            Some(OpKind::Unary(op, a)) => match op {
                UnaryOp::Negate
                | UnaryOp::Abs
                | UnaryOp::Floor
                | UnaryOp::Ceil
                | UnaryOp::Trunc
                | UnaryOp::RoundEven => Some(*a),
                UnaryOp::Sqrt
                | UnaryOp::Not
                | UnaryOp::ApproximateReciprocal
                | UnaryOp::ApproximateInverseSqrt
                | UnaryOp::ApproximateSqrt
                | UnaryOp::Seldom => None,
            },
            // If either operand is a NaN the result is the first.
            Some(OpKind::Binary(BinaryOp::Min | BinaryOp::Max, a, _)) => Some(*a),
            Some(OpKind::Binary(BinaryOp::Add | BinaryOp::Subtract | BinaryOp::Multiply, a, b)) => {
                if self.is_factor(*b) {
                    Some(*a)
                } else if self.is_factor(*a) {
                    Some(*b)
                } else {
                    None
                }
            }
            Some(OpKind::Fma(a, b, c)) if self.is_factor(*b) && self.is_factor(*c) => Some(*a),
            _ => None,
        };
        match earlier {
            Some(earlier) => self.origin(earlier),
            None => Some(value),
        }
    }

    /// True for a finite constant other than 0: adding or multiplying it creates no NaN.
    fn is_factor(&self, value: Value) -> bool {
        match self.definitions[value] {
            Some(OpKind::Constant(Constant::F32(number))) => number.is_finite() && *number != 0.0,
            _ => false,
        }
    }

    fn at(&self, value: Value) -> Supposed {
        self.values[value]
    }

    fn region(&mut self, region: &Region, nan: Value) -> Result<(), Seen> {
        for op in &region.ops {
            self.budget = self.budget.checked_sub(1).ok_or(Seen)?;
            if op.results.iter().any(|result| result == nan) {
                continue;
            }
            match &op.kind {
                OpKind::If { condition, then, otherwise } => {
                    self.branch(op, *condition, then, otherwise, nan)?;
                }
                OpKind::Loop { initial, body } => {
                    self.none_tells(initial.iter().copied())?;
                    self.region(body, nan)?;
                    self.none_tells(body.yields.iter().copied())?;
                }
                kind => {
                    if let Some(supposed) = self.pure(kind) {
                        self.values[op.results.get(0)] = supposed;
                    } else {
                        let mut seen = false;
                        kind.for_each_operand(|operand| seen |= self.at(operand).tells());
                        if seen {
                            return Err(Seen);
                        }
                    }
                }
            }
        }
        Ok(())
    }

    fn none_tells(&self, mut values: impl Iterator<Item = Value>) -> Result<(), Seen> {
        if values.any(|value| self.at(value).tells()) { Err(Seen) } else { Ok(()) }
    }

    fn branch(
        &mut self,
        op: &Op,
        condition: Value,
        then: &Region,
        otherwise: &Region,
        nan: Value,
    ) -> Result<(), Seen> {
        let (takes_then, takes_otherwise) = match self.at(condition) {
            Is(condition) => (condition, !condition),
            Same => (true, true),
            Nan | NanBits | Tells => return Err(Seen),
        };
        if takes_then {
            self.region(then, nan)?;
        }
        if takes_otherwise {
            self.region(otherwise, nan)?;
        }
        for (result, (a, b)) in op.results.iter().zip(then.yields.iter().zip(&otherwise.yields)) {
            self.values[result] = match (takes_then, takes_otherwise) {
                (true, false) => self.at(*a),
                (false, _) => self.at(*b),
                (true, true) => self.at(*a).or(self.at(*b)),
            };
        }
        Ok(())
    }

    /// Returns the state of the result of an operation without effects; `None` for others, whose operands must not
    /// depend on the payload.
    fn pure(&self, kind: &OpKind) -> Option<Supposed> {
        Some(match *kind {
            OpKind::Constant(constant) => match constant {
                Constant::F32(value) if value.is_nan() => Nan,
                Constant::Bool(value) => Is(value),
                Constant::F32(_) | Constant::I32(_) | Constant::U32(_) => Same,
            },
            OpKind::Unary(op, a) => match (op, self.at(a)) {
                (UnaryOp::Not, Is(value)) => Is(!value),
                (_, NanBits) => Tells,
                (_, a) => a,
            },
            OpKind::Binary(op, a, b) => self.binary(op, a, b),
            OpKind::Compare(op, a, b) => match (self.at(a), self.at(b)) {
                (Nan, _) | (_, Nan) => Is(op == CompareOp::NotEqual),
                (a, b) => a.with(b),
            },
            OpKind::Select(condition, a, b) => match (self.at(condition), self.at(a), self.at(b)) {
                (Is(true), a, _) => a,
                (Is(false), _, b) => b,
                (Same, a, b) => a.or(b),
                (_, Nan, Nan) => Nan,
                (Nan | NanBits | Tells, _, _) => Tells,
            },
            OpKind::Fma(a, b, c) => match (self.at(a), self.at(b), self.at(c)) {
                (Nan, _, _) | (_, Nan, _) | (_, _, Nan) => Nan,
                (a, b, c) => a.with(b).with(c),
            },
            OpKind::Convert(to, a) => match (to, self.at(a)) {
                (Scalar::F32, Nan) => Nan,
                (Scalar::Bool, Nan) => Is(true),
                (Scalar::Bool, Is(value)) => Is(value),
                (_, a) => a.with(Same),
            },
            OpKind::Bitcast(to, a) => match (to, self.at(a)) {
                (Scalar::F32, Nan | NanBits) => Nan,
                (Scalar::F32 | Scalar::Bool, a) => a,
                (Scalar::I32 | Scalar::U32, Nan) => NanBits,
                (Scalar::I32 | Scalar::U32, a) => a,
            },
            // Addresses are clamped, so the result depends on the payload only through the loaded value.
            OpKind::Load(_, Index::Dynamic(index)) => self.at(index).with(Same),
            OpKind::Load(_, Index::Constant(_)) | OpKind::Length(_) | OpKind::LightCount => Same,
            OpKind::Store(..)
            | OpKind::If { .. }
            | OpKind::Loop { .. }
            | OpKind::Trace { .. }
            | OpKind::Occluded { .. }
            | OpKind::LightSample { .. }
            | OpKind::Ambient
            | OpKind::Rand
            | OpKind::Query(..)
            | OpKind::ReferenceCall(_)
            | OpKind::IsSet(..)
            | OpKind::Seed(_)
            | OpKind::Derivative(..)
            | OpKind::ChainRule(..)
            | OpKind::ReferenceCount(_)
            | OpKind::Report(..)
            | OpKind::ReportBudget => return None,
        })
    }

    fn binary(&self, op: BinaryOp, a: Value, b: Value) -> Supposed {
        let (first, second) = (self.at(a), self.at(b));
        match self.function.scalar(a) {
            Scalar::F32 => match (op, first, second) {
                // If the second operand is a NaN the result is the first.
                (BinaryOp::Min | BinaryOp::Max, first, Nan) => first,
                (_, Nan, _) | (_, _, Nan) => Nan,
                (_, first, second) => first.with(second),
            },
            Scalar::Bool => match (op, first, second) {
                (BinaryOp::And, Is(false), _) | (BinaryOp::And, _, Is(false)) => Is(false),
                (BinaryOp::Or, Is(true), _) | (BinaryOp::Or, _, Is(true)) => Is(true),
                (BinaryOp::And, Is(true), other) | (BinaryOp::And, other, Is(true)) => other,
                (BinaryOp::Or, Is(false), other) | (BinaryOp::Or, other, Is(false)) => other,
                (BinaryOp::Xor, Is(first), Is(second)) => Is(first != second),
                (_, first, second) => first.with(second),
            },
            Scalar::I32 | Scalar::U32 => match (op, first, second) {
                (BinaryOp::Xor, NanBits, _) if is_sign(self.definitions, b) => NanBits,
                (BinaryOp::Xor, _, NanBits) if is_sign(self.definitions, a) => NanBits,
                (BinaryOp::Or, NanBits, _) | (BinaryOp::Or, _, NanBits) => NanBits,
                (_, first, second) => first.with(second),
            },
        }
    }
}

#[cfg(test)]
mod tests {
    use rtsl_ir::Function;

    use crate::lower::nan_bits::hidden_bitcasts;

    fn is_hidden(body: &str) -> bool {
        let text = format!(
            "function f scratch a: f32[2] scratch n: u32[2] local s: f32[4] {{
                %a: f32 = load scratch:a@0 %n: u32 = load scratch:n@0
                %2: f32 = constant 2.0 %0: f32 = constant 0.0 %23: u32 = constant 23
                {body} }}"
        );
        let function: Function = text.parse().unwrap();
        rtsl_ir::verify::verify(&function).unwrap();
        hidden_bitcasts(&function).contains(&true)
    }

    #[test]
    fn arithmetic_with_the_nan_hides_its_bits() {
        let scale = "%b: u32 = bitcast %a %c: u32 = shift_left %b, %23 %s: f32 = bitcast %c";
        for (product, hidden) in [("multiply %s, %a", true), ("multiply %s, %2", false)] {
            let text = format!("{scale} %r: f32 = {product} return scratch:a@0 = %r");
            assert_eq!(is_hidden(&text), hidden, "{product}");
        }
    }

    #[test]
    fn the_nan_is_found_behind_arithmetic() {
        for (before, hidden) in [
            ("%k: f32 = fma %a, %2, %2", true),
            ("%m: f32 = min %a, %2 %k: f32 = floor %m", true),
            // Never a NaN.
            ("%k: f32 = min %2, %a", true),
            // Also a NaN for infinities, which the result does not show.
            ("%k: f32 = subtract %a, %a", false),
            ("%k: f32 = multiply %a, %0", false),
            ("%k: f32 = sqrt %a", false),
        ] {
            let text = format!(
                "{before} %b: u32 = bitcast %k %c: u32 = shift_left %b, %23 %s: f32 = bitcast %c
                %r: f32 = multiply %s, %a return scratch:a@0 = %r"
            );
            assert_eq!(is_hidden(&text), hidden, "{before}");
        }
    }

    #[test]
    fn comparisons_with_the_nan_are_known() {
        for (comparison, hidden) in [
            ("less %a, %0", true),
            ("greater_equal %a, %0", true),
            ("not_equal %a, %a", false),
            ("less %t, %0", false),
            ("less %2, %0", false),
        ] {
            let text = format!(
                "%b: u32 = bitcast %a %k: u32 = shift_left %b, %23 %t: f32 = bitcast %k
                %c: bool = {comparison} %r: f32 = select %c, %t, %2 return scratch:a@0 = %r"
            );
            assert_eq!(is_hidden(&text), hidden, "{comparison}");
            let branch = text.replace("select %c, %t, %2", "if %c { yield %t } else { yield %2 }");
            assert_eq!(is_hidden(&branch), hidden, "if {comparison}");
        }
    }

    #[test]
    fn outputs_and_conditions_are_observable() {
        let bits = "%b: u32 = bitcast %a %c: u32 = shift_left %b, %23 %s: f32 = bitcast %c";
        for rest in [
            "return scratch:n@0 = %c",
            "return scratch:n@0 = %b",
            "%i: i32 = convert %s store local:s@%i, %2 return scratch:a@0 = %2",
            "store local:s@0, %s %r: f32 = load local:s@0 return scratch:a@0 = %r",
            "%d: bool = less %s, %0 %r: f32 = if %d { yield %a } else { yield %2 }
             return scratch:a@0 = %r",
        ] {
            assert!(!is_hidden(&format!("{bits} {rest}")), "{rest}");
        }
    }

    #[test]
    fn carried_values_must_not_depend_on_the_payload() {
        for (carried, hidden) in [("%a", true), ("%s", false)] {
            let text = format!(
                "%b: u32 = bitcast %a %c: u32 = shift_left %b, %23 %s: f32 = bitcast %c
                %r: f32 = loop (%p: f32 = {carried}) {{
                    %q: f32 = multiply %s, %a %d: bool = less %q, %p repeat %d, %q
                }} return scratch:a@0 = %r"
            );
            assert_eq!(is_hidden(&text), hidden, "{carried}");
        }
    }
}
