//! Which of a kernel's inputs differ from lane to lane.

use rtsl_ir::{Place, PlaceKind};

/// What the lanes of one call have in common. The author of a shader wrote for one ray and
/// one object; the shape says which of the two is many.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Shape {
    /// Rays vary, the object is one.
    Packet,
    /// As [`Shape::Packet`], but all rays start where the first one does.
    CommonOrigin,
    /// Rays vary, and each has its own of many objects.
    Stream,
    /// One ray, objects vary: lane `i` is object `i` of a range. A kernel that accepts hits keeps the
    /// nearest.
    Leaf,
    /// One ray, one object: plain scalar code.
    Single,
}

/// The state variable that [`Shape::CommonOrigin`] reads once for all rays.
const ORIGIN: &str = "rt_RayOrigin";

impl Shape {
    /// All shapes.
    pub const ALL: [Shape; 5] =
        [Shape::Packet, Shape::CommonOrigin, Shape::Stream, Shape::Leaf, Shape::Single];

    /// The name that the command line and the text form use.
    pub const fn name(self) -> &'static str {
        match self {
            Shape::Packet => "packet",
            Shape::CommonOrigin => "common-origin",
            Shape::Stream => "stream",
            Shape::Leaf => "leaf",
            Shape::Single => "single",
        }
    }

    /// The shape of this name.
    pub fn from_name(name: &str) -> Option<Shape> {
        Shape::ALL.into_iter().find(|shape| shape.name() == name)
    }

    /// Whether what `place` holds before a call differs from lane to lane; where it does not,
    /// kernels read it in lane 0, before they store anything. This is all that the lowering knows of
    /// a shape's meaning. `of_objects`: it stands in blocks of objects, not once for all of them. Slots are
    /// absent from the table: what they hold depends on what is stored.
    pub fn varies(self, place: &Place, of_objects: bool) -> bool {
        let of_ray =
            matches!(place.kind, PlaceKind::State | PlaceKind::Scratch | PlaceKind::Accepted);
        let is_data =
            matches!(place.kind, PlaceKind::Member | PlaceKind::Parameter | PlaceKind::Buffer);
        let of_object = is_data && of_objects;
        match self {
            Shape::Packet => of_ray,
            Shape::CommonOrigin => {
                of_ray && !(place.kind == PlaceKind::State && place.name == ORIGIN)
            }
            Shape::Stream => of_ray || of_object,
            Shape::Leaf => of_object || place.kind == PlaceKind::Accepted,
            Shape::Single => false,
        }
    }

    /// Whether a kernel stores what it sets of `place`, state or scratch, to the lane that it reads there. Where it does
    /// not, to store what was read changes other lanes. `accepts`: the method accepts hits.
    pub fn stores_where_it_reads(self, place: &Place, accepts: bool) -> bool {
        match self {
            Shape::Packet | Shape::CommonOrigin | Shape::Stream => self.varies(place, false),
            // The lane of the one ray; in the other methods of the leaf shape, those of the objects.
            Shape::Single => true,
            Shape::Leaf => accepts,
        }
    }

    /// Whether there are many objects in a call.
    pub const fn has_many_objects(self) -> bool {
        match self {
            Shape::Stream | Shape::Leaf => true,
            Shape::Packet | Shape::CommonOrigin | Shape::Single => false,
        }
    }

    /// The width of kernels of this shape where `width` is asked for.
    pub const fn width(self, width: u32) -> u32 {
        match self {
            Shape::Packet | Shape::CommonOrigin | Shape::Stream | Shape::Leaf => width,
            Shape::Single => 1,
        }
    }
}
