//! Reports of traced functions, of their statements and the values of their variables, and the places of values.

use std::ops::Range;
use std::sync::Arc;

use rtsl_ir::{
    Event, EventKind, EventValue, MAX_REPORTED_SCALARS, OpKind, Place, Source, Value, ValueScope,
    scalar_count,
};
use rtsl_sema::hir::{
    Expression, ExpressionKind, Function, Local, LocalId, Statement, StatementKind, Type,
};
use rtsl_source::Span;

use crate::Lowering;
use crate::limits::Lowered;
use crate::parameters::parameter_type;

/// The texts of a traced class.
#[derive(Clone, Debug, Default)]
pub struct Tracing {
    /// The texts, by the indices of files in spans. Those of the prelude are `None`: what its functions compute has the
    /// place of their call.
    pub sources: Vec<Option<Arc<Source>>>,
}

impl Tracing {
    /// Returns the place of a span, if its text is traced.
    fn place(&self, span: Span) -> Option<Place> {
        let source = self.sources.get(span.file.0 as usize)?.clone()?;
        Some(Place { source, start: span.start, end: span.end })
    }
}

impl<'m> Lowering<'m> {
    /// Makes a span the place of the operations that follow, until [`Lowering::leave_place`].
    pub fn enter_place(&mut self, span: Span) {
        let Some(tracing) = self.tracing else { return };
        let place = tracing.place(span).or_else(|| self.builder.place().cloned());
        let outer = self.builder.set_place(place);
        self.outer_places.push(outer);
    }

    /// Restores the place from before [`Lowering::enter_place`].
    pub fn leave_place(&mut self) {
        if let Some(outer) = self.outer_places.pop() {
            self.builder.set_place(outer);
        }
    }

    /// Lowers a `print`.
    pub fn lower_print(
        &mut self,
        pieces: &[String],
        arguments: &'m [Expression],
        span: Span,
    ) -> Lowered<()> {
        let mut operands = Vec::new();
        for argument in arguments {
            operands.extend(self.lower_expression(argument)?);
        }
        let values =
            arguments.iter().map(|it| self.value_of_type("", &it.ty, ValueScope::default()));
        let values = values.collect();
        self.report(EventKind::Print(pieces.to_vec()), span, values, operands);
        Ok(())
    }

    /// Reports that a statement, or what is like one, runs next.
    pub fn report_step(&mut self, span: Span) {
        if self.is_traced(span) {
            self.report(EventKind::Statement, span, Vec::new(), Vec::new());
        }
    }

    /// Reports a statement that is a step of its own, by the span of its head.
    pub fn report_statement(&mut self, statement: &Statement) {
        let head =
            |end: Span| if end.file == statement.span.file { statement.span.to(end) } else { end };
        match &statement.kind {
            // Their parts are steps.
            StatementKind::Block(_) | StatementKind::Loop(_) | StatementKind::Illuminance(_) => {}
            StatementKind::Declare(_, None) => {}
            StatementKind::If { condition, .. } => self.report_step(head(condition.span)),
            StatementKind::Switch { selector, .. } => self.report_step(head(selector.span)),
            StatementKind::Expression(_)
            | StatementKind::Declare(_, Some(_))
            | StatementKind::Print { .. }
            | StatementKind::Return(_)
            | StatementKind::Break
            | StatementKind::Continue => self.report_step(statement.span),
        }
    }

    /// Lowers a condition and reports its value.
    pub fn lower_condition(&mut self, condition: &'m Expression) -> Lowered<Value> {
        let value = self.lower_scalar(condition)?;
        self.report_expression(EventKind::Condition, condition.span, &condition.ty, &[value]);
        Ok(value)
    }

    /// Reports the new value of what an expression denotes, and that of the whole variable.
    pub fn report_assignment(&mut self, target: &Expression, values: &[Value]) {
        let place = self.tracing.and_then(|tracing| tracing.place(target.span));
        let Some(Place { source, start, end }) = place else { return };
        let name = source.text.get(start as usize..end as usize).unwrap_or_default();
        let root = root_expression(target);
        let (scope, variable) = match root.kind {
            ExpressionKind::Local(id) => {
                (ValueScope::Local, self.frame.locals.get(id.0 as usize).copied().flatten())
            }
            ExpressionKind::Member(id) => (ValueScope::Member, self.members.get(&id).copied()),
            ExpressionKind::State(id) => (ValueScope::State, self.states.get(&id).copied()),
            _ => return,
        };
        let extent = match root.kind {
            ExpressionKind::Local(id) => self.extent_of(id),
            _ => EventValue::EVERYWHERE,
        };
        let value = |name: &str, ty: &Type| {
            let (name, ty) = (name.to_owned(), parameter_type(self.layouts, ty));
            Arc::new(EventValue { name, ty, scope, extent: extent.clone() })
        };
        let part = value(name, &target.ty);
        let mut reported = Reported::default();
        reported.add(part, values);
        if let Some(variable) = variable.filter(|_| !std::ptr::eq(root, target)) {
            let whole = value(&self.variable(variable).name, &root.ty);
            if scalar_count(&whole.ty) <= MAX_REPORTED_SCALARS {
                let values = self.stored(variable);
                reported.add(whole, &values);
            }
        }
        self.report_all(EventKind::Assignment, target.span, reported);
    }

