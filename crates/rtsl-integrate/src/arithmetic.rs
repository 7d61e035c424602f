//! Operations of linked functions that no shader wrote: arithmetic on numbers and vectors.
//!
//! None is contracted, so that a host that computes the same gets the same bits.

use crate::stage_linker::StageLinker;
use rtsl_ir::{
    BinaryOp, CompareOp, Constant, Index, Op, OpKind, Scalar, UnaryOp, Value, Variable,
    VariableKind,
};
use rtsl_link::Linking;

/// The components of a vector.
pub(crate) type Vector = [Value; 3];

/// An affine map: the images of the axes, then that of the origin.
pub(crate) type Map = [Vector; 4];

/// Operations that are added at the end of a list.
pub(crate) struct Arithmetic<'l> {
    pub linker: &'l mut StageLinker,
    pub to: &'l mut Vec<Op>,
}

/// Returns three of several values, from `first` on.
pub(crate) fn vector_at(values: &[Value], first: usize) -> Vector {
    [values[first], values[first + 1], values[first + 2]]
}

impl Arithmetic<'_> {
    pub fn boolean(&mut self, value: bool) -> Linking<Value> {
        self.linker.constant(self.to, Constant::Bool(value))
    }

    pub fn float(&mut self, value: f32) -> Linking<Value> {
        self.linker.constant(self.to, Constant::F32(value))
    }

    pub fn integer(&mut self, value: i32) -> Linking<Value> {
        self.linker.constant(self.to, Constant::I32(value))
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

    pub fn compare(&mut self, op: CompareOp, a: Value, b: Value) -> Linking<Value> {
        Ok(self.linker.emit(self.to, OpKind::Compare(op, a, b), &[Scalar::Bool], false)?.get(0))
    }

    pub fn less(&mut self, a: Value, b: Value) -> Linking<Value> {
        self.compare(CompareOp::Less, a, b)
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

    pub fn scaled(&mut self, v: Vector, factor: Value) -> Linking<Vector> {
        self.each(|it, axis| it.multiply(v[axis], factor))
    }

    /// The sum of three products, in order.
    pub fn products(&mut self, a: Vector, b: Vector) -> Linking<Value> {
        let [x, y, z] = self.each(|it, axis| it.multiply(a[axis], b[axis]))?;
        let sum = self.add(x, y)?;
        self.add(sum, z)
    }

    /// A vector at unit length, or another one.
    pub fn normalized_or(&mut self, v: Vector, otherwise: Vector) -> Linking<Vector> {
        Ok(vector_at(&self.call("rt_normalizedOr", [v, otherwise].as_flattened())?, 0))
    }

    /// Transforms a vector.
    pub fn transformed_vector(&mut self, map: &Map, v: Vector) -> Linking<Vector> {
        let operands = [map.as_flattened(), &v].concat();
        Ok(vector_at(&self.call("rt_mapVector", &operands)?, 0))
    }

    /// Transforms a point.
    pub fn transformed_point(&mut self, map: &Map, p: Vector) -> Linking<Vector> {
        let operands = [map.as_flattened(), &p].concat();
        Ok(vector_at(&self.call("rt_mapPoint", &operands)?, 0))
    }

    /// Applies the transposed linear part of a map to a vector.
    pub fn transposed_vector(&mut self, map: &Map, v: Vector) -> Linking<Vector> {
        let operands = [map.as_flattened(), &v].concat();
        Ok(vector_at(&self.call("rt_mapNormal", &operands)?, 0))
    }

    /// The first number if it is greater, else the second.
    pub fn larger(&mut self, a: Value, b: Value) -> Linking<Value> {
        let is_larger = self.compare(CompareOp::Greater, a, b)?;
        self.select(is_larger, a, b)
    }
}
