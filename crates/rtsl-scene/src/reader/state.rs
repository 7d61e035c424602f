//! The graphics state of the scene format, and the blocks that save and restore it.

use std::collections::BTreeMap;
use std::rc::Rc;

use rtsl::Span;

use super::current_transform::CurrentTransform;
use super::parameter::Parameter;
use crate::spectrum::ColorSpace;
use crate::{EntityId, EntityKind};

/// The state that applies to the next shape, light or texture.
#[derive(Clone, Debug)]
pub struct GraphicsState {
    /// The current transform.
    pub transform: CurrentTransform,
    /// The current material.
    pub material: MaterialChoice,
    /// The current area light.
    pub area_light: Option<EntityId>,
    /// True if normals are flipped.
    pub reverse_orientation: bool,
    /// The colour space of `rgb` parameters.
    pub color_space: &'static ColorSpace,
    /// Parameters that `Attribute` sets for all later entities of a kind.
    pub defaults: BTreeMap<EntityKind, Rc<Vec<Parameter>>>,
}

/// The current material.
#[derive(Clone, Debug)]
pub enum MaterialChoice {
    /// No material was chosen yet.
    Default,
    /// The material created by `Material`.
    Made(EntityId),
    /// The material that `MakeNamedMaterial` creates under this name, before or after its use.
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
            color_space: ColorSpace::SRGB,
            defaults: BTreeMap::new(),
        }
    }
}

/// An open block.
#[derive(Clone, Debug)]
pub struct Block {
    /// The kind of the block.
    pub kind: BlockKind,
    /// The place of the directive that opened it.
    pub span: Span,
    /// The state to restore at its end.
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
    /// Returns the directive that opens it.
    pub fn begin(self) -> &'static str {
        match self {
            BlockKind::Attribute => "AttributeBegin",
            BlockKind::Transform => "TransformBegin",
            BlockKind::Object => "ObjectBegin",
        }
    }

    /// Returns the directive that closes it.
    pub fn end(self) -> &'static str {
        match self {
            BlockKind::Attribute => "AttributeEnd",
            BlockKind::Transform => "TransformEnd",
            BlockKind::Object => "ObjectEnd",
        }
    }
}
