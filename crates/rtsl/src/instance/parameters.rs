//! Converts values of parameters to words.

use std::borrow::Cow;
use std::sync::Arc;

use rtsl_ir::class::{Annotation, AnnotationValue, Parameter, ParameterType};
use rtsl_ir::{Constant, Scalar};
use rtsl_memory::SharedWords;
use rtsl_source::most_similar;
use rtsl_spec::{COLOR_COMPONENTS, Role};

use super::instance::Instance;
use super::value::{Numbers, Value};
use super::words::{Leaves, Words};
use crate::errors::Mismatch;
use crate::type_name::type_name;

/// The greatest nesting of types and values; no class comes near it.
const DEPTH_LIMIT: usize = 64;

/// The converted value of a parameter.
pub(crate) enum Argument {
    /// Data, leaf by leaf, and what is outside of the parameter's range, as a clause.
    Data(Leaves, Option<String>),
    /// The instances of a reference or of an array of references.
    References(Vec<Arc<Instance>>),
}

/// Converts `value` for `parameter`.
pub(crate) fn argument(parameter: &Parameter, value: &Value) -> Result<Argument, Mismatch> {
    match &parameter.ty {
        ParameterType::Reference(_) => references(&parameter.ty, value).map(Argument::References),
        ParameterType::Array(element, _) | ParameterType::Buffer(element)
            if matches!(**element, ParameterType::Reference(_)) =>
        {
            references(&parameter.ty, value).map(Argument::References)
        }
        ParameterType::Textured(_) if matches!(value, Value::Instance(_)) => {
            references(&ParameterType::Reference(Role::Texture), value).map(Argument::References)
        }
        ParameterType::Textured(ty) => {
            let mut leaves = Leaves::new();
            add(ty, value, &parameter.name, &mut leaves, 0).map_err(|_| Mismatch::Type {
                expected: format!("{} or a texture", type_name(ty)),
                found: value.describe(),
            })?;
            let outside = outside_range(parameter, &leaves)?;
            Ok(Argument::Data(leaves, outside))
        }
        ty => {
            let mut leaves = Leaves::new();
            let choices = parameter.choices();
            let value = &*numbers_of_choices(&choices, value, 0)?;
            if let Some(shared) = shared_buffer(ty, value) {
                leaves.insert(parameter.name.clone(), Words::Shared(shared));
            } else {
                add(ty, value, &parameter.name, &mut leaves, 0)?;
            }
            let outside = outside_range(parameter, &leaves)?;
            check_choices(&choices, &leaves)?;
            Ok(Argument::Data(leaves, outside))
        }
    }
}

/// Converts `value` for a variable `name` of type `ty`, by the names of its leaves; for hosts that set scratch.
///
/// # Errors
/// If the value has another type, as a sentence.
pub fn place_words(
    name: &str,
    ty: &ParameterType,
    value: &Value,
) -> Result<Vec<(String, Vec<u32>)>, String> {
    let mut leaves = Leaves::new();
    add(ty, value, name, &mut leaves, 0).map_err(|mismatch| match mismatch {
        Mismatch::Type { expected, found } => format!("expected {expected}, found {found}"),
        Mismatch::Range(problem) => problem,
        Mismatch::Role { class, role } => format!("`{class}` is no {role}"),
    })?;
    Ok(leaves.into_iter().map(|(name, words)| (name, words.as_slice().to_vec())).collect())
}

fn references(ty: &ParameterType, value: &Value) -> Result<Vec<Arc<Instance>>, Mismatch> {
    match (ty, value) {
        (ParameterType::Reference(role), Value::Instance(instance)) => {
            if instance.class().roles.contains(role) {
                Ok(vec![instance.clone()])
            } else {
                let class = instance.class().name.clone();
                Err(Mismatch::Role { class, role: role.name() })
            }
        }
        (ParameterType::Array(element, count), Value::List(values))
            if values.len() == *count as usize =>
        {
            let each = values.iter().map(|value| references(element, value));
            Ok(each.collect::<Result<Vec<_>, _>>()?.concat())
        }
        (ParameterType::Buffer(element), Value::List(values)) => {
            let each = values.iter().map(|value| references(element, value));
            Ok(each.collect::<Result<Vec<_>, _>>()?.concat())
        }
        _ => Err(mismatch(ty, value)),
    }
}

