//! Warns about constants that are not numbers: `sqrt(-1.0)`, `acos(2.0)`, `0.0 / 0.0`.

use rtsl_ir::{Constant, Scalar};
use rtsl_source::{Diagnostic, diagnostic_codes as codes};

use super::Checker;
use super::types::component_scalar;
use crate::hir::{Expression, ExpressionKind};

/// The limit on operations for the search in one unit. It stops when the limit is reached.
pub(super) const UNIT_FUEL: u32 = 1_000_000;

/// The limit on operations to evaluate one operation on constants.
const OPERATION_FUEL: u32 = 10_000;

impl Checker<'_> {
    /// Warns about a division, or a call of a built-in function, that gives NaN for constants that
    /// are numbers.
    pub(super) fn check_not_nan(&mut self, operation: &Expression) {
        if component_scalar(&operation.ty) != Some(Scalar::F32) {
            return;
        }
        let operands: Vec<&Expression> = match &operation.kind {
            ExpressionKind::Binary(_, left, right) => vec![left, right],
            ExpressionKind::Builtin(call) => call.arguments.iter().collect(),
            _ => return,
        };
        // A float made from bits may be an intentional NaN.
        if !operands.iter().all(|operand| component_scalar(&operand.ty) == Some(Scalar::F32)) {
            return;
        }
        let of_numbers = operands.iter().all(|operand| self.is_nan(operand) == Some(false));
        if of_numbers && self.is_nan(operation) == Some(true) {
            self.report_nan(operation);
        }
    }

    /// True if some component is NaN; `None` if the value is not known.
    fn is_nan(&mut self, expression: &Expression) -> Option<bool> {
        let evaluator = self.evaluator(self.nan_fuel.min(OPERATION_FUEL));
        let (value, spent) = evaluator.evaluate(expression);
        self.nan_fuel = self.nan_fuel.saturating_sub(spent);
        let is_nan = |each: &Constant| matches!(each, Constant::F32(value) if value.is_nan());
        Some(value.ok()?.iter().any(is_nan))
    }

    fn report_nan(&mut self, operation: &Expression) {
        let (message, help) = match &operation.kind {
            ExpressionKind::Builtin(call) => {
                (format!("this `{}` is not a number", call.builtin.name), domain(call.builtin.name))
            }
            _ => ("this quotient is not a number".to_owned(), None),
        };
        let diagnostic =
            Diagnostic::new(codes::NOT_A_NUMBER, message).at(operation.span, "always NaN");
        let diagnostic = match help {
            Some(help) => diagnostic.help(help),
            None => diagnostic,
        };
        self.report(diagnostic.note("if NaN is intended, write `uintBitsToFloat(0x7FC00000u)`"));
    }
}

/// The domain of a function, as the diagnostic describes it.
fn domain(function: &str) -> Option<&'static str> {
    match function {
        "sqrt" | "inversesqrt" => Some("its argument must not be negative"),
        "log" | "log2" => Some("its argument must be positive"),
        "acos" | "asin" => Some("its argument must lie between -1 and 1"),
        "acosh" => Some("its argument must be at least 1"),
        "atanh" => Some("its argument must lie between -1 and 1, both excluded"),
        "pow" => Some("its first argument must not be negative; for integer powers, multiply"),
        "mod" => Some("its second argument must not be zero"),
        "normalize" => Some("its argument must not be zero"),
        _ => None,
    }
}
