//! Machine code in memory.

use std::collections::BTreeMap;

use crate::elf::Object;
use crate::error::JitError;
use crate::frames::Frames;
use crate::memory::CodeMemory;
use crate::runtime;

/// Loaded machine code; its memory is freed on drop.
pub struct Module {
    memory: CodeMemory,
    functions: BTreeMap<String, usize>,
    frames: Frames,
}

impl Module {
    /// Loads an object file compiled for this machine, with the stack sizes `frames`.
    pub(crate) fn load(object: &[u8], frames: Frames) -> Result<Module, JitError> {
        let _span = tracing::debug_span!("load_code", bytes = object.len()).entered();
        let object = Object::parse(object)?;
        let layout = object.layout()?;
        let mut memory = CodeMemory::new(layout.size)?;
        let base = memory.address();
        object.write(&layout, base, memory.bytes(), runtime::address)?;
        memory.protect(layout.code_size)?;
        Ok(Module { memory, functions: object.functions(&layout)?, frames })
    }

    /// Returns the names of the functions, sorted.
    pub fn functions(&self) -> impl Iterator<Item = &str> {
        self.functions.keys().map(String::as_str)
    }

    /// Returns the address of a function, valid as long as the module lives.
    ///
    /// # Errors
    /// [`JitError::MissingFunction`].
    pub fn function(&self, name: &str) -> Result<*const u8, JitError> {
        let offset =
            self.functions.get(name).ok_or_else(|| JitError::MissingFunction(name.to_owned()))?;
        Ok(self.memory.at(*offset))
    }

    /// Returns the stack size of a call of the function in bytes, at most [`MAX_FRAME_BYTES`](crate::MAX_FRAME_BYTES).
    pub fn frame(&self, name: &str) -> usize {
        self.frames.of(name)
    }

    /// Returns the size of the code and its constants, in bytes.
    pub fn size(&self) -> usize {
        self.memory.size()
    }
}

impl std::fmt::Debug for Module {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Module").field("functions", &self.functions.keys()).finish()
    }
}
