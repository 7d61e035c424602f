//! Many objects of one program, in blocks.

use std::borrow::Borrow;
use std::collections::BTreeMap;
use std::sync::Arc;

use rtsl_memory::{SharedWords, prefetch_values, with_capacity_in_huge_pages};

use crate::instance::{BoundBuffer, BufferEntries, InstanceBlock};
use crate::instance_run::InstanceRun;
use crate::object_form::ObjectForm;
use crate::offsets::{BUFFER_WORDS, LANE_PADDING, NO_OBJECT, OBJECTS_IN_BLOCK};

const IN_BLOCK: usize = OBJECTS_IN_BLOCK as usize;

/// One word of each object of a block.
#[repr(C, align(32))]
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct ObjectRow(pub [u32; IN_BLOCK]);

/// Objects of one program by index. Words that differ from object to object are in blocks, the others once in
/// [`Objects::shared`]. The [form](ObjectForm) determines the words in blocks; a kernel is compiled for one form.
///
/// A block has a row for each word of the form, with that word of [`OBJECTS_IN_BLOCK`] objects. Objects have no other
/// memory, but each buffer that they bind is kept alive.
pub struct Objects {
    form: ObjectForm,
    shared: Arc<InstanceBlock>,
    count: usize,
    /// The rows block by block, followed by as many blocks of zeros as the widest vector reads past the end.
    rows: Arc<Vec<ObjectRow>>,
    /// The buffers whose entries are in blocks, by address.
    buffers: Arc<BTreeMap<usize, SharedWords>>,
    /// The entries that are in blocks of all objects, by words of the blocks.
    entries: BufferEntries,
}

impl Objects {
    /// Returns `count` zeroed objects that share the data and buffers of `shared`. That block also contains the words
    /// of the form, which are not read.
    ///
    /// # Panics
    /// If a buffer's entry is among the words of the form, or there are [`NO_OBJECT`] objects or more, or more than the
    /// form is for.
    pub fn new(form: ObjectForm, shared: Arc<InstanceBlock>, count: usize) -> Objects {
        let overlaps = |it: &BoundBuffer| form.overlaps(it.offset, BUFFER_WORDS);
        assert!(!shared.buffers().iter().any(overlaps), "buffers are shared");
        Objects::zeros(form, shared, count)
    }

    fn zeros(form: ObjectForm, shared: Arc<InstanceBlock>, count: usize) -> Objects {
        assert!(count < NO_OBJECT as usize, "objects have numbers");
        let fits = form.few_blocks().is_none_or(|blocks| count <= blocks as usize * IN_BLOCK);
        assert!(fits, "the form is for fewer objects");
        let row_count = blocks(count) * form.words().len();
        let mut rows = with_capacity_in_huge_pages(row_count);
        rows.resize(row_count, ObjectRow::default());
        let (buffers, entries) = (Arc::default(), BufferEntries::default());
        Objects { form, shared, count, rows: Arc::new(rows), buffers, entries }
    }

    /// Returns instances of one layout as objects, indexed from 0. Words outside the form are shared with the first.
    ///
    /// # Panics
    /// If one lacks words of the form, or there are [`NO_OBJECT`] or more.
    pub fn of_instances<B: Borrow<InstanceBlock>>(
        form: ObjectForm,
        instances: impl IntoIterator<Item = B>,
    ) -> Objects {
        let instances = instances.into_iter().map(|it| InstanceRun::new(it.borrow().clone(), 1));
        Objects::of_runs(form, &instances.collect::<Vec<_>>())
    }

