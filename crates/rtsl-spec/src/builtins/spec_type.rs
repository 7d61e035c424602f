//! The types that signatures and state variables use.

use std::fmt;

use super::SpecStruct;

/// A type of the language that is not declared by the user: everything but users' structs, arrays
/// and buffers.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum SpecType {
    /// No value: the result type of a function that returns nothing.
    Void,
    /// A truth value.
    Bool,
    /// A 32-bit integer in two's complement.
    Int,
    /// An unsigned 32-bit integer.
    Uint,
    /// IEEE 754 binary32.
    Float,
    /// A vector of 2, 3 or 4 scalars.
    Vec(Scalar, u8),
    /// A matrix of floats with this many columns and rows, 2 to 4 each.
    Mat(u8, u8),
    /// A colour, whose number of components the host defines.
    Color,
    /// A struct of the language (`rt_Surface`, ...).
    Struct(SpecStruct),
    /// A reference to a shader of any role (`rt_Texture`, `rt_Material`, ...).
    Reference,
}

/// The component type of a vector.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Scalar {
    /// `bvecN`.
    Bool,
    /// `ivecN`.
    Int,
    /// `uvecN`.
    Uint,
    /// `vecN`.
    Float,
}

impl Scalar {
    /// The scalar as a [`SpecType`].
    pub const fn as_type(self) -> SpecType {
        match self {
            Scalar::Bool => SpecType::Bool,
            Scalar::Int => SpecType::Int,
            Scalar::Uint => SpecType::Uint,
            Scalar::Float => SpecType::Float,
        }
    }

    /// The prefix before `vec` in the name of a vector of these.
    const fn vector_prefix(self) -> &'static str {
        match self {
            Scalar::Bool => "b",
            Scalar::Int => "i",
            Scalar::Uint => "u",
            Scalar::Float => "",
        }
    }
}

impl SpecType {
    /// The type called `name` in the language; `mat3` and `mat3x3` are the same type.
    pub fn from_name(name: &str) -> Option<SpecType> {
        Some(match name {
            "void" => SpecType::Void,
            "bool" => SpecType::Bool,
            "int" => SpecType::Int,
            "uint" => SpecType::Uint,
            "float" => SpecType::Float,
            "color" => SpecType::Color,
            "reference" => SpecType::Reference,
            _ => {
                return vector_from_name(name)
                    .or_else(|| matrix_from_name(name))
                    .or_else(|| SpecStruct::from_name(name).map(SpecType::Struct));
            }
        })
    }

    /// A vector of `size` of these, or the scalar itself if `size` is 1.
    pub const fn scalar_or_vector(scalar: Scalar, size: u8) -> SpecType {
        if size == 1 { scalar.as_type() } else { SpecType::Vec(scalar, size) }
    }
}

fn vector_from_name(name: &str) -> Option<SpecType> {
    let (prefix, size) = name.split_once("vec")?;
    let scalar = match prefix {
        "b" => Scalar::Bool,
        "i" => Scalar::Int,
        "u" => Scalar::Uint,
        "" => Scalar::Float,
        _ => return None,
    };
    Some(SpecType::Vec(scalar, dimension(size)?))
}

fn matrix_from_name(name: &str) -> Option<SpecType> {
    let size = name.strip_prefix("mat")?;
    let (columns, rows) = size.split_once('x').unwrap_or((size, size));
    Some(SpecType::Mat(dimension(columns)?, dimension(rows)?))
}

fn dimension(digit: &str) -> Option<u8> {
    match digit {
        "2" => Some(2),
        "3" => Some(3),
        "4" => Some(4),
        _ => None,
    }
}

impl fmt::Display for SpecType {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        match *self {
            SpecType::Void => out.write_str("void"),
            SpecType::Bool => out.write_str("bool"),
            SpecType::Int => out.write_str("int"),
            SpecType::Uint => out.write_str("uint"),
            SpecType::Float => out.write_str("float"),
            SpecType::Vec(scalar, size) => write!(out, "{}vec{size}", scalar.vector_prefix()),
            SpecType::Mat(columns, rows) if columns == rows => write!(out, "mat{columns}"),
            SpecType::Mat(columns, rows) => write!(out, "mat{columns}x{rows}"),
            SpecType::Color => out.write_str("color"),
            SpecType::Struct(each) => out.write_str(each.name()),
            SpecType::Reference => out.write_str("reference"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_type_parses_from_its_name() {
        for name in [
            "void",
            "bool",
            "int",
            "uint",
            "float",
            "color",
            "vec2",
            "ivec3",
            "uvec4",
            "bvec2",
            "mat2",
            "mat3x4",
            "mat4x2",
            "rt_Surface",
        ] {
            let ty = SpecType::from_name(name).unwrap_or_else(|| panic!("{name} is a type"));
            assert_eq!(ty.to_string(), name);
        }
        for name in ["vec", "vec5", "dvec2", "mat", "mat5", "mat2x5", "genF", ""] {
            assert_eq!(SpecType::from_name(name), None, "{name}");
        }
    }
}
