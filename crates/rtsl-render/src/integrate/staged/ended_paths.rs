//! The light and the radiance of paths that have ended.

use super::frames::Blocks;
use super::path_set::PathSet;
use super::run::StagedPaths;
use crate::compiled::variables::variables;
use crate::integrate::rows::{all_finite, are_finite};

impl StagedPaths<'_> {
    /// Returns in `colors` the light of all paths without their weights. Their colours are at component `first` of the
    /// state.
    pub fn light(&self, first: usize, colors: &mut [[f32; 3]]) {
        for channel in 0..3 {
            let all = colors.iter_mut().map(|color| &mut color[channel]);
            all.zip(self.channel_of_light(first, channel))
                .for_each(|(to, light)| *to = 0.0 + light);
        }
    }

    /// Returns in `radiance` that of all paths.
    pub fn radiance(&self, radiance: &mut [[f32; 3]]) {
        for channel in 0..3 {
            let all = radiance.iter_mut().map(|radiance| &mut radiance[channel]);
            all.zip(self.channel_of_radiance(channel)).for_each(|(to, radiance)| *to = radiance);
        }
    }

    /// Returns in `radiance` that of some paths, channel by channel; black for the others.
    pub fn radiance_of(&self, paths: &PathSet, radiance: &mut [Vec<f32>; 3]) {
        for (channel, to) in radiance.iter_mut().enumerate() {
            let all = to.iter_mut().zip(self.channel_of_radiance(channel));
            all.for_each(|(to, radiance)| *to = radiance);
            paths.clear_others(to);
        }
    }

    /// Returns the paths whose radiance, channel by channel, is not finite though their weights are.
    pub fn lost(&self, paths: &PathSet, radiance: &[Vec<f32>; 3]) -> impl Iterator<Item = u32> {
        let is_any = !radiance.iter().all(|channel| all_finite(channel));
        let is_lost = |path: &u32| {
            let path = *path as usize;
            let scratch = &self.frames.paths.scratch;
            let weight = self.staged.columns.weights.map(|array| scratch.floats(array)[path]);
            let radiance = radiance.each_ref().map(|channel| channel[path]);
            !are_finite(&radiance) && are_finite(&weight)
        };
        let paths = is_any.then(|| paths.paths());
        paths.unwrap_or_default().iter().copied().filter(is_lost)
    }

    /// Returns a channel of the radiance of paths: their light, weighted.
    fn channel_of_radiance(&self, channel: usize) -> impl Iterator<Item = f32> {
        let light = self.channel_of_light(variables().sample_color, channel);
        let weights = self.frames.paths.scratch.floats(self.staged.columns.weights[channel]);
        // A sum with 0 has no negative zeros.
        light.zip(weights).map(|(light, weight)| 0.0 + weight * light)
    }

    /// Returns a channel of the light of paths, whose colours are at component `first` of the state.
    fn channel_of_light(&self, first: usize, channel: usize) -> impl Iterator<Item = f32> {
        let Blocks { state, scratch } = &self.frames.paths;
        let colors = state.floats(first + channel).iter();
        let lights = scratch.floats(self.staged.columns.lit[channel]);
        colors.zip(lights).map(|(color, light)| color + light)
    }
}
