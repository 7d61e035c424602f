//! The stack size of locals.

use rtsl_abi::CallMode;
use rtsl_ir::VariableKind;
use rtsl_ir::host::MAX_LANES;

use crate::kernel::{Kernel, KernelVariable};

/// The greatest size of the locals of a kernel of the greatest width, in words: they are on the stack, and kernels call
/// hosts that call kernels. The limit is the same for every width, so that a shader compiles for all or for none.
pub const MAX_LOCAL_WORDS: u64 = 1 << 16;

/// Returns the stack size of the locals of a kernel of the greatest width, in words.
pub(crate) fn local_words(kernel: &Kernel) -> u64 {
    // In the leaf mode scratch arrays are uniform and copied to the stack.
    let is_local = |variable: &&KernelVariable| match variable.variable.kind {
        VariableKind::Local => true,
        VariableKind::Scratch => kernel.mode == CallMode::Leaf,
        VariableKind::State
        | VariableKind::Member
        | VariableKind::Parameter
        | VariableKind::Buffer
        | VariableKind::Accepted => false,
    };
    let words = kernel.variables.iter().filter(is_local);
    let words = words.map(|variable| {
        u64::from(variable.variable.len) * if variable.varies { MAX_LANES as u64 } else { 1 }
    });
    words.sum()
}
