//! The members of one of several lights of a class, of which each path has chosen its own: one body of the class's
//! methods serves all, and loads what they differ in from arrays.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

use rtsl_ir::{
    BinaryOp, CompareOp, Constant, Index, Op, OpKind, Scalar, Value, Variable, VariableKind,
};
use rtsl_link::Linking;

use crate::area_light::AreaLightLink;
use crate::arithmetic::Arithmetic;
use crate::lights::LightLink;
use crate::stage_linker::StageLinker;

/// Lights of one class, which share their methods.
#[derive(Clone, Debug)]
pub struct LightClassLink {
    /// The indices of the lights.
    pub lights: Vec<usize>,
    /// The path to their members.
    pub prefix: String,
    /// Their methods.
    pub methods: LightMethods,
    /// The members in which they differ.
    pub differing: Arc<DifferingMembers>,
}

/// The members in which lights of a class differ, by their names without the path.
#[derive(Debug, Default, PartialEq, Eq)]
pub struct DifferingMembers {
    /// Members, and scalars of these. Such a member is an array: the first scalar of light after light, then the second.
    pub scalars: BTreeSet<(String, u32)>,
    /// Buffers, with the elements of all lights, and whether some light has none. Arrays have the first word and the
    /// number of elements of each light.
    pub buffers: BTreeMap<String, bool>,
}

/// Ends the name of the array with the first words of lights in a buffer.
pub const FIRST_WORD: &str = ".rt_First";
/// Ends the name of that with their numbers of elements.
pub const ELEMENTS: &str = ".rt_Elements";

/// The methods of lights.
#[derive(Clone, Debug)]
pub enum LightMethods {
    /// Of lights without a shape.
    Shapeless(LightLink),
    /// Of shapes with emitters.
    Area(Box<AreaLightLink>),
}

impl LightClassLink {
    /// True if classes of the same programs have the same code.
    pub fn is_like(&self, other: &LightClassLink) -> bool {
        let form = |class: &LightClassLink| match &class.methods {
            LightMethods::Shapeless(light) => {
                (false, light.is_placed, light.is_weighed, light.places)
            }
            LightMethods::Area(light) => {
                (true, light.shape.is_placed, light.is_weighed, light.shape.places)
            }
        };
        form(self) == form(other)
            && (&self.lights, &self.prefix, &self.differing)
                == (&other.lights, &other.prefix, &other.differing)
    }
}

/// The lights of which each path has chosen one.
pub(crate) struct ChosenLight {
    prefix: String,
    count: u32,
    /// The index of the path's light.
    element: Value,
    differing: Arc<DifferingMembers>,
}

/// Returns the path to the members of lights, of which this is the index of the first.
pub fn light_prefix(index: usize) -> String {
    format!("light.{index}.")
}

impl ChosenLight {
    /// Returns the choice of the light with a number, if those of the class follow `first`.
    pub fn new(
        code: &mut Arithmetic<'_>,
        class: &LightClassLink,
        number: Value,
        first: u32,
    ) -> Linking<ChosenLight> {
        let (first, last) = (code.word(first)?, code.word(class.lights.len() as u32 - 1)?);
        let element = code.binary(BinaryOp::Subtract, number, first)?;
        let element = code.binary(BinaryOp::Min, element, last)?;
        let element = code.bitcast(Scalar::I32, element)?;
        Ok(ChosenLight::of(class, element))
    }

    /// Returns the choice of a light among those of its class.
    pub fn of(class: &LightClassLink, element: Value) -> ChosenLight {
        let LightClassLink { lights, prefix, differing, .. } = class;
        let (prefix, count) = (prefix.clone(), lights.len() as u32);
        ChosenLight { prefix, count, element, differing: differing.clone() }
    }

    /// Returns the index, in the array of a member, of the scalar that each path loads; `None` if the member is not an
    /// array.
    fn index_of(
        &self,
        code: &mut Arithmetic<'_>,
        member: &Variable,
        index: Index,
    ) -> Linking<Option<Index>> {
        let Some(name) = member.name.strip_prefix(&self.prefix) else { return Ok(None) };
        let scalars = (name.to_owned(), 0)..=(name.to_owned(), u32::MAX);
        if self.differing.scalars.range(scalars).next().is_none() {
            return Ok(None);
        }
        let first = match index {
            Index::Constant(scalar) => {
                let first = scalar * self.count;
                if !self.differing.scalars.contains(&(name.to_owned(), scalar)) {
                    return Ok(Some(Index::Constant(first)));
                }
                if let Some(Constant::I32(element)) = code.linker.known(self.element) {
                    return Ok(Some(Index::Constant(first + element as u32)));
                }
                code.integer(first as i32)?
            }
            Index::Dynamic(scalar) => {
                let (zero, last) = (code.integer(0)?, code.integer(member.len as i32 - 1)?);
                let scalar = code.binary(BinaryOp::Max, scalar, zero)?;
                let scalar = code.binary(BinaryOp::Min, scalar, last)?;
                let count = code.integer(self.count as i32)?;
                code.multiply(scalar, count)?
            }
        };
        Ok(Some(Index::Dynamic(code.add(first, self.element)?)))
    }

