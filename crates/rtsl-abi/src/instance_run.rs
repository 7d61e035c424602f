//! Instances that differ in few words.

use std::collections::BTreeMap;

use crate::instance::{BoundBuffer, InstanceBlock};

/// Instances of one layout in a row, such as the elements of one object, which differ in few words: those have a
/// column each, and the others are stored once. In a scene of 3.5 million triangles, a block for each took 2.2 s to
/// make, where columns take 0.1 (Zen 5).
#[derive(Clone, Debug)]
pub struct InstanceRun {
    first: InstanceBlock,
    count: usize,
    /// For each word in which they may differ that of each instance.
    columns: BTreeMap<u32, Vec<u32>>,
}

impl InstanceRun {
    /// Returns `count` instances with these data.
    pub fn new(block: InstanceBlock, count: usize) -> InstanceRun {
        InstanceRun { first: block, count, columns: BTreeMap::new() }
    }

    /// Gives each instance a word of its own.
    ///
    /// # Panics
    /// If there are not as many values as instances, if the block has no such word, or it is part of an entry of a
    /// buffer.
    #[must_use]
    pub fn with_column(mut self, word: u32, values: Vec<u32>) -> InstanceRun {
        assert_eq!(values.len(), self.count, "each instance has a word");
        if let Some(value) = values.first() {
            self.first = self.first.with_words([(word, *value)].into_iter());
            self.columns.insert(word, values);
        }
        self
    }

    /// Returns instances of longer layouts, in which the words of the parts follow one another. Parts with one instance
    /// have the same words in all.
    ///
    /// # Panics
    /// If two parts have several instances, but not the same number.
    pub fn joined(parts: &[InstanceRun]) -> InstanceRun {
        let count = parts.iter().map(|part| part.count).find(|count| *count != 1).unwrap_or(1);
        let (mut words, mut buffers, mut columns) = (Vec::new(), Vec::new(), BTreeMap::new());
        for part in parts {
            assert!(part.count == 1 || part.count == count, "parts are of the same instances");
            let start = words.len() as u32;
            let bound = part.first.buffers().iter();
            buffers.extend(bound.map(|it| BoundBuffer { offset: start + it.offset, ..it.clone() }));
            words.extend_from_slice(part.first.words());
            let of_part = part.columns.iter().filter(|_| part.count == count);
            columns.extend(of_part.map(|(word, values)| (start + word, values.clone())));
        }
        InstanceRun { first: InstanceBlock::new(&words, buffers), count, columns }
    }

    /// The first instance.
    pub fn first(&self) -> &InstanceBlock {
        &self.first
    }

    /// The number of instances.
    pub fn count(&self) -> usize {
        self.count
    }

    /// Returns an instance.
    ///
    /// # Panics
    /// If there is no such instance.
    pub fn instance(&self, index: usize) -> InstanceBlock {
        assert!(index < self.count, "instance {index} of {}", self.count);
        self.first.with_words(self.columns.iter().map(|(word, values)| (*word, values[index])))
    }

    /// True if the instances differ in a word.
    pub fn differ_in(&self, word: u32) -> bool {
        self.column(word).is_some_and(|values| values.iter().any(|value| *value != values[0]))
    }

    /// Returns a word of each instance, if they may differ in it.
    pub(crate) fn column(&self, word: u32) -> Option<&[u32]> {
        self.columns.get(&word).map(Vec::as_slice)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn block(words: &[u32]) -> InstanceBlock {
        InstanceBlock::new(words, Vec::new())
    }

    #[test]
    fn instances_differ_in_columns_alone() {
        let run = InstanceRun::new(block(&[1, 2, 3, 4]), 3);
        let run = run.with_column(2, vec![7, 8, 9]).with_column(3, vec![5, 5, 5]);
        assert_eq!(run.first().words(), [1, 2, 7, 5]);
        assert_eq!(run.instance(2).words(), [1, 2, 9, 5]);
        assert_eq!([0, 2, 3].map(|word| run.differ_in(word)), [false, true, false]);
    }

    #[test]
    fn parts_follow_one_another() {
        let buffer = BoundBuffer { offset: 0, words: [1, 2].into(), element_words: 1 };
        let one = InstanceRun::new(InstanceBlock::new(&[0; 4], vec![buffer]), 1);
        let three = InstanceRun::new(block(&[1, 2]), 3).with_column(1, vec![4, 5, 6]);
        let run = InstanceRun::joined(&[three.clone(), one, three]);
        assert_eq!(run.count(), 3);
        let instance = run.instance(1);
        assert_eq!([&instance.words()[..2], &instance.words()[6..]], [[1, 5], [1, 5]]);
        assert_eq!((instance.buffers()[0].offset, instance.words()[4]), (2, 2));
    }

    #[test]
    #[should_panic(expected = "of the same instances")]
    fn parts_have_the_same_instances() {
        let run = |count| InstanceRun::new(block(&[1, 2]), count);
        InstanceRun::joined(&[run(1), run(2), run(3)]);
    }
}
