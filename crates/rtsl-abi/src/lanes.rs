//! Storage for the per-ray values of calls: one array of 32-bit words for each component.

use std::ops::Range;

use crate::component_set::ComponentSet;
use crate::lane_arrays::LaneArrays;
use crate::offsets::LANE_PADDING;

const PADDING: usize = LANE_PADDING as usize;

/// As many words as the widest vector, with its alignment.
#[repr(C, align(64))]
#[derive(Clone, Copy)]
pub(crate) struct Chunk([u32; PADDING]);

/// Zeroed chunks on the heap, accessed through one pointer only, so that kernels may keep copies of it.
pub(crate) struct Chunks {
    start: *mut Chunk,
    count: usize,
}

impl Chunks {
    /// Allocates zeroed chunks.
    ///
    /// # Panics
    /// If the size exceeds the address space.
    pub(crate) fn new(count: usize) -> Chunks {
        let chunks = vec![Chunk([0; PADDING]); count].into_boxed_slice();
        Chunks { start: Box::into_raw(chunks).cast(), count }
    }

    #[inline]
    pub(crate) fn words(&self) -> *mut u32 {
        self.start.cast()
    }

    #[inline]
    pub(crate) fn all(&self) -> &[u32] {
        // Safety: a chunk is `PADDING` words without gaps; all are owned and initialised.
        unsafe { std::slice::from_raw_parts(self.words(), self.count * PADDING) }
    }

    #[inline]
    pub(crate) fn all_mut(&mut self) -> &mut [u32] {
        // Safety: as for `all`, and borrowed mutably.
        unsafe { std::slice::from_raw_parts_mut(self.words(), self.count * PADDING) }
    }
}

impl Drop for Chunks {
    fn drop(&mut self) {
        let chunks = std::ptr::slice_from_raw_parts_mut(self.start, self.count);
        // Safety: made by `Box::into_raw` in `new`, freed once.
        drop(unsafe { Box::from_raw(chunks) });
    }
}

/// The number of chunks from which on the distance between arrays is an odd number of them.
///
/// A kernel reads the same lanes of many arrays. At distances of 4 KiB these are in one set of a first-level cache: its
/// ways do not suffice, and each load waits for the second level. An odd distance took 4 to 11 % off path tracing.
const MIN_SPREAD_CHUNKS: usize = 8;

/// Allocates `arrays` arrays of `lanes` words each; returns the memory and the stride in words: the lanes rounded up to
/// whole chunks, and to an odd number of chunks if they are many.
///
/// # Panics
/// If the size exceeds the address space.
fn arrays_of_zeros(arrays: usize, lanes: usize) -> (Chunks, usize) {
    let chunks = lanes.div_ceil(PADDING);
    let chunks = if chunks < MIN_SPREAD_CHUNKS { chunks } else { chunks | 1 };
    let sizes = chunks.checked_mul(PADDING).zip(chunks.checked_mul(arrays));
    let Some((stride, all_chunks)) = sizes else {
        panic!("no memory has room for {arrays} arrays of {lanes} lanes")
    };
    (Chunks::new(all_chunks), stride)
}

/// Arrays of 32-bit words, one for each component of the state or of scratch, with one word for each lane (ray). Every
/// array is aligned to 64 bytes and its length is at least the number of lanes rounded up to a multiple of
/// [`LANE_PADDING`], so that a kernel of any width may read and write whole vectors.
// In this order, so that what the checks of a call read is in one or two cache lines.
#[repr(C)]
pub struct LaneBlock {
    /// The address of each component's array, for kernels; null if it has none.
    table: Box<[*mut u32]>,
    lanes: usize,
    /// The components with an array, as far as a set can hold them.
    present: ComponentSet,
    /// The number of components if each has an array, else 0.
    dense: usize,
    memory: Chunks,
    /// The number of lanes of an array, including padding.
    stride: usize,
}

