//! Conversion of values between JSON and the language.

use std::collections::BTreeMap;
use std::sync::Arc;

use rtsl::{
    Class, Constant, Diagnostic, Instance, ParameterType, Scalar, StateType, StateVariable, Unit,
    Value, type_name,
};
use serde_json::Value as JsonValue;

use super::request::Values;
use crate::json::Json;

/// One value for all rays, or one for each.
#[derive(Clone, Debug)]
pub enum Lanes {
    /// The same for all.
    Uniform(JsonValue),
    /// `{"lanes": [...]}`.
    Varying(Vec<JsonValue>),
}

impl Lanes {
    /// Parses a value that may have lanes.
    pub fn parse(value: &JsonValue) -> Lanes {
        match value {
            JsonValue::Object(fields) if fields.len() == 1 => match fields.get("lanes") {
                Some(JsonValue::Array(values)) => Lanes::Varying(values.clone()),
                _ => Lanes::Uniform(value.clone()),
            },
            _ => Lanes::Uniform(value.clone()),
        }
    }

    /// Returns the number of rays for which it has values; `None` for any number.
    pub fn count(&self) -> Option<usize> {
        match self {
            Lanes::Uniform(_) => None,
            Lanes::Varying(values) => Some(values.len()),
        }
    }

    /// Returns the value of a ray.
    pub fn get(&self, lane: usize) -> Option<&JsonValue> {
        match self {
            Lanes::Uniform(value) => Some(value),
            Lanes::Varying(values) => values.get(lane),
        }
    }
}

/// Parses a parameter's value. An object with a `class` is an instance of that class of the text.
pub fn parse_value(json: &JsonValue, unit: &Unit) -> Result<Value, ValueError> {
    match json {
        JsonValue::Bool(value) => Ok(Value::Bool(*value)),
        JsonValue::Number(number) => parse_number(&number.to_string()),
        JsonValue::String(text) => match text.as_str() {
            "NaN" => Ok(Value::Float(f32::NAN)),
            "Infinity" => Ok(Value::Float(f32::INFINITY)),
            "-Infinity" => Ok(Value::Float(f32::NEG_INFINITY)),
            // The name of a choice.
            _ => Ok(Value::Text(text.clone())),
        },
        JsonValue::Array(values) => {
            let values = values.iter().map(|value| parse_value(value, unit));
            Ok(Value::List(values.collect::<Result<_, _>>()?))
        }
        JsonValue::Object(fields) => match fields.get("class") {
            Some(JsonValue::String(class)) => parse_instance(class, fields, unit),
            _ => {
                let fields = fields
                    .iter()
                    .map(|(name, value)| Ok((name.clone(), parse_value(value, unit)?)));
                Ok(Value::Struct(fields.collect::<Result<_, ValueError>>()?))
            }
        },
        JsonValue::Null => Err(ValueError::Malformed("null is no value".to_owned())),
    }
}

/// The error of an invalid value.
#[derive(Debug)]
pub enum ValueError {
    /// An error of the request.
    Malformed(String),
    /// The instance cannot be created.
    Instance(Vec<Diagnostic>),
}

/// Integers become ints if they fit, so that they convert to any type.
fn parse_number(text: &str) -> Result<Value, ValueError> {
    // A float preserves the sign of its zero.
    if text != "-0" {
        if let Ok(value) = text.parse() {
            return Ok(Value::Int(value));
        }
        if let Ok(value) = text.parse() {
            return Ok(Value::Uint(value));
        }
    }
    let malformed = |_| ValueError::Malformed(format!("`{text}` is no number"));
    text.parse().map(Value::Float).map_err(malformed)
}

fn parse_instance(name: &str, fields: &Values, unit: &Unit) -> Result<Value, ValueError> {
    let class = unit.class(name).map_err(|error| ValueError::Instance(vec![error]))?;
    let empty = Values::new();
    let params = match fields.get("params") {
        Some(JsonValue::Object(params)) => params,
        None => &empty,
        Some(_) => {
            return Err(ValueError::Malformed("`params` is no object".to_owned()));
        }
    };
    let instance = make_instance(class, unit, params.iter())?;
    Ok(Value::Instance(instance))
}

/// Creates an instance of `class` with these parameters.
pub fn make_instance<'a>(
    class: &Arc<Class>,
    unit: &Unit,
    params: impl Iterator<Item = (&'a String, &'a JsonValue)>,
) -> Result<Arc<Instance>, ValueError> {
    let arguments = params
        .map(|(name, value)| Ok((name.as_str(), parse_value(value, unit)?)))
        .collect::<Result<Vec<_>, ValueError>>()?;
    Instance::new(class, arguments)
        .map_err(|errors| ValueError::Instance(errors.iter().cloned().collect()))
}