    /// Returns whether lights may lack elements of a buffer in which they differ; `None` for others.
    fn copied(&self, buffer: &Variable) -> Option<bool> {
        let name = buffer.name.strip_prefix(&self.prefix)?;
        self.differing.buffers.get(name).copied()
    }

    /// Loads what an array has for the path's light and a buffer.
    fn of_buffer(
        &self,
        code: &mut Arithmetic<'_>,
        buffer: &Variable,
        array: &str,
    ) -> Linking<Value> {
        let (kind, name) = (VariableKind::Member, format!("{}{array}", buffer.name));
        let array = Variable { kind, name, scalar: Scalar::I32, len: self.count };
        let array = code.linker.intern_variable(array);
        let index = match code.linker.known(self.element) {
            Some(Constant::I32(element)) => Index::Constant(element as u32),
            _ => Index::Dynamic(self.element),
        };
        let kind = OpKind::Load(array, index);
        Ok(code.linker.emit(code.to, kind, &[Scalar::I32], false)?.get(0))
    }

    /// Loads a scalar of a buffer, whose index is clamped to the elements of the path's light; 0 if it has none.
    fn load_element(
        &self,
        code: &mut Arithmetic<'_>,
        buffer: &Variable,
        index: Index,
    ) -> Linking<Option<Value>> {
        let Some(may_be_empty) = self.copied(buffer) else { return Ok(None) };
        let first = self.of_buffer(code, buffer, FIRST_WORD)?;
        let elements = self.of_buffer(code, buffer, ELEMENTS)?;
        let zero = code.integer(0)?;
        let within = match index {
            Index::Constant(scalar) => code.integer(scalar as i32)?,
            Index::Dynamic(index) => {
                let words = code.integer(buffer.len as i32)?;
                let (words, one) = (code.multiply(elements, words)?, code.integer(1)?);
                let last = code.binary(BinaryOp::Subtract, words, one)?;
                let index = code.binary(BinaryOp::Min, index, last)?;
                code.binary(BinaryOp::Max, index, zero)?
            }
        };
        let index = Index::Dynamic(code.add(first, within)?);
        let words = code.linker.intern_variable(buffer.clone());
        let kind = OpKind::Load(words, index);
        let loaded = code.linker.emit(code.to, kind, &[buffer.scalar], false)?.get(0);
        if !may_be_empty {
            return Ok(Some(loaded));
        }
        let has_any = code.compare(CompareOp::Greater, elements, zero)?;
        let nothing = code.linker.constant(code.to, Constant::zero(buffer.scalar))?;
        Ok(Some(code.select(has_any, loaded, nothing)?))
    }
}

impl StageLinker {
    /// Returns the number of elements in a buffer of the light that each path has chosen; `None` for buffers that lights
    /// share, and those of others.
    pub(crate) fn length_of_chosen(
        &mut self,
        buffer: &Variable,
        to: &mut Vec<Op>,
    ) -> Linking<Option<Value>> {
        let Some(choice) = self.chosen_light.clone() else { return Ok(None) };
        let is_copied = choice.copied(buffer).is_some();
        let code = &mut Arithmetic { linker: self, to };
        is_copied.then(|| choice.of_buffer(code, buffer, ELEMENTS)).transpose()
    }

    /// Loads a scalar of a member or a buffer of the light that each path has chosen; `None` for what lights share, and
    /// that of others.
    pub(crate) fn load_chosen(
        &mut self,
        member: &Variable,
        index: Index,
        to: &mut Vec<Op>,
    ) -> Linking<Option<Value>> {
        let Some(choice) = self.chosen_light.clone() else { return Ok(None) };
        if member.kind == VariableKind::Buffer {
            return choice.load_element(&mut Arithmetic { linker: self, to }, member, index);
        }
        let code = &mut Arithmetic { linker: &mut *self, to: &mut *to };
        let Some(index) = choice.index_of(code, member, index)? else { return Ok(None) };
        let (scalar, len) = (member.scalar, member.len * choice.count);
        let array = self.intern_variable(Variable { len, ..member.clone() });
        Ok(Some(self.emit(to, OpKind::Load(array, index), &[scalar], false)?.get(0)))
    }
}
