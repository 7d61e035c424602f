//! Instances that were made of entities, and what later loads keep of them.

use std::collections::BTreeSet;
use std::sync::Arc;

use rtsl::{Class, Instance};

use crate::attributes::WantedAttributes;
use crate::description::EntityId;
use crate::gltf::FileAttributes;
use crate::presence::Presences;

/// The instance of an entity.
#[derive(Clone)]
pub(super) enum Slot {
    Empty,
    /// The instance is being made: a reference to it now is a cycle.
    Open,
    Made(Made),
    /// The instance cannot be made; an error was reported.
    Failed,
}

/// An instance, and its dependencies besides the parameters of its entity.
#[derive(Clone, Debug)]
pub struct Made {
    /// The instance of the entity's class.
    pub instance: Arc<Instance>,
    /// A material with the relief that the entity gives it.
    pub(super) relief: Option<Arc<Instance>>,
    /// The alpha texture of a shape.
    pub(super) alpha: Option<Arc<Instance>>,
    /// The instances of the entities that it refers to.
    pub(super) named: Vec<(EntityId, Arc<Instance>)>,
    /// The classes of the constants among its references.
    pub(super) standard: Vec<Arc<Class>>,
    /// The class of the entity, before attributes.
    pub(super) class: Arc<Class>,
    /// The attributes that shaders of the scene read.
    pub(super) wanted: Arc<WantedAttributes>,
}

impl Made {
    /// The instance that other entities and objects refer to.
    pub(super) fn outermost(&self) -> Arc<Instance> {
        self.relief.as_ref().unwrap_or(&self.instance).clone()
    }
}

/// The instances of an earlier load.
#[derive(Clone, Copy)]
pub struct Earlier<'a> {
    /// The instances, by entity.
    pub made: &'a [Option<Made>],
    /// The entities whose parameters changed since.
    pub changed: &'a BTreeSet<EntityId>,
    /// The attributes that a glTF file gave its shapes.
    pub attributes: &'a Arc<FileAttributes>,
    /// The alpha textures of materials with holes.
    pub presences: &'a Presences,
}

/// The parts of a load that later ones use again.
pub struct Kept {
    /// The instances, by entity.
    pub made: Vec<Option<Made>>,
    /// The attributes that a glTF file gives its shapes.
    pub attributes: Arc<FileAttributes>,
    /// The alpha textures of materials with holes.
    pub presences: Presences,
}
