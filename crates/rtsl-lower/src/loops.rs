//! Loops: `for`, `while`, `do`.

use rtsl_ir::{EventKind, Value};
use rtsl_sema::hir::{Expression, Loop};
use rtsl_source::Span;

use crate::Lowering;
use crate::calls::Jumps;
use crate::cells::Cell;
use crate::expressions::is_cheap;
use crate::facts::{Assigned, Root};
use crate::limits::Lowered;
use rtsl_sema::walk::Node;

impl<'m> Lowering<'m> {
    pub fn lower_loop(&mut self, repeat: &'m Loop, span: Span) -> Lowered<()> {
        self.lower_list(&repeat.initializer)?;
        let outer = self.frame.jumps;
        let jumps = Jumps { broke: self.new_flag(), continued: Some(self.new_flag()) };
        self.frame.jumps = Some(jumps);
        let carried = self.carried_by(repeat);
        match &repeat.condition {
            Some(condition) if !repeat.test_last => {
                if repeat.declaration.is_none() && is_cheap(condition) {
                    // The condition is tested before the first iteration and at the end of each.
                    let first = self.lower_test(condition)?;
                    self.lower_when(first, span, |lowering| {
                        lowering.lower_rounds(repeat, carried, span)
                    })?;
                } else {
                    self.lower_tested_rounds(repeat, condition, carried, span)?;
                }
            }
            Some(_) | None => self.lower_rounds(repeat, carried, span)?,
        }
        self.frame.jumps = outer;
        Ok(())
    }

    fn carried_by(&self, repeat: &Loop) -> Vec<Cell> {
        let mut nodes: Vec<Node> = repeat.body.iter().map(Node::Statement).collect();
        nodes.extend(repeat.condition.iter().chain(&repeat.step).map(Node::Expression));
        let assigned = self.facts.assigned(self.module, nodes);
        self.cells_changed_by(&assigned)
    }

    /// Lowers a loop with the test at the end of each iteration.
    fn lower_rounds(&mut self, repeat: &'m Loop, carried: Vec<Cell>, span: Span) -> Lowered<()> {
        self.lower_repeat(&carried, span, |lowering| {
            lowering.lower_round(repeat)?;
            lowering.lower_step_and_test(repeat, repeat.condition.as_ref(), span)
        })
    }

    /// Lowers a loop with the test at the beginning of each iteration.
    fn lower_tested_rounds(
        &mut self,
        repeat: &'m Loop,
        condition: &'m Expression,
        carried: Vec<Cell>,
        span: Span,
    ) -> Lowered<()> {
        self.lower_repeat(&carried, span, |lowering| {
            let again = lowering.new_flag();
            let test = lowering.lower_test(condition)?;
            if let Some(local) = repeat.declaration {
                let variable = lowering.local_variable(local, span)?;
                lowering.set_variable(variable, &[test]);
                lowering.report_local(EventKind::Assignment, local, condition.span, &[test]);
            }
            lowering.lower_when(test, span, |lowering| {
                lowering.lower_round(repeat)?;
                let value = lowering.lower_step_and_test(repeat, None, span)?;
                lowering.cells.set(again, value);
                Ok(())
            })?;
            Ok(lowering.cells.get(again))
        })
    }

    /// Lowers one iteration of the body. Afterwards the flags of `break` and `return` hold how it
    /// ended.
    fn lower_round(&mut self, repeat: &'m Loop) -> Lowered<()> {
        let Some(jumps) = self.frame.jumps else { return Ok(()) };
        // An iteration begins only if there was no jump.
        self.clear(self.frame.returned);
        self.clear(jumps.broke);
        if let Some(flag) = jumps.continued {
            self.clear(flag);
        }
        self.lower_list(&repeat.body)?;
        if let Some(flag) = jumps.continued {
            self.clear(flag);
        }
        Ok(())
    }

    /// Lowers the step and the test after the body, guarded against jumps. Returns the condition
    /// for another iteration.
    fn lower_step_and_test(
        &mut self,
        repeat: &'m Loop,
        condition: Option<&'m Expression>,
        span: Span,
    ) -> Lowered<Value> {
        let stopped = self.stopped();
        let going = self.builder.not(stopped);
        let again = self.new_flag();
        self.lower_when(going, span, |lowering| {
            if let Some(step) = &repeat.step {
                lowering.report_step(step.span);
                lowering.lower_expression(step)?;
            }
            let value = match condition {
                Some(condition) => lowering.lower_test(condition)?,
                None => lowering.builder.bool(true),
            };
            lowering.cells.set(again, value);
            Ok(())
        })?;
        Ok(self.cells.get(again))
    }

    /// Lowers the condition of a loop, which is a step.
    fn lower_test(&mut self, condition: &'m Expression) -> Lowered<Value> {
        self.report_step(condition.span);
        self.lower_condition(condition)
    }

    /// Lowers a loop whose body returns the condition for another iteration. Cells that are not
    /// carried are restored afterwards.
    pub fn lower_repeat(
        &mut self,
        carried: &[Cell],
        span: Span,
        body: impl FnOnce(&mut Self) -> Lowered<Value>,
    ) -> Lowered<()> {
        self.check_regions(span)?;
        let initial = carried.iter().map(|cell| self.cells.get(*cell)).collect();
        let params = self.builder.begin_loop(initial);
        let mark = self.cells.mark();
        for (cell, param) in carried.iter().zip(params.iter()) {
            self.set_cell(*cell, param);
        }
        let again = body(self)?;
        let next: Vec<Value> = carried.iter().map(|cell| self.cells.get(*cell)).collect();
        self.cells.take_back(mark);
        let results = self.builder.end_loop(again, &next);
        for (cell, result) in carried.iter().zip(results.iter()) {
            self.set_cell(*cell, result);
        }
        Ok(())
    }

    /// The cells of the variables that a part of the function may change.
    pub fn cells_changed_by(&self, assigned: &Assigned) -> Vec<Cell> {
        let mut cells = Vec::new();
        for root in &assigned.roots {
            let variable = match root {
                Root::Local(id) => self.frame.locals[id.0 as usize],
                Root::Member(id) => self.members.get(id).copied(),
                Root::State(id) => self.states.get(id).copied(),
                Root::Accepted => {
                    cells.push(self.accepted);
                    None
                }
            };
            if let Some(id) = variable {
                cells.extend(self.cells_of(id).into_iter().flatten());
                cells.extend(self.variable(id).default.map(|default| default.written));
            }
        }
        if assigned.returns {
            cells.push(self.frame.returned);
            let result = self.frame.result.and_then(|result| self.cells_of(result));
            cells.extend(result.into_iter().flatten());
        }
        cells
    }
}
