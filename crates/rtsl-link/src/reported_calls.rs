//! Reports of calls, for traces: of those that one method makes of another, and of linked methods that are copied.

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

/// Reports the start of a method that is called through a reference, with the state and the members that it reads.
pub(crate) fn report_call<L: Linker>(
    linker: &mut L,
    site: &mut Site<'_>,
    call: &ReferenceCall,
    to: &mut Vec<Op>,
) -> Linking<()> {
    if !site.class().is_traced {
        return Ok(());
    }
    let method = name_of(site, call);
    report_start(linker, site, &method, to)
}

/// Reports the start of a linked method that is copied, as if a host called it.
pub(crate) fn report_linked_call<L: Linker>(
    linker: &mut L,
    site: &mut Site<'_>,
    to: &mut Vec<Op>,
) -> Linking<()> {
    report_start(linker, site, &site.function.name, to)
}

fn report_start<L: Linker>(
    linker: &mut L,
    site: &mut Site<'_>,
    method: &str,
    to: &mut Vec<Op>,
) -> Linking<()> {
    let reference = site.prefix.trim_end_matches('.').to_owned();
    let state = read_values(linker, site, VariableKind::State, to)?;
    report(linker, method, EventKind::Call(reference), state, to)?;
    let members = read_values(linker, site, VariableKind::Member, to)?;
    if members.values.is_empty() {
        return Ok(());
    }
    report(linker, method, EventKind::Known, members, to)
}

/// Reports the end of a method that is called through a reference, with its results.
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
    let mut reported = Reported::default();
    for (name, components) in by_variable.into_values() {
        let (kind, scalar) = (VariableKind::State, Scalar::F32);
        let (name, len) = (name.to_owned(), components.len() as u32);
        reported.add(&Variable { kind, name, scalar, len }, components);
    }
    report(linker, &name_of(site, call), EventKind::Return, reported, to)
}

/// Reports the end of a linked method that is copied, with the state that it sets.
pub(crate) fn report_linked_return<L: Linker>(
    linker: &mut L,
    site: &Site<'_>,
    to: &mut Vec<Op>,
) -> Linking<()> {
    let function = site.function;
    let mut by_variable: BTreeMap<VariableId, Vec<Value>> = BTreeMap::new();
    for (output, value) in function.outputs.iter().zip(&function.body.yields) {
        let info = function.variable(output.variable);
        if info.kind == VariableKind::State && is_recorded(&info.name, info.len) {
            by_variable.entry(output.variable).or_default().push(site.value(*value));
        }
    }
    let mut reported = Reported::default();
    for (variable, components) in by_variable {
        let len = components.len() as u32;
        reported.add(&Variable { len, ..function.variable(variable).clone() }, components);
    }
    report(linker, &function.name, EventKind::Return, reported, to)
}

/// The name of a method that is called through a reference.
fn name_of(site: &Site<'_>, call: &ReferenceCall) -> String {
    format!("{}.{}", site.class().name, call.method.name())
}

/// Values that are reported, with the scalars.
#[derive(Default)]
struct Reported {
    values: Vec<Arc<EventValue>>,
    operands: Vec<Value>,
}

impl Reported {
    fn add(&mut self, variable: &Variable, components: Vec<Value>) {
        self.values.push(Arc::new(event_value(variable)));
        self.operands.extend(components);
    }
}

/// Loads the variables of a kind that a method reads.
fn read_values<L: Linker>(
    linker: &mut L,
    site: &mut Site<'_>,
    kind: VariableKind,
    to: &mut Vec<Op>,
) -> Linking<Reported> {
    let mut reported = Reported::default();
    for variable in read(site, kind) {
        let info = site.function.variable(variable);
        let mut components = Vec::new();
        for component in 0..info.len {
            let index = Index::Constant(component);
            components.push(match kind {
                VariableKind::State => load_state(linker, site, variable, index, to)?,
                _ => load_member(linker, site, variable, index, to)?,
            });
        }
        reported.add(info, components);
    }
    Ok(reported)
}

fn report<L: Linker>(
    linker: &mut L,
    method: &str,
    kind: EventKind,
    Reported { values, operands }: Reported,
    to: &mut Vec<Op>,
) -> Linking<()> {
    let event = Event { kind, method: method.into(), place: None, values };
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
