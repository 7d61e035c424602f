//! Reports of the calls that one method makes of another, where both are traced.

use std::collections::BTreeMap;
use std::sync::Arc;

use rtsl_ir::class::ParameterType;
use rtsl_ir::{
    Event, EventKind, EventValue, Index, Op, OpKind, ReferenceCall, Scalar, Value, VariableId,
    VariableKind,
};

use super::linker::{Linker, Linking, Site};

impl Linker {
    /// Reports the start of a called method, with the state that it reads.
    pub(super) fn report_call(
        &mut self,
        site: &mut Site<'_>,
        call: &ReferenceCall,
        to: &mut Vec<Op>,
    ) -> Linking<()> {
        if !site.tree.class.is_traced {
            return Ok(());
        }
        let (mut values, mut operands) = (Vec::new(), Vec::new());
        for variable in state_read(site) {
            let info = site.function.variable(variable);
            values.push(event_value(&info.name, info.len));
            for component in 0..info.len {
                operands.push(self.load_state(site, variable, Index::Constant(component), to)?);
            }
        }
        let reference = site.prefix.trim_end_matches('.').to_owned();
        self.report(site, call, EventKind::Call(reference), (values, operands), to)
    }

    /// Reports the end of a called method, with its results.
    pub(super) fn report_return(
        &mut self,
        site: &Site<'_>,
        call: &ReferenceCall,
        results: &[Value],
        to: &mut Vec<Op>,
    ) -> Linking<()> {
        if !site.tree.class.is_traced {
            return Ok(());
        }
        let mut by_variable: BTreeMap<u32, (&str, Vec<Value>)> = BTreeMap::new();
        for (component, value) in call.results.iter().zip(results) {
            let name = component.variable().map_or("", |variable| variable.name);
            by_variable.entry(component.variable).or_insert((name, Vec::new())).1.push(*value);
        }
        let (mut values, mut operands) = (Vec::new(), Vec::new());
        for (name, components) in by_variable.into_values() {
            values.push(event_value(name, components.len() as u32));
            operands.extend(components);
        }
        self.report(site, call, EventKind::Return, (values, operands), to)
    }

    fn report(
        &mut self,
        site: &Site<'_>,
        call: &ReferenceCall,
        kind: EventKind,
        (values, operands): (Vec<EventValue>, Vec<Value>),
        to: &mut Vec<Op>,
    ) -> Linking<()> {
        let method = format!("{}.{}", site.tree.class.name, call.method.name());
        let event = Event { kind, method, place: None, values };
        self.emit(to, OpKind::Report(Arc::new(event), operands), &[], false)?;
        Ok(())
    }
}

/// The state variables that a method reads, in the order of its variables.
fn state_read(site: &Site<'_>) -> Vec<VariableId> {
    let mut is_read = vec![false; site.function.variables.len()];
    site.function.body.for_each_op(&mut |op| {
        if let OpKind::Load(variable, _) = op.kind {
            is_read[variable.0 as usize] = true;
        }
    });
    let all = (0..).map(VariableId).zip(&site.function.variables).zip(is_read);
    let read = all.filter(|((_, it), is_read)| *is_read && it.kind == VariableKind::State);
    read.map(|((id, _), _)| id).collect()
}

fn event_value(name: &str, components: u32) -> EventValue {
    let ty = match components {
        1 => ParameterType::Scalar(Scalar::F32),
        count => ParameterType::Vector(Scalar::F32, count.min(u8::MAX.into()) as u8),
    };
    EventValue { name: name.to_owned(), ty }
}
