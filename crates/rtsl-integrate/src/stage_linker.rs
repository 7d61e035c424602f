//! The linker of stages: it answers what a stage asks, and binds the members of lights and objects of which each path
//! has its own.

use std::collections::BTreeMap;
use std::ops::{Deref, DerefMut};
use std::sync::Arc;

use rtsl_ir::{Constant, Index, Op, OpKind, Value, Variable, VariableId, VariableKind};
use rtsl_link::{Draft, Linker, Linking, Site};

use crate::chosen_light::ChosenLight;
use crate::search::ArrayElement;
use crate::sequences::CopiedNumbers;
use crate::shade_call::ShadeCall;
use crate::stage::SurfaceLinks;

/// Links the stages of a method, and whatever else copies methods of cameras, shapes, materials and lights.
#[derive(Default)]
pub(crate) struct StageLinker {
    draft: Draft,
    /// The methods that answer the queries of a stage.
    pub surface: Option<Arc<SurfaceLinks>>,
    /// The properties of surfaces that are computed already where operations are added, by their operands.
    pub known_properties: Vec<(Vec<Value>, Vec<Value>)>,
    /// The random numbers of the method that is being copied, if operations compute them.
    pub copied_numbers: Option<CopiedNumbers>,
    /// True while a method is copied that has no random numbers: all are 0.
    pub draws_zeros: bool,
    /// The locals with the values of a path that pass from stage to stage, by their scratch arrays.
    pub passed_values: BTreeMap<&'static str, VariableId>,
    /// The light whose methods are being copied, if each path has chosen one.
    pub chosen_light: Option<Arc<ChosenLight>>,
    /// The object whose method is being copied, if it is one of several with the same code.
    pub element: Option<ArrayElement>,
    /// The call of a method that shades a surface whose body is being copied into a stage of an integrator.
    pub shade_call: Option<ShadeCall>,
    /// The local with the contribution of a stage.
    pub contribution: Option<VariableId>,
}

impl StageLinker {
    /// Begins a function of this name.
    pub fn new(name: impl Into<String>) -> StageLinker {
        StageLinker { draft: Draft::new(name), ..StageLinker::default() }
    }
}

impl Linker for StageLinker {
    fn answer(
        &mut self,
        site: &Site<'_>,
        op: &Op,
        to: &mut Vec<Op>,
    ) -> Linking<Option<Vec<Value>>> {
        if op.kind == OpKind::Rand && self.draws_zeros {
            return Ok(Some(vec![self.constant(to, Constant::F32(0.0))?]));
        }
        self.answer_stage(site, op, to)
    }

    fn binds(&self, kind: VariableKind) -> bool {
        let is_of_element = kind == VariableKind::Member && self.element.is_some();
        self.chosen_light.is_some() || is_of_element
    }

    fn load_bound(
        &mut self,
        variable: &Variable,
        index: Index,
        to: &mut Vec<Op>,
    ) -> Linking<Option<Value>> {
        match self.element.filter(|_| variable.kind == VariableKind::Member) {
            Some(element) => self.load_of_element(element, variable, index, to).map(Some),
            None => self.load_chosen(variable, index, to),
        }
    }

    fn length_of_bound(&mut self, buffer: &Variable, to: &mut Vec<Op>) -> Linking<Option<Value>> {
        self.length_of_chosen(buffer, to)
    }

    fn nested<T>(&mut self, work: impl FnOnce(&mut Self) -> Linking<T>) -> Linking<T> {
        self.enter()?;
        // What a region computes is not known after it.
        let known = self.known_properties.len();
        let result = work(self);
        self.known_properties.truncate(known);
        self.leave();
        result
    }
}

impl Deref for StageLinker {
    type Target = Draft;

    fn deref(&self) -> &Draft {
        &self.draft
    }
}

impl DerefMut for StageLinker {
    fn deref_mut(&mut self) -> &mut Draft {
        &mut self.draft
    }
}
