//! The state of the scene format: what stands when a directive is met, and the blocks that save it.

use std::collections::BTreeMap;
use std::rc::Rc;

use rtsl::Span;

use super::current_transform::CurrentTransform;
use super::parameter::Parameter;
use crate::{EntityId, EntityKind};

/// What applies to the next shape, light or texture.
#[derive(Clone, Debug)]
pub struct GraphicsState {
    /// The current transform.
    pub transform: CurrentTransform,
    /// The current material.
    pub material: MaterialChoice,
    /// The current area light.
    pub area_light: Option<EntityId>,
    /// Whether normals are turned round.
    pub reverse_orientation: bool,
    /// Parameters that `Attribute` gives to all later entities of a kind.
    pub defaults: BTreeMap<EntityKind, Rc<Vec<Parameter>>>,
}

/// The current material.
#[derive(Clone, Debug)]
pub enum MaterialChoice {
    /// None was chosen yet.
    Default,
    /// The one that `Material` made.
    Made(EntityId),
    /// The one that `MakeNamedMaterial` makes under this name, here or later.
    Named(Rc<str>, Span),
}

impl GraphicsState {
    /// The state at the beginning of a scene.
    pub fn new() -> Self {
        GraphicsState {
            transform: CurrentTransform::IDENTITY,
            material: MaterialChoice::Default,
            area_light: None,
            reverse_orientation: false,
            defaults: BTreeMap::new(),
        }
    }
}

/// A block that is open.
#[derive(Clone, Debug)]
pub struct Block {
    /// What opened it.
    pub kind: BlockKind,
    /// Where.
    pub span: Span,
    /// The state before it.
    pub saved: GraphicsState,
}

/// The kinds of block.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum BlockKind {
    /// `AttributeBegin`
    Attribute,
    /// `TransformBegin`, which saves the transform only.
    Transform,
    /// `ObjectBegin`
    Object,
}

impl BlockKind {
    /// The directive that opens it.
    pub fn begin(self) -> &'static str {
        match self {
            BlockKind::Attribute => "AttributeBegin",
            BlockKind::Transform => "TransformBegin",
            BlockKind::Object => "ObjectBegin",
        }
    }

    /// The directive that closes it.
    pub fn end(self) -> &'static str {
        match self {
            BlockKind::Attribute => "AttributeEnd",
            BlockKind::Transform => "TransformEnd",
            BlockKind::Object => "ObjectEnd",
        }
    }
}
