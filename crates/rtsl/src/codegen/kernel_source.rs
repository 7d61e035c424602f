//! The input of code generation.

use rtsl_abi::{BufferEntry, CallMode, DataLocation, Layout, Signature};
use rtsl_ir::{Function, Output, VariableKind};
use rtsl_jit::MAX_FRAME_BYTES;
use rtsl_source::Diagnostic;

use super::touched::state_components;
use super::variant::Variant;
use crate::errors;

/// A linked function with the call mode, width and layout of the kernel to make.
#[derive(Clone, Copy)]
pub(crate) struct KernelSource<'a> {
    pub function: &'a Function,
    pub mode: CallMode,
    /// Rays at a time.
    pub width: u32,
    pub layout: &'a Layout,
}

impl<'a> KernelSource<'a> {
    /// The widths of kernels.
    pub const WIDTHS: [u32; 4] = [1, 4, 8, 16];

    /// Creates the source of a variant's kernel. `width` is that of variants without one.
    pub fn new(
        function: &'a Function,
        variant: &Variant,
        layout: &'a Layout,
        width: u32,
    ) -> KernelSource<'a> {
        KernelSource { function, mode: variant.mode, width: variant.width_in(width), layout }
    }

    /// Checks that there are kernels of the width.
    pub fn check_width(self) -> Result<(), Diagnostic> {
        if Self::WIDTHS.contains(&self.width) {
            return Ok(());
        }
        Err(errors::unknown_width(self.width))
    }

    /// Returns a smaller width for a kernel whose stack frame is too large: each value on the stack has a lane for each
    /// ray.
    ///
    /// Kernels of all widths give the same results. A narrow kernel compiles in seconds, where wide code that has to
    /// fit its frame takes LLVM minutes.
    pub fn narrower_width(self, frame_bytes: usize) -> Option<u32> {
        let narrower = Self::WIDTHS.into_iter().filter(|width| *width < self.width);
        let bytes = |width: u32| frame_bytes * width as usize / self.width as usize;
        narrower.clone().filter(|it| bytes(*it) <= MAX_FRAME_BYTES).max().or(narrower.min())
    }

    /// Returns the requirements of the kernel on a call.
    pub fn signature(self) -> Signature {
        let kind = |output: &Output| self.function.variable(output.variable).kind;
        let (buffers, object_buffers) = self.buffers();
        let form = self.layout.object_form(self.mode);
        Signature {
            state: state_components(self.function),
            scratch_arrays: self.layout.scratch_arrays,
            block_words: self.layout.block_words,
            buffers: buffers.into(),
            object_words: form.as_ref().map(|form| form.words().len() as u32),
            object_blocks: form.and_then(|form| form.few_blocks()),
            object_buffers: object_buffers.into(),
            mode: self.mode,
            accepts: self
                .function
                .outputs
                .iter()
                .any(|output| kind(output) == VariableKind::Accepted),
        }
    }

    /// The buffers that all objects of a call share, and those of each object.
    fn buffers(self) -> (Vec<BufferEntry>, Vec<BufferEntry>) {
        let form = self.layout.object_form(self.mode);
        let (mut shared, mut of_objects) = (Vec::new(), Vec::new());
        let variables = self.function.variables.iter();
        for variable in variables.filter(|variable| variable.kind == VariableKind::Buffer) {
            let element_words = variable.len;
            match self.layout.locate(variable, form.as_ref()) {
                Some(DataLocation::Instance(offset)) => {
                    shared.push(BufferEntry { offset, element_words });
                }
                Some(DataLocation::Objects(offset)) => {
                    of_objects.push(BufferEntry { offset, element_words });
                }
                None => {}
            }
        }
        (shared, of_objects)
    }
}
