//! A pool of the constants of a function, each defined once at the start of the body.

use std::collections::HashMap;

use crate::{Constant, Function, Op, OpKind, Scalar, Value, Values};

/// Constants to be defined at the start of a function, where every region sees them.
#[derive(Clone, Debug, Default)]
pub struct ConstantPool {
    /// Used for lookup only, so the iteration order cannot affect results.
    values: HashMap<Constant, Value>,
    ops: Vec<Op>,
}

impl ConstantPool {
    /// Returns a pool with the constants that `function` defines at its outermost level before any other operation.
    pub fn of(function: &Function) -> Self {
        let mut pool = ConstantPool::default();
        for op in &function.body.ops {
            let OpKind::Constant(constant) = op.kind else { break };
            pool.values.entry(constant).or_insert(op.results.get(0));
        }
        pool
    }

    /// Returns the value of `constant`; a new constant gets a new entry in `values`.
    pub fn intern(&mut self, values: &mut Vec<Scalar>, constant: Constant) -> Value {
        *self.values.entry(constant).or_insert_with(|| {
            let results = Values { first: values.len() as u32, count: 1 };
            values.push(constant.scalar());
            self.ops.push(Op { results, precise: false, kind: OpKind::Constant(constant) });
            results.get(0)
        })
    }

    /// Inserts the constants that are new to `function` at its start.
    pub fn define_in(self, function: &mut Function) {
        function.body.ops.splice(0..0, self.ops);
    }
}
