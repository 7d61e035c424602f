//! Values of parameters.

use std::sync::Arc;

use rtsl_ir::Scalar;
use rtsl_memory::SharedWords;

use super::instance::Instance;

/// A value of a parameter. It must have the type of the parameter; numbers convert as in the language (int to uint to
/// float).
///
/// ```
/// use rtsl::{Numbers, Value};
///
/// let number: Value = 2.5.into();
/// let vector: Value = [1.0, 2.0, 3.0].into();
/// // Buffers share numbers of their type.
/// let positions = Value::Numbers(Numbers::floats([0.0; 9]));
/// let light = Value::Struct(vec![("position".to_owned(), vector), ("power".to_owned(), number)]);
/// # let _ = (positions, light);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug)]
pub enum Value {
    /// A bool.
    Bool(bool),
    /// An int.
    Int(i32),
    /// A uint.
    Uint(u32),
    /// A float.
    Float(f32),
    /// A vector, a matrix (column by column), a colour (linear RGB, or one grey number), an
    /// array or a buffer. Numbers may be nested as the type is, or all in one list.
    List(Vec<Value>),
    /// Many numbers at once, for buffers and arrays; several instances may share it.
    Numbers(Numbers),
    /// A struct, field by field, in any order.
    Struct(Vec<(String, Value)>),
    /// Another instance, for a reference.
    Instance(Arc<Instance>),
    /// The name of a choice, for a parameter whose type is an enumeration.
    Text(String),
}

/// Numbers of one type. Cloning shares them.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Numbers {
    scalar: Scalar,
    words: SharedWords,
}

impl Numbers {
    /// Numbers from their bits: bools are 0 or 1.
    pub fn from_words(scalar: Scalar, words: impl Into<SharedWords>) -> Numbers {
        Numbers { scalar, words: words.into() }
    }

    /// Floats.
    pub fn floats(values: impl IntoIterator<Item = f32>) -> Numbers {
        Numbers::from_words(Scalar::F32, values.into_iter().map(f32::to_bits).collect::<Vec<_>>())
    }

    /// Ints.
    pub fn ints(values: impl IntoIterator<Item = i32>) -> Numbers {
        let words = values.into_iter().map(i32::cast_unsigned).collect::<Vec<_>>();
        Numbers::from_words(Scalar::I32, words)
    }

    /// Their type.
    pub fn scalar(&self) -> Scalar {
        self.scalar
    }

    /// Their bits.
    pub fn words(&self) -> &SharedWords {
        &self.words
    }
}

impl Value {
    /// Describes the value for diagnostics.
    pub(crate) fn describe(&self) -> String {
        match self {
            Value::Bool(_) => "a bool".to_owned(),
            Value::Int(_) => "an int".to_owned(),
            Value::Uint(_) => "a uint".to_owned(),
            Value::Float(_) => "a float".to_owned(),
            Value::List(values) => match values.len() {
                1 => "a list of 1 value".to_owned(),
                count => format!("a list of {count} values"),
            },
            Value::Numbers(numbers) => format!("{} numbers", numbers.words.len()),
            Value::Struct(_) => "a struct".to_owned(),
            Value::Text(text) => format!("the text {text:?}"),
            Value::Instance(instance) => format!("an instance of `{}`", instance.class().name),
        }
    }
}

macro_rules! from {
    ($($ty:ty => $variant:ident;)*) => {$(
        impl From<$ty> for Value {
            fn from(value: $ty) -> Value {
                Value::$variant(value)
            }
        }
    )*};
}

from! {
    bool => Bool;
    i32 => Int;
    u32 => Uint;
    f32 => Float;
    Vec<Value> => List;
    Numbers => Numbers;
    Arc<Instance> => Instance;
    String => Text;
}

impl From<&str> for Value {
    fn from(value: &str) -> Value {
        Value::Text(value.to_owned())
    }
}

impl<T: Into<Value>, const N: usize> From<[T; N]> for Value {
    fn from(values: [T; N]) -> Value {
        Value::List(values.into_iter().map(Into::into).collect())
    }
}
