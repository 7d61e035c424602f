//! The parameters of a scene that can be changed in a session, for user interfaces.

use rtsl::{
    Annotation, AnnotationValue, Class, Constant, Instance, Parameter, ParameterType, Role, Scalar,
};
use rtsl_scene::reader::Values;
use rtsl_scene::{EntityId, EntityKind};

/// A part of a scene that is an instance of a class.
#[derive(Clone, Debug, PartialEq)]
pub struct Thing {
    /// Its entity in the scene's description.
    pub entity: EntityId,
    /// The kind of the entity.
    pub kind: EntityKind,
    /// Its name, or its class and the line in the scene's text.
    pub title: String,
    /// Its class.
    pub class: String,
}

/// A parameter of a thing.
#[derive(Clone, Debug, PartialEq)]
pub struct Control {
    /// Its name.
    pub name: String,
    /// Its display name: the annotation `label`, or else the parameter's name.
    pub label: String,
    /// The annotation `doc`.
    pub doc: Option<String>,
    /// The annotation `unit`.
    pub unit: Option<String>,
    /// The type of its value.
    pub kind: ControlKind,
    /// The annotation `min`.
    pub min: Option<f64>,
    /// The annotation `max`.
    pub max: Option<f64>,
    /// The names and numbers of the choices, if the parameter's type is an enumeration.
    pub choices: Vec<(String, f64)>,
    /// The current value: one number, or one for each component; true is 1.
    pub values: Vec<f64>,
}

/// The type of a control's value.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ControlKind {
    /// A real number, or a vector of them.
    Real,
    /// An integer, or a vector of integers.
    Whole,
    /// A boolean.
    Truth,
    /// A colour: linear red, green and blue.
    Color,
}

impl Control {
    /// Returns the control for a parameter of an instance to which the scene gives these values; `None` for types that
    /// controls do not support.
    pub fn new(
        instance: &Instance,
        parameter: &Parameter,
        given: Option<&Values>,
    ) -> Option<Control> {
        let class = instance.class();
        let is_texture = matches!(given, Some(Values::Texts(_)));
        if is_texture && matches!(parameter.ty, ParameterType::Textured(_)) {
            return None;
        }
        let (kind, values) = match kind_of(&parameter.ty) {
            Some((kind, count)) => {
                let values = given
                    .and_then(|given| numbers(given).or_else(|| numbers_of_names(given, parameter)))
                    .or_else(|| default(class, instance, parameter))?;
                (kind, spread(values, count)?)
            }
            // A constant texture is shown as a colour.
            None if parameter.ty == ParameterType::Reference(Role::Texture) => {
                (ControlKind::Color, spread(given.and_then(numbers)?, 3)?)
            }
            None => return None,
        };
        let text = |key| match annotation(parameter, key)? {
            AnnotationValue::Text(text) => Some(text.clone()),
            AnnotationValue::None | AnnotationValue::Constant(_) => None,
        };
        let number = |key| match annotation(parameter, key)? {
            AnnotationValue::Constant(constant) => Some(number_of(*constant)),
            AnnotationValue::None | AnnotationValue::Text(_) => None,
        };
        Some(Control {
            name: parameter.name.clone(),
            label: text("label").unwrap_or_else(|| parameter.name.clone()),
            doc: text("doc"),
            unit: text("unit"),
            kind,
            min: number("min"),
            max: number("max"),
            choices: choices(parameter),
            values,
        })
    }

    /// Returns the numbers in the form of a scene's parameter.
    pub fn scene_values(&self, numbers: &[f64]) -> Values {
        match self.kind {
            ControlKind::Truth => Values::Booleans(numbers.iter().map(|it| *it != 0.0).collect()),
            ControlKind::Whole => Values::Numbers(numbers.iter().map(|it| it.round()).collect()),
            ControlKind::Real | ControlKind::Color => Values::Numbers(numbers.to_vec()),
        }
    }
}

/// The type of a control for this parameter type, and its number of components.
fn kind_of(ty: &ParameterType) -> Option<(ControlKind, usize)> {
    let scalar = |scalar: &Scalar| match scalar {
        Scalar::F32 => ControlKind::Real,
        Scalar::I32 | Scalar::U32 => ControlKind::Whole,
        Scalar::Bool => ControlKind::Truth,
    };
    match ty {
        ParameterType::Scalar(ty) => Some((scalar(ty), 1)),
        ParameterType::Vector(ty, count) => Some((scalar(ty), usize::from(*count))),
        ParameterType::Color => Some((ControlKind::Color, 3)),
        ParameterType::Textured(value) => kind_of(value),
        ParameterType::Matrix(..)
        | ParameterType::Struct(..)
        | ParameterType::Array(..)
        | ParameterType::Buffer(_)
        | ParameterType::Reference(_) => None,
    }
}

fn numbers(values: &Values) -> Option<Vec<f64>> {
    match values {
        Values::Numbers(numbers) => Some(numbers.clone()),
        Values::Booleans(values) => Some(values.iter().map(|value| f64::from(*value)).collect()),
        Values::Texts(_) | Values::Buffer(_) => None,
    }
}

fn choices(parameter: &Parameter) -> Vec<(String, f64)> {
    let choices = parameter.choices().into_iter();
    choices.map(|(name, value)| (name.to_owned(), f64::from(value))).collect()
}

/// The numbers of the choices that a scene names.
fn numbers_of_names(values: &Values, parameter: &Parameter) -> Option<Vec<f64>> {
    let Values::Texts(names) = values else { return None };
    let choices = parameter.choices();
    let number = |name: &String| choices.iter().find(|(choice, _)| choice == name);
    names.iter().map(|name| number(name).map(|(_, value)| f64::from(*value))).collect()
}

/// A single number sets all components of a colour.
fn spread(values: Vec<f64>, count: usize) -> Option<Vec<f64>> {
    match values.as_slice() {
        [grey] => Some(vec![*grey; count]),
        all => (all.len() == count).then_some(values),
    }
}

/// The default value of a parameter that the scene does not set.
fn default(class: &Class, instance: &Instance, parameter: &Parameter) -> Option<Vec<f64>> {
    let scalar = match &parameter.ty {
        ParameterType::Scalar(scalar) | ParameterType::Vector(scalar, _) => *scalar,
        _ => Scalar::F32,
    };
    let words = match instance.member(&parameter.name) {
        Some(words) => words.to_vec(),
        None => rtsl::default_value(class, parameter)?,
    };
    let number = |word: &u32| match scalar {
        Scalar::F32 => shortest(f32::from_bits(*word)),
        Scalar::I32 => f64::from(word.cast_signed()),
        Scalar::U32 | Scalar::Bool => f64::from(*word),
    };
    Some(words.iter().map(number).collect())
}

/// The shortest decimal number that rounds to a float: 0.1, not 0.10000000149.
fn shortest(x: f32) -> f64 {
    x.to_string().parse().unwrap_or(f64::from(x))
}

fn annotation<'a>(parameter: &'a Parameter, key: &str) -> Option<&'a AnnotationValue> {
    let is = |annotation: &&Annotation| annotation.key == key;
    parameter.annotations.iter().find(is).map(|annotation| &annotation.value)
}

fn number_of(constant: Constant) -> f64 {
    match constant {
        Constant::F32(value) => shortest(value),
        Constant::I32(value) => f64::from(value),
        Constant::U32(value) => f64::from(value),
        Constant::Bool(value) => f64::from(value),
    }
}
