//! The syntax tree: the structure of the text, with a span for everything that a diagnostic may
//! name.
//!
//! Names are kept as written and not resolved. The parser bounds the depth of trees (see
//! [`deep_stack::MAX_DEPTH`](rtsl_source::deep_stack::MAX_DEPTH)), so that recursive visitors are
//! safe on a deep stack.

use rtsl_source::Span;

/// A name and its span.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Identifier {
    /// The name.
    pub name: String,
    /// The span of the name.
    pub span: Span,
}

/// A whole translation unit, with includes and macros expanded.
#[derive(Clone, Debug, Default)]
pub struct TranslationUnit {
    /// The imports, which come before the first class.
    pub imports: Vec<Import>,
    /// All items at file scope, in order.
    pub items: Vec<Item>,
    /// The parts of the text that could not be parsed and are not in the tree, or not as a whole.
    pub skipped: Vec<Span>,
}

/// `import microfacets.ggx as ggx;`: the names of another file, as parts of one name.
#[derive(Clone, Debug)]
pub struct Import {
    /// The folders and the file, without its ending.
    pub path: Vec<Identifier>,
    /// The name after `as`.
    pub alias: Option<Identifier>,
    /// The span of the path.
    pub span: Span,
}

impl Import {
    /// The name by which the importing file knows the module.
    pub fn name(&self) -> Option<&Identifier> {
        self.alias.as_ref().or(self.path.last())
    }

    /// The path as written, with dots.
    pub fn dotted(&self) -> String {
        self.joined(".")
    }

    /// The path of the file.
    pub fn file(&self) -> String {
        format!("{}.rtsl", self.joined("/"))
    }

    fn joined(&self, separator: &str) -> String {
        let names: Vec<&str> = self.path.iter().map(|part| part.name.as_str()).collect();
        names.join(separator)
    }
}

/// An item at file scope or in a class.
#[derive(Clone, Debug)]
pub enum Item {
    /// `struct Name { ... };`
    Struct(Struct),
    /// `enum Name { ... };`
    Enumeration(Enumeration),
    /// `static_assert(condition, "text");`
    Assertion(Assertion),
    /// A function or a prototype; in a class also a method or the constructor.
    Function(Function),
    /// One declarator of a constant or a member. `float a, b[2];` gives two.
    Variable(Variable),
    /// `class Name : bases;` or `{ ... }`. Only at file scope.
    Class(Class),
}

/// A class in either form.
#[derive(Clone, Debug)]
pub struct Class {
    /// The class's name.
    pub name: Identifier,
    /// The names after the colon: roles and at most one class, as the checker verifies.
    pub bases: Vec<Identifier>,
    /// The form of the declaration.
    pub form: ClassForm,
    /// Members, structs, functions and methods, but no classes.
    pub items: Vec<Item>,
    /// The documentation comment just before the class, without comment marks.
    pub documentation: Option<String>,
    /// The span of the header, from `class` to the `;` or `{`.
    pub span: Span,
    /// The place after the class.
    pub end: Span,
}

/// The form of a class declaration.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ClassForm {
    /// `class A : B;`, whose items are those up to the next header or the end.
    Header,
    /// `class A : B { ... };`
    Block,
}

/// `struct Name { fields };`
#[derive(Clone, Debug)]
pub struct Struct {
    /// The struct's name; GLSL's unnamed structs get a generated one that no text can write.
    pub name: Identifier,
    /// The fields, one declarator each.
    pub fields: Vec<Field>,
    /// The span of the whole declaration.
    pub span: Span,
}

/// `enum Name { First, Second = 4 };`
#[derive(Clone, Debug)]
pub struct Enumeration {
    /// The enumeration's name.
    pub name: Identifier,
    /// The choices in order, with the values that the text gives.
    pub choices: Vec<(Identifier, Option<Expression>)>,
    /// The span of the whole declaration.
    pub span: Span,
}

/// `static_assert(condition, "text");`
#[derive(Clone, Debug)]
pub struct Assertion {
    /// The condition, a constant expression.
    pub condition: Expression,
    /// The text that is shown if it is false.
    pub text: String,
    /// The span of the whole assertion.
    pub span: Span,
}

/// A field of a struct.
#[derive(Clone, Debug)]
pub struct Field {
    /// The type, including array sizes of the declarator.
    pub ty: TypeName,
    /// Its name.
    pub name: Identifier,
}