/// Returns the host's words if a buffer can use them as they are.
fn shared_buffer(ty: &ParameterType, value: &Value) -> Option<SharedWords> {
    let (ParameterType::Buffer(element), Value::Numbers(numbers)) = (ty, value) else {
        return None;
    };
    let (scalar, count) = flat(element)?;
    let fits = scalar == numbers.scalar() && numbers.words().len().is_multiple_of(count as usize);
    fits.then(|| numbers.words().clone())
}

/// Returns the scalar type and the number of scalars of a type with one leaf.
pub(crate) fn flat(ty: &ParameterType) -> Option<(Scalar, u32)> {
    match ty {
        ParameterType::Scalar(scalar) => Some((*scalar, 1)),
        ParameterType::Vector(scalar, count) => Some((*scalar, u32::from(*count))),
        ParameterType::Matrix(columns, rows) => {
            Some((Scalar::F32, u32::from(*columns) * u32::from(*rows)))
        }
        ParameterType::Color => Some((Scalar::F32, COLOR_COMPONENTS)),
        ParameterType::Array(element, count) => {
            let (scalar, each) = flat(element)?;
            Some((scalar, each.checked_mul(*count)?))
        }
        ParameterType::Textured(value) => flat(value),
        ParameterType::Struct(..) | ParameterType::Buffer(_) | ParameterType::Reference(_) => None,
    }
}

fn add(
    ty: &ParameterType,
    value: &Value,
    path: &str,
    leaves: &mut Leaves,
    depth: usize,
) -> Result<(), Mismatch> {
    if depth > DEPTH_LIMIT {
        return Err(mismatch(ty, value));
    }
    match (ty, value) {
        (ParameterType::Struct(_, fields), Value::Struct(values)) => {
            add_fields(ty, fields, values, path, leaves, depth)
        }
        (ParameterType::Array(element, count), Value::List(values))
            if values.len() == *count as usize && !is_flat_list(element, values) =>
        {
            values.iter().try_for_each(|value| add(element, value, path, leaves, depth + 1))
        }
        (ParameterType::Buffer(element), Value::List(values)) if !is_flat_list(element, values) => {
            // A buffer without elements has leaves, too.
            reserve(element, path, leaves);
            values.iter().try_for_each(|value| add(element, value, path, leaves, depth + 1))
        }
        (ParameterType::Buffer(element), _) => match flat(element) {
            Some((scalar, count)) => {
                let words = scalars(scalar, value, depth).ok_or_else(|| mismatch(ty, value))?;
                if !words.len().is_multiple_of(count as usize) {
                    return Err(mismatch(ty, value));
                }
                extend(leaves, path, words);
                Ok(())
            }
            None => Err(mismatch(ty, value)),
        },
        _ => {
            let words = flat(ty).and_then(|(scalar, count)| {
                let mut words = scalars(scalar, value, depth)?;
                if *ty == ParameterType::Color && words.len() == 1 {
                    words.resize(COLOR_COMPONENTS as usize, words[0]);
                }
                (words.len() == count as usize).then_some(words)
            });
            extend(leaves, path, words.ok_or_else(|| mismatch(ty, value))?);
            Ok(())
        }
    }
}

fn add_fields(
    ty: &ParameterType,
    fields: &[(String, ParameterType)],
    values: &[(String, Value)],
    path: &str,
    leaves: &mut Leaves,
    depth: usize,
) -> Result<(), Mismatch> {
    let found = |text: String| Mismatch::Type { expected: type_name(ty), found: text };
    let known = |name: &String| fields.iter().any(|(field, _)| field == name);
    if let Some((name, _)) = values.iter().find(|(name, _)| !known(name)) {
        return Err(found(format!("a struct with a field `{name}`")));
    }
    for (field, field_type) in fields {
        let value = values.iter().find(|(name, _)| name == field);
        let (_, value) = value.ok_or_else(|| found(format!("a struct without `{field}`")))?;
        add(field_type, value, &format!("{path}.{field}"), leaves, depth + 1)?;
    }
    Ok(())
}

