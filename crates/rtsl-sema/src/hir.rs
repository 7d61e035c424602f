//! The typed tree: every name resolved, every conversion written out, every overload chosen.
//!
//! A [`Module`] holds the prelude's functions and structs first, then those of the unit, so that
//! ids are the same in both. A class is self-contained: inherited members, methods and
//! functions have been checked again in its own context and stand among its own.
//!
//! Sizes of arrays are known, constant expressions are folded, and no function calls itself,
//! directly or through others.

use std::sync::Arc;

use rtsl_ir::class::Annotation;
use rtsl_ir::{Constant, Scalar};
use rtsl_source::Span;
use rtsl_spec::{Method, Role};

pub use rtsl_syntax::ast::{BinaryOperator, StepOperator, UnaryOperator};

/// A type of the language.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub enum Type {
    /// No value.
    Void,
    /// bool, int, uint or float.
    Scalar(Scalar),
    /// 2 to 4 components.
    Vector(Scalar, u8),
    /// Of float: columns, rows; `mat3x2` has 3 columns of 2 rows.
    Matrix(u8, u8),
    /// As many f32 as `rtsl_spec::COLOR_COMPONENTS`.
    Color,
    /// A struct of the module or the class.
    Struct(StructId),
    /// A fixed-size array.
    Array(Box<Type>, u32),
    /// An unsized array: a buffer member.
    Buffer(Box<Type>),
    /// A reference to an instance.
    Reference(Role),
    /// What an expression has that was reported already; no diagnostic ever speaks of it, and
    /// no tree that reaches the lowering has it.
    Error,
}

/// An index into [`Module::structs`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct StructId(pub u32);

/// An index into [`Module::functions`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct FunctionId(pub u32);

/// An index into [`Module::classes`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct ClassId(pub u32);

/// An index into [`Class::members`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct MemberId(pub u32);

/// An index into [`Function::locals`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct LocalId(pub u32);

/// An index into [`rtsl_spec::state_variables`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct StateId(pub u32);

/// A checked translation unit on top of the prelude.
#[derive(Clone, Debug, Default)]
pub struct Module {
    /// All structs, those declared in classes and blocks too.
    pub structs: Vec<Arc<Struct>>,
    /// All functions, methods and constructors; file scope and classes.
    pub functions: Vec<Arc<Function>>,
    /// The classes of the unit (and the prelude's own).
    pub classes: Vec<Class>,
}

/// A struct.
#[derive(Clone, Debug)]
pub struct Struct {
    /// Its name.
    pub name: String,
    /// Its fields.
    pub fields: Vec<(String, Type)>,
}

/// A class.
#[derive(Clone, Debug)]
pub struct Class {
    /// Its name.
    pub name: String,
    /// Its roles, in the order of [`Role::ALL`], inherited ones too.
    pub roles: Vec<Role>,
    /// Its documentation comment.
    pub documentation: Option<String>,
    /// All members, inherited ones first. Constants (`const`) are folded away and not here.
    pub members: Vec<Member>,
    /// The constructor.
    pub constructor: Option<Constructor>,
    /// The methods: its own, inherited ones, and those implied by others.
    pub methods: Vec<(Method, FunctionId)>,
    /// The header.
    pub span: Span,
}

/// A member.
#[derive(Clone, Debug)]
pub struct Member {
    /// Its name.
    pub name: String,
    /// Its type; buffers and references are told by it.
    pub ty: Type,
    /// Where it lives.
    pub storage: Storage,
    /// Its initial value; reads no member and no state.
    pub initializer: Option<Expression>,
    /// Annotations, values folded.
    pub annotations: Vec<Annotation>,
    /// For references: tested with `isSet` somewhere in the class.
    pub tested: bool,
    /// The declarator.
    pub span: Span,
}

/// Where a member lives.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Storage {
    /// A parameter of the instance.
    Public,
    /// Data of the instance.
    Private,
    /// Per ray.
    Scratch,
}

