//! The state of some rays, and their host, which only answers `rand()`.

use glam::{Vec2, Vec3};
use rtsl::host::{Host, LaneFloats, LaneSet};
use rtsl::{LaneBlock, LaneMask, lookup_state};

use crate::random::{SHADER_DIMENSION, Stream};

/// State and scratch of some rays.
pub struct Rays {
    pub(crate) state: LaneBlock,
    pub(crate) scratch: LaneBlock,
    pub(crate) accepted: LaneMask,
    pub(crate) host: RandomHost,
    pub(crate) count: usize,
}

impl Rays {
    /// Returns the number of rays.
    pub fn count(&self) -> usize {
        self.count
    }

    /// Limits calls to the first `count` lanes.
    pub fn truncate(&mut self, count: usize) {
        assert!(count <= self.state.lanes(), "as many lanes as there are");
        self.count = count;
    }

    /// Changes the rays' indices, and restarts the sequences of `rand()`.
    pub fn renumber(&mut self, stream: Stream, first: u64) {
        self.host.stream = stream;
        self.host.first = first;
        self.restart();
    }

    /// Restarts the sequences of `rand()`.
    pub fn restart(&mut self) {
        self.host.requests.fill(0);
    }

    /// Sets a variable to a separate value for each ray.
    pub fn set_vectors(&mut self, variable: &str, values: impl IntoIterator<Item = Vec3>) {
        let [x, y, z] = self.state.vectors_mut::<3>(component_of(variable));
        for (lane, value) in values.into_iter().enumerate() {
            (x[lane], y[lane], z[lane]) = value.into();
        }
    }

    /// Sets a variable to a separate value for each ray.
    pub fn set_pairs(&mut self, variable: &str, values: impl IntoIterator<Item = Vec2>) {
        let [x, y] = self.state.vectors_mut::<2>(component_of(variable));
        for (lane, value) in values.into_iter().enumerate() {
            (x[lane], y[lane]) = value.into();
        }
    }

    /// Sets a direction, and the variables that depend on it.
    pub fn set_ray_directions(&mut self, directions: impl IntoIterator<Item = Vec3> + Clone) {
        let inverse = directions.clone().into_iter().map(Vec3::recip);
        self.set_vectors("rt_InverseRayDirection", inverse);
        self.set_vectors("rt_RayDirection", directions);
    }

    /// Sets a variable to a separate value for each ray.
    pub fn set_floats(&mut self, variable: &str, values: impl IntoIterator<Item = f32>) {
        let array = self.state.floats_mut(component_of(variable));
        array.iter_mut().zip(values).for_each(|(lane, value)| *lane = value);
    }

    /// Sets a variable for all rays.
    pub fn fill(&mut self, variable: &str, value: f32) {
        self.state.floats_mut(component_of(variable)).fill(value);
    }

    /// Sets a variable for all rays.
    pub fn fill_vector(&mut self, variable: &str, value: Vec3) {
        let arrays = self.state.vectors_mut::<3>(component_of(variable));
        arrays.into_iter().zip(value.to_array()).for_each(|(array, value)| array.fill(value));
    }

    /// Returns a variable of each ray.
    pub fn floats(&self, variable: &str) -> &[f32] {
        &self.state.floats(component_of(variable))[..self.count]
    }

    /// Returns a variable of each ray; the three components of a colour.
    pub fn vectors(&self, variable: &str) -> Vec<Vec3> {
        let first = component_of(variable);
        let [x, y, z] = [0, 1, 2].map(|component| self.state.floats(first + component));
        (0..self.count).map(|ray| Vec3::new(x[ray], y[ray], z[ray])).collect()
    }

    /// Returns a variable of each ray.
    pub fn pairs(&self, variable: &str) -> Vec<Vec2> {
        let first = component_of(variable);
        let [x, y] = [0, 1].map(|component| self.state.floats(first + component));
        (0..self.count).map(|ray| Vec2::new(x[ray], y[ray])).collect()
    }

    /// Returns a variable of one ray; the three components of a colour.
    pub fn vector(&self, variable: &str, ray: usize) -> Vec3 {
        let first = component_of(variable);
        Vec3::from_array([0, 1, 2].map(|component| self.state.floats(first + component)[ray]))
    }
}

/// A host that answers `rand()`, traces nothing and has no lights.
pub(crate) struct RandomHost {
    stream: Stream,
    /// The index of the first ray.
    first: u64,
    /// For each ray, the number of requests.
    requests: Vec<u32>,
}

impl RandomHost {
    pub fn new(stream: Stream, first: u64, count: usize) -> RandomHost {
        RandomHost { stream, first, requests: vec![0; count] }
    }
}

impl Host for RandomHost {
    fn rand(&mut self, lanes: LaneSet, values: &mut LaneFloats) {
        for lane in lanes.iter() {
            let ray = lanes.base as usize + lane;
            let dimension = SHADER_DIMENSION + self.requests[ray];
            values[lane] = self.stream.number(self.first + ray as u64, dimension);
            self.requests[ray] += 1;
        }
    }
}

/// Returns the first component of a state variable.
pub fn component_of(variable: &str) -> usize {
    lookup_state(variable).expect("a state variable").first_component as usize
}
