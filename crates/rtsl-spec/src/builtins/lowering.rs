//! The lowering of built-in functions to operations of the single-ray IR.

/// The way in which a call is lowered.
///
/// "Per component" means: component i of the result, and of each `out` argument, comes from
/// component i of the arguments; a scalar argument among vectors is used for every component. A
/// color has as many components as the host defines.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Lowering {
    /// One operation of the IR, per component.
    Operation(Operation),
    /// A function of this name in the prelude: the one with exactly these parameter types if the
    /// prelude has it, otherwise the scalar one, per component.
    Prelude,
    /// Lowered by code specific to the function, because it has effects or concerns references,
    /// types or state.
    Special(Special),
}

/// The operations of the IR that built-in functions name.
///
/// Operand types follow from the overload: `Abs` on `int` is the operation on i32.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Operation {
    /// |x|; the least int is returned unchanged.
    Abs,
    /// The square root, correctly rounded.
    Sqrt,
    /// Rounds towards minus infinity.
    Floor,
    /// Rounds towards plus infinity.
    Ceil,
    /// Rounds towards zero.
    Trunc,
    /// Rounds to the nearest integer, ties to even.
    RoundEven,
    /// a * b + c, rounded once.
    Fma,
    /// y < x ? y : x.
    Min,
    /// x < y ? y : x.
    Max,
    /// x < y.
    Less,
    /// x <= y.
    LessEqual,
    /// x > y.
    Greater,
    /// x >= y.
    GreaterEqual,
    /// x == y.
    Equal,
    /// x != y.
    NotEqual,
    /// Logical negation.
    Not,
    /// The operand, with the hint that it is seldom true.
    Seldom,
    /// The upper 32 bits of the 64-bit product, on i32 and u32.
    MultiplyHigh,
    /// The bits of an f32 as a u32.
    BitcastToUint,
    /// The bits of a u32 as an f32.
    BitcastToFloat,
}

/// The functions that the lowering handles one by one.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Special {
    /// `hit(t)`: offers a hit.
    Hit,
    /// `trace(o, d)` and `trace(o, d, tMax)`: asks the host for radiance.
    Trace,
    /// `occluded(o, d, tMax)`: asks the host for visibility.
    Occluded,
    /// `ambient()`: asks the host for the ambient light.
    Ambient,
    /// `nearestHit(...)`: asks the host for a surface.
    NearestHit,
    /// The query of the IR with this name, whose operands are the leaves of the arguments and whose results are those
    /// of the result. Of a surface it takes the scalars that identify it.
    Query(&'static str),
    /// `rand()`: the next dimension of the host's sampler.
    Rand,
    /// `inside()`: `dot(rt_RayDirection, rt_GeometricNormal) > 0`.
    Inside,
    /// `gradient(value, variable)`: the derivative of an expression.
    Gradient,
    /// The change of an expression over the width of the filter: its differential along one side, or the sum of both.
    Change(Along),
    /// A map between the world and the space of the hit object.
    Map(Direction, Mapped),
    /// `isSet(reference)`: a constant once the scene is linked.
    IsSet,
    /// `isTextured(parameter)`, likewise.
    IsTextured,
    /// `rgb(color)`: converts to a vector.
    Rgb,
    /// `any(b)`: the disjunction of the components, all of them evaluated.
    Any,
    /// `all(b)`: the conjunction of the components, all of them evaluated.
    All,
    /// `matrixCompMult(x, y)`: the product of matrices component by component.
    MatrixCompMult,
    /// `transpose(m)`.
    Transpose,
}

/// The sides of the filter along which an expression changes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Along {
    /// By `rt_du` along u.
    U,
    /// By `rt_dv` along v.
    V,
    /// Along both, without signs.
    Both,
}

/// The direction of a map between the world and the space of the hit object.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Direction {
    /// From the world.
    ToObject,
    /// To the world.
    ToWorld,
}

/// The kind of vector that a map applies to.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Mapped {
    /// A point.
    Point,
    /// A difference of points.
    Vector,
    /// A normal of a surface, whose length is any.
    Normal,
}

impl Lowering {
    /// True for functions of the surface that a ray has hit, which materials and textures have.
    pub fn needs_surface(self) -> bool {
        matches!(self, Lowering::Special(Special::Inside | Special::Map(..) | Special::Change(_)))
    }
}
