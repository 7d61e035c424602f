//! Operations of linked functions that no shader wrote: arithmetic on numbers and vectors.
//!
//! None is contracted, so that a host that computes the same gets the same bits.

use rtsl_ir::{
    BinaryOp, CompareOp, Constant, Index, Op, OpKind, Region, Scalar, UnaryOp, Value, Variable,
    VariableKind,
};
use rtsl_math::USUAL_SQUARES;

use super::linker::{Linker, Linking};

/// The components of a vector.
pub(super) type Vector = [Value; 3];

/// An affine map: the images of the axes, then that of the origin.
pub(super) type Map = [Vector; 4];

/// Operations that are added at the end of a list.
pub(super) struct Arithmetic<'l> {
    pub linker: &'l mut Linker,
    pub to: &'l mut Vec<Op>,
}

impl Arithmetic<'_> {
    pub fn float(&mut self, value: f32) -> Linking<Value> {
        self.linker.constant(self.to, Constant::F32(value))
    }

    pub fn word(&mut self, value: u32) -> Linking<Value> {
        self.linker.constant(self.to, Constant::U32(value))
    }

    pub fn binary(&mut self, op: BinaryOp, a: Value, b: Value) -> Linking<Value> {
        let scalar = self.linker.out.scalar(a);
        Ok(self.linker.emit(self.to, OpKind::Binary(op, a, b), &[scalar], true)?.get(0))
    }

    pub fn add(&mut self, a: Value, b: Value) -> Linking<Value> {
        self.binary(BinaryOp::Add, a, b)
    }

    pub fn multiply(&mut self, a: Value, b: Value) -> Linking<Value> {
        self.binary(BinaryOp::Multiply, a, b)
    }

    pub fn divide(&mut self, a: Value, b: Value) -> Linking<Value> {
        self.binary(BinaryOp::Divide, a, b)
    }

    pub fn unary(&mut self, op: UnaryOp, a: Value) -> Linking<Value> {
        let scalar = self.linker.out.scalar(a);
        Ok(self.linker.emit(self.to, OpKind::Unary(op, a), &[scalar], true)?.get(0))
    }

    pub fn root(&mut self, a: Value) -> Linking<Value> {
        self.unary(UnaryOp::Sqrt, a)
    }

    pub fn compare(&mut self, op: CompareOp, a: Value, b: Value) -> Linking<Value> {
        Ok(self.linker.emit(self.to, OpKind::Compare(op, a, b), &[Scalar::Bool], false)?.get(0))
    }

    pub fn less(&mut self, a: Value, b: Value) -> Linking<Value> {
        self.compare(CompareOp::Less, a, b)
    }

    pub fn and(&mut self, a: Value, b: Value) -> Linking<Value> {
        self.binary(BinaryOp::And, a, b)
    }

    pub fn select(&mut self, condition: Value, a: Value, b: Value) -> Linking<Value> {
        let scalar = self.linker.out.scalar(a);
        Ok(self.linker.emit(self.to, OpKind::Select(condition, a, b), &[scalar], false)?.get(0))
    }

    pub fn convert(&mut self, to: Scalar, a: Value) -> Linking<Value> {
        Ok(self.linker.emit(self.to, OpKind::Convert(to, a), &[to], true)?.get(0))
    }

    pub fn bitcast(&mut self, to: Scalar, a: Value) -> Linking<Value> {
        Ok(self.linker.emit(self.to, OpKind::Bitcast(to, a), &[to], true)?.get(0))
    }

    /// Loads a scalar of a variable.
    pub fn load(&mut self, variable: Variable, index: u32) -> Linking<Value> {
        let scalar = variable.scalar;
        if let Some(chosen) = self.linker.load_chosen(&variable, Index::Constant(index), self.to)? {
            return Ok(chosen);
        }
        let variable = self.linker.intern_variable(variable);
        let kind = OpKind::Load(variable, Index::Constant(index));
        Ok(self.linker.emit(self.to, kind, &[scalar], false)?.get(0))
    }

    /// Loads a scalar of a scratch array that hosts set.
    pub fn column(&mut self, name: &str, scalar: Scalar) -> Linking<Value> {
        let kind = VariableKind::Scratch;
        self.load(Variable { kind, name: name.to_owned(), scalar, len: 1 }, 0)
    }

    /// Loads three scalars of a member of `len`, from `first` on.
    pub fn member(&mut self, name: &str, len: u32, first: u32) -> Linking<Vector> {
        let kind = VariableKind::Member;
        let variable = Variable { kind, name: name.to_owned(), scalar: Scalar::F32, len };
        let mut load = |index: u32| self.load(variable.clone(), first + index);
        Ok([load(0)?, load(1)?, load(2)?])
    }

    /// Loads a member of one scalar.
    pub fn load_member(&mut self, name: &str, scalar: Scalar) -> Linking<Value> {
        let kind = VariableKind::Member;
        self.load(Variable { kind, name: name.to_owned(), scalar, len: 1 }, 0)
    }

    /// Returns the map that leaves points where they are.
    pub fn identity(&mut self) -> Linking<Map> {
        let (zero, one) = (self.float(0.0)?, self.float(1.0)?);
        let axis = |axis: usize| {
            let mut unit = [zero; 3];
            unit[axis] = one;
            unit
        };
        Ok([axis(0), axis(1), axis(2), [zero; 3]])
    }

    /// Loads a map that is a member.
    pub fn map(&mut self, name: &str) -> Linking<Map> {
        let mut column = |index: u32| self.member(name, 12, 3 * index);
        Ok([column(0)?, column(1)?, column(2)?, column(3)?])
    }

    pub fn each(
        &mut self,
        mut component: impl FnMut(&mut Self, usize) -> Linking<Value>,
    ) -> Linking<Vector> {
        Ok([component(self, 0)?, component(self, 1)?, component(self, 2)?])
    }

    pub fn vector(&mut self, value: [f32; 3]) -> Linking<Vector> {
        self.each(|it, axis| it.float(value[axis]))
    }

    pub fn sum(&mut self, a: Vector, b: Vector) -> Linking<Vector> {
        self.each(|it, axis| it.add(a[axis], b[axis]))
    }

    pub fn difference(&mut self, a: Vector, b: Vector) -> Linking<Vector> {
        self.each(|it, axis| it.binary(BinaryOp::Subtract, a[axis], b[axis]))
    }

    pub fn scaled(&mut self, v: Vector, factor: Value) -> Linking<Vector> {
        self.each(|it, axis| it.multiply(v[axis], factor))
    }

    /// The magnitudes of the components.
    pub fn sizes(&mut self, v: Vector) -> Linking<Vector> {
        self.each(|it, axis| it.unary(UnaryOp::Abs, v[axis]))
    }

    pub fn select_vector(&mut self, condition: Value, a: Vector, b: Vector) -> Linking<Vector> {
        self.each(|it, axis| it.select(condition, a[axis], b[axis]))
    }

    /// The sum of three products, in order.
    pub fn products(&mut self, a: Vector, b: Vector) -> Linking<Value> {
        let [x, y, z] = self.each(|it, axis| it.multiply(a[axis], b[axis]))?;
        let sum = self.add(x, y)?;
        self.add(sum, z)
    }

    /// Transforms a vector.
    pub fn transformed_vector(&mut self, map: &Map, v: Vector) -> Linking<Vector> {
        let [x, y, z, _] = map;
        self.each(|it, axis| it.products(v, [x[axis], y[axis], z[axis]]))
    }

    /// Transforms a point.
    pub fn transformed_point(&mut self, map: &Map, p: Vector) -> Linking<Vector> {
        let v = self.transformed_vector(map, p)?;
        self.sum(v, map[3])
    }

    /// Applies the transposed linear part of a map to a vector.
    pub fn transposed_vector(&mut self, map: &Map, v: Vector) -> Linking<Vector> {
        self.each(|it, axis| it.products(v, map[axis]))
    }

    /// The point at a parameter of a ray.
    pub fn point_on_ray(
        &mut self,
        origin: Vector,
        direction: Vector,
        parameter: Value,
    ) -> Linking<Vector> {
        self.each(|it, axis| {
            let way = it.multiply(parameter, direction[axis])?;
            it.add(origin[axis], way)
        })
    }

    /// As [`rtsl_math::normalize_or`].
    pub fn normalized_or(&mut self, v: Vector, otherwise: Vector) -> Linking<Vector> {
        let square = self.products(v, v)?;
        let (least, greatest) =
            (self.float(*USUAL_SQUARES.start())?, self.float(*USUAL_SQUARES.end())?);
        let is_long = self.compare(CompareOp::GreaterEqual, square, least)?;
        let is_short = self.compare(CompareOp::LessEqual, square, greatest)?;
        let is_usual = self.and(is_long, is_short)?;
        let (one, length) = (self.float(1.0)?, self.root(square)?);
        let factor = self.divide(one, length)?;
        let normalized = self.scaled(v, factor)?;
        let is_unusual = self.unary(UnaryOp::Not, is_usual)?;
        let is_unusual = self.unary(UnaryOp::Seldom, is_unusual)?;
        self.rarely(is_unusual, normalized, |it| it.normalized_by_parts(v, otherwise))
    }

    /// Computes a vector where a condition holds that seldom does.
    fn rarely(
        &mut self,
        condition: Value,
        usual: Vector,
        unusual: impl FnOnce(&mut Arithmetic<'_>) -> Linking<Vector>,
    ) -> Linking<Vector> {
        let mut then = Region::default();
        then.yields = self
            .linker
            .nested(|linker| unusual(&mut Arithmetic { linker, to: &mut then.ops }))?
            .to_vec();
        let otherwise = Region { yields: usual.to_vec(), ..Region::default() };
        let kind = OpKind::If { condition, then, otherwise };
        let results = self.linker.emit(self.to, kind, &[Scalar::F32; 3], false)?;
        Ok([0, 1, 2].map(|axis| results.get(axis)))
    }

    /// Normalises a vector whose squared length would overflow or underflow.
    fn normalized_by_parts(&mut self, v: Vector, otherwise: Vector) -> Linking<Vector> {
        let [x, y, z] = self.sizes(v)?;
        let largest = self.larger(x, y)?;
        let largest = self.larger(largest, z)?;
        let scaled = self.each(|it, axis| it.divide(v[axis], largest))?;
        let square = self.products(scaled, scaled)?;
        let length = self.root(square)?;
        // A vector has no direction if a component is NaN or infinite, or all are 0: NaN fails the comparison.
        let (one, infinity) = (self.float(1.0)?, self.float(f32::INFINITY)?);
        let is_long = self.compare(CompareOp::GreaterEqual, length, one)?;
        let is_finite = self.less(largest, infinity)?;
        let has_length = self.and(is_long, is_finite)?;
        let normalized = self.each(|it, axis| it.divide(scaled[axis], length))?;
        self.select_vector(has_length, normalized, otherwise)
    }

    /// The first number if it is greater, else the second.
    pub fn larger(&mut self, a: Value, b: Value) -> Linking<Value> {
        let is_larger = self.compare(CompareOp::Greater, a, b)?;
        self.select(is_larger, a, b)
    }

    /// True for positive numbers less than infinity.
    pub fn is_usable(&mut self, a: Value) -> Linking<Value> {
        let (zero, infinity) = (self.float(0.0)?, self.float(f32::INFINITY)?);
        let is_positive = self.compare(CompareOp::Greater, a, zero)?;
        let is_finite = self.less(a, infinity)?;
        self.and(is_positive, is_finite)
    }

    /// A number if it is less than infinity, else 0.
    pub fn finite_or_zero(&mut self, a: Value) -> Linking<Value> {
        let (infinity, zero) = (self.float(f32::INFINITY)?, self.float(0.0)?);
        let is_finite = self.less(a, infinity)?;
        self.select(is_finite, a, zero)
    }
}
