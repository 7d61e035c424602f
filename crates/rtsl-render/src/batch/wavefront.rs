//! The paths of a wave.

use super::features::PathFeatures;

/// Samples of a pixel that a wave takes: with 64 pixels a thousand paths, whose memory caches hold.
pub const SAMPLES_IN_WAVE: u32 = 16;

/// A path on its way: what is known of it between surfaces. Two lines of a cache each; what is read together lies
/// in fours.
#[repr(C, align(64))]
#[derive(Clone, Copy, Debug)]
pub struct Path {
    /// Where its ray begins, in world space.
    pub origin: [f32; 3],
    /// The least parameter of a hit (exclusive).
    pub epsilon: f32,
    /// Where its ray goes; of unit length unless a camera made it.
    pub direction: [f32; 3],
    /// The greatest parameter of a hit (exclusive); of the hit, once that is found.
    pub distance: f32,
    /// The greatest parameter of a hit, for good.
    pub limit: f32,
    /// What radiance along its ray is multiplied with.
    pub throughput: [f32; 3],
    /// The density of its direction per solid angle; 0 if it was not chosen by a density.
    pub density: f32,
    /// What it brought back so far.
    pub radiance: [f32; 3],
    /// The time within the shutter.
    pub time: f32,
    /// How wide its ray is where it begins.
    pub width: f32,
    /// How much wider after a unit of length.
    pub spread: f32,
    /// Which sequence of numbers it has.
    pub key: u32,
    /// Which sample of its pixel it is.
    pub sample: u32,
    /// The normals where its ray begins, on the side that its last ray came from, in world space.
    pub geometric_normal: [f32; 3],
    /// The one for shading.
    pub shading_normal: [f32; 3],
    /// Whether it was said already whose values are not finite in what it brings back.
    pub is_blamed: bool,
}

impl Path {
    /// One that goes nowhere.
    pub const NOWHERE: Path = Path {
        origin: [0.0; 3],
        epsilon: 0.0,
        direction: [0.0, 0.0, 1.0],
        distance: f32::INFINITY,
        limit: f32::INFINITY,
        throughput: [1.0; 3],
        density: 0.0,
        radiance: [0.0; 3],
        time: 0.0,
        width: 0.0,
        spread: 0.0,
        geometric_normal: [0.0, 0.0, 1.0],
        shading_normal: [0.0, 0.0, 1.0],
        key: 0,
        sample: 0,
        is_blamed: false,
    };
}

/// What a ray hits, in the scene's terms.
#[derive(Clone, Copy, Debug, Default)]
pub struct PathHit {
    /// The index of the path.
    pub path: u32,
    /// The object.
    pub object: u32,
    /// Which of its elements.
    pub element: u32,
    /// The instance that places it; [`NO_INSTANCE`] for the world.
    pub instance: u32,
}

/// Instead of an instance: the world.
pub const NO_INSTANCE: u32 = u32::MAX;

/// Paths that are traced together, with memory for what is known of them.
#[derive(Default)]
pub struct Wavefront {
    /// The paths.
    pub paths: Vec<Path>,
    /// What their first surfaces are, if that is asked for; else none.
    pub features: Vec<PathFeatures>,
    /// Those whose rays have still to be traced, by their index.
    pub active: Vec<u32>,
    /// Those whose rays left the scene.
    pub left: Vec<u32>,
    /// The hits of the others, as they were found.
    pub hits: Vec<(u32, PathHit)>,
    /// The same, sorted by group.
    pub sorted: Vec<PathHit>,
    /// For each group the end of its hits among the sorted.
    pub ends: Vec<usize>,
}

impl Wavefront {
    /// Sorts the hits by their groups, of which there are so many; within a group they keep their order.
    pub fn sort(&mut self, groups: usize) {
        self.ends.clear();
        self.ends.resize(groups, 0);
        for (group, _) in &self.hits {
            self.ends[*group as usize] += 1;
        }
        let mut next = 0;
        for end in &mut self.ends {
            (*end, next) = (next, next + *end);
        }
        self.sorted.clear();
        self.sorted.resize(self.hits.len(), PathHit::default());
        for (group, hit) in &self.hits {
            let place = &mut self.ends[*group as usize];
            self.sorted[*place] = *hit;
            *place += 1;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn hits_are_sorted_by_group_and_keep_their_order() {
        let hits = [2, 0, 2, 1, 0].into_iter().zip(0..);
        let hits = hits.map(|(group, path)| (group, PathHit { path, ..PathHit::default() }));
        let mut wave = Wavefront { hits: hits.collect(), ..Wavefront::default() };
        wave.sort(4);
        let paths: Vec<u32> = wave.sorted.iter().map(|hit| hit.path).collect();
        assert_eq!(
            (paths.as_slice(), wave.ends.as_slice()),
            ([1, 4, 3, 0, 2].as_slice(), [2, 3, 5, 5].as_slice())
        );
        assert_eq!(size_of::<Path>(), 128);
    }
}
