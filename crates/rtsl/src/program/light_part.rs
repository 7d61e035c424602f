//! The members of lights in stages: those of a class share their code, and what they differ in is in arrays.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

use rtsl_abi::offsets::BUFFER_WORDS;
use rtsl_abi::{BoundBuffer, InstanceBlock, Layout};
use rtsl_integrate::chosen_light::{DifferingMembers, ELEMENTS, FIRST_WORD};

use super::program::Program;
use super::staged_program::ParameterValues;

/// The greatest number of words of buffers in which lights of a class differ that are copied, each to one for all of
/// them: 64 MB. Lights with more, such as large images, are apart.
const MAX_COPIED_WORDS: usize = 1 << 24;

/// The properties that lights which share their code have in common: the addresses of programs and of large data.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct LightKey {
    /// The programs of the light's parts.
    pub programs: Vec<usize>,
    /// True if lights of the class have a space of their own.
    pub is_placed: bool,
    /// True if its samples have densities.
    pub is_weighed: bool,
    /// True if an instance places its group.
    pub is_grouped: bool,
    /// The buffers, if they are not copied.
    pub bound: Vec<(usize, usize)>,
}

impl LightKey {
    /// Returns the key of a light in the world whose buffers are copied.
    pub fn new(programs: &[&Arc<Program>], is_placed: bool, is_weighed: bool) -> LightKey {
        let programs = programs.iter().map(|program| Arc::as_ptr(program).addr()).collect();
        LightKey { programs, is_placed, is_weighed, is_grouped: false, bound: Vec::new() }
    }
}

/// Returns the addresses and the lengths of a block's buffers.
pub(crate) fn bound_buffers(block: &InstanceBlock) -> Vec<(usize, usize)> {
    block.buffers().iter().map(|it| (it.words.as_ptr().addr(), it.words.len())).collect()
}

/// True if the buffers of lights are copied, of which these are [the addresses and the lengths](bound_buffers), unless
/// all lights have the same.
pub(crate) fn are_copied<'a>(buffers: impl Iterator<Item = &'a [(usize, usize)]>) -> bool {
    let distinct: BTreeMap<usize, usize> = buffers.flatten().copied().collect();
    distinct.values().sum::<usize>() <= MAX_COPIED_WORDS
}

/// The members of a class of lights.
pub(crate) struct ClassMembers {
    /// The members in which the lights differ, or may when values change.
    pub differing: DifferingMembers,
    /// The members with the path to them. Those that differ are arrays: scalar by scalar, light after light.
    pub layout: Layout,
    /// The data.
    pub block: InstanceBlock,
}

impl ClassMembers {
    /// Returns the members of lights that have this layout and this data each. The names begin with `prefix`.
    pub fn new(
        prefix: &str,
        layout: &Layout,
        blocks: &[InstanceBlock],
        values: ParameterValues,
    ) -> ClassMembers {
        let (mut made, mut words) = (Layout::default(), Vec::new());
        let (mut buffers, mut arrays) = (Vec::new(), Vec::new());
        let mut differing = DifferingMembers::default();
        let without_path = |name: &str| name.strip_prefix(prefix).unwrap_or(name).to_owned();
        for (name, offset) in &layout.buffers {
            let first = words.len() as u32;
            made.buffers.insert(name.clone(), first);
            words.resize(words.len() + BUFFER_WORDS as usize, 0);
            let CommonBuffer { buffer, parts } = CommonBuffer::new(*offset, blocks);
            buffers.extend(buffer.map(|it| BoundBuffer { offset: first, ..it }));
            if let Some(parts) = parts {
                let may_be_empty = parts.iter().any(|part| part.1 == 0);
                differing.buffers.insert(without_path(name), may_be_empty);
                let (firsts, elements): (Vec<u32>, Vec<u32>) = parts.into_iter().unzip();
                arrays.extend([
                    (format!("{name}{FIRST_WORD}"), firsts),
                    (format!("{name}{ELEMENTS}"), elements),
                ]);
            }
        }
        for (name, of_lights) in arrays {
            made.members.insert(name, words.len() as u32);
            words.extend(of_lights);
        }
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
            let name = without_path(name);
            differing.scalars.extend(differ.iter().map(|word| (name.clone(), word - first)));
        }
        let block = InstanceBlock::new(&words, buffers);
        made.block_words = block.words().len() as u32;
        ClassMembers { differing, layout: made, block }
    }
}

