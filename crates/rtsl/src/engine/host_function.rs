//! Functions of the renderer's texts that hosts call now and then.

use std::sync::OnceLock;
use std::sync::atomic::{AtomicUsize, Ordering};

use rtsl_abi::LaneBlock;
use rtsl_ir::Constant;

use super::engine::Engine;
use super::renderer_function::RendererFunction;

/// A [function of the renderer's texts](RendererFunction) that is made when it is needed, since stages compute most of
/// what hosts may have to. It is interpreted at first, because the few calls for the preparation of a scene take less
/// time than machine code does. Threads may share it.
#[derive(Debug)]
pub struct HostFunction {
    engine: Engine,
    name: &'static str,
    known: Vec<Constant>,
    interpreted: OnceLock<RendererFunction>,
    compiled: OnceLock<RendererFunction>,
    /// The number of lanes of interpreted calls.
    lanes: AtomicUsize,
}

impl HostFunction {
    /// The number of lanes that are interpreted, in about the time that it takes to make machine code.
    pub(crate) const INTERPRETED: usize = 1 << 12;

    /// Describes the function with a name, for known values of the first scalars of its parameters.
    pub fn new(engine: &Engine, name: &'static str, known: &[Constant]) -> HostFunction {
        HostFunction {
            engine: engine.clone(),
            name,
            known: known.to_vec(),
            interpreted: OnceLock::new(),
            compiled: OnceLock::new(),
            lanes: AtomicUsize::new(0),
        }
    }

    /// Calls it for the first `count` lanes of arrays: those of the other scalars of its parameters, in order, then those
    /// of its results.
    ///
    /// # Panics
    /// If there is no function of this name, or its parameters begin otherwise.
    #[inline]
    pub fn call(&self, arrays: &mut LaneBlock, count: usize) {
        let function = self.compiled.get().unwrap_or_else(|| self.prepare(count));
        function.call(arrays, count, None);
    }

    /// True once calls need no interpreter.
    #[cfg(test)]
    pub(crate) fn is_compiled(&self) -> bool {
        self.compiled.get().is_some()
    }

    /// Returns the function for a further call of so many lanes. One thread makes the machine code; the others need not
    /// wait. If code generation fails, the function is interpreted from then on.
    #[cold]
    fn prepare(&self, count: usize) -> &RendererFunction {
        let before = self.lanes.fetch_add(count, Ordering::Relaxed);
        let is_last = before < Self::INTERPRETED && before + count >= Self::INTERPRETED;
        if is_last && let Ok(compiled) = self.engine.renderer_function(self.name, &self.known) {
            return self.compiled.get_or_init(|| compiled);
        }
        self.interpreted.get_or_init(|| {
            let made = Engine::interpreter().renderer_function(self.name, &self.known);
            made.expect("the interpreter runs the texts of the library")
        })
    }
}
