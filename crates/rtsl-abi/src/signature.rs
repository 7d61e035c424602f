//! Signatures of kernels.

use std::ops::Range;
use std::sync::Arc;

use crate::call::{CallArguments, Instances};
use crate::call_error::CallError;
use crate::call_mode::CallMode;
use crate::component_set::ComponentSet;
use crate::host_lanes::HostArguments;
use crate::instance::{BufferEntry, InstanceBlock};
use crate::lane_arrays::LaneArrays;
use crate::lanes::LaneMask;
use crate::leaf::LeafArguments;
use crate::objects::Objects;
use crate::offsets;

const IN_BLOCK: usize = offsets::OBJECTS_IN_BLOCK as usize;

/// The requirements of a kernel on a call, against which calls are checked.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Signature {
    /// The components of the state that it reads or writes.
    pub state: ComponentSet,
    /// The number of scratch arrays that it needs, from the first of the class's layout.
    pub scratch_arrays: u32,
    /// The number of words that it needs of the instance's block, or of the one that objects share.
    pub block_words: u32,
    /// The buffers that it needs in that block.
    pub buffers: Arc<[BufferEntry]>,
    /// The number of words of each object, if it takes objects.
    pub object_words: Option<u32>,
    /// The greatest number of blocks of objects that it serves, if there is one.
    pub object_blocks: Option<u32>,
    /// The buffers that it needs in each object, by words of the object.
    pub object_buffers: Arc<[BufferEntry]>,
    /// The call mode.
    pub mode: CallMode,
    /// True if it stores the rays with a hit.
    pub accepts: bool,
}

impl Signature {
    /// Checks that a call's arguments have the sizes that code relies on.
    ///
    /// # Errors
    /// If they do not, because the caller mixed up classes or call modes.
    // Inlined, as are the functions it calls: see `CompiledKernel::call`.
    #[inline(always)]
    pub fn check(&self, call: &CallArguments<'_>) -> Result<(), CallError> {
        self.check_sizes(&CallSizes {
            state: &*call.state,
            scratch: &*call.scratch,
            count: call.count,
            rays: self.rays(call.count, call.mask),
            mask: call.mask.map(LaneMask::lanes),
            accepted: call.accepted.as_ref().map(|accepted| accepted.lanes()),
            instances: call.instances,
            // The arrays of a `LaneBlock` are padded for every width.
            vector: 1,
        })
    }

    /// True if a call for one instance has the sizes that code relies on, for a [plain](Signature::is_plain) kernel: then
    /// [`Signature::check`], which takes more instructions and branches, finds nothing.
    #[inline(always)]
    pub fn fits_plain_call(&self, call: &CallArguments<'_>, block: &InstanceBlock) -> bool {
        let CallArguments { state, scratch, count, mask, accepted, instances: _, host: _ } = call;
        let count = *count;
        // Looked at only if the kernel writes them, since that is one cache line more.
        let accepted_fit =
            || !self.accepts || accepted.as_ref().is_some_and(|it| it.lanes() >= count);
        count <= i32::MAX as usize
            && block.words().len() >= self.block_words as usize
            && state.has_all(&self.state)
            && state.lanes() >= count
            && (self.scratch_arrays == 0 || scratch.lanes() >= count)
            && scratch.has_first(self.scratch_arrays)
            && accepted_fit()
            && mask.is_none_or(|mask| mask.lanes() >= count)
    }

    /// Returns the rays that code for packets looks at, from the first of a vector: those that a mask may have on, unless
    /// code stores for the others that they have no hit.
    #[inline(always)]
    pub fn rays(&self, count: usize, mask: Option<&LaneMask>) -> Range<usize> {
        let Some(mask) = mask.filter(|_| !self.accepts) else { return 0..count };
        let Range { start, end } = mask.range();
        start - start % offsets::LANE_PADDING as usize..end.min(count)
    }

    /// True if a call takes one instance without buffers, for any number of rays.
    pub fn is_plain(&self) -> bool {
        let for_packets = matches!(self.mode, CallMode::Packet | CallMode::CommonOrigin);
        let no_buffers = self.buffers.is_empty() && self.object_buffers.is_empty();
        for_packets && no_buffers && self.object_words.is_none()
    }

