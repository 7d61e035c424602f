//! Control-flow warnings that need no data-flow analysis: variables read before they have a value,
//! unused variables, functions that can end without returning a value.

use rtsl_source::{Diagnostic, Span, diagnostic_codes as codes};
use rtsl_syntax::ast;

use super::Checker;
use super::scope::Entity;
use crate::hir::{LocalId, Type};

/// Reads of variables that are judged at the end of the enclosing loop.
#[derive(Debug, Default)]
pub(super) struct Flow {
    /// The number of conditions inside the innermost loop that enclose the current statement.
    conditional_depth: u32,
    /// Conditional reads inside a loop of variables that are not assigned before them in the text.
    /// A later part of the loop body may assign them.
    pending: Vec<(LocalId, Span)>,
}

impl Checker<'_> {
    /// Notes that a local is read. Locals start as zero, so a read before any assignment in the
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

    /// Notes that a local, or a part of it, is assigned.
    pub(super) fn note_local_write(&mut self, id: LocalId) {
        let info = &mut self.function.local_info[id.0 as usize];
        info.assigned = true;
    }

    fn report_uninitialized(&mut self, id: LocalId, span: Span) {
        // One warning per variable is enough.
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

    /// Checks text that runs only under a condition.
    pub(super) fn conditionally<T>(&mut self, check: impl FnOnce(&mut Self) -> T) -> T {
        self.function.flow.conditional_depth += 1;
        let result = check(self);
        self.function.flow.conditional_depth -= 1;
        result
    }

    /// Checks text that runs repeatedly, then judges the reads in it.
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

    /// Closes the innermost scope, and notes its unused variables.
    pub(super) fn close_scope(&mut self) {
        for (name, named) in self.scopes.pop() {
            let Entity::Local(id) = named.entity else { continue };
            if !self.function.local_info[id.0 as usize].used && !name.starts_with('_') {
                self.function.unused.push((name, named.span));
            }
        }
    }

    /// Warns about the unused variables of the function.
    pub(super) fn report_unused_variables(&mut self) {
        for (name, span) in std::mem::take(&mut self.function.unused) {
            self.report(
                Diagnostic::new(codes::UNUSED_VARIABLE, format!("`{name}` is never used"))
                    .at(span, "declared here and never named again"),
            );
        }
    }

    /// Reports an error or a warning if the end of a body can be reached and the function has a
    /// result.
    pub(super) fn check_end_of_function(&mut self, function: &ast::Function, result: &Type) {
        if *result == Type::Void || *result == Type::Error {
            return;
        }
        let name = &function.name.name;
        let shown = self.show_one(result);
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
                    .at(function.name.span, format!("expected a `return` with {shown}")),
            );
        }
    }

    /// Warns, once per block, that the text after a jump is never reached.
    pub(super) fn report_unreachable(&mut self, span: Span, jump: Span) {
        self.report(
            Diagnostic::new(codes::UNREACHABLE, "this is never reached")
                .at(span, "never reached")
                .label(jump, "control never continues after this"),
        );
    }
}
