//! Constants in C++ syntax.

use rtsl_ir::{Constant, Scalar};

/// Returns the type of values.
pub(crate) fn type_name(scalar: Scalar) -> &'static str {
    match scalar {
        Scalar::F32 => "float",
        Scalar::I32 => "int32_t",
        Scalar::U32 => "uint32_t",
        Scalar::Bool => "bool",
    }
}

/// Returns the type of words in a block: bools are words of 0 and 1.
pub(crate) fn stored_type_name(scalar: Scalar) -> &'static str {
    match scalar {
        Scalar::Bool => "uint32_t",
        Scalar::F32 | Scalar::I32 | Scalar::U32 => type_name(scalar),
    }
}

/// Returns a constant as a value.
pub(crate) fn literal(constant: Constant) -> String {
    match constant {
        Constant::F32(value) => float(value),
        Constant::I32(i32::MIN) => "INT32_MIN".to_owned(),
        Constant::I32(value) => value.to_string(),
        Constant::U32(value) if value < 0x1_0000 => format!("{value}u"),
        Constant::U32(value) => format!("{value:#x}u"),
        Constant::Bool(value) => value.to_string(),
    }
}

/// Returns a constant as a word of a block.
pub(crate) fn stored_literal(scalar: Scalar, bits: u32) -> String {
    match scalar {
        Scalar::Bool => format!("{}u", u32::from(bits != 0)),
        Scalar::F32 | Scalar::I32 | Scalar::U32 => literal(Constant::from_bits(scalar, bits)),
    }
}

/// Returns the shortest decimal that is read back as this number.
fn float(value: f32) -> String {
    if value.is_nan() {
        // NaN payloads are not preserved.
        return "NAN".to_owned();
    }
    if value.is_infinite() {
        return if value > 0.0 { "INFINITY" } else { "-INFINITY" }.to_owned();
    }
    format!("{value:?}f")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn constants_are_written_exactly() {
        let table = [
            (Constant::F32(1.0), "1.0f"),
            (Constant::F32(-0.0), "-0.0f"),
            (Constant::F32(0.1), "0.1f"),
            (Constant::F32(1e-45), "1e-45f"),
            (Constant::F32(f32::MAX), "3.4028235e38f"),
            (Constant::F32(f32::NEG_INFINITY), "-INFINITY"),
            (Constant::F32(f32::NAN), "NAN"),
            (Constant::I32(i32::MIN), "INT32_MIN"),
            (Constant::I32(-7), "-7"),
            (Constant::U32(7), "7u"),
            (Constant::U32(u32::MAX), "0xffffffffu"),
            (Constant::Bool(true), "true"),
        ];
        for (constant, expected) in table {
            assert_eq!(literal(constant), expected);
        }
        assert_eq!(stored_literal(Scalar::Bool, 5), "1u");
    }
}
