//! Values that documents give as text.

use crate::types::Type;

/// Returns the numbers of a value, or `None` if the text has others.
pub fn numbers(text: &str, ty: Type) -> Option<Vec<f64>> {
    match ty {
        Type::Boolean => match text.trim() {
            "true" | "True" | "1" => Some(vec![1.0]),
            "false" | "False" | "0" => Some(vec![0.0]),
            _ => None,
        },
        Type::Text => None,
        _ => {
            let numbers: Option<Vec<f64>> = parts(text).take(ty.count() + 1).map(number).collect();
            let numbers = numbers?;
            match numbers.len() {
                // One number serves all components.
                1 if ty.is_vector() => Some(vec![numbers[0]; ty.count()]),
                count if count == ty.count() => Some(numbers),
                _ => None,
            }
        }
    }
}

/// Returns the first numbers of a text that has more of them than the type; `None` for other texts.
pub fn first_numbers(text: &str, ty: Type) -> Option<Vec<f64>> {
    if matches!(ty, Type::Boolean | Type::Text) {
        return None;
    }
    let mut numbers: Vec<f64> = parts(text).map(number).collect::<Option<_>>()?;
    let is_longer = numbers.len() > ty.count();
    numbers.truncate(ty.count());
    is_longer.then_some(numbers)
}

/// The words between commas and white space.
fn parts(text: &str) -> impl Iterator<Item = &str> {
    let parts = text.split(|letter: char| letter == ',' || letter.is_whitespace());
    parts.filter(|part| !part.is_empty())
}

fn number(text: &str) -> Option<f64> {
    let value: f64 = text.parse().ok()?;
    (value.is_finite() && value.abs() <= f64::from(f32::MAX)).then_some(value)
}

/// Writes a value in RTSL.
pub fn rtsl(numbers: &[f64], ty: Type) -> String {
    match ty {
        Type::Boolean => (numbers[0] != 0.0).to_string(),
        Type::Integer => format!("{}", numbers[0] as i32),
        Type::Float => float(numbers[0]),
        _ => {
            let parts: Vec<String> = numbers.iter().copied().map(float).collect();
            let same = parts.iter().all(|part| *part == parts[0]);
            let parts = if same && ty.is_vector() { &parts[..1] } else { &parts[..] };
            format!("{}({})", ty.rtsl(), parts.join(", "))
        }
    }
}

/// Writes a number in RTSL, in parentheses if it is negative.
pub fn float(value: f64) -> String {
    let text = format!("{:?}", value as f32);
    if text.starts_with('-') { format!("({text})") } else { text }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_have_the_count_of_the_type() {
        assert_eq!(numbers("1, 0.5,-2", Type::Color3), Some(vec![1.0, 0.5, -2.0]));
        assert_eq!(numbers("0.5", Type::Vector2), Some(vec![0.5, 0.5]));
        assert_eq!(numbers("1, 2", Type::Vector3), None);
        assert_eq!(numbers("nan", Type::Float), None);
        assert_eq!(numbers("1e99", Type::Float), None);
        assert_eq!(numbers("true", Type::Boolean), Some(vec![1.0]));
        assert_eq!(numbers("10,000", Type::Float), None);
    }

    #[test]
    fn the_first_numbers_are_those_of_texts_with_more() {
        assert_eq!(first_numbers("10,000", Type::Float), Some(vec![10.0]));
        assert_eq!(first_numbers("1, 2, 3, 4", Type::Color3), Some(vec![1.0, 2.0, 3.0]));
        assert_eq!(first_numbers("1, 2, 3", Type::Color3), None);
        assert_eq!(first_numbers("10 m", Type::Float), None);
    }

    #[test]
    fn values_are_written_as_rtsl_reads_them() {
        assert_eq!(rtsl(&[1.0, 0.5, -2.0], Type::Color3), "vec3(1.0, 0.5, (-2.0))");
        assert_eq!(rtsl(&[0.5, 0.5], Type::Vector2), "vec2(0.5)");
        assert_eq!(rtsl(&[1e-7], Type::Float), "1e-7");
        assert_eq!(rtsl(&[1.0], Type::Boolean), "true");
    }
}
