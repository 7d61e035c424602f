//! Limits of LLVM's version and of stack frames.

/// The oldest LLVM with a suitable C API and syntax.
pub(crate) const OLDEST_MAJOR: u32 = 17;

/// The greatest stack size of a function, including the functions that it calls. Hosts call kernels on their threads'
/// stacks, each of which should be at least twice this size.
pub const MAX_FRAME_BYTES: usize = 256 << 10;
