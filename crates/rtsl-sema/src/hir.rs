//! The typed tree: every name resolved, every conversion explicit, every overload chosen.
//!
//! A [`Module`] holds the prelude's functions and structs first, then those of the unit, so that
//! ids are the same in both. A class is self-contained: inherited members, methods and functions
//! have been checked again in its context and are listed among its own.
//!
//! Sizes of arrays are known, constant expressions are folded, and no function is recursive.

use std::sync::Arc;

use rtsl_ir::class::Annotation;
use rtsl_ir::{Constant, Scalar};
use rtsl_source::Span;
use rtsl_spec::builtins::{Builtin, ReferenceMethod};
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
    /// A matrix of floats with these columns and rows: `mat3x2` has 3 columns of 2 rows.
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
    /// The type of an erroneous expression that was reported. It never appears in a diagnostic, nor
    /// in a tree that reaches the lowering.
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
    /// All structs, including those declared in classes and blocks.
    pub structs: Vec<Arc<Struct>>,
    /// All functions, methods and constructors, of file scope and classes.
    pub functions: Vec<Arc<Function>>,
    /// The classes of the unit (and the prelude's own).
    pub classes: Vec<Class>,
}

/// A struct.
#[derive(Clone, Debug)]
pub struct Struct {
    /// The name.
    pub name: String,
    /// The fields, with name and type.
    pub fields: Vec<(String, Type)>,
}

/// A class.
#[derive(Clone, Debug)]
pub struct Class {
    /// The name.
    pub name: String,
    /// The roles in the order of [`Role::ALL`], including inherited ones.
    pub roles: Vec<Role>,
    /// The documentation comment.
    pub documentation: Option<String>,
    /// All members, inherited ones first. `const` members are folded and not listed.
    pub members: Vec<Member>,
    /// The constructor.
    pub constructor: Option<Constructor>,
    /// The methods, including inherited and implied ones.
    pub methods: Vec<(Method, FunctionId)>,
    /// True for a class of a module that the unit uses.
    pub is_imported: bool,
    /// The span of the header.
    pub span: Span,
}

/// A member.
#[derive(Clone, Debug)]
pub struct Member {
    /// The name.
    pub name: String,
    /// The type, which also marks buffers and references.
    pub ty: Type,
    /// The storage class.
    pub storage: Storage,
    /// The initial value, which reads no member and no state.
    pub initializer: Option<Expression>,
    /// The annotations, with values folded.
    pub annotations: Vec<Annotation>,
    /// True if the host may set a texture instead of a value.
    pub textured: bool,
    /// For references: true if the class tests it with `isSet`. For textured members: true if it tests it with
    /// `isTextured`.
    pub tested: bool,
    /// For textured members: the function of a class below that takes the place of value and texture.
    pub computed: Option<FunctionId>,
    /// The span of the declarator.
    pub span: Span,
}

/// The storage class of a member.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Storage {
    /// A parameter of the instance.
    Public,
    /// Data of the instance.
    Private,
    /// Data of a ray.
    Scratch,
    /// Data of a ray that hosts may keep, such as an AOV.
    Output,
    /// A value of the object that a ray hit, which the scene gives.
    Attribute,
}

impl Storage {
    /// True if the member is data of a ray.
    pub fn is_of_ray(self) -> bool {
        matches!(self, Storage::Scratch | Storage::Output)
    }
}

/// A constructor: a function of its parameters, with their defaults.
#[derive(Clone, Debug)]
pub struct Constructor {
    /// The function with the body and the parameters.
    pub function: FunctionId,
    /// One entry for each parameter.
    pub parameters: Vec<ConstructorParameter>,
}

/// The data that a constructor parameter has beyond a function's.
#[derive(Clone, Debug)]
pub struct ConstructorParameter {
    /// The default, which reads no member, no state, no other parameter.
    pub default: Option<Expression>,
    /// The annotations, with values folded.
    pub annotations: Vec<Annotation>,
    /// The span of the parameter.
    pub span: Span,
}

/// A function, method or constructor.
#[derive(Clone, Debug)]
pub struct Function {
    /// The name.
    pub name: String,
    /// The documentation comment.
    pub documentation: Option<String>,
    /// The class in whose context it was checked; its `Member` expressions index that class.
    pub class: Option<ClassId>,
    /// The interface method that it implements, for looking up directions of state variables;
    /// `None` for helpers.
    pub method: Option<Method>,
    /// The result type. The result is zero if the end of the body is reached without a `return`.
    pub result: Type,
    /// True if the result is `precise`.
    pub precise: bool,
    /// The passing modes of the parameters, which are the first of [`Function::locals`].
    pub parameters: Vec<Passing>,
    /// The values of the last parameters in calls that leave them out; calls in the module have them.
    pub defaults: Vec<Expression>,
    /// The parameters, then all variables of the body.
    pub locals: Vec<Local>,
    /// The body; a prototype without a definition has been reported.
    pub body: Vec<Statement>,
    /// The span of the header.
    pub span: Span,
    /// The span of the closing brace; that of the header for a prototype.
    pub end: Span,
}