// Safety: the pointers are to the block's heap memory, which is not shared.
unsafe impl Send for LaneBlock {}
// Safety: through a shared reference memory is only read.
unsafe impl Sync for LaneBlock {}

impl LaneBlock {
    /// Returns zeroed arrays: `components` arrays for `lanes` rays.
    ///
    /// # Panics
    /// If the size exceeds the address space.
    pub fn new(components: usize, lanes: usize) -> LaneBlock {
        let (memory, stride) = arrays_of_zeros(components, lanes);
        // Safety: `index` is below `components`, and the memory has `components * stride` words, a number that did not
        // overflow.
        let table =
            (0..components).map(|index| unsafe { memory.words().add(index * stride) }).collect();
        let present = (0..components.min(ComponentSet::CAPACITY as usize) as u32).collect();
        LaneBlock { memory, table, present, dense: components, lanes, stride }
    }

    /// Returns zeroed arrays for some of `components` only, contiguous in the order of `present`, for kernels that do
    /// not access the others.
    ///
    /// # Panics
    /// If `present` contains a component twice, or one that is not below `components` and [`ComponentSet::CAPACITY`],
    /// or the size exceeds the address space.
    pub fn sparse(components: usize, present: &[u32], lanes: usize) -> LaneBlock {
        let (memory, stride) = arrays_of_zeros(present.len(), lanes);
        let mut table = vec![std::ptr::null_mut::<u32>(); components].into_boxed_slice();
        for (index, component) in present.iter().enumerate() {
            let entry = &mut table[*component as usize];
            assert!(entry.is_null(), "component {component} is named twice");
            // Safety: `index` is below `present.len()`, and the memory has that many times `stride` words, a number
            // that did not overflow.
            *entry = unsafe { memory.words().add(index * stride) };
        }
        let present = present.iter().copied().collect();
        LaneBlock { memory, table, present, dense: 0, lanes, stride }
    }

    /// Returns the number of components, including those without an array.
    #[inline]
    pub fn components(&self) -> usize {
        self.table.len()
    }

    /// True if some components have no array.
    #[inline]
    pub fn is_sparse(&self) -> bool {
        self.dense < self.components()
    }

    /// True if each of these components has an array.
    #[inline]
    pub fn has_all(&self, components: &ComponentSet) -> bool {
        self.present.contains_all(components)
    }

    /// True if all components have arrays, and there are so many of them, or none is asked for: one comparison, since
    /// each call makes it.
    #[inline]
    pub(crate) fn has_first(&self, components: u32) -> bool {
        self.dense >= components as usize
    }

    /// Returns the number of rays for which there is room.
    #[inline]
    pub fn lanes(&self) -> usize {
        self.lanes
    }

    /// Returns the array of a component, without its padding.
    ///
    /// # Panics
    /// If there is no such component, or it has no array; likewise for the methods below.
    #[inline]
    pub fn words(&self, component: usize) -> &[u32] {
        let start = self.start_of(component);
        &self.memory()[start..start + self.lanes]
    }

    /// Returns the array of a component, with mutable access.
    #[inline]
    pub fn words_mut(&mut self, component: usize) -> &mut [u32] {
        let (start, lanes) = (self.start_of(component), self.lanes);
        &mut self.memory_mut()[start..start + lanes]
    }

    /// Returns the array of a component of type f32.
    #[inline]
    pub fn floats(&self, component: usize) -> &[f32] {
        let words = self.words(component);
        // Safety: f32 has the size and alignment of u32, and any bits are a value.
        unsafe { std::slice::from_raw_parts(words.as_ptr().cast(), words.len()) }
    }

    /// Returns the array of a component of type f32, with mutable access.
    #[inline]
    pub fn floats_mut(&mut self, component: usize) -> &mut [f32] {
        let words = self.words_mut(component);
        // Safety: as for `floats`; the words are borrowed mutably.
        unsafe { std::slice::from_raw_parts_mut(words.as_mut_ptr().cast(), words.len()) }
    }

