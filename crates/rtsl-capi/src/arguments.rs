//! Calls of kernels, checked.

use std::ffi::c_void;

use rtsl::{
    CallArguments, CallError, CallMode, CallStatus, HostArguments, HostLanes, Instances, LaneBlock,
    LaneIndices, LaneMask, state_component_count,
};

use crate::error::{Error, RtslResult, check_size, guard, place, slice};
use crate::host::{CHost, RtslHostFunctions};
use crate::kernel::KernelEntry;
use crate::registry::{RtslInstanceId, RtslKernelId, RtslObjectsId};

/// The arguments of a call for many rays. All zeros, but for the size, is a call for no rays; kernels of the shape single
/// are called for one.
#[repr(C)]
pub struct RtslArguments {
    /// `sizeof(RtslArguments)`: later versions may add fields at the end.
    pub size: u32,
    /// How many rays: 1 of the shape single; of the shape leaf how many objects.
    pub count: u32,
    /// How many words each array has: at least the count rounded up to a multiple of the kernel's width; of the shape leaf at
    /// least 1.
    pub lanes: u32,
    /// How many pointers `state` has: `RTSL_STATE_COMPONENTS`.
    pub state_count: u32,
    /// How many pointers `scratch` has.
    pub scratch_count: u32,
    /// Bits of `RtslStatus` are set.
    pub status: u32,
    /// A lane array for each state component; null for those that the method neither reads nor sets.
    pub state: *const *mut f32,
    /// A lane array for each of the class's scratch arrays; null where it has none.
    pub scratch: *const *mut f32,
    /// 0 or -1 a ray, as many words as the arrays have; of the shape leaf 0 or -1 an object, `count` of them. Null: all
    /// rays, and always of the shape single.
    pub mask: *const i32,
    /// `intersect`, leaf shape apart: written, -1 for rays with a hit and 0 for others; as many words as the arrays have.
    pub accepted: *mut i32,
    /// What answers the shader's questions, or null: zeros.
    pub host: *const RtslHostFunctions,
    /// Passed to the host's functions.
    pub user: *mut c_void,
    /// The instance, for shapes with one object.
    pub instance: RtslInstanceId,
    /// The objects, for the shapes stream and leaf.
    pub objects: RtslObjectsId,
    /// The shape stream: the number of each ray's object, `count` of them.
    pub index: *const u32,
    /// The shape leaf: the number of the first object, a multiple of `RTSL_OBJECTS_IN_BLOCK`.
    pub first: u32,
    /// `intersect` in the shape leaf: written, the number of the object with the nearest hit, or `RTSL_NONE`. What else the
    /// method set is in lane 0.
    pub nearest: u32,
}

/// Runs a method for many rays. Everything is checked but what arrays have room for, which is `lanes`. Where it fails nothing
/// was run.
///
/// # Safety
/// `arguments` is null or leads to so many bytes as its size says; its pointers are null or lead to what their fields say, used by
/// nobody else meanwhile; the host's functions do what `rtsl_kernel.h` says.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn rtsl_kernel_call(
    kernel: RtslKernelId,
    arguments: *mut RtslArguments,
) -> RtslResult {
    guard(|| {
        // Safety: the caller's promise; the struct is whole if its size is right.
        let arguments = unsafe {
            check_size(arguments, "arguments")?;
            place(arguments, "arguments")?
        };
        let kernel = kernel.get()?;
        // Safety: the caller's promise.
        unsafe { call(&kernel, arguments) }
    })
}

/// # Safety
/// As for [`rtsl_kernel_call`].
unsafe fn call(kernel: &KernelEntry, arguments: &mut RtslArguments) -> Result<(), Error> {
    let lanes = arguments.lanes as usize;
    // Safety: the caller's promise.
    let (state, scratch) = unsafe {
        let state = slice(arguments.state, arguments.state_count as usize, "state")?;
        let scratch = slice(arguments.scratch, arguments.scratch_count as usize, "scratch")?;
        (HostLanes::from_table(state, lanes), HostLanes::from_table(scratch, lanes))
    };
    // Safety: the caller's promise.
    let functions = unsafe { arguments.host.as_ref() }.copied().unwrap_or_default();
    let host = CHost { functions, user: arguments.user };
    let lanes = CallLanes { state, scratch, host };
    let status = match kernel.shape {
        // Safety: the caller's promise.
        CallMode::Single | CallMode::Packet | CallMode::CommonOrigin | CallMode::Stream => unsafe {
            call_rays(kernel, arguments, lanes)?
        },
        // Safety: the caller's promise.
        CallMode::Leaf => unsafe { call_leaf(kernel, arguments, lanes)? },
    };
    arguments.nearest = status.nearest.unwrap_or(rtsl::NO_OBJECT);
    arguments.status |= u32::from(status.budget_exhausted);
    Ok(())
}

/// What calls of all shapes have.
struct CallLanes<'a> {
    state: HostLanes<'a>,
    scratch: HostLanes<'a>,
    host: CHost,
}

