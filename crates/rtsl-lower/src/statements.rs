//! Statements.

use rtsl_ir::{Constant, EventKind, Value};
use rtsl_sema::hir::{Expression, ExpressionKind, LocalId, Statement, StatementKind};
use rtsl_source::Span;

use crate::Lowering;
use crate::calls::Jumps;
use crate::cells::Cell;
use crate::facts::Root;
use crate::limits::Lowered;
use crate::variables::SourceVariableId;

/// The depth of regions up to which the statements after an `if` that ends in a jump become its
/// other branch. At greater depth flags are used, so that a long list of `if (...) return` does not
/// nest without bound.
const REGIONS_FOR_BRANCHES: usize = 40;

impl<'m> Lowering<'m> {
    /// Lowers statements in order, up to one that jumps. The statements after one that may jump are
    /// guarded.
    pub fn lower_list(&mut self, list: &'m [Statement]) -> Lowered<()> {
        let mut rest = list;
        while let Some(statement) = rest.first() {
            let stopped = self.stopped();
            match self.builder.known(stopped) {
                Some(Constant::Bool(true)) => return Ok(()),
                Some(_) => rest = self.lower_run(rest)?,
                None => {
                    let going = self.builder.not(stopped);
                    let mut left = rest;
                    self.lower_unstopped(going, statement.span, |lowering| {
                        left = lowering.lower_run(rest)?;
                        Ok(())
                    })?;
                    rest = left;
                }
            }
        }
        Ok(())
    }

    /// Lowers a region that is executed only if there was no jump.
    pub fn lower_unstopped(
        &mut self,
        condition: Value,
        span: Span,
        fill: impl FnOnce(&mut Self) -> Lowered<()>,
    ) -> Lowered<()> {
        self.lower_when(condition, span, |lowering| {
            let before: Vec<(Cell, Value)> =
                lowering.flags().map(|flag| (flag, lowering.cells.get(flag))).collect();
            for (flag, _) in &before {
                lowering.clear(*flag);
            }
            fill(lowering)?;
            // A flag that remains clear has not changed.
            for (flag, value) in before {
                let after = lowering.cells.get(flag);
                if lowering.builder.known(after) == Some(Constant::Bool(false)) {
                    lowering.cells.set(flag, value);
                }
            }
            Ok(())
        })
    }

    /// Lowers statements in order, up to and including the first that may jump; returns the
    /// remaining ones.
    fn lower_run(&mut self, list: &'m [Statement]) -> Lowered<&'m [Statement]> {
        let mut rest = list;
        while let Some((statement, after)) = rest.split_first() {
            if self.takes_rest_as_branch(statement, after) {
                self.lower_if_with_rest(statement, after)?;
                return Ok(&[]);
            }
            self.lower_statement(statement)?;
            rest = after;
            let stopped = self.stopped();
            if self.builder.known(stopped) != Some(Constant::Bool(false)) {
                break;
            }
        }
        Ok(rest)
    }

    /// True for an `if` of which one branch always jumps.
    fn takes_rest_as_branch(&self, statement: &Statement, after: &[Statement]) -> bool {
        let StatementKind::If { then, otherwise, .. } = &statement.kind else { return false };
        !after.is_empty()
            && self.builder.depth() < REGIONS_FOR_BRANCHES
            && always_jumps(then) != always_jumps(otherwise)
    }

    /// Lowers `if (c) { ...; return; } rest` as `if (c) { ...; return; } else { rest }`.
    fn lower_if_with_rest(
        &mut self,
        statement: &'m Statement,
        after: &'m [Statement],
    ) -> Lowered<()> {
        let StatementKind::If { condition, then, otherwise } = &statement.kind else {
            return Ok(());
        };
        self.enter(statement.span)?;
        self.report_statement(statement);
        let condition = self.lower_condition(condition)?;
        let ends = ends_of_branches(statement, otherwise);
        let branch = |lowering: &mut Self, list: &'m [Statement], end: u32| {
            lowering.lower_scope(list, end)?;
            if !always_jumps(list) {
                lowering.lower_list(after)?;
            }
            Ok(Vec::new())
        };
        self.lower_if(
            condition,
            statement.span,
            |lowering| branch(lowering, then, ends[0]),
            |lowering| branch(lowering, otherwise, ends[1]),
        )?;
        self.leave();
        Ok(())
    }