    /// Like [`Objects::of_instances`], of runs one after the other.
    ///
    /// # Panics
    /// As for [`Objects::of_instances`].
    pub fn of_runs(form: ObjectForm, runs: &[InstanceRun]) -> Objects {
        let shared = runs.first().map_or_else(InstanceBlock::default, |run| run.first().clone());
        let count = runs.iter().map(InstanceRun::count).sum();
        let mut objects = Objects::zeros(form.clone(), Arc::new(shared), count);
        objects.entries = objects.shared.entries().in_objects(&form);
        let (words, mut buffers) = (form.words().len(), BTreeMap::new());
        let mut start = 0;
        for run in runs {
            let block = run.first();
            let rows = objects.own_rows();
            for (position, word) in form.words().iter().enumerate() {
                let mut set = |number: usize, value: u32| {
                    rows[number / IN_BLOCK * words + position].0[number % IN_BLOCK] = value;
                };
                let numbers = start..start + run.count();
                match run.column(*word) {
                    Some(values) => {
                        numbers.zip(values).for_each(|(number, value)| set(number, *value))
                    }
                    None => {
                        let value = block.words()[*word as usize];
                        numbers.for_each(|number| set(number, value));
                    }
                }
            }
            start += run.count();
            objects.entries.retain_common(&block.entries().in_objects(&form));
            let of_object =
                |it: &&BoundBuffer| words > 0 && form.position(it.offset, BUFFER_WORDS).is_some();
            for BoundBuffer { words, .. } in block.buffers().iter().filter(of_object) {
                buffers.entry(words.as_ptr().addr()).or_insert_with(|| words.clone());
            }
        }
        objects.buffers = Arc::new(buffers);
        objects
    }

    /// Returns the objects as the ends of longer instances: the words of their layout follow `first` others. `shared`
    /// is the whole block of the first instance.
    ///
    /// # Panics
    /// If it is too short.
    #[must_use]
    pub fn after(self, first: u32, shared: InstanceBlock) -> Objects {
        assert_eq!(shared.words().len(), first as usize + self.shared.words().len());
        Objects { form: self.form.after(first), shared: Arc::new(shared), ..self }
    }

    /// Returns the objects in another order: object `i` is the former `order[i]`, or zeros if that is [`NO_OBJECT`], as
    /// in the gaps of an order in which groups begin at blocks.
    ///
    /// # Panics
    /// If the order contains the index of a missing object.
    pub fn in_order(&self, order: &[u32]) -> Objects {
        let Objects { form, shared, buffers, entries, .. } = self;
        let mut objects = Objects::zeros(form.clone(), shared.clone(), order.len());
        let words = form.words().len();
        if words > 0 {
            let blocks = objects.own_rows().chunks_exact_mut(words).zip(order.chunks(IN_BLOCK));
            for (rows, order) in blocks {
                for (lane, number) in order.iter().enumerate().filter(|(_, it)| **it != NO_OBJECT) {
                    let number = *number as usize;
                    assert!(number < self.count, "object {number} of {}", self.count);
                    let from = &self.rows[number / IN_BLOCK * words..][..words];
                    let from = from.iter().map(|row| row.0[number % IN_BLOCK]);
                    rows.iter_mut().zip(from).for_each(|(row, word)| row.0[lane] = word);
                }
            }
        }
        Objects { buffers: buffers.clone(), entries: entries.clone(), ..objects }
    }

    /// Returns all objects as instances of the layout.
    ///
    /// # Panics
    /// If objects have buffers of their own.
    pub fn run(&self) -> InstanceRun {
        assert!(self.entries.is_empty(), "all buffers are shared");
        let run = InstanceRun::new(InstanceBlock::clone(&self.shared), self.count);
        self.form.words().iter().enumerate().fold(run, |run, (position, word)| {
            let values = (0..self.count).map(|object| self.word(object, position));
            run.with_column(*word, values.collect())
        })
    }

    /// Prefetches the block of the object with this index.
    #[inline(always)]
    pub fn prefetch(&self, number: u32) {
        let words = self.form.words().len();
        prefetch_values(self.rows.as_ptr().wrapping_add(number as usize / IN_BLOCK * words), words);
    }

    /// Returns the words that differ.
    pub fn form(&self) -> &ObjectForm {
        &self.form
    }

    /// Returns the data that all objects share: an instance of the layout in which the words of the form are unused.
    pub fn shared(&self) -> &Arc<InstanceBlock> {
        &self.shared
    }

    /// Returns the number of objects.
    #[inline]
    pub fn len(&self) -> usize {
        self.count
    }

    /// True if there are none.
    pub fn is_empty(&self) -> bool {
        self.count == 0
    }

    /// Returns the size of the blocks, in bytes.
    pub fn bytes(&self) -> usize {
        size_of_val(self.rows.as_slice())
    }

    /// Returns the word of an object at a position of the form.
    ///
    /// # Panics
    /// If there is no such object or word.
    pub fn word(&self, object: usize, position: usize) -> u32 {
        self.rows[self.row(object, position)].0[object % IN_BLOCK]
    }

