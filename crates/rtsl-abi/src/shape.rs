//! Which of a kernel's inputs differ from lane to lane.

use rtsl_ir::{Variable, VariableKind};

/// What the lanes of one call have in common. The author of a shader wrote for one ray and
/// one object; the shape says which of the two is many.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum CallMode {
    /// Rays vary, the object is one.
    Packet,
    /// As [`CallMode::Packet`], but all rays start where the first one does.
    CommonOrigin,
    /// Rays vary, and each has its own of many objects.
    Stream,
    /// One ray, objects vary: lane `i` is object `i` of a range. A kernel that accepts hits keeps the
    /// nearest.
    Leaf,
    /// One ray, one object: plain scalar code.
    Single,
}

/// The state variable that [`CallMode::CommonOrigin`] reads once for all rays.
const ORIGIN: &str = "rt_RayOrigin";

impl CallMode {
    /// All shapes.
    pub const ALL: [CallMode; 5] = [
        CallMode::Packet,
        CallMode::CommonOrigin,
        CallMode::Stream,
        CallMode::Leaf,
        CallMode::Single,
    ];

    /// The name that the command line and the text form use.
    pub const fn name(self) -> &'static str {
        match self {
            CallMode::Packet => "packet",
            CallMode::CommonOrigin => "common-origin",
            CallMode::Stream => "stream",
            CallMode::Leaf => "leaf",
            CallMode::Single => "single",
        }
    }

    /// The shape of this name.
    pub fn from_name(name: &str) -> Option<CallMode> {
        CallMode::ALL.into_iter().find(|shape| shape.name() == name)
    }

    /// Whether what `place` holds before a call differs from lane to lane; where it does not,
    /// kernels read it in lane 0, before they store anything. This is all that the lowering knows of
    /// a shape's meaning. `of_objects`: it stands in blocks of objects, not once for all of them. Slots are
    /// absent from the table: what they hold depends on what is stored.
    pub fn varies(self, variable: &Variable, of_objects: bool) -> bool {
        let of_ray = matches!(
            variable.kind,
            VariableKind::State | VariableKind::Scratch | VariableKind::Accepted
        );
        let is_data = matches!(
            variable.kind,
            VariableKind::Member | VariableKind::Parameter | VariableKind::Buffer
        );
        let of_object = is_data && of_objects;
        match self {
            CallMode::Packet => of_ray,
            CallMode::CommonOrigin => {
                of_ray && !(variable.kind == VariableKind::State && variable.name == ORIGIN)
            }
            CallMode::Stream => of_ray || of_object,
            CallMode::Leaf => of_object || variable.kind == VariableKind::Accepted,
            CallMode::Single => false,
        }
    }

    /// Whether a kernel stores what it sets of `place`, state or scratch, to the lane that it reads there. Where it does
    /// not, to store what was read changes other lanes. `accepts`: the method accepts hits.
    pub fn stores_where_it_reads(self, variable: &Variable, accepts: bool) -> bool {
        match self {
            CallMode::Packet | CallMode::CommonOrigin | CallMode::Stream => {
                self.varies(variable, false)
            }
            // The lane of the one ray; in the other methods of the leaf shape, those of the objects.
            CallMode::Single => true,
            CallMode::Leaf => accepts,
        }
    }

    /// Whether there are many objects in a call.
    pub const fn has_many_objects(self) -> bool {
        match self {
            CallMode::Stream | CallMode::Leaf => true,
            CallMode::Packet | CallMode::CommonOrigin | CallMode::Single => false,
        }
    }

    /// The width of kernels of this shape where `width` is asked for.
    pub const fn width(self, width: u32) -> u32 {
        match self {
            CallMode::Packet | CallMode::CommonOrigin | CallMode::Stream | CallMode::Leaf => width,
            CallMode::Single => 1,
        }
    }
}
