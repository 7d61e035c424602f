//! C++ expressions as trees, and their layout.

use rtsl_ir::Value;

/// The greatest line length, as far as lines can be broken.
pub(crate) const LINE_LENGTH: usize = 100;
/// The indentation of blocks and of continuation lines.
pub(crate) const INDENT: usize = 4;

/// An expression.
#[derive(Clone, Debug)]
pub(crate) enum Expression {
    /// A name or a literal; for a mutable variable with the value it holds.
    Atom { text: String, variable: Option<Value> },
    /// `-a`, `!a`, `~a`.
    Unary(&'static str, Box<Expression>),
    /// `a + b`.
    Binary(Operator, Box<Expression>, Box<Expression>),
    /// `condition ? a : b`.
    Choice(Box<Expression>, Box<Expression>, Box<Expression>),
    /// `callee(a, b)`, also a cast.
    Call(String, Vec<Expression>),
    /// `{a, b}`
    List(Vec<Expression>),
    /// `array[index]`
    Element(String, Box<Expression>),
}

/// A binary operator with its precedence, greater for operators that bind more tightly.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Operator {
    pub text: &'static str,
    pub precedence: u8,
    /// True if `a op (b op c)` equals `(a op b) op c`, so no parentheses are needed.
    pub associative: bool,
}

impl Operator {
    const fn new(text: &'static str, precedence: u8, associative: bool) -> Operator {
        Operator { text, precedence, associative }
    }
}

pub(crate) const MULTIPLY: Operator = Operator::new("*", 10, false);
pub(crate) const DIVIDE: Operator = Operator::new("/", 10, false);
pub(crate) const REMAINDER: Operator = Operator::new("%", 10, false);
pub(crate) const ADD: Operator = Operator::new("+", 9, false);
pub(crate) const SUBTRACT: Operator = Operator::new("-", 9, false);
pub(crate) const SHIFT_LEFT: Operator = Operator::new("<<", 8, false);
pub(crate) const SHIFT_RIGHT: Operator = Operator::new(">>", 8, false);
pub(crate) const LESS: Operator = Operator::new("<", 7, false);
pub(crate) const LESS_EQUAL: Operator = Operator::new("<=", 7, false);
pub(crate) const GREATER: Operator = Operator::new(">", 7, false);
pub(crate) const GREATER_EQUAL: Operator = Operator::new(">=", 7, false);
pub(crate) const EQUAL: Operator = Operator::new("==", 6, false);
pub(crate) const NOT_EQUAL: Operator = Operator::new("!=", 6, false);
pub(crate) const BIT_AND: Operator = Operator::new("&", 5, true);
pub(crate) const BIT_XOR: Operator = Operator::new("^", 4, true);
pub(crate) const BIT_OR: Operator = Operator::new("|", 3, true);
pub(crate) const AND: Operator = Operator::new("&&", 2, true);
pub(crate) const OR: Operator = Operator::new("||", 1, true);

const CHOICE: u8 = 0;
const UNARY: u8 = 11;
const PRIMARY: u8 = 12;

impl Expression {
    /// Returns a name or literal.
    pub fn atom(text: impl Into<String>) -> Expression {
        Expression::Atom { text: text.into(), variable: None }
    }

    pub fn unary(operator: &'static str, operand: Expression) -> Expression {
        Expression::Unary(operator, Box::new(operand))
    }

    pub fn binary(operator: Operator, a: Expression, b: Expression) -> Expression {
        Expression::Binary(operator, Box::new(a), Box::new(b))
    }

    pub fn choice(condition: Expression, a: Expression, b: Expression) -> Expression {
        Expression::Choice(Box::new(condition), Box::new(a), Box::new(b))
    }

    pub fn call<const N: usize>(callee: &str, arguments: [Expression; N]) -> Expression {
        Expression::Call(callee.to_owned(), arguments.into())
    }

