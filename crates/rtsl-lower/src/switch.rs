//! `switch`: the cases in order, each guarded by "its value, or fallen through".

use rtsl_ir::{CompareOp, Value};
use rtsl_sema::hir::{Expression, StatementKind, SwitchCase};
use rtsl_source::Span;

use crate::Lowering;
use crate::calls::Jumps;
use crate::limits::Lowered;

impl<'m> Lowering<'m> {
    pub fn lower_switch(
        &mut self,
        selector: &'m Expression,
        cases: &'m [SwitchCase],
        span: Span,
    ) -> Lowered<()> {
        let selector = self.lower_scalar(selector)?;
        let selected = self.lower_labels(selector, cases);
        self.clear_declared(cases, span)?;

        let outer = self.frame.jumps;
        let continued = outer.and_then(|jumps| jumps.continued);
        self.frame.jumps = Some(Jumps { broke: self.new_flag(), continued });
        let falling = self.new_flag();
        for (case, selected) in cases.iter().zip(selected) {
            let fallen = self.cells.get(falling);
            let runs = self.either(fallen, selected);
            self.clear(falling);
            self.lower_unstopped(runs, span, |lowering| {
                lowering.lower_list(&case.body)?;
                let stopped = lowering.stopped();
                let falls = lowering.builder.not(stopped);
                lowering.cells.set(falling, falls);
                Ok(())
            })?;
        }
        self.frame.jumps = outer;
        Ok(())
    }

    /// For each case, the condition that the selector chooses it.
    fn lower_labels(&mut self, selector: Value, cases: &[SwitchCase]) -> Vec<Value> {
        let mut any = self.builder.bool(false);
        let mut selected = Vec::with_capacity(cases.len());
        for case in cases {
            let equal = match case.value {
                Some(constant) => {
                    let constant = self.builder.constant(constant);
                    self.builder.compare(CompareOp::Equal, selector, constant)
                }
                None => self.builder.bool(false),
            };
            any = self.either(any, equal);
            selected.push(equal);
        }
        if let Some(default) = cases.iter().position(|case| case.value.is_none()) {
            selected[default] = self.builder.not(any);
        }
        selected
    }

    /// Sets the variables of the `switch` to zero, since the cases that declare them may be jumped
    /// over.
    fn clear_declared(&mut self, cases: &[SwitchCase], span: Span) -> Lowered<()> {
        for statement in cases.iter().flat_map(|case| &case.body) {
            if let StatementKind::Declare(local, _) = statement.kind {
                let variable = self.local_variable(local, span)?;
                let layout = self.variable(variable).layout.clone();
                let zeros = self.zeros(&layout);
                self.set_variable(variable, &zeros);
            }
        }
        Ok(())
    }
}
