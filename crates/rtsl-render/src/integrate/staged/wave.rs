//! The data of a wavefront's paths beside their frames.

use rtsl::{END, RayType};

use super::columns::Columns;
use super::frames::{Blocks, Frames};
use super::spawning::Spawning;
use super::staged_method::StagedMethod;
use crate::compiled::variables::variables;
use crate::integrate::host::RayOfCall;
use crate::integrate::spawned_paths::SpawnedPaths;
use crate::integrate::wavefront::Path;

/// The data of a wavefront's paths beside their frames, by path: these are not moved to other lanes.
#[derive(Default)]
pub struct Wave {
    /// The number of paths.
    pub count: usize,
    /// The number of lanes in which they are.
    pub lanes: usize,
    /// The distances and the objects of the first surfaces, if they are kept; `None` without a hit.
    pub first_hits: Vec<Option<(f32, f32)>>,
    /// The state of requests, which hosts answer; empty if no kernel asks a host.
    pub rays: Vec<RayOfCall>,
    /// The state on which spawned rays and calls of `shade` depend.
    pub spawning: Spawning,
    /// The index of the object for which stages without a surface are called; empty if there is one for all.
    pub objects: Vec<u32>,
}

/// A component of state, with its value for a path's ray, to read and to write.
type RayComponent = (usize, fn(&Path) -> f32, fn(&mut Path) -> &mut f32);

/// Returns the components of state with a path's ray.
pub fn ray_components() -> [RayComponent; 11] {
    let v = variables();
    [
        (v.ray_origin, |path| path.origin[0], |path| &mut path.origin[0]),
        (v.ray_origin + 1, |path| path.origin[1], |path| &mut path.origin[1]),
        (v.ray_origin + 2, |path| path.origin[2], |path| &mut path.origin[2]),
        (v.ray_direction, |path| path.direction[0], |path| &mut path.direction[0]),
        (v.ray_direction + 1, |path| path.direction[1], |path| &mut path.direction[1]),
        (v.ray_direction + 2, |path| path.direction[2], |path| &mut path.direction[2]),
        (v.epsilon, |path| path.epsilon, |path| &mut path.epsilon),
        (v.hit_distance, |path| path.limit, |path| &mut path.limit),
        (v.time_seed, |path| path.time, |path| &mut path.time),
        (v.ray_width, |path| path.width, |path| &mut path.width),
        (v.ray_spread, |path| path.spread, |path| &mut path.spread),
    ]
}

/// Copies the items with these indices.
fn gather<T: Copy>(from: &[T], indices: &[u32], to: &mut [T]) {
    to.iter_mut().zip(indices).for_each(|(to, index)| *to = from[*index as usize]);
}

impl Wave {
    /// Begins a number of paths of this depth, which have no rays and no weights yet.
    pub fn begin(&mut self, frames: &mut Frames, staged: &StagedMethod, count: usize, depth: u32) {
        let columns = &staged.columns;
        let Wave { first_hits, rays, spawning, objects, .. } = self;
        first_hits.clear();
        rays.clear();
        spawning.begin(if staged.spawns() || depth > 0 { count } else { 0 });
        objects.clear();
        (self.count, self.lanes) = (count, count);
        let counts = [columns.drawn, columns.searches, columns.shadow_rays, columns.children];
        for array in columns.counts.into_iter().chain(counts).chain(columns.lit) {
            frames.paths.scratch.words_mut(array)[..count].fill(0);
        }
        frames.paths.scratch.words_mut(columns.next)[..count].fill(END.cast_unsigned());
        let state = &mut frames.paths.state;
        state.floats_mut(variables().ray_depth)[..count].fill(depth as f32);
        state.floats_mut(variables().ray_type)[..count].fill(RayType::of(depth, 0).value());
    }

    /// Has the first hits of the paths kept.
    pub fn keep_first_hits(&mut self) {
        self.first_hits.resize(self.count, None);
    }