    /// True if repeating it is no longer than a name for it.
    pub fn is_trivial(&self) -> bool {
        match self {
            Expression::Atom { .. } => true,
            Expression::Unary(_, operand) => matches!(**operand, Expression::Atom { .. }),
            _ => false,
        }
    }

    /// Returns the number of operators and calls.
    pub fn size(&self) -> usize {
        match self {
            Expression::Atom { .. } => 0,
            Expression::Unary(_, a) => a.size(),
            Expression::Element(_, index) => 1 + index.size(),
            Expression::Binary(_, a, b) => 1 + a.size() + b.size(),
            Expression::Choice(a, b, c) => 1 + a.size() + b.size() + c.size(),
            Expression::Call(_, all) | Expression::List(all) => {
                1 + all.iter().map(Expression::size).sum::<usize>()
            }
        }
    }

    /// True if it contains a variable of one of these values.
    pub fn reads(&self, wanted: &dyn Fn(Value) -> bool) -> bool {
        match self {
            Expression::Atom { variable, .. } => variable.is_some_and(wanted),
            Expression::Unary(_, a) | Expression::Element(_, a) => a.reads(wanted),
            Expression::Binary(_, a, b) => a.reads(wanted) || b.reads(wanted),
            Expression::Choice(a, b, c) => a.reads(wanted) || b.reads(wanted) || c.reads(wanted),
            Expression::Call(_, all) | Expression::List(all) => {
                all.iter().any(|one| one.reads(wanted))
            }
        }
    }

    /// Returns the logical negation.
    pub fn inverted(self) -> Expression {
        match self {
            Expression::Unary("!", operand) => *operand,
            // The negation of an order comparison is not the opposite comparison, since both are false for a NaN.
            Expression::Binary(EQUAL, a, b) => Expression::Binary(NOT_EQUAL, a, b),
            Expression::Binary(NOT_EQUAL, a, b) => Expression::Binary(EQUAL, a, b),
            other => Expression::unary("!", other),
        }
    }

    fn precedence(&self) -> u8 {
        match self {
            Expression::Atom { text, .. } if text.starts_with('-') => UNARY,
            Expression::Atom { .. }
            | Expression::Call(..)
            | Expression::List(_)
            | Expression::Element(..) => PRIMARY,
            Expression::Unary(..) => UNARY,
            Expression::Binary(operator, ..) => operator.precedence,
            Expression::Choice(..) => CHOICE,
        }
    }

    /// Returns the expression on one line.
    pub fn flat(&self) -> String {
        match self {
            Expression::Atom { text, .. } => text.clone(),
            Expression::Unary(operator, operand) => {
                let inner = operand.in_parentheses_below(UNARY).flat();
                // Avoids the operator `--`.
                match inner.starts_with('-') && *operator == "-" {
                    true => format!("{operator}({inner})"),
                    false => format!("{operator}{inner}"),
                }
            }
            Expression::Binary(operator, a, b) => {
                let (left, right) = operand_texts(*operator, a, b);
                format!("{left} {} {right}", operator.text)
            }
            Expression::Choice(condition, a, b) => {
                let condition = condition.in_parentheses_below(CHOICE + 1).flat();
                let a = a.in_parentheses_below(CHOICE + 1).flat();
                format!("{condition} ? {a} : {}", b.flat())
            }
            Expression::Call(callee, arguments) => format!("{callee}({})", joined(arguments)),
            Expression::List(elements) => format!("{{{}}}", joined(elements)),
            Expression::Element(array, index) => format!("{array}[{}]", index.flat()),
        }
    }