    /// Checks the arguments of a host's call of a kernel with this width.
    ///
    /// # Errors
    /// If they do not fit.
    pub fn check_host(&self, call: &HostArguments<'_, '_>, width: usize) -> Result<(), CallError> {
        if self.mode == CallMode::Leaf {
            return Err(CallError::InstanceForm(self.mode.name()));
        }
        self.check_sizes(&CallSizes {
            state: &*call.state,
            scratch: &*call.scratch,
            count: call.count,
            rays: 0..call.count,
            mask: call.mask.map(<[i32]>::len),
            accepted: call.accepted.as_ref().map(|accepted| accepted.len()),
            instances: call.instances,
            vector: width,
        })
    }

    /// Checks a call for rays, with either owner of the arrays.
    #[inline(always)]
    fn check_sizes<L: LaneArrays>(&self, call: &CallSizes<'_, L>) -> Result<(), CallError> {
        let CallSizes { state, scratch, count, mask, accepted, instances, vector, ref rays } =
            *call;
        self.check_instances(instances, count, rays)?;
        if self.mode == CallMode::Single && (count != 1 || mask.is_some()) {
            return Err(CallError::NotOneRay);
        }
        let needed = needed_lanes(count, vector)?;
        let room = |given: usize| has_room(count, needed, given);
        match self.mode {
            // The lane of the ray, to which the outputs of the nearest hit are also stored.
            CallMode::Leaf if self.accepts => self.check_arrays(state, scratch, 1, 1)?,
            // The lane of the ray and those of the objects.
            CallMode::Leaf => self.check_arrays(state, scratch, count, needed.max(1))?,
            CallMode::Packet | CallMode::CommonOrigin | CallMode::Stream | CallMode::Single => {
                self.check_arrays(state, scratch, count, needed)?;
                match accepted {
                    Some(lanes) => room(lanes)?,
                    None if self.accepts => return Err(CallError::MissingAccepted),
                    None => {}
                }
            }
        }
        mask.map_or(Ok(()), room)
    }

    /// Checks that a leaf kernel fits objects.
    ///
    /// # Panics
    /// If it does not; likewise for [`Signature::check_leaf`].
    pub fn check_leaf_objects(&self, objects: &Objects) {
        let is_test = self.mode == CallMode::Leaf && self.accepts;
        assert!(is_test, "the kernel is not `intersect` in the leaf mode");
        let fit = self.fits_objects(objects) && self.fits_block(objects.shared());
        assert!(fit, "objects have the form that the kernel is made for, and the class's buffers");
    }

    /// Checks the arguments of a call for a range of these objects, which fit.
    #[inline(always)]
    pub fn check_leaf(&self, call: &LeafArguments<'_>, objects: usize) {
        if let Err(error) = self.check_tests(call, objects) {
            error.refuse();
        }
    }

    #[inline(always)]
    fn check_tests(&self, call: &LeafArguments<'_>, objects: usize) -> Result<(), CallError> {
        let LeafArguments { state, scratch, count, tests, host: _ } = call;
        let count = *count as usize;
        needed_lanes(count, 1)?;
        needed_lanes(tests.len(), 1)?;
        let rays = tests.iter().map(|test| test.ray as usize + 1).max().unwrap_or(0);
        self.check_arrays(&**state, &**scratch, rays, rays)?;
        tests.iter().try_for_each(|test| check_range(test.first, count, objects))
    }

    /// Checks that state and scratch have the arrays that code accesses, with `needed` lanes for so many rays.
    #[inline(always)]
    fn check_arrays<L: LaneArrays>(
        &self,
        state: &L,
        scratch: &L,
        rays: usize,
        needed: usize,
    ) -> Result<(), CallError> {
        if let Some(component) = state.missing_component(&self.state) {
            return Err(CallError::MissingState(component));
        }
        has_room(rays, needed, state.lanes())?;
        if self.scratch_arrays == 0 {
            return Ok(());
        }
        if let Some(array) = scratch.missing_array(self.scratch_arrays) {
            return Err(CallError::MissingScratch(array));
        }
        has_room(rays, needed, scratch.lanes())
    }

