//! Packet code as LLVM text.
//!
//! Writing text needs no LLVM: this crate knows the language of LLVM (as versions 17 to 23 read
//! it) and which instructions of a target are worth using, but no library, no process and
//! nothing of RTSL but packet code.
//!
//! A kernel becomes one function, `void @symbol(ptr %call)`; `rtsl_abi::offsets` says what it finds
//! there. One that interleaves has a second, which the first calls for full chunks. A [`Callback`] finds
//! the same in a struct of a host's own. Nothing in the text allows LLVM to change a result: no fast-math flags, no contraction, no undefined value that
//! reaches a lane that is on. Where approximation is allowed packet code says so, and the text says
//! how.

mod approximation;
mod arithmetic;
mod blend;
mod callback;
mod chunk;
mod constructor;
mod control;
mod emitter;
mod fma;
mod host;
mod leaf_test;
mod library;
mod memory;
mod module;
mod nearest;
mod objects;
mod operand;
mod target;
mod values;

use rtsl_packet::Kernel;

use crate::emitter::{Emitter, Part};
use crate::leaf_test::all_tests;
use crate::module::Module;

pub use callback::Callback;
pub use constructor::{ConstructedWord, Constructor, ConstructorPart};
pub use library::{Library, emit_library};
pub use target::{Estimates, TargetFeatures};

/// The text of a module with a function for each kernel, called by the symbol that stands with it.
pub fn emit<'a>(
    kernels: impl IntoIterator<Item = (&'a str, &'a Kernel)>,
    target: &TargetFeatures,
) -> String {
    emit_module(kernels, target).finish()
}

/// The text of a module with a function for each callback, whose argument is a struct of the host's.
pub fn emit_callbacks<'a>(
    callbacks: impl IntoIterator<Item = (&'a str, Callback<'a>)>,
    target: &TargetFeatures,
) -> String {
    let mut module = Module::new(target);
    for (symbol, callback) in callbacks {
        let function = Emitter::for_callback(&mut module, callback).emit(symbol);
        module.add_function(&function);
    }
    module.finish()
}

fn emit_module<'a, 'm>(
    kernels: impl IntoIterator<Item = (impl AsRef<str>, &'a Kernel)>,
    target: &'m TargetFeatures,
) -> Module<'m> {
    let mut module = Module::new(target);
    for (symbol, kernel) in kernels {
        let symbol = symbol.as_ref();
        let parts: &[Part] = match kernel.interleave {
            None => &[Part::All],
            Some(_) => &[Part::Full, Part::Rest],
        };
        for part in parts {
            let function = Emitter::new(&mut module, kernel, *part).emit(symbol);
            module.add_function(&function);
        }
        if kernel.keeps_nearest() {
            module.add_function(&all_tests(symbol));
        }
    }
    module
}
