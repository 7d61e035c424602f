//! The frames of a wavefront's paths.

use rtsl::{LaneBlock, LaneIndices, LaneMask};

use super::answers::{AnsweredHit, Answers};
use super::moved_paths::MovedPaths;
use super::path_set::{PathSet, VECTOR_PATHS};
use super::path_sets::PathSets;

/// The number of shadow rays of one call of a kernel: their arrays stay in the first-level cache.
pub const CALL_RAYS: usize = 256;

/// The memory of one thread for the paths of a wavefront, at one level of recursion.
pub struct Frames {
    /// The state and the scratch of all paths. Each path has a lane.
    pub paths: Blocks,
    /// The arrays among which the paths are moved to other lanes.
    pub moved: MovedPaths,
    /// The state and the scratch of shadow rays.
    pub shadow_rays: Blocks,
    /// The index of the surface of each lane.
    pub surfaces: LaneIndices,
    /// The lanes that take part in a call.
    pub mask: LaneMask,
    /// The lanes with a contribution.
    pub contributing: PathSet,
    /// The weights in the pixel of what lanes spawn.
    pub importance: Vec<f32>,
    /// The lanes of paths that had not ended when they were sorted last.
    pub running: PathSet,
    /// The lanes by their next stages.
    pub by_stage: PathSets,
    /// The groups of the surfaces of lanes.
    pub groups: Vec<u32>,
    /// The lanes by their next kernels.
    pub by_kernel: PathSets,
    /// The lanes that a sampled light may reach.
    pub lit: Vec<u32>,
    /// The operands of requests and the times of paths that wait for an answer.
    pub requests: [Vec<f32>; 9],
    /// The answers to them, if they are searches.
    pub answers: Answers,
    /// The lanes whose hits are of objects with alpha textures, with these hits.
    pub cut: Vec<(u32, AnsweredHit)>,
    lanes: usize,
    sizes: BlockSizes,
}

/// The numbers of arrays that stages need.
#[derive(Clone, Copy, Debug)]
pub struct BlockSizes {
    /// The components of state: the first ones of all. The last ones are the attributes and the transforms of surfaces,
    /// a third of all, which few materials read.
    pub state: usize,
    /// The arrays of scratch.
    pub scratch: usize,
}

impl BlockSizes {
    /// The greater number of each kind.
    pub fn max(self, other: BlockSizes) -> BlockSizes {
        BlockSizes { state: self.state.max(other.state), scratch: self.scratch.max(other.scratch) }
    }
}

/// The arrays of paths.
pub struct Blocks {
    /// The state of the integrator.
    pub state: LaneBlock,
    /// The scratch of stages.
    pub scratch: LaneBlock,
}

impl Blocks {
    /// Allocates so many lanes.
    pub fn new(sizes: BlockSizes, lanes: usize) -> Blocks {
        let state = LaneBlock::new(sizes.state, lanes);
        Blocks { state, scratch: LaneBlock::new(sizes.scratch, lanes) }
    }
}

impl Frames {
    /// Allocates the memory of calls, for stages that need at most so many arrays; there is no room for paths yet.
    pub fn new(sizes: BlockSizes) -> Frames {
        Frames {
            paths: Blocks::new(sizes, 0),
            moved: MovedPaths::default(),
            shadow_rays: Blocks::new(sizes, CALL_RAYS),
            surfaces: LaneIndices::new(0),
            mask: LaneMask::new(0),
            contributing: PathSet::default(),
            importance: Vec::new(),
            running: PathSet::default(),
            by_stage: PathSets::default(),
            groups: Vec::new(),
            by_kernel: PathSets::default(),
            lit: Vec::new(),
            requests: Default::default(),
            answers: Answers::default(),
            cut: Vec::new(),
            lanes: 0,
            sizes,
        }
    }

    /// Allocates the memory for so many paths, if there is not enough.
    pub fn make_room(&mut self, lanes: usize) {
        let lanes = lanes.next_multiple_of(VECTOR_PATHS);
        if lanes > self.lanes {
            self.paths = Blocks::new(self.sizes, lanes);
            self.moved = MovedPaths::default();
            self.surfaces = LaneIndices::new(lanes);
            self.mask = LaneMask::new(lanes);
            self.groups.resize(lanes, 0);
            self.lanes = lanes;
        }
    }

    /// The number of paths for which there is memory.
    pub fn lanes(&self) -> usize {
        self.lanes
    }

    /// Returns the index of the path in a lane.
    pub fn path_in(&self, lane: u32) -> usize {
        self.moved.path_in(lane)
    }

    /// Allocates arrays to which paths are moved, with a vector more than there are lanes: copies store whole vectors.
    pub fn new_blocks(&self) -> Blocks {
        Blocks::new(self.sizes, self.lanes + VECTOR_PATHS)
    }
}

/// Sets the indices of the objects for which a kernel is called, by lane. Kernels need valid indices for all lanes of
/// the vectors of a call.
pub fn set_objects(objects: &mut LaneIndices, lanes: &PathSet, index: impl Fn(u32) -> u32) {
    let objects = objects.as_mut_slice();
    objects[lanes.range()].fill(0);
    for lane in lanes.paths() {
        objects[*lane as usize] = index(*lane);
    }
}

/// The same for a column with the indices of so many objects. Paths of other kernels have those of other objects there.
pub fn take_objects(objects: &mut LaneIndices, lanes: &PathSet, indices: &[u32], count: usize) {
    let (last, lanes) = (count as u32 - 1, lanes.range());
    // No list of the lanes is needed, nor a scattered store.
    let objects = objects.as_mut_slice()[lanes.clone()].iter_mut();
    objects.zip(&indices[lanes]).for_each(|(to, index)| *to = (*index).min(last));
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn all_lanes_of_vectors_have_valid_objects() {
        let mut objects = LaneIndices::new(3 * VECTOR_PATHS);
        objects.as_mut_slice().fill(9);
        let mut lanes = PathSet::default();
        lanes.set_range(1, 17);
        set_objects(&mut objects, &lanes, |lane| lane % 2);
        let expected = (0..32).map(|lane| u32::from(lane < 18 && lane % 2 == 1));
        assert!(objects.as_slice()[..32].iter().copied().eq(expected));
        take_objects(&mut objects, &lanes, &[5; 3 * VECTOR_PATHS], 3);
        assert!(objects.as_slice()[..32].iter().all(|index| *index == 2));
        assert_eq!(objects.as_slice()[32..], [9; VECTOR_PATHS], "no lane of the call");
    }
}
