//! Conversion of a scene's parameters to the arguments of a class.

use std::borrow::Cow;
use std::sync::Arc;

use rtsl::{
    Diagnostic, Instance, Numbers, ParameterType as ClassType, ReferenceCount, Role, Scalar, Value,
    diagnostic_codes as codes, type_name, with_article,
};

use crate::pbrt::NamedEntity;
use crate::reader::{Component, Parameter, ParameterType, ReferenceKind, Values};

/// Resolves the references in arguments.
pub trait Resolve {
    /// Returns the instance with this name in the scene.
    fn named(&mut self, kind: ReferenceKind, name: &str) -> Result<Arc<Instance>, Box<Diagnostic>>;

    /// Returns a texture of constant colour.
    fn constant_texture(&mut self, color: [f32; 3]) -> Result<Arc<Instance>, Box<Diagnostic>>;
}

/// Converts a parameter of an entity, by the class's names, to an argument of the class. Messages have the scene's
/// names.
pub fn argument(
    of: NamedEntity<'_>,
    mut parameter: Cow<'_, Parameter>,
    resolve: &mut dyn Resolve,
) -> Result<Value, Box<Diagnostic>> {
    let Some(expected) = of.class.parameters.iter().find(|it| it.name == parameter.name) else {
        return Err(of.unknown_parameter(&parameter));
    };
    let written = of.written(&parameter);
    if written != parameter.name {
        let written = written.to_owned();
        parameter.to_mut().name = written;
    }
    value(expected, &parameter, resolve)
}

/// Converts a parameter, whose name is that of messages, to a value.
fn value(
    expected: &rtsl::Parameter,
    parameter: &Parameter,
    resolve: &mut dyn Resolve,
) -> Result<Value, Box<Diagnostic>> {
    if matches!(expected.ty, ClassType::Textured(_)) {
        return textured(parameter, &expected.ty, resolve);
    }
    match reference_role(&expected.ty) {
        Some((role, count)) => references(parameter, role, count, resolve),
        None => match named_choices(parameter, expected) {
            Some(names) => Ok(names),
            None => data(parameter, &expected.ty),
        },
    }
}

/// Returns the names of choices that a scene gives for a parameter whose type is an enumeration.
fn named_choices(parameter: &Parameter, expected: &rtsl::Parameter) -> Option<Value> {
    let (Values::Texts(names), ParameterType::Text | ParameterType::Given) =
        (&parameter.values, &parameter.kind)
    else {
        return None;
    };
    if expected.choices().is_empty() {
        return None;
    }
    let mut names: Vec<Value> = names.iter().map(|name| Value::Text(name.clone())).collect();
    let is_single = matches!(expected.ty, ClassType::Scalar(_)) && names.len() == 1;
    if is_single { names.pop() } else { Some(Value::List(names)) }
}

/// Returns the texture that a parameter names, or a constant texture of the numbers that it gives.
pub fn texture(
    parameter: &Parameter,
    resolve: &mut dyn Resolve,
) -> Result<Arc<Instance>, Box<Diagnostic>> {
    if let Some(color) = constant_color(parameter) {
        return resolve.constant_texture(color);
    }
    let names = reference_names(parameter, ReferenceKind::Texture, ReferenceCount::Single)?;
    named(parameter, ReferenceKind::Texture, &names[0], resolve)
}

/// Returns the texture that a parameter names, or its values.
fn textured(
    parameter: &Parameter,
    ty: &ClassType,
    resolve: &mut dyn Resolve,
) -> Result<Value, Box<Diagnostic>> {
    match parameter.values {
        Values::Texts(_) => references(parameter, Role::Texture, ReferenceCount::Single, resolve),
        Values::Numbers(_) | Values::Booleans(_) | Values::Buffer(_) => {
            data(parameter, ty.value_type())
        }
    }
}

/// For references and arrays of them, the role and the array's length.
fn reference_role(ty: &ClassType) -> Option<(Role, ReferenceCount)> {
    let (role, count) = match ty {
        ClassType::Array(element, count) => (&**element, ReferenceCount::Array(*count)),
        ClassType::Buffer(element) => (&**element, ReferenceCount::Open),
        single => (single, ReferenceCount::Single),
    };
    let ClassType::Reference(role) = role else { return None };
    Some((*role, count))
}

