//! From text to classes.

use std::path::PathBuf;

/// How text is compiled.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct CompilerOptions {
    /// The greatest number of loop iterations of one ray in one call, all loops taken
    /// together; unlimited where `None`. Hosts that run text they do not know set it.
    pub loop_budget: Option<u32>,
    /// The folders in which `#include` looks after that of the including file.
    pub search_path: Vec<PathBuf>,
}
