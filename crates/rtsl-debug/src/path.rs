//! Parts of values by their paths: `hits[2].normal.x`.

use std::sync::Arc;

use rtsl::{Constant, ParameterType, Scalar, TracedValue, TracedVariable};

use crate::expression::holds_structs;
use crate::scopes::Scopes;

/// The result of looking up a path.
pub(crate) enum Found {
    /// The value.
    Value(TracedValue),
    /// The text is no path, or begins with no variable.
    NoPath,
    /// The variable has no such part.
    NoPart(String),
}

/// Returns the value that a path denotes.
pub(crate) fn find(scopes: &Scopes, text: &str) -> Found {
    let text = text.trim();
    if let Some(value) = scopes.find(text) {
        return Found::Value(value.clone());
    }
    let end = text.find(|letter: char| !is_of_name(letter)).unwrap_or(text.len());
    let (name, mut rest) = text.split_at(end);
    let Some(mut value) = scopes.find(name).cloned() else { return Found::NoPath };
    while !rest.is_empty() {
        let Some((step, after)) = next_step(scopes, rest) else { return Found::NoPath };
        value = match step_to(&value, &step) {
            Ok(part) => part,
            Err(message) => return Found::NoPart(message),
        };
        rest = after;
    }
    Found::Value(value)
}

/// Returns a part of a value, with its path as the name.
fn step_to(value: &TracedValue, step: &str) -> Result<TracedValue, String> {
    let name = value.name();
    let part = part(value, step).ok_or_else(|| format!("`{name}` has no part `{step}`"))?;
    let name = match step.starts_with('[') {
        true => format!("{name}{step}"),
        false => format!("{name}.{step}"),
    };
    Ok(renamed(&part, name))
}

/// Follows the steps after a value up to a part that is no struct, and returns it with the text after them.
pub(crate) fn part_without_structs<'a>(
    scopes: &Scopes,
    value: &TracedValue,
    mut rest: &'a str,
) -> Result<(TracedValue, &'a str), String> {
    let mut value = value.clone();
    while holds_structs(&value) {
        let Some((step, after)) = next_step(scopes, rest) else {
            let name = value.name();
            return Err(format!("`{name}` is a struct: an expression can have its fields only"));
        };
        value = step_to(&value, &step)?;
        rest = after;
    }
    Ok((value, rest))
}

/// Gives a value another name.
pub(crate) fn renamed(value: &TracedValue, name: String) -> TracedValue {
    let variable = TracedVariable { name, ..TracedVariable::clone(&value.variable) };
    TracedValue { variable: Arc::new(variable), words: value.words.clone() }
}

/// True for the letters of names.
pub(crate) fn is_of_name(letter: char) -> bool {
    letter.is_ascii_alphanumeric() || letter == '_'
}

/// Splits the first step off: `field`, or `[2]`. The index may be a variable.
fn next_step<'a>(scopes: &Scopes, rest: &'a str) -> Option<(String, &'a str)> {
    if let Some(rest) = rest.strip_prefix('.') {
        let end = rest.find(|letter: char| !is_of_name(letter)).unwrap_or(rest.len());
        return (end > 0).then(|| (rest[..end].to_owned(), &rest[end..]));
    }
    let (index, after) = rest.strip_prefix('[')?.split_once(']')?;
    let index = index.trim();
    let known = || match scopes.find(index)?.scalar()? {
        Constant::I32(value) => u32::try_from(value).ok(),
        Constant::U32(value) => Some(value),
        Constant::F32(_) | Constant::Bool(_) => None,
    };
    let index: u32 = index.parse().ok().or_else(known)?;
    Some((format!("[{index}]"), after))
}

fn part(value: &TracedValue, step: &str) -> Option<TracedValue> {
    let parts = value.parts();
    let named = |name: &str| parts.iter().find(|part| part.name() == name);
    if let Some(part) = named(step) {
        return Some(part.clone());
    }
    let is_vector = matches!(value.ty(), ParameterType::Vector(..) | ParameterType::Color);
    if !is_vector {
        return None;
    }
    if let Some(index) = step.strip_prefix('[').and_then(|it| it.strip_suffix(']')) {
        return parts.get(index.parse::<usize>().ok()?).cloned();
    }
    let components: Vec<&TracedValue> =
        step.chars().map(|letter| parts.get(component(letter)?)).collect::<Option<_>>()?;
    let scalar = match components.first()?.ty() {
        ParameterType::Scalar(scalar) => *scalar,
        _ => Scalar::F32,
    };
    let ty = match components.len() {
        1 => ParameterType::Scalar(scalar),
        count @ 2..=4 => ParameterType::Vector(scalar, count as u8),
        _ => return None,
    };
    let words = components.iter().flat_map(|part| part.words.iter().copied()).collect();
    let variable = TracedVariable::new(step, ty, value.variable.scope);
    Some(TracedValue { variable: Arc::new(variable), words })
}

/// The index of the component that a letter of a swizzle selects.
fn component(letter: char) -> Option<usize> {
    let sets = ["xyzw", "rgba", "stpq"];
    sets.iter().find_map(|set| set.find(letter))
}