/// The passing mode of an argument.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Passing {
    /// Copied in at the call.
    In,
    /// Copied out at the return; zero before.
    Out,
    /// Copied in at the call and out at the return.
    InOut,
}

/// A parameter or variable.
#[derive(Clone, Debug)]
pub struct Local {
    /// The name.
    pub name: String,
    /// The type.
    pub ty: Type,
    /// True for `precise` variables: computations for them are not contracted.
    pub precise: bool,
}

/// A statement.
#[derive(Clone, Debug)]
pub struct Statement {
    /// The kind of statement, with its parts.
    pub kind: StatementKind,
    /// The span of the statement.
    pub span: Span,
}

/// The kinds of statement. All loops have one form.
#[derive(Clone, Debug)]
pub enum StatementKind {
    /// An expression evaluated for its effects.
    Expression(Expression),
    /// Begins the lifetime of a variable, with its initial value or zero.
    Declare(LocalId, Option<Expression>),
    /// `{ }`
    Block(Vec<Statement>),
    /// `if`
    If {
        /// The condition, a bool.
        condition: Expression,
        /// The statements if it is true.
        then: Vec<Statement>,
        /// The statements if it is false.
        otherwise: Vec<Statement>,
    },
    /// `switch`: runs from the matching case on, through the following ones until a `break`.
    Switch {
        /// The selector, an int or uint.
        selector: Expression,
        /// The cases in order of the text.
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
    /// `print`, where prints are kept.
    Print {
        /// The parts of the text before, between and after the values: one more than these.
        pieces: Vec<String>,
        /// The values: scalars, vectors, matrices and colors.
        arguments: Vec<Expression>,
    },
}

/// `for (initializer; condition; step) body`.
#[derive(Clone, Debug)]
pub struct Loop {
    /// Statements that run once; their variables live as long as the loop.
    pub initializer: Vec<Statement>,
    /// The variable of `while (bool b = ...)`, declared before each test.
    pub declaration: Option<LocalId>,
    /// The condition, a bool; if absent, the loop is endless. With a declaration, it is the
    /// variable's initial value.
    pub condition: Option<Expression>,
    /// The step after each iteration, also after a `continue`.
    pub step: Option<Expression>,
    /// The body.
    pub body: Vec<Statement>,
    /// True for `do`: the body runs before the first test.
    pub test_last: bool,
}

/// `illuminance`.
#[derive(Clone, Debug)]
pub struct Illuminance {
    /// The point, a vec3; `rt_HitPoint` if absent.
    pub point: Option<Expression>,
    /// The cone: its axis, a vec3, and half angle, a float in radians.
    pub cone: Option<(Expression, Expression)>,
    /// The statements to run for each light.
    pub body: Vec<Statement>,
}

/// One label of a `switch` with the statements up to the next.
#[derive(Clone, Debug)]
pub struct SwitchCase {
    /// The value, folded; `None` for `default`.
    pub value: Option<Constant>,
    /// The statements up to the next label.
    pub body: Vec<Statement>,
}

/// An expression with its type.
///
/// Chains of binary operators and commas may be as long as the text. They lean to the left, so
/// visitors must loop over [`Expression::chain`] instead of recursing into left operands. `Clone`
/// and `Drop` do so too.
#[derive(Debug)]
pub struct Expression {
    /// The kind of expression, with its operands.
    pub kind: ExpressionKind,
    /// The type.
    pub ty: Type,
    /// The span.
    pub span: Span,
}

impl Expression {
    /// Splits a chain `a + b && c, d` into its leftmost operand and its links, the innermost first.
    /// The left operand of each link is the link before.
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