/// A type as written. `float[2] a[3]` is normalised: `sizes` lists the outermost dimension first,
/// here 3 then 2.
#[derive(Clone, Debug)]
pub struct TypeName {
    /// `float`, `vec3`, `color`, `rt_Texture`, a struct's name, `void`.
    pub name: Identifier,
    /// Array dimensions, outermost first; `None` for `[]`.
    pub sizes: Vec<Option<Expression>>,
    /// The span of the whole type.
    pub span: Span,
}

/// The qualifiers before a declaration's type.
#[derive(Clone, Debug, Default)]
pub struct Qualifiers {
    /// All qualifiers in order. The parser reports duplicates and drops them.
    pub list: Vec<(Qualifier, Span)>,
}

impl Qualifiers {
    /// The span of `qualifier`, if present.
    pub fn find(&self, qualifier: Qualifier) -> Option<Span> {
        self.list.iter().find(|(each, _)| *each == qualifier).map(|(_, span)| *span)
    }
}

/// A qualifier of a declaration. The parser accepts and drops precision qualifiers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[allow(missing_docs, reason = "each is the keyword of its name")]
pub enum Qualifier {
    Public,
    Private,
    Scratch,
    Texture,
    /// `output`
    Output,
    Attribute,
    Const,
    Uniform,
    Precise,
    Invariant,
    In,
    Out,
    InOut,
}

/// One `key value` of an annotation `[[key value, key value]]`.
#[derive(Clone, Debug)]
pub struct Annotation {
    /// `label`, `min`, `max`, `doc`, ...
    pub key: Identifier,
    /// The value after the key.
    pub value: AnnotationValue,
}

/// The value of an annotation.
#[derive(Clone, Debug)]
pub enum AnnotationValue {
    /// No value: the key is a flag.
    None,
    /// Double-quoted text with its escapes resolved.
    Text(String, Span),
    /// A constant expression.
    Expression(Expression),
}

/// A variable: a member, a constant or a local variable.
#[derive(Clone, Debug)]
pub struct Variable {
    /// The `[[...]]` before the declaration; only members may have them.
    pub annotations: Vec<Annotation>,
    /// `public`, `const`, ...
    pub qualifiers: Qualifiers,
    /// The type with all array dimensions.
    pub ty: TypeName,
    /// Its name.
    pub name: Identifier,
    /// The initial value after the `=`.
    pub initializer: Option<Initializer>,
    /// The span of the declarator.
    pub span: Span,
}

/// The initial value in a declaration.
#[derive(Clone, Debug)]
pub enum Initializer {
    /// An expression.
    Expression(Expression),
    /// `{ a, b, { c } }`, with a trailing comma allowed.
    List(Vec<Initializer>, Span),
}

/// A function, prototype, method or constructor.
#[derive(Clone, Debug)]
pub struct Function {
    /// Qualifiers before the return type (`precise`, `const`), and `public`/`private` on methods.
    pub qualifiers: Qualifiers,
    /// The result type; `None` for a constructor written without `void`.
    pub result: Option<TypeName>,
    /// The name; `constructor` for the constructor.
    pub name: Identifier,
    /// The parameters. `(void)` gives none.
    pub parameters: Vec<Parameter>,
    /// The body; `None` for a prototype.
    pub body: Option<Block>,
    /// The comment just before the function, without comment marks.
    pub documentation: Option<String>,
    /// The span from the first qualifier to the closing parenthesis.
    pub span: Span,
}

/// A parameter of a function.
#[derive(Clone, Debug)]
pub struct Parameter {
    /// The `[[...]]` before the parameter; only constructor parameters may have them.
    pub annotations: Vec<Annotation>,
    /// `in`, `out`, `inout`, `const`.
    pub qualifiers: Qualifiers,
    /// Its type.
    pub ty: TypeName,
    /// The name, which GLSL allows to be omitted.
    pub name: Option<Identifier>,
    /// The default after `=`, allowed for constructor parameters.
    pub default: Option<Initializer>,
    /// The span of the whole parameter.
    pub span: Span,
}

/// `{ ... }`
#[derive(Clone, Debug)]
pub struct Block {
    /// The statements of the block.
    pub statements: Vec<Statement>,
    /// The span, including the braces.
    pub span: Span,
}

/// `print("t = {}", t)`
#[derive(Clone, Debug)]
pub struct Print {
    /// The text, with a `{}` for each argument.
    pub text: String,
    /// The span of the text.
    pub text_span: Span,
    /// The values to print.
    pub arguments: Vec<Expression>,
}

/// A statement.
#[derive(Clone, Debug)]
pub struct Statement {
    /// The kind of statement, with its parts.
    pub kind: StatementKind,
    /// The span of the whole statement.
    pub span: Span,
}

