//! What a kernel takes.

use std::sync::Arc;

use rtsl_ir::{Index, PlaceKind};
use rtsl_packet::kernel::{KernelPlace, OpKind, Region};
use rtsl_packet::{Kernel, Shape, abi};

use crate::call::{CallArguments, Instances};
use crate::components::ComponentSet;
use crate::host_lanes::CallError;
use crate::instance::{BufferEntry, InstanceBlock};
use crate::lanes::{LaneBlock, LaneMask};
use crate::leaf::LeafArguments;
use crate::objects::Objects;

/// What a kernel takes; calls are checked against it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Signature {
    /// The components of the state that it reads or writes.
    pub state: ComponentSet,
    /// Scratch arrays that it needs, counted from the first of the class's layout.
    pub scratch_arrays: u32,
    /// Words that it needs of the instance's block, or of the one that objects share.
    pub block_words: u32,
    /// The buffers that it needs there.
    pub buffers: Arc<[BufferEntry]>,
    /// Words of each object, where it takes objects.
    pub object_words: Option<u32>,
    /// The buffers that it needs of each object, by words of the object.
    pub object_buffers: Arc<[BufferEntry]>,
    /// What the lanes of a call have in common.
    pub shape: Shape,
    /// Whether it says which rays it found a hit for.
    pub accepts: bool,
    /// Rays in a chunk, where a call may [begin at any](Kernel::begins_at_any_chunk).
    pub separate_chunks: Option<u32>,
}

impl Signature {
    /// What packet code takes.
    pub fn of(kernel: &Kernel) -> Signature {
        let places = |kind| kernel.places.iter().filter(move |it| it.place.kind == kind);
        let end = |place: &KernelPlace| place.location.saturating_add(place.place.len);
        let buffers = |of_objects| -> Arc<[BufferEntry]> {
            let buffers = places(PlaceKind::Buffer).filter(|it| it.of_objects == of_objects);
            let entry =
                |it: &KernelPlace| BufferEntry { offset: it.location, element_words: it.place.len };
            buffers.map(entry).collect()
        };
        let (buffers, object_buffers) = (buffers(false), buffers(true));
        let entry_ends = buffers.iter().map(|it| it.offset.saturating_add(abi::BUFFER_WORDS));
        let members = places(PlaceKind::Member).filter(|it| !it.of_objects).map(end);
        Signature {
            state: state_components(kernel),
            scratch_arrays: places(PlaceKind::Scratch).map(end).max().unwrap_or(0),
            block_words: members.chain(entry_ends).max().unwrap_or(0),
            buffers,
            object_words: kernel.object_words,
            object_buffers,
            shape: kernel.shape,
            accepts: kernel.accepted_output().is_some(),
            separate_chunks: kernel.begins_at_any_chunk().then_some(kernel.width),
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
            (Shape::Packet | Shape::CommonOrigin | Shape::Single, Instances::One(_)) => {
                self.check_rays(call);
                assert!(self.object_words.is_none(), "the kernel takes objects");
            }
            (
                Shape::Packet | Shape::CommonOrigin | Shape::Single,
                Instances::Object(objects, number),
            ) => {
                self.check_rays(call);
                self.check_objects(objects);
                assert!((number as usize) < objects.len(), "the object is one of these");
            }
            (Shape::Leaf, Instances::Range(objects, first)) => {
                self.check_count(call.count, call.mask);
                self.check_lanes(call.state, call.scratch, self.leaf_lanes(call.count));
                self.check_objects(objects);
                check_range(first, call.count, objects.len());
            }
            (Shape::Stream, Instances::Many(objects, indices)) => {
                self.check_rays(call);
                self.check_objects(objects);
                check_indices(indices.as_slice(), call.count, objects.len());
            }
            (
                shape,
                Instances::One(_)
                | Instances::Object(..)
                | Instances::Many(..)
                | Instances::Range(..),
            ) => {
                panic!("the {} shape takes its instances in another form", shape.name())
            }
        }
        self.check_block(call.instances.block());
        if self.shape == Shape::Single {
            let is_one = call.count == 1 && call.mask.is_none();
            assert!(is_one, "the single shape takes one ray and no mask");
        }
    }

    /// Checks that a leaf kernel fits objects.
    ///
    /// # Panics
    /// If it does not; so for [`Signature::check_leaf`].
    pub fn check_leaf_objects(&self, objects: &Objects) {
        let is_test = self.shape == Shape::Leaf && self.accepts;
        assert!(is_test, "the kernel is `intersect` in the leaf shape");
        self.check_objects(objects);
        self.check_block(objects.shared());
    }

    /// Checks the arguments of a call for some of so many objects that fit.
    #[inline(always)]
    pub fn check_leaf(&self, call: &LeafArguments<'_>, objects: usize) {
        let LeafArguments { state, scratch, count, tests, host: _ } = call;
        self.check_count(*count as usize, None);
        self.check_count(tests.len(), None);
        let rays = tests.iter().map(|test| test.ray as usize + 1).max();
        self.check_lanes(state, scratch, rays.unwrap_or(0));
        tests.iter().for_each(|test| check_range(test.first, *count as usize, objects));
    }

