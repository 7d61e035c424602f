//! Scratch of primitives whose `intersect` another class calls through a reference.
//!
//! A call that accepts a hit leaves its scratch in locals, which later calls of the same primitive read. They are
//! outputs of an `intersect`, so that the methods that describe the hit find them in the scratch of the ray.

use rtsl_ir::{Index, Op, OpKind, Output, Region, Value, Variable, VariableId, VariableKind};

use crate::draft::{Draft, Linking};
use crate::site::Site;

impl Draft {
    /// Returns the local with what a call left of a scratch variable of a called primitive.
    pub(crate) fn called_scratch_of(
        &self,
        site: &Site<'_>,
        variable: VariableId,
    ) -> Option<VariableId> {
        if site.is_root || self.called_scratch.is_empty() {
            return None;
        }
        self.called_scratch.get(&site.name_of(site.function.variable(variable))).copied()
    }

    /// Keeps the scratch that a copied method of a reference sets, if it accepts a hit.
    pub(crate) fn keep_called_scratch(&mut self, site: &Site<'_>, to: &mut Vec<Op>) -> Linking<()> {
        let function = site.function;
        let outputs: Vec<(&Variable, u32, Value)> = (function.outputs.iter())
            .zip(&function.body.yields)
            .map(|(output, value)| {
                (function.variable(output.variable), output.component, site.value(*value))
            })
            .collect();
        let accepted = outputs.iter().find(|(place, ..)| place.kind == VariableKind::Accepted);
        let Some((.., accepted)) = accepted else { return Ok(()) };
        let mut then = Region::default();
        for (place, component, value) in &outputs {
            if place.kind == VariableKind::Scratch {
                let local = self.called_scratch_local(site.name_of(place), place);
                let store = OpKind::Store(local, Index::Constant(*component), *value);
                self.emit(&mut then.ops, store, &[], false)?;
            }
        }
        if !then.ops.is_empty() {
            let otherwise = Region::default();
            self.emit(to, OpKind::If { condition: *accepted, then, otherwise }, &[], false)?;
        }
        Ok(())
    }

    fn called_scratch_local(&mut self, name: String, place: &Variable) -> VariableId {
        if let Some(known) = self.called_scratch.get(&name) {
            return *known;
        }
        let kind = VariableKind::Local;
        let local = self.intern_variable(Variable {
            kind,
            name: format!("{name}.called"),
            ..place.clone()
        });
        self.called_scratch.insert(name, local);
        local
    }

    /// Makes what calls left outputs of the function, if it accepts hits.
    pub(crate) fn output_called_scratch(&mut self) -> Linking<()> {
        let kind = |output: &Output| self.out.variables[output.variable.0 as usize].kind;
        if !self.out.outputs.iter().any(|output| kind(output) == VariableKind::Accepted) {
            return Ok(());
        }
        for (name, local) in std::mem::take(&mut self.called_scratch) {
            let place = self.out.variables[local.0 as usize].clone();
            let (scalar, len) = (place.scalar, place.len);
            let scratch = Variable { kind: VariableKind::Scratch, name, ..place };
            let variable = self.intern_variable(scratch);
            for component in 0..len {
                let mut ops = std::mem::take(&mut self.out.body.ops);
                let load = OpKind::Load(local, Index::Constant(component));
                let value = self.emit(&mut ops, load, &[scalar], false);
                self.out.body.ops = ops;
                self.out.body.yields.push(value?.get(0));
                self.out.outputs.push(Output { variable, component });
            }
        }
        Ok(())
    }
}