    /// Checks that the instances have the form that the kernel requires, and that the object indices are in range.
    #[inline(always)]
    fn check_instances(
        &self,
        instances: Instances<'_>,
        count: usize,
        rays: &Range<usize>,
    ) -> Result<(), CallError> {
        let takes_objects = self.object_words.is_some();
        let form_fits = match (self.mode, instances) {
            (CallMode::Packet | CallMode::CommonOrigin | CallMode::Single, Instances::One(_)) => {
                !takes_objects
            }
            (
                CallMode::Packet | CallMode::CommonOrigin | CallMode::Single,
                Instances::Object(..),
            )
            | (CallMode::Stream, Instances::Many(..))
            | (CallMode::Leaf, Instances::Range(..)) => takes_objects,
            (
                CallMode::Packet | CallMode::CommonOrigin | CallMode::Single,
                Instances::Many(..) | Instances::Range(..),
            )
            | (
                CallMode::Stream,
                Instances::One(_) | Instances::Object(..) | Instances::Range(..),
            )
            | (CallMode::Leaf, Instances::One(_) | Instances::Object(..) | Instances::Many(..)) => {
                false
            }
        };
        if !form_fits {
            return Err(CallError::InstanceForm(self.mode.name()));
        }
        let objects_fit = instances.objects().is_none_or(|objects| self.fits_objects(objects));
        if !(objects_fit && self.fits_block(instances.block())) {
            return Err(CallError::ForeignInstance);
        }
        match instances {
            Instances::One(_) => Ok(()),
            Instances::Object(objects, number) => exists((number as usize) < objects.len()),
            Instances::Many(objects, indices) => {
                exists(are_numbers(indices.as_slice(), rays, objects.len()))
            }
            Instances::Range(objects, first) => check_range(first, count, objects.len()),
        }
    }

    /// True if a block, of the instance or shared by objects, has the words and buffers that code reads.
    #[inline(always)]
    fn fits_block(&self, block: &InstanceBlock) -> bool {
        block.words().len() >= self.block_words as usize
            && self.buffers.iter().all(|buffer| block.entries().contains(buffer))
    }

    /// True if each object has the words and buffers that code reads.
    #[inline(always)]
    fn fits_objects(&self, objects: &Objects) -> bool {
        let words = Some(objects.form().words().len() as u32);
        let most = self.object_blocks.map(|blocks| blocks as usize * IN_BLOCK);
        self.object_words == words
            && most.is_none_or(|most| objects.len() <= most)
            && self.object_buffers.iter().all(|it| objects.entries().contains(it))
    }
}

/// The sizes of a call's arguments.
struct CallSizes<'a, L> {
    state: &'a L,
    scratch: &'a L,
    /// The number of rays, or of objects in the leaf mode.
    count: usize,
    /// The rays that code looks at.
    rays: Range<usize>,
    /// The number of lanes of the mask.
    mask: Option<usize>,
    /// The number of lanes for accepted hits.
    accepted: Option<usize>,
    instances: Instances<'a>,
    /// The vector width in whose multiples code accesses the caller's arrays.
    vector: usize,
}

/// Returns the number of lanes of so many rays in whole vectors.
#[inline(always)]
fn needed_lanes(rays: usize, vector: usize) -> Result<usize, CallError> {
    if rays > i32::MAX as usize {
        return Err(CallError::TooManyRays(rays));
    }
    rays.checked_next_multiple_of(vector).ok_or(CallError::TooManyRays(rays))
}

#[inline(always)]
fn has_room(rays: usize, needed: usize, given: usize) -> Result<(), CallError> {
    if given >= needed { Ok(()) } else { Err(CallError::TooFewLanes { rays, needed, given }) }
}

#[inline(always)]
fn exists(all: bool) -> Result<(), CallError> {
    if all { Ok(()) } else { Err(CallError::NoSuchObject) }
}

/// Checks that a range of objects begins at a block and is within the given number.
#[inline(always)]
fn check_range(first: u32, count: usize, objects: usize) -> Result<(), CallError> {
    if !first.is_multiple_of(offsets::OBJECTS_IN_BLOCK) {
        return Err(CallError::NoBlockStart(first));
    }
    let end = (first as usize).checked_add(count);
    exists(end.is_some_and(|end| end <= objects))
}

