//! Parameters in a scene's text: `"float radius" 2`.
//!
//! They are matched against the parameters of a class when the class is known, by [`crate`].

use rtsl::{Numbers, Span};
use rtsl_memory::Amount;

/// A parameter with its values.
#[derive(Clone, Debug, PartialEq)]
pub struct Parameter {
    /// The type that the scene declares.
    pub kind: ParameterType,
    /// Its name.
    pub name: String,
    /// The place of the declaration, quotes included.
    pub declaration: Span,
    /// The values.
    pub values: Values,
    /// The place of the values.
    pub values_span: Span,
}

impl Parameter {
    /// Returns the first value, if it is a number.
    pub fn first_number(&self) -> Option<f64> {
        match &self.values {
            Values::Numbers(numbers) => numbers.first().copied(),
            Values::Booleans(_) | Values::Texts(_) | Values::Buffer(_) => None,
        }
    }

    /// Returns the first value, if it is a string.
    pub fn first_text(&self) -> Option<&str> {
        match &self.values {
            Values::Texts(texts) => texts.first().map(String::as_str),
            Values::Numbers(_) | Values::Booleans(_) | Values::Buffer(_) => None,
        }
    }

    /// Returns the first value, if it is a boolean, which older files quote.
    pub fn first_boolean(&self) -> Option<bool> {
        match &self.values {
            Values::Booleans(values) => values.first().copied(),
            Values::Texts(texts) => texts.first().and_then(|text| text.parse().ok()),
            Values::Numbers(_) | Values::Buffer(_) => None,
        }
    }

    /// True if it is declared as a colour or a spectrum.
    pub fn is_color(&self) -> bool {
        self.kind == COLOR || self.kind == ParameterType::Spectrum
    }

    /// True if it is declared as a list of real numbers.
    pub fn is_numbers(&self) -> bool {
        self.kind == numeric(Component::Float, 1)
    }

    /// Takes the factor of a black body, which earlier versions give after its temperature.
    pub fn take_blackbody_scale(&mut self) -> Option<f64> {
        match (self.kind, &mut self.values) {
            (ParameterType::Blackbody, Values::Numbers(numbers)) if numbers.len() == 2 => {
                numbers.pop()
            }
            _ => None,
        }
    }
}

/// The values of a parameter.
#[derive(Clone, Debug, PartialEq)]
pub enum Values {
    /// Numbers.
    Numbers(Vec<f64>),
    /// Booleans.
    Booleans(Vec<bool>),
    /// Quoted strings.
    Texts(Vec<String>),
    /// The numbers of a class's buffer, which instances share. No text gives them.
    Buffer(Numbers),
}

impl Values {
    /// Returns the number of values.
    pub fn len(&self) -> usize {
        match self {
            Values::Numbers(values) => values.len(),
            Values::Booleans(values) => values.len(),
            Values::Texts(values) => values.len(),
            Values::Buffer(numbers) => numbers.words().len(),
        }
    }

    /// True if there are no values.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Returns the memory of the values.
    pub fn memory(&self) -> Amount {
        match self {
            Values::Numbers(values) => Amount::of::<f64>(values.len()),
            Values::Booleans(values) => Amount::of::<bool>(values.len()),
            Values::Texts(values) => {
                let bytes = values.iter().map(String::len).sum();
                Amount::of::<String>(values.len()) + Amount::of::<u8>(bytes)
            }
            Values::Buffer(numbers) => Amount::of::<u32>(numbers.words().len()),
        }
    }

    /// Returns a description of the values for messages.
    pub fn description(&self) -> &'static str {
        match self {
            Values::Numbers(_) => "numbers",
            Values::Booleans(_) => "truth values",
            Values::Texts(_) => "strings",
            Values::Buffer(_) => "a buffer",
        }
    }
}

/// The type of a component of a parameter.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Component {
    /// A real number.
    Float,
    /// A signed 32-bit integer.
    Int,
    /// An unsigned 32-bit integer.
    Uint,
    /// A boolean.
    Bool,
}

/// The kinds of things that a scene can refer to by name.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum ReferenceKind {
    /// A `Texture`.
    Texture,
    /// A `MakeNamedMaterial`.
    Material,
    /// A `Shape` with a `"string name"`.
    Primitive,
    /// A `LightSource` with a `"string name"`.
    Light,
    /// The `Camera`, by its `"string name"`.
    Camera,
    /// The `Integrator`, by its `"string name"`.
    Integrator,
}