/// True if a list has the numbers of all elements, which are themselves lists of numbers, in one list.
fn is_flat_list(element: &ParameterType, values: &[Value]) -> bool {
    let is_number = |value: &Value| {
        matches!(value, Value::Bool(_) | Value::Int(_) | Value::Uint(_) | Value::Float(_))
    };
    let several = flat(element).is_some_and(|(_, count)| count > 1);
    // One number for each element is a list of greys.
    several && *element != ParameterType::Color && values.iter().all(is_number)
}

fn reserve(ty: &ParameterType, path: &str, leaves: &mut Leaves) {
    match ty {
        ParameterType::Struct(_, fields) => {
            for (field, ty) in fields {
                reserve(ty, &format!("{path}.{field}"), leaves);
            }
        }
        ParameterType::Array(element, _) if flat(element).is_none() => {
            reserve(element, path, leaves);
        }
        _ => extend(leaves, path, Vec::new()),
    }
}

fn extend(leaves: &mut Leaves, path: &str, words: Vec<u32>) {
    match leaves.get_mut(path) {
        Some(Words::Owned(existing)) => existing.extend(words),
        Some(Words::Shared(_)) | None => {
            leaves.insert(path.to_owned(), Words::Owned(words));
        }
    }
}

/// All numbers of a value, converted to `scalar`, in order; `None` where one can't be.
fn scalars(scalar: Scalar, value: &Value, depth: usize) -> Option<Vec<u32>> {
    if depth > DEPTH_LIMIT {
        return None;
    }
    match value {
        Value::Bool(value) => convert(scalar, Constant::Bool(*value)).map(|word| vec![word]),
        Value::Int(value) => convert(scalar, Constant::I32(*value)).map(|word| vec![word]),
        Value::Uint(value) => convert(scalar, Constant::U32(*value)).map(|word| vec![word]),
        Value::Float(value) => convert(scalar, Constant::F32(*value)).map(|word| vec![word]),
        Value::List(values) => {
            let each = values.iter().map(|value| scalars(scalar, value, depth + 1));
            Some(each.collect::<Option<Vec<_>>>()?.concat())
        }
        Value::Numbers(numbers) => {
            let constant = |word: &u32| Constant::from_bits(numbers.scalar(), *word);
            numbers.words().iter().map(|word| convert(scalar, constant(word))).collect()
        }
        Value::Struct(_) | Value::Instance(_) | Value::Text(_) => None,
    }
}

/// The language's implicit conversions, and a non-negative int to uint.
fn convert(to: Scalar, value: Constant) -> Option<u32> {
    match (to, value) {
        (Scalar::F32, Constant::I32(value)) => Some((value as f32).to_bits()),
        (Scalar::F32, Constant::U32(value)) => Some((value as f32).to_bits()),
        (Scalar::U32, Constant::I32(value)) => u32::try_from(value).ok(),
        (Scalar::I32, Constant::U32(value)) => i32::try_from(value).ok().map(i32::cast_unsigned),
        (to, value) if to == value.scalar() => Some(value.bits()),
        (Scalar::F32 | Scalar::I32 | Scalar::U32 | Scalar::Bool, _) => None,
    }
}

fn mismatch(ty: &ParameterType, value: &Value) -> Mismatch {
    Mismatch::Type { expected: type_name(ty), found: value.describe() }
}

/// Returns what is outside of the range of a parameter, if anything is.
///
/// # Errors
/// If it is not finite, and so has no meaning.
fn outside_range(parameter: &Parameter, leaves: &Leaves) -> Result<Option<String>, Mismatch> {
    let least = bound(&parameter.annotations, "min");
    let greatest = bound(&parameter.annotations, "max");
    let Some(scalar) = number_type(&parameter.ty) else { return Ok(None) };
    if least.is_none() && greatest.is_none() {
        return Ok(None);
    }
    let mut outside = None;
    for word in leaves.values().flat_map(|words| words.as_slice()) {
        let value = to_f64(Constant::from_bits(scalar, *word));
        // A NaN is in no range.
        let above = least.is_none_or(|least| value >= least);
        let below = greatest.is_none_or(|greatest| value <= greatest);
        if above && below {
            continue;
        }
        let reason = || format!("{value} is not {}", range_name(least, greatest));
        if !value.is_finite() {
            return Err(Mismatch::Range(reason()));
        }
        outside = outside.or_else(|| Some(reason()));
    }
    Ok(outside)
}

