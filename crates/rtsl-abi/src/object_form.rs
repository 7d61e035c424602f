//! Which data of many objects stands for each of them, and which once for all.

use std::sync::Arc;

/// The words of a class's [layout](crate::Layout) that differ from object to object, of many objects in
/// blocks. The others are the same for all of them, as are the vertex buffers of a mesh's triangles.
/// Cheap to clone.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct ObjectForm {
    /// Sorted. Their order is that in blocks.
    words: Arc<[u32]>,
}

impl ObjectForm {
    /// These words of the layout differ. A place is in it as a whole, or not at all.
    pub fn new(words: impl IntoIterator<Item = u32>) -> ObjectForm {
        let mut words: Vec<u32> = words.into_iter().collect();
        words.sort_unstable();
        words.dedup();
        ObjectForm { words: words.into() }
    }

    /// The words of the layout, in their order in blocks.
    #[inline]
    pub fn words(&self) -> &[u32] {
        &self.words
    }

    /// Where the `len` words of the layout from `first` on stand in blocks; `None` where one of them
    /// stands once for all objects.
    pub fn position(&self, first: u32, len: u32) -> Option<u32> {
        let position = self.words.binary_search(&first).ok()?;
        let words = self.words[position..].iter().take(len as usize);
        let in_a_row = words.zip(first..).take_while(|(word, expected)| *word == expected);
        (in_a_row.count() == len as usize).then_some(position as u32)
    }

    /// Whether one of these words of the layout differs.
    pub fn overlaps(&self, first: u32, len: u32) -> bool {
        let from = self.words.partition_point(|word| *word < first);
        self.words.get(from).is_some_and(|word| *word < first.saturating_add(len))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn places_are_in_a_form_as_a_whole() {
        let form = ObjectForm::new([9, 2, 3, 4, 3]);
        assert_eq!(form.words(), [2, 3, 4, 9]);
        assert_eq!((form.position(2, 3), form.position(9, 1)), (Some(0), Some(3)));
        assert_eq!((form.position(4, 2), form.position(5, 1)), (None, None));
        assert!(form.overlaps(4, 2) && form.overlaps(0, 3) && !form.overlaps(5, 4));
    }
}
