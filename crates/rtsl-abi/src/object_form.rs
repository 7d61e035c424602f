//! The division of the data of many objects into per-object and shared words.

use std::sync::Arc;

use crate::offsets::OBJECTS_IN_BLOCK;

/// The greatest number of blocks whose rows fit into one register.
const MAX_FEW_BLOCKS: u32 = 2;

/// The words of a class's [layout](crate::Layout) that are per object, for many objects in blocks. The others are
/// shared by all of them, such as the vertex buffers of a mesh's triangles. Cheap to clone.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct ObjectForm {
    /// Sorted, in the order of the rows of blocks.
    words: Arc<[u32]>,
    few_blocks: Option<u32>,
}

impl ObjectForm {
    /// Returns the form with these words of the layout. It contains all words of a variable, or none of them.
    pub fn new(words: impl IntoIterator<Item = u32>) -> ObjectForm {
        let mut words: Vec<u32> = words.into_iter().collect();
        words.sort_unstable();
        words.dedup();
        ObjectForm { words: words.into(), few_blocks: None }
    }

    /// Returns the form in a layout in which all words follow `first` others.
    #[must_use]
    pub fn after(self, first: u32) -> ObjectForm {
        ObjectForm { words: self.words.iter().map(|word| first + word).collect(), ..self }
    }

    /// Returns the form for so many objects. If they are few, kernels keep the rows of all in registers, and serve no
    /// more objects than fit into as many blocks.
    #[must_use]
    pub fn of_count(self, count: usize) -> ObjectForm {
        let blocks = count.div_ceil(OBJECTS_IN_BLOCK as usize).max(1) as u32;
        ObjectForm { few_blocks: Some(blocks).filter(|it| *it <= MAX_FEW_BLOCKS), ..self }
    }

    /// The greatest number of blocks, if they are few.
    #[inline]
    pub fn few_blocks(&self) -> Option<u32> {
        self.few_blocks
    }

    /// Returns the words of the layout, in their order in blocks.
    #[inline]
    pub fn words(&self) -> &[u32] {
        &self.words
    }

    /// Returns the position in blocks of the `len` words of the layout from `first`; `None` if one of them is shared by
    /// all objects.
    pub fn position(&self, first: u32, len: u32) -> Option<u32> {
        let position = self.words.binary_search(&first).ok()?;
        let words = self.words[position..].iter().take(len as usize);
        let in_a_row = words.zip(first..).take_while(|(word, expected)| *word == expected);
        (in_a_row.count() == len as usize).then_some(position as u32)
    }

    /// True if one of these words of the layout is per object.
    pub fn overlaps(&self, first: u32, len: u32) -> bool {
        let from = self.words.partition_point(|word| *word < first);
        self.words.get(from).is_some_and(|word| *word < first.saturating_add(len))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_form_has_all_words_of_a_variable_or_none() {
        let form = ObjectForm::new([9, 2, 3, 4, 3]);
        assert_eq!(form.words(), [2, 3, 4, 9]);
        assert_eq!((form.position(2, 3), form.position(9, 1)), (Some(0), Some(3)));
        assert_eq!((form.position(4, 2), form.position(5, 1)), (None, None));
        assert!(form.overlaps(4, 2) && form.overlaps(0, 3) && !form.overlaps(5, 4));
    }

    #[test]
    fn few_objects_are_known_by_their_blocks() {
        let blocks = [0, 1, 8, 9, 16, 17].map(|count| ObjectForm::new([0]).of_count(count));
        let blocks = blocks.each_ref().map(ObjectForm::few_blocks);
        assert_eq!(blocks, [Some(1), Some(1), Some(1), Some(2), Some(2), None]);
    }
}
