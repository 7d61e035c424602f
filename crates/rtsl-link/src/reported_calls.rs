//! Reports of the calls that one method makes of another, where both are traced.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

use rtsl_ir::class::ParameterType;
use rtsl_ir::{
    Event, EventKind, EventValue, Function, Index, MAX_REPORTED_SCALARS, Op, OpKind, ReferenceCall,
    Scalar, Value, ValueScope, Variable, VariableId, VariableKind,
};

use crate::draft::Linking;
use crate::linker::Linker;
use crate::loads::{load_member, load_state};
use crate::site::Site;

/// Reports the start of a called method, with the state that it reads.
pub(crate) fn report_call<L: Linker>(
    linker: &mut L,
    site: &mut Site<'_>,
    call: &ReferenceCall,
    to: &mut Vec<Op>,
) -> Linking<()> {
    if !site.class().is_traced {
        return Ok(());
    }
    let (mut values, mut operands) = (Vec::new(), Vec::new());
    for variable in read(site, VariableKind::State) {
        let info = site.function.variable(variable);
        values.push(Arc::new(event_value(info)));
        for component in 0..info.len {
            operands.push(load_state(linker, site, variable, Index::Constant(component), to)?);
        }
    }
    let reference = site.prefix.trim_end_matches('.').to_owned();
    report(linker, site, call, EventKind::Call(reference), (values, operands), to)?;
    report_members(linker, site, call, to)
}

/// Reports the members that a called method reads.
fn report_members<L: Linker>(
    linker: &mut L,
    site: &mut Site<'_>,
    call: &ReferenceCall,
    to: &mut Vec<Op>,
) -> Linking<()> {
    let (mut values, mut operands) = (Vec::new(), Vec::new());
    for variable in read(site, VariableKind::Member) {
        let info = site.function.variable(variable);
        values.push(Arc::new(event_value(info)));
        for component in 0..info.len {
            operands.push(load_member(linker, site, variable, Index::Constant(component), to)?);
        }
    }
    if values.is_empty() {
        return Ok(());
    }
    report(linker, site, call, EventKind::Known, (values, operands), to)
}

/// Reports the end of a called method, with its results.
pub(crate) fn report_return<L: Linker>(
    linker: &mut L,
    site: &Site<'_>,
    call: &ReferenceCall,
    results: &[Value],
    to: &mut Vec<Op>,
) -> Linking<()> {
    if !site.class().is_traced {
        return Ok(());
    }
    let mut by_variable: BTreeMap<u32, (&str, Vec<Value>)> = BTreeMap::new();
    for (component, value) in call.results.iter().zip(results) {
        let name = component.variable().map_or("", |variable| variable.name);
        by_variable.entry(component.variable).or_insert((name, Vec::new())).1.push(*value);
    }
    let (mut values, mut operands) = (Vec::new(), Vec::new());
    for (name, components) in by_variable.into_values() {
        let (kind, scalar) = (VariableKind::State, Scalar::F32);
        let (name, len) = (name.to_owned(), components.len() as u32);
        values.push(Arc::new(event_value(&Variable { kind, name, scalar, len })));
        operands.extend(components);
    }
    report(linker, site, call, EventKind::Return, (values, operands), to)
}

fn report<L: Linker>(
    linker: &mut L,
    site: &Site<'_>,
    call: &ReferenceCall,
    kind: EventKind,
    (values, operands): (Vec<Arc<EventValue>>, Vec<Value>),
    to: &mut Vec<Op>,
) -> Linking<()> {
    let method = format!("{}.{}", site.class().name, call.method.name()).into();
    let event = Event { kind, method, place: None, values };
    linker.emit(to, OpKind::Report(Arc::new(event), operands), &[], false)?;
    Ok(())
}

/// The variables of a kind that a method reads and that can be recorded, in the order of its variables.
fn read(site: &Site<'_>, kind: VariableKind) -> Vec<VariableId> {
    let mut is_read = vec![false; site.function.variables.len()];
    site.function.body.for_each_op(&mut |op| {
        if let OpKind::Load(variable, _) = op.kind {
            is_read[variable.0 as usize] = true;
        }
    });
    let all = (0..).map(VariableId).zip(&site.function.variables).zip(is_read);
    let known_later = known_at_reads(site.function);
    let is_wanted = |it: &Variable| {
        let is_known_later = kind == VariableKind::Member && known_later.contains(&*it.name);
        it.kind == kind && is_recorded(&it.name, it.len) && !is_known_later
    };
    let read = all.filter(|((_, it), is_read)| *is_read && is_wanted(it));
    read.map(|((id, _), _)| id).collect()
}

/// The members that a function reports when it reads them, since they may stand for textures.
pub fn known_at_reads(function: &Function) -> BTreeSet<String> {
    let mut names = BTreeSet::new();
    function.body.for_each_op(&mut |op| {
        if let OpKind::Report(event, _) = &op.kind
            && event.kind == EventKind::Known
            && event.place.is_some()
        {
            let members = event.values.iter().filter(|it| it.scope == ValueScope::Member);
            names.extend(members.map(|value| value.name.clone()));
        }
    });
    names
}

/// True if a variable is not too large, and no table of constants of the compiler, whose name has two underscores.
pub fn is_recorded(name: &str, components: u32) -> bool {
    components as usize <= MAX_REPORTED_SCALARS && !name.contains("__")
}

/// Describes a variable in the memory of the host.
pub fn event_value(variable: &Variable) -> EventValue {
    let ty = match variable.len {
        1 => ParameterType::Scalar(variable.scalar),
        count => ParameterType::Vector(variable.scalar, count.min(u8::MAX.into()) as u8),
    };
    let scope = match variable.kind {
        VariableKind::State => ValueScope::State,
        _ => ValueScope::Member,
    };
    EventValue::new(&variable.name, ty, scope)
}
