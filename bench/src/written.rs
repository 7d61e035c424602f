//! Hand-written kernels, safe to run.
#![allow(unsafe_code, reason = "hand-written kernels read and write arrays without checks")]

use crate::kernels::Kernel;
use crate::packet::{Packet, RAYS};

/// A kernel's machine code.
pub(crate) type Entry = unsafe fn(Packet);

/// A hand-written kernel with the sizes of what it touches.
#[derive(Clone, Copy, Debug)]
pub struct Written {
    entry: Entry,
    state: usize,
    scratch: usize,
    parameters: usize,
}

impl Written {
    /// `entry` must be code of the kernel `K` that this processor can run.
    pub(crate) const fn new<K: Kernel>(entry: Entry) -> Written {
        Written { entry, state: K::STATE, scratch: K::SCRATCH, parameters: K::PARAMETERS }
    }

    /// Does a packet of [`RAYS`] rays.
    ///
    /// # Panics
    /// If there are fewer arrays or parameters than the kernel touches, or they are not aligned to 64
    /// bytes.
    pub fn run(&self, state: &mut [u32], scratch: &mut [u32], parameters: &[f32]) {
        assert!(state.len() >= self.state * RAYS, "the state has the kernel's arrays");
        assert!(scratch.len() >= self.scratch * RAYS, "scratch has the kernel's arrays");
        assert!(parameters.len() >= self.parameters, "the kernel's parameters are there");
        let packet = Packet {
            state: state.as_mut_ptr().cast(),
            scratch: scratch.as_mut_ptr().cast(),
            parameters: parameters.as_ptr(),
        };
        assert!(packet.state.addr().is_multiple_of(64) && packet.scratch.addr().is_multiple_of(64));
        // Safety: the arrays have the sizes that were just checked; any bits are floats.
        unsafe { (self.entry)(packet) }
    }
}
