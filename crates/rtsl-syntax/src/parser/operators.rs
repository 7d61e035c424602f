//! Operators and their precedences.

use crate::ast::{BinaryOperator, StepOperator, UnaryOperator};
use crate::token::Punctuator;

/// The precedence of an operator; a greater number binds more tightly.
pub(super) type Binding = u8;

pub(super) const SEQUENCE: Binding = 1;
pub(super) const ASSIGNMENT: Binding = 2;
pub(super) const CONDITIONAL: Binding = 3;
pub(super) const UNARY: Binding = 15;

/// The binary operator that `punctuator` denotes.
pub(super) fn binary(punctuator: Punctuator) -> Option<(BinaryOperator, Binding)> {
    Some(match punctuator {
        Punctuator::OrOr => (BinaryOperator::Or, 4),
        Punctuator::XorXor => (BinaryOperator::Xor, 5),
        Punctuator::AndAnd => (BinaryOperator::And, 6),
        Punctuator::Bar => (BinaryOperator::BitOr, 7),
        Punctuator::Caret => (BinaryOperator::BitXor, 8),
        Punctuator::Ampersand => (BinaryOperator::BitAnd, 9),
        Punctuator::EqualEqual => (BinaryOperator::Equal, 10),
        Punctuator::NotEqual => (BinaryOperator::NotEqual, 10),
        Punctuator::Less => (BinaryOperator::Less, 11),
        Punctuator::Greater => (BinaryOperator::Greater, 11),
        Punctuator::LessEqual => (BinaryOperator::LessEqual, 11),
        Punctuator::GreaterEqual => (BinaryOperator::GreaterEqual, 11),
        Punctuator::ShiftLeft => (BinaryOperator::ShiftLeft, 12),
        Punctuator::ShiftRight => (BinaryOperator::ShiftRight, 12),
        Punctuator::Plus => (BinaryOperator::Add, 13),
        Punctuator::Minus => (BinaryOperator::Subtract, 13),
        Punctuator::Star => (BinaryOperator::Multiply, 14),
        Punctuator::Slash => (BinaryOperator::Divide, 14),
        Punctuator::Percent => (BinaryOperator::Remainder, 14),
        _ => return None,
    })
}

/// The assignment that `punctuator` denotes, with its operator if it is a compound one.
pub(super) fn assignment(punctuator: Punctuator) -> Option<Option<BinaryOperator>> {
    Some(match punctuator {
        Punctuator::Assign => None,
        Punctuator::AddAssign => Some(BinaryOperator::Add),
        Punctuator::SubtractAssign => Some(BinaryOperator::Subtract),
        Punctuator::MultiplyAssign => Some(BinaryOperator::Multiply),
        Punctuator::DivideAssign => Some(BinaryOperator::Divide),
        Punctuator::RemainderAssign => Some(BinaryOperator::Remainder),
        Punctuator::ShiftLeftAssign => Some(BinaryOperator::ShiftLeft),
        Punctuator::ShiftRightAssign => Some(BinaryOperator::ShiftRight),
        Punctuator::AndAssign => Some(BinaryOperator::BitAnd),
        Punctuator::XorAssign => Some(BinaryOperator::BitXor),
        Punctuator::OrAssign => Some(BinaryOperator::BitOr),
        _ => return None,
    })
}

/// The prefix operator that `punctuator` denotes, except `++` and `--`.
pub(super) fn unary(punctuator: Punctuator) -> Option<UnaryOperator> {
    Some(match punctuator {
        Punctuator::Minus => UnaryOperator::Negate,
        Punctuator::Bang => UnaryOperator::Not,
        Punctuator::Tilde => UnaryOperator::BitNot,
        Punctuator::Plus => UnaryOperator::Plus,
        _ => return None,
    })
}

/// `++` or `--`.
pub(super) fn step(punctuator: Punctuator) -> Option<StepOperator> {
    Some(match punctuator {
        Punctuator::Increment => StepOperator::Increment,
        Punctuator::Decrement => StepOperator::Decrement,
        _ => return None,
    })
}