    fn in_parentheses_below(&self, precedence: u8) -> InParentheses<'_> {
        InParentheses { inner: self, needed: self.precedence() < precedence }
    }

    /// Returns the expression on as many lines as needed.
    pub fn lay_out(&self, room: Room) -> String {
        let flat = self.flat();
        if room.takes(&flat) {
            return flat;
        }
        match self {
            Expression::Atom { .. } | Expression::Element(..) => flat,
            Expression::Unary(operator, operand) => {
                let needed = operand.precedence() < UNARY;
                format!("{operator}{}", parenthesised(operand, needed, room.behind(operator)))
            }
            Expression::Binary(operator, ..) => {
                let mut operands = Vec::new();
                let first = self.chain(operator.precedence, &mut operands);
                lay_out_chain(*operator, first, &operands, room)
            }
            Expression::Choice(condition, a, b) => {
                let line = room.next_line();
                let part = |part: &Expression, room: Room| {
                    parenthesised(part, part.precedence() == CHOICE, room)
                };
                let condition = part(condition, room.followed_by(0));
                let a = part(a, line.behind("? ").deeper().followed_by(0));
                let b = b.lay_out(line.behind(": ").deeper());
                let margin = room.margin();
                format!("{condition}{margin}? {a}{margin}: {b}")
            }
            Expression::Call(callee, arguments) => {
                let room = room.behind(callee).behind("(").followed_by(room.after + 1);
                format!("{callee}({})", lay_out_list(arguments, room))
            }
            Expression::List(elements) => {
                let room = room.behind("{").followed_by(room.after + 1);
                format!("{{{}}}", lay_out_list(elements, room))
            }
        }
    }

    /// Returns the first operand of a chain of operators of this precedence; the other operands are appended.
    fn chain<'a>(
        &'a self,
        precedence: u8,
        operands: &mut Vec<(Operator, &'a Expression)>,
    ) -> &'a Expression {
        match self {
            Expression::Binary(operator, a, b) if operator.precedence == precedence => {
                let first = match needs_parentheses(*operator, a, true) {
                    true => a,
                    false => a.chain(precedence, operands),
                };
                operands.push((*operator, b));
                first
            }
            other => other,
        }
    }
}

/// The position of an expression.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Room {
    /// The column of its start.
    pub column: usize,
    /// The indentation of continuation lines.
    pub indentation: usize,
    /// The number of characters that follow.
    pub after: usize,
}

impl Room {
    fn takes(self, text: &str) -> bool {
        self.column + text.len() + self.after <= LINE_LENGTH
    }

    fn behind(self, text: &str) -> Room {
        Room { column: self.column + text.len(), ..self }
    }

    fn followed_by(self, after: usize) -> Room {
        Room { after, ..self }
    }

    fn deeper(self) -> Room {
        Room { indentation: self.indentation + INDENT, ..self }
    }

    fn next_line(self) -> Room {
        Room { column: self.indentation, ..self }
    }

    /// Returns the position after text that may have several lines.
    fn behind_lines(self, text: &str) -> Room {
        match text.rsplit_once('\n') {
            Some((_, last)) => Room { column: last.len(), ..self },
            None => self.behind(text),
        }
    }

    /// Returns a line break and the margin of the next line.
    fn margin(self) -> String {
        format!("\n{}", " ".repeat(self.indentation))
    }
}

struct InParentheses<'a> {
    inner: &'a Expression,
    needed: bool,
}

impl InParentheses<'_> {
    fn flat(&self) -> String {
        let inner = self.inner.flat();
        if self.needed { format!("({inner})") } else { inner }
    }
}

fn joined(all: &[Expression]) -> String {
    all.iter().map(Expression::flat).collect::<Vec<_>>().join(", ")
}

fn operand_texts(operator: Operator, a: &Expression, b: &Expression) -> (String, String) {
    let text = |operand: &Expression, is_left| {
        let needed = needs_parentheses(operator, operand, is_left);
        InParentheses { inner: operand, needed }.flat()
    };
    (text(a, true), text(b, false))
}

