//! The members of one of several lights of a class, of which each path has chosen its own: one body of the class's
//! methods serves all.

use std::collections::BTreeSet;
use std::sync::Arc;

use rtsl_ir::{CompareOp, Index, Op, OpKind, Value, Variable};

use super::arithmetic::Arithmetic;
use super::linker::{Linker, Linking};

/// Lights of one class, which share their methods.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct LightClassLink {
    /// The indices of the lights.
    pub lights: Vec<usize>,
    /// The members in which they differ, by their names without the path to the light, and the scalars of these.
    pub differing: Arc<BTreeSet<(String, u32)>>,
}

/// The lights of which each path has chosen one.
pub(super) struct ChosenLight {
    /// The paths to the lights' members. Methods are copied for the first.
    prefixes: Vec<String>,
    /// For each light but the first, true for paths that have chosen it or a later one.
    is_from: Vec<Value>,
    differing: Arc<BTreeSet<(String, u32)>>,
}

/// Returns the path to a light's members.
pub(crate) fn light_prefix(index: usize) -> String {
    format!("light.{index}.")
}

impl ChosenLight {
    /// Returns the choice of the lights of a class, whose numbers follow `first`.
    pub fn new(
        code: &mut Arithmetic<'_>,
        class: &LightClassLink,
        (chosen, first): (Value, u32),
    ) -> Linking<ChosenLight> {
        let mut is_from = Vec::new();
        for number in 1..class.lights.len() as u32 {
            let number = code.word(first + number)?;
            is_from.push(code.compare(CompareOp::GreaterEqual, chosen, number)?);
        }
        let prefixes = class.lights.iter().map(|light| light_prefix(*light)).collect();
        Ok(ChosenLight { prefixes, is_from, differing: class.differing.clone() })
    }

    /// Returns the name of a member without the path to the light, if the lights differ in this scalar of it.
    fn differing<'a>(&self, name: &'a str, index: Index) -> Option<&'a str> {
        let rest = name.strip_prefix(&self.prefixes[0])?;
        let scalars = match index {
            Index::Constant(scalar) => scalar..=scalar,
            Index::Dynamic(_) => 0..=u32::MAX,
        };
        let (first, last) = (*scalars.start(), *scalars.end());
        let range = (rest.to_owned(), first)..=(rest.to_owned(), last);
        self.differing.range(range).next().map(|_| rest)
    }
}

impl Linker {
    /// Loads a scalar of a member of the light that each path has chosen; `None` for other members, and those that
    /// lights share.
    pub(super) fn load_chosen(
        &mut self,
        member: &Variable,
        index: Index,
        to: &mut Vec<Op>,
    ) -> Linking<Option<Value>> {
        let Some(choice) = self.chosen_light.clone() else { return Ok(None) };
        let Some(rest) = choice.differing(&member.name, index) else { return Ok(None) };
        let mut chosen = None;
        for (light, prefix) in choice.prefixes.iter().enumerate() {
            let member = Variable { name: format!("{prefix}{rest}"), ..member.clone() };
            let scalar = member.scalar;
            let variable = self.intern_variable(member);
            let own = self.emit(to, OpKind::Load(variable, index), &[scalar], false)?.get(0);
            chosen = Some(match chosen {
                None => own,
                Some(earlier) => {
                    let kind = OpKind::Select(choice.is_from[light - 1], own, earlier);
                    self.emit(to, kind, &[scalar], false)?.get(0)
                }
            });
        }
        Ok(chosen)
    }
}
