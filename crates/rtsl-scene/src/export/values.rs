//! The parameters of a description's entities, with the textures that they name.

use std::collections::BTreeMap;

use crate::description::{Description, Entity, EntityId, EntityKind};
use crate::reader::{ParameterType, ReferenceKind, Values};

/// A parameter that may be a texture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Input<T> {
    Constant(T),
    Texture(EntityId),
}

/// The entities of a description by their kinds and names.
pub struct Names<'d>(BTreeMap<(EntityKind, &'d str), EntityId>);

impl<'d> Names<'d> {
    pub fn of(description: &'d Description) -> Self {
        let entities = description.entities.iter().enumerate();
        let named = entities
            .filter_map(|(index, it)| Some(((it.kind, it.name.as_deref()?), EntityId(index))));
        Names(named.collect())
    }

    /// Returns the entity that a parameter refers to.
    pub fn referred(&self, entity: &Entity, name: &str) -> Option<EntityId> {
        let parameter = entity.parameter(name)?;
        let kind = match parameter.kind {
            ParameterType::Reference(ReferenceKind::Texture) => EntityKind::Texture,
            ParameterType::Reference(ReferenceKind::Material) => EntityKind::Material,
            _ => return None,
        };
        self.0.get(&(kind, parameter.first_text()?)).copied()
    }

    /// Returns a number or its texture.
    pub fn number(&self, entity: &Entity, name: &str, default: f64) -> Input<f64> {
        match self.referred(entity, name) {
            Some(texture) => Input::Texture(texture),
            None => Input::Constant(entity.number(name).unwrap_or(default)),
        }
    }

    /// Returns a colour or its texture.
    pub fn color(&self, entity: &Entity, name: &str) -> Input<[f64; 3]> {
        match self.referred(entity, name) {
            Some(texture) => Input::Texture(texture),
            None => Input::Constant(numbers(entity, name).unwrap_or([1.0; 3])),
        }
    }
}

/// Returns the numbers of a parameter, if there are so many.
pub fn numbers<const COUNT: usize>(entity: &Entity, name: &str) -> Option<[f64; COUNT]> {
    match &entity.parameter(name)?.values {
        Values::Numbers(numbers) => numbers.as_slice().try_into().ok(),
        Values::Booleans(_) | Values::Texts(_) | Values::Buffer(_) => None,
    }
}

/// Returns a boolean parameter.
pub fn boolean(entity: &Entity, name: &str) -> Option<bool> {
    entity.parameter(name).and_then(|it| it.first_boolean())
}