/// The statements of GLSL, and `illuminance`.
#[derive(Clone, Debug)]
#[allow(missing_docs, reason = "the fields are the parts that each variant shows")]
pub enum StatementKind {
    /// `;`, or the placeholder for a statement that could not be parsed.
    Empty,
    /// `expression;`
    Expression(Expression),
    /// A declaration of one or more variables.
    Variables(Vec<Variable>),
    /// A struct declared in a block, with the variables declared along with it.
    Struct(Struct, Vec<Variable>),
    /// `static_assert(condition, "text");`
    Assertion(Assertion),
    /// `print("t = {}", t);`
    Print(Print),
    /// A function prototype in a block (as in GLSL ES) or a nested function; the checker reports
    /// both.
    Function(Function),
    /// `{ ... }`, a scope.
    Block(Block),
    /// `if (c) a else b`
    If { condition: Expression, then: Box<Statement>, otherwise: Option<Box<Statement>> },
    /// `switch (e) { case 1: ... }`. The statements of each case extend to the next label.
    Switch { selector: Expression, cases: Vec<SwitchCase> },
    /// `for (init; condition; step) body`
    For {
        initializer: Box<Statement>,
        condition: Option<Condition>,
        step: Option<Expression>,
        body: Box<Statement>,
    },
    /// `while (c) body`
    While { condition: Condition, body: Box<Statement> },
    /// `do body while (c);`
    DoWhile { body: Box<Statement>, condition: Expression },
    /// `illuminance body`, `illuminance(P) body`, `illuminance(P, N, angle) body`: 0, 1 or 3
    /// arguments, as the checker verifies.
    Illuminance { arguments: Vec<Expression>, body: Box<Statement> },
    /// `return e;`
    Return(Option<Expression>),
    /// `break;`
    Break,
    /// `continue;`
    Continue,
}

/// The condition of a loop.
#[derive(Clone, Debug)]
pub enum Condition {
    /// An expression.
    Expression(Expression),
    /// `bool b = ...`
    Declaration(Box<Variable>),
}

/// One label of a `switch` with its statements.
#[derive(Clone, Debug)]
pub struct SwitchCase {
    /// The value of `case e:`, or `None` for `default:`.
    pub label: Option<Expression>,
    /// The span of the label.
    pub span: Span,
    /// The statements up to the next label; empty if another label follows directly.
    pub statements: Vec<Statement>,
}

/// An expression.
///
/// Chains of binary operators and commas may be as long as the text. They lean to the left, so
/// visitors must loop over [`Expression::chain`] instead of recursing into left operands. `Clone`
/// and `Drop` do so too.
#[derive(Debug)]
pub struct Expression {
    /// The kind of expression, with its operands.
    pub kind: ExpressionKind,
    /// The span of the whole expression, without enclosing parentheses.
    pub span: Span,
}

impl Expression {
    /// Splits a chain `a + b * c + d` into its leftmost operand and its links, the innermost first.
    /// Each link is a binary operation or sequence whose left operand is the link before.
    pub fn chain(&self) -> (&Expression, Vec<&Expression>) {
        let mut links = Vec::new();
        let mut first = self;
        while let Some(left) = first.left_operand() {
            links.push(first);
            first = left;
        }
        links.reverse();
        (first, links)
    }

    /// True if this is not a link, so that a chain with it as its left operand begins with it.
    pub(crate) fn chain_begins(&self) -> bool {
        self.left_operand().is_none()
    }

    fn left_operand(&self) -> Option<&Expression> {
        match &self.kind {
            ExpressionKind::Binary(_, left, _) | ExpressionKind::Sequence(left, _) => Some(left),
            _ => None,
        }
    }

    /// Takes the left operand out if it is a link itself, and leaves a placeholder.
    fn take_inner_link(&mut self) -> Option<Expression> {
        let (ExpressionKind::Binary(_, left, _) | ExpressionKind::Sequence(left, _)) =
            &mut self.kind
        else {
            return None;
        };
        left.left_operand()?;
        let empty = Expression { kind: ExpressionKind::Error, span: left.span };
        Some(std::mem::replace(left, empty))
    }
}

impl Clone for Expression {
    fn clone(&self) -> Self {
        let (first, links) = self.chain();
        let first = Expression { kind: first.kind.clone(), span: first.span };
        links.into_iter().fold(first, |left, link| {
            let left = Box::new(left);
            let kind = match &link.kind {
                ExpressionKind::Binary(operator, _, right) => {
                    ExpressionKind::Binary(*operator, left, right.clone())
                }
                ExpressionKind::Sequence(_, right) => ExpressionKind::Sequence(left, right.clone()),
                other => unreachable!("a chain has no link {other:?}"),
            };
            Expression { kind, span: link.span }
        })
    }
}