    /// Returns `N` lanes of a component of type f32, from `start` on; padding may be among them.
    #[inline]
    pub fn floats_at<const N: usize>(&self, component: usize, start: usize) -> &[f32; N] {
        let array = self.lanes_at::<N>(component, start);
        // Safety: the range of lanes was checked; f32 has the size and alignment of u32.
        unsafe { &*array }
    }

    /// Like [`LaneBlock::floats_at`], with mutable access.
    #[inline]
    pub fn floats_mut_at<const N: usize>(
        &mut self,
        component: usize,
        start: usize,
    ) -> &mut [f32; N] {
        let array = self.lanes_at::<N>(component, start);
        // Safety: as for `floats_at`, and borrowed mutably along with the block.
        unsafe { &mut *array }
    }

    /// Returns `LANES` lanes of `N` consecutive components, such as those of a vector, from `start` on.
    #[inline]
    pub fn vectors_at<const N: usize, const LANES: usize>(
        &self,
        first: usize,
        start: usize,
    ) -> [&[f32; LANES]; N] {
        self.check_lanes(start, LANES);
        // Safety: the range of lanes was checked; f32 has the size and alignment of u32.
        self.arrays(first).map(|array| unsafe { &*array.add(start).cast() })
    }

    /// Like [`LaneBlock::vectors_at`], with mutable access.
    #[inline]
    pub fn vectors_mut_at<const N: usize, const LANES: usize>(
        &mut self,
        first: usize,
        start: usize,
    ) -> [&mut [f32; LANES]; N] {
        self.check_lanes(start, LANES);
        // Safety: as for `vectors_at`; the arrays do not overlap and are borrowed mutably along with the block.
        self.arrays(first).map(|array| unsafe { &mut *array.add(start).cast() })
    }

    /// Returns the address of `N` lanes of a component, all of which exist.
    #[inline]
    fn lanes_at<const N: usize>(&self, component: usize, start: usize) -> *mut [f32; N] {
        self.check_lanes(start, N);
        // Safety: the array has so many lanes.
        unsafe { self.array(component).add(start).cast() }
    }

    /// Returns the arrays of `N` consecutive components, such as those of a vector, with simultaneous mutable access.
    #[inline]
    pub fn vectors_mut<const N: usize>(&mut self, first: usize) -> [&mut [f32]; N] {
        let lanes = self.lanes;
        // Safety: the arrays have so many lanes and do not overlap; they are borrowed mutably along with the block;
        // f32 has the size and alignment of u32.
        self.arrays(first)
            .map(|start| unsafe { std::slice::from_raw_parts_mut(start.cast::<f32>(), lanes) })
    }

    /// Returns all arrays with their padding, contiguously.
    #[inline]
    pub fn memory(&self) -> &[u32] {
        self.memory.all()
    }

    /// Returns all arrays with their padding, with mutable access.
    #[inline]
    pub fn memory_mut(&mut self) -> &mut [u32] {
        self.memory.all_mut()
    }

    /// Returns all arrays with their padding as floats, with mutable access.
    #[inline]
    pub fn float_memory_mut(&mut self) -> &mut [f32] {
        let words = self.memory_mut();
        // Safety: as for `floats_mut`.
        unsafe { std::slice::from_raw_parts_mut(words.as_mut_ptr().cast(), words.len()) }
    }

    /// Returns the table of arrays for a kernel, which may read and write each up to the padding's end.
    #[inline]
    pub fn table_mut(&mut self) -> *const *mut u32 {
        self.table.as_ptr()
    }

    #[inline]
    fn array(&self, component: usize) -> *mut u32 {
        assert!(component < self.components(), "component {component} of {}", self.components());
        let array = self.table[component];
        assert!(!array.is_null(), "component {component} has no array");
        array
    }

    #[inline]
    fn check_lanes(&self, start: usize, count: usize) {
        let end = start.checked_add(count);
        assert!(end.is_some_and(|end| end <= self.stride), "lanes from {start} on");
    }

