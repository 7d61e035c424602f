//! Hand-written kernels, safe to run.
#![allow(unsafe_code, reason = "hand-written kernels read and write arrays without checks")]

use crate::kernels::Kernel;
#[cfg(target_arch = "x86_64")]
use crate::packet::Packet;
use crate::packet::RAYS;
#[cfg(target_arch = "x86_64")]
use crate::rivals::libraries::LibraryFunction;

/// A kernel's machine code: state, scratch, parameters. Slices, so that the compiler knows that what is
/// stored in one is not loaded from another, and does uniform work once.
pub(crate) type Entry = unsafe fn(&mut [f32], &mut [f32], &[f32]);

#[derive(Clone, Copy, Debug)]
enum Code {
    Kernel(Entry),
    #[cfg(target_arch = "x86_64")]
    Library(LibraryFunction),
}

/// A hand-written kernel with the sizes of what it touches.
#[derive(Clone, Copy, Debug)]
pub struct Written {
    code: Code,
    state: usize,
    scratch: usize,
    parameters: usize,
}

impl Written {
    /// `entry` must be code of the kernel `K` that this processor can run.
    pub(crate) const fn new<K: Kernel>(entry: Entry) -> Written {
        Written::of::<K>(Code::Kernel(entry))
    }

    /// `function` must be the function that `K` is, and this processor must have AVX2.
    #[cfg(target_arch = "x86_64")]
    pub(crate) const fn library<K: Kernel>(function: LibraryFunction) -> Written {
        Written::of::<K>(Code::Library(function))
    }

    const fn of<K: Kernel>(code: Code) -> Written {
        Written { code, state: K::STATE, scratch: K::SCRATCH, parameters: K::PARAMETERS }
    }

    /// Does a packet of [`RAYS`] rays.
    ///
    /// # Panics
    /// If there are fewer arrays or parameters than the kernel touches, or they are not aligned to 64
    /// bytes.
    pub fn run(&self, state: &mut [f32], scratch: &mut [f32], parameters: &[f32]) {
        assert!(state.len() >= self.state * RAYS, "the state has the kernel's arrays");
        assert!(scratch.len() >= self.scratch * RAYS, "scratch has the kernel's arrays");
        assert!(parameters.len() >= self.parameters, "the kernel's parameters are there");
        let is_aligned = |array: &[f32]| array.as_ptr().addr().is_multiple_of(64);
        assert!(is_aligned(state) && is_aligned(scratch), "arrays are aligned for vectors");
        // Safety: the arrays have the sizes and the alignment that were just checked. Who made this promised that the code is
        // the kernel's and that this processor can run it. What indices a table among the parameters leads to is the race's
        // to answer for, whose table is a permutation of bytes: a check of it here would count as the rival's time.
        unsafe {
            match self.code {
                Code::Kernel(entry) => entry(state, scratch, parameters),
                #[cfg(target_arch = "x86_64")]
                Code::Library(function) => {
                    function.packet(Packet::new(state, scratch, parameters));
                }
            }
        }
    }
}
