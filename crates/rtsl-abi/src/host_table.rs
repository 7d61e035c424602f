//! The host's functions as machine code calls them.
//!
//! A panic of the host must not unwind through machine code, which has no unwind tables. It is caught and stored; from
//! then on the host is not called again and answers are zeros; the panic resumes when the kernel has returned.

use std::any::Any;
use std::ffi::c_void;
use std::panic::{AssertUnwindSafe, catch_unwind};

use rtsl_ir::Query;
use rtsl_ir::host::{
    Host, LaneColors, LaneFloats, LaneSet, LaneWords, LightLanes, LightQueryLanes, MAX_LANES,
    RayLanes,
};
use rtsl_spec::COLOR_COMPONENTS;

/// A colour as kernels receive it from the host.
pub type Color = [f32; COLOR_COMPONENTS as usize];

/// Pointers to the functions, in the order of the `HOST_` constants of [`offsets`](crate::offsets).
#[repr(C)]
pub struct HostTable {
    /// Computes the radiance along rays.
    pub trace: unsafe extern "C" fn(*mut c_void, u32, u32, *const RayLanes, *mut LaneColors),
    /// Returns the set of lanes whose rays hit anything.
    pub occluded: unsafe extern "C" fn(*mut c_void, u32, u32, *const RayLanes) -> u32,
    /// Returns the number of lights.
    pub light_count: unsafe extern "C" fn(*mut c_void) -> u32,
    /// Samples one light from points; returns the set of lanes that it reaches.
    pub light_sample: unsafe extern "C" fn(
        *mut c_void,
        u32,
        u32,
        u32,
        *const LightQueryLanes,
        *mut LightLanes,
    ) -> u32,
    /// Returns the ambient light.
    pub ambient: unsafe extern "C" fn(*mut c_void, *mut Color),
    /// Returns the next random number of each lane.
    pub rand: unsafe extern "C" fn(*mut c_void, u32, u32, *mut LaneFloats),
    /// Answers a query of an integrator.
    pub query: unsafe extern "C" fn(*mut c_void, u32, u32, u32, *const LaneWords, *mut LaneWords),
}

/// Functions that answer each request immediately from the [`HostCalls`] behind the user pointer.
pub static HOST_TABLE: HostTable =
    HostTable { trace, occluded, light_count, light_sample, ambient, rand, query };

/// The host of a call and its panic, if any; the user pointer of [`HOST_TABLE`] points to it.
pub struct HostCalls<'a> {
    /// The host, which answers requests.
    pub host: &'a mut dyn Host,
    /// The panic of the host, to be resumed once the kernel has returned.
    pub panic: Option<Box<dyn Any + Send>>,
}

impl HostCalls<'_> {
    /// Queries the host; returns zeros once it has panicked.
    fn ask<T: Default>(&mut self, question: impl FnOnce(&mut dyn Host) -> T) -> T {
        if self.panic.is_some() {
            return T::default();
        }
        match catch_unwind(AssertUnwindSafe(|| question(self.host))) {
            Ok(answer) => answer,
            Err(panic) => {
                self.panic = Some(panic);
                T::default()
            }
        }
    }
}

/// Returns the calls behind the user pointer.
///
/// # Safety
/// `user` is the pointer of the running call, and nothing else uses the calls meanwhile.
unsafe fn calls<'a>(user: *mut c_void) -> &'a mut HostCalls<'a> {
    // Safety: the caller's promise.
    unsafe { &mut *user.cast() }
}

unsafe extern "C" fn trace(
    user: *mut c_void,
    base: u32,
    active: u32,
    rays: *const RayLanes,
    radiance: *mut LaneColors,
) {
    // Safety: kernels pass their user pointer, and lanes on the stack.
    let (calls, rays, radiance) = unsafe { (calls(user), &*rays, &mut *radiance) };
    *radiance = calls.ask(|host| {
        let mut answer = LaneColors::default();
        host.trace(LaneSet { base, active }, rays, &mut answer);
        answer
    });
}

unsafe extern "C" fn occluded(
    user: *mut c_void,
    base: u32,
    active: u32,
    rays: *const RayLanes,
) -> u32 {
    // Safety: as for `trace`.
    let (calls, rays) = unsafe { (calls(user), &*rays) };
    calls.ask(|host| host.occluded(LaneSet { base, active }, rays)) & active
}

unsafe extern "C" fn light_count(user: *mut c_void) -> u32 {
    // Safety: as for `trace`.
    let calls = unsafe { calls(user) };
    calls.ask(|host| host.light_count())
}

unsafe extern "C" fn light_sample(
    user: *mut c_void,
    base: u32,
    active: u32,
    index: u32,
    query: *const LightQueryLanes,
    light: *mut LightLanes,
) -> u32 {
    // Safety: as for `trace`.
    let (calls, query, light) = unsafe { (calls(user), &*query, &mut *light) };
    let lanes = LaneSet { base, active };
    let (answer, reached) = calls.ask(|host| {
        let mut answer = LightLanes::default();
        let reached = host.light_sample(lanes, index, query, &mut answer);
        (answer, reached)
    });
    *light = answer;
    reached & active
}

unsafe extern "C" fn ambient(user: *mut c_void, color: *mut Color) {
    // Safety: as for `trace`.
    let (calls, color) = unsafe { (calls(user), &mut *color) };
    *color = calls.ask(|host| host.ambient());
}

unsafe extern "C" fn rand(user: *mut c_void, base: u32, active: u32, values: *mut LaneFloats) {
    // Safety: as for `trace`.
    let (calls, values) = unsafe { (calls(user), &mut *values) };
    *values = calls.ask(|host| {
        let mut answer = LaneFloats::default();
        host.rand(LaneSet { base, active }, &mut answer);
        answer
    });
}

unsafe extern "C" fn query(
    user: *mut c_void,
    base: u32,
    active: u32,
    query: u32,
    operands: *const LaneWords,
    results: *mut LaneWords,
) {
    let query = Query::ALL[query as usize];
    let (operand_count, result_count) =
        (query.operand_scalars().count(), query.result_scalars().count());
    // Safety: as for `trace`; kernels pass an array for each operand and result of the query.
    let (calls, operands, results) = unsafe {
        (
            calls(user),
            std::slice::from_raw_parts(operands, operand_count),
            std::slice::from_raw_parts_mut(results, result_count),
        )
    };
    results.fill([0; MAX_LANES]);
    calls.ask(|host| host.query_lanes(LaneSet { base, active }, query, operands, results));
}

#[cfg(test)]
mod tests {
    use std::mem::offset_of;

    use crate::offsets;

    use super::*;

    #[test]
    fn the_table_is_in_the_order_of_the_interface() {
        for (offset, index) in [
            (offset_of!(HostTable, trace), offsets::HOST_TRACE),
            (offset_of!(HostTable, occluded), offsets::HOST_OCCLUDED),
            (offset_of!(HostTable, light_count), offsets::HOST_LIGHT_COUNT),
            (offset_of!(HostTable, light_sample), offsets::HOST_LIGHT_SAMPLE),
            (offset_of!(HostTable, ambient), offsets::HOST_AMBIENT),
            (offset_of!(HostTable, rand), offsets::HOST_RAND),
            (offset_of!(HostTable, query), offsets::HOST_QUERY),
            (size_of::<HostTable>(), offsets::HOST_FUNCTIONS),
        ] {
            assert_eq!(offset, index as usize * size_of::<usize>());
        }
    }
}
