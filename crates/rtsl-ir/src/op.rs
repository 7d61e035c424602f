//! Scalar types, constants and operations.

use std::sync::Arc;

use rtsl_spec::{Method, Role};

use crate::{Event, Query, Region, Value, Values, VariableId};

/// The type of a value.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Scalar {
    /// IEEE 754 binary32.
    F32,
    /// 32 bits, two's complement, wrapping.
    I32,
    /// 32 bits, wrapping.
    U32,
    /// True or false.
    Bool,
}

impl Scalar {
    /// All types.
    pub const ALL: [Scalar; 4] = [Scalar::F32, Scalar::I32, Scalar::U32, Scalar::Bool];

    /// Returns the type with this keyword.
    pub fn from_name(name: &str) -> Option<Scalar> {
        Scalar::ALL.into_iter().find(|scalar| scalar.name() == name)
    }

    /// Returns the keyword of the text form.
    pub const fn name(self) -> &'static str {
        match self {
            Scalar::F32 => "f32",
            Scalar::I32 => "i32",
            Scalar::U32 => "u32",
            Scalar::Bool => "bool",
        }
    }
}

/// A constant. Equality compares bits: -0 differs from 0, and a NaN equals itself.
#[derive(Clone, Copy, Debug)]
#[allow(missing_docs, reason = "named by their types")]
pub enum Constant {
    F32(f32),
    I32(i32),
    U32(u32),
    Bool(bool),
}

impl Constant {
    /// Returns the type.
    pub const fn scalar(self) -> Scalar {
        match self {
            Constant::F32(_) => Scalar::F32,
            Constant::I32(_) => Scalar::I32,
            Constant::U32(_) => Scalar::U32,
            Constant::Bool(_) => Scalar::Bool,
        }
    }

    /// Returns the bits: 0 or 1 for a bool.
    pub const fn bits(self) -> u32 {
        match self {
            Constant::F32(value) => value.to_bits(),
            Constant::I32(value) => value as u32,
            Constant::U32(value) => value,
            Constant::Bool(value) => value as u32,
        }
    }

    /// Returns the constant of this type with these bits; for bool, any bits but 0 are true.
    pub const fn from_bits(scalar: Scalar, bits: u32) -> Constant {
        match scalar {
            Scalar::F32 => Constant::F32(f32::from_bits(bits)),
            Scalar::I32 => Constant::I32(bits as i32),
            Scalar::U32 => Constant::U32(bits),
            Scalar::Bool => Constant::Bool(bits != 0),
        }
    }

    /// Returns zero or false.
    pub const fn zero(scalar: Scalar) -> Constant {
        Constant::from_bits(scalar, 0)
    }
}

impl PartialEq for Constant {
    fn eq(&self, other: &Self) -> bool {
        self.scalar() == other.scalar() && self.bits() == other.bits()
    }
}

impl Eq for Constant {}

impl std::hash::Hash for Constant {
    fn hash<H: std::hash::Hasher>(&self, state: &mut H) {
        (self.scalar(), self.bits()).hash(state);
    }
}

/// Operations on one value; the result has the operand's type.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum UnaryOp {
    /// f32: flips the sign bit. i32, u32: wrapping.
    Negate,
    /// i32, u32: bitwise. bool: logical.
    Not,
    /// f32: clears the sign bit. i32: wrapping (the least value stays).
    Abs,
    /// f32: correctly rounded, as IEEE 754 requires.
    Sqrt,
    /// f32: to an integral value, downward.
    Floor,
    /// f32: upward.
    Ceil,
    /// f32: towards zero.
    Trunc,
    /// f32: to nearest, ties to even.
    RoundEven,
    /// f32: approximately `1 / a`. Only where results may differ between machines, as the next two.
    ApproximateReciprocal,
    /// f32: approximately `1 / sqrt(a)`.
    ApproximateInverseSqrt,
    /// f32: approximately `sqrt(a)`.
    ApproximateSqrt,
    /// bool: the operand itself. A hint by the author that it is rarely true, so an `if` on it remains a branch.
    Seldom,
}

