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
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct EngineOptions {
    /// What runs them.
    pub backend: Backend,
    /// Rays at a time: 1, 4, 8 or 16; what suits the machine where `None`. Never changes results.
    pub width: Option<u32>,
    /// How exact arithmetic is.
    pub math: Math,
    /// How much work goes into machine code. Never changes results.
    pub optimization: OptLevel,
}

/// What the rays of one call have in common. The author of a shader wrote for one ray and
/// one object; the shape says which of the two is many.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Shape {
    /// Rays vary, the object is one.
    Packet,
    /// Rays vary, and each has its own object.
    Stream,
}

impl Shape {
    /// All shapes.
    pub const ALL: [Shape; 2] = [Shape::Packet, Shape::Stream];

    /// The name that the command line and the text form use.
    pub const fn name(self) -> &'static str {
        match self {
            Shape::Packet => "packet",
            Shape::Stream => "stream",
        }
    }

    /// The shape of this name.
    pub fn from_name(name: &str) -> Option<Shape> {
        Shape::ALL.into_iter().find(|shape| shape.name() == name)
    }
}