/// A constructor: a function of its parameters, with their defaults.
#[derive(Clone, Debug)]
pub struct Constructor {
    /// Its body and parameters.
    pub function: FunctionId,
    /// One entry a parameter.
    pub parameters: Vec<ConstructorParameter>,
}

/// What a constructor parameter has beyond a function's.
#[derive(Clone, Debug)]
pub struct ConstructorParameter {
    /// Its default; reads no member, no state, no other parameter.
    pub default: Option<Expression>,
    /// Annotations, values folded.
    pub annotations: Vec<Annotation>,
}

/// A function, method or constructor.
#[derive(Clone, Debug)]
pub struct Function {
    /// Its name.
    pub name: String,
    /// The comment just before it.
    pub documentation: Option<String>,
    /// The class in whose context it was checked: its `Member` expressions index that class.
    pub class: Option<ClassId>,
    /// For interface methods which one, in which role state directions are looked up; `None` for helpers.
    pub method: Option<Method>,
    /// What it returns; zero where its end is reached without a `return`.
    pub result: Type,
    /// `precise` function result.
    pub precise: bool,
    /// The first of [`Function::locals`] are these parameters.
    pub parameters: Vec<Passing>,
    /// Parameters, then all variables of the body.
    pub locals: Vec<Local>,
    /// What it does; a prototype without body has been reported.
    pub body: Vec<Statement>,
    /// Its header.
    pub span: Span,
}

/// How an argument is passed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Passing {
    /// Copied in.
    In,
    /// Copied out at the return; zero before.
    Out,
    /// Both.
    InOut,
}

/// A parameter or variable.
#[derive(Clone, Debug)]
pub struct Local {
    /// Its name.
    pub name: String,
    /// Its type.
    pub ty: Type,
    /// `precise`: what is computed for it is not contracted.
    pub precise: bool,
}

/// A statement.
#[derive(Clone, Debug)]
pub struct Statement {
    /// What it is.
    pub kind: StatementKind,
    /// Where.
    pub span: Span,
}

/// The statements. All loops have one form.
#[derive(Clone, Debug)]
pub enum StatementKind {
    /// Evaluated for its effects.
    Expression(Expression),
    /// The variable's life begins, with its initial value or zero.
    Declare(LocalId, Option<Expression>),
    /// `{ }`
    Block(Vec<Statement>),
    /// `if`
    If {
        /// bool.
        condition: Expression,
        /// Where true.
        then: Vec<Statement>,
        /// Where false.
        otherwise: Vec<Statement>,
    },
    /// `switch`: runs from the matching case on, through the following ones until a `break`.
    Switch {
        /// int or uint.
        selector: Expression,
        /// In order of the text.
        cases: Vec<SwitchCase>,
    },
    /// `for`, `while`, `do`.
    Loop(Box<Loop>),
    /// `illuminance`
    Illuminance(Box<Illuminance>),
    /// `return`
    Return(Option<Expression>),
    /// `break`
    Break,
    /// `continue`
    Continue,
}

/// `for (initializer; condition; step) body`.
#[derive(Clone, Debug)]
pub struct Loop {
    /// Run once, its variables live in the loop.
    pub initializer: Vec<Statement>,
    /// `while (bool b = ...)` declares this before each test.
    pub declaration: Option<LocalId>,
    /// bool; for ever where absent. With a declaration: its initial value.
    pub condition: Option<Expression>,
    /// After each round, `continue` included.
    pub step: Option<Expression>,
    /// What is repeated.
    pub body: Vec<Statement>,
    /// `do`: the body comes before the first test.
    pub test_last: bool,
}

/// `illuminance`.
#[derive(Clone, Debug)]
pub struct Illuminance {
    /// vec3; `rt_HitPoint` where absent.
    pub point: Option<Expression>,
    /// vec3 and float (radians): axis and half angle of the cone.
    pub cone: Option<(Expression, Expression)>,
    /// Run for each light.
    pub body: Vec<Statement>,
}