    /// Returns the arrays of consecutive components, with a single check for all of them.
    #[inline]
    fn arrays<const N: usize>(&self, first: usize) -> [*mut u32; N] {
        let arrays = self.table.get(first..).and_then(|rest| rest.first_chunk::<N>());
        let Some(arrays) = arrays else {
            panic!("components from {first} on, of {}", self.components())
        };
        if self.is_sparse() {
            assert!(arrays.iter().all(|array| !array.is_null()), "a component has no array");
        }
        *arrays
    }

    /// Returns the offset in the memory of a component's array, in words.
    #[inline]
    fn start_of(&self, component: usize) -> usize {
        (self.array(component).addr() - self.memory.words().addr()) / size_of::<u32>()
    }
}

impl LaneArrays for LaneBlock {
    #[inline(always)]
    fn lanes(&self) -> usize {
        self.lanes
    }

    #[inline(always)]
    fn missing_component(&self, components: &ComponentSet) -> Option<u32> {
        if self.has_all(components) {
            return None;
        }
        components.iter().find(|component| !self.present.contains(*component))
    }

    #[inline(always)]
    fn missing_array(&self, arrays: u32) -> Option<u32> {
        match self.table.get(..arrays as usize) {
            None => Some(self.components() as u32),
            Some(_) if !self.is_sparse() => None,
            Some(table) => table.iter().position(|array| array.is_null()).map(|it| it as u32),
        }
    }
}

impl Clone for LaneBlock {
    fn clone(&self) -> Self {
        let mut memory = Chunks::new(self.memory.count);
        memory.all_mut().copy_from_slice(self.memory());
        let moved = |array: &*mut u32| match array.is_null() {
            true => std::ptr::null_mut(),
            // Safety: the same offset from the start as in the original, which has the same size.
            false => unsafe { memory.words().byte_add(array.addr() - self.memory.words().addr()) },
        };
        let table = self.table.iter().map(moved).collect();
        let LaneBlock { present, dense, lanes, stride, .. } = *self;
        LaneBlock { memory, table, present, dense, lanes, stride }
    }
}

impl std::fmt::Debug for LaneBlock {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "LaneBlock({} components, {} lanes)", self.components(), self.lanes)
    }
}

/// A bool for each lane, in the form of kernels: words of 0 and -1.
pub struct LaneMask {
    words: Chunks,
    lanes: usize,
    /// All lanes outside of it are off.
    range: Range<usize>,
}

impl LaneMask {
    /// Returns a mask with all lanes false.
    pub fn new(lanes: usize) -> LaneMask {
        LaneMask { words: Chunks::new(lanes.div_ceil(PADDING)), lanes, range: 0..0 }
    }

    /// Returns the mask of the lanes for which `is_on` returns true.
    pub fn from_fn(lanes: usize, mut is_on: impl FnMut(usize) -> bool) -> LaneMask {
        let mut mask = LaneMask::new(lanes);
        (0..lanes).for_each(|lane| mask.set(lane, is_on(lane)));
        mask
    }

    /// Returns the number of lanes.
    #[inline]
    pub fn lanes(&self) -> usize {
        self.lanes
    }

    /// True if `lane` is on.
    ///
    /// # Panics
    /// If there is no such lane; likewise for the methods below.
    #[inline]
    pub fn get(&self, lane: usize) -> bool {
        self.words.all()[..self.lanes][lane] != 0
    }

    /// Sets a lane.
    #[inline]
    pub fn set(&mut self, lane: usize, is_on: bool) {
        let lanes = self.lanes;
        self.words.all_mut()[..lanes][lane] = if is_on { u32::MAX } else { 0 };
        let Range { start, end } = self.range;
        match is_on {
            true if self.range.is_empty() => self.range = lane..lane + 1,
            true => self.range = start.min(lane)..end.max(lane + 1),
            false => {}
        }
    }

    /// Sets all lanes.
    pub fn fill(&mut self, is_on: bool) {
        self.words_mut().fill(if is_on { u32::MAX } else { 0 });
    }

