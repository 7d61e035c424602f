//! Paths that are moved to other lanes, so that those of one kernel fill vectors.
//!
//! A wavefront begins with its paths in the order of their pixels, which suits the rays that cameras generate. After
//! some surfaces few paths are left, and neighbours wait for different kernels. Then those that go on are moved to
//! other arrays, kernel by kernel, with the columns that anyone still reads. The results of those that have ended are
//! copied to the arrays where they were loaded.

use rtsl::END;

use super::frames::{Blocks, Frames};
use super::moved_columns::MovedColumns;
use super::path_set::PathSet;
use super::path_sets::PathSets;

/// The arrays among which paths are moved.
#[derive(Default)]
pub struct MovedPaths {
    /// The arrays to which the paths were loaded, while these are in others.
    loaded: Option<Blocks>,
    /// Arrays to which paths can be moved.
    spare: Vec<Blocks>,
    /// The index of the path in each lane; meaningless until paths are moved.
    paths: Vec<u32>,
    /// Memory for the next indices.
    next_paths: Vec<u32>,
    /// Memory for the lanes of paths that have ended, and for the indices of these.
    ended: PathSet,
    ended_paths: Vec<u32>,
}

impl MovedPaths {
    /// Returns the index of the path in a lane.
    pub fn path_in(&self, lane: u32) -> usize {
        if self.has_moved() { self.paths[lane as usize] as usize } else { lane as usize }
    }

    /// The index of the path in each lane, if the paths have been moved.
    pub fn paths(&self) -> Option<&[u32]> {
        self.has_moved().then_some(&self.paths)
    }

    /// Returns the arrays to which the paths were loaded, given those in which they are, and the index there of the path
    /// in each lane, unless it is that of the lane.
    pub fn loaded<'a>(&'a mut self, paths: &'a mut Blocks) -> (&'a mut Blocks, Option<&'a [u32]>) {
        match &mut self.loaded {
            Some(loaded) => (loaded, Some(&self.paths)),
            None => (paths, None),
        }
    }

    fn has_moved(&self) -> bool {
        self.loaded.is_some()
    }
}

impl Frames {
    /// Moves the paths of sets to adjacent lanes, set by set, and makes these the sets. Of the running paths, the
    /// others have ended. Returns the number of lanes.
    pub fn move_paths(
        &mut self,
        columns: &MovedColumns,
        running: &mut PathSet,
        sets: &mut PathSets,
    ) -> usize {
        self.keep_results(columns, running);
        let mut target = self.moved.spare.pop().unwrap_or_else(|| self.new_blocks());
        let starts = sets.starts(self.lanes());
        let (from, to) = (&self.paths.scratch, &mut target.scratch);
        sets.copy(&starts, columns.read.iter().copied(), from, to);
        self.move_indices(sets, &starts);
        let left = std::mem::replace(&mut self.paths, target);
        let MovedPaths { loaded, spare, .. } = &mut self.moved;
        match loaded {
            None => *loaded = Some(left),
            Some(_) => spare.push(left),
        }
        sets.set_ranges(&starts);
        running.set_union(sets.sets().map(|(_, set)| set));
        running.lanes()
    }

    /// Puts the results of running paths that have ended where these were loaded, and makes those the arrays of paths.
    pub fn return_results(&mut self, columns: &MovedColumns, running: &PathSet) {
        self.keep_results(columns, running);
        if let Some(loaded) = self.moved.loaded.take() {
            self.moved.spare.push(std::mem::replace(&mut self.paths, loaded));
        }
    }

    fn move_indices(&mut self, sets: &PathSets, starts: &[usize]) {
        let lanes = self.lanes();
        let MovedPaths { loaded, paths, next_paths, .. } = &mut self.moved;
        next_paths.resize(lanes, 0);
        for ((_, set), start) in sets.sets().zip(starts) {
            let to = next_paths[*start..].iter_mut().zip(set.paths());
            match loaded {
                None => to.for_each(|(to, lane)| *to = *lane),
                Some(_) => to.for_each(|(to, lane)| *to = paths[*lane as usize]),
            }
        }
        std::mem::swap(paths, next_paths);
    }

    /// Copies the results of running paths that have ended to the arrays where they were loaded, if they are in others.
    fn keep_results(&mut self, columns: &MovedColumns, running: &PathSet) {
        let MovedPaths { loaded: Some(loaded), paths, ended, ended_paths, .. } = &mut self.moved
        else {
            return;
        };
        ended.set_equal(running, self.paths.scratch.words(columns.next), END.cast_unsigned());
        let lanes = ended.paths();
        ended_paths.clear();
        ended_paths.extend(lanes.iter().map(|lane| paths[*lane as usize]));
        let copy = |from: &[u32], to: &mut [u32]| {
            let pairs = lanes.iter().zip(&*ended_paths);
            pairs.for_each(|(lane, path)| to[*path as usize] = from[*lane as usize]);
        };
        for array in &columns.results {
            copy(self.paths.scratch.words(*array), loaded.scratch.words_mut(*array));
        }
        for component in &columns.state {
            copy(self.paths.state.words(*component), loaded.state.words_mut(*component));
        }
    }
}