    /// Returns the words of objects block by block, a row for each word of the form, including those past the last
    /// object, which do not affect results.
    ///
    /// # Panics
    /// If the form contains entries of buffers: hosts must not access words that kernels use as addresses.
    pub fn rows(&self) -> &[ObjectRow] {
        &self.rows
    }

    /// Like [`Objects::rows`], with mutable access.
    ///
    /// # Panics
    /// Also if other objects [share](Objects::sharing) the words.
    pub fn rows_mut(&mut self) -> &mut [ObjectRow] {
        assert!(self.entries.is_empty(), "objects with buffers of their own do not change");
        let blocks = self.count.div_ceil(IN_BLOCK) * self.form.words().len();
        &mut self.own_rows()[..blocks]
    }

    fn own_rows(&mut self) -> &mut [ObjectRow] {
        Arc::get_mut(&mut self.rows).expect("no others share the words")
    }

    /// Stores objects of the same form at these indices.
    ///
    /// # Panics
    /// If the form is another one, there are no such objects, or hosts must not change them.
    pub fn store(&mut self, objects: &Objects, indices: &[u32]) {
        assert_eq!(self.form, objects.form, "objects of one form");
        assert!(objects.count >= indices.len() && objects.entries.is_empty());
        let words = self.form.words().len();
        let rows = self.rows_mut();
        for (from, to) in indices.iter().map(|to| *to as usize).enumerate() {
            for position in 0..words {
                rows[to / IN_BLOCK * words + position].0[to % IN_BLOCK] =
                    objects.rows[from / IN_BLOCK * words + position].0[from % IN_BLOCK];
            }
        }
    }

    /// Returns the same objects with other data that they share, in the same memory.
    ///
    /// # Panics
    /// If objects have buffers of their own, or the data are of another size or bind a buffer among the words of the
    /// form.
    #[must_use]
    pub fn sharing(&self, shared: Arc<InstanceBlock>) -> Objects {
        assert!(self.entries.is_empty(), "all buffers are shared");
        assert_eq!(shared.words().len(), self.shared.words().len(), "data of one layout");
        let overlaps = |it: &BoundBuffer| self.form.overlaps(it.offset, BUFFER_WORDS);
        assert!(!shared.buffers().iter().any(overlaps), "buffers are shared");
        let Objects { form, count, rows, buffers, entries, .. } = self;
        Objects {
            form: form.clone(),
            shared,
            count: *count,
            rows: rows.clone(),
            buffers: buffers.clone(),
            entries: entries.clone(),
        }
    }

    /// Returns the scalars of the object's buffer whose entry is at a position of the form.
    pub fn buffer(&self, object: usize, position: usize) -> Option<&[u32]> {
        let [low, high] = [0, 1].map(|word| self.word(object, position + word).to_ne_bytes());
        let address = u64::from_ne_bytes([low, high].concat().try_into().ok()?);
        Some(self.buffers.get(&usize::try_from(address).ok()?)?)
    }

    fn row(&self, object: usize, position: usize) -> usize {
        let words = self.form.words().len();
        assert!(object < self.count && position < words, "word {position} of object {object}");
        object / IN_BLOCK * words + position
    }

    #[inline]
    pub(crate) fn entries(&self) -> &BufferEntries {
        &self.entries
    }

    /// Returns the address of the first word of an object, or of the first object if there are none.
    #[inline]
    pub fn pointer(&self, object: usize) -> *const u8 {
        let words = self.form.words().len();
        let bytes = object / IN_BLOCK * words * size_of::<ObjectRow>();
        let start = self.rows.as_ptr().cast::<u8>();
        start.wrapping_add(bytes + object % IN_BLOCK * size_of::<u32>())
    }
}

/// Returns the number of blocks for so many objects, including those that vectors read past the end.
fn blocks(count: usize) -> usize {
    count.div_ceil(IN_BLOCK) + LANE_PADDING as usize / IN_BLOCK - 1
}

