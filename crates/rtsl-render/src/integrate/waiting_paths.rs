//! Spawned paths that wait until they are followed.
//!
//! The columns stay where kernels have appended them, wavefront after wavefront; only indices are sorted. Moving the
//! columns and allocating them anew for each depth took a seventh of the time of three-spheres.

use std::mem;

use super::spawned_paths::SpawnedPaths;

/// Spawned paths whose parents are samples, in the order in which the light of these is added.
#[derive(Default)]
pub struct WaitingPaths {
    /// The paths, in any order. Those that are not ordered yet are the last.
    pub paths: SpawnedPaths,
    /// The indices of the paths, in the order of their light.
    pub order: Vec<u32>,
    /// Memory for sorting.
    places: Vec<u32>,
}

impl WaitingPaths {
    /// Returns the number of paths.
    pub fn len(&self) -> usize {
        self.order.len()
    }

    /// The number of paths for which it has memory.
    pub fn capacity(&self) -> usize {
        self.order.capacity().max(self.paths.parents.capacity())
    }

    /// Removes all paths.
    pub fn clear(&mut self) {
        self.paths.clear();
        self.order.clear();
    }

    /// Orders the last paths, which so many parents have spawned, by these; those of one parent stay in their order.
    /// `sample` returns the sample of a parent.
    pub fn order_last(&mut self, parents: usize, sample: impl Fn(u32) -> u32) {
        let WaitingPaths { paths, order, places } = self;
        let first = order.len();
        let spawned = &mut paths.parents[first..];
        if spawned.is_sorted() {
            order.extend(first as u32..paths.parents.len() as u32);
        } else {
            // The places of the paths of each parent begin where those of the parents before end.
            places.clear();
            places.resize(parents, 0);
            spawned.iter().for_each(|parent| places[*parent as usize] += 1);
            let mut end = first as u32;
            places.iter_mut().for_each(|place| end += mem::replace(place, end));
            order.resize(end as usize, 0);
            for (index, parent) in (first as u32..).zip(&*spawned) {
                let place = &mut places[*parent as usize];
                order[*place as usize] = index;
                *place += 1;
            }
        }
        paths.parents[first..].iter_mut().for_each(|parent| *parent = sample(*parent));
    }

    /// Appends others, and leaves none there.
    pub fn append(&mut self, others: &mut WaitingPaths) {
        if self.len() == 0 {
            return mem::swap(self, others);
        }
        let first = self.paths.len() as u32;
        self.order.extend(others.order.drain(..).map(|index| first + index));
        self.paths.append(&mut others.paths, |parent| parent);
    }

    /// Returns the least depth of a path.
    pub fn least_depth(&self) -> Option<u32> {
        self.paths.depths.iter().copied().min()
    }

    /// Moves the paths of one depth to others, of which there are none yet.
    pub fn take_depth(&mut self, depth: u32, to: &mut WaitingPaths) {
        if self.paths.depths.iter().all(|it| *it == depth) {
            return mem::swap(self, to);
        }
        *to = self.split_off(|paths, index| paths.depths[index] == depth);
    }

    /// Splits off the paths of about half of the samples, the later ones; `None` if there is one sample.
    pub fn split_off_samples(&mut self) -> Option<WaitingPaths> {
        let samples = &self.paths.parents;
        let (least, greatest) = (samples.iter().copied().min()?, samples.iter().copied().max()?);
        let middle = least + (greatest - least).div_ceil(2);
        (greatest > least).then(|| self.split_off(|paths, index| paths.parents[index] >= middle))
    }

    fn split_off(&mut self, is_taken: impl Fn(&SpawnedPaths, usize) -> bool) -> WaitingPaths {
        let (all, mut taken) = (mem::take(self), WaitingPaths::default());
        for index in all.order {
            let is_taken = is_taken(&all.paths, index as usize);
            let to = if is_taken { &mut taken } else { &mut *self };
            to.order.push(to.paths.len() as u32);
            to.paths.push(&all.paths.get(index as usize));
        }
        taken
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::integrate::spawned_paths::SpawnedPath;

    /// Adds paths with these parents and depths, whose keys are their places.
    fn add(waiting: &mut WaitingPaths, paths: &[(u32, u32)]) {
        for (key, (parent, depth)) in (0..).zip(paths) {
            waiting.paths.push(&SpawnedPath {
                parent: *parent,
                depth: *depth,
                origin: [0.0; 3],
                direction: [1.0; 3],
                limit: 1.0,
                throughput: [1.0; 3],
                importance: 1.0,
                key,
                time: 0.0,
                sample: 0,
            });
        }
    }

    /// The samples and the keys, in order.
    fn ordered(waiting: &WaitingPaths) -> Vec<(u32, u32)> {
        let paths = waiting.order.iter().map(|index| waiting.paths.get(*index as usize));
        paths.map(|path| (path.parent, path.key)).collect()
    }

    #[test]
    fn paths_are_ordered_by_their_parents() {
        let mut waiting = WaitingPaths::default();
        add(&mut waiting, &[(3, 1), (1, 1), (3, 1), (0, 1), (1, 1)]);
        waiting.order_last(4, |it| it + 10);
        assert_eq!(ordered(&waiting), [(10, 3), (11, 1), (11, 4), (13, 0), (13, 2)]);
        add(&mut waiting, &[(1, 1), (0, 1)]);
        waiting.order_last(2, |it| it + 20);
        assert_eq!(ordered(&waiting)[5..], [(20, 1), (21, 0)]);
        let mut others = WaitingPaths::default();
        add(&mut others, &[(7, 1)]);
        others.order_last(8, |it| it);
        others.append(&mut waiting);
        assert_eq!((others.len(), waiting.len()), (8, 0));
        assert_eq!(ordered(&others)[..2], [(7, 0), (10, 3)]);
        others.clear();
        assert_eq!(others.least_depth(), None);
    }

    #[test]
    fn depths_and_samples_are_taken_apart() {
        let mut waiting = WaitingPaths::default();
        add(&mut waiting, &[(2, 3), (0, 2), (1, 3), (0, 3), (5, 2)]);
        waiting.order_last(6, |it| it);
        assert_eq!(waiting.least_depth(), Some(2));
        let mut level = WaitingPaths::default();
        waiting.take_depth(2, &mut level);
        assert_eq!(ordered(&level), [(0, 1), (5, 4)]);
        assert_eq!(ordered(&waiting), [(0, 3), (1, 2), (2, 0)]);
        let later = waiting.split_off_samples().expect("there are several");
        assert_eq!((ordered(&waiting), ordered(&later)), (vec![(0, 3)], vec![(1, 2), (2, 0)]));
        assert!(waiting.split_off_samples().is_none());
        level.clear();
        waiting.take_depth(3, &mut level);
        assert_eq!((waiting.len(), ordered(&level)), (0, vec![(0, 3)]));
    }
}