/// One label of a `switch` with the statements up to the next.
#[derive(Clone, Debug)]
pub struct SwitchCase {
    /// The values, folded; empty for `default`.
    pub value: Option<Constant>,
    /// Statements up to the next label.
    pub body: Vec<Statement>,
}

/// An expression with its type. Chains of binary operators and commas may be as long as the text: they lean to
/// the left, and whoever visits them loops over [`Expression::chain`]. Cloning and dropping do.
#[derive(Debug)]
pub struct Expression {
    /// What it is.
    pub kind: ExpressionKind,
    /// Its type.
    pub ty: Type,
    /// Where.
    pub span: Span,
}

impl Expression {
    /// The links of a chain `a + b && c, d`, the innermost first, and what it begins with: the left operand of each
    /// link is the link before.
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

    fn left_operand(&self) -> Option<&Expression> {
        match &self.kind {
            ExpressionKind::Binary(_, left, _)
            | ExpressionKind::And(left, _)
            | ExpressionKind::Or(left, _)
            | ExpressionKind::Sequence(left, _) => Some(left),
            _ => None,
        }
    }

    /// The left operand where it has one itself, which leaves an empty place.
    fn take_inner_link(&mut self) -> Option<Expression> {
        let (ExpressionKind::Binary(_, left, _)
        | ExpressionKind::And(left, _)
        | ExpressionKind::Or(left, _)
        | ExpressionKind::Sequence(left, _)) = &mut self.kind
        else {
            return None;
        };
        left.left_operand()?;
        let empty = Expression { kind: ExpressionKind::Error, ty: Type::Error, span: left.span };
        Some(std::mem::replace(left, empty))
    }
}

