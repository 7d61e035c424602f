//! Options of code generation.

use rtsl_jit::OptLevel;

use super::line_costs::LineCosts;
use super::trace::Trace;

/// The exactness of arithmetic.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Math {
    /// `a * b + c` is rounded once if a rule of the IR contracts it; results are the same on every machine.
    #[default]
    Contract,
    /// Every operation is rounded.
    Strict,
    /// Like `Contract`, and code generators may reassociate and approximate: results may differ
    /// from machine to machine.
    Fast,
}

impl Math {
    /// Returns the name on command lines.
    pub const fn name(self) -> &'static str {
        match self {
            Math::Contract => "contract",
            Math::Strict => "strict",
            Math::Fast => "fast",
        }
    }

    /// Returns the mode of this name.
    pub fn from_name(name: &str) -> Option<Math> {
        [Math::Contract, Math::Strict, Math::Fast].into_iter().find(|math| math.name() == name)
    }
}

/// The means to run kernels.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Backend {
    /// Machine code if there is an LLVM, else the interpreter, with a warning.
    #[default]
    Auto,
    /// Machine code; without LLVM an error.
    Jit,
    /// The interpreter.
    Interpreter,
}

/// Options of an [`Engine`](crate::Engine).
///
/// ```
/// use rtsl::{Backend, Engine, EngineOptions, Math};
///
/// // Untrusted text on the interpreter, each operation rounded.
/// let options = EngineOptions {
///     backend: Backend::Interpreter,
///     math: Math::Strict,
///     loop_budget: Some(1_000_000),
///     ..EngineOptions::default()
/// };
/// let (engine, _) = Engine::new(options)?;
/// assert!(engine.llvm().is_none());
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct EngineOptions {
    /// The means to run kernels.
    pub backend: Backend,
    /// Rays at a time: 1, 4, 8 or 16; if `None`, the width of the machine's vectors. Never changes results.
    pub width: Option<u32>,
    /// The number of full chunks at a time: 1, 2 or 4; if `None`, an estimate chooses for each kernel. Never changes
    /// results.
    pub interleave: Option<u32>,
    /// The exactness of arithmetic.
    pub math: Math,
    /// The greatest number of loop iterations of one ray in one call, all loops taken together; unlimited if `None`.
    /// The status of a call that uses it up has a flag. Hosts that run untrusted text set it here and in
    /// [`CompilerOptions`](crate::CompilerOptions).
    pub loop_budget: Option<u32>,
    /// The level of optimisation of machine code. Never changes results.
    pub optimization: OptLevel,
    /// The record of what methods do. With one, the engine runs everything on the interpreter, without optimisation and
    /// with the same results. Classes must be [compiled for it](crate::CompilerOptions::traced).
    pub trace: Option<Trace>,
    /// The record of the work of lines. With one, and without a trace, the engine runs everything on the interpreter of
    /// packet code, 8 rays at a time if no width is given, and with the same results.
    pub costs: Option<LineCosts>,
}
