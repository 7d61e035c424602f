//! Programs as data: what the generator makes, the printer writes and the evaluator runs.

use rtsl_ir::{BinaryOp, CompareOp, Scalar, UnaryOp};

/// A scalar, or a vector with 2 to 4 components.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Type {
    pub scalar: Scalar,
    pub size: u8,
}

impl Type {
    pub const fn scalar(scalar: Scalar) -> Type {
        Type { scalar, size: 1 }
    }

    pub const BOOL: Type = Type::scalar(Scalar::Bool);
    pub const INT: Type = Type::scalar(Scalar::I32);
    pub const FLOAT: Type = Type::scalar(Scalar::F32);
}

/// A variable, a parameter or a scratch member; an array of these where it has a count.
#[derive(Clone, Debug)]
pub struct Variable {
    pub name: String,
    pub ty: Type,
    pub count: Option<u32>,
    /// Counts the rounds of a loop: never a target.
    pub counter: bool,
}

impl Variable {
    pub fn scalars(&self) -> usize {
        usize::from(self.ty.size) * self.count.unwrap_or(1) as usize
    }
}

/// An index into a function's variables or the program's members.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Name {
    Local(usize),
    Member(usize),
}

/// An lvalue of a basic type.
#[derive(Clone, Debug)]
pub struct Target {
    pub name: Name,
    /// Of an array.
    pub element: Option<Expression>,
    pub components: Components,
}

#[derive(Clone, Debug)]
pub enum Components {
    All,
    /// Without repetition in lvalues.
    Swizzle(Vec<u8>),
    Dynamic(Box<Expression>),
}

#[derive(Clone, Debug)]
pub struct Expression {
    pub ty: Type,
    pub kind: Kind,
}

#[derive(Clone, Debug)]
pub enum Kind {
    /// Bits of each component.
    Constant(Vec<u32>),
    /// Components of the state variable `rt_TextureUVW`.
    Input(Vec<u8>),
    Read(Box<Target>),
    Swizzle(Box<Expression>, Vec<u8>),
    Unary(UnaryOp, Box<Expression>),
    /// Componentwise; a scalar serves for all components.
    Binary(BinaryOp, Box<Expression>, Box<Expression>),
    /// Of scalars; `==` and `!=` of whole vectors too.
    Compare(CompareOp, Box<Expression>, Box<Expression>),
    /// `&&` or `||`.
    Logical(bool, Box<Expression>, Box<Expression>),
    Conditional(Box<Expression>, Box<Expression>, Box<Expression>),
    /// From the components of these, converted.
    Construct(Vec<Expression>),
    Builtin(Builtin, Vec<Expression>),
    Call(usize, Vec<Argument>),
    Assign(Box<Target>, Option<BinaryOp>, Box<Expression>),
    /// Up or down; the new value or the old.
    Step {
        target: Box<Target>,
        up: bool,
        prefix: bool,
    },
}

#[derive(Clone, Debug)]
pub enum Argument {
    Value(Expression),
    Place(Target),
}

/// Built-in functions. The evaluator knows the exact formula of all but the last kind.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Builtin {
    Abs,
    Floor,
    Ceil,
    Trunc,
    Sqrt,
    Min,
    Max,
    Clamp,
    Mix,
    Step,
    Sign,
    Fma,
    Dot,
    Any,
    All,
    LessThan,
    FloatBitsToInt,
    /// Of the prelude, on numbers of type float or vectors of these.
    Prelude(&'static str),
}

impl Builtin {
    pub const fn name(self) -> &'static str {
        match self {
            Builtin::Abs => "abs",
            Builtin::Floor => "floor",
            Builtin::Ceil => "ceil",
            Builtin::Trunc => "trunc",
            Builtin::Sqrt => "sqrt",
            Builtin::Min => "min",
            Builtin::Max => "max",
            Builtin::Clamp => "clamp",
            Builtin::Mix => "mix",
            Builtin::Step => "step",
            Builtin::Sign => "sign",
            Builtin::Fma => "fma",
            Builtin::Dot => "dot",
            Builtin::Any => "any",
            Builtin::All => "all",
            Builtin::LessThan => "lessThan",
            Builtin::FloatBitsToInt => "floatBitsToInt",
            Builtin::Prelude(name) => name,
        }
    }
}

#[derive(Clone, Debug)]
pub enum Statement {
    /// A declaration, zero where there is no value.
    Declare(usize, Option<Expression>),
    Expression(Expression),
    If(Expression, Vec<Statement>, Vec<Statement>),
    /// `for (int i = 0; i < count; i++)`
    For(usize, Expression, Vec<Statement>),
    /// `int i = 0; while (i++ < count && condition)`
    While(usize, u32, Expression, Vec<Statement>),
    /// `int i = 0; do { } while (i++ < count && condition);`
    DoWhile(usize, u32, Expression, Vec<Statement>),
    /// Labels (`None` is `default`) with their statements.
    Switch(Expression, Vec<(Option<i32>, Vec<Statement>)>),
    Break,
    Continue,
    Return(Option<Expression>),
}

/// The direction of a parameter.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Passing {
    In,
    Out,
    InOut,
}

#[derive(Clone, Debug)]
pub struct Function {
    pub name: String,
    pub result: Option<Type>,
    /// The first variables are the parameters.
    pub parameters: Vec<Passing>,
    pub variables: Vec<Variable>,
    pub body: Vec<Statement>,
}

/// A texture: helpers first, `lookup` last. A function calls only earlier ones.
#[derive(Clone, Debug)]
pub struct Program {
    pub members: Vec<Variable>,
    pub functions: Vec<Function>,
}