impl UnaryOp {
    /// The operators whose results are the same on all machines.
    pub const EXACT: &[UnaryOp] = &[
        UnaryOp::Negate,
        UnaryOp::Not,
        UnaryOp::Abs,
        UnaryOp::Sqrt,
        UnaryOp::Floor,
        UnaryOp::Ceil,
        UnaryOp::Trunc,
        UnaryOp::RoundEven,
        UnaryOp::Seldom,
    ];
}

/// Gives an enumeration of operators its keywords in the text form.
macro_rules! named {
    ($name:ident: $($variant:ident => $keyword:literal,)*) => {
        impl $name {
            /// All operators.
            pub const ALL: &[$name] = &[$($name::$variant),*];

            /// Returns the keyword of the text form.
            pub const fn name(self) -> &'static str {
                match self {
                    $($name::$variant => $keyword),*
                }
            }

            /// Returns the operator with this keyword.
            pub fn from_name(name: &str) -> Option<$name> {
                $name::ALL.iter().copied().find(|op| op.name() == name)
            }
        }
    };
}

named! { UnaryOp:
    Negate => "negate",
    Not => "not",
    Abs => "abs",
    Sqrt => "sqrt",
    Floor => "floor",
    Ceil => "ceil",
    Trunc => "trunc",
    RoundEven => "round_even",
    ApproximateReciprocal => "approximate_reciprocal",
    ApproximateInverseSqrt => "approximate_inverse_sqrt",
    ApproximateSqrt => "approximate_sqrt",
    Seldom => "seldom",
}

/// Operations on two values of one type; the result has that type.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum BinaryOp {
    /// f32: IEEE. i32, u32: wrapping.
    Add,
    /// f32: IEEE. i32, u32: wrapping.
    Subtract,
    /// f32: IEEE. i32, u32: wrapping.
    Multiply,
    /// f32: IEEE. i32, u32: rounds towards zero; division by 0 gives 0; the least i32 divided by -1 wraps.
    Divide,
    /// i32, u32: the remainder of the division above, so with the dividend's sign; by 0 it is 0.
    Remainder,
    /// `b < a ? b : a`, so `a` if either is NaN or both are zeros. f32, i32, u32.
    Min,
    /// `a < b ? b : a`, likewise.
    Max,
    /// i32, u32: bitwise. bool: logical.
    And,
    /// i32, u32: bitwise. bool: logical.
    Or,
    /// i32, u32: bitwise. bool: logical.
    Xor,
    /// i32, u32: shifts left by the low 5 bits of the second operand.
    ShiftLeft,
    /// i32: arithmetic shift; u32: logical shift; by the low 5 bits.
    ShiftRight,
    /// i32, u32: the upper 32 bits of the 64-bit product.
    MultiplyHigh,
}

named! { BinaryOp:
    Add => "add",
    Subtract => "subtract",
    Multiply => "multiply",
    Divide => "divide",
    Remainder => "remainder",
    Min => "min",
    Max => "max",
    And => "and",
    Or => "or",
    Xor => "xor",
    ShiftLeft => "shift_left",
    ShiftRight => "shift_right",
    MultiplyHigh => "multiply_high",
}

/// Comparisons of two values of one type, with a bool result. bool supports only `Equal` and `NotEqual`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum CompareOp {
    /// False with a NaN.
    Equal,
    /// True with a NaN.
    NotEqual,
    /// False with a NaN.
    Less,
    /// False with a NaN.
    LessEqual,
    /// False with a NaN.
    Greater,
    /// False with a NaN.
    GreaterEqual,
}