impl Drop for Expression {
    fn drop(&mut self) {
        let mut next = self.take_inner_link();
        while let Some(mut link) = next {
            next = link.take_inner_link();
        }
    }
}

/// The expressions of GLSL.
#[derive(Clone, Debug)]
#[allow(missing_docs, reason = "the fields are the parts that each variant shows")]
pub enum ExpressionKind {
    /// The placeholder for an expression that could not be parsed; the error is already reported.
    Error,
    /// `12`, `0xC`, `012` (value as the bits of a 32-bit integer).
    Int(i32),
    /// `3u`
    Uint(u32),
    /// `1.5`, `1e3f`: the nearest f32.
    Float(f32),
    /// `true`, `false`
    Bool(bool),
    /// A name.
    Name(String),
    /// `(a, b)`
    Sequence(Box<Expression>, Box<Expression>),
    /// `-a`, `!a`, `~a`, `+a`
    Unary(UnaryOperator, Box<Expression>),
    /// `++a`, `a++`, `--a`, `a--`
    Step { target: Box<Expression>, by: StepOperator, prefix: bool },
    /// `a + b`, `a && b`
    Binary(BinaryOperator, Box<Expression>, Box<Expression>),
    /// `a = b`, `a += b`
    Assign { target: Box<Expression>, operator: Option<BinaryOperator>, value: Box<Expression> },
    /// `c ? a : b`
    Conditional(Box<Expression>, Box<Expression>, Box<Expression>),
    /// `a[i]`; also the callee of `float[2](...)`, whose `index` may be absent: `float[](...)`.
    Index(Box<Expression>, Option<Box<Expression>>),
    /// `a.b`: a field or swizzle.
    Member(Box<Expression>, Identifier),
    /// `f(x)`, `vec3(x)`, `float[2](x, y)`: a call of a function or constructor.
    Call { callee: Box<Expression>, arguments: Vec<Expression> },
    /// `a.length()`, `kd.lookup(uv)`.
    MethodCall { receiver: Box<Expression>, method: Identifier, arguments: Vec<Expression> },
}

/// `-`, `!`, `~`, `+`
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[allow(missing_docs, reason = "named by what they do")]
pub enum UnaryOperator {
    Negate,
    Not,
    BitNot,
    Plus,
}

/// `++` and `--`
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[allow(missing_docs, reason = "named by what they do")]
pub enum StepOperator {
    Increment,
    Decrement,
}

/// The binary operators, except assignment and comma.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[allow(missing_docs, reason = "named by what they do")]
pub enum BinaryOperator {
    Add,
    Subtract,
    Multiply,
    Divide,
    Remainder,
    ShiftLeft,
    ShiftRight,
    BitAnd,
    BitOr,
    BitXor,
    Less,
    LessEqual,
    Greater,
    GreaterEqual,
    Equal,
    NotEqual,
    And,
    Or,
    Xor,
}

impl UnaryOperator {
    /// The operator as RTSL writes it.
    pub const fn text(self) -> &'static str {
        match self {
            UnaryOperator::Negate => "-",
            UnaryOperator::Not => "!",
            UnaryOperator::BitNot => "~",
            UnaryOperator::Plus => "+",
        }
    }
}

impl BinaryOperator {
    /// The operator as RTSL writes it.
    pub const fn text(self) -> &'static str {
        match self {
            BinaryOperator::Add => "+",
            BinaryOperator::Subtract => "-",
            BinaryOperator::Multiply => "*",
            BinaryOperator::Divide => "/",
            BinaryOperator::Remainder => "%",
            BinaryOperator::ShiftLeft => "<<",
            BinaryOperator::ShiftRight => ">>",
            BinaryOperator::BitAnd => "&",
            BinaryOperator::BitOr => "|",
            BinaryOperator::BitXor => "^",
            BinaryOperator::Less => "<",
            BinaryOperator::LessEqual => "<=",
            BinaryOperator::Greater => ">",
            BinaryOperator::GreaterEqual => ">=",
            BinaryOperator::Equal => "==",
            BinaryOperator::NotEqual => "!=",
            BinaryOperator::And => "&&",
            BinaryOperator::Or => "||",
            BinaryOperator::Xor => "^^",
        }
    }
}
