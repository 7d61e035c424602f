//! Paths of rays that other paths have spawned.
//!
//! Methods that trace rays do not wait for them where their colour is affine in what comes back: each ray becomes a
//! path, at the next depth, with the product of the weights on the way to it. The light of a sample is the sum of the
//! light of its paths, depth by depth, and within a depth in the order of their parents, then of the rays of a parent.

use std::collections::BTreeSet;

use super::rows::all_finite;
use super::wavefront::Path;

/// A path that another one, its parent, spawns.
#[derive(Clone, Copy, Debug)]
pub struct SpawnedPath {
    /// The index of the parent.
    pub parent: u32,
    /// The depth of its ray.
    pub depth: u32,
    /// The origin of its ray, off the surface that it leaves.
    pub origin: [f32; 3],
    /// The direction of its ray.
    pub direction: [f32; 3],
    /// The greatest parameter of a hit.
    pub limit: f32,
    /// The weight of its radiance.
    pub throughput: [f32; 3],
    /// A bound of the weight in the pixel.
    pub importance: f32,
    /// The key of its random sequences.
    pub key: u32,
    /// The time within the shutter.
    pub time: f32,
    /// The index of the sample.
    pub sample: u32,
}

impl SpawnedPath {
    /// Returns its state before it is traced, for hits at this distance at least.
    pub fn path(&self, epsilon: f32) -> Path {
        let SpawnedPath { origin, direction, limit, throughput, .. } = *self;
        let SpawnedPath { importance, key, time, sample, .. } = *self;
        Path {
            origin,
            direction,
            epsilon,
            distance: limit,
            limit,
            throughput,
            importance,
            key,
            time,
            sample,
            ..Path::NOWHERE
        }
    }
}

/// The greatest number of paths of one depth that wait together: about 150 MB. A loop in a method may spawn any number.
pub const MAX_SPAWNED: usize = 1 << 21;

/// Spawned paths, component by component.
#[derive(Debug, Default)]
pub struct SpawnedPaths {
    /// The indices of the parents.
    pub parents: Vec<u32>,
    /// The depths of the rays.
    pub depths: Vec<u32>,
    /// Origin, direction and limit of the rays.
    pub ends: [Vec<f32>; 7],
    /// The weights of radiance.
    pub throughput: [Vec<f32>; 3],
    /// Bounds of the weights in the pixel.
    pub importance: Vec<f32>,
    /// The keys of random sequences.
    pub keys: Vec<u32>,
    /// The times within the shutter.
    pub times: Vec<f32>,
    /// The indices of samples.
    pub samples: Vec<u32>,
}

impl SpawnedPaths {
    /// Returns the number of paths.
    pub fn len(&self) -> usize {
        self.parents.len()
    }

    /// True without paths.
    pub fn is_empty(&self) -> bool {
        self.parents.is_empty()
    }

    /// Adds a path.
    pub fn push(&mut self, path: &SpawnedPath) {
        let SpawnedPath { origin, direction, limit, .. } = *path;
        self.parents.push(path.parent);
        self.depths.push(path.depth);
        let ends = origin.into_iter().chain(direction).chain([limit]);
        self.ends.iter_mut().zip(ends).for_each(|(column, number)| column.push(number));
        let weights = self.throughput.iter_mut().zip(path.throughput);
        weights.for_each(|(column, weight)| column.push(weight));
        self.importance.push(path.importance);
        self.keys.push(path.key);
        self.times.push(path.time);
        self.samples.push(path.sample);
    }

    /// Removes all paths.
    pub fn clear(&mut self) {
        let SpawnedPaths { parents, depths, ends, throughput, importance, keys, times, samples } =
            self;
        ends.iter_mut().chain(throughput).chain([importance, times]).for_each(Vec::clear);
        [parents, depths, keys, samples].into_iter().for_each(Vec::clear);
    }

    /// Appends the paths of others, whose parents have the indices that `parent` maps theirs to.
    pub fn append(&mut self, others: &mut SpawnedPaths, parent: impl Fn(u32) -> u32) {
        self.parents.extend(others.parents.drain(..).map(parent));
        self.depths.append(&mut others.depths);
        let ends = self.ends.iter_mut().chain(&mut self.throughput);
        let of_others = others.ends.iter_mut().chain(&mut others.throughput);
        ends.zip(of_others).for_each(|(to, from)| to.append(from));
        self.importance.append(&mut others.importance);
        self.keys.append(&mut others.keys);
        self.times.append(&mut others.times);
        self.samples.append(&mut others.samples);
    }

    /// Returns the parents of paths, from `first` on, whose weights are not finite, each once.
    pub fn lost_parents(&self, first: usize) -> Vec<u32> {
        if self.throughput.iter().all(|weights| all_finite(&weights[first..])) {
            return Vec::new();
        }
        let is_lost = |index: &usize| self.throughput.iter().any(|it| !it[*index].is_finite());
        let lost = (first..self.len()).filter(is_lost).map(|index| self.parents[index]);
        lost.collect::<BTreeSet<u32>>().into_iter().collect()
    }

    /// Returns a path.
    pub fn get(&self, index: usize) -> SpawnedPath {
        let [ox, oy, oz, dx, dy, dz, limit] = self.ends.each_ref().map(|column| column[index]);
        SpawnedPath {
            parent: self.parents[index],
            depth: self.depths[index],
            origin: [ox, oy, oz],
            direction: [dx, dy, dz],
            limit,
            throughput: self.weights(index),
            importance: self.importance[index],
            key: self.keys[index],
            time: self.times[index],
            sample: self.samples[index],
        }
    }

    /// Returns the weights of a path's radiance.
    pub fn weights(&self, index: usize) -> [f32; 3] {
        self.throughput.each_ref().map(|column| column[index])
    }
}

/// Returns the greatest magnitude of a weight, as kernels compute it.
pub fn greatest_weight(weight: [f32; 3]) -> f32 {
    let larger = |a: f32, b: f32| if a > b { a } else { b };
    let [red, green, blue] = weight.map(f32::abs);
    larger(larger(red, green), blue)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn paths_are_appended_with_other_parents() {
        let path = |parent: u32| SpawnedPath {
            parent,
            depth: 1,
            origin: [0.0; 3],
            direction: [1.0; 3],
            limit: parent as f32,
            throughput: [1.0; 3],
            importance: 1.0,
            key: 0,
            time: 0.0,
            sample: 0,
        };
        let (mut paths, mut all) = (SpawnedPaths::default(), SpawnedPaths::default());
        [3, 1, 3].into_iter().for_each(|parent| paths.push(&path(parent)));
        all.push(&path(7));
        all.append(&mut paths, |parent| parent / 2);
        assert!(paths.is_empty() && all.parents == [7, 1, 0, 1]);
        assert_eq!(all.get(3).path(0.5).limit, 3.0);
    }

    #[test]
    fn the_greatest_weight_is_a_magnitude() {
        assert_eq!(greatest_weight([-2.0, 1.0, 0.5]), 2.0);
        assert_eq!(greatest_weight([0.0, 1.0, -3.0]), 3.0);
        assert!(greatest_weight([0.0, 1.0, f32::NAN]).is_nan());
    }
}
