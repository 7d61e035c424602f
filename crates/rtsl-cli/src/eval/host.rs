//! A host that answers every ray alike.

use rtsl::host::{Host, LaneColors, LaneFloats, LaneSet, LightLanes, LightQueryLanes, RayLanes};

use super::request::HostRequest;

/// Answers with the values of the request.
pub struct PlainHost<'a>(pub &'a HostRequest);

impl Host for PlainHost<'_> {
    fn trace(&mut self, _: LaneSet, _: &RayLanes, radiance: &mut LaneColors) {
        for (component, value) in radiance.iter_mut().zip(self.0.trace) {
            component.fill(value);
        }
    }

    fn occluded(&mut self, lanes: LaneSet, _: &RayLanes) -> u32 {
        if self.0.occluded { lanes.active } else { 0 }
    }

    fn light_count(&mut self) -> u32 {
        self.0.lights.len() as u32
    }

    fn light_sample(
        &mut self,
        lanes: LaneSet,
        index: u32,
        query: &LightQueryLanes,
        light: &mut LightLanes,
    ) -> u32 {
        let Some(source) = self.0.lights.get(index as usize) else { return 0 };
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
        self.0.ambient
    }

    fn rand(&mut self, _: LaneSet, values: &mut LaneFloats) {
        values.fill(self.0.rand);
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
