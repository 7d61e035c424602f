//! The frames of a wavefront's paths.

use super::super::super::shading_batch::set_indices;
use super::path_set::PathSet;
use super::path_sets::PathSets;
use super::run::Place;
use rtsl::{LaneBlock, LaneIndices, LaneMask, StageKernel, new_state};

/// The number of paths of one call of a kernel: their arrays stay in the second-level cache.
pub const CALL_PATHS: usize = 256;

/// The memory of one thread for the paths of a wavefront, at one level of recursion.
pub struct Frames {
    /// The state and the scratch of all paths.
    pub paths: Blocks,
    /// Those of the paths of one call, unless it is for all paths.
    pub call: Blocks,
    /// The index of the surface of each path of the call.
    pub surfaces: LaneIndices,
    /// The paths that take part in a call for all of them.
    pub mask: LaneMask,
    /// The lanes of a call.
    pub called: PathSet,
    /// Those that contribute.
    pub contributing: PathSet,
    /// The paths by their next stages.
    pub by_stage: PathSets,
    /// The groups of the paths' surfaces.
    pub groups: Vec<u32>,
    /// The paths of a stage by these groups.
    pub by_group: PathSets,
    /// The paths that a sampled light may reach.
    pub lit: Vec<u32>,
    /// The operands of requests and the times of paths that wait for an answer.
    pub requests: [Vec<f32>; 9],
    lanes: usize,
    scratch_arrays: usize,
}

/// The arrays of paths.
pub struct Blocks {
    /// The state of the integrator.
    pub state: LaneBlock,
    /// The scratch of stages.
    pub scratch: LaneBlock,
}

impl Blocks {
    fn new(scratch_arrays: usize, lanes: usize) -> Blocks {
        let scratch = LaneBlock::new(scratch_arrays, lanes);
        Blocks { state: new_state(lanes), scratch }
    }
}

impl Frames {
    /// Allocates the memory of calls, for stages with at most so many scratch arrays; there is no room for paths yet.
    pub fn new(scratch_arrays: usize) -> Frames {
        Frames {
            paths: Blocks::new(scratch_arrays, 0),
            call: Blocks::new(scratch_arrays, CALL_PATHS),
            surfaces: LaneIndices::new(CALL_PATHS),
            mask: LaneMask::new(0),
            called: PathSet::default(),
            contributing: PathSet::default(),
            by_stage: PathSets::default(),
            groups: Vec::new(),
            by_group: PathSets::default(),
            lit: Vec::new(),
            requests: Default::default(),
            lanes: 0,
            scratch_arrays,
        }
    }

    /// Allocates the memory for so many paths, if there is not enough.
    pub fn make_room(&mut self, lanes: usize) {
        if lanes > self.lanes {
            self.paths = Blocks::new(self.scratch_arrays, lanes);
            self.surfaces = LaneIndices::new(lanes.max(CALL_PATHS));
            self.mask = LaneMask::new(lanes);
            self.groups.resize(lanes, 0);
            self.lanes = lanes;
        }
    }

    /// Copies what a kernel reads of these paths to the arrays of the call.
    pub fn gather(&mut self, kernel: &StageKernel, slots: &[u32]) {
        for array in &kernel.reads {
            let from = self.paths.scratch.words(*array);
            let to = self.call.scratch.words_mut(*array);
            to.iter_mut().zip(slots).for_each(|(to, slot)| *to = from[*slot as usize]);
        }
    }

    /// Copies what a kernel stored from the arrays of the call to these paths. `next` is the array of the next stage.
    pub fn scatter(&mut self, kernel: &StageKernel, slots: &[u32], next: usize) {
        for array in &kernel.ports {
            let from = self.call.scratch.words(*array);
            let to = self.paths.scratch.words_mut(*array);
            from.iter().zip(slots).for_each(|(from, slot)| to[*slot as usize] = *from);
        }
        if kernel.outputs.is_empty() && kernel.state.is_empty() {
            return;
        }
        let ended = |(_, next): &(usize, &u32)| next.cast_signed() == rtsl::END;
        let next = self.call.scratch.words(next)[..slots.len()].iter().enumerate();
        let ended: Vec<(usize, usize)> =
            next.filter(ended).map(|(lane, _)| (lane, slots[lane] as usize)).collect();
        for array in &kernel.outputs {
            let from = self.call.scratch.words(*array);
            let to = self.paths.scratch.words_mut(*array);
            ended.iter().for_each(|(lane, slot)| to[*slot] = from[*lane]);
        }
        for component in &kernel.state {
            let from = self.call.state.words(*component);
            let to = self.paths.state.words_mut(*component);
            ended.iter().for_each(|(lane, slot)| to[*slot] = from[*lane]);
        }
    }
}

/// Sets the indices of the objects for which a kernel is called, by path.
pub fn set_objects(objects: &mut LaneIndices, place: Place<'_>, index: impl Fn(usize) -> u32) {
    match place {
        Place::Copied(slots) => set_indices(objects, slots.iter().map(|it| index(*it as usize))),
        Place::All { paths, .. } => {
            // Kernels need valid indices for all paths.
            let objects = objects.as_mut_slice();
            objects.fill(0);
            for path in paths.paths() {
                objects[*path as usize] = index(*path as usize);
            }
        }
    }
}

/// The same for a column with the indices of so many objects. Paths of other kernels have those of other objects there.
pub fn take_objects(
    objects: &mut LaneIndices,
    place: Place<'_>,
    (indices, count): (&[u32], usize),
) {
    let last = count as u32 - 1;
    match place {
        Place::Copied(_) => set_objects(objects, place, |path| indices[path]),
        // No list of the paths is needed, nor a scattered store.
        Place::All { count, .. } => {
            let objects = objects.as_mut_slice().iter_mut();
            objects.zip(&indices[..count]).for_each(|(to, index)| *to = (*index).min(last));
        }
    }
}
