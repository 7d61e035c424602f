//! Sets of paths by what they wait for.

use std::ops::Range;

use fearless_simd::{Level, Simd, dispatch};
use rtsl::LaneBlock;

use super::path_set::{PathSet, VECTOR_PATHS, are_sparse};

/// The greatest number of keys for which vectors of paths are compared with each: of more, paths are sorted singly.
const MAX_COMPARED_KEYS: usize = 8;

/// Sets of paths by keys.
#[derive(Default)]
pub struct PathSets {
    sets: Vec<PathSet>,
    keys: usize,
    /// Memory for the lanes that are copied.
    copied: Vec<u32>,
}

impl PathSets {
    /// Makes the sets of so many keys empty.
    pub fn begin(&mut self, keys: usize) {
        self.keys = keys;
        self.sets.resize_with(keys.max(self.sets.len()), PathSet::default);
        self.sets[..keys].iter_mut().for_each(PathSet::clear);
    }

    /// Sorts paths into the sets of some keys. A column has the index of each path's set among these; paths with other
    /// indices are in no set.
    pub fn sort(&mut self, paths: &PathSet, column: &[u32], keys: Range<usize>) {
        let sets = &mut self.sets[keys];
        if sets.len() <= MAX_COMPARED_KEYS {
            sets.iter_mut().zip(0..).for_each(|(set, index)| set.set_equal(paths, column, index));
            return;
        }
        for path in paths.paths() {
            if let Some(set) = sets.get_mut(column[*path as usize] as usize) {
                set.push(*path);
            }
        }
    }

    /// Makes these paths the set of a key.
    pub fn set(&mut self, key: usize, paths: &PathSet) {
        self.sets[key].set_same(paths);
    }

    /// Makes the sets of keys empty that a test rejects.
    pub fn retain(&mut self, keeps: impl Fn(usize) -> bool) {
        let sets = self.sets[..self.keys].iter_mut().enumerate();
        sets.filter(|(key, _)| !keeps(*key)).for_each(|(_, set)| set.clear());
    }

    /// Returns the sets that are not empty, with their keys.
    pub fn sets(&self) -> impl Iterator<Item = (usize, &PathSet)> {
        let sets = self.sets[..self.keys].iter().enumerate();
        sets.filter(|(_, set)| !set.is_empty())
    }

    /// Returns the first lane of each set that is not empty, if all are to be adjacent in so many lanes: that of a vector
    /// if there is room.
    pub fn starts(&self, lanes: usize) -> Vec<usize> {
        let places = |granularity: usize| {
            self.sets().scan(0, move |end, (_, set)| {
                let start = *end;
                *end = (start + set.len()).next_multiple_of(granularity);
                Some((start, *end))
            })
        };
        let has_room = places(VECTOR_PATHS).last().is_none_or(|(_, end)| end <= lanes);
        places(if has_room { VECTOR_PATHS } else { 1 }).map(|(start, _)| start).collect()
    }

    /// Copies arrays of the paths of each set that is not empty to lanes from its start on.
    pub fn copy(
        &mut self,
        starts: &[usize],
        arrays: impl Iterator<Item = usize>,
        from: &LaneBlock,
        to: &mut LaneBlock,
    ) {
        let numbers = self.sets().map(|(_, set)| (set.len(), set.vectors()));
        let (paths, vectors) = numbers.fold((0, 0), |all, set| (all.0 + set.0, all.1 + set.1));
        if !are_sparse(paths, vectors) {
            return dispatch!(Level::new(), simd => self.copy_vectors(simd, starts, arrays, from, to));
        }
        let mut copied = std::mem::take(&mut self.copied);
        copied.clear();
        for ((_, set), start) in self.sets().zip(starts) {
            // Lanes between sets get those of any path.
            copied.resize(*start, 0);
            copied.extend_from_slice(set.paths());
        }
        for array in arrays {
            let from = from.words(array);
            let to = to.words_mut(array).iter_mut().zip(&copied);
            to.for_each(|(to, lane)| *to = from[*lane as usize]);
        }
        self.copied = copied;
    }

    /// Makes the sets that are not empty those of as many adjacent paths, from their starts on.
    pub fn set_ranges(&mut self, starts: &[usize]) {
        let sets = self.sets[..self.keys].iter_mut().filter(|set| !set.is_empty());
        sets.zip(starts).for_each(|(set, start)| set.set_range(*start, set.len()));
    }

    #[inline(always)]
    fn copy_vectors<S: Simd>(
        &self,
        simd: S,
        starts: &[usize],
        arrays: impl Iterator<Item = usize>,
        from: &LaneBlock,
        to: &mut LaneBlock,
    ) {
        for array in arrays {
            let (from, to) = (from.words(array), to.words_mut(array));
            for ((_, set), start) in self.sets().zip(starts) {
                set.copy(simd, from, &mut to[*start..]);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn few_and_many_keys_give_the_same_sets() {
        let column: Vec<u32> = (0..50).map(|path| path * 7 % 11).collect();
        let paths = PathSet::all(column.len());
        let mut sets = PathSets::default();
        for keys in [3, 10] {
            sets.begin(keys + 1);
            sets.sort(&paths, &column, 1..keys + 1);
            let found: Vec<(usize, &[u32])> =
                sets.sets().map(|(key, set)| (key, set.paths())).collect();
            assert_eq!(found.len(), keys);
            for (key, found) in found {
                let expected = (0..50).filter(|path| column[*path as usize] + 1 == key as u32);
                assert!(found.iter().copied().eq(expected), "{key}");
            }
        }
        sets.begin(9);
        sets.sort(&paths, &[9; 50], 0..9);
        assert_eq!(sets.sets().count(), 0);
    }

    #[test]
    fn sets_are_moved_to_adjacent_lanes() {
        const LANES: usize = 80;
        let mut column = LaneBlock::new(1, LANES + VECTOR_PATHS);
        for (path, word) in column.words_mut(0).iter_mut().enumerate() {
            *word = 100 + path as u32;
        }
        let keys: Vec<u32> = (0..40).map(|path| path % 3).collect();
        for (lanes, expected) in [(LANES, [0, 16]), (30, [0, 14])] {
            let mut sets = PathSets::default();
            sets.begin(4);
            sets.sort(&PathSet::all(keys.len()), &keys, 0..2);
            let before: Vec<Vec<u32>> = sets.sets().map(|(_, set)| set.paths().to_vec()).collect();
            let starts = sets.starts(lanes);
            assert_eq!(starts, expected);
            let mut moved = LaneBlock::new(1, LANES + VECTOR_PATHS);
            sets.copy(&starts, [0].into_iter(), &column, &mut moved);
            sets.set_ranges(&starts);
            for (((_, set), start), before) in sets.sets().zip(&starts).zip(before) {
                assert_eq!(set.paths()[0] as usize, *start);
                let words = set.paths().iter().map(|lane| moved.words(0)[*lane as usize] - 100);
                assert!(words.eq(before));
            }
        }
    }
}
