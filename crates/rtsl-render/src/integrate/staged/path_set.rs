//! Sets of a wavefront's paths.

use std::cell::{OnceCell, RefCell};
use std::ops::Range;

use fearless_simd::prelude::*;
use fearless_simd::{Level, Simd, SimdBase, dispatch, f32x16, u32x16};
use rtsl::LaneMask;
use rtsl_bvh::LaneMask as PacketMask;

/// The number of paths in a vector.
pub const VECTOR_PATHS: usize = 16;

/// A set of paths, as masks of vectors and, once anyone asks for it, as a list in ascending order. The paths are also
/// the lanes of columns, of which the set selects numbers.
#[derive(Clone, Debug, Default)]
pub struct PathSet {
    /// The index of the vector of the first mask.
    first: usize,
    /// A mask for each vector from that one on. All other vectors have no paths.
    masks: Vec<u16>,
    count: usize,
    list: OnceCell<Vec<u32>>,
    /// Memory for the next list.
    spare: RefCell<Vec<u32>>,
}

impl PathSet {
    /// Returns the set of all of so many paths.
    pub fn all(count: usize) -> PathSet {
        let mut set = PathSet::default();
        set.set_all(count);
        set
    }

    /// Returns the set with these masks, each of which is for 64 paths.
    pub fn of_packets(masks: &[PacketMask]) -> PathSet {
        let mut set = PathSet::default();
        let vectors = |mask: &PacketMask| [0, 16, 32, 48].map(|shift| (mask >> shift) as u16);
        set.masks.extend(masks.iter().flat_map(vectors));
        set.masks_are_set();
        set
    }

    /// The number of paths.
    pub fn len(&self) -> usize {
        self.count
    }

    /// True if it has no paths.
    pub fn is_empty(&self) -> bool {
        self.count == 0
    }

    /// The paths, in ascending order.
    pub fn paths(&self) -> &[u32] {
        self.list.get_or_init(|| {
            let mut list = self.spare.take();
            list.clear();
            dispatch!(Level::new(), simd => self.add_to_list(simd, &mut list));
            list
        })
    }

    /// The end of the lanes of its vectors.
    pub fn lanes(&self) -> usize {
        self.range().end
    }

    /// Returns the lanes of the vectors that may have paths.
    pub fn range(&self) -> Range<usize> {
        self.first * VECTOR_PATHS..(self.first + self.masks.len()) * VECTOR_PATHS
    }

    /// Makes it the set of all of so many paths.
    pub fn set_all(&mut self, count: usize) {
        self.clear();
        self.masks.resize(count / VECTOR_PATHS, u16::MAX);
        let rest = count % VECTOR_PATHS;
        self.masks.extend((rest > 0).then_some(!(u16::MAX << rest)));
        self.masks_are_set();
    }

    /// Makes it the set of so many paths from `start` on.
    pub fn set_range(&mut self, start: usize, count: usize) {
        self.clear();
        self.first = start / VECTOR_PATHS;
        let end = start + count;
        let below = |end: usize, vector: usize| {
            let lanes = end.saturating_sub(vector * VECTOR_PATHS).min(VECTOR_PATHS);
            ((1_u32 << lanes) - 1) as u16
        };
        let vectors = self.first..end.div_ceil(VECTOR_PATHS);
        self.masks.extend(vectors.map(|vector| below(end, vector) & !below(start, vector)));
        self.count = count;
    }