    /// Turns off all lanes, and returns those of a range to be set.
    pub fn begin_range(&mut self, range: Range<usize>) -> &mut [u32] {
        let before = std::mem::replace(&mut self.range, range.clone());
        let words = &mut self.words.all_mut()[..self.lanes];
        words[before].fill(0);
        &mut words[range]
    }

    /// Returns a range outside of which all lanes are off: kernels need not look there.
    #[inline]
    pub fn range(&self) -> Range<usize> {
        self.range.clone()
    }

    /// Returns the lanes in the form of kernels: 0 for false, all bits for true.
    #[inline]
    pub fn words(&self) -> &[u32] {
        &self.words.all()[..self.lanes]
    }

    /// Like [`LaneMask::words`], with mutable access.
    #[inline]
    pub fn words_mut(&mut self) -> &mut [u32] {
        let lanes = self.lanes;
        self.range = 0..lanes;
        &mut self.words.all_mut()[..lanes]
    }

    /// True if any lane is on.
    pub fn any(&self) -> bool {
        self.any_of(self.range())
    }

    /// True if any of these lanes is on.
    #[inline]
    pub fn any_of(&self, lanes: Range<usize>) -> bool {
        self.words.all()[..self.lanes][lanes].iter().any(|word| *word != 0)
    }

    /// Returns the lanes that are on, in order.
    pub fn iter_on(&self) -> impl Iterator<Item = usize> {
        let words = self.words.all()[..self.lanes].iter().enumerate();
        words.filter(|(_, word)| **word != 0).map(|(lane, _)| lane)
    }

    /// Returns the address of the first lane.
    #[inline]
    pub fn pointer(&self) -> *const i32 {
        self.words.words().cast_const().cast()
    }

    /// Returns the address of the first lane, through which kernels store accepted hits.
    #[inline]
    pub fn pointer_mut(&mut self) -> *mut i32 {
        self.range = 0..self.lanes;
        self.words.words().cast()
    }
}

// Safety: the memory is owned by the mask alone.
unsafe impl Send for LaneMask {}
// Safety: through a shared reference memory is only read.
unsafe impl Sync for LaneMask {}

/// The object index of each lane; initially 0.
pub struct LaneIndices {
    words: Chunks,
    lanes: usize,
}

impl LaneIndices {
    /// Returns indices of 0.
    pub fn new(lanes: usize) -> LaneIndices {
        LaneIndices { words: Chunks::new(lanes.div_ceil(PADDING)), lanes }
    }

    /// Returns the indices.
    #[inline]
    pub fn as_slice(&self) -> &[u32] {
        &self.words.all()[..self.lanes]
    }

    /// Returns the indices, with mutable access.
    #[inline]
    pub fn as_mut_slice(&mut self) -> &mut [u32] {
        let lanes = self.lanes;
        &mut self.words.all_mut()[..lanes]
    }

    /// Returns the address of the first lane's index.
    #[inline]
    pub fn pointer(&self) -> *const u32 {
        self.words.words()
    }
}

