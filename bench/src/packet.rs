//! A packet of rays in memory, as hand-written code sees it.
#![allow(unsafe_code, reason = "hand-written kernels read and write arrays without checks")]

/// Rays of a packet.
pub const RAYS: usize = 64;

/// The arrays of a packet from some ray on: array `k` of the state is `RAYS * k` words further, and so
/// for scratch.
#[derive(Clone, Copy, Debug)]
pub struct Packet {
    /// The state's arrays, in the order in which the race names them.
    pub state: *mut f32,
    /// The scratch arrays of the class.
    pub scratch: *mut f32,
    /// The parameters, which are the same for all rays.
    pub parameters: *const f32,
}

impl Packet {
    /// The packet in these arrays.
    #[inline(always)]
    pub fn new(state: &mut [f32], scratch: &mut [f32], parameters: &[f32]) -> Packet {
        Packet {
            state: state.as_mut_ptr(),
            scratch: scratch.as_mut_ptr(),
            parameters: parameters.as_ptr(),
        }
    }

    /// The packet from the ray `lanes` further on.
    ///
    /// # Safety
    /// Within the packet.
    #[inline(always)]
    pub unsafe fn at(self, lanes: usize) -> Packet {
        // Safety: as promised by the caller.
        unsafe {
            Packet {
                state: self.state.add(lanes),
                scratch: self.scratch.add(lanes),
                parameters: self.parameters,
            }
        }
    }

    /// Returns the start of an array of the state.
    ///
    /// # Safety
    /// The packet has it.
    #[inline(always)]
    pub unsafe fn state(self, array: usize) -> *mut f32 {
        // Safety: as promised by the caller.
        unsafe { self.state.add(array * RAYS) }
    }

    /// Returns the start of a scratch array.
    ///
    /// # Safety
    /// The packet has it.
    #[inline(always)]
    pub unsafe fn scratch(self, array: usize) -> *mut f32 {
        // Safety: as promised by the caller.
        unsafe { self.scratch.add(array * RAYS) }
    }

    /// Returns a parameter.
    ///
    /// # Safety
    /// The race has it.
    #[inline(always)]
    pub unsafe fn parameter(self, index: usize) -> f32 {
        // Safety: as promised by the caller.
        unsafe { *self.parameters.add(index) }
    }
}
