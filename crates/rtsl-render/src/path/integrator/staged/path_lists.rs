//! Lists of paths by what they wait for.

/// Lists of paths by keys. Each list keeps the order in which the paths were given.
#[derive(Default)]
pub struct PathLists {
    keys: Vec<u32>,
    /// The end of the list of each key in `paths`.
    ends: Vec<usize>,
    paths: Vec<u32>,
}

impl PathLists {
    /// Sorts paths by a key less than `keys`.
    pub fn sort(&mut self, paths: &[u32], keys: usize, key: impl Fn(u32) -> u32) {
        let PathLists { keys: of_paths, ends, paths: sorted } = self;
        of_paths.clear();
        of_paths.extend(paths.iter().map(|path| key(*path)));
        ends.clear();
        ends.resize(keys, 0);
        sorted.clear();
        let first = of_paths.first().copied().unwrap_or(0);
        if of_paths.iter().all(|key| *key == first) {
            sorted.extend_from_slice(paths);
            ends[first as usize..].fill(paths.len());
            return;
        }
        of_paths.iter().for_each(|key| ends[*key as usize] += 1);
        let mut next = 0;
        for end in ends.iter_mut() {
            (*end, next) = (next, next + *end);
        }
        sorted.resize(paths.len(), 0);
        for (path, key) in paths.iter().zip(of_paths) {
            let place = &mut ends[*key as usize];
            sorted[*place] = *path;
            *place += 1;
        }
    }

    /// Returns the paths whose keys are less than this.
    pub fn below(&self, key: usize) -> &[u32] {
        &self.paths[..key.checked_sub(1).map_or(0, |last| self.ends[last])]
    }

    /// Returns the lists of keys less than this that are not empty, with their keys.
    pub fn lists(&self, keys: usize) -> impl Iterator<Item = (usize, &[u32])> {
        let list = |key: usize| &self.paths[self.below(key).len()..self.ends[key]];
        (0..keys).map(move |key| (key, list(key))).filter(|(_, list)| !list.is_empty())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lists_keep_their_order() {
        let mut lists = PathLists::default();
        for _ in 0..2 {
            lists.sort(&[7, 1, 4, 9, 2], 4, |path| path % 3);
            let expected: [(usize, &[u32]); 2] = [(0, &[9]), (1, &[7, 1, 4])];
            assert!(lists.lists(2).eq(expected));
            assert_eq!((lists.below(0), lists.below(2)), (&[][..], &[9, 7, 1, 4][..]));
            lists.sort(&[5, 2], 4, |path| path % 3);
            assert!(lists.lists(4).eq([(2, &[5, 2][..])]));
            assert_eq!(lists.below(2), &[0; 0]);
        }
    }
}
