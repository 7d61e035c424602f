//! Call modes of kernels: the inputs that vary from lane to lane.

use rtsl_ir::{Variable, VariableKind};

/// The call mode of a kernel. A shader is written for one ray and one object; the mode determines which of the two
/// varies between the lanes of a call.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum CallMode {
    /// Many rays, one object.
    Packet,
    /// As [`CallMode::Packet`], but all rays have the origin of the first.
    CommonOrigin,
    /// Many rays, each with its object.
    Stream,
    /// One ray, many objects: lane `i` is object `i` of a range. A kernel that accepts hits keeps the nearest.
    Leaf,
    /// One ray, one object: scalar code.
    Single,
}

/// The state variable that [`CallMode::CommonOrigin`] reads once for all rays.
const ORIGIN: &str = "rt_RayOrigin";

impl CallMode {
    /// All call modes.
    pub const ALL: [CallMode; 5] = [
        CallMode::Packet,
        CallMode::CommonOrigin,
        CallMode::Stream,
        CallMode::Leaf,
        CallMode::Single,
    ];

    /// Returns the name on the command line and in the text form.
    pub const fn name(self) -> &'static str {
        match self {
            CallMode::Packet => "packet",
            CallMode::CommonOrigin => "common-origin",
            CallMode::Stream => "stream",
            CallMode::Leaf => "leaf",
            CallMode::Single => "single",
        }
    }

    /// Returns the call mode with this name.
    pub fn from_name(name: &str) -> Option<CallMode> {
        CallMode::ALL.into_iter().find(|mode| mode.name() == name)
    }

    /// True if the content of `variable` before a call differs from lane to lane; otherwise kernels read it from lane
    /// 0, before they store anything. The lowering knows the meaning of a call mode only through this function.
    /// `of_objects` is true for variables in blocks of objects. Locals are not included: their content depends on the
    /// stores.
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

    /// True if a kernel stores its output to `variable`, a state or scratch variable, in the lane from which it reads
    /// it. Otherwise storing the value read changes other lanes. `accepts` is true if the method accepts hits.
    pub fn stores_where_it_reads(self, variable: &Variable, accepts: bool) -> bool {
        match self {
            CallMode::Packet | CallMode::CommonOrigin | CallMode::Stream => {
                self.varies(variable, false)
            }
            CallMode::Single => true,
            // Outputs of methods that accept hits go to the ray's lane, those of other methods to the objects' lanes.
            CallMode::Leaf => accepts,
        }
    }

    /// True if a call has many objects.
    pub const fn has_many_objects(self) -> bool {
        match self {
            CallMode::Stream | CallMode::Leaf => true,
            CallMode::Packet | CallMode::CommonOrigin | CallMode::Single => false,
        }
    }

    /// Returns the width of kernels of this mode if `width` is requested.
    pub const fn width(self, width: u32) -> u32 {
        match self {
            CallMode::Packet | CallMode::CommonOrigin | CallMode::Stream | CallMode::Leaf => width,
            CallMode::Single => 1,
        }
    }
}