impl CompareOp {
    /// Returns the comparison of `b` and `a` that is equivalent to this comparison of `a` and `b`.
    pub const fn mirrored(self) -> CompareOp {
        match self {
            CompareOp::Equal | CompareOp::NotEqual => self,
            CompareOp::Less => CompareOp::Greater,
            CompareOp::LessEqual => CompareOp::GreaterEqual,
            CompareOp::Greater => CompareOp::Less,
            CompareOp::GreaterEqual => CompareOp::LessEqual,
        }
    }
}

named! { CompareOp:
    Equal => "equal",
    NotEqual => "not_equal",
    Less => "less",
    LessEqual => "less_equal",
    Greater => "greater",
    GreaterEqual => "greater_equal",
}

/// The index of a scalar of a variable.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Index {
    /// A constant, less than the variable's length (for a buffer, within the first element).
    Constant(u32),
    /// An i32 that the lowering has clamped dimension by dimension. Backends clamp it once more to the variable's
    /// length (for buffers: scalars per element times the number of elements; a buffer without elements reads as 0), so
    /// that no shader accesses other memory.
    Dynamic(Value),
}

/// One component of a state variable of the language.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct StateComponent {
    /// [`rtsl_spec::StateVariable::index`].
    pub variable: u32,
    /// The index of the component.
    pub component: u32,
}

impl StateComponent {
    /// Returns the component `component` of the state variable of this name, if there is one.
    pub fn named(name: &str, component: u32) -> Option<StateComponent> {
        let variable = rtsl_spec::lookup_state(name)?;
        let in_range = component < variable.ty.components();
        in_range.then_some(StateComponent { variable: variable.index, component })
    }

    /// Returns the state variable, if there is one with that index.
    pub fn variable(self) -> Option<&'static rtsl_spec::StateVariable> {
        rtsl_spec::state_variables().get(self.variable as usize)
    }
}

impl std::fmt::Display for StateComponent {
    fn fmt(&self, out: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let name = self.variable().map_or("?", |variable| variable.name);
        write!(out, "{name}@{}", self.component)
    }
}

/// A reference member, or an element of an array of references.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum ReferencePath {
    /// A single reference.
    Single,
    /// The element at this i32, clamped to the array's length.
    Element(Value),
}

/// A call of a method of a referenced instance. Linking replaces it with that method's body.
#[derive(Clone, Debug, PartialEq)]
pub struct ReferenceCall {
    /// The name of the reference member.
    pub member: String,
    /// The reference, or the element of an array of references.
    pub path: ReferencePath,
    /// The role in which it is called.
    pub role: Role,
    /// The method.
    pub method: Method,
    /// State that the callee sees instead of the variable's value: state that the caller has changed, and explicit
    /// arguments (`lookup(uv)`).
    pub overrides: Vec<(StateComponent, Value)>,
    /// The results of the call, each of type f32.
    pub results: Vec<StateComponent>,
}

/// An operation with its results.
#[derive(Clone, Debug, PartialEq)]
pub struct Op {
    /// The values that it defines.
    pub results: Values,
    /// True if the operation must not be contracted, because it contributes to a `precise` variable.
    pub precise: bool,
    /// The operation itself.
    pub kind: OpKind,
}

