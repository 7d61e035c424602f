//! A host that answers every ray alike.

use crate::host::{Host, LaneColors, LaneFloats, LaneSet, LightLanes, LightQueryLanes, RayLanes};

/// A host that answers every ray alike, for tools that call single methods without a scene.
///
/// ```
/// use rtsl_ir::host::{Host, PlainHost};
///
/// let mut host = PlainHost { ambient: [0.1; 3], ..PlainHost::default() };
/// assert_eq!((host.ambient(), host.light_count()), ([0.1; 3], 0));
/// ```
#[derive(Clone, Debug, Default, PartialEq)]
pub struct PlainHost {
    /// The radiance along every ray.
    pub trace: [f32; 3],
    /// True if every ray is occluded.
    pub occluded: bool,
    /// Ambient light.
    pub ambient: [f32; 3],
    /// The value of `rand()`.
    pub rand: f32,
    /// The lights of `illuminance`.
    pub lights: Vec<PlainLight>,
}

/// A light that is the same at every point.
#[derive(Clone, Debug, PartialEq)]
pub struct PlainLight {
    /// The unit vector towards it.
    pub direction: [f32; 3],
    /// Its distance.
    pub distance: f32,
    /// Its radiance, or the whole contribution if the density is 0.
    pub color: [f32; 3],
    /// The density per solid angle; 0 for a delta.
    pub pdf: f32,
}

impl Host for PlainHost {
    fn trace(&mut self, _: LaneSet, _: &RayLanes, radiance: &mut LaneColors) {
        for (component, value) in radiance.iter_mut().zip(self.trace) {
            component.fill(value);
        }
    }

    fn occluded(&mut self, lanes: LaneSet, _: &RayLanes) -> u32 {
        if self.occluded { lanes.active } else { 0 }
    }

    fn light_count(&mut self) -> u32 {
        self.lights.len() as u32
    }

    fn light_sample(
        &mut self,
        lanes: LaneSet,
        index: u32,
        query: &LightQueryLanes,
        light: &mut LightLanes,
    ) -> u32 {
        let Some(source) = self.lights.get(index as usize) else { return 0 };
        let mut reached = 0;
        for lane in lanes.iter() {
            let normal = query.normal.each_ref().map(|component| component[lane]);
            if !is_within(source.direction, normal, query.cosine[lane]) {
                continue;
            }
            reached |= 1 << lane;
            for axis in 0..3 {
                light.direction[axis][lane] = source.direction[axis];
                light.color[axis][lane] = source.color[axis];
            }
            light.distance[lane] = source.distance;
            light.pdf[lane] = source.pdf;
        }
        reached
    }

    fn ambient(&mut self) -> [f32; 3] {
        self.ambient
    }

    fn rand(&mut self, _: LaneSet, values: &mut LaneFloats) {
        values.fill(self.rand);
    }
}

/// True if the angle between a unit vector and an axis has at least this cosine.
fn is_within(direction: [f32; 3], axis: [f32; 3], cosine: f32) -> bool {
    if cosine == f32::NEG_INFINITY {
        return true;
    }
    let dot = |a: [f32; 3], b: [f32; 3]| a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
    dot(direction, axis) >= cosine * dot(axis, axis).sqrt()
}
