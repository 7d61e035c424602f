//! Translation of pbrt parameters to those of a class.

use std::borrow::Cow;

use rtsl::{Class, ParameterType as ClassType};
use rtsl_math::Transform;

use super::name::PbrtName;
use crate::description::Entity;
use crate::reader::{COLOR, Parameter, ParameterType, ReferenceKind, Values};
use crate::spectrum::luminance;

/// Translates the parameters of an entity to those of its class.
pub fn translated<'e>(
    entity: &'e Entity,
    name: &PbrtName,
    class: &Class,
) -> Vec<Cow<'e, Parameter>> {
    let taken = entity.parameters.iter().filter(|it| effect(it, name, class) == Effect::Given);
    let mut translation = Translation { entity, parameters: taken.map(Cow::Borrowed).collect() };
    for parameter in &mut translation.parameters {
        let ours = name.parameter(&parameter.name);
        if ours != parameter.name {
            let ours = ours.to_owned();
            parameter.to_mut().name = ours;
        }
    }
    for parameter in &mut translation.parameters {
        take_mean(parameter, class);
    }
    name.translate(&mut translation);
    for (name, values) in name.defaults() {
        if translation.find(name).is_none() {
            translation.set(name, values.to_vec());
        }
    }
    translation.parameters
}

/// Replaces a spectrum by its mean, weighted like luminance, if the class takes one number: the index of a glass varies
/// with the wavelength, and a ray carries all of them.
fn take_mean(parameter: &mut Cow<'_, Parameter>, class: &Class) {
    let own = class.parameters.iter().find(|it| it.name == parameter.name);
    let is_number = own.is_some_and(|own| matches!(own.ty, ClassType::Scalar(_)));
    if let (true, COLOR, Values::Numbers(numbers)) = (is_number, parameter.kind, &parameter.values)
        && let [red, green, blue] = numbers[..]
    {
        let mean = luminance([red, green, blue]);
        parameter.to_mut().values = Values::Numbers(vec![mean]);
    }
}

/// The parameters of an entity that have no effect, each with the reason.
pub fn without_effect<'e>(
    entity: &'e Entity,
    name: &PbrtName,
    class: &Class,
) -> impl Iterator<Item = (&'e Parameter, &'static str)> {
    entity.parameters.iter().filter_map(move |parameter| match effect(parameter, name, class) {
        Effect::None(why) => Some((parameter, why)),
        Effect::Given | Effect::ReadByMaker => None,
    })
}

#[derive(PartialEq)]
enum Effect {
    /// Passed on to the class.
    Given,
    /// Read where values are made of files.
    ReadByMaker,
    None(&'static str),
}

fn effect(parameter: &Parameter, standard: &PbrtName, class: &Class) -> Effect {
    let name = parameter.name.as_str();
    let ours = standard.parameter(name);
    let own = class.parameters.iter().find(|it| it.name == ours);
    let textured = parameter.kind == ParameterType::Reference(ReferenceKind::Texture);
    match own {
        _ if standard.is_read_by_maker(name) => Effect::ReadByMaker,
        Some(own)
            if textured && !matches!(own.ty, ClassType::Reference(_) | ClassType::Textured(_)) =>
        {
            Effect::None("it is constant over the surface and cannot be a texture")
        }
        Some(_) => Effect::Given,
        None if standard.has_no_effect(name) => Effect::None("it is left out"),
        None => Effect::Given,
    }
}

/// The parameters of an entity, on the way from the format's to those of a class: by their names in the class.
pub struct Translation<'e> {
    entity: &'e Entity,
    parameters: Vec<Cow<'e, Parameter>>,
}

impl<'e> Translation<'e> {
    /// The entity as the scene describes it.
    pub fn entity(&self) -> &'e Entity {
        self.entity
    }

    /// The transform from the entity's space to the world's.
    pub fn to_world(&self) -> Transform {
        self.entity.transform
    }

    /// The parameter `name`, if it is given.
    pub fn find(&self, name: &str) -> Option<&Parameter> {
        self.parameters.iter().find(|it| it.name == name).map(AsRef::as_ref)
    }

    /// The first number of the parameter `name`, or `default`.
    pub fn number(&self, name: &str, default: f64) -> f64 {
        self.find(name).and_then(first_number).unwrap_or(default)
    }

    /// Removes the parameter `name`.
    pub fn take(&mut self, name: &str) -> Option<Cow<'e, Parameter>> {
        let place = self.parameters.iter().position(|it| it.name == name)?;
        Some(self.parameters.remove(place))
    }

    /// The first text of the parameter `name`, if its values are texts.
    pub fn text(&self, name: &str) -> Option<&str> {
        match &self.find(name)?.values {
            Values::Texts(texts) => texts.first().map(String::as_str),
            Values::Numbers(_) | Values::Booleans(_) | Values::Buffer(_) => None,
        }
    }

    /// Replaces the values of the parameter `name`, which is of a type for numbers from then on.
    pub fn replace(&mut self, name: &str, values: Vec<f64>) {
        if let Some(parameter) = self.parameters.iter_mut().find(|it| it.name == name) {
            let parameter = parameter.to_mut();
            (parameter.kind, parameter.values) = (ParameterType::Given, Values::Numbers(values));
        }
    }

    /// Removes the parameter `name` if its values are numbers, and returns the first.
    pub fn take_number(&mut self, name: &str) -> Option<Option<f64>> {
        match self.take(name)?.values {
            Values::Numbers(ref values) => Some(values.first().copied()),
            Values::Booleans(_) | Values::Texts(_) | Values::Buffer(_) => None,
        }
    }

    /// Adds a parameter.
    pub fn push(&mut self, parameter: Parameter) {
        self.parameters.push(Cow::Owned(parameter));
    }

    /// Adds a parameter that the scene does not give.
    pub fn set(&mut self, name: &str, values: Vec<f64>) {
        self.push(Parameter {
            kind: ParameterType::Given,
            name: name.to_owned(),
            declaration: self.entity.class_span,
            values: Values::Numbers(values),
            values_span: self.entity.class_span,
        });
    }

    /// Multiplies the parameter `name`, which is 1 by default.
    pub fn multiply(&mut self, name: &str, factor: f64) {
        match self.parameters.iter_mut().find(|it| it.name == name) {
            Some(parameter) => {
                if let Values::Numbers(values) = &mut parameter.to_mut().values {
                    values.iter_mut().for_each(|value| *value *= factor);
                }
            }
            None => self.set(name, vec![factor]),
        }
    }

    /// Joins two numbers of the format into one vector.
    pub fn join(&mut self, names: [&str; 2], joined: &str, default: f64) {
        let first = self.parameters.iter().find(|it| names.contains(&it.name.as_str()));
        let Some(first) = first.cloned() else { return };
        let values = Values::Numbers(names.map(|name| self.number(name, default)).into());
        self.parameters.retain(|it| !names.contains(&it.name.as_str()));
        let (kind, name) = (ParameterType::Given, joined.to_owned());
        self.push(Parameter { kind, name, values, ..first.into_owned() });
    }
}

fn first_number(parameter: &Parameter) -> Option<f64> {
    match &parameter.values {
        Values::Numbers(values) => values.first().copied(),
        Values::Booleans(_) | Values::Texts(_) | Values::Buffer(_) => None,
    }
}
