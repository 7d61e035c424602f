//! The names of types.

use std::collections::BTreeSet;

use rtsl_ir::Scalar;
use rtsl_spec::Role;
use rtsl_spec::builtins::SpecStruct;

use crate::hir::Type;

/// The name of a type that contains no struct. The caller formats arrays and structs.
pub(crate) fn plain_type_name(ty: &Type) -> String {
    match ty {
        Type::Void => "void".into(),
        Type::Scalar(scalar) => scalar_name(*scalar).into(),
        Type::Vector(scalar, size) => {
            let prefix = match scalar {
                Scalar::F32 => "",
                Scalar::I32 => "i",
                Scalar::U32 => "u",
                Scalar::Bool => "b",
            };
            format!("{prefix}vec{size}")
        }
        Type::Matrix(columns, rows) if columns == rows => format!("mat{columns}"),
        Type::Matrix(columns, rows) => format!("mat{columns}x{rows}"),
        Type::Color => "color".into(),
        Type::Reference(role) => role.class().into(),
        Type::Struct(_) => "struct".into(),
        Type::Array(..) | Type::Buffer(_) => "array".into(),
        Type::Error => "?".into(),
    }
}

fn scalar_name(scalar: Scalar) -> &'static str {
    match scalar {
        Scalar::F32 => "float",
        Scalar::I32 => "int",
        Scalar::U32 => "uint",
        Scalar::Bool => "bool",
    }
}

/// The names of all built-in types, for suggestions.
pub(super) fn builtin_type_names() -> Vec<String> {
    let scalars = [Scalar::F32, Scalar::I32, Scalar::U32, Scalar::Bool];
    let mut types = vec![Type::Void, Type::Color];
    types.extend(scalars.map(Type::Scalar));
    for scalar in scalars {
        types.extend((2..=4).map(|size| Type::Vector(scalar, size)));
    }
    for columns in 2..=4 {
        types.extend((2..=4).map(|rows| Type::Matrix(columns, rows)));
    }
    types.extend(Role::ALL.map(Type::Reference));
    let mut names: BTreeSet<String> = types.iter().map(plain_type_name).collect();
    names.extend(SpecStruct::ALL.map(|each| each.name().to_owned()));
    names.into_iter().collect()
}
