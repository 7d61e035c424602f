//! How calls of a built-in function become operations of the single-ray IR

/// What the lowering makes of a call
///
/// "Per component" means: component i of the result, and of each `out` argument, comes from
/// component i of the arguments; an argument that is a scalar where others have several
/// components is used for each of them. A color has as many components as the host says.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Lowering {
    /// One operation of the IR, per component
    Operation(Operation),
    /// A function of this name in the prelude: the one with these very parameter types if the
    /// prelude has it, otherwise the one on scalars, per component
    Prelude,
    /// Made by hand, since it has effects or concerns references, types or state
    Special(Special),
}

/// The operations of the IR that built-in functions name
///
/// Operand types follow from the overload: `Abs` on `int` is the operation on i32.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Operation {
    /// |x|; the least int stays as it is
    Abs,
    /// The square root, correctly rounded
    Sqrt,
    /// Towards minus infinity
    Floor,
    /// Towards plus infinity
    Ceil,
    /// Towards zero
    Trunc,
    /// To the nearest integer, to the even one at half way
    RoundEven,
    /// a * b + c, rounded once
    Fma,
    /// y < x ? y : x
    Min,
    /// x < y ? y : x
    Max,
    /// x < y
    Less,
    /// x <= y
    LessEqual,
    /// x > y
    Greater,
    /// x >= y
    GreaterEqual,
    /// x == y
    Equal,
    /// x != y
    NotEqual,
    /// The truth value's opposite
    Not,
    /// The truth value, said to be seldom true
    Seldom,
    /// The upper 32 bits of the 64-bit product, on i32 and u32
    MultiplyHigh,
    /// The bits of an f32 as a u32
    BitcastToUint,
    /// The bits of a u32 as an f32
    BitcastToFloat,
}

/// What the lowering makes by hand
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Special {
    /// `hit(t)`: offers a hit
    Hit,
    /// `trace(o, d)` and `trace(o, d, tMax)`: asks the host for radiance
    Trace,
    /// `occluded(o, d, tMax)`: asks the host for visibility
    Occluded,
    /// `ambient()`: asks the host
    Ambient,
    /// `rand()`: the next dimension of the host's sampler
    Rand,
    /// `inside()`: `dot(rt_RayDirection, rt_GeometricNormal) > 0`
    Inside,
    /// `isSet(reference)`: known when the scene is linked
    IsSet,
    /// `rgb(color)`: the conversion back to a vector
    Rgb,
    /// `any(b)`: the or of the components, all of them evaluated
    Any,
    /// `all(b)`: the and of the components, all of them evaluated
    All,
    /// `matrixCompMult(x, y)`: the product of matrices component by component
    MatrixCompMult,
    /// `transpose(m)`
    Transpose,
}
