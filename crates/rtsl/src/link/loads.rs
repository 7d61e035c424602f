//! Loads of variables of a copied method that are not copied as they are: of state that differs from the call's, of
//! scratch that is not in memory, of members and buffers of the chosen light or object.

use rtsl_ir::{
    CompareOp, Constant, Index, Op, OpKind, Scalar, StateComponent, Value, Variable, VariableId,
    VariableKind,
};
use rtsl_spec::lookup_state;

use super::linker::{Linker, Linking, Site, find_override, index_of_site};

impl Linker {
    /// True if the loads of a variable of a method are not copied as they are.
    pub(super) fn replaces_loads(&self, site: &Site<'_>, variable: VariableId) -> bool {
        match site.function.variable(variable).kind {
            VariableKind::State => !site.overrides.is_empty(),
            VariableKind::Scratch => {
                self.scratch.is_some() || self.called_scratch_of(site, variable).is_some()
            }
            VariableKind::Member => {
                self.chosen_light.is_some()
                    || self.element.is_some()
                    || !site.tree.class.attributes.is_empty()
            }
            VariableKind::Buffer => self.chosen_light.is_some(),
            _ => false,
        }
    }

    /// Returns what such a load gives.
    pub(super) fn replaced_load(
        &mut self,
        site: &mut Site<'_>,
        variable: VariableId,
        index: Index,
        to: &mut Vec<Op>,
    ) -> Linking<Value> {
        match site.function.variable(variable).kind {
            VariableKind::State => self.load_state(site, variable, index, to),
            VariableKind::Scratch => self.load_scratch(site, variable, index, to),
            VariableKind::Buffer => {
                self.load_of_light(site, variable, index_of_site(site, index), to)
            }
            _ => self.load_member(site, variable, index, to),
        }
    }

    /// Loads a state component as a callee sees it.
    pub(super) fn load_state(
        &mut self,
        site: &mut Site<'_>,
        variable: VariableId,
        index: Index,
        to: &mut Vec<Op>,
    ) -> Linking<Value> {
        let info = site.function.variable(variable);
        let state = lookup_state(&info.name).map(|state| state.index);
        let len = info.len;
        let wanted = |component| state.map(|variable| StateComponent { variable, component });
        let new = self.variable(site, variable);
        let overrides = &site.overrides;
        let load = |linker: &mut Self, to: &mut Vec<Op>, component: u32| match wanted(component)
            .and_then(|wanted| find_override(overrides, wanted))
        {
            Some(value) => Ok(value),
            None => {
                let kind = OpKind::Load(new, Index::Constant(component));
                Ok(linker.emit(to, kind, &[Scalar::F32], false)?.get(0))
            }
        };
        let index = index_of_site(site, index);
        self.load_component(index, len, Scalar::F32, load, to)
    }

    /// Loads a scalar of a member, that of the chosen light or object.
    pub(super) fn load_member(
        &mut self,
        site: &mut Site<'_>,
        variable: VariableId,
        index: Index,
        to: &mut Vec<Op>,
    ) -> Linking<Value> {
        let index = index_of_site(site, index);
        let info = site.function.variable(variable);
        if let Some(attribute) = self.load_attribute(site, info, index, to)? {
            return Ok(attribute);
        }
        if self.element.is_some() {
            let member = Variable { name: site.name_of(info), ..info.clone() };
            return self.load_of_element(self.element, member, index, to);
        }
        self.load_of_light(site, variable, index, to)
    }

    /// Loads a scalar of a member or of a buffer, that of the chosen light.
    fn load_of_light(
        &mut self,
        site: &mut Site<'_>,
        variable: VariableId,
        index: Index,
        to: &mut Vec<Op>,
    ) -> Linking<Value> {
        let info = site.function.variable(variable);
        let named = Variable { name: site.name_of(info), ..info.clone() };
        if let Some(chosen) = self.load_chosen(&named, index, to)? {
            return Ok(chosen);
        }
        let new = self.variable(site, variable);
        Ok(self.emit(to, OpKind::Load(new, index), &[named.scalar], false)?.get(0))
    }

    /// Returns a scalar of scratch that is not in memory.
    fn load_scratch(
        &mut self,
        site: &mut Site<'_>,
        variable: VariableId,
        index: Index,
        to: &mut Vec<Op>,
    ) -> Linking<Value> {
        let info = site.function.variable(variable);
        let (scalar, len) = (info.scalar, info.len);
        if let Some(local) = self.called_scratch_of(site, variable) {
            let index = index_of_site(site, index);
            return Ok(self.emit(to, OpKind::Load(local, index), &[scalar], false)?.get(0));
        }
        let name = site.name_of(info);
        let load = |linker: &mut Self, to: &mut Vec<Op>, component: u32| {
            let mut set = linker.scratch.iter().flatten().rev();
            match set.find(|((set, at), _)| *set == name && *at == component) {
                Some((_, value)) => Ok(*value),
                None => linker.constant(to, Constant::from_bits(scalar, 0)),
            }
        };
        let index = index_of_site(site, index);
        self.load_component(index, len, scalar, load, to)
    }

    /// Loads the component that an index selects, clamped.
    pub fn load_component(
        &mut self,
        index: Index,
        len: u32,
        scalar: Scalar,
        load: impl Fn(&mut Self, &mut Vec<Op>, u32) -> Linking<Value>,
        to: &mut Vec<Op>,
    ) -> Linking<Value> {
        let index = match index {
            Index::Constant(component) => return load(self, to, component),
            Index::Dynamic(index) => index,
        };
        let mut chosen = load(self, to, len - 1)?;
        for component in (0..len - 1).rev() {
            let value = load(self, to, component)?;
            let bound = self.constant(to, Constant::I32(component as i32))?;
            let kind = OpKind::Compare(CompareOp::LessEqual, index, bound);
            let is_it = self.emit(to, kind, &[Scalar::Bool], false)?.get(0);
            let kind = OpKind::Select(is_it, value, chosen);
            chosen = self.emit(to, kind, &[scalar], false)?.get(0);
        }
        Ok(chosen)
    }
}