impl std::fmt::Debug for Objects {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "Objects({} of {} words)", self.count, self.form.words().len())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn instance(first: u32) -> InstanceBlock {
        InstanceBlock::new(&[first, first + 1], Vec::new())
    }

    #[test]
    fn words_of_a_block_are_in_rows() {
        let instances: Vec<_> = (0..20).map(|number| instance(10 * number)).collect();
        let objects = Objects::of_instances(ObjectForm::new(0..2), &instances);
        assert_eq!(objects.rows[5].0, [161, 171, 181, 191, 0, 0, 0, 0]);
        assert_eq!(objects.word(19, 1), 191);
        let order: Vec<u32> = [3, NO_OBJECT, 19].into_iter().chain(4..12).collect();
        let ordered = objects.in_order(&order);
        assert_eq!(ordered.rows[0].0, [30, 0, 190, 40, 50, 60, 70, 80]);
        assert_eq!(ordered.rows[3].0, [91, 101, 111, 0, 0, 0, 0, 0]);
        assert_eq!((ordered.len(), ordered.bytes()), (11, 6 * 32));
        let one = Objects::of_instances(ObjectForm::new([1]), &instances);
        assert_eq!((one.word(7, 0), one.shared().words()), (71, [0, 1].as_slice()));
        // Word 0 is that of the first instance for all.
        assert_eq!(one.run().instance(7).words(), [0, 71]);
        assert_eq!(objects.run().instance(19).words(), instances[19].words());
        assert!(Objects::of_instances::<InstanceBlock>(ObjectForm::new([]), []).is_empty());
    }

    #[test]
    fn runs_are_the_same_as_their_instances() {
        let run = |first, count: u32| {
            let run = InstanceRun::new(instance(first), count as usize);
            run.with_column(1, (0..count).map(|number| 100 + number).collect())
        };
        let runs = [run(1, 5), InstanceRun::new(instance(3), 1), run(7, 13)];
        let instances = runs.iter().flat_map(|run| (0..run.count()).map(|it| run.instance(it)));
        for form in [ObjectForm::new(0..2), ObjectForm::new([1])] {
            let of_runs = Objects::of_runs(form.clone(), &runs);
            let of_instances = Objects::of_instances(form, instances.clone());
            assert_eq!((of_runs.len(), &of_runs.rows), (19, &of_instances.rows));
            assert_eq!(of_runs.shared().words(), of_instances.shared().words());
        }
    }

    #[test]
    fn objects_of_one_form_are_stored_anywhere_and_shared() {
        let run = |first| {
            let run = InstanceRun::new(instance(first), 9);
            run.with_column(0, (0..9).map(|number| first + 10 * number).collect())
        };
        let [one, other] =
            [1, 2].map(|first| Objects::of_runs(ObjectForm::new([0]), &[run(first)]));
        let mut both = Objects::new(ObjectForm::new([0]), one.shared().clone(), 20);
        both.store(&one, &[0, 2, 4, 6, 8, 10, 12, 14, 16]);
        both.store(&other, &[19, 1, 3, 5]);
        let words: Vec<u32> = (0..20).map(|object| both.word(object, 0)).collect();
        assert_eq!(words[..8], [1, 12, 11, 22, 21, 32, 31, 0]);
        assert_eq!(words[16..], [81, 0, 0, 2]);
        let shared = both.sharing(other.shared().clone());
        assert_eq!((shared.word(1, 0), shared.shared().words()), (12, [2, 3].as_slice()));
        assert_eq!(shared.rows().as_ptr(), both.rows().as_ptr());
    }

    #[test]
    fn buffers_are_kept_once_and_found_again() {
        let counted: Arc<[u32]> = Arc::from([1, 2, 3]);
        let words = SharedWords::from(counted.clone());
        let bound = || BoundBuffer { offset: 0, words: words.clone(), element_words: 1 };
        let instances = [0; 9].map(|_| InstanceBlock::new(&[0; 4], vec![bound()]));
        let objects = Objects::of_instances(ObjectForm::new(0..4), instances);
        // The others are of this test, and of the block that objects share.
        assert_eq!(Arc::strong_count(&counted), 4);
        assert_eq!(objects.buffer(8, 0), Some([1, 2, 3].as_slice()));
        assert_eq!(objects.word(8, 2), 3);
    }

    #[test]
    #[should_panic(expected = "do not change")]
    fn addresses_are_not_for_hosts() {
        let buffer = BoundBuffer { offset: 0, words: [1].into(), element_words: 1 };
        let instance = InstanceBlock::new(&[0; 4], vec![buffer]);
        Objects::of_instances(ObjectForm::new(0..4), [&instance]).rows_mut();
    }
}