impl ReferenceKind {
    /// Returns the word for the kind in messages.
    pub fn word(self) -> &'static str {
        match self {
            ReferenceKind::Texture => "texture",
            ReferenceKind::Material => "material",
            ReferenceKind::Primitive => "primitive",
            ReferenceKind::Light => "light",
            ReferenceKind::Camera => "camera",
            ReferenceKind::Integrator => "integrator",
        }
    }
}

/// The types that a parameter's declaration can name.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ParameterType {
    /// `float`, `point3`, `mat4` and so on: values of so many components each.
    Numeric {
        /// The type of each component.
        component: Component,
        /// The number of components of a value.
        count: usize,
        /// True for colours.
        color: bool,
    },
    /// `spectrum`: a colour, alternating wavelengths and values, or a name. The reader converts it to a colour.
    Spectrum,
    /// `blackbody`: a temperature in kelvin. The reader converts it to a colour.
    Blackbody,
    /// `string`
    Text,
    /// `texture`, `material`, ...: the name of another part of the scene.
    Reference(ReferenceKind),
    /// Not declared: the value comes from the command line and is checked against the type of the class's parameter.
    Given,
}

const fn numeric(component: Component, count: usize) -> ParameterType {
    ParameterType::Numeric { component, count, color: false }
}

/// Linear red, green and blue.
pub const COLOR: ParameterType =
    ParameterType::Numeric { component: Component::Float, count: 3, color: true };

/// Every type name, the format's own first, then RTSL's.
const TYPES: &[(&str, ParameterType)] = &[
    ("float", numeric(Component::Float, 1)),
    ("integer", numeric(Component::Int, 1)),
    ("bool", numeric(Component::Bool, 1)),
    ("string", ParameterType::Text),
    ("rgb", COLOR),
    ("color", COLOR),
    ("xyz", COLOR),
    ("spectrum", ParameterType::Spectrum),
    ("blackbody", ParameterType::Blackbody),
    ("point2", numeric(Component::Float, 2)),
    ("vector2", numeric(Component::Float, 2)),
    ("point", numeric(Component::Float, 3)),
    ("point3", numeric(Component::Float, 3)),
    ("vector", numeric(Component::Float, 3)),
    ("vector3", numeric(Component::Float, 3)),
    ("normal", numeric(Component::Float, 3)),
    ("normal3", numeric(Component::Float, 3)),
    ("texture", ParameterType::Reference(ReferenceKind::Texture)),
    ("material", ParameterType::Reference(ReferenceKind::Material)),
    ("primitive", ParameterType::Reference(ReferenceKind::Primitive)),
    ("shape", ParameterType::Reference(ReferenceKind::Primitive)),
    ("light", ParameterType::Reference(ReferenceKind::Light)),
    ("camera", ParameterType::Reference(ReferenceKind::Camera)),
    ("int", numeric(Component::Int, 1)),
    ("uint", numeric(Component::Uint, 1)),
    ("vec2", numeric(Component::Float, 2)),
    ("vec3", numeric(Component::Float, 3)),
    ("vec4", numeric(Component::Float, 4)),
    ("ivec2", numeric(Component::Int, 2)),
    ("ivec3", numeric(Component::Int, 3)),
    ("ivec4", numeric(Component::Int, 4)),
    ("uvec2", numeric(Component::Uint, 2)),
    ("uvec3", numeric(Component::Uint, 3)),
    ("uvec4", numeric(Component::Uint, 4)),
    ("bvec2", numeric(Component::Bool, 2)),
    ("bvec3", numeric(Component::Bool, 3)),
    ("bvec4", numeric(Component::Bool, 4)),
    ("mat2", numeric(Component::Float, 4)),
    ("mat2x2", numeric(Component::Float, 4)),
    ("mat2x3", numeric(Component::Float, 6)),
    ("mat2x4", numeric(Component::Float, 8)),
    ("mat3", numeric(Component::Float, 9)),
    ("mat3x2", numeric(Component::Float, 6)),
    ("mat3x3", numeric(Component::Float, 9)),
    ("mat3x4", numeric(Component::Float, 12)),
    ("mat4", numeric(Component::Float, 16)),
    ("mat4x2", numeric(Component::Float, 8)),
    ("mat4x3", numeric(Component::Float, 12)),
    ("mat4x4", numeric(Component::Float, 16)),
];

/// Returns the type spelled `word`.
pub fn parameter_type(word: &str) -> Option<ParameterType> {
    TYPES.iter().find(|(spelling, _)| *spelling == word).map(|(_, kind)| *kind)
}

/// Returns the spellings of all types.
pub fn parameter_type_words() -> impl Iterator<Item = &'static str> {
    TYPES.iter().map(|(spelling, _)| *spelling)
}
