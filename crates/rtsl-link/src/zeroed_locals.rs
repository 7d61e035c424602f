//! Locals of a copied body that may run several times: each run begins with zeros.

use rtsl_ir::{
    BinaryOp, CompareOp, Constant, Index, Op, OpKind, Region, Scalar, Value, VariableId,
    VariableKind,
};

use crate::draft::{Draft, Linking};
use crate::site::Site;

/// The greatest length of a local that is zeroed without a loop.
const UNROLLED_LENGTH: u32 = 16;

impl Draft {
    /// Begins to copy a body: zeroes its locals if it may run several times.
    ///
    /// # Errors
    /// If the function becomes too large.
    pub fn begin_copy(&mut self, site: &mut Site<'_>, to: &mut Vec<Op>) -> Linking<()> {
        if !self.in_loop {
            return Ok(());
        }
        let function = site.function;
        for (id, variable) in (0..).map(VariableId).zip(&function.variables) {
            if variable.kind != VariableKind::Local {
                continue;
            }
            let local = self.variable(site, id);
            let zero = self.constant(to, Constant::zero(variable.scalar))?;
            if variable.len <= UNROLLED_LENGTH {
                for index in 0..variable.len {
                    self.emit(to, OpKind::Store(local, Index::Constant(index), zero), &[], false)?;
                }
            } else {
                self.zero_by_loop(local, variable.len, zero, to)?;
            }
        }
        Ok(())
    }

    fn zero_by_loop(
        &mut self,
        local: VariableId,
        len: u32,
        zero: Value,
        to: &mut Vec<Op>,
    ) -> Linking<()> {
        let first = self.constant(to, Constant::I32(0))?;
        let one = self.constant(to, Constant::I32(1))?;
        let end = self.constant(to, Constant::I32(i32::try_from(len).unwrap_or(i32::MAX)))?;
        let index = self.out.new_values(&[Scalar::I32]).get(0);
        let mut body = Region { params: vec![index], ..Region::default() };
        let ops = &mut body.ops;
        self.emit(ops, OpKind::Store(local, Index::Dynamic(index), zero), &[], false)?;
        let next = OpKind::Binary(BinaryOp::Add, index, one);
        let next = self.emit(ops, next, &[Scalar::I32], false)?.get(0);
        let again = OpKind::Compare(CompareOp::Less, next, end);
        let again = self.emit(ops, again, &[Scalar::Bool], false)?.get(0);
        body.yields = vec![again, next];
        self.emit(to, OpKind::Loop { initial: vec![first], body }, &[Scalar::I32], false)?;
        Ok(())
    }
}
