//! Calls through references, which the bodies of the called methods replace.

use rtsl_ir::class::Reference;
use rtsl_ir::{
    CompareOp, Constant, Index, Op, OpKind, ReferenceCall, ReferencePath, Region, Scalar,
    StateComponent, Value, Variable, VariableKind,
};
use rtsl_spec::{Default as StateDefault, Direction, Role, lookup_state, state_variables};

use crate::class_tree::{ClassTree, element_path};
use crate::draft::Linking;
use crate::linker::{Linker, takes_derivatives};
use crate::reported_calls::{report_call, report_return};
use crate::site::{Site, find_override};

/// Adds the operations for one element of an array of references and returns their results.
type ElementBody<'a, L> = dyn FnMut(&mut L, usize, &mut Vec<Op>) -> Linking<Vec<Value>> + 'a;

/// Returns whether a reference is set.
pub(crate) fn is_set<L: Linker>(
    linker: &mut L,
    site: &Site<'_>,
    member: &str,
    path: ReferencePath,
    to: &mut Vec<Op>,
) -> Linking<Value> {
    let (_, elements) = find_reference(site, member);
    let mut element = |linker: &mut L, index: usize, to: &mut Vec<Op>| {
        let is_set = elements.get(index).is_some_and(Option::is_some);
        Ok(vec![linker.constant(to, Constant::Bool(is_set))?])
    };
    let chosen = match path {
        ReferencePath::Single => element(linker, 0, to)?,
        ReferencePath::Element(index) => {
            let choice = Choice { index: site.value(index), results: &[Scalar::Bool] };
            choose(linker, &choice, 0..elements.len(), &mut element, to)?
        }
    };
    Ok(chosen[0])
}

/// Returns the results of a call through a reference.
pub(crate) fn reference_call<L: Linker>(
    linker: &mut L,
    site: &Site<'_>,
    call: &ReferenceCall,
    to: &mut Vec<Op>,
) -> Linking<Vec<Value>> {
    let (reference, elements) = find_reference(site, &call.member);
    let mut overrides = site.overrides.clone();
    for (component, value) in &call.overrides {
        overrides.retain(|(other, _)| other != component);
        overrides.push((*component, site.value(*value)));
    }
    let mut element = |linker: &mut L, index: usize, to: &mut Vec<Op>| {
        let path = reference.map_or_else(String::new, |it| element_path(it, index));
        match elements.get(index).and_then(Option::as_ref) {
            Some(tree) => {
                let prefix = format!("{}{path}.", site.prefix);
                inline(linker, tree, prefix, call, &overrides, to)
            }
            None => {
                // An array without elements has none that is unset.
                let is_element = index < elements.len();
                if reference.is_some_and(|reference| is_element && !reference.tested) {
                    let path = format!("{}{path}", site.prefix);
                    linker.warnings.insert((site.class().name.clone(), path));
                }
                defaults(linker, call, &overrides, to)
            }
        }
    };
    match call.path {
        ReferencePath::Single => element(linker, 0, to),
        ReferencePath::Element(index) => {
            let results = vec![Scalar::F32; call.results.len()];
            let choice = Choice { index: site.value(index), results: &results };
            choose(linker, &choice, 0..elements.len(), &mut element, to)
        }
    }
}

/// Copies the body of the called method.
fn inline<L: Linker>(
    linker: &mut L,
    tree: &ClassTree,
    prefix: String,
    call: &ReferenceCall,
    overrides: &[(StateComponent, Value)],
    to: &mut Vec<Op>,
) -> Linking<Vec<Value>> {
    let class = &tree.class;
    let differentiable = class.differentiable.get(&call.method);
    let differentiable = differentiable.filter(|_| linker.takes_derivatives);
    let Some(function) = differentiable.or_else(|| class.methods.get(&call.method)) else {
        return defaults(linker, call, overrides, to);
    };
    let mut site = Site::new(Some(tree), function, prefix, &mut linker.out);
    site.overrides = overrides.to_vec();
    linker.begin_copy(&mut site, to)?;
    report_call(linker, &mut site, call, to)?;
    let takes_derivatives = linker.takes_derivatives || takes_derivatives(function);
    let outer = std::mem::replace(&mut linker.takes_derivatives, takes_derivatives);
    let copied = linker.nested(|linker| linker.copy_ops(&mut site, &function.body.ops, to));
    linker.takes_derivatives = outer;
    copied?;
    linker.keep_called_scratch(&site, to)?;
    let result = |linker: &mut L, wanted: &StateComponent, to: &mut Vec<Op>| {
        let output = function.outputs.iter().position(|output| {
            let variable = function.variable(output.variable);
            let state = lookup_state(&variable.name).map(|state| state.index);
            variable.kind == VariableKind::State
                && state == Some(wanted.variable)
                && output.component == wanted.component
        });
        match output {
            Some(index) => Ok(site.value(function.body.yields[index])),
            None => default(linker, call, overrides, *wanted, to),
        }
    };
    let results = call.results.iter().map(|wanted| result(linker, wanted, to));
    let results = results.collect::<Linking<Vec<Value>>>()?;
    report_return(linker, &site, call, &results, to)?;
    Ok(results)
}

