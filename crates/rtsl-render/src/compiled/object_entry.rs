//! The parts of an object's surface, by index.

/// The indices of an object's parts.
#[derive(Clone, Copy, Debug, Default)]
pub struct ObjectEntry {
    /// Its group.
    pub group: u32,
    /// The index of its material among those of its class.
    pub material: u32,
    /// The index of its emitter among those of its class.
    pub emitter: u32,
    /// The index of its alpha texture among those of its class.
    pub alpha: u32,
    /// The traversal class of the object or its elements.
    pub class: u32,
    /// Its index there; elements have separate ones.
    pub index: u32,
}
