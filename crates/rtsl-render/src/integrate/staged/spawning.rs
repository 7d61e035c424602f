//! The state of paths on which the rays and the calls of `shade` that they spawn depend.

use std::ops::Range;

use rtsl_math::sampling::child_key;

use crate::integrate::numbers::{Purpose, count_after, sequence_key};

/// The state on which the rays and the calls of `shade` that paths spawn depend, by path.
#[derive(Default)]
pub struct Spawning {
    /// Bounds of the weights of the paths' radiance in their pixels; 1 for paths that are missing here.
    pub importance: Vec<f32>,
    /// True for paths that received light that was not finite, whose cause was reported.
    pub is_spoilt: Vec<bool>,
    /// The numbers of rays traced by `trace()`.
    children: Vec<u32>,
    /// The counts of calls of `shade`, from a multiple for each search on.
    shades: Vec<u32>,
}

impl Spawning {
    /// Returns a bound of the weight of a path's radiance in its pixel.
    pub fn importance_of(&self, path: usize) -> f32 {
        self.importance.get(path).copied().unwrap_or(1.0)
    }

    /// Sets the weights in the pixel of what some lanes spawn with these weights. `paths` has the index of the path in
    /// each lane, unless it is that of the lane.
    pub fn weigh(
        &self,
        bounds: &[f32],
        paths: Option<&[u32]>,
        lanes: Range<usize>,
        weights: &mut Vec<f32>,
    ) {
        weights.resize(bounds.len(), 0.0);
        let all = weights[lanes.clone()].iter_mut().zip(&bounds[lanes.clone()]);
        match paths {
            None if self.importance.len() >= bounds.len() => {
                all.zip(&self.importance[lanes]).for_each(|((to, bound), own)| *to = own * bound);
            }
            None => all.for_each(|(to, bound)| *to = *bound),
            Some(paths) => all.zip(&paths[lanes]).for_each(|((to, bound), path)| {
                *to = self.importance_of(*path as usize) * bound;
            }),
        }
    }

    /// Begins a number of paths.
    pub fn begin(&mut self, count: usize) {
        let Spawning { importance, is_spoilt, children, shades } = self;
        importance.clear();
        importance.resize(count, 1.0);
        is_spoilt.clear();
        is_spoilt.resize(count, false);
        for counts in [children, shades] {
            counts.clear();
            counts.resize(count, 0);
        }
    }

    /// Returns the key of the path of the next ray that `trace()` traces, given that of its parent.
    pub fn begin_child(&mut self, path: usize, key: u32) -> u32 {
        let children = &mut self.children[path];
        *children = children.wrapping_add(1);
        child_key(key, *children)
    }

    /// Begins the sequences of what follows a search.
    pub fn begin_search(&mut self, path: usize, searches: u32) {
        self.shades[path] = count_after(searches);
    }

    /// Returns the key of the sequence of the next call of `shade`, given that of the path.
    pub fn begin_shade(&mut self, path: usize, key: u32) -> u32 {
        let shades = &mut self.shades[path];
        *shades = shades.wrapping_add(1);
        sequence_key(key, Purpose::Shade, *shades)
    }
}