fn references(
    parameter: &Parameter,
    role: Role,
    count: ReferenceCount,
    resolve: &mut dyn Resolve,
) -> Result<Value, Box<Diagnostic>> {
    let kind = reference_kind(role);
    if let (Role::Texture, ReferenceCount::Single, Some(color)) =
        (role, count, constant_color(parameter))
    {
        return resolve.constant_texture(color).map(Value::Instance);
    }
    let names = reference_names(parameter, kind, count)?;
    let mut instances = Vec::with_capacity(names.len());
    for name in names {
        instances.push(Value::Instance(named(parameter, kind, name, resolve)?));
    }
    Ok(match (count, instances.pop()) {
        (ReferenceCount::Single, Some(only)) => only,
        (_, last) => {
            instances.extend(last);
            Value::List(instances)
        }
    })
}

/// The names in a parameter that refers to other parts of the scene.
fn reference_names(
    parameter: &Parameter,
    kind: ReferenceKind,
    count: ReferenceCount,
) -> Result<&[String], Box<Diagnostic>> {
    let names = match (&parameter.kind, &parameter.values) {
        (ParameterType::Reference(given), Values::Texts(names)) if *given == kind => names,
        (ParameterType::Given | ParameterType::Text, Values::Texts(names)) => names,
        _ => {
            let message = format!(
                "`{}` refers to {}, expected `\"{} {}\" \"name\"`",
                parameter.name,
                with_article(kind.word()),
                kind.word(),
                parameter.name
            );
            return Err(wrong(parameter, message));
        }
    };
    if count == ReferenceCount::Open || names.len() == count.unset() {
        return Ok(names);
    }
    let count = count.unset();
    let message = format!("`{}` takes {count} names, found {}", parameter.name, names.len());
    Err(wrong(parameter, message))
}

fn named(
    parameter: &Parameter,
    kind: ReferenceKind,
    name: &str,
    resolve: &mut dyn Resolve,
) -> Result<Arc<Instance>, Box<Diagnostic>> {
    resolve.named(kind, name).map_err(|diagnostic| match diagnostic.primary {
        None => Box::new(diagnostic.at(parameter.values_span, "")),
        Some(_) => diagnostic,
    })
}

/// The colour of a texture given by numbers: one for grey, three for red, green and blue.
fn constant_color(parameter: &Parameter) -> Option<[f32; 3]> {
    let numeric = match parameter.kind {
        ParameterType::Numeric { component, .. } => component != Component::Bool,
        ParameterType::Given => true,
        ParameterType::Spectrum
        | ParameterType::Blackbody
        | ParameterType::Text
        | ParameterType::Reference(_) => false,
    };
    match &parameter.values {
        Values::Numbers(values) if numeric => match values.as_slice() {
            [grey] => Some([*grey as f32; 3]),
            [red, green, blue] => Some([*red as f32, *green as f32, *blue as f32]),
            _ => None,
        },
        Values::Numbers(_) | Values::Booleans(_) | Values::Texts(_) | Values::Buffer(_) => None,
    }
}

fn reference_kind(role: Role) -> ReferenceKind {
    match role {
        Role::Camera => ReferenceKind::Camera,
        Role::Primitive => ReferenceKind::Primitive,
        Role::Texture => ReferenceKind::Texture,
        Role::Light => ReferenceKind::Light,
        Role::Material => ReferenceKind::Material,
        Role::Integrator => ReferenceKind::Integrator,
    }
}

fn data(parameter: &Parameter, ty: &ClassType) -> Result<Value, Box<Diagnostic>> {
    let Some((scalar, count)) = scalars_of(ty) else {
        let message = format!(
            "`{}` is of type `{}`, which a scene cannot give",
            parameter.name,
            type_name(ty)
        );
        return Err(wrong(parameter, message));
    };
    if let (Values::Buffer(numbers), None) = (&parameter.values, count)
        && numbers.scalar() == scalar
    {
        return Ok(Value::Numbers(numbers.clone()));
    }
    let words = words(parameter, scalar).ok_or_else(|| mismatch(parameter, ty))?;
    let expected = match count {
        Some(count) => words.len() == count,
        None => true,
    };
    let grey = is_color(ty) && words.len() == 1;
    if !expected && !grey {
        let message = format!(
            "`{}` is of type `{}`, which takes {} numbers, found {}",
            parameter.name,
            type_name(ty),
            count.unwrap_or(0),
            words.len()
        );
        return Err(wrong(parameter, message));
    }
    Ok(Value::Numbers(Numbers::from_words(scalar, words)))
}

