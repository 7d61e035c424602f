//! The names of types in diagnostics and user interfaces.

use rtsl_ir::Scalar;
use rtsl_ir::class::ParameterType;

/// Returns the type as RTSL writes it.
pub fn type_name(ty: &ParameterType) -> String {
    match ty {
        ParameterType::Scalar(scalar) => scalar_name(*scalar).to_owned(),
        ParameterType::Vector(scalar, count) => {
            let prefix = match scalar {
                Scalar::F32 => "",
                Scalar::I32 => "i",
                Scalar::U32 => "u",
                Scalar::Bool => "b",
            };
            format!("{prefix}vec{count}")
        }
        ParameterType::Matrix(columns, rows) if columns == rows => format!("mat{columns}"),
        ParameterType::Matrix(columns, rows) => format!("mat{columns}x{rows}"),
        ParameterType::Color => "color".to_owned(),
        ParameterType::Struct(name, _) => name.clone(),
        ParameterType::Array(element, count) => format!("{}[{count}]", type_name(element)),
        ParameterType::Buffer(element) => format!("{}[]", type_name(element)),
        ParameterType::Reference(role) => role.class().to_owned(),
        ParameterType::Textured(value) => format!("texture {}", type_name(value)),
    }
}

/// Returns the type of a number as RTSL writes it.
pub fn scalar_name(scalar: Scalar) -> &'static str {
    match scalar {
        Scalar::F32 => "float",
        Scalar::I32 => "int",
        Scalar::U32 => "uint",
        Scalar::Bool => "bool",
    }
}
