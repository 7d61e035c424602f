//! JSON output: floats have the shortest text that reads back to the same bits.

use serde::ser::{SerializeMap, SerializeSeq};
use serde::{Serialize, Serializer};

/// A value to write.
#[derive(Clone, Debug, PartialEq)]
pub enum Json {
    /// A float; infinities and NaN are strings.
    Float(f32),
    /// An integer.
    Integer(i64),
    /// A boolean.
    Bool(bool),
    /// Text.
    Text(String),
    /// An array.
    List(Vec<Json>),
    /// An object, in this order.
    Object(Vec<(String, Json)>),
}

impl Serialize for Json {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        match self {
            Json::Float(value) if value.is_nan() => serializer.serialize_str("NaN"),
            Json::Float(f32::INFINITY) => serializer.serialize_str("Infinity"),
            Json::Float(f32::NEG_INFINITY) => serializer.serialize_str("-Infinity"),
            Json::Float(value) => serializer.serialize_f32(*value),
            Json::Integer(value) => serializer.serialize_i64(*value),
            Json::Bool(value) => serializer.serialize_bool(*value),
            Json::Text(text) => serializer.serialize_str(text),
            Json::List(values) => {
                let mut list = serializer.serialize_seq(Some(values.len()))?;
                values.iter().try_for_each(|value| list.serialize_element(value))?;
                list.end()
            }
            Json::Object(fields) => {
                let mut object = serializer.serialize_map(Some(fields.len()))?;
                fields.iter().try_for_each(|(key, value)| object.serialize_entry(key, value))?;
                object.end()
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn floats_read_back_to_the_same_bits() {
        let text = |value: f32| serde_json::to_string(&Json::Float(value)).unwrap();
        for value in [0.1, -0.0, 1.0, 3.4028235e38, 1e-45, 16_777_216.0, 1.0 / 3.0] {
            assert_eq!(text(value).parse::<f32>().unwrap().to_bits(), value.to_bits());
        }
        assert_eq!(text(0.1), "0.1");
        assert_eq!(text(f32::NAN), "\"NaN\"");
        assert_eq!(text(f32::NEG_INFINITY), "\"-Infinity\"");
    }
}