/// Returns the results of a call of an unset reference, or of a method that the class lacks.
fn defaults<L: Linker>(
    linker: &mut L,
    call: &ReferenceCall,
    overrides: &[(StateComponent, Value)],
    to: &mut Vec<Op>,
) -> Linking<Vec<Value>> {
    call.results.iter().map(|wanted| default(linker, call, overrides, *wanted, to)).collect()
}

/// Returns a result that no method sets: its default or, if the method also receives it, what it received.
fn default<L: Linker>(
    linker: &mut L,
    call: &ReferenceCall,
    overrides: &[(StateComponent, Value)],
    wanted: StateComponent,
    to: &mut Vec<Op>,
) -> Linking<Value> {
    let row = wanted.variable().and_then(|variable| call.role.row(variable.name));
    let is_received = row.and_then(|row| row.direction(call.method)) == Some(Direction::InOut);
    if !is_received {
        return linker.constant(to, default_of(call.role, wanted));
    }
    match (find_override(overrides, wanted), wanted.variable()) {
        (None, Some(variable)) => {
            let received = Variable {
                kind: VariableKind::State,
                name: variable.name.to_owned(),
                scalar: Scalar::F32,
                len: variable.ty.components(),
            };
            let received = linker.intern_variable(received);
            let load = OpKind::Load(received, Index::Constant(wanted.component));
            Ok(linker.emit(to, load, &[Scalar::F32], false)?.get(0))
        }
        (Some(value), _) => Ok(value),
        (None, None) => linker.constant(to, Constant::F32(0.0)),
    }
}

/// Calls `element` for each index of `range` and makes comparisons that select one by the clamped index: each
/// halves the range.
fn choose<L: Linker>(
    linker: &mut L,
    choice: &Choice<'_>,
    range: std::ops::Range<usize>,
    element: &mut ElementBody<'_, L>,
    to: &mut Vec<Op>,
) -> Linking<Vec<Value>> {
    if range.len() <= 1 {
        return element(linker, range.start, to);
    }
    let middle = range.start + range.len() / 2;
    let bound = linker.constant(to, Constant::I32(i32::try_from(middle).unwrap_or(i32::MAX)))?;
    let kind = OpKind::Compare(CompareOp::Less, choice.index, bound);
    let condition = linker.emit(to, kind, &[Scalar::Bool], false)?.get(0);
    let mut half = |linker: &mut L, range| {
        linker.nested(|linker| {
            let mut region = Region::default();
            region.yields = choose(linker, choice, range, element, &mut region.ops)?;
            Ok(region)
        })
    };
    let then = half(linker, range.start..middle)?;
    let otherwise = half(linker, middle..range.end)?;
    let kind = OpKind::If { condition, then, otherwise };
    Ok(linker.emit(to, kind, choice.results, false)?.iter().collect())
}

/// An index that selects, clamped, one of several bodies with these results.
struct Choice<'a> {
    index: Value,
    results: &'a [Scalar],
}

/// Returns a reference of the class of a site, with its elements.
pub(crate) fn find_reference<'a>(
    site: &Site<'a>,
    member: &str,
) -> (Option<&'a Reference>, &'a [Option<ClassTree>]) {
    let find = |tree: &'a ClassTree| {
        let index = tree.class.references.iter().position(|it| it.name == member)?;
        Some((tree.class.references.get(index), &*tree.references[index]))
    };
    site.tree.and_then(find).unwrap_or_default()
}

/// Returns the value of an output that its method leaves unset. If the default is another variable's value it is zero,
/// as that of the other variable is.
pub fn default_of(role: Role, wanted: StateComponent) -> Constant {
    let variable = state_variables().get(wanted.variable as usize);
    let default = variable.and_then(|variable| role.row(variable.name)).map(|row| row.default);
    Constant::F32(match default {
        Some(StateDefault::Constant(value)) => value,
        Some(StateDefault::Components(values)) => {
            values.get(wanted.component as usize).copied().unwrap_or(0.0)
        }
        Some(
            StateDefault::Variable(_)
            | StateDefault::Grey(_)
            | StateDefault::Luminance(_)
            | StateDefault::Tangent(_),
        )
        | None => 0.0,
    })
}
