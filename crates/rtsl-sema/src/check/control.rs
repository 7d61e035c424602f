//! What can be said of control flow without solving it: variables read before any text gives them
//! a value, variables never named, functions whose end gives no value.

use rtsl_source::{Diagnostic, Span, diagnostic_codes as codes};
use rtsl_syntax::ast;

use super::Checker;
use super::scope::Entity;
use crate::hir::{LocalId, Type};

/// Reads to be judged at the end of the loop around them.
#[derive(Debug, Default)]
pub(super) struct Flow {
    /// Conditions around the statement being checked that stand inside the innermost loop.
    conditional_depth: u32,
    /// Reads, under a condition inside a loop, of variables that no text before them assigns: a
    /// later part of the loop may.
    pending: Vec<(LocalId, Span)>,
}

impl Checker<'_> {
    /// Notes that a local is read. Its life began with zero, so a read before any assignment in the
    /// text is probably a mistake.
    pub(super) fn note_local_read(&mut self, id: LocalId, span: Span) {
        let info = &mut self.function.local_info[id.0 as usize];
        if info.assigned {
            return;
        }
        let declared_outside_loop = info.loop_depth < self.function.loop_depth;
        if declared_outside_loop && self.function.flow.conditional_depth > 0 {
            self.function.flow.pending.push((id, span));
        } else {
            self.report_uninitialized(id, span);
        }
    }

    /// Notes that a local, or a part of it, is given a value.
    pub(super) fn note_local_write(&mut self, id: LocalId) {
        let info = &mut self.function.local_info[id.0 as usize];
        info.assigned = true;
    }

    fn report_uninitialized(&mut self, id: LocalId, span: Span) {
        // Once a variable is enough.
        self.function.local_info[id.0 as usize].assigned = true;
        let declared = self.function.local_info[id.0 as usize].span;
        let name = self.function.locals[id.0 as usize].name.clone();
        self.report(
            Diagnostic::new(
                codes::UNINITIALIZED,
                format!("`{name}` is read before it has a value"),
            )
            .at(span, "reads zero")
            .label(declared, "declared here without a value")
            .help("give it a value where it is declared"),
        );
    }

    /// Checks what runs only under a condition.
    pub(super) fn conditionally<T>(&mut self, check: impl FnOnce(&mut Self) -> T) -> T {
        self.function.flow.conditional_depth += 1;
        let result = check(self);
        self.function.flow.conditional_depth -= 1;
        result
    }

    /// Checks what runs repeatedly, then judges the reads in it.
    pub(super) fn repeatedly<T>(&mut self, check: impl FnOnce(&mut Self) -> T) -> T {
        let depth = std::mem::take(&mut self.function.flow.conditional_depth);
        let switches = std::mem::take(&mut self.function.switch_depth);
        self.function.loop_depth += 1;
        let result = check(self);
        self.function.loop_depth -= 1;
        self.function.switch_depth = switches;
        self.function.flow.conditional_depth = depth;
        if self.function.loop_depth == 0 {
            for (id, span) in std::mem::take(&mut self.function.flow.pending) {
                if !self.function.local_info[id.0 as usize].assigned {
                    self.report_uninitialized(id, span);
                }
            }
        }
        result
    }

    /// Closes the innermost scope, and notes its variables that nothing named.
    pub(super) fn close_scope(&mut self) {
        for (name, named) in self.scopes.pop() {
            let Entity::Local(id) = named.entity else { continue };
            if !self.function.local_info[id.0 as usize].used && !name.starts_with('_') {
                self.function.unused.push((name, named.span));
            }
        }
    }

    /// Warns about the variables of the function that nothing named.
    pub(super) fn report_unused_variables(&mut self) {
        for (name, span) in std::mem::take(&mut self.function.unused) {
            self.report(
                Diagnostic::new(codes::UNUSED_VARIABLE, format!("`{name}` is never used"))
                    .at(span, "declared here, named nowhere else"),
            );
        }
    }

    /// The end of a body can be reached: an error or a warning where a value is due.
    pub(super) fn check_end_of_function(&mut self, function: &ast::Function, result: &Type) {
        if *result == Type::Void || *result == Type::Error {
            return;
        }
        let name = &function.name.name;
        let shown = self.show(result);
        if self.function.returns_value {
            self.report(
                Diagnostic::new(
                    codes::MISSING_RETURN,
                    format!("`{name}` does not return a value on every path"),
                )
                .at(function.name.span, "the end can be reached; the result is zero there"),
            );
        } else {
            self.report(
                Diagnostic::new(codes::NO_RETURN, format!("`{name}` returns no value"))
                    .at(function.name.span, format!("expected a `return` with a `{shown}`")),
            );
        }
    }

    /// Says once a block that what follows a jump is never reached.
    pub(super) fn report_unreachable(&mut self, span: Span, jump: Span) {
        self.report(
            Diagnostic::new(codes::UNREACHABLE, "this is never reached")
                .at(span, "never reached")
                .label(jump, "control does not come past this"),
        );
    }
}
