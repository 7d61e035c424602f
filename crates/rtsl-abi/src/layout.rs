//! The memory layout of a class's data: members in the instance's block or in blocks of objects, scratch in lane
//! arrays.

use std::collections::BTreeMap;
use std::ops::Range;

use rtsl_ir::{Variable, VariableKind};

use crate::offsets::BUFFER_WORDS;
use crate::{CallMode, ObjectForm};

/// The layout of one class, linked with those it refers to. The methods of the class share it.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Layout {
    /// The first word of each member in the block.
    pub members: BTreeMap<String, u32>,
    /// The first word of each buffer's entry in the block.
    pub buffers: BTreeMap<String, u32>,
    /// The first lane array of each scratch variable.
    pub scratch: BTreeMap<String, u32>,
    /// The size of the block in words, even.
    pub block_words: u32,
    /// The number of scratch lane arrays.
    pub scratch_arrays: u32,
    /// The words of the block that are in blocks of objects. If `None`, call modes with many objects have all words
    /// there, and the others none.
    pub objects: Option<ObjectForm>,
}

/// The location of a member or buffer.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum DataLocation {
    /// A word of the instance's block.
    Instance(u32),
    /// A word of each object.
    Objects(u32),
}

impl Layout {
    /// Lays out variables consecutively: members and buffers in the block, scratch in arrays.
    pub fn new<'a>(
        members: impl IntoIterator<Item = &'a Variable>,
        buffers: impl IntoIterator<Item = &'a Variable>,
        scratch: impl IntoIterator<Item = &'a Variable>,
    ) -> Layout {
        let mut layout = Layout::default();
        for variable in buffers {
            layout.buffers.insert(variable.name.clone(), layout.block_words);
            layout.block_words += BUFFER_WORDS;
        }
        for variable in members {
            layout.members.insert(variable.name.clone(), layout.block_words);
            layout.block_words += variable.len;
        }
        layout.block_words = layout.block_words.next_multiple_of(2);
        for variable in scratch {
            layout.scratch.insert(variable.name.clone(), layout.scratch_arrays);
            layout.scratch_arrays += variable.len;
        }
        layout
    }

    /// Returns the words of each member and each buffer's entry, in order, including their padding.
    pub fn variables(&self) -> impl Iterator<Item = Range<u32>> {
        let mut starts: Vec<u32> =
            self.members.values().chain(self.buffers.values()).copied().collect();
        starts.push(self.block_words);
        starts.sort_unstable();
        // Members without scalars have the same start as the next variable.
        starts.dedup();
        (1..starts.len()).map(move |next| starts[next - 1]..starts[next])
    }

    /// Returns the words in blocks of objects in calls of this mode; `None` if they have one instance's block.
    pub fn object_form(&self, mode: CallMode) -> Option<ObjectForm> {
        let all = || ObjectForm::new(0..self.block_words);
        self.objects.clone().or_else(|| mode.has_many_objects().then(all))
    }

    /// Returns the location of a member or buffer for objects of this form; `None` for other variables, those missing
    /// in the layout, and those with only some words in the blocks.
    pub fn locate(&self, variable: &Variable, form: Option<&ObjectForm>) -> Option<DataLocation> {
        let (first, words) = match variable.kind {
            VariableKind::Member => (*self.members.get(&variable.name)?, variable.len),
            VariableKind::Buffer => (*self.buffers.get(&variable.name)?, BUFFER_WORDS),
            VariableKind::State
            | VariableKind::Parameter
            | VariableKind::Scratch
            | VariableKind::Local
            | VariableKind::Accepted => return None,
        };
        match form.filter(|form| form.overlaps(first, words)) {
            None => Some(DataLocation::Instance(first)),
            Some(form) => form.position(first, words).map(DataLocation::Objects),
        }
    }
}
