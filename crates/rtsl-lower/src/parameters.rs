//! The parameters that hosts may set.

use rtsl_ir::class::{self, Annotation, Parameter, ParameterTarget, ParameterType};
use rtsl_sema::hir::{Class, Module, Storage, Type};

use crate::layout::Layouts;

/// The parameters of a class: those of its constructor, then its public members.
pub(crate) fn parameters_of(module: &Module, layouts: &Layouts, class: &Class) -> Vec<Parameter> {
    let mut parameters = constructor_parameters(module, layouts, class);
    let of_constructor = parameters.len();
    for member in &class.members {
        let shadowed =
            parameters[..of_constructor].iter().any(|parameter| parameter.name == member.name);
        if member.storage != Storage::Public || member.computed.is_some() || shadowed {
            continue;
        }
        let reference = reference_role(&member.ty).is_some();
        parameters.push(Parameter {
            name: member.name.clone(),
            ty: match member.textured {
                true => ParameterType::Textured(Box::new(parameter_type(layouts, &member.ty))),
                false => parameter_type(layouts, &member.ty),
            },
            target: ParameterTarget::Member,
            required: of_constructor == 0
                && member.initializer.is_none()
                && !reference
                && !is_element(&member.annotations),
            annotations: member.annotations.clone(),
        });
    }
    parameters
}

/// The types of the members whose storage is wanted, all of which are data of a ray.
pub(crate) fn ray_member_types(
    layouts: &Layouts,
    class: &Class,
    is_wanted: impl Fn(Storage) -> bool,
) -> Vec<(String, ParameterType)> {
    let members = class.members.iter().filter(|member| is_wanted(member.storage));
    members.map(|member| (member.name.clone(), parameter_type(layouts, &member.ty))).collect()
}

fn constructor_parameters(module: &Module, layouts: &Layouts, class: &Class) -> Vec<Parameter> {
    let Some(constructor) = &class.constructor else { return Vec::new() };
    let locals = &module.functions[constructor.function.0 as usize].locals;
    let parameters = constructor.parameters.iter().zip(locals);
    parameters
        .map(|(parameter, local)| Parameter {
            name: local.name.clone(),
            ty: parameter_type(layouts, &local.ty),
            target: ParameterTarget::Constructor,
            required: parameter.default.is_none() && !is_element(&parameter.annotations),
            annotations: parameter.annotations.clone(),
        })
        .collect()
}

/// True for the element parameter. A single instance need not set it, since hosts make one object
/// for each value.
fn is_element(annotations: &[Annotation]) -> bool {
    annotations.iter().any(|annotation| annotation.key == class::ELEMENT)
}

/// The role of a reference, or of the references in an array.
pub(crate) fn reference_role(ty: &Type) -> Option<rtsl_spec::Role> {
    match ty {
        Type::Reference(role) => Some(*role),
        Type::Array(element, _) | Type::Buffer(element) => reference_role(element),
        _ => None,
    }
}

pub(crate) fn parameter_type(layouts: &Layouts, ty: &Type) -> ParameterType {
    match ty {
        Type::Scalar(scalar) => ParameterType::Scalar(*scalar),
        Type::Vector(scalar, size) => ParameterType::Vector(*scalar, *size),
        Type::Matrix(columns, rows) => ParameterType::Matrix(*columns, *rows),
        Type::Color => ParameterType::Color,
        Type::Struct(id) => {
            let fields = layouts.fields(*id).iter();
            let fields = fields.map(|(name, ty)| (name.clone(), parameter_type(layouts, ty)));
            ParameterType::Struct(layouts.struct_name(*id).to_owned(), fields.collect())
        }
        Type::Array(element, count) => {
            ParameterType::Array(Box::new(parameter_type(layouts, element)), *count)
        }
        Type::Buffer(element) => ParameterType::Buffer(Box::new(parameter_type(layouts, element))),
        Type::Reference(role) => ParameterType::Reference(*role),
        Type::Void | Type::Error => unreachable!("members have a type with values"),
    }
}