fn needs_parentheses(operator: Operator, operand: &Expression, is_left: bool) -> bool {
    let Expression::Binary(inner, ..) = operand else {
        return operand.precedence() < operator.precedence;
    };
    if *inner == operator {
        return !is_left && !operator.associative;
    }
    // Combinations whose precedence is little known, for which compilers warn.
    let is_arithmetic = |it: &Operator| it.precedence >= ADD.precedence;
    let is_comparison =
        |it: &Operator| (EQUAL.precedence..=LESS.precedence).contains(&it.precedence);
    let is_known = is_arithmetic(inner) && (is_arithmetic(&operator) || is_comparison(&operator))
        || (operator.precedence <= AND.precedence && is_comparison(inner));
    !is_known
        || inner.precedence < operator.precedence
        || (inner.precedence == operator.precedence && !is_left)
}

fn parenthesised(inner: &Expression, needed: bool, room: Room) -> String {
    match needed {
        true => format!("({})", inner.lay_out(room.behind("(").followed_by(room.after + 1))),
        false => inner.lay_out(room),
    }
}

/// Lays out as many operands per line as fit, with line breaks before operators.
fn lay_out_chain(
    outer: Operator,
    first: &Expression,
    operands: &[(Operator, &Expression)],
    room: Room,
) -> String {
    let needed = needs_parentheses(outer, first, true);
    let mut text = parenthesised(first, needed, room.followed_by(0));
    let mut line = room.behind_lines(&text);
    for (index, (operator, operand)) in operands.iter().enumerate() {
        let needed = needs_parentheses(*operator, operand, false);
        let after = if index + 1 == operands.len() { room.after } else { 0 };
        let flat = InParentheses { inner: operand, needed }.flat();
        let fits = line.followed_by(after + operator.text.len() + 2).takes(&flat);
        if !fits {
            text.push_str(&room.margin());
            line = room.next_line();
        } else {
            text.push(' ');
            line = line.behind(" ");
        }
        text.push_str(operator.text);
        text.push(' ');
        line = line.behind(operator.text).behind(" ").followed_by(after);
        let operand = parenthesised(operand, needed, line.deeper());
        text.push_str(&operand);
        line = line.behind_lines(&operand);
    }
    text
}

/// Lays out as many elements per line as fit.
fn lay_out_list(all: &[Expression], room: Room) -> String {
    let mut text = String::new();
    let mut line = room;
    for (index, element) in all.iter().enumerate() {
        let is_last = index + 1 == all.len();
        let after = if is_last { room.after } else { 1 };
        if index > 0 && line.followed_by(after + 1).takes(&element.flat()) {
            text.push(' ');
            line = line.behind(" ");
        } else if index > 0 {
            text.push_str(&room.margin());
            line = room.next_line();
        }
        let part = element.lay_out(line.followed_by(after).deeper());
        line = line.behind_lines(&part);
        text.push_str(&part);
        if !is_last {
            text.push(',');
            line = line.behind(",");
        }
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    fn name(text: &str) -> Expression {
        Expression::atom(text)
    }

    #[test]
    fn parentheses_are_written_where_needed() {
        let sum = Expression::binary(ADD, name("a"), name("b"));
        let difference = Expression::binary(SUBTRACT, name("c"), sum.clone());
        assert_eq!(difference.flat(), "c - (a + b)");
        let product = Expression::binary(MULTIPLY, sum.clone(), name("-1.0f"));
        assert_eq!(product.flat(), "(a + b) * -1.0f");
        assert_eq!(Expression::unary("-", name("-1.0f")).flat(), "-(-1.0f)");
        assert_eq!(Expression::unary("-", sum.clone()).flat(), "-(a + b)");
        let less = Expression::binary(LESS, sum, name("c"));
        let both = Expression::binary(AND, less.clone(), name("d"));
        assert_eq!(Expression::binary(OR, both, name("e")).flat(), "(a + b < c && d) || e");
        let masked = Expression::binary(
            BIT_AND,
            name("a"),
            Expression::binary(SHIFT_LEFT, name("b"), name("3u")),
        );
        assert_eq!(masked.flat(), "a & (b << 3u)");
        let choice = Expression::choice(less.inverted(), name("x"), name("y"));
        assert_eq!(choice.flat(), "!(a + b < c) ? x : y");
    }
}
