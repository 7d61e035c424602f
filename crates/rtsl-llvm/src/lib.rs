//! Emission of packet code as LLVM text.
//!
//! The emission of text requires no LLVM: this crate depends on LLVM's language (as versions 17 to 23 read it) and on
//! the instructions of targets, but on no library, no process and no part of RTSL except packet code.
//!
//! A kernel becomes one function, `void @symbol(ptr %call)`; `rtsl_abi::offsets` describes its argument. A kernel that
//! interleaves has a second function, and often a third, for [full chunks](FullChunks), which the first calls. The
//! argument of a [`Callback`] is a struct of the host instead. Nothing in the text allows LLVM to change a result: no
//! fast-math flags, no contraction, no undefined value that reaches an active lane. Where approximation is allowed,
//! packet code contains approximate operations, and the text determines their implementation.

mod approximation;
mod arithmetic;
mod blend;
mod callback;
mod chunk;
mod classification;
mod constructor;
mod control;
mod emitter;
mod fma;
mod full_chunks;
mod host;
mod leaf_test;
mod library;
mod memory;
mod module;
mod nearest;
mod negation;
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
pub use full_chunks::FullChunks;
pub use library::{Library, emit_library};
pub use target::{Estimates, TargetFeatures};

/// Returns the text of a module with a function for each kernel, with the symbol given with it.
pub fn emit<'a>(
    kernels: impl IntoIterator<Item = (&'a str, &'a Kernel)>,
    target: &TargetFeatures,
) -> String {
    emit_module(kernels, target).finish()
}

/// Returns the text of a module with a function for each callback, whose argument is a struct of the host.
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
            None if kernel.keeps_nearest() => &[Part::Full, Part::All],
            None => &[Part::All],
            Some(_) => &[Part::Full, Part::Rest],
        };
        for part in parts {
            let function = Emitter::new(&mut module, kernel, *part).emit(symbol);
            module.add_function(&function);
        }
        if kernel.keeps_nearest() {
            module.add_function(&all_tests(symbol, kernel.width));
        }
    }
    module
}
