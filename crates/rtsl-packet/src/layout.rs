//! Where a class's data lies in memory: members in the instance's block, scratch in lane arrays.

use std::collections::BTreeMap;

use rtsl_ir::Place;

use crate::abi::BUFFER_WORDS;

/// The layout of one class, linked with those it refers to. The methods of the class share it.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Layout {
    /// The first word of each member in the block.
    pub members: BTreeMap<String, u32>,
    /// The first word of each buffer's entry in the block.
    pub buffers: BTreeMap<String, u32>,
    /// The first lane array of each scratch place.
    pub scratch: BTreeMap<String, u32>,
    /// The size of the block in words, even.
    pub block_words: u32,
    /// The number of scratch lane arrays.
    pub scratch_arrays: u32,
}

impl Layout {
    /// Lays the places out one after the other: members and buffers in the block, scratch in arrays.
    pub fn new<'a>(
        members: impl IntoIterator<Item = &'a Place>,
        buffers: impl IntoIterator<Item = &'a Place>,
        scratch: impl IntoIterator<Item = &'a Place>,
    ) -> Layout {
        let mut layout = Layout::default();
        for place in buffers {
            layout.buffers.insert(place.name.clone(), layout.block_words);
            layout.block_words += BUFFER_WORDS;
        }
        for place in members {
            layout.members.insert(place.name.clone(), layout.block_words);
            layout.block_words += place.len;
        }
        layout.block_words = layout.block_words.next_multiple_of(2);
        for place in scratch {
            layout.scratch.insert(place.name.clone(), layout.scratch_arrays);
            layout.scratch_arrays += place.len;
        }
        layout
    }
}
