//! Reports of traced functions, of prints and assignments, and the places of values.

use std::sync::Arc;

use rtsl_ir::{Event, EventKind, EventValue, OpKind, Place, Source, Value, scalar_count};
use rtsl_sema::hir::{Expression, LocalId, Type};
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
        let values = arguments.iter().map(|it| self.event_value(String::new(), &it.ty));
        let values = values.collect();
        self.report(EventKind::Print(pieces.to_vec()), span, values, operands);
        Ok(())
    }

    /// Reports the new value of what an expression denotes.
    pub fn report_assignment(&mut self, target: &Expression, values: &[Value]) {
        let place = self.tracing.and_then(|tracing| tracing.place(target.span));
        if let Some(Place { source, start, end }) = place {
            let name = source.text.get(start as usize..end as usize).unwrap_or_default();
            self.report_value(name.to_owned(), &target.ty, target.span, values);
        }
    }

    /// Reports the initial value of a local.
    pub fn report_local(&mut self, local: LocalId, span: Span, values: &[Value]) {
        let Some(function) = self.frame.function else { return };
        let local = &function.locals[local.0 as usize];
        if self.tracing.is_some_and(|tracing| tracing.place(span).is_some()) {
            self.report_value(local.name.clone(), &local.ty, span, values);
        }
    }

    fn report_value(&mut self, name: String, ty: &Type, span: Span, values: &[Value]) {
        let value = self.event_value(name, ty);
        if scalar_count(&value.ty) == values.len() {
            self.report(EventKind::Assignment, span, vec![value], values.to_vec());
        }
    }

    fn event_value(&self, name: String, ty: &Type) -> EventValue {
        EventValue { name, ty: parameter_type(self.layouts, ty) }
    }

    fn report(
        &mut self,
        kind: EventKind,
        span: Span,
        values: Vec<EventValue>,
        operands: Vec<Value>,
    ) {
        let method = self.builder.function().name.clone();
        let place = self.tracing.and_then(|tracing| tracing.place(span));
        let event = Event { kind, method, place, values };
        self.builder.push(OpKind::Report(Arc::new(event), operands));
    }
}
