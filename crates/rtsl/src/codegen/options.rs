//! How programs are compiled and run.

use rtsl_jit::OptLevel;

/// How exact arithmetic is.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Math {
    /// `a * b + c` is rounded once where one rule in the IR says so; the same on every machine.
    #[default]
    Contract,
    /// Every operation is rounded.
    Strict,
    /// Like `Contract`, and code generators may reassociate and approximate: results may differ
    /// from machine to machine.
    Fast,
}

impl Math {
    /// The name on command lines.
    pub const fn name(self) -> &'static str {
        match self {
            Math::Contract => "contract",
            Math::Strict => "strict",
            Math::Fast => "fast",
        }
    }

    /// The mode of this name.
    pub fn from_name(name: &str) -> Option<Math> {
        [Math::Contract, Math::Strict, Math::Fast].into_iter().find(|math| math.name() == name)
    }
}

/// What runs kernels.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Backend {
    /// Machine code where there is an LLVM, else the interpreter, with a warning.
    #[default]
    Auto,
    /// Machine code; without LLVM an error.
    Jit,
    /// The interpreter.
    Interpreter,
}

/// How an [`Engine`](crate::Engine) makes kernels.
///
/// ```
/// use rtsl::{Backend, Engine, EngineOptions, Math};
///
/// // Text of strangers, rounded as it is written, on the interpreter.
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
    /// What runs them.
    pub backend: Backend,
    /// Rays at a time: 1, 4, 8 or 16; what suits the machine where `None`. Never changes results.
    pub width: Option<u32>,
    /// How many vectors full chunks are done at a time: 1, 2 or 4; where `None`, each kernel has
    /// what suits its code. Never changes results.
    pub interleave: Option<u32>,
    /// How exact arithmetic is.
    pub math: Math,
    /// The greatest number of loop iterations of one ray in one call, all loops taken together;
    /// unlimited where `None`. A call that passes it says so in its status. Hosts that run text
    /// they do not know set it here and in [`CompilerOptions`](crate::CompilerOptions).
    pub loop_budget: Option<u32>,
    /// How much work goes into machine code. Never changes results.
    pub optimization: OptLevel,
}