    /// Makes it the set of the paths of all these sets.
    pub fn set_union<'a>(&mut self, sets: impl Iterator<Item = &'a PathSet>) {
        self.clear();
        for PathSet { first, masks, .. } in sets {
            self.masks.resize(self.masks.len().max(first + masks.len()), 0);
            let all = self.masks[*first..].iter_mut();
            all.zip(masks).for_each(|(mask, of_set)| *mask |= of_set);
        }
        self.masks_are_set();
    }

    /// Makes it an empty set.
    pub fn clear(&mut self) {
        self.first = 0;
        self.masks.clear();
        self.count = 0;
        self.forget_list();
    }

    /// Adds a path after all that it has.
    #[inline]
    pub fn push(&mut self, path: u32) {
        let (vector, lane) = (path as usize / VECTOR_PATHS, path as usize % VECTOR_PATHS);
        if self.count == 0 {
            self.clear();
            self.first = vector;
            let mut list = self.spare.take();
            list.clear();
            self.list = OnceCell::from(list);
        }
        let index = vector - self.first;
        if index >= self.masks.len() {
            self.masks.resize(index + 1, 0);
        }
        self.masks[index] |= 1 << lane;
        self.count += 1;
        if let Some(list) = self.list.get_mut() {
            list.push(path);
        }
    }

    /// Makes it the set of those of other paths whose word in a column is `key`.
    pub fn set_equal(&mut self, others: &PathSet, column: &[u32], key: u32) {
        dispatch!(Level::new(), simd => self.select(simd, others, |start| {
            let words: u32x16<_> = vector(simd, column, start);
            words.simd_eq(key).to_bitmask() as u16
        }));
        self.masks_are_set();
    }

    /// Makes it the set of those of other paths with a number in any of three columns that is not 0.
    pub fn set_nonzero(&mut self, others: &PathSet, columns: [&[f32]; 3]) {
        let [x, y, z] = columns;
        dispatch!(Level::new(), simd => self.select(simd, others, |start| {
            let x: f32x16<_> = vector(simd, x, start);
            let y: f32x16<_> = vector(simd, y, start);
            let z: f32x16<_> = vector(simd, z, start);
            let is_zero = x.simd_eq(0.0) & y.simd_eq(0.0) & z.simd_eq(0.0);
            !is_zero.to_bitmask() as u16
        }));
        self.masks_are_set();
    }

    /// Makes it the set of those of other paths whose number in a column is neither 0 nor less than a cutoff, as NaN is.
    pub fn set_followed(&mut self, others: &PathSet, column: &[f32], cutoff: f32) {
        dispatch!(Level::new(), simd => self.select(simd, others, |start| {
            let numbers: f32x16<_> = vector(simd, column, start);
            let is_left_out = numbers.simd_lt(cutoff) | numbers.simd_eq(0.0);
            !is_left_out.to_bitmask() as u16
        }));
        self.masks_are_set();
    }

    /// Appends the numbers of the paths in columns.
    pub fn append<'a>(&self, columns: impl IntoIterator<Item = (&'a [f32], &'a mut Vec<f32>)>) {
        if are_sparse(self.count, self.vectors()) {
            return self.append_each(columns);
        }
        dispatch!(Level::new(), simd => for (column, to) in columns {
            append::<_, f32x16<_>>(simd, self, |start| vector(simd, column, start), to);
        });
    }

    /// Appends the words of the paths in columns.
    pub fn append_words<'a>(
        &self,
        columns: impl IntoIterator<Item = (&'a [u32], &'a mut Vec<u32>)>,
    ) {
        if are_sparse(self.count, self.vectors()) {
            return self.append_each(columns);
        }
        dispatch!(Level::new(), simd => for (column, to) in columns {
            append::<_, u32x16<_>>(simd, self, |start| vector(simd, column, start), to);
        });
    }

    /// Returns the number of lanes of the vectors of so many paths that contain any of these: a power of two, up to 16.
    pub fn lanes_of_vectors(&self, width: usize) -> usize {
        let vector = u16::MAX >> (VECTOR_PATHS - width);
        let starts = || (0..VECTOR_PATHS).step_by(width);
        let vectors = |mask: &u16| starts().filter(|start| mask >> start & vector != 0).count();
        self.masks.iter().map(vectors).sum::<usize>() * width
    }

    /// Copies the words of the paths in a column to adjacent lanes, with room for a vector more.
    #[inline(always)]
    pub fn copy<S: Simd>(&self, simd: S, column: &[u32], to: &mut [u32]) {
        compress(simd, self, |start| vector::<S, u32x16<S>>(simd, column, start), to);
    }

    /// Returns the sum of numbers that are made of the words of the paths in a column.
    pub fn sum(&self, column: &[u32], number: impl Fn(u32) -> u64) -> u64 {
        let sum_of = |(mask, words): (&u16, &[u32])| -> u64 {
            let numbers = words.iter().map(|word| number(*word));
            match *mask {
                u16::MAX => numbers.sum(),
                mask => numbers
                    .enumerate()
                    .filter(|(lane, _)| mask >> lane & 1 != 0)
                    .map(|it| it.1)
                    .sum(),
            }
        };
        let Range { start, end } = self.range();
        let vectors = column[start..end.min(column.len())].chunks(VECTOR_PATHS);
        self.masks.iter().zip(vectors).map(sum_of).sum()
    }

    /// Makes it the same set as another.
    pub fn set_same(&mut self, other: &PathSet) {
        self.clear();
        self.first = other.first;
        self.masks.extend_from_slice(&other.masks);
        self.count = other.count;
    }

    /// Sets the numbers of other paths in a column to 0.
    pub fn clear_others(&self, column: &mut [f32]) {
        let (before, column) = column.split_at_mut(self.range().start);
        before.fill(0.0);
        for (mask, numbers) in self.masks.iter().zip(column.chunks_mut(VECTOR_PATHS)) {
            if *mask == u16::MAX {
                continue;
            }
            let lanes = numbers.iter_mut().enumerate();
            let others = lanes.filter(|(lane, _)| mask >> lane & 1 == 0);
            others.for_each(|(_, number)| *number = 0.0);
        }
    }

    /// Makes it the mask of kernels for so many lanes.
    pub fn store_mask(&self, mask: &mut LaneMask, lanes: usize) {
        let Range { start, end } = self.range();
        let words = mask.begin_range(start.min(lanes)..end.min(lanes));
        dispatch!(Level::new(), simd => store_words(simd, &self.masks, words));
    }

    /// The number of vectors with paths.
    pub fn vectors(&self) -> usize {
        self.masks.iter().filter(|mask| **mask != 0).count()
    }

    fn append_each<'a, T: Copy + 'a>(
        &self,
        columns: impl IntoIterator<Item = (&'a [T], &'a mut Vec<T>)>,
    ) {
        let paths = self.paths();
        for (column, to) in columns {
            to.extend(paths.iter().map(|path| column[*path as usize]));
        }
    }

    /// Counts the paths after the masks have changed.
    fn masks_are_set(&mut self) {
        self.count = self.masks.iter().map(|mask| mask.count_ones() as usize).sum();
        self.forget_list();
    }

    fn forget_list(&mut self) {
        if let Some(list) = self.list.take() {
            self.spare.replace(list);
        }
    }

    /// Makes it the set of those of other paths that a test selects, vector by vector, given the first path.
    #[inline(always)]
    fn select<S: Simd>(&mut self, _: S, others: &PathSet, test: impl Fn(usize) -> u16) {
        self.masks.clear();
        self.first = others.first;
        self.masks.extend_from_slice(&others.masks);
        // A loop, because calls of closures by iterators leave the code for vectors.
        for (index, mask) in self.masks.iter_mut().enumerate() {
            if *mask != 0 {
                *mask &= test((others.first + index) * VECTOR_PATHS);
            }
        }
    }

    /// Appends the paths of the masks to a list.
    #[inline(always)]
    fn add_to_list<S: Simd>(&self, simd: S, list: &mut Vec<u32>) {
        let lanes = u32x16::from_fn(simd, |lane| lane as u32);
        append::<S, u32x16<S>>(simd, self, |start| lanes + start as u32, list);
    }
}