/// A buffer of all lights of a class.
struct CommonBuffer {
    /// Its words; none if it is not bound.
    buffer: Option<BoundBuffer>,
    /// The first word and the number of elements of each light's own; `None` if all have the same.
    parts: Option<Vec<(u32, u32)>>,
}

impl CommonBuffer {
    /// Returns the buffer with this entry in the blocks of lights, or one with the elements of all of them.
    fn new(offset: u32, blocks: &[InstanceBlock]) -> CommonBuffer {
        let own = |block| buffer_at(block, offset);
        let address = |buffer: Option<&BoundBuffer>| buffer.map(|it| it.words.as_ptr().addr());
        let first = own(&blocks[0]);
        if blocks.iter().all(|block| address(own(block)) == address(first)) {
            return CommonBuffer { buffer: first.cloned(), parts: None };
        }
        let (mut words, mut element_words) = (Vec::new(), 1);
        let mut known: BTreeMap<Option<usize>, (u32, u32)> = BTreeMap::new();
        let part = |block| {
            let buffer = own(block);
            *known.entry(address(buffer)).or_insert_with(|| {
                let Some(buffer) = buffer else { return (0, 0) };
                let (first, elements) = (words.len() as u32, buffer.elements());
                element_words = buffer.element_words;
                words.extend_from_slice(&buffer.words[..(elements * element_words) as usize]);
                (first, elements)
            })
        };
        let parts = blocks.iter().map(part).collect();
        let buffer = BoundBuffer { offset, words: words.into(), element_words };
        CommonBuffer { buffer: Some(buffer), parts: Some(parts) }
    }
}

/// Returns the buffer with this entry in a block.
fn buffer_at(block: &InstanceBlock, offset: u32) -> Option<&BoundBuffer> {
    block.buffers().iter().find(|buffer| buffer.offset == offset)
}

/// True if these are the same programs, in the same order.
pub(crate) fn have_same_programs(programs: &[Arc<Program>], others: &[Arc<Program>]) -> bool {
    let mut pairs = programs.iter().zip(others);
    programs.len() == others.len() && pairs.all(|(one, other)| Arc::ptr_eq(one, other))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The data of a light with a buffer and a member.
    fn block(words: &[u32], member: u32) -> InstanceBlock {
        let buffer = BoundBuffer { offset: 0, words: words.into(), element_words: 2 };
        InstanceBlock::new(&[0, 0, 0, 0, member, 0], vec![buffer])
    }

    fn members(blocks: &[InstanceBlock]) -> ClassMembers {
        let mut layout = Layout { block_words: 6, ..Layout::default() };
        layout.buffers.insert("light.0.data".to_owned(), 0);
        layout.members.insert("light.0.power".to_owned(), 4);
        ClassMembers::new("light.0.", &layout, blocks, ParameterValues::Final)
    }

    #[test]
    fn buffers_in_which_lights_differ_become_one() {
        let first = block(&[1, 2, 3, 4, 5], 7);
        let blocks = [first.clone(), block(&[6, 7], 7), first, block(&[], 7)];
        let ClassMembers { differing, layout, block } = members(&blocks);
        assert_eq!(*block.buffers()[0].words, [1, 2, 3, 4, 6, 7]);
        assert_eq!(differing.buffers, BTreeMap::from([("data".to_owned(), true)]));
        assert!(differing.scalars.is_empty());
        let array = |name: &str| {
            let first = layout.members[&format!("light.0.data{name}")] as usize;
            &block.words()[first..first + 4]
        };
        assert_eq!(array(FIRST_WORD), [0, 4, 0, 6]);
        assert_eq!(array(ELEMENTS), [2, 1, 2, 0]);
        assert_eq!(block.words()[layout.members["light.0.power"] as usize], 7);
    }

    #[test]
    fn buffers_that_lights_share_stay() {
        let shared = block(&[1, 2], 7);
        let other = InstanceBlock::new(&[0, 0, 0, 0, 8, 0], shared.buffers().to_vec());
        let ClassMembers { differing, block, .. } = members(&[shared.clone(), other]);
        assert_eq!(block.buffers()[0].words.as_ptr(), shared.buffers()[0].words.as_ptr());
        assert!(differing.buffers.is_empty());
        assert_eq!(differing.scalars, BTreeSet::from([("power".to_owned(), 0)]));
    }

    #[test]
    fn few_words_are_copied() {
        let (small, large) = ([(16, 5)], [(64, MAX_COPIED_WORDS - 5)]);
        assert!(are_copied([&small[..], &large, &small].into_iter()));
        assert!(!are_copied([&small[..], &large, &[(32, 1)]].into_iter()));
    }
}
