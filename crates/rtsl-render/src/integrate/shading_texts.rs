//! Texts of the library about the surfaces that materials shade, for hosts: stages contain the same.

use std::sync::Arc;

use rtsl::{Engine, HostFunction, LaneBlock};

use super::rows::BATCH_LANES;
use super::shaded_surface::ShadedSurface;

/// The texts. Threads share them.
#[derive(Debug)]
pub struct ShadingTexts {
    leave: HostFunction,
    lit_side: HostFunction,
    is_sample_in_cone: HostFunction,
}

/// The texts, with the arrays for calls of one thread.
pub struct ShadingCalls {
    texts: Arc<ShadingTexts>,
    arrays: LaneBlock,
}

/// The cone from which light is taken.
#[derive(Clone, Copy, Debug)]
pub struct Cone {
    /// Its axis, of any length.
    pub axis: [f32; 3],
    /// The least cosine between axis and light; -infinity for no cone.
    pub cosine: f32,
}

impl ShadingTexts {
    /// The texts for calls by an engine.
    pub fn new(engine: &Engine) -> ShadingTexts {
        let text = |name| HostFunction::new(engine, name, &[]);
        ShadingTexts {
            leave: text("rt_leave"),
            lit_side: text("rt_litSide"),
            is_sample_in_cone: text("rt_isSampleInCone"),
        }
    }
}

impl ShadingCalls {
    /// The greatest number of arrays of a call.
    const ARRAYS: usize = 16;

    /// Allocates the arrays.
    pub fn new(texts: &Arc<ShadingTexts>) -> ShadingCalls {
        let arrays = LaneBlock::new(ShadingCalls::ARRAYS, BATCH_LANES);
        ShadingCalls { texts: texts.clone(), arrays }
    }

    /// Returns the origin of a ray: if it begins on the surface that a material shades, off it.
    pub fn leave(
        &mut self,
        surface: Option<&ShadedSurface>,
        origin: [f32; 3],
        direction: [f32; 3],
    ) -> [f32; 3] {
        let Some(surface) = surface else { return origin };
        let mut left = origin;
        self.leave_all(1, |_| (*surface, origin, direction), |_, origin| left = origin);
        left
    }

    /// Computes the origins of so many rays, given the surfaces that materials shade, their origins and directions.
    pub fn leave_all(
        &mut self,
        count: usize,
        ray: impl Fn(usize) -> (ShadedSurface, [f32; 3], [f32; 3]),
        mut store: impl FnMut(usize, [f32; 3]),
    ) {
        for start in (0..count).step_by(BATCH_LANES) {
            let lanes = BATCH_LANES.min(count - start);
            for lane in 0..lanes {
                let (surface, origin, direction) = ray(start + lane);
                let numbers = [surface.point(), surface.normal()].into_iter().flatten();
                let ends = [origin, direction].into_iter().flatten();
                self.set(lane, numbers.chain([surface.offset]).chain(ends));
            }
            self.texts.leave.call(&mut self.arrays, lanes);
            for lane in 0..lanes {
                store(start + lane, [13, 14, 15].map(|array| self.arrays.floats(array)[lane]));
            }
        }
    }

    /// Returns the sides of surfaces, of these normals, for which light from cones is taken: 1 for that of the normal.
    pub fn lit_sides(&mut self, surfaces: impl Iterator<Item = ([f32; 3], Cone)>) -> &[f32] {
        let mut count = 0;
        for (normal, Cone { axis, cosine }) in surfaces {
            self.set(count, normal.into_iter().chain(axis).chain([cosine]));
            count += 1;
        }
        self.texts.lit_side.call(&mut self.arrays, count);
        &self.arrays.floats(7)[..count]
    }

    /// Tells of which samples of lights, with these directions and this radiance, light is taken from cones.
    pub fn are_in_cones(
        &mut self,
        samples: impl Iterator<Item = ([f32; 3], [f32; 3], Cone)>,
    ) -> impl Iterator<Item = bool> {
        let mut count = 0;
        for (direction, radiance, Cone { axis, cosine }) in samples {
            let sample = direction.into_iter().chain(radiance);
            self.set(count, sample.chain(axis).chain([cosine]));
            count += 1;
        }
        self.texts.is_sample_in_cone.call(&mut self.arrays, count);
        self.arrays.words(10)[..count].iter().map(|word| *word != 0)
    }

    /// Sets a lane of the first arrays.
    fn set(&mut self, lane: usize, numbers: impl Iterator<Item = f32>) {
        for (array, number) in numbers.enumerate() {
            self.arrays.floats_mut(array)[lane] = number;
        }
    }
}

#[cfg(test)]
mod tests {
    use rtsl::EngineOptions;

    use super::*;

    const UP: [f32; 3] = [0.0, 1.0, 0.0];

    fn calls() -> ShadingCalls {
        let engine = Engine::new(EngineOptions::default()).expect("an engine").0;
        ShadingCalls::new(&Arc::new(ShadingTexts::new(&engine)))
    }

    #[test]
    fn rays_that_begin_on_the_surface_leave_it() {
        let floor = ShadedSurface::new([1.0, 0.0, 2.0], 0.25, UP, [0.6, 0.8, 0.0]);
        let mut calls = calls();
        let mut leave = |origin, direction| calls.leave(Some(&floor), origin, direction);
        assert_eq!(leave([3.0, 0.125, 0.0], UP), [3.0, 0.375, 0.0]);
        assert_eq!(leave([3.0, 0.0, 0.0], [1.0, -1.0, 0.0]), [3.0, -0.25, 0.0]);
        let elsewhere = [3.0, 0.5, 0.0];
        assert_eq!(leave(elsewhere, UP), elsewhere);
        let nowhere = leave([f32::NAN, 0.0, 0.0], UP);
        assert!(nowhere[0].is_nan() && nowhere[1] == 0.0);
        assert_eq!(calls.leave(None, [3.0, 0.0, 0.0], UP), [3.0, 0.0, 0.0]);
        // More than fit into the arrays.
        let mut heights = vec![0.0; 2 * BATCH_LANES + 3];
        let ray = |index: usize| (floor, [0.0, (index % 2) as f32, 0.0], UP);
        calls.leave_all(heights.len(), ray, |index, [_, height, _]| heights[index] = height);
        let expected = |(index, height): (usize, &f32)| *height == [0.25, 1.0][index % 2];
        assert!(heights.iter().enumerate().all(expected));
    }

    #[test]
    fn cones_take_light_from_their_side() {
        let (mut calls, up) = (calls(), Cone { axis: [0.0, 2.0, 0.0], cosine: 0.5 });
        let down = Cone { axis: [0.0, -3.0, 0.0], ..up };
        let none = Cone { cosine: f32::NEG_INFINITY, ..down };
        let sides = calls.lit_sides([up, down, none].into_iter().map(|cone| (UP, cone)));
        assert_eq!(sides, [1.0, -1.0, 1.0]);
        let light = [1.0, 0.0, 0.0];
        let samples = [(light, up), (light, down), (light, none), ([0.0; 3], none)];
        let samples = samples.into_iter().map(|(radiance, cone)| (UP, radiance, cone));
        assert!(calls.are_in_cones(samples).eq([true, false, true, false]));
    }
}
