//! The function under construction. Unlike [`rtsl_ir::Builder`], it lets a closed region be opened again.

use rtsl_ir::{
    BinaryOp, Constant, ConstantPool, Function, Index, IndexVec, MAX_NESTING, Op, OpKind, Scalar,
    UnaryOp, Value, Values, VariableId, evaluate,
};

use crate::SplitError;

/// A function whose operations are added to the innermost open region. Operations on constants are folded.
pub(crate) struct Code {
    pub function: Function,
    constants: ConstantPool,
    /// The constant of each value that is one.
    known: IndexVec<Value, Option<Constant>>,
    /// The operations of the open regions, the body first.
    open: Vec<Vec<Op>>,
    /// The number of operations that may still be added.
    left: u32,
}

impl Code {
    /// Returns an empty function to which this many operations can be added.
    pub fn new(name: String, left: u32) -> Self {
        Code {
            function: Function::new(name),
            constants: ConstantPool::default(),
            known: IndexVec::default(),
            open: vec![Vec::new()],
            left,
        }
    }

    /// Returns the number of operations that may still be added.
    pub fn left(&self) -> u32 {
        self.left
    }

    /// Returns the constant that a value is.
    pub fn known(&self, value: Value) -> Option<Constant> {
        self.known.get(value).copied().flatten()
    }

    /// Returns the type of a value.
    pub fn scalar(&self, value: Value) -> Scalar {
        self.function.scalar(value)
    }

    /// Returns new values of these types, which the caller defines.
    pub fn new_values(&mut self, scalars: &[Scalar]) -> Values {
        self.function.new_values(scalars)
    }

    /// Adds an operation with results of these types.
    pub fn push(&mut self, kind: OpKind, precise: bool, scalars: &[Scalar]) -> Values {
        let results = self.function.new_values(scalars);
        self.left = self.left.saturating_sub(1);
        let region = self.open.last_mut().expect("the body is open");
        region.push(Op { results, precise, kind });
        results
    }

    /// Adds an operation, or folds it to a constant; returns its results.
    pub fn emit(&mut self, kind: OpKind, precise: bool, scalars: &[Scalar]) -> Values {
        match evaluate::fold(&kind, |value| self.known(value)) {
            Some(constant) => Values { first: self.constant(constant).0, count: 1 },
            None => self.push(kind, precise, scalars),
        }
    }

    /// Returns the value of a constant.
    pub fn constant(&mut self, constant: Constant) -> Value {
        let value = self.constants.intern(&mut self.function.values, constant);
        self.known.insert(value, Some(constant), None);
        value
    }

    /// Returns the value of a constant of type bool.
    pub fn bool(&mut self, constant: bool) -> Value {
        self.constant(Constant::Bool(constant))
    }

    /// Adds the negation of a bool.
    pub fn not(&mut self, value: Value) -> Value {
        self.emit(OpKind::Unary(UnaryOp::Not, value), false, &[Scalar::Bool]).get(0)
    }

    /// Adds the conjunction of two bools.
    pub fn and(&mut self, a: Value, b: Value) -> Value {
        for (side, other) in [(a, b), (b, a)] {
            match self.known(side) {
                Some(Constant::Bool(true)) => return other,
                Some(_) => return side,
                None => {}
            }
        }
        self.emit(OpKind::Binary(BinaryOp::And, a, b), false, &[Scalar::Bool]).get(0)
    }

    /// Adds a load of a scalar of a variable.
    pub fn load(&mut self, variable: VariableId, index: u32) -> Value {
        let scalar = self.function.variable(variable).scalar;
        self.push(OpKind::Load(variable, Index::Constant(index)), false, &[scalar]).get(0)
    }

    /// Adds a store to a scalar of a local.
    pub fn store(&mut self, local: VariableId, index: u32, value: Value) {
        self.push(OpKind::Store(local, Index::Constant(index), value), false, &[]);
    }

    /// Opens a region, or opens a closed one again.
    pub fn open(&mut self, ops: Vec<Op>) -> Result<(), SplitError> {
        if self.open.len() > MAX_NESTING {
            return Err(SplitError::Nesting);
        }
        if self.left == 0 {
            return Err(SplitError::Operations);
        }
        self.open.push(ops);
        Ok(())
    }

    /// Closes the innermost region.
    pub fn close(&mut self) -> Vec<Op> {
        self.open.pop().expect("a region is open")
    }

    /// Returns the function with its constants; all regions but the body are closed.
    pub fn finish(mut self) -> Function {
        self.function.body.ops = self.close();
        assert!(self.open.is_empty(), "{} regions are still open", self.open.len());
        self.constants.define_in(&mut self.function);
        self.function
    }
}
