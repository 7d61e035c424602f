//! Types of values in documents.

/// The type of a value.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[allow(missing_docs, reason = "the names are MaterialX's")]
pub enum Type {
    Boolean,
    Integer,
    Float,
    Vector2,
    Vector3,
    Vector4,
    Color3,
    Color4,
    Matrix33,
    Matrix44,
    /// Texts, and the names of files.
    Text,
}

/// The types by their names in documents. The old `color2` is a vector.
const NAMES: [(&str, Type); 13] = [
    ("boolean", Type::Boolean),
    ("integer", Type::Integer),
    ("float", Type::Float),
    ("vector2", Type::Vector2),
    ("vector3", Type::Vector3),
    ("vector4", Type::Vector4),
    ("color3", Type::Color3),
    ("color4", Type::Color4),
    ("color2", Type::Vector2),
    ("matrix33", Type::Matrix33),
    ("matrix44", Type::Matrix44),
    ("string", Type::Text),
    ("filename", Type::Text),
];

/// Types of documents whose values are no part of expressions.
const OTHERS: [&str; 22] = [
    "BSDF",
    "EDF",
    "VDF",
    "booleanarray",
    "color2array",
    "color3array",
    "color4array",
    "displacementshader",
    "floatarray",
    "geomname",
    "geomnamearray",
    "integerarray",
    "lightshader",
    "material",
    "multioutput",
    "none",
    "stringarray",
    "surfaceshader",
    "vector2array",
    "vector3array",
    "vector4array",
    "volumeshader",
];

/// The names of all types that MaterialX defines.
pub fn names() -> impl Iterator<Item = &'static str> {
    NAMES.iter().map(|(name, _)| *name).chain(OTHERS)
}

impl Type {
    /// Returns the type with this name in documents.
    pub fn named(name: &str) -> Option<Type> {
        NAMES.iter().find(|(other, _)| *other == name).map(|(_, ty)| *ty)
    }

    /// The name in documents.
    pub fn name(self) -> &'static str {
        NAMES.iter().find(|(_, ty)| *ty == self).map_or("string", |(name, _)| name)
    }

    /// The type in RTSL.
    pub fn rtsl(self) -> &'static str {
        match self {
            Type::Boolean => "bool",
            Type::Integer | Type::Text => "int",
            Type::Float => "float",
            Type::Vector2 => "vec2",
            Type::Vector3 | Type::Color3 => "vec3",
            Type::Vector4 | Type::Color4 => "vec4",
            Type::Matrix33 => "mat3",
            Type::Matrix44 => "mat4",
        }
    }

    /// The number of numbers in a value.
    pub fn count(self) -> usize {
        match self {
            Type::Boolean | Type::Integer | Type::Float | Type::Text => 1,
            Type::Vector2 => 2,
            Type::Vector3 | Type::Color3 => 3,
            Type::Vector4 | Type::Color4 => 4,
            Type::Matrix33 => 9,
            Type::Matrix44 => 16,
        }
    }

    /// True for colours, which have colour spaces.
    pub fn is_color(self) -> bool {
        matches!(self, Type::Color3 | Type::Color4)
    }

    /// True for vectors and colours.
    pub fn is_vector(self) -> bool {
        (2..=4).contains(&self.count())
    }
}