/// True if the indices of rays, and of lanes in the same vectors, are below `instances`.
#[inline(always)]
fn are_numbers(indices: &[u32], rays: &Range<usize>, instances: usize) -> bool {
    // A number of rays that cannot be rounded up exceeds the number of indices.
    let padding = offsets::LANE_PADDING as usize;
    let padded = rays.end.checked_next_multiple_of(padding).unwrap_or(rays.end);
    let read = indices.get(rays.start..padded.min(indices.len())).unwrap_or_default();
    // Not `all`, which is not vectorised.
    let greatest = read.iter().fold(0, |greatest, index| greatest.max(*index));
    indices.len() >= rays.end && (greatest as usize) < instances
}

#[cfg(test)]
mod tests {
    use rtsl_ir::host::NoHost;

    use crate::lanes::LaneBlock;

    use super::*;

    fn signature() -> Signature {
        Signature {
            state: ComponentSet::from_iter([1, 3]),
            scratch_arrays: 2,
            block_words: 4,
            buffers: Arc::default(),
            object_words: None,
            object_blocks: None,
            object_buffers: Arc::default(),
            mode: CallMode::Packet,
            accepts: true,
        }
    }

    /// A plain call fits just where the checks of all calls find no error, except that it refuses sparse scratch.
    #[test]
    fn plain_calls_fit_by_the_rules_of_all_calls() {
        let (signature, small, large) = (signature(), LaneMask::new(16), LaneMask::new(48));
        let blocks = [2, 4].map(|words| InstanceBlock::new(&vec![0; words], Vec::new()));
        let sizes = [16, 40];
        let mut fitting = 0;
        for (lanes, components, scratch_arrays) in
            sizes.into_iter().flat_map(|lanes| [(lanes, 4, 2), (lanes, 3, 2), (lanes, 4, 1)])
        {
            for (block, mask, accepts) in blocks.iter().flat_map(|block| {
                let masks = [None, Some(&small), Some(&large)];
                masks.into_iter().flat_map(move |mask| [16, 48, 0].map(|it| (block, mask, it)))
            }) {
                let mut accepted = LaneMask::new(accepts);
                let call = CallArguments {
                    state: &mut LaneBlock::new(components, lanes),
                    scratch: &mut LaneBlock::new(scratch_arrays, 40),
                    count: 40,
                    mask,
                    accepted: (accepts > 0).then_some(&mut accepted),
                    instances: Instances::One(block),
                    host: &mut NoHost,
                };
                let fits = signature.fits_plain_call(&call, block);
                assert_eq!(fits, signature.check(&call).is_ok());
                fitting += usize::from(fits);
            }
        }
        assert_eq!(fitting, 2);
    }

    /// Neither code nor checks look at rays before the vector of the first that is on, and after the last.
    #[test]
    fn rays_that_a_mask_leaves_out_may_have_any_index() {
        let accepting = signature();
        let signature = Signature { accepts: false, ..accepting.clone() };
        let mut mask = LaneMask::new(100);
        assert!(signature.rays(100, Some(&mask)).is_empty());
        mask.begin_range(35..50);
        assert_eq!(signature.rays(100, Some(&mask)), 32..50);
        assert_eq!(signature.rays(40, Some(&mask)), 32..40);
        assert!(signature.rays(20, Some(&mask)).is_empty());
        assert_eq!(signature.rays(100, None), 0..100);
        assert_eq!(accepting.rays(100, Some(&mask)), 0..100);
        let mut indices = [9; 100];
        indices[32..64].fill(2);
        assert!(are_numbers(&indices, &(32..50), 3) && !are_numbers(&indices, &(32..65), 3));
        assert!(!are_numbers(&indices, &(16..50), 3));
        assert!(!are_numbers(&indices[..48], &(32..50), 3), "indices are missing");
        mask.begin_range(96..100);
        assert!(are_numbers(&indices, &signature.rays(40, Some(&mask)), 1));
    }

    #[test]
    fn calls_of_objects_are_not_plain() {
        let plain = signature();
        assert!(plain.is_plain());
        assert!(!Signature { mode: CallMode::Stream, ..plain.clone() }.is_plain());
        assert!(!Signature { object_words: Some(3), ..plain.clone() }.is_plain());
        let buffers = [BufferEntry { offset: 0, element_words: 1 }].into();
        assert!(!Signature { buffers, ..plain }.is_plain());
    }
}