    /// Reports the initial value of a local that is declared here.
    pub fn report_local(&mut self, kind: EventKind, id: LocalId, span: Span, values: &[Value]) {
        let Some(function) = self.frame.function else { return };
        let local = &function.locals[id.0 as usize];
        if self.is_traced(span) {
            let is_of_function = span.file == function.end.file;
            let end = if is_of_function { self.frame.scope_end } else { u32::MAX };
            let start = if is_of_function { span.end.min(end) } else { 0 };
            self.frame.extents[id.0 as usize] = start..end;
            let mut reported = Reported::default();
            reported.add(self.local_value(id, local), values);
            self.report_all(kind, span, reported);
        }
    }

    fn local_value(&self, id: LocalId, local: &Local) -> Arc<EventValue> {
        let (name, ty) = (local.name.clone(), parameter_type(self.layouts, &local.ty));
        let (scope, extent) = (ValueScope::Local, self.extent_of(id));
        Arc::new(EventValue { name, ty, scope, extent })
    }

    fn extent_of(&self, id: LocalId) -> Range<u32> {
        self.frame.extents.get(id.0 as usize).cloned().unwrap_or(EventValue::EVERYWHERE)
    }

    /// Reports the value of a variable that nothing in the text has assigned.
    pub fn report_known(
        &mut self,
        name: &str,
        scope: ValueScope,
        ty: &Type,
        values: &[Value],
        span: Span,
    ) {
        if self.tracing.is_some() {
            let mut reported = Reported::default();
            reported.add(self.value_of_type(name, ty, scope), values);
            self.report_all(EventKind::Known, span, reported);
        }
    }

    /// Reports the start of a function, whose frame is the current one, with its parameters.
    pub fn report_enter(&mut self, function: &Function, span: Span) {
        if !self.is_traced(function.span) {
            return;
        }
        let mut reported = Reported::default();
        for (index, local) in function.locals.iter().take(function.parameters.len()).enumerate() {
            let Some(variable) = self.frame.locals[index] else { continue };
            let value = self.local_value(LocalId(index as u32), local);
            if scalar_count(&value.ty) <= MAX_REPORTED_SCALARS {
                let values = self.stored(variable);
                reported.add(value, &values);
            }
        }
        let (kind, Reported { values, operands }) =
            (EventKind::Enter(function.name.clone()), reported);
        self.report(kind, span, values, operands);
    }

    /// Reports the end of a function, with its result.
    pub fn report_leave(&mut self, function: &Function, result: &[Value]) {
        if !self.is_traced(function.span) {
            return;
        }
        let mut reported = Reported::default();
        if function.result != Type::Void {
            let value = self.value_of_type("", &function.result, ValueScope::default());
            reported.add(value, result);
        }
        let Reported { values, operands } = reported;
        self.report(EventKind::Leave, function.end, values, operands);
    }

    /// True if the text of a span is traced.
    fn is_traced(&self, span: Span) -> bool {
        self.tracing.is_some_and(|tracing| tracing.place(span).is_some())
    }

    fn report_expression(&mut self, kind: EventKind, span: Span, ty: &Type, values: &[Value]) {
        if self.is_traced(span) {
            let mut reported = Reported::default();
            reported.add(self.value_of_type("", ty, ValueScope::default()), values);
            self.report_all(kind, span, reported);
        }
    }

    /// Reports values, if there are any.
    fn report_all(&mut self, kind: EventKind, span: Span, reported: Reported) {
        let Reported { values, operands } = reported;
        if !values.is_empty() {
            self.report(kind, span, values, operands);
        }
    }

    fn value_of_type(&self, name: &str, ty: &Type, scope: ValueScope) -> Arc<EventValue> {
        Arc::new(EventValue::new(name, parameter_type(self.layouts, ty), scope))
    }

    fn report(
        &mut self,
        kind: EventKind,
        span: Span,
        values: Vec<Arc<EventValue>>,
        operands: Vec<Value>,
    ) {
        let method = self.builder.function().name.as_str().into();
        let place = self.tracing.and_then(|tracing| tracing.place(span));
        let event = Event { kind, method, place, values };
        self.builder.push(OpKind::Report(Arc::new(event), operands));
    }
}

/// Values with their scalars.
#[derive(Default)]
struct Reported {
    values: Vec<Arc<EventValue>>,
    operands: Vec<Value>,
}

impl Reported {
    /// Adds a value, unless it is none that can be reported.
    fn add(&mut self, value: Arc<EventValue>, scalars: &[Value]) {
        let is_reported = (1..=MAX_REPORTED_SCALARS).contains(&scalars.len());
        if is_reported && scalar_count(&value.ty) == scalars.len() {
            self.values.push(value);
            self.operands.extend_from_slice(scalars);
        }
    }
}

/// The variable that an expression denotes a part of.
fn root_expression(mut part: &Expression) -> &Expression {
    while let ExpressionKind::Swizzle(whole, _)
    | ExpressionKind::Field(whole, _)
    | ExpressionKind::Index(whole, _) = &part.kind
    {
        part = whole;
    }
    part
}