/// The operations. Each has one result unless its documentation states otherwise.
#[derive(Clone, Debug, PartialEq)]
pub enum OpKind {
    /// A constant.
    Constant(Constant),
    /// One operand.
    Unary(UnaryOp, Value),
    /// Two operands of one type.
    Binary(BinaryOp, Value, Value),
    /// Two operands of one type, with a bool result.
    Compare(CompareOp, Value, Value),
    /// The second value if the first, a bool, is true, else the third.
    Select(Value, Value, Value),
    /// `a * b + c` rounded once, f32.
    Fma(Value, Value, Value),
    /// Conversion to another type by value. f32 to integers: towards zero, saturating, NaN to 0. Integers to f32: to
    /// nearest even. i32 to u32 and back: the same bits. bool to numbers: 0 or 1. Numbers to bool: not equal to 0 (a
    /// NaN is true).
    Convert(Scalar, Value),
    /// Reinterpretation of the bits as another type; between f32, i32 and u32. From f32 to an integer every NaN gives
    /// [`CANONICAL_NAN`](crate::evaluate::CANONICAL_NAN), since machines differ in the bits of the NaNs they produce.
    Bitcast(Scalar, Value),
    /// Loads a scalar of any variable except an accepted one. State, members, parameters and scratch have the value
    /// from before the call.
    Load(VariableId, Index),
    /// Stores to a local. No result.
    Store(VariableId, Index, Value),
    /// The number of elements of a buffer, i32.
    Length(VariableId),
    /// Executes one of two regions without parameters; has as many results as each yields.
    If {
        /// The condition, a bool.
        condition: Value,
        /// The region executed if the condition is true.
        then: Region,
        /// The region executed if the condition is false.
        otherwise: Region,
    },
    /// Runs its body at least once. The body's parameters are the carried values, at first `initial`; it yields a bool
    /// and the next carried values. While the bool is true the body runs again with them; once it is false they are the
    /// results.
    Loop {
        /// The first carried values.
        initial: Vec<Value>,
        /// The repeated region.
        body: Region,
    },
    /// The radiance along a new ray, up to the parameter `limit`: `COLOR_COMPONENTS` results, f32.
    Trace {
        /// The origin, world space.
        origin: [Value; 3],
        /// The direction, world space, of any length.
        direction: [Value; 3],
        /// The greatest parameter of a hit.
        limit: Value,
        /// The weight of the answer: the greatest factor with which the method multiplies a component of it, in
        /// absolute value; 1 where it is unknown. The answer does not depend on it.
        weight: Value,
    },
    /// True if anything lies on the ray before `limit`; bool.
    Occluded {
        /// The origin, world space.
        origin: [Value; 3],
        /// The direction, world space, of any length.
        direction: [Value; 3],
        /// The greatest parameter of a hit.
        limit: Value,
    },
    /// The number of light samples for this call, i32; the same for every ray of a call.
    LightCount,
    /// The light sample `index` at a point. Results: a bool, true if the light reaches the point unshadowed from within
    /// the cone; direction (3, unit, towards the light); distance; colour (`COLOR_COMPONENTS`); density. All f32 but
    /// the first.
    LightSample {
        /// From 0 to the count, i32; the same for every ray of a call that is still in the loop.
        index: Value,
        /// The point to be lit, world space.
        point: [Value; 3],
        /// The cone's axis, any length.
        normal: [Value; 3],
        /// The least cosine between axis and light of the lights taken; -infinity for no cone.
        cosine: Value,
    },
    /// The scene's ambient light: `COLOR_COMPONENTS` results, f32.
    Ambient,
    /// The next dimension of this ray's sampler, in [0,1), f32.
    Rand,
    /// A query of an integrator, with its operands.
    Query(Query, Vec<Value>),
    /// A method call on another instance; replaced by linking.
    ReferenceCall(Box<ReferenceCall>),
    /// True if a reference is set, bool; replaced by linking.
    IsSet(String, ReferencePath),
    /// A copy of an f32, with respect to which derivatives are taken; replaced by linking, as the next two.
    Seed(Value),
    /// The derivative of the first f32 with respect to the second, a [`OpKind::Seed`] before it in the same region or in
    /// one around it.
    Derivative(Value, Value),
    /// The first f32, whose derivative is the sum of the products of the pairs: each the derivative of a value, and
    /// that value's factor.
    ChainRule(Value, Vec<(Value, Value)>),
    /// The number of elements of an array of references, i32; replaced by linking.
    ReferenceCount(String),
    /// Reports that this ray used up its budget of loop iterations. No result.
    ReportBudget,
    /// Reports the scalars of the event's values to the observer of the run. Only traced functions have it, which the
    /// interpreter runs; code generators leave it out. No result.
    Report(Arc<Event>, Vec<Value>),
}
