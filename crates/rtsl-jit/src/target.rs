//! The machine to compile for.

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
    /// The names that [`Target::by_name`] knows, `host` apart.
    pub const NAMES: [&'static str; 4] = ["x86-64-v2", "x86-64-v3", "x86-64-v4", "aarch64"];

    /// A machine by the name the command line gives it; `None` for a name that is not in
    /// [`Target::NAMES`].
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

    /// The triple by which LLVM knows this machine's kind. The object format is ELF
    /// everywhere, because the loader of [`crate::Module`] reads that; the calling convention
    /// is that of Linux everywhere.
    pub(crate) fn host_triple() -> &'static str {
        if cfg!(target_arch = "aarch64") {
            "aarch64-unknown-linux-gnu"
        } else {
            "x86_64-unknown-linux-gnu"
        }
    }

    /// LLVM's name of the kind of machine.
    pub fn triple(&self) -> &str {
        &self.triple
    }

    /// LLVM's name of the processor.
    pub fn cpu(&self) -> &str {
        &self.cpu
    }

    /// What the processor has beyond its name, as LLVM writes it: `+fma,-avx512f`.
    pub fn features(&self) -> &str {
        &self.features
    }

    /// Whether this is the machine the program runs on.
    pub fn is_host(&self) -> bool {
        self.is_host
    }
}

/// The kind of machine and the processor.
impl fmt::Display for Target {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} {}", self.triple, self.cpu)
    }
}

pub(crate) fn c_string(text: &str) -> CString {
    CString::new(text.replace('\0', " ")).unwrap_or_default()
}