    /// Takes the left operand out if it is a link itself, and leaves a placeholder.
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

/// The kinds of expression. Operands have the types that the operation requires: conversions are
/// explicit.
#[derive(Clone, Debug)]
pub enum ExpressionKind {
    /// A constant scalar, or the components of a constant vector, matrix (column by column) or
    /// color, or all leaves of a constant array or struct, element by element and field by field.
    /// It is shared, since a table may be large and used often.
    Constant(Arc<[Constant]>),
    /// A local variable.
    Local(LocalId),
    /// A member of the class: data, scratch, buffer or reference.
    Member(MemberId),
    /// The value of a textured member, or that of its texture at the hit. In the constructor, the value, even if there
    /// is a texture.
    Textured(MemberId),
    /// The value of a textured member that a function computes. In the constructor, the initial value.
    Computed(MemberId, FunctionId),
    /// A state variable.
    State(StateId),
    /// Components of a vector, scalar swizzles not included: `v.zyx`, `v.x`.
    Swizzle(Box<Expression>, Vec<u8>),
    /// A field of a struct.
    Field(Box<Expression>, u32),
    /// `a[i]` of an array, buffer, vector or matrix (giving a column). The index is int or uint.
    Index(Box<Expression>, Box<Expression>),
    /// A conversion to the expression's type, which has the same form with another scalar; or
    /// between bool and int, uint or float.
    Convert(Box<Expression>),
    /// A constructor of the expression's type, as in GLSL, with arguments in order, of any types
    /// that the checker has accepted: vectors and matrices from components or from one scalar
    /// (splat, diagonal); a matrix from a matrix; truncation; arrays and structs element by
    /// element; a color from a float, a vec3 or three floats; a scalar from the first component of
    /// its argument.
    Construct(Vec<Expression>),
    /// `-`, `!`, `~` componentwise. The checker drops `+`.
    Unary(UnaryOperator, Box<Expression>),
    /// Arithmetic, bitwise operations, comparison, `==` and `!=` of any type, `^^`. The operands
    /// have one type, or one is a scalar of the other's component type (to be splat), or the
    /// operation is a product of GLSL's linear algebra: matrix times matrix, matrix times vector,
    /// vector times matrix. The operands of a shift may differ in signedness.
    Binary(BinaryOperator, Box<Expression>, Box<Expression>),
    /// `a && b`: the second operand is evaluated only if the first is true.
    And(Box<Expression>, Box<Expression>),
    /// `a || b`: the second operand is evaluated only if the first is false.
    Or(Box<Expression>, Box<Expression>),
    /// `a = b` or `a op= b`; the value is the new one. The target is an lvalue: locals, members,
    /// state and their fields, elements and swizzles without repetition.
    Assign {
        /// The target.
        target: Box<Expression>,
        /// The `op` of `op=`, by the rules of [`ExpressionKind::Binary`].
        operator: Option<BinaryOperator>,
        /// The right side.
        value: Box<Expression>,
    },
    /// `++`, `--` on int, uint, float, their vectors, and matrices.
    Step {
        /// The target.
        target: Box<Expression>,
        /// Increment or decrement.
        by: StepOperator,
        /// True if the value is the new one; else it is the old one.
        prefix: bool,
    },
    /// `c ? a : b`; only one operand is evaluated.
    Conditional(Box<Expression>, Box<Expression>, Box<Expression>),
    /// `a, b`
    Sequence(Box<Expression>, Box<Expression>),
    /// A call of a user's or the prelude's function, or of a method of the same class, with one
    /// argument for each parameter. `out` and `inout` arguments are lvalues, evaluated before the
    /// call from left to right and written after it in the same order. The value of an `out`
    /// parameter is converted to its argument's type.
    Call(FunctionId, Vec<Expression>),
    /// A call of a built-in function: the entry and the chosen overload.
    Builtin(BuiltinCall),
    /// A call of a method of a referenced instance.
    ReferenceCall(Box<ReferenceCall>),
    /// `isSet(reference)` or `isTextured(parameter)`; the operand is a reference or a textured member.
    IsSet(Box<Expression>),
    /// `a.length()` of a buffer; other lengths are constants.
    Length(Box<Expression>),
    /// An erroneous expression that was reported.
    Error,
}

/// A call of a built-in function.
#[derive(Clone, Debug)]
pub struct BuiltinCall {
    /// The entry in `rtsl_spec::builtins`: a function, or a method of a struct, whose first argument is the struct.
    pub builtin: &'static Builtin,
    /// For the lowering `Prelude`: the prelude's function. It takes whole arguments or, if it takes
    /// scalars and the arguments are vectors, is applied component by component (`componentwise`).
    pub prelude: Option<FunctionId>,
    /// True if the call applies to each component, with scalar arguments splat.
    pub componentwise: bool,
    /// The arguments, converted to the overload's types; `out` ones are lvalues as in
    /// [`ExpressionKind::Call`].
    pub arguments: Vec<Expression>,
}

/// A call of a method of a reference, such as `kd.lookup(uv)`.
#[derive(Clone, Debug)]
pub struct ReferenceCall {
    /// A reference member, an element of an array of references, or a parameter.
    pub reference: Expression,
    /// The method that is called.
    pub method: &'static ReferenceMethod,
    /// The state variables that the callee sees with another value than the caller, in the order of the arguments. The
    /// argument of `lookup(uv)` is one for `rt_TextureUV`.
    pub arguments: Vec<StateArgument>,
}

/// An argument of a call of a reference: the value of a state variable.
#[derive(Clone, Debug)]
pub struct StateArgument {
    /// The state variable, an input of the callee.
    pub state: StateId,
    /// The value, of the variable's type.
    pub value: Expression,
}
