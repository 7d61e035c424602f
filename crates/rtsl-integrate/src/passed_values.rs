//! Values of a path that pass from stage to stage in scratch arrays: counts of random numbers, and sums of light.
//!
//! A stage keeps such a value in a local, from which operations load it, and to which they store it, also in loops.

use rtsl_ir::{Index, OpKind, Output, Region, Scalar, Value, Variable, VariableId, VariableKind};
use rtsl_link::Linking;

use crate::arithmetic::Arithmetic;
use crate::stage_linker::StageLinker;

impl StageLinker {
    /// Returns the local with the value that passes in a scratch array.
    pub(crate) fn passed_value(&mut self, column: &'static str, scalar: Scalar) -> VariableId {
        if let Some(local) = self.passed_values.get(column) {
            return *local;
        }
        let local = self.new_local(column.to_owned(), scalar);
        self.passed_values.insert(column, local);
        local
    }

    /// Loads the passed values when the stage begins, and stores them when it ends.
    pub(crate) fn pass_on_values(&mut self) -> Linking<()> {
        for (column, local) in self.passed_values.clone() {
            let mut ops = Vec::new();
            let scalar = self.out.variable(local).scalar;
            let before = match self.count_at_start(column, &mut ops)? {
                Some(count) => count,
                None => Arithmetic { linker: &mut *self, to: &mut ops }.column(column, scalar)?,
            };
            let code = &mut Arithmetic { linker: &mut *self, to: &mut ops };
            code.store_local(local, before)?;
            let mut body = std::mem::take(&mut self.out.body);
            ops.append(&mut body.ops);
            let after = Arithmetic { linker: &mut *self, to: &mut ops }.load_local(local)?;
            let (kind, name) = (VariableKind::Scratch, column.to_owned());
            let column = self.intern_variable(Variable { kind, name, scalar, len: 1 });
            self.out.outputs.push(Output { variable: column, component: 0 });
            body.yields.push(after);
            self.out.body = Region { ops, ..body };
        }
        Ok(())
    }

    /// Returns a local of one scalar.
    pub(crate) fn new_local(&mut self, name: String, scalar: Scalar) -> VariableId {
        self.intern_variable(Variable { kind: VariableKind::Local, name, scalar, len: 1 })
    }
}

impl Arithmetic<'_> {
    /// Loads the value of a local of one scalar.
    pub fn load_local(&mut self, local: VariableId) -> Linking<Value> {
        let kind = OpKind::Load(local, Index::Constant(0));
        let scalar = self.linker.out.variable(local).scalar;
        Ok(self.linker.emit(self.to, kind, &[scalar], false)?.get(0))
    }

    /// Stores a value to a local of one scalar.
    pub fn store_local(&mut self, local: VariableId, value: Value) -> Linking<()> {
        let kind = OpKind::Store(local, Index::Constant(0), value);
        self.linker.emit(self.to, kind, &[], false).map(drop)
    }
}