/// Returns the value with the numbers of choices instead of their names.
fn numbers_of_choices<'v>(
    choices: &[(&str, i32)],
    value: &'v Value,
    depth: usize,
) -> Result<Cow<'v, Value>, Mismatch> {
    match value {
        Value::Text(name) if !choices.is_empty() => {
            match choices.iter().find(|(choice, _)| choice == name) {
                Some((_, number)) => Ok(Cow::Owned(Value::Int(*number))),
                None => Err(no_choice(
                    choices,
                    &format!("`{name}`"),
                    most_similar_choice(choices, name),
                )),
            }
        }
        Value::List(values) if !choices.is_empty() && depth < DEPTH_LIMIT => {
            let each = values
                .iter()
                .map(|value| numbers_of_choices(choices, value, depth + 1).map(Cow::into_owned));
            Ok(Cow::Owned(Value::List(each.collect::<Result<_, _>>()?)))
        }
        other => Ok(Cow::Borrowed(other)),
    }
}

fn most_similar_choice<'c>(choices: &[(&'c str, i32)], name: &str) -> Option<&'c str> {
    most_similar(name, choices.iter().map(|(choice, _)| *choice))
}

/// Checks that each number is that of a choice.
fn check_choices(choices: &[(&str, i32)], leaves: &Leaves) -> Result<(), Mismatch> {
    let is_choice = |word: &u32| choices.iter().any(|(_, value)| value.cast_unsigned() == *word);
    let mut words = leaves.values().flat_map(|words| words.as_slice());
    match words.find(|word| !choices.is_empty() && !is_choice(word)) {
        Some(word) => Err(no_choice(choices, &word.cast_signed().to_string(), None)),
        None => Ok(()),
    }
}

fn no_choice(choices: &[(&str, i32)], found: &str, meant: Option<&str>) -> Mismatch {
    let known: Vec<String> =
        choices.iter().map(|(name, value)| format!("`{name}` ({value})")).collect();
    let question = meant.map(|name| format!("; did you mean `{name}`?")).unwrap_or_default();
    Mismatch::Range(format!("{found} is none of the choices {}{question}", known.join(", ")))
}

fn range_name(least: Option<f64>, greatest: Option<f64>) -> String {
    match (least, greatest) {
        (Some(least), Some(greatest)) => format!("between {least} and {greatest}"),
        (Some(least), None) => format!("at least {least}"),
        (None, Some(greatest)) => format!("at most {greatest}"),
        (None, None) => "any number".to_owned(),
    }
}

pub(crate) fn bound(annotations: &[Annotation], key: &str) -> Option<f64> {
    annotations.iter().rev().find_map(|annotation| match annotation.value {
        AnnotationValue::Constant(value) if annotation.key == key => Some(to_f64(value)),
        _ => None,
    })
}

fn to_f64(value: Constant) -> f64 {
    match value {
        // By its shortest decimal form, so that 0.1 is compared and printed as 0.1.
        Constant::F32(value) => value.to_string().parse().unwrap_or(f64::from(value)),
        Constant::I32(value) => f64::from(value),
        Constant::U32(value) => f64::from(value),
        Constant::Bool(value) => f64::from(u8::from(value)),
    }
}

/// Returns the type of the numbers that a range bounds.
fn number_type(ty: &ParameterType) -> Option<Scalar> {
    match ty {
        ParameterType::Buffer(element) => number_type(element),
        ty => flat(ty).map(|(scalar, _)| scalar).filter(|scalar| *scalar != Scalar::Bool),
    }
}

impl From<&Numbers> for Value {
    fn from(numbers: &Numbers) -> Value {
        Value::Numbers(numbers.clone())
    }
}
