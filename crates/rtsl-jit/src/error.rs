//! Errors of loading LLVM and of compilation.

use std::fmt;
use std::path::PathBuf;

/// The version of an LLVM library.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct LlvmVersion {
    /// The major version, which determines the API.
    pub major: u32,
    /// The minor version.
    pub minor: u32,
    /// The patch version.
    pub patch: u32,
}

impl fmt::Display for LlvmVersion {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}.{}.{}", self.major, self.minor, self.patch)
    }
}

/// The reason LLVM could not be loaded. The message lists the libraries tried and suggests remedies.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct LlvmError {
    /// Each library that was tried, and the reason it was rejected.
    pub tried: Vec<(PathBuf, String)>,
    /// True if the environment variable `RTSL_LLVM` selected the library.
    pub chosen_by_user: bool,
}

impl fmt::Display for LlvmError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if self.chosen_by_user {
            write!(f, "the LLVM that RTSL_LLVM names can't be used")?;
        } else if self.tried.is_empty() {
            write!(f, "no LLVM library was found")?;
        } else {
            write!(f, "none of the LLVM libraries found can be used")?;
        }
        for (path, reason) in &self.tried {
            write!(f, "\n  {}: {reason}", path.display())?;
        }
        write!(
            f,
            "\n  install LLVM {} or newer (Debian: `apt install libllvm19`), or the Rust \
             toolchain, which holds one, or set RTSL_LLVM to the library's file or folder",
            crate::limits::OLDEST_MAJOR
        )
    }
}

impl std::error::Error for LlvmError {}

/// The reason a module's text could not be compiled.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum JitError {
    /// The packet code violates an invariant: a bug in the compiler.
    #[error("the packet code is not valid: {0}")]
    InvalidKernel(#[from] rtsl_packet::VerifyError),
    /// The packet code and the record for which it is compiled do not fit each other.
    #[error("{0}")]
    Record(#[from] rtsl_packet::RecordError),
    /// The text is not valid LLVM syntax, or the module is invalid.
    #[error("LLVM does not accept the module: {0}")]
    InvalidModule(String),
    /// This LLVM does not support the target, or one of its features.
    #[error("LLVM has no target `{triple}`: {reason}")]
    UnknownTarget {
        /// The target triple.
        triple: String,
        /// LLVM's message.
        reason: String,
    },
    /// LLVM reported an error or aborted during code generation.
    #[error("LLVM failed: {0}")]
    CodeGeneration(String),
    /// The stack frame of a function is too large.
    #[error(
        "`{function}` needs {} KiB of stack, where {} KiB are allowed",
        .bytes.div_ceil(1024),
        crate::limits::MAX_FRAME_BYTES >> 10
    )]
    Frame {
        /// The function's symbol.
        function: String,
        /// The size of its frame.
        bytes: usize,
    },
    /// The code calls a function that is not part of the runtime.
    #[error("the compiled code calls `{0}`, which is not a function of the runtime")]
    UndefinedSymbol(String),
    /// The object file contains a feature that the loader does not support.
    #[error("the object file can't be loaded: {0}")]
    Object(String),
    /// The module has no function of this name.
    #[error("the module has no function `{0}`")]
    MissingFunction(String),
    /// The target differs from this machine; such code can be printed but not run.
    #[error("code for `{0}` can't run on this machine")]
    ForeignTarget(String),
    /// This process was forked from one that was compiling on another thread.
    #[error(
        "this process was forked while another thread of its parent compiled, so LLVM can't be used in it"
    )]
    Forked,
    /// `exit` was called: LLVM's globals are destroyed, or will be at any moment.
    #[error("the process is ending, and nothing is compiled any more")]
    Ending,
    /// The system has no memory for code.
    #[error("no memory for machine code: {0}")]
    Memory(String),
}

/// The reason for which a folder can't keep compiled code.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum CodeCacheError {
    /// It can't be created or read.
    #[error("the folder `{}` can't be used: {reason}", .path.display())]
    Folder {
        /// The folder.
        path: PathBuf,
        /// The system's reason.
        reason: String,
    },
    /// It, or a folder above it, belongs to another user.
    #[error("the folder `{}` belongs to another user", .0.display())]
    Owner(PathBuf),
    /// Other users may write in it, or in a folder above it.
    #[error("other users may write in the folder `{}`", .0.display())]
    Writable(PathBuf),
}