    fn lower_statement(&mut self, statement: &'m Statement) -> Lowered<()> {
        self.enter(statement.span)?;
        self.report_statement(statement);
        match &statement.kind {
            StatementKind::Expression(value) => {
                self.lower_expression(value)?;
            }
            StatementKind::Declare(local, value) => {
                self.lower_declaration(*local, value.as_ref(), statement)?;
            }
            StatementKind::Block(list) => self.lower_scope(list, statement.span.end)?,
            StatementKind::If { condition, then, otherwise } => {
                let condition = self.lower_condition(condition)?;
                let ends = ends_of_branches(statement, otherwise);
                self.lower_if(
                    condition,
                    statement.span,
                    |lowering| lowering.lower_scope(then, ends[0]).map(|()| Vec::new()),
                    |lowering| lowering.lower_scope(otherwise, ends[1]).map(|()| Vec::new()),
                )?;
            }
            StatementKind::Switch { selector, cases } => {
                self.in_scope(statement.span.end, |lowering| {
                    lowering.lower_switch(selector, cases, statement.span)
                })?;
            }
            StatementKind::Loop(repeat) => self.in_scope(statement.span.end, |lowering| {
                lowering.lower_loop(repeat, statement.span)
            })?,
            StatementKind::Illuminance(illuminance) => {
                self.in_scope(statement.span.end, |lowering| {
                    lowering.lower_illuminance(illuminance, statement.span)
                })?;
            }
            StatementKind::Print { pieces, arguments } => {
                self.lower_print(pieces, arguments, statement.span)?;
            }
            StatementKind::Return(value) => self.lower_return(value.as_ref())?,
            StatementKind::Break => {
                if let Some(jumps) = self.frame.jumps {
                    self.raise(jumps.broke);
                }
            }
            StatementKind::Continue => {
                if let Some(Jumps { continued: Some(continued), .. }) = self.frame.jumps {
                    self.raise(continued);
                }
            }
        }
        self.leave();
        Ok(())
    }

    /// Lowers statements whose variables are visible up to an offset of the text.
    fn lower_scope(&mut self, list: &'m [Statement], end: u32) -> Lowered<()> {
        self.in_scope(end, |lowering| lowering.lower_list(list))
    }

    fn in_scope(&mut self, end: u32, lower: impl FnOnce(&mut Self) -> Lowered<()>) -> Lowered<()> {
        let outer = std::mem::replace(&mut self.frame.scope_end, end);
        lower(self)?;
        self.frame.scope_end = outer;
        Ok(())
    }

    fn lower_declaration(
        &mut self,
        local: LocalId,
        value: Option<&'m Expression>,
        statement: &Statement,
    ) -> Lowered<()> {
        let function = self.frame.id.filter(|_| value.is_none());
        if function.is_some_and(|id| !self.facts.of(id).named_locals.contains(&local)) {
            return Ok(());
        }
        if let Some(table) = self.table_for(local, value)? {
            self.frame.locals[local.0 as usize] = Some(table);
            return Ok(());
        }
        let variable = self.local_variable(local, statement.span)?;
        let values = match value {
            Some(value) => self.lower_precisely(self.is_precise(local), value)?,
            None => {
                let layout = self.variable(variable).layout.clone();
                self.zeros(&layout)
            }
        };
        self.set_variable(variable, &values);
        let kind = if value.is_some() { EventKind::Assignment } else { EventKind::Known };
        self.report_local(kind, local, statement.span, &values);
        Ok(())
    }

    /// The table that can replace an array of constants that is never written and has to be in
    /// memory.
    fn table_for(
        &mut self,
        local: LocalId,
        value: Option<&'m Expression>,
    ) -> Lowered<Option<SourceVariableId>> {
        let (Some(value), Some(function)) = (value, self.frame.id) else { return Ok(None) };
        let facts = self.facts.of(function);
        // A `switch` has created its variables already, since it may jump over declarations.
        let wanted = facts.indexed.contains(&Root::Local(local))
            && !facts.written_locals.contains(&local)
            && self.frame.locals[local.0 as usize].is_none();
        // A named variable may be written while this one is live, so this one cannot be an alias of
        // it.
        let named = matches!(value.kind, ExpressionKind::Member(_) | ExpressionKind::Local(_));
        if wanted && !named { self.host_variable_of(value) } else { Ok(None) }
    }

    fn lower_return(&mut self, value: Option<&'m Expression>) -> Lowered<()> {
        if let Some(value) = value {
            let precise = self.frame.function.is_some_and(|function| function.precise);
            let values = self.lower_precisely(precise, value)?;
            if let Some(result) = self.frame.result {
                self.set_variable(result, &values);
            }
        }
        self.raise(self.frame.returned);
        Ok(())
    }

    /// True if a jump skips the following statements.
    pub fn stopped(&mut self) -> Value {
        let flags = self.flags();
        self.any_flag(flags)
    }

    /// The flags that skip the following statements.
    fn flags(&self) -> impl Iterator<Item = Cell> + use<> {
        let jumps = self.frame.jumps;
        let broke = jumps.map(|jumps| jumps.broke);
        let continued = jumps.and_then(|jumps| jumps.continued);
        [Some(self.frame.returned), broke, continued].into_iter().flatten()
    }
}

/// The offsets up to which variables of the branches of an `if` are visible.
fn ends_of_branches(statement: &Statement, otherwise: &[Statement]) -> [u32; 2] {
    let end = statement.span.end;
    [otherwise.first().map_or(end, |first| end.min(first.span.start)), end]
}

/// True if control never reaches the end of the list. Jumps out of inner loops do not count.
fn always_jumps(list: &[Statement]) -> bool {
    list.iter().any(|statement| match &statement.kind {
        StatementKind::Return(_) | StatementKind::Break | StatementKind::Continue => true,
        StatementKind::Block(list) => always_jumps(list),
        StatementKind::If { then, otherwise, .. } => always_jumps(then) && always_jumps(otherwise),
        StatementKind::Expression(_)
        | StatementKind::Declare(..)
        | StatementKind::Switch { .. }
        | StatementKind::Loop(_)
        | StatementKind::Illuminance(_)
        | StatementKind::Print { .. } => false,
    })
}
