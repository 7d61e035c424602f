//! Requests to the host.

use rtsl_ir::host::{
    LaneColors, LaneFloats, LaneSet, LaneWords, LightLanes, LightQueryLanes, MAX_LANES, RayLanes,
};
use rtsl_ir::{Query, Scalar, Value};

use super::{Execution, Lanes};
use crate::kernel::{Op, OpKind, Ray};

impl Execution<'_> {
    pub(super) fn request(&mut self, op: &Op) {
        match &op.kind {
            OpKind::Trace { mask, ray, weight } => {
                let set = self.lane_set(*mask);
                let rays = RayLanes { weight: self.floats(*weight), ..self.ray_lanes(ray) };
                let mut radiance = LaneColors::default();
                self.host.trace(set, &rays, &mut radiance);
                self.define_answers(op.results.iter(), radiance.iter(), set.active);
            }
            OpKind::Occluded { mask, ray } => {
                let (set, rays) = (self.lane_set(*mask), self.ray_lanes(ray));
                let occluded = self.host.occluded(set, &rays) & set.active;
                self.values[op.results.get(0)] = mask_lanes(occluded);
            }
            OpKind::LightCount => {
                let count = self.host.light_count();
                self.define(op.results.get(0), |_, _| count);
            }
            OpKind::LightSample { mask, index, point, normal, cosine } => {
                let (set, index) = (self.lane_set(*mask), self.get(*index, 0));
                let query = LightQueryLanes {
                    point: point.map(|value| self.floats(value)),
                    normal: normal.map(|value| self.floats(value)),
                    cosine: self.floats(*cosine),
                };
                let mut light = LightLanes::default();
                let reached = self.host.light_sample(set, index, &query, &mut light) & set.active;
                let LightLanes { direction, distance, color, pdf } = &light;
                let answers = direction.iter().chain([distance]).chain(color).chain([pdf]);
                self.define_answers(op.results.iter().skip(1), answers, reached);
                self.zero_unless(op, reached);
                self.values[op.results.get(0)] = mask_lanes(reached);
            }
            OpKind::Ambient => {
                for (result, component) in op.results.iter().zip(self.host.ambient()) {
                    self.define(result, |_, _| component.to_bits());
                }
            }
            OpKind::Rand(mask) => {
                let set = self.lane_set(*mask);
                let mut numbers = LaneFloats::default();
                self.host.rand(set, &mut numbers);
                self.define_answers(op.results.iter(), [&numbers], set.active);
            }
            OpKind::Query { mask, query, operands } => self.query(op, *mask, *query, operands),
            OpKind::ReportBudget => self.outcome.budget_exceeded = true,
            other => unreachable!("{other:?} is no request"),
        }
    }

    fn query(&mut self, op: &Op, mask: Option<Value>, query: Query, operands: &[Value]) {
        // A query without a mask is for the whole chunk, of which one lane is enough.
        let set = mask.map_or(LaneSet { base: self.base, active: 1 }, |mask| self.lane_set(mask));
        let operands: Vec<LaneWords> = operands.iter().map(|it| self.values[*it]).collect();
        let mut answers = vec![[0; MAX_LANES]; op.results.count as usize];
        self.host.query_lanes(set, query, &operands, &mut answers);
        for (result, answer) in op.results.iter().zip(&answers) {
            let (scalar, uniform) = (self.scalar(result), mask.is_none());
            self.values[result] = std::array::from_fn(|lane| match set.active >> lane & 1 {
                _ if uniform => answer[0],
                0 => self.noise(scalar, lane),
                _ => answer[lane],
            });
        }
    }

    fn lane_set(&self, mask: Value) -> LaneSet {
        LaneSet { base: self.base, active: self.lanes_of(mask) }
    }

    fn ray_lanes(&self, ray: &Ray) -> RayLanes {
        RayLanes {
            origin: ray.origin.map(|value| self.floats(value)),
            direction: ray.direction.map(|value| self.floats(value)),
            limit: self.floats(ray.limit),
            weight: LaneFloats::default(),
        }
    }

    fn floats(&self, value: Value) -> LaneFloats {
        self.values[value].map(f32::from_bits)
    }

    /// Defines the results in the lanes that were answered; the others are unspecified.
    fn define_answers<'b>(
        &mut self,
        results: impl Iterator<Item = Value>,
        answers: impl IntoIterator<Item = &'b LaneFloats>,
        answered: u32,
    ) {
        for (result, answer) in results.zip(answers) {
            let noise = |lane| self.noise(Scalar::F32, lane);
            let is_answered = |lane: usize| answered >> lane & 1 != 0;
            let bits = |lane| if is_answered(lane) { answer[lane].to_bits() } else { noise(lane) };
            self.values[result] = std::array::from_fn(bits);
        }
    }

    /// Lights that do not reach a point read as zero there.
    fn zero_unless(&mut self, op: &Op, reached: u32) {
        for result in op.results.iter() {
            for (lane, bits) in self.values[result].iter_mut().enumerate() {
                *bits *= reached >> lane & 1;
            }
        }
    }
}

fn mask_lanes(on: u32) -> Lanes {
    std::array::from_fn(|lane| on >> lane & 1)
}
