//! The lanes whose hits have transforms.

/// The object that a ray hit.
#[derive(Clone, Copy, Debug)]
pub struct ObjectHit {
    /// The index of the object.
    pub object: u32,
    /// The index of its element.
    pub element: u32,
    /// The index of the instance that places it; `None` for the world.
    pub instance: Option<u32>,
}

/// Hits of objects of one traversal class, by lane.
pub trait HitLanes {
    /// Returns the hit of a lane.
    fn hit(&self, lane: usize) -> ObjectHit;

    /// Returns the time of a lane's ray within the shutter.
    fn time(&self, lane: usize) -> f32;
}
