//! A host's functions.

use std::ffi::c_void;

use rtsl::COLOR_COMPONENTS;
use rtsl::host::{Host, LaneColors, LaneFloats, LaneSet, LightLanes, LightQueryLanes, RayLanes};

type Color = [f32; COLOR_COMPONENTS as usize];

/// What a shader asks of its renderer; `rtsl_kernel.h` tells what each function does. One that is null answers with zeros.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default)]
pub struct RtslHostFunctions {
    /// The radiance along rays.
    pub trace:
        Option<unsafe extern "C" fn(*mut c_void, u32, u32, *const RayLanes, *mut LaneFloats)>,
    /// Which lanes have anything on their rays.
    pub occluded: Option<unsafe extern "C" fn(*mut c_void, u32, u32, *const RayLanes) -> u32>,
    /// How many light samples there are.
    pub light_count: Option<unsafe extern "C" fn(*mut c_void) -> u32>,
    /// A light sample at points.
    pub light_sample: Option<
        unsafe extern "C" fn(
            *mut c_void,
            u32,
            u32,
            u32,
            *const LightQueryLanes,
            *mut LightLanes,
        ) -> u32,
    >,
    /// The ambient light.
    pub ambient: Option<unsafe extern "C" fn(*mut c_void, *mut f32)>,
    /// The next dimension of samplers.
    pub rand: Option<unsafe extern "C" fn(*mut c_void, u32, u32, *mut f32)>,
}

/// The functions with their user pointer.
pub struct CHost {
    pub functions: RtslHostFunctions,
    pub user: *mut c_void,
}

// Safety of all calls below: the functions do what the header says of them, as who handed them over has promised; the
// pointers lead to lanes that are there during the call.
impl Host for CHost {
    fn trace(&mut self, lanes: LaneSet, rays: &RayLanes, radiance: &mut LaneColors) {
        if let Some(trace) = self.functions.trace {
            // Safety: see above.
            unsafe { trace(self.user, lanes.base, lanes.active, rays, radiance.as_mut_ptr()) };
        }
    }

    fn occluded(&mut self, lanes: LaneSet, rays: &RayLanes) -> u32 {
        let Some(occluded) = self.functions.occluded else { return 0 };
        // Safety: see above.
        unsafe { occluded(self.user, lanes.base, lanes.active, rays) }
    }

    fn light_count(&mut self) -> u32 {
        let Some(light_count) = self.functions.light_count else { return 0 };
        // Safety: see above.
        unsafe { light_count(self.user) }
    }

    fn light_sample(
        &mut self,
        lanes: LaneSet,
        index: u32,
        query: &LightQueryLanes,
        light: &mut LightLanes,
    ) -> u32 {
        let Some(light_sample) = self.functions.light_sample else { return 0 };
        // Safety: see above.
        unsafe { light_sample(self.user, lanes.base, lanes.active, index, query, light) }
    }

    fn ambient(&mut self) -> Color {
        let mut color = Color::default();
        if let Some(ambient) = self.functions.ambient {
            // Safety: see above.
            unsafe { ambient(self.user, color.as_mut_ptr()) };
        }
        color
    }

    fn rand(&mut self, lanes: LaneSet, values: &mut LaneFloats) {
        if let Some(rand) = self.functions.rand {
            // Safety: see above.
            unsafe { rand(self.user, lanes.base, lanes.active, values.as_mut_ptr()) };
        }
    }
}