/// Returns the warnings about values of an instance, and of those that it refers to, outside of their ranges.
pub fn range_warnings(instance: &Instance) -> Vec<Diagnostic> {
    let own = instance.outside_range().iter().map(|it| it.warning.clone());
    let referred = instance.references().iter().flatten().flatten();
    own.chain(referred.flat_map(|instance| range_warnings(instance))).collect()
}

/// Collects all floats of a value, in order.
fn parse_floats(json: &JsonValue, floats: &mut Vec<f32>) -> Result<(), String> {
    match parse_value(json, &Unit::default()) {
        Ok(Value::Int(value)) => floats.push(value as f32),
        Ok(Value::Uint(value)) => floats.push(value as f32),
        Ok(Value::Float(value)) => floats.push(value),
        Ok(Value::List(_)) => {
            let JsonValue::Array(values) = json else { return Ok(()) };
            return values.iter().try_for_each(|value| parse_floats(value, floats));
        }
        Ok(_) | Err(_) => return Err(format!("{json} is no float or list of floats")),
    }
    Ok(())
}

/// Parses the components of a state variable; a single float may be given for a colour.
pub fn parse_state(variable: &StateVariable, json: &JsonValue) -> Result<Vec<f32>, String> {
    let (name, count) = (variable.name, variable.ty.components() as usize);
    let mut floats = Vec::with_capacity(count);
    parse_floats(json, &mut floats).map_err(|error| format!("`{name}`: {error}"))?;
    if variable.ty == StateType::Color && floats.len() == 1 {
        floats.resize(count, floats[0]);
    }
    if floats.len() != count {
        return Err(format!("`{name}` has {count} components, not {}", floats.len()));
    }
    Ok(floats)
}

/// The words of variables, read element by element.
pub type PlaceWords<'a> = BTreeMap<String, Box<dyn Iterator<Item = u32> + 'a>>;

/// Parses `name=value`, where the value is a number, a list with commas, or JSON.
pub fn parse_setting(text: &str) -> Result<(String, JsonValue), String> {
    let (name, value) = text.split_once('=').ok_or("expected NAME=VALUE")?;
    let json = |text: &str| {
        let number = serde_json::from_str(text);
        // Numbers that JSON does not accept: `.5`, `+1`, `1.`.
        let float = || {
            let value: f32 = text.trim().parse().ok()?;
            let shown = serde_json::to_string(&Json::Float(value)).ok()?;
            serde_json::from_str(&shown).ok()
        };
        let name = || {
            let is_of_name = |letter: char| letter.is_ascii_alphanumeric() || letter == '_';
            let is_name = text.chars().all(is_of_name)
                && text.starts_with(|first: char| first.is_ascii_alphabetic() || first == '_');
            is_name.then(|| JsonValue::String(text.to_owned()))
        };
        let value = number.ok().or_else(float).or_else(name);
        value.ok_or_else(|| format!("`{text}` is not a value"))
    };
    let value = if value.contains(',') && !value.trim_start().starts_with(['[', '{']) {
        JsonValue::Array(value.split(',').map(json).collect::<Result<_, _>>()?)
    } else {
        json(value)?
    };
    Ok((name.to_owned(), value))
}

/// Converts the words of a type's variables to JSON; the first variable is called `path`.
pub fn show(ty: &ParameterType, path: &str, words: &mut PlaceWords<'_>) -> Json {
    match ty {
        ParameterType::Scalar(scalar) => show_scalar(*scalar, path, words),
        ParameterType::Vector(scalar, count) => {
            Json::List((0..*count).map(|_| show_scalar(*scalar, path, words)).collect())
        }
        ParameterType::Matrix(columns, rows) => {
            let column = ParameterType::Vector(Scalar::F32, *rows);
            Json::List((0..*columns).map(|_| show(&column, path, words)).collect())
        }
        ParameterType::Color => {
            let color = ParameterType::Vector(Scalar::F32, rtsl::COLOR_COMPONENTS as u8);
            show(&color, path, words)
        }
        ParameterType::Struct(_, fields) => {
            let fields = fields
                .iter()
                .map(|(name, ty)| (name.clone(), show(ty, &format!("{path}.{name}"), words)));
            Json::Object(fields.collect())
        }
        ParameterType::Array(element, count) => {
            Json::List((0..*count).map(|_| show(element, path, words)).collect())
        }
        // No class has these types in scratch.
        ParameterType::Buffer(_) | ParameterType::Reference(_) | ParameterType::Textured(_) => {
            Json::Text(type_name(ty))
        }
    }
}

fn show_scalar(scalar: Scalar, path: &str, words: &mut PlaceWords<'_>) -> Json {
    let word = words.get_mut(path).and_then(Iterator::next).unwrap_or_default();
    match Constant::from_bits(scalar, word) {
        Constant::F32(value) => Json::Float(value),
        Constant::I32(value) => Json::Integer(value.into()),
        Constant::U32(value) => Json::Integer(value.into()),
        Constant::Bool(value) => Json::Bool(value),
    }
}
