//! Sets of paths by what they wait for.

use super::path_set::PathSet;

/// The greatest number of keys for which vectors of paths are compared with each: of more, paths are sorted singly.
const MAX_COMPARED_KEYS: usize = 8;

/// Sets of paths by keys.
#[derive(Default)]
pub struct PathSets {
    sets: Vec<PathSet>,
    keys: usize,
}

impl PathSets {
    /// Sorts paths by their keys in a column. Paths whose keys are not below `keys` are in no set.
    pub fn sort(&mut self, paths: &PathSet, column: &[u32], keys: usize) {
        self.keys = keys;
        self.sets.resize_with(keys.max(self.sets.len()), PathSet::default);
        let sets = &mut self.sets[..keys];
        if keys <= MAX_COMPARED_KEYS {
            let keys = 0..keys as u32;
            sets.iter_mut().zip(keys).for_each(|(set, key)| set.set_equal(paths, column, key));
            return;
        }
        sets.iter_mut().for_each(|set| set.clear(column.len()));
        for path in paths.paths() {
            if let Some(set) = sets.get_mut(column[*path as usize] as usize) {
                set.push(*path);
            }
        }
    }

    /// Returns the sets that are not empty, with their keys.
    pub fn sets(&self) -> impl Iterator<Item = (usize, &PathSet)> {
        let sets = self.sets[..self.keys].iter().enumerate();
        sets.filter(|(_, set)| !set.is_empty())
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
            sets.sort(&paths, &column, keys);
            let found: Vec<(usize, &[u32])> =
                sets.sets().map(|(key, set)| (key, set.paths())).collect();
            assert_eq!(found.len(), keys);
            for (key, found) in found {
                let expected = (0..50).filter(|path| column[*path as usize] == key as u32);
                assert!(found.iter().copied().eq(expected), "{key}");
            }
        }
        sets.sort(&paths, &[9; 50], 9);
        assert_eq!(sets.sets().count(), 0);
    }
}
