//! Named storage outside the values of a function.

use crate::Scalar;

/// A place of a function: an index into [`Function::places`](crate::Function::places).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct VariableId(pub u32);

/// A named run of scalars of one type. Aggregates of mixed types are several places, one a leaf:
/// a member `s` of struct type with fields `vec3 a; int b[2];` is `s.a` (f32 x 3) and `s.b` (i32 x 2),
/// and an array `t[4]` of that struct is `t.a` (f32 x 12, element by element) and `t.b` (i32 x 8).
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Variable {
    /// What stores it.
    pub kind: VariableKind,
    /// Its name: `rt_RayOrigin`, `center`, `light.position`; after linking, `kd.scale` for a member of the
    /// instance that the reference `kd` names, `layers[2].scale` in an array of references.
    pub name: String,
    /// The type of each scalar.
    pub scalar: Scalar,
    /// The number of scalars; for a buffer, the scalars of one element.
    pub len: u32,
}

/// What stores a place.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum VariableKind {
    /// A state variable of the one table: per ray.
    State,
    /// A member of the instance. Only the constructor and the initialiser store it.
    Member,
    /// A constructor parameter; only in the constructor and the initialiser.
    Parameter,
    /// Per ray, kept between the methods of one object for one hit.
    Scratch,
    /// Read-only data that the host binds; `len` scalars an element, of run-time length.
    Buffer,
    /// The function's own memory, zero at its start; the only kind that `store` may name.
    Local,
    /// One bool, only as an output: the call accepted a hit.
    Accepted,
}

impl VariableKind {
    /// All of them.
    pub const ALL: [VariableKind; 7] = [
        VariableKind::State,
        VariableKind::Member,
        VariableKind::Parameter,
        VariableKind::Scratch,
        VariableKind::Buffer,
        VariableKind::Local,
        VariableKind::Accepted,
    ];

    /// The kind with this keyword.
    pub fn from_name(name: &str) -> Option<VariableKind> {
        VariableKind::ALL.into_iter().find(|kind| kind.name() == name)
    }

    /// The keyword of the text form.
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
