//! Types and operands of LLVM text.

use std::fmt::{self, Display, Formatter};

use rtsl_ir::{Constant, Scalar};

/// A scalar type, or a vector of more than one.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct LlvmType {
    pub element: &'static str,
    /// The number of elements; 1 for the element itself, since LLVM generates poor code for vectors of one.
    pub count: u32,
}

impl LlvmType {
    pub fn is_vector(self) -> bool {
        self.count > 1
    }

    /// Returns the type with the same number of another element.
    pub fn of(self, element: &'static str) -> LlvmType {
        LlvmType { element, ..self }
    }

    /// Returns the type of one element.
    pub fn one(self) -> LlvmType {
        LlvmType { count: 1, ..self }
    }

    /// Returns the suffix in names of intrinsics: `v8f32`.
    pub fn suffix(self) -> String {
        let element = match self.element {
            "float" => "f32",
            "double" => "f64",
            "ptr" => "p0",
            integer => integer,
        };
        if self.is_vector() { format!("v{}{element}", self.count) } else { element.to_owned() }
    }
}

impl Display for LlvmType {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        match self.count {
            0 | 1 => f.write_str(self.element),
            count => write!(f, "<{count} x {}>", self.element),
        }
    }
}

/// Returns the element type of values in registers.
pub fn register_element(scalar: Scalar) -> &'static str {
    match scalar {
        Scalar::F32 => "float",
        Scalar::I32 | Scalar::U32 => "i32",
        Scalar::Bool => "i1",
    }
}

/// Returns the element type in memory, where bools are words.
pub fn memory_element(scalar: Scalar) -> &'static str {
    match scalar {
        Scalar::F32 => "float",
        Scalar::I32 | Scalar::U32 | Scalar::Bool => "i32",
    }
}

/// An operand of an instruction.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Operand {
    /// The result of an instruction.
    Local(u32),
    /// The function's argument.
    Call,
    /// The bits of an f32.
    Float(u32),
    Int(i32),
    Bool(bool),
    /// Zeros of any type but a pointer.
    Zero,
}

impl Operand {
    /// Returns a constant as a scalar operand.
    pub fn constant(constant: Constant) -> Operand {
        match constant {
            Constant::F32(value) => Operand::Float(value.to_bits()),
            Constant::I32(value) => Operand::Int(value),
            Constant::U32(value) => Operand::Int(value as i32),
            Constant::Bool(value) => Operand::Bool(value),
        }
    }

    /// True if all bits are zero.
    pub fn is_zero(self) -> bool {
        matches!(self, Operand::Zero | Operand::Float(0) | Operand::Int(0) | Operand::Bool(false))
    }
}

impl Display for Operand {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        match *self {
            Operand::Local(number) => write!(f, "%t{number}"),
            Operand::Call => f.write_str("%call"),
            Operand::Float(bits) => write!(f, "0x{:016X}", double_bits(bits)),
            Operand::Int(value) => write!(f, "{value}"),
            Operand::Bool(value) => write!(f, "{value}"),
            Operand::Zero => f.write_str("zeroinitializer"),
        }
    }
}

/// Returns the bits of the f64 of the same value, in which LLVM writes an f32; payloads of NaNs are preserved.
fn double_bits(bits: u32) -> u64 {
    let value = f32::from_bits(bits);
    if value.is_nan() {
        let sign = u64::from(bits >> 31) << 63;
        return sign | 0x7ff << 52 | u64::from(bits & 0x007f_ffff) << 29;
    }
    f64::from(value).to_bits()
}

/// A basic block.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Label(pub u32);

impl Display for Label {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        write!(f, "b{}", self.0)
    }
}
