//! Calls of interpreters in the forms that machine code has: of a host's arrays, and of tests in leaves.

use rtsl_abi::{
    CallArguments, CallError, CallStatus, HostArguments, Instances, LaneBlock, LaneMask,
    LeafArguments, Objects, Signature,
};
use rtsl_spec::state_component_count;

/// The stack of a call, in builds without optimisation. Interpreters recurse over nested operations at most.
const FRAME_BYTES: usize = 32 << 10;

/// Checks that the stack has room for a call.
///
/// # Errors
/// If it has not.
pub(super) fn check_stack() -> Result<(), CallError> {
    rtsl_abi::check_stack(FRAME_BYTES)
}

/// Runs a method for all rays of a host's arrays, whose values are copied.
///
/// # Errors
/// If the arguments do not fit the method, or the stack has no room for it.
pub(super) fn with_copies(
    signature: &Signature,
    call: HostArguments<'_, '_>,
    run: impl FnOnce(CallArguments<'_>) -> CallStatus,
) -> Result<CallStatus, CallError> {
    signature.check_host(&call, 1)?;
    check_stack()?;
    let HostArguments { state, scratch, count, mask, accepted, instances, host } = call;
    let components: Vec<u32> = signature.state.iter().collect();
    let mut own_state = LaneBlock::sparse(state_component_count() as usize, &components, count);
    let mut own_scratch = LaneBlock::new(signature.scratch_arrays as usize, count);
    state.copy_to(&mut own_state, count);
    scratch.copy_to(&mut own_scratch, count);
    let mask = mask.map(|mask| LaneMask::from_fn(count, |lane| mask[lane] != 0));
    let mut hits = LaneMask::new(count);
    let status = run(CallArguments {
        state: &mut own_state,
        scratch: &mut own_scratch,
        count,
        mask: mask.as_ref(),
        accepted: Some(&mut hits),
        instances,
        host,
    });
    state.copy_from(&own_state, count);
    scratch.copy_from(&own_scratch, count);
    if let Some(accepted) = accepted.filter(|_| signature.accepts) {
        let words = accepted.iter_mut().zip(hits.words());
        words.for_each(|(accepted, hit)| *accepted = hit.cast_signed());
    }
    Ok(status)
}

/// Makes the tests of a call in the call mode `leaf`, one after another. `run` makes one, for the ray of a lane.
pub(super) fn make_tests(
    signature: &Signature,
    call: LeafArguments<'_>,
    objects: &Objects,
    run: impl Fn(CallArguments<'_>, usize) -> CallStatus,
) -> CallStatus {
    signature.check_leaf(&call, objects.len());
    let LeafArguments { state, scratch, count, tests, host } = call;
    let mut status = CallStatus::default();
    for test in tests {
        let call = CallArguments {
            state: &mut *state,
            scratch: &mut *scratch,
            count: count as usize,
            mask: None,
            accepted: None,
            instances: Instances::Range(objects, test.first),
            host: &mut *host,
        };
        let made = run(call, test.ray as usize);
        test.set_nearest(made.nearest);
        status.budget_exhausted |= made.budget_exhausted;
    }
    status
}