fn is_color(ty: &ClassType) -> bool {
    matches!(ty, ClassType::Color)
}

/// The scalar type of a type's components, if they all have the same, and their number; the number is `None` for
/// buffers, which take any number of elements.
fn scalars_of(ty: &ClassType) -> Option<(Scalar, Option<usize>)> {
    match ty {
        ClassType::Scalar(scalar) => Some((*scalar, Some(1))),
        ClassType::Vector(scalar, count) => Some((*scalar, Some(usize::from(*count)))),
        ClassType::Matrix(columns, rows) => {
            Some((Scalar::F32, Some(usize::from(*columns) * usize::from(*rows))))
        }
        ClassType::Color => Some((Scalar::F32, Some(3))),
        ClassType::Array(element, count) => {
            let (scalar, each) = scalars_of(element)?;
            Some((scalar, Some(each?.checked_mul(*count as usize)?)))
        }
        ClassType::Buffer(element) => scalars_of(element).map(|(scalar, _)| (scalar, None)),
        ClassType::Struct(..) | ClassType::Reference(_) | ClassType::Textured(_) => None,
    }
}

/// Converts the values to the bits of a scalar type, with the language's implicit conversions.
fn words(parameter: &Parameter, scalar: Scalar) -> Option<Vec<u32>> {
    let declared = match parameter.kind {
        ParameterType::Numeric { component, .. } => Some(component),
        ParameterType::Given => None,
        ParameterType::Spectrum
        | ParameterType::Blackbody
        | ParameterType::Text
        | ParameterType::Reference(_) => return None,
    };
    match (&parameter.values, scalar) {
        (Values::Booleans(values), Scalar::Bool) => {
            Some(values.iter().map(|value| u32::from(*value)).collect())
        }
        (Values::Texts(values), Scalar::Bool) if declared == Some(Component::Bool) => {
            Some(values.iter().map(|value| u32::from(value == "true")).collect())
        }
        (Values::Numbers(values), Scalar::F32) if declared != Some(Component::Bool) => {
            let bits =
                |value: &f64| Some(*value as f32).filter(|x| x.is_finite()).map(f32::to_bits);
            values.iter().map(bits).collect()
        }
        (Values::Numbers(values), Scalar::I32) if declared != Some(Component::Float) => {
            let bits = |value: &f64| {
                let whole = *value as i32;
                (f64::from(whole) == *value).then_some(whole.cast_unsigned())
            };
            values.iter().map(bits).collect()
        }
        (Values::Numbers(values), Scalar::U32) if declared != Some(Component::Float) => {
            let bits = |value: &f64| (f64::from(*value as u32) == *value).then_some(*value as u32);
            values.iter().map(bits).collect()
        }
        _ => None,
    }
}

fn mismatch(parameter: &Parameter, ty: &ClassType) -> Box<Diagnostic> {
    if let ParameterType::Reference(kind) = parameter.kind {
        let (name, ty, kind) = (&parameter.name, type_name(ty), kind.word());
        let message = format!("`{name}` is of type `{ty}`, found {}", with_article(kind));
        let help = match kind {
            "texture" => {
                "give a value; a class takes textures by members of type `rt_Texture` or with the qualifier `texture`"
            }
            _ => "give a value",
        };
        return Box::new(wrong(parameter, message).help(help));
    }
    let message = format!(
        "`{}` is of type `{}`, found {}",
        parameter.name,
        type_name(ty),
        parameter.values.description()
    );
    wrong(parameter, message)
}

fn wrong(parameter: &Parameter, message: String) -> Box<Diagnostic> {
    let diagnostic = Diagnostic::new(codes::WRONG_VALUE, message).at(parameter.values_span, "");
    Box::new(if parameter.declaration == parameter.values_span {
        diagnostic
    } else {
        diagnostic.label(parameter.declaration, "declared here")
    })
}