/// True if so few paths are in so many vectors that they are copied faster one by one.
pub fn are_sparse(paths: usize, vectors: usize) -> bool {
    // Without an instruction for it, a vector takes about as long to compress as all its paths do, one by one: with 14
    // instead of 4, glue takes a sixth less time in public scenes on a Zen processor.
    let few_paths = if Level::new().as_avx512().is_some() { 4 } else { 14 };
    paths < few_paths * vectors
}

/// Stores masks of vectors as words.
#[inline(always)]
fn store_words<S: Simd>(simd: S, masks: &[u16], words: &mut [u32]) {
    let (on, off) = (u32x16::splat(simd, u32::MAX), u32x16::splat(simd, 0));
    for (words, mask) in words.chunks_mut(VECTOR_PATHS).zip(masks) {
        let lanes =
            <u32x16<S> as SimdBase<S>>::Mask::from_bitmask(simd, u64::from(*mask)).select(on, off);
        match words.len() {
            VECTOR_PATHS => lanes.store_slice(words),
            count => words.copy_from_slice(&lanes.as_slice()[..count]),
        }
    }
}

/// Appends the lanes of paths in vectors. `vector` returns the vector that begins with a lane.
#[inline(always)]
fn append<S: Simd, V: SimdBase<S>>(
    simd: S,
    paths: &PathSet,
    vector: impl Fn(usize) -> V,
    to: &mut Vec<V::Element>,
) where
    V::Element: Default,
{
    let (start, end) = (to.len(), to.len() + paths.count);
    to.resize(end + VECTOR_PATHS, V::Element::default());
    compress(simd, paths, vector, &mut to[start..]);
    to.truncate(end);
}

