//! C++ expressions as trees, and how they are laid out.

use rtsl_ir::Value;

/// Lines are no longer than this where they can be broken.
pub(crate) const LINE_LENGTH: usize = 100;
/// Of blocks, and of the lines that continue one.
pub(crate) const INDENT: usize = 4;

/// An expression.
#[derive(Clone, Debug)]
pub(crate) enum Expression {
    /// A name or a literal; for a variable that changes, the values it stands for.
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

/// A binary operator with its precedence, greater for those that bind more tightly.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Operator {
    pub text: &'static str,
    pub precedence: u8,
    /// `a op (b op c)` is `(a op b) op c`, so no parentheses are needed.
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
    /// A name or literal.
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

    /// Whether writing it twice is no longer than a name for it.
    pub fn is_trivial(&self) -> bool {
        match self {
            Expression::Atom { .. } => true,
            Expression::Unary(_, operand) => matches!(**operand, Expression::Atom { .. }),
            _ => false,
        }
    }

    /// The number of operators and calls in it.
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

    /// Whether it names one of the variables that change.
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

    /// The same where it is true and this is false, and the other way round.
    pub fn inverted(self) -> Expression {
        match self {
            Expression::Unary("!", operand) => *operand,
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

    /// On one line.
    pub fn flat(&self) -> String {
        match self {
            Expression::Atom { text, .. } => text.clone(),
            Expression::Unary(operator, operand) => {
                let inner = operand.in_parentheses_below(UNARY).flat();
                // Not the other operator `--`.
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

    /// On as many lines as are needed, the first from `column` on, the others with this indentation; `after` characters
    /// follow.
    pub fn lay_out(&self, column: usize, indentation: usize, after: usize) -> String {
        let flat = self.flat();
        if column + flat.len() + after <= LINE_LENGTH {
            return flat;
        }
        let inner = indentation + INDENT;
        let new_line = format!("\n{}", " ".repeat(indentation));
        match self {
            Expression::Atom { .. } | Expression::Unary(..) | Expression::Element(..) => flat,
            Expression::Binary(operator, a, b) => {
                let left =
                    parenthesised(a, needs_parentheses(*operator, a, true), column, indentation);
                let right = needs_parentheses(*operator, b, false);
                let start = indentation + operator.text.len() + 1;
                let right = parenthesised(b, right, start, inner);
                format!("{left}{new_line}{} {right}", operator.text)
            }
            Expression::Choice(condition, a, b) => {
                let condition =
                    parenthesised(condition, condition.precedence() == CHOICE, column, indentation);
                let a = parenthesised(a, a.precedence() == CHOICE, indentation + 2, inner);
                let b = b.lay_out(indentation + 2, indentation, after);
                format!("{condition}{new_line}? {a}{new_line}: {b}")
            }
            Expression::Call(callee, arguments) => {
                format!(
                    "{callee}({})",
                    laid_out_list(arguments, column + callee.len() + 1, indentation, after + 1)
                )
            }
            Expression::List(elements) => {
                format!("{{{}}}", laid_out_list(elements, column + 1, indentation, after + 1))
            }
        }
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
    // What readers don't know by heart, and compilers warn of.
    let is_arithmetic = |it: &Operator| it.precedence >= ADD.precedence;
    let is_comparison =
        |it: &Operator| (EQUAL.precedence..=LESS.precedence).contains(&it.precedence);
    let is_known = is_arithmetic(inner) && (is_arithmetic(&operator) || is_comparison(&operator))
        || (operator.precedence <= AND.precedence && is_comparison(inner));
    !is_known
        || inner.precedence < operator.precedence
        || (inner.precedence == operator.precedence && !is_left)
}

fn parenthesised(inner: &Expression, needed: bool, column: usize, indentation: usize) -> String {
    match needed {
        true => format!("({})", inner.lay_out(column + 1, indentation, 1)),
        false => inner.lay_out(column, indentation, 0),
    }
}

/// As many on a line as fit.
fn laid_out_list(all: &[Expression], column: usize, indentation: usize, after: usize) -> String {
    let mut text = String::new();
    let mut column = column;
    for (index, element) in all.iter().enumerate() {
        let is_last = index + 1 == all.len();
        let after = if is_last { after } else { 1 };
        if index > 0 {
            let fits = column + 1 + element.flat().len() + after <= LINE_LENGTH;
            match fits {
                true => text.push(' '),
                false => text.push_str(&format!("\n{}", " ".repeat(indentation))),
            }
            column = if fits { column + 1 } else { indentation };
        }
        let part = element.lay_out(column, indentation + INDENT, after);
        column = match part.rsplit_once('\n') {
            Some((_, last)) => last.len(),
            None => column + part.len(),
        };
        text.push_str(&part);
        if !is_last {
            text.push(',');
            column += 1;
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
    fn parentheses_stand_where_they_are_needed() {
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
