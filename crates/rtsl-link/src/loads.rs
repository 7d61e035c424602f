//! Loads of variables of a copied method that are not copied as they are: of state that differs from the call's, of
//! scratch that is not in memory, of members and buffers that are bound to other data.

use rtsl_ir::{
    CompareOp, Constant, Index, Op, OpKind, Scalar, StateComponent, Value, Variable, VariableId,
    VariableKind,
};
use rtsl_spec::lookup_state;

use crate::attributes::load_attribute;
use crate::draft::Linking;
use crate::linker::Linker;
use crate::site::{Site, find_override};

/// True if the loads of a variable of a method are not copied as they are.
pub(crate) fn are_replaced<L: Linker>(linker: &L, site: &Site<'_>, variable: VariableId) -> bool {
    match site.function.variable(variable).kind {
        VariableKind::State => !site.overrides.is_empty(),
        VariableKind::Scratch => {
            linker.scratch.is_some() || linker.called_scratch_of(site, variable).is_some()
        }
        VariableKind::Member => {
            linker.binds(VariableKind::Member)
                || site.tree.is_some_and(|tree| !tree.class.attributes.is_empty())
        }
        VariableKind::Buffer => linker.binds(VariableKind::Buffer),
        _ => false,
    }
}

/// Returns what such a load gives.
pub(crate) fn replaced<L: Linker>(
    linker: &mut L,
    site: &mut Site<'_>,
    variable: VariableId,
    index: Index,
    to: &mut Vec<Op>,
) -> Linking<Value> {
    match site.function.variable(variable).kind {
        VariableKind::State => load_state(linker, site, variable, index, to),
        VariableKind::Scratch => load_scratch(linker, site, variable, index, to),
        VariableKind::Buffer => load_own_or_bound(linker, site, variable, site.index(index), to),
        _ => load_member(linker, site, variable, index, to),
    }
}

/// Loads a state component as a callee sees it.
pub(crate) fn load_state<L: Linker>(
    linker: &mut L,
    site: &mut Site<'_>,
    variable: VariableId,
    index: Index,
    to: &mut Vec<Op>,
) -> Linking<Value> {
    let info = site.function.variable(variable);
    let state = lookup_state(&info.name).map(|state| state.index);
    let len = info.len;
    let wanted = |component| state.map(|variable| StateComponent { variable, component });
    let own = linker.variable(site, variable);
    let overrides = &site.overrides;
    let load = |linker: &mut L, to: &mut Vec<Op>, component: u32| match wanted(component)
        .and_then(|wanted| find_override(overrides, wanted))
    {
        Some(value) => Ok(value),
        None => {
            let kind = OpKind::Load(own, Index::Constant(component));
            Ok(linker.emit(to, kind, &[Scalar::F32], false)?.get(0))
        }
    };
    let index = site.index(index);
    load_component(linker, index, len, Scalar::F32, load, to)
}

/// Loads a scalar of a member, that of the chosen light or object.
pub(crate) fn load_member<L: Linker>(
    linker: &mut L,
    site: &mut Site<'_>,
    variable: VariableId,
    index: Index,
    to: &mut Vec<Op>,
) -> Linking<Value> {
    let index = site.index(index);
    let info = site.function.variable(variable);
    if let Some(attribute) = load_attribute(linker, site, info, index, to)? {
        return Ok(attribute);
    }
    load_own_or_bound(linker, site, variable, index, to)
}

/// Loads a scalar of a member or of a buffer, from the data to which it is bound.
fn load_own_or_bound<L: Linker>(
    linker: &mut L,
    site: &mut Site<'_>,
    variable: VariableId,
    index: Index,
    to: &mut Vec<Op>,
) -> Linking<Value> {
    if let Some(bound) = linker.load_bound(&named(site, variable), index, to)? {
        return Ok(bound);
    }
    let own = linker.variable(site, variable);
    linker.load(own, index, to)
}

/// Returns a scalar of scratch that is not in memory.
fn load_scratch<L: Linker>(
    linker: &mut L,
    site: &mut Site<'_>,
    variable: VariableId,
    index: Index,
    to: &mut Vec<Op>,
) -> Linking<Value> {
    let info = site.function.variable(variable);
    let (scalar, len) = (info.scalar, info.len);
    if let Some(local) = linker.called_scratch_of(site, variable) {
        let index = site.index(index);
        return Ok(linker.emit(to, OpKind::Load(local, index), &[scalar], false)?.get(0));
    }
    let name = site.name_of(info);
    let load = |linker: &mut L, to: &mut Vec<Op>, component: u32| {
        let mut set = linker.scratch.iter().flatten().rev();
        match set.find(|((set, at), _)| *set == name && *at == component) {
            Some((_, value)) => Ok(*value),
            None => linker.constant(to, Constant::from_bits(scalar, 0)),
        }
    };
    let index = site.index(index);
    load_component(linker, index, len, scalar, load, to)
}

/// Loads the component that an index selects, clamped: each by `load`.
///
/// # Errors
/// Those of `load`, and if the function becomes too large.
pub fn load_component<L: Linker>(
    linker: &mut L,
    index: Index,
    len: u32,
    scalar: Scalar,
    load: impl Fn(&mut L, &mut Vec<Op>, u32) -> Linking<Value>,
    to: &mut Vec<Op>,
) -> Linking<Value> {
    let index = match index {
        Index::Constant(component) => return load(linker, to, component),
        Index::Dynamic(index) => index,
    };
    let mut chosen = load(linker, to, len - 1)?;
    for component in (0..len - 1).rev() {
        let value = load(linker, to, component)?;
        let bound = linker.constant(to, Constant::I32(component as i32))?;
        let kind = OpKind::Compare(CompareOp::LessEqual, index, bound);
        let is_it = linker.emit(to, kind, &[Scalar::Bool], false)?.get(0);
        let kind = OpKind::Select(is_it, value, chosen);
        chosen = linker.emit(to, kind, &[scalar], false)?.get(0);
    }
    Ok(chosen)
}

/// Returns a variable of a site with its name in the draft.
pub(crate) fn named(site: &Site<'_>, variable: VariableId) -> Variable {
    let variable = site.function.variable(variable);
    Variable { name: site.name_of(variable), ..variable.clone() }
}