/// The same to the lanes of a slice, which has room for a vector more.
#[inline(always)]
fn compress<S: Simd, V: SimdBase<S>>(
    simd: S,
    paths: &PathSet,
    vector: impl Fn(usize) -> V,
    to: &mut [V::Element],
) {
    // Whole vectors are stored, each over the end of the one before.
    let mut end = 0;
    for (index, mask) in (paths.first..).zip(&paths.masks) {
        if *mask == 0 {
            continue;
        }
        let selected = V::Mask::from_bitmask(simd, u64::from(*mask));
        let lanes = vector(index * VECTOR_PATHS).compress(selected);
        lanes.store_slice(&mut to[end..end + VECTOR_PATHS]);
        end += mask.count_ones() as usize;
    }
}

/// Loads the vector of a column that begins with a lane; lanes that the column lacks are 0.
#[inline(always)]
fn vector<S: Simd, V: SimdBase<S>>(simd: S, column: &[V::Element], start: usize) -> V
where
    V::Element: Default,
{
    match column.get(start..start + VECTOR_PATHS) {
        Some(lanes) => V::from_slice(simd, lanes),
        None => V::from_fn(simd, |lane| column.get(start + lane).copied().unwrap_or_default()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::integrate::host::is_followed;

    /// A count that leaves a vector incomplete.
    const COUNT: usize = 75;

    #[test]
    fn paths_are_selected_by_their_words() {
        let column: Vec<u32> = (0..COUNT as u32).map(|path| path % 3).collect();
        let mut set = PathSet::default();
        set.set_equal(&PathSet::all(COUNT), &column, 2);
        let expected: Vec<u32> = (0..COUNT as u32).filter(|path| path % 3 == 2).collect();
        assert_eq!(set.paths(), expected);
        let mut ends = PathSet::default();
        ends.set_equal(&set, &column, 1);
        assert_eq!(ends.paths(), [0; 0]);
    }

    #[test]
    fn numbers_other_than_zero_are_found_in_any_column() {
        let mut columns = [const { [0.0; COUNT] }; 3];
        (columns[0][3], columns[1][40], columns[2][74]) = (1.0, f32::NAN, -1.0);
        columns[1][5] = -0.0;
        let mut set = PathSet::default();
        set.set_nonzero(&PathSet::all(COUNT), columns.each_ref().map(|it| &it[..]));
        assert_eq!(set.paths(), [3, 40, 74]);
        let mut numbers = vec![];
        set.append([(&columns[2][..], &mut numbers)]);
        assert_eq!(numbers, [0.0, 0.0, -1.0]);
        let (words, mut appended) = (Vec::from_iter(100..100 + COUNT as u32), vec![7]);
        set.append_words([(&words[..], &mut appended)]);
        assert_eq!(appended, [7, 103, 140, 174]);
    }

    #[test]
    fn vectors_are_followed_as_single_paths_are() {
        let numbers = [0.5, 0.25, 0.249, 0.0, -0.0, -1.0, f32::NAN, f32::INFINITY, 1e-30];
        for cutoff in [0.0, 0.25] {
            let mut set = PathSet::default();
            set.set_followed(&PathSet::all(numbers.len()), &numbers, cutoff);
            let all = (0..).zip(numbers);
            let expected = all.filter(|(_, number)| is_followed(*number, cutoff)).map(|it| it.0);
            assert_eq!(set.paths(), expected.collect::<Vec<u32>>(), "{cutoff}");
        }
    }

    #[test]
    fn sets_are_made_in_several_ways() {
        let mask = 0x8000_0000_0001_0004;
        let set = PathSet::of_packets(&[0, mask]);
        assert_eq!(set.paths(), [66, 80, 127]);
        let mut column = [1.0; 128];
        set.clear_others(&mut column);
        assert!((0..128).all(|path| (column[path as usize] == 1.0) == set.paths().contains(&path)));
        let mut pushed = PathSet::default();
        set.paths().iter().for_each(|path| pushed.push(*path));
        assert_eq!((pushed.len(), pushed.range()), (3, 64..128));
        let words: Vec<u32> = (0..128).collect();
        assert_eq!(set.sum(&words, u64::from), 66 + 80 + 127);
        assert_eq!(PathSet::all(COUNT).sum(&words, |word| u64::from(word > 70)), 4);
        assert_eq!(pushed.paths(), set.paths());
        let mut range = PathSet::default();
        range.set_range(20, 30);
        assert_eq!((range.len(), range.lanes()), (30, 64));
        assert!(range.paths().iter().copied().eq(20..50));
        range.set_range(32, 16);
        assert!(range.paths().iter().copied().eq(32..48));
        let mut union = PathSet::default();
        union.set_union([&set, &range].into_iter());
        assert_eq!(union.len(), 19);
        assert!(union.paths().iter().all(|it| set.paths().contains(it) || (32..48).contains(it)));
        let mut mask = LaneMask::new(130);
        for set in [&set, &pushed] {
            mask.fill(true);
            set.store_mask(&mut mask, 130);
            assert!((0..130).all(|path| mask.get(path) == set.paths().contains(&(path as u32))));
        }
        assert_eq!(mask.range(), 64..128);
    }

    #[test]
    fn lanes_are_counted_by_vectors() {
        let set = PathSet::of_packets(&[0x8001_0001]);
        let lanes = [1, 4, 8, 16].map(|width| set.lanes_of_vectors(width));
        assert_eq!(lanes, [3, 12, 24, 32]);
    }

    #[test]
    fn words_are_copied_to_adjacent_lanes() {
        let column: Vec<u32> = (100..228).collect();
        for masks in [[0x0000_FFF0, 0xFFFF], [0x8000_0100, 3 << 40]] {
            let set = PathSet::of_packets(&masks);
            let mut copied = vec![7; set.len() + VECTOR_PATHS];
            dispatch!(Level::new(), simd => set.copy(simd, &column, &mut copied));
            let expected = set.paths().iter().map(|path| path + 100);
            assert!(copied[..set.len()].iter().copied().eq(expected));
        }
    }
}
