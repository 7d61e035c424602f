//! Where a class's data lies in memory: members in the instance's block or in blocks of objects,
//! scratch in lane arrays.

use std::collections::BTreeMap;
use std::ops::Range;

use rtsl_ir::{Place, PlaceKind};

use crate::offsets::BUFFER_WORDS;
use crate::{CallMode, ObjectForm};

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
    /// Which words of the block stand in blocks of objects. Where `None`, shapes with many objects have
    /// all of them there, and others none.
    pub objects: Option<ObjectForm>,
}

/// Where a member or buffer stands.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum DataLocation {
    /// At this word of the instance's block.
    Instance(u32),
    /// At this word of each object.
    Objects(u32),
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

    /// The words of each member and each buffer's entry, in their order, with what pads the last.
    pub fn places(&self) -> impl Iterator<Item = Range<u32>> {
        let mut starts: Vec<u32> =
            self.members.values().chain(self.buffers.values()).copied().collect();
        starts.push(self.block_words);
        starts.sort_unstable();
        // Members without scalars begin where the next does.
        starts.dedup();
        (1..starts.len()).map(move |next| starts[next - 1]..starts[next])
    }

    /// The words that stand in blocks of objects in calls of this shape; `None` where they have one
    /// instance's block.
    pub fn object_form(&self, shape: CallMode) -> Option<ObjectForm> {
        let all = || ObjectForm::new(0..self.block_words);
        self.objects.clone().or_else(|| shape.has_many_objects().then(all))
    }

    /// Where a member or buffer stands beside objects of this form; `None` for other places, those
    /// that the layout lacks, and such of which only a part stands in the blocks.
    pub fn locate(&self, place: &Place, form: Option<&ObjectForm>) -> Option<DataLocation> {
        let (first, words) = match place.kind {
            PlaceKind::Member => (*self.members.get(&place.name)?, place.len),
            PlaceKind::Buffer => (*self.buffers.get(&place.name)?, BUFFER_WORDS),
            PlaceKind::State
            | PlaceKind::Parameter
            | PlaceKind::Scratch
            | PlaceKind::Slot
            | PlaceKind::Accepted => return None,
        };
        match form.filter(|form| form.overlaps(first, words)) {
            None => Some(DataLocation::Instance(first)),
            Some(form) => form.position(first, words).map(DataLocation::Objects),
        }
    }
}