// Safety: the memory is owned by the indices alone.
unsafe impl Send for LaneIndices {}
// Safety: through a shared reference memory is only read.
unsafe impl Sync for LaneIndices {}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn arrays_are_apart_and_aligned() {
        let mut block = LaneBlock::new(3, 21);
        for component in 0..3 {
            assert_eq!(block.words(component).as_ptr() as usize % 64, 0);
            block.words_mut(component).fill(component as u32);
        }
        let [a, b] = block.vectors_mut::<2>(1);
        a[20] = 1.0;
        b[0] = 2.0;
        let [c, d] = block.vectors_mut_at::<2, 8>(1, 24);
        (c[7], d[0]) = (3.0, 4.0);
        let [c, d] = block.vectors_at::<2, 8>(1, 24);
        assert_eq!((c[7], d[0]), (3.0, 4.0));
        let copy = block.clone();
        assert_eq!(copy.words(0), [0; 21]);
        assert_eq!((copy.floats(1)[20], copy.words(1)[19]), (1.0, 1));
        assert_eq!((copy.floats(2)[0], copy.words(2)[1]), (2.0, 2));
        assert!(LaneBlock::new(0, 5).components() == 0 && LaneBlock::new(2, 0).words(1).is_empty());
    }

    #[test]
    fn masks_are_words_of_all_bits() {
        let mut mask = LaneMask::new(21);
        mask.words_mut()[20] = u32::MAX;
        mask.set(3, true);
        assert_eq!(mask.iter_on().collect::<Vec<_>>(), [3, 20]);
        assert!(mask.words()[3] == u32::MAX && mask.words().len() == 21);
        assert!(mask.any_of(18..21) && !mask.any_of(4..20));
    }

    #[test]
    fn lanes_outside_of_the_range_of_a_mask_are_off() {
        let mut mask = LaneMask::new(40);
        assert!(mask.range().is_empty());
        [7, 30, 9].into_iter().for_each(|lane| mask.set(lane, true));
        mask.set(35, false);
        assert_eq!(mask.range(), 7..31);
        mask.begin_range(16..32).fill(u32::MAX);
        assert!(mask.iter_on().eq(16..32) && mask.range() == (16..32));
        mask.begin_range(3..3);
        assert!(!mask.any() && mask.iter_on().next().is_none());
        mask.fill(true);
        assert_eq!(mask.range(), 0..40);
        mask.begin_range(0..1);
        mask.pointer_mut();
        assert_eq!(mask.range(), 0..40, "machine code may store to any lane");
    }

    #[test]
    fn sparse_arrays_lie_in_the_order_in_which_they_are_named() {
        let mut block = LaneBlock::sparse(9, &[7, 2], 20);
        block.words_mut(7).fill(1);
        block.words_mut(2).fill(2);
        let copy = block.clone();
        assert_eq!((copy.components(), copy.memory().len()), (9, 64));
        assert_eq!((copy.memory()[19], copy.memory()[32]), (1, 2));
        assert_eq!((copy.words(7), copy.words(2)), ([1; 20].as_slice(), [2; 20].as_slice()));
        assert!(copy.has_all(&ComponentSet::from_iter([2])));
        assert!(!copy.has_all(&ComponentSet::from_iter([2, 3])));
    }

    #[test]
    fn sizes_that_overflow_get_no_memory() {
        let refused = |make: fn() -> LaneBlock| std::panic::catch_unwind(make).is_err();
        assert!(refused(|| LaneBlock::new(4, 1 << 62)));
        assert!(refused(|| LaneBlock::new(3, usize::MAX)));
        assert!(refused(|| LaneBlock::new(usize::MAX, 17)));
        assert!(refused(|| LaneBlock::sparse(9, &[7, 2], 1 << 63)));
        assert!(refused(|| LaneBlock::sparse(9, &[7, 2, 1, 0], 1 << 62)));
        assert!(refused(|| LaneBlock::new(1, usize::MAX)));
        assert!(std::panic::catch_unwind(|| LaneMask::new(usize::MAX)).is_err());
        assert!(std::panic::catch_unwind(|| LaneIndices::new(usize::MAX)).is_err());
    }

    #[test]
    fn arrays_that_are_missing_are_named() {
        let block = LaneBlock::sparse(9, &[7, 0], 20);
        assert_eq!(block.missing_array(1), None);
        assert_eq!((block.missing_array(2), block.missing_array(10)), (Some(1), Some(9)));
        assert_eq!(block.missing_component(&ComponentSet::from_iter([0, 7, 8])), Some(8));
        assert_eq!(LaneBlock::new(3, 0).missing_array(3), None);
    }

    #[test]
    #[should_panic(expected = "component 3 has no array")]
    fn a_component_without_an_array_is_not_read() {
        LaneBlock::sparse(9, &[7, 2], 20).words(3);
    }
}