    /// Sets the weights of all paths to 1.
    pub fn begin_weights(&self, frames: &mut Frames, columns: &Columns) {
        for array in columns.weights {
            frames.paths.scratch.floats_mut(array)[..self.count].fill(1.0);
        }
    }

    /// Loads the rays of paths.
    pub fn load_paths(&mut self, frames: &mut Frames, columns: &Columns, paths: &[Path]) {
        let state = &mut frames.paths.state;
        for (component, value, _) in ray_components() {
            let floats = state.floats_mut(component).iter_mut();
            floats.zip(paths).for_each(|(to, path)| *to = value(path));
        }
        let Columns { time, key, sample, .. } = *columns;
        let scratch = &mut frames.paths.scratch;
        let mut set = |array: usize, word: fn(&Path) -> u32| {
            let words = scratch.words_mut(array).iter_mut();
            words.zip(paths).for_each(|(to, path)| *to = word(path));
        };
        set(time, |path| path.time.to_bits());
        set(key, |path| path.key);
        set(sample, |path| path.sample);
        let [red, green, blue] = columns.weights;
        set(red, |path| path.throughput[0].to_bits());
        set(green, |path| path.throughput[1].to_bits());
        set(blue, |path| path.throughput[2].to_bits());
        let bounds = self.spawning.importance.iter_mut();
        bounds.zip(paths).for_each(|(to, path)| *to = path.importance);
    }

    /// Begins what hosts know of the paths.
    pub fn begin_rays(&mut self, frames: &Frames, columns: &Columns) {
        let scratch = &frames.paths.scratch;
        let (keys, samples) = (scratch.words(columns.key), scratch.words(columns.sample));
        let times = scratch.floats(columns.time);
        let weights = columns.weights.map(|array| scratch.floats(array));
        let ray = |path: usize| RayOfCall {
            importance: self.spawning.importance_of(path),
            throughput: weights.map(|weights| weights[path]),
            ..RayOfCall::new(keys[path], samples[path], times[path])
        };
        self.rays.extend((0..self.count).map(ray));
    }

    /// Loads the rays of spawned paths, of which these are the indices, for hits at this distance at least.
    pub fn load_spawned(
        &mut self,
        frames: &mut Frames,
        columns: &Columns,
        spawned: &SpawnedPaths,
        indices: &[u32],
        epsilon: f32,
    ) {
        let Blocks { state, scratch } = &mut frames.paths;
        let count = indices.len();
        let v = variables();
        let floats = |from: &[f32], to: &mut [f32]| gather(from, indices, to);
        let words = |from: &[u32], to: &mut [u32]| gather(from, indices, to);
        let [origin @ .., limit] = &spawned.ends;
        for axis in 0..3 {
            floats(&origin[axis], state.floats_mut(v.ray_origin + axis));
            floats(&origin[3 + axis], state.floats_mut(v.ray_direction + axis));
            floats(&spawned.throughput[axis], scratch.floats_mut(columns.weights[axis]));
        }
        floats(limit, state.floats_mut(v.hit_distance));
        state.floats_mut(v.epsilon)[..count].fill(epsilon);
        state.floats_mut(v.ray_width)[..count].fill(0.0);
        state.floats_mut(v.ray_spread)[..count].fill(0.0);
        floats(&spawned.times, state.floats_mut(v.time_seed));
        floats(&spawned.times, scratch.floats_mut(columns.time));
        words(&spawned.keys, scratch.words_mut(columns.key));
        words(&spawned.samples, scratch.words_mut(columns.sample));
        floats(&spawned.importance, &mut self.spawning.importance);
    }

    /// Returns the path of a loaded ray, without its weight.
    pub fn path(&self, frames: &Frames, columns: &Columns, path: u32) -> Path {
        let Blocks { state, scratch } = &frames.paths;
        let at = path as usize;
        let mut made = Path {
            key: scratch.words(columns.key)[at],
            sample: scratch.words(columns.sample)[at],
            importance: self.spawning.importance_of(at),
            ..Path::NOWHERE
        };
        for (component, _, number) in ray_components() {
            *number(&mut made) = state.floats(component)[at];
        }
        made
    }
}
