//! Variables: the named storage that a function reads and writes.

use crate::Scalar;

/// A variable of a function: an index into [`Function::variables`](crate::Function::variables).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct VariableId(pub u32);

/// A named run of scalars of one type. An aggregate of mixed types becomes several variables, one for each leaf: a
/// member `s` of struct type with fields `vec3 a; int b[2];` is `s.a` (f32 x 3) and `s.b` (i32 x 2), and an array
/// `t[4]` of that struct is `t.a` (f32 x 12, element by element) and `t.b` (i32 x 8).
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Variable {
    /// The kind of storage.
    pub kind: VariableKind,
    /// The name: `rt_RayOrigin`, `center`, `light.position`. After linking also `kd.scale` for a member of the instance
    /// that the reference `kd` names, and `layers[2].scale` in an array of references.
    pub name: String,
    /// The type of each scalar.
    pub scalar: Scalar,
    /// The number of scalars; for a buffer, the number of scalars per element.
    pub len: u32,
}

/// The kinds of storage of variables.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum VariableKind {
    /// A state variable of the language, stored per ray.
    State,
    /// A member of the instance. Only the constructor and the initialiser store it.
    Member,
    /// A constructor parameter; occurs only in the constructor and the initialiser.
    Parameter,
    /// Scratch: stored per ray and kept between the methods of one object for one hit.
    Scratch,
    /// Read-only data that the host binds: `len` scalars per element, with a run-time number of elements.
    Buffer,
    /// Memory of the function itself, zero at its start; the only kind that `store` may write.
    Local,
    /// One bool, only as an output: true if the call accepted a hit.
    Accepted,
}

impl VariableKind {
    /// All kinds.
    pub const ALL: [VariableKind; 7] = [
        VariableKind::State,
        VariableKind::Member,
        VariableKind::Parameter,
        VariableKind::Scratch,
        VariableKind::Buffer,
        VariableKind::Local,
        VariableKind::Accepted,
    ];

    /// Returns the kind with this keyword.
    pub fn from_name(name: &str) -> Option<VariableKind> {
        VariableKind::ALL.into_iter().find(|kind| kind.name() == name)
    }

    /// Returns the keyword of the text form.
    pub const fn name(self) -> &'static str {
        match self {
            VariableKind::State => "state",
            VariableKind::Member => "member",
            VariableKind::Parameter => "parameter",
            VariableKind::Scratch => "scratch",
            VariableKind::Buffer => "buffer",
            VariableKind::Local => "local",
            VariableKind::Accepted => "accepted",
        }
    }
}
