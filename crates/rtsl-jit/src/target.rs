//! Target machines of compilation.

use std::ffi::CString;
use std::fmt;

/// A machine: LLVM's triple, processor and features.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub struct Target {
    pub(crate) triple: String,
    pub(crate) cpu: String,
    pub(crate) features: String,
    pub(crate) is_host: bool,
}

impl Target {
    /// The names that [`Target::by_name`] accepts, except `host`.
    pub const NAMES: [&'static str; 4] = ["x86-64-v2", "x86-64-v3", "x86-64-v4", "aarch64"];

    /// Returns a machine by its name on the command line; `None` for a name that is not in [`Target::NAMES`].
    pub fn by_name(name: &str) -> Option<Target> {
        let (triple, cpu) = match name {
            "x86-64-v2" | "x86-64-v3" | "x86-64-v4" => ("x86_64-unknown-linux-gnu", name),
            "aarch64" => ("aarch64-unknown-linux-gnu", "generic"),
            _ => return None,
        };
        Some(Target {
            triple: triple.to_owned(),
            cpu: cpu.to_owned(),
            features: String::new(),
            is_host: false,
        })
    }

    /// Returns the LLVM triple of this machine. The object format is always ELF, because the loader of
    /// [`crate::Module`] reads that; the calling convention is always that of Linux.
    pub(crate) fn host_triple() -> &'static str {
        if cfg!(target_arch = "aarch64") {
            "aarch64-unknown-linux-gnu"
        } else {
            "x86_64-unknown-linux-gnu"
        }
    }

    /// Returns the target triple.
    pub fn triple(&self) -> &str {
        &self.triple
    }

    /// Returns LLVM's name of the processor.
    pub fn cpu(&self) -> &str {
        &self.cpu
    }

    /// Returns the features of the processor in addition to those of its name, in LLVM syntax: `+fma,-avx512f`.
    pub fn features(&self) -> &str {
        &self.features
    }

    /// True if this is the machine on which the program runs.
    pub fn is_host(&self) -> bool {
        self.is_host
    }
}

/// Prints the triple and the processor.
impl fmt::Display for Target {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} {}", self.triple, self.cpu)
    }
}

pub(crate) fn c_string(text: &str) -> CString {
    CString::new(text.replace('\0', " ")).unwrap_or_default()
}
