//! What a kernel takes.

use std::sync::Arc;

use rtsl_ir::{Index, PlaceKind};
use rtsl_packet::kernel::{KernelPlace, OpKind, Region};
use rtsl_packet::{Kernel, Shape, abi};

use crate::call::{CallArguments, Instances};
use crate::components::ComponentSet;
use crate::instance::{BufferEntries, BufferEntry};

/// What a kernel takes; calls are checked against it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Signature {
    /// The components of the state that it reads or writes.
    pub state: ComponentSet,
    /// Scratch arrays that it needs, counted from the first of the class's layout.
    pub scratch_arrays: u32,
    /// Words of an instance's block that it needs.
    pub block_words: u32,
    /// The buffers that it needs.
    pub buffers: Arc<[BufferEntry]>,
    /// What the lanes of a call have in common.
    pub shape: Shape,
    /// Whether it says which rays it found a hit for.
    pub accepts: bool,
}

impl Signature {
    /// What packet code takes.
    pub fn of(kernel: &Kernel) -> Signature {
        let places = |kind| kernel.places.iter().filter(move |it| it.place.kind == kind);
        let end = |place: &KernelPlace| place.location.saturating_add(place.place.len);
        let buffers = places(PlaceKind::Buffer)
            .map(|buffer| BufferEntry { offset: buffer.location, element_words: buffer.place.len });
        let buffers: Arc<[BufferEntry]> = buffers.collect();
        let entry_ends = buffers.iter().map(|it| it.offset.saturating_add(abi::BUFFER_WORDS));
        Signature {
            state: state_components(kernel),
            scratch_arrays: places(PlaceKind::Scratch).map(end).max().unwrap_or(0),
            block_words: places(PlaceKind::Member).map(end).chain(entry_ends).max().unwrap_or(0),
            buffers,
            shape: kernel.shape,
            accepts: kernel.accepted_output().is_some(),
        }
    }

    /// Checks that a call's arguments have the sizes that code relies on.
    ///
    /// # Panics
    /// If they have not: the caller mixed up classes or shapes.
    // Inlined, as is what it calls: see `CompiledKernel::call`.
    #[inline(always)]
    pub fn check(&self, call: &CallArguments<'_>) {
        match (self.shape, call.instances) {
            (Shape::Packet | Shape::CommonOrigin | Shape::Single, Instances::One(block)) => {
                self.check_rays(call);
                self.check_blocks(block.words().len(), block.entries());
            }
            (Shape::Leaf, Instances::Range(members, first)) => {
                self.check_lanes(call, if self.accepts { 1 } else { call.count.max(1) });
                let end = (first as usize).checked_add(call.count);
                let number = members.instances().len();
                assert!(end.is_some_and(|end| end <= number), "the block has all objects");
                assert!(number <= abi::NO_OBJECT as usize, "objects have numbers");
                self.check_blocks(members.least_words(), members.entries());
            }
            (Shape::Stream, Instances::Many(table, indices)) => {
                self.check_rays(call);
                check_indices(indices.as_slice(), call.count, table.blocks().len());
                self.check_blocks(table.least_words(), table.entries());
            }
            (shape, Instances::One(_) | Instances::Many(..) | Instances::Range(..)) => {
                panic!("the {} shape takes its instances in another form", shape.name())
            }
        }
        if self.shape == Shape::Single {
            let is_one = call.count == 1 && call.mask.is_none();
            assert!(is_one, "the single shape takes one ray and no mask");
        }
    }

    /// Checks what has a lane for each ray.
    #[inline(always)]
    fn check_rays(&self, call: &CallArguments<'_>) {
        self.check_lanes(call, call.count);
        let room = call.accepted.as_ref().map(|accepted| accepted.lanes());
        assert!(!self.accepts || room.is_some(), "`intersect` reports accepted hits");
        assert!(room.is_none_or(|lanes| lanes >= call.count), "every ray may be accepted");
    }

    /// Checks state and scratch for so many lanes, and the mask.
    #[inline(always)]
    fn check_lanes(&self, call: &CallArguments<'_>, lanes: usize) {
        let CallArguments { state, scratch, count, mask, .. } = call;
        assert!(*count <= u32::MAX as usize / 2, "at most 2^31 rays a call");
        assert!(state.has_all(&self.state), "the state has every array that the kernel touches");
        assert!(state.lanes() >= lanes, "the state has room for every ray");
        if self.scratch_arrays > 0 {
            let arrays = self.scratch_arrays as usize;
            let is_of_class = scratch.components() >= arrays && !scratch.is_sparse();
            assert!(is_of_class, "the scratch is that of the class");
            assert!(scratch.lanes() >= lanes, "scratch has room for every ray");
        }
        assert!(mask.is_none_or(|mask| mask.lanes() >= *count), "the mask has every ray");
    }

    /// Checks blocks by the size of the smallest and the buffers that all have.
    #[inline(always)]
    fn check_blocks(&self, words: usize, entries: &BufferEntries) {
        assert!(words >= self.block_words as usize, "the instance is one of the class");
        let has_all = self.buffers.iter().all(|buffer| entries.contains(buffer));
        assert!(has_all, "the instance has the buffers of the class");
    }
}

/// Checks that so many rays have the number of one of `instances`.
fn check_indices(indices: &[u32], rays: usize, instances: usize) {
    assert!(indices.len() >= rays, "every ray has an instance");
    let are_in_table = indices.iter().all(|index| (*index as usize) < instances);
    assert!(instances > 0 && are_in_table, "every ray's instance is in the table");
}

/// The state components that a kernel loads or stores.
fn state_components(kernel: &Kernel) -> ComponentSet {
    let mut components = ComponentSet::default();
    add_loaded(kernel, &kernel.prologue, &mut components);
    add_loaded(kernel, &kernel.body, &mut components);
    for output in &kernel.outputs {
        let place = kernel.place(output.place);
        if place.place.kind == PlaceKind::State {
            components.insert(place.location + output.component);
        }
    }
    components
}

fn add_loaded(kernel: &Kernel, region: &Region, components: &mut ComponentSet) {
    for op in &region.ops {
        if let OpKind::Load(id, index) = &op.kind
            && kernel.place(*id).place.kind == PlaceKind::State
        {
            let place = kernel.place(*id);
            match index {
                Index::Constant(index) => components.insert(place.location + index),
                Index::Dynamic(_) => {
                    (0..place.place.len).for_each(|it| components.insert(place.location + it));
                }
            }
        }
        op.kind.regions().for_each(|region| add_loaded(kernel, region, components));
    }
}
