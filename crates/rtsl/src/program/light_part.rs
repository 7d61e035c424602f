//! The members of lights in stages: those of a class share their code, and what they differ in is in arrays.

use std::collections::BTreeSet;
use std::sync::Arc;

use rtsl_abi::offsets::BUFFER_WORDS;
use rtsl_abi::{BoundBuffer, InstanceBlock, Layout};

use super::program::Program;
use super::staged_program::ParameterValues;

/// The properties that lights which share their code have in common: the addresses of programs and data.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct LightKey {
    /// The programs of the light's parts.
    pub programs: Vec<usize>,
    /// True if lights of the class have a space of their own.
    pub is_placed: bool,
    /// True if its samples have densities.
    pub is_weighed: bool,
    /// The data that hosts bind, which cannot be chosen for each path.
    pub bound: Vec<(usize, usize)>,
}

impl LightKey {
    /// Returns the key of a light whose data is in such blocks.
    pub fn new<'a>(
        programs: &[&Arc<Program>],
        is_placed: bool,
        is_weighed: bool,
        blocks: impl IntoIterator<Item = &'a InstanceBlock>,
    ) -> LightKey {
        let programs = programs.iter().map(|program| Arc::as_ptr(program).addr()).collect();
        let buffers = blocks.into_iter().flat_map(InstanceBlock::buffers);
        let bound = buffers.map(|it| (it.words.as_ptr().addr(), it.words.len())).collect();
        LightKey { programs, is_placed, is_weighed, bound }
    }
}

/// The members of a class of lights.
pub(crate) struct ClassMembers {
    /// The members in which the lights differ, or may when values change, without the path, and the scalars of these.
    pub differing: BTreeSet<(String, u32)>,
    /// The members with the path to them. Those that differ are arrays: scalar by scalar, light after light.
    pub layout: Layout,
    /// The data.
    pub block: InstanceBlock,
}

impl ClassMembers {
    /// Returns the members of lights that have this layout and this data each, and the same buffers. The names begin
    /// with `prefix`.
    pub fn new(
        prefix: &str,
        layout: &Layout,
        blocks: &[InstanceBlock],
        values: ParameterValues,
    ) -> ClassMembers {
        let (mut made, mut words) = (Layout::default(), Vec::new());
        let mut buffers = Vec::new();
        for (name, offset) in &layout.buffers {
            let own = blocks[0].buffers().iter().filter(|buffer| buffer.offset == *offset);
            let first = words.len() as u32;
            made.buffers.insert(name.clone(), first);
            buffers.extend(own.map(|it| BoundBuffer { offset: first, ..it.clone() }));
            words.resize(words.len() + BUFFER_WORDS as usize, 0);
        }
        let mut differing = BTreeSet::new();
        let starts = layout.members.values().chain(layout.buffers.values()).copied();
        let starts: BTreeSet<u32> = starts.chain([layout.block_words]).collect();
        for (name, first) in &layout.members {
            let end = starts.range(first + 1..).next().copied().unwrap_or(*first);
            let may_differ = blocks.len() > 1 && values == ParameterValues::Changing;
            let differs = |word: &u32| {
                let word = |block: &InstanceBlock| block.words()[*word as usize];
                may_differ || blocks.iter().any(|block| word(block) != word(&blocks[0]))
            };
            let differ: Vec<u32> = (*first..end).filter(differs).collect();
            made.members.insert(name.clone(), words.len() as u32);
            let of_lights = if differ.is_empty() { &blocks[..1] } else { blocks };
            for word in *first..end {
                words.extend(of_lights.iter().map(|block| block.words()[word as usize]));
            }
            let name = name.strip_prefix(prefix).unwrap_or(name);
            differing.extend(differ.iter().map(|word| (name.to_owned(), word - first)));
        }
        let block = InstanceBlock::new(&words, buffers);
        made.block_words = block.words().len() as u32;
        ClassMembers { differing, layout: made, block }
    }
}

/// True if these are the same programs, in the same order.
pub(crate) fn have_same_programs(programs: &[Arc<Program>], others: &[Arc<Program>]) -> bool {
    let mut pairs = programs.iter().zip(others);
    programs.len() == others.len() && pairs.all(|(one, other)| Arc::ptr_eq(one, other))
}