/// # Safety
/// As for [`rtsl_kernel_call`].
unsafe fn call_rays(
    kernel: &KernelEntry,
    arguments: &RtslArguments,
    lanes: CallLanes<'_>,
) -> Result<CallStatus, Error> {
    let CallLanes { mut state, mut scratch, mut host } = lanes;
    let room = arguments.lanes as usize;
    // Safety: the caller's promise.
    let mask = (!arguments.mask.is_null())
        .then(|| unsafe { slice(arguments.mask, room, "mask") })
        .transpose()?;
    // Safety: the caller's promise.
    let accepted = (!arguments.accepted.is_null() && room > 0)
        .then(|| unsafe { std::slice::from_raw_parts_mut(arguments.accepted, room) });
    let (block, objects, indices);
    let instances = if kernel.shape == CallMode::Stream {
        objects = arguments.objects.get()?;
        check_program(kernel, &objects.program)?;
        // Safety: the caller's promise.
        indices = unsafe { lane_indices(arguments)? };
        Instances::Many(&objects.objects, &indices)
    } else {
        block = arguments.instance.get()?.block(&kernel.program)?;
        Instances::One(&block)
    };
    let called = kernel.kernel.call_host(HostArguments {
        state: &mut state,
        scratch: &mut scratch,
        count: arguments.count as usize,
        mask,
        accepted,
        instances,
        host: &mut host,
    });
    called.map_err(|error| refused(&error))
}

/// # Safety
/// As for [`rtsl_kernel_call`].
unsafe fn lane_indices(arguments: &RtslArguments) -> Result<LaneIndices, Error> {
    let count = arguments.count as usize;
    if count > arguments.lanes as usize {
        let problem = format!("{count} rays take as many lanes, and there are {}", arguments.lanes);
        return Err(Error::new(RtslResult::Lanes, problem));
    }
    // Safety: the caller's promise.
    let numbers = unsafe { slice(arguments.index, count, "index")? };
    let mut indices = LaneIndices::new(count);
    indices.as_mut_slice().copy_from_slice(numbers);
    Ok(indices)
}

/// # Safety
/// As for [`rtsl_kernel_call`].
unsafe fn call_leaf(
    kernel: &KernelEntry,
    arguments: &RtslArguments,
    lanes: CallLanes<'_>,
) -> Result<CallStatus, Error> {
    let CallLanes { mut state, mut scratch, mut host } = lanes;
    let objects = arguments.objects.get()?;
    check_program(kernel, &objects.program)?;
    let count = arguments.count as usize;
    let end = (arguments.first as usize).checked_add(count);
    let begins_block = arguments.first.is_multiple_of(rtsl::OBJECTS_IN_BLOCK);
    if !begins_block || end.is_none_or(|end| end > objects.objects.len()) {
        let problem = format!(
            "there are {} objects, and those of a leaf begin at a multiple of {}",
            objects.objects.len(),
            rtsl::OBJECTS_IN_BLOCK
        );
        return Err(Error::new(RtslResult::Argument, problem));
    }
    // `intersect` leaves what it found in lane 0, other methods leave theirs in the objects' lanes.
    let used = if kernel.accepts() { 1 } else { count.max(1) };
    let components: Vec<u32> = kernel.kernel.state_components().iter().collect();
    if let Some(missing) = components.iter().find(|component| !state.has(**component)) {
        let problem = format!("the state has no array for component {missing}");
        return Err(Error::new(RtslResult::Lanes, problem));
    }
    if (arguments.lanes as usize) < used {
        let problem = format!("the call takes {used} lanes, and there are {}", arguments.lanes);
        return Err(Error::new(RtslResult::Lanes, problem));
    }
    let mut own_state = LaneBlock::sparse(state_component_count() as usize, &components, used);
    let mut own_scratch = kernel.program.new_scratch(used);
    state.copy_to(&mut own_state, used);
    scratch.copy_to(&mut own_scratch, used);
    // Safety: the caller's promise.
    let mask = unsafe { leaf_mask(arguments, count)? };
    let called = kernel.kernel.try_call(CallArguments {
        state: &mut own_state,
        scratch: &mut own_scratch,
        count,
        mask: mask.as_ref(),
        accepted: None,
        instances: Instances::Range(&objects.objects, arguments.first),
        host: &mut host,
    });
    let status = called.map_err(|error| refused(&error))?;
    state.copy_from(&own_state, used);
    scratch.copy_from(&own_scratch, used);
    Ok(status)
}

/// # Safety
/// As for [`rtsl_kernel_call`].
unsafe fn leaf_mask(arguments: &RtslArguments, count: usize) -> Result<Option<LaneMask>, Error> {
    if arguments.mask.is_null() {
        return Ok(None);
    }
    // Safety: the caller's promise.
    let words = unsafe { slice(arguments.mask, count, "mask")? };
    Ok(Some(LaneMask::from_fn(count, |lane| words[lane] != 0)))
}

fn check_program(
    kernel: &KernelEntry,
    program: &std::sync::Arc<rtsl::Program>,
) -> Result<(), Error> {
    if std::sync::Arc::ptr_eq(&kernel.program, program) {
        return Ok(());
    }
    let problem = "the objects are of another class than the kernel, or of another engine";
    Err(Error::new(RtslResult::Instance, problem))
}

/// A call that can't be made.
fn refused(error: &CallError) -> Error {
    let result = match error {
        CallError::MissingState(_)
        | CallError::MissingScratch(_)
        | CallError::TooManyRays(_)
        | CallError::TooFewLanes { .. } => RtslResult::Lanes,
        CallError::MissingAccepted
        | CallError::NotOneRay
        | CallError::NoSuchObject
        | CallError::NoBlockStart(_) => RtslResult::Argument,
        CallError::InstanceForm(_) | CallError::ForeignInstance => RtslResult::Instance,
        CallError::NoStack => RtslResult::Memory,
    };
    Error::new(result, error.to_string())
}
