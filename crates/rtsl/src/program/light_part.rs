//! The members of lights in stages, and the classes of lights that share their code.

use std::collections::BTreeSet;
use std::sync::Arc;

use rtsl_abi::{InstanceBlock, Layout};

use super::program::Program;
use super::staged_program::ParameterValues;
use crate::link::chosen_light::LightClassLink;

/// A light's part of the members of stages.
pub(crate) struct LightPart {
    /// The path to its members.
    pub prefix: String,
    /// The programs of its parts.
    pub programs: Vec<Arc<Program>>,
    /// True if lights of its class have a space of their own.
    pub is_placed: bool,
    /// True if its samples have densities.
    pub is_weighed: bool,
    /// The members with the path to them.
    pub layout: Layout,
    /// The data.
    pub block: InstanceBlock,
}

impl LightPart {
    /// True if the methods of lights are the same. Data that hosts bind cannot be chosen for each path.
    fn is_of_class(&self, other: &LightPart) -> bool {
        let has_code_of = |other: &LightPart| {
            have_same_programs(&self.programs, &other.programs)
                && (self.is_placed, self.is_weighed) == (other.is_placed, other.is_weighed)
        };
        has_code_of(other) && self.layout.buffers.is_empty()
    }

    /// Adds the scalars of members in which another light of the class differs, or may differ when values change,
    /// without the paths to the lights.
    fn add_differing(
        &self,
        other: &LightPart,
        values: ParameterValues,
        differing: &mut BTreeSet<(String, u32)>,
    ) {
        let (words, others) = (self.block.words(), other.block.words());
        let mut members: Vec<(u32, &str)> =
            self.layout.members.iter().map(|(name, word)| (*word, name.as_str())).collect();
        members.sort_unstable();
        let ends = members.iter().skip(1).map(|(word, _)| *word).chain([self.layout.block_words]);
        for ((first, name), end) in members.iter().zip(ends) {
            let name = name.strip_prefix(&self.prefix).unwrap_or(name);
            let differ = (*first..end).filter(|word| {
                let word = *word as usize;
                values == ParameterValues::Changing || words[word] != others[word]
            });
            differing.extend(differ.map(|word| (name.to_owned(), word - first)));
        }
    }
}

/// True if these are the same programs, in the same order.
pub(crate) fn have_same_programs(programs: &[Arc<Program>], others: &[Arc<Program>]) -> bool {
    let mut pairs = programs.iter().zip(others);
    programs.len() == others.len() && pairs.all(|(one, other)| Arc::ptr_eq(one, other))
}

/// Returns the classes of the lights with these indices, which have such values.
pub(crate) fn light_classes(
    parts: &[LightPart],
    lights: &[usize],
    values: ParameterValues,
) -> Vec<LightClassLink> {
    let mut classes: Vec<Vec<usize>> = Vec::new();
    for light in lights {
        let is_of_class = |class: &&mut Vec<usize>| parts[class[0]].is_of_class(&parts[*light]);
        match classes.iter_mut().find(is_of_class) {
            Some(class) => class.push(*light),
            None => classes.push(vec![*light]),
        }
    }
    let linked = classes.into_iter().map(|lights| {
        let mut differing = BTreeSet::new();
        for other in &lights[1..] {
            parts[lights[0]].add_differing(&parts[*other], values, &mut differing);
        }
        LightClassLink { lights, differing: Arc::new(differing) }
    });
    linked.collect()
}
