//! What can go wrong.

use std::fmt;
use std::path::PathBuf;

/// The version of an LLVM library.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct LlvmVersion {
    /// The number that says which API there is.
    pub major: u32,
    /// The second number.
    pub minor: u32,
    /// The third number.
    pub patch: u32,
}

impl fmt::Display for LlvmVersion {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}.{}.{}", self.major, self.minor, self.patch)
    }
}

/// Why there is no LLVM. The text says what was tried and what can be done.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct LlvmError {
    /// Each library that was looked at, and why it does not serve.
    pub tried: Vec<(PathBuf, String)>,
    /// Whether the environment variable `RTSL_LLVM` chose the library.
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
            crate::llvm::OLDEST_MAJOR
        )
    }
}

impl std::error::Error for LlvmError {}

/// Why a module's text did not become code.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum JitError {
    /// The packet code breaks a rule: a mistake in the compiler.
    #[error("the packet code is not valid: {0}")]
    InvalidKernel(#[from] rtsl_packet::VerifyError),
    /// The packet code and the record that it is to be called for do not fit each other.
    #[error("{0}")]
    Record(#[from] rtsl_packet::RecordError),
    /// The text is not LLVM's language, or the module breaks its rules.
    #[error("LLVM does not accept the module: {0}")]
    InvalidModule(String),
    /// The target's name, or one of its features, means nothing to this LLVM.
    #[error("LLVM has no target `{triple}`: {reason}")]
    UnknownTarget {
        /// The target triple.
        triple: String,
        /// LLVM's words.
        reason: String,
    },
    /// LLVM reported an error or gave up while it made code.
    #[error("LLVM failed: {0}")]
    CodeGeneration(String),
    /// A function keeps too much on the stack.
    #[error(
        "`{function}` needs {} KiB of stack, where {} KiB are allowed",
        .bytes.div_ceil(1024),
        crate::frames::MAX_FRAME_BYTES >> 10
    )]
    Frame {
        /// The function's symbol.
        function: String,
        /// What it needs.
        bytes: usize,
    },
    /// The code calls what this process must not or can't provide.
    #[error("the compiled code calls `{0}`, which is no function of the runtime")]
    UndefinedSymbol(String),
    /// The object file holds something that the loader does not know.
    #[error("the object file can't be loaded: {0}")]
    Object(String),
    /// There is no function of this name in the module.
    #[error("the module has no function `{0}`")]
    MissingFunction(String),
    /// Code for another machine can be printed, but not run.
    #[error("code for `{0}` can't run on this machine")]
    ForeignTarget(String),
    /// This process was forked from one that was compiling on another thread.
    #[error(
        "this process was forked while another thread of its parent compiled, so LLVM can't be used in it"
    )]
    Forked,
    /// `exit` was called: LLVM's globals are gone, or will be any moment.
    #[error("the process is ending, and nothing is compiled any more")]
    Ending,
    /// The system gave no memory for code.
    #[error("no memory for machine code: {0}")]
    Memory(String),
}
