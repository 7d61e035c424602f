//! Which of a kernel's inputs differ from ray to ray.

use rtsl_ir::{Place, PlaceKind};

/// What the rays of one call have in common. The author of a shader wrote for one ray and
/// one object; the shape says which of the two is many.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Shape {
    /// Rays vary, the object is one.
    Packet,
    /// Rays vary, and each has its own object.
    Stream,
}

impl Shape {
    /// All shapes.
    pub const ALL: [Shape; 2] = [Shape::Packet, Shape::Stream];

    /// The name that the command line and the text form use.
    pub const fn name(self) -> &'static str {
        match self {
            Shape::Packet => "packet",
            Shape::Stream => "stream",
        }
    }

    /// The shape of this name.
    pub fn from_name(name: &str) -> Option<Shape> {
        Shape::ALL.into_iter().find(|shape| shape.name() == name)
    }

    /// Whether what `place` holds differs from ray to ray. This is all that the rest of
    /// the compiler knows of a shape's meaning. Slots are absent from the table: what they hold
    /// depends on what is stored.
    pub fn varies(self, place: &Place) -> bool {
        match place.kind {
            PlaceKind::State | PlaceKind::Scratch | PlaceKind::Accepted => true,
            PlaceKind::Member | PlaceKind::Parameter | PlaceKind::Buffer => match self {
                Shape::Packet => false,
                Shape::Stream => true,
            },
            PlaceKind::Slot => false,
        }
    }
}