    /// The lanes of state and scratch in the leaf shape: those of the ray, or of each object's outputs.
    #[inline(always)]
    fn leaf_lanes(&self, count: usize) -> usize {
        if self.accepts { 1 } else { count.max(1) }
    }

    /// Checks what has a lane for each ray.
    #[inline(always)]
    fn check_rays(&self, call: &CallArguments<'_>) {
        self.check_count(call.count, call.mask);
        self.check_lanes(call.state, call.scratch, call.count);
        let room = call.accepted.as_ref().map(|accepted| accepted.lanes());
        assert!(!self.accepts || room.is_some(), "`intersect` reports accepted hits");
        assert!(room.is_none_or(|lanes| lanes >= call.count), "every ray may be accepted");
    }

    /// Checks the number of lanes, and the mask.
    #[inline(always)]
    fn check_count(&self, count: usize, mask: Option<&LaneMask>) {
        assert!(count <= u32::MAX as usize / 2, "at most 2^31 rays a call");
        assert!(mask.is_none_or(|mask| mask.lanes() >= count), "the mask has every ray");
    }

    /// Checks state and scratch for so many lanes.
    #[inline(always)]
    fn check_lanes(&self, state: &LaneBlock, scratch: &LaneBlock, lanes: usize) {
        assert!(state.has_all(&self.state), "the state has every array that the kernel touches");
        assert!(state.lanes() >= lanes, "the state has room for every ray");
        if self.scratch_arrays > 0 {
            let arrays = self.scratch_arrays as usize;
            let is_of_class = scratch.components() >= arrays && !scratch.is_sparse();
            assert!(is_of_class, "the scratch is that of the class");
            assert!(scratch.lanes() >= lanes, "scratch has room for every ray");
        }
    }

    /// Checks the instances of a host's call.
    pub(crate) fn check_host_instances(
        &self,
        instances: Instances<'_>,
        count: usize,
    ) -> Result<(), CallError> {
        let objects = instances.objects();
        let form_fits = match (self.shape, instances) {
            (Shape::Packet | Shape::CommonOrigin | Shape::Single, Instances::One(_)) => {
                self.object_words.is_none()
            }
            (Shape::Packet | Shape::CommonOrigin | Shape::Single, Instances::Object(..))
            | (Shape::Stream, Instances::Many(..)) => self.object_words.is_some(),
            (Shape::Packet | Shape::CommonOrigin | Shape::Single, _)
            | (Shape::Stream | Shape::Leaf, _) => false,
        };
        if !form_fits {
            return Err(CallError::InstanceForm(self.shape.name()));
        }
        let fit = objects.is_none_or(|objects| self.fits_objects(objects));
        if !(fit && self.fits_block(instances.block())) {
            return Err(CallError::ForeignInstance);
        }
        let exist = objects.is_none_or(|objects| match instances {
            Instances::Object(_, number) => (number as usize) < objects.len(),
            Instances::Many(_, indices) => are_numbers(indices.as_slice(), count, objects.len()),
            Instances::One(_) | Instances::Range(..) => true,
        });
        if exist { Ok(()) } else { Err(CallError::NoSuchObject) }
    }

    /// Checks the instance's block, or that which objects share.
    #[inline(always)]
    fn check_block(&self, block: &InstanceBlock) {
        assert!(self.fits_block(block), "the instance is one of the class, with its buffers");
    }

    #[inline(always)]
    fn fits_block(&self, block: &InstanceBlock) -> bool {
        block.words().len() >= self.block_words as usize
            && self.buffers.iter().all(|buffer| block.entries().contains(buffer))
    }

    /// Checks what all objects have.
    #[inline(always)]
    fn check_objects(&self, objects: &Objects) {
        let fit = self.fits_objects(objects);
        assert!(fit, "objects have the form that the kernel is made for, and the class's buffers");
    }

    #[inline(always)]
    fn fits_objects(&self, objects: &Objects) -> bool {
        let words = Some(objects.form().words().len() as u32);
        self.object_words == words
            && self.object_buffers.iter().all(|it| objects.entries().contains(it))
    }
}

/// Checks that a range of objects begins a block and is among so many.
#[inline(always)]
fn check_range(first: u32, count: usize, objects: usize) {
    let end = (first as usize).checked_add(count);
    assert!(end.is_some_and(|end| end <= objects), "all objects are of these");
    let begins_block = first.is_multiple_of(abi::OBJECTS_IN_BLOCK);
    assert!(begins_block, "the first object is the first of a block");
}

/// Checks that so many rays, and lanes that share a vector with them, have the number of one of `instances`.
fn check_indices(indices: &[u32], rays: usize, instances: usize) {
    assert!(are_numbers(indices, rays, instances), "every ray has an instance of the table");
}

/// Whether so many rays, and lanes that share a vector with them, have the number of one of `instances`.
#[inline(always)]
fn are_numbers(indices: &[u32], rays: usize, instances: usize) -> bool {
    let read = rays.next_multiple_of(abi::LANE_PADDING as usize).min(indices.len());
    // Not `all`, which looks at one after another.
    let greatest = indices[..read].iter().fold(0, |greatest, index| greatest.max(*index));
    indices.len() >= rays && (greatest as usize) < instances
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
