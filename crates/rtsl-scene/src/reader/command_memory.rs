//! The memory that commands of a scene will occupy, computed before they are executed.

use rtsl_memory::Amount;

use super::directive::Keyword;
use super::parameter::Parameter;
use super::parser::Command;
use crate::{Entity, EntityKind, InstanceUse};

/// The memory of an entity after loading, besides its description.
const OF_ENTITY: Amount = Amount(512);

/// The kind of entity that a directive creates, if any.
pub fn entity_kind(keyword: Keyword) -> Option<EntityKind> {
    match keyword {
        Keyword::AreaLightSource => Some(EntityKind::AreaLight),
        Keyword::Camera => Some(EntityKind::Camera),
        Keyword::Film => Some(EntityKind::Film),
        Keyword::Integrator => Some(EntityKind::Integrator),
        Keyword::LightSource => Some(EntityKind::Light),
        Keyword::MakeNamedMaterial | Keyword::Material => Some(EntityKind::Material),
        Keyword::PixelFilter => Some(EntityKind::Filter),
        Keyword::Sampler => Some(EntityKind::Sampler),
        Keyword::Shape => Some(EntityKind::Shape),
        Keyword::Texture => Some(EntityKind::Texture),
        _ => None,
    }
}

/// The memory that a command adds to the description of a scene. `defaults` are parameters that an entity gets besides
/// those of the command. Lists count double because of their spare capacity.
pub fn memory(command: &Command, defaults: &[Parameter]) -> Amount {
    let own = parameters(&command.parameters);
    match command.keyword {
        Keyword::ObjectBegin | Keyword::ObjectInstance | Keyword::CoordinateSystem => {
            Amount::of::<InstanceUse>(2) + OF_ENTITY
        }
        Keyword::Attribute => own,
        keyword if entity_kind(keyword).is_some() => {
            Amount::of::<Entity>(2) + OF_ENTITY + own + parameters(defaults)
        }
        _ => Amount::default(),
    }
}

fn parameters(list: &[Parameter]) -> Amount {
    let memory = |it: &Parameter| {
        Amount::of::<Parameter>(1) + Amount::of::<u8>(it.name.len()) + it.values.memory()
    };
    list.iter().map(memory).sum()
}