impl Clone for Expression {
    fn clone(&self) -> Self {
        let (first, links) = self.chain();
        let Expression { kind, ty, span } = first;
        let first = Expression { kind: kind.clone(), ty: ty.clone(), span: *span };
        links.into_iter().fold(first, |left, link| {
            let left = Box::new(left);
            let kind = match &link.kind {
                ExpressionKind::Binary(operator, _, right) => {
                    ExpressionKind::Binary(*operator, left, right.clone())
                }
                ExpressionKind::And(_, right) => ExpressionKind::And(left, right.clone()),
                ExpressionKind::Or(_, right) => ExpressionKind::Or(left, right.clone()),
                ExpressionKind::Sequence(_, right) => ExpressionKind::Sequence(left, right.clone()),
                other => unreachable!("a chain has no link {other:?}"),
            };
            Expression { kind, ty: link.ty.clone(), span: link.span }
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

/// The expressions. Operands have the types that the operation takes: conversions are written out.
#[derive(Clone, Debug)]
pub enum ExpressionKind {
    /// A constant scalar, or the components of a constant vector, matrix (column by column) or
    /// color, or all leaves of a constant array or struct element by element and field by field. Shared, since a table may be large and
    /// used often.
    Constant(Arc<[Constant]>),
    /// A local variable.
    Local(LocalId),
    /// A member of the class: data, scratch, buffer or reference.
    Member(MemberId),
    /// A state variable.
    State(StateId),
    /// Components of a vector, scalar swizzles not included: `v.zyx`, `v.x`.
    Swizzle(Box<Expression>, Vec<u8>),
    /// A field of a struct.
    Field(Box<Expression>, u32),
    /// `a[i]` of an array, buffer, vector or matrix (a column). The index is int or uint.
    Index(Box<Expression>, Box<Expression>),
    /// To the expression's type, which has the same shape with another scalar; or int/uint/float of
    /// a bool and back.
    Convert(Box<Expression>),
    /// GLSL's constructors for the expression's type, arguments in order, of any types that the
    /// checker has accepted: vectors and matrices from components, from one scalar (splat, diagonal),
    /// matrix from matrix, truncation; arrays and structs element by element; color from float,
    /// vec3 or three floats; a scalar from the first component of its argument.
    Construct(Vec<Expression>),
    /// `-`, `!`, `~` componentwise. `+` has gone.
    Unary(UnaryOperator, Box<Expression>),
    /// Arithmetic, bitwise, comparison, `==` and `!=` of any type; `^^`. Operands are of one type, or
    /// one is a scalar of the other's component type (to be spread), or it is GLSL's linear
    /// algebra: matrix times matrix, matrix times vector, vector times matrix; shifts may
    /// differ in signedness.
    Binary(BinaryOperator, Box<Expression>, Box<Expression>),
    /// `a && b`: the second evaluated only where the first is true.
    And(Box<Expression>, Box<Expression>),
    /// `a || b`: the second evaluated only where the first is false.
    Or(Box<Expression>, Box<Expression>),
    /// `a = b` or `a op= b`; gives the new value. The target is an lvalue: locals, members, state and
    /// their fields, elements and swizzles without repetition.
    Assign {
        /// What is assigned.
        target: Box<Expression>,
        /// `op` of `op=`, by the rules of [`ExpressionKind::Binary`].
        operator: Option<BinaryOperator>,
        /// The right side.
        value: Box<Expression>,
    },
    /// `++`, `--` on int, uint, float, their vectors, and matrices.
    Step {
        /// What is stepped.
        target: Box<Expression>,
        /// Up or down.
        by: StepOperator,
        /// Gives the new value (else the old).
        prefix: bool,
    },
    /// `c ? a : b`; only one side is evaluated.
    Conditional(Box<Expression>, Box<Expression>, Box<Expression>),
    /// `a, b`
    Sequence(Box<Expression>, Box<Expression>),
    /// A user's or the prelude's function, or a method of the same class. One argument a parameter; `out`
    /// and `inout` arguments are lvalues, found before the call from left to right and written after it
    /// in the same order. What an `out` parameter hands back is converted to its argument's type.
    Call(FunctionId, Vec<Expression>),
    /// A built-in that the lowering does itself: the entry and the chosen overload.
    Builtin(BuiltinCall),
    /// A method of a referenced instance.
    ReferenceCall(Box<ReferenceCall>),
    /// `isSet(reference)`; the expression is a reference.
    IsSet(Box<Expression>),
    /// `a.length()` of a buffer; other lengths are constants.
    Length(Box<Expression>),
    /// Was reported.
    Error,
}

/// A call of a built-in function.
#[derive(Clone, Debug)]
pub struct BuiltinCall {
    /// Its name in `rtsl_spec::builtins`, which says how it is lowered.
    pub name: &'static str,
    /// Where the registry says `Prelude`: the prelude's function, on whole arguments or, where it takes
    /// scalars and the arguments are vectors, applied component by component (`componentwise`).
    pub prelude: Option<FunctionId>,
    /// Apply to each component, scalar arguments spread.
    pub componentwise: bool,
    /// Arguments converted to the overload's types; `out` ones are lvalues as in [`ExpressionKind::Call`].
    pub arguments: Vec<Expression>,
}

/// `kd.lookup(uv)` and its like.
#[derive(Clone, Debug)]
pub struct ReferenceCall {
    /// A reference member, or an element of an array of references.
    pub reference: Expression,
    /// The role it is called in.
    pub role: Role,
    /// What is called.
    pub function: ReferenceFunction,
    /// `lookup(uv)`, `lookup(uvw)`: none, a vec2 or a vec3.
    pub arguments: Vec<Expression>,
}

/// What can be called on a reference.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[allow(missing_docs, reason = "named as in the language")]
pub enum ReferenceFunction {
    Lookup,
    LookupFloat,
    Shade,
    Bsdf,
    SampleBsdf,
    EvaluatePdf,
    Emission,
}
