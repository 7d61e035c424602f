//! Converts the spelling of a number literal to its value.

/// The value of a literal.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Number {
    /// The bits of a 32-bit integer.
    Int(i32),
    Uint(u32),
    Float(f32),
}

/// The reason why a spelling is not a number.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum NumberError {
    /// An invalid suffix after the digits, with its offset in the literal.
    Suffix(usize),
    /// A digit too large for the base.
    Digit(char),
    /// `0x` without digits, `1e` without an exponent, two points.
    Malformed,
    /// The suffix of floats after digits without a point and an exponent, with its offset.
    WholeFloat(usize),
    /// GLSL's suffix `lf` for doubles.
    Double,
    /// An integer of more than 32 bits.
    IntegerRange,
    /// A number larger than the largest float.
    FloatRange,
}

/// Parses `spelling`, which begins with a digit or with a point followed by a digit.
pub(crate) fn parse_number(spelling: &str) -> Result<Number, NumberError> {
    if let Some(digits) = spelling.strip_prefix("0x").or_else(|| spelling.strip_prefix("0X")) {
        return parse_integer(digits, 16, 2);
    }
    let integer_end = digits_end(spelling, 0);
    match spelling.as_bytes().get(integer_end) {
        Some(b'.' | b'e' | b'E' | b'f' | b'F') => parse_float(spelling, integer_end),
        Some(b'l' | b'L') => Err(double_or_suffix(spelling, integer_end)),
        _ if spelling.starts_with('0') && integer_end > 1 => parse_integer(&spelling[1..], 8, 1),
        _ => parse_integer(spelling, 10, 0),
    }
}

fn digits_end(spelling: &str, start: usize) -> usize {
    let digits = spelling[start..].bytes().take_while(u8::is_ascii_digit).count();
    start + digits
}

/// Parses digits and suffix; `offset` is the offset of `text` in the literal.
fn parse_integer(text: &str, base: u32, offset: usize) -> Result<Number, NumberError> {
    let is_digit = |byte: &u8| {
        if base == 16 { byte.is_ascii_hexdigit() } else { byte.is_ascii_digit() }
    };
    let end = text.bytes().take_while(is_digit).count();
    let (digits, suffix) = text.split_at(end);
    if digits.is_empty() {
        return Err(NumberError::Malformed);
    }
    let unsigned = match suffix {
        "" => false,
        "u" | "U" => true,
        _ => return Err(NumberError::Suffix(offset + end)),
    };
    let mut value = 0_u32;
    for digit in digits.chars() {
        let digit_value = digit.to_digit(base).ok_or(NumberError::Digit(digit))?;
        value = value
            .checked_mul(base)
            .and_then(|shifted| shifted.checked_add(digit_value))
            .ok_or(NumberError::IntegerRange)?;
    }
    Ok(if unsigned { Number::Uint(value) } else { Number::Int(value as i32) })
}

fn parse_float(spelling: &str, integer_end: usize) -> Result<Number, NumberError> {
    let bytes = spelling.as_bytes();
    let mut end = integer_end;
    if bytes.get(end) == Some(&b'.') {
        end = digits_end(spelling, end + 1);
    }
    if matches!(bytes.get(end), Some(b'e' | b'E')) {
        let signed = matches!(bytes.get(end + 1), Some(b'+' | b'-'));
        let exponent = end + 1 + usize::from(signed);
        end = digits_end(spelling, exponent);
        if end == exponent {
            return Err(NumberError::Malformed);
        }
    }
    match &spelling[end..] {
        "f" | "F" if end == integer_end => return Err(NumberError::WholeFloat(end)),
        "" | "f" | "F" => {}
        suffix if suffix.starts_with('.') => return Err(NumberError::Malformed),
        _ => return Err(double_or_suffix(spelling, end)),
    }
    // Rust rounds to the nearest float, ties to even, on every machine.
    let value: f32 = spelling[..end].parse().map_err(|_| NumberError::Malformed)?;
    if value.is_infinite() {
        return Err(NumberError::FloatRange);
    }
    Ok(Number::Float(value))
}

fn double_or_suffix(spelling: &str, suffix: usize) -> NumberError {
    match &spelling[suffix..] {
        "lf" | "LF" => NumberError::Double,
        _ => NumberError::Suffix(suffix),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn literals_have_glsl_values() {
        let cases = [
            ("12", Number::Int(12)),
            ("012", Number::Int(10)),
            ("0xC", Number::Int(12)),
            ("0XfFu", Number::Uint(255)),
            ("3u", Number::Uint(3)),
            ("0", Number::Int(0)),
            ("0xFFFFFFFF", Number::Int(-1)),
            ("4294967295", Number::Int(-1)),
            ("1.", Number::Float(1.0)),
            (".5", Number::Float(0.5)),
            ("1e3", Number::Float(1000.0)),
            ("1.5f", Number::Float(1.5)),
            ("09.5", Number::Float(9.5)),
            ("1.f", Number::Float(1.0)),
            ("1e0f", Number::Float(1.0)),
            ("2.5E-1F", Number::Float(0.25)),
        ];
        for (text, value) in cases {
            assert_eq!(parse_number(text), Ok(value), "{text}");
        }
    }

    #[test]
    fn malformed_literals_give_the_reason() {
        let cases = [
            ("12abc", NumberError::Suffix(2)),
            ("089", NumberError::Digit('8')),
            ("0x", NumberError::Malformed),
            ("1e", NumberError::Malformed),
            ("1..2", NumberError::Malformed),
            ("1f", NumberError::WholeFloat(1)),
            ("010F", NumberError::WholeFloat(3)),
            ("1.0lf", NumberError::Double),
            ("1.0h", NumberError::Suffix(3)),
            ("4294967296", NumberError::IntegerRange),
            ("1e39", NumberError::FloatRange),
            ("0xfg", NumberError::Suffix(3)),
        ];
        for (text, error) in cases {
            assert_eq!(parse_number(text), Err(error), "{text}");
        }
    }
}
