//! Values of a function's variables, and a host, for generated functions.

use rtsl_ir::evaluate::CANONICAL_NAN;
use rtsl_ir::host::{Host, LaneColors, LaneFloats, LaneSet, LightLanes, LightQueryLanes, RayLanes};
use rtsl_ir::{Constant, Effect, Function, Query, Scalar, Storage, VariableId, VariableKind};
use rtsl_spec::COLOR_COMPONENTS;

use super::Entropy;
use super::entropy::mix;

/// The variables of one function for one ray, in vectors.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Memory {
    variables: Vec<PlaceMemory>,
}

#[derive(Clone, Debug, PartialEq, Eq)]
struct PlaceMemory {
    scalar: Scalar,
    elements: u32,
    bits: Vec<u32>,
}

impl Memory {
    /// Returns storage for the variables of `function` except locals, filled from the bytes.
    pub fn new(function: &Function, entropy: &mut Entropy<'_>) -> Self {
        let variables = function.variables.iter().map(|variable| {
            let elements =
                if variable.kind == VariableKind::Buffer { entropy.below(5) as u32 } else { 1 };
            let count =
                if variable.kind == VariableKind::Local { 0 } else { variable.len * elements };
            let bits = (0..count).map(|_| entropy.constant(variable.scalar).bits()).collect();
            PlaceMemory { scalar: variable.scalar, elements, bits }
        });
        Memory { variables: variables.collect() }
    }

    /// Returns the scalars of a variable.
    pub fn bits(&self, variable: VariableId) -> &[u32] {
        &self.variables[variable.0 as usize].bits
    }

    /// Returns all scalars as constants; NaNs are canonicalised, since their payloads are unspecified.
    pub fn snapshot(&self) -> Vec<Vec<Constant>> {
        let snapshot = |variable: &PlaceMemory| {
            let constants =
                variable.bits.iter().map(|bits| Constant::from_bits(variable.scalar, *bits));
            constants.map(canonical).collect()
        };
        self.variables.iter().map(snapshot).collect()
    }
}

impl Storage for Memory {
    fn load(&self, variable: VariableId, index: u32) -> u32 {
        self.variables[variable.0 as usize].bits[index as usize]
    }

    fn elements(&self, buffer: VariableId) -> u32 {
        self.variables[buffer.0 as usize].elements
    }

    fn store(&mut self, variable: VariableId, component: u32, bits: u32) {
        self.variables[variable.0 as usize].bits[component as usize] = bits;
    }
}

/// A host whose answers are hashes of the request with its weight, the ray and the number of previous requests of the
/// ray.
#[derive(Clone, Debug, Default)]
pub struct HashHost {
    /// The number of requests so far of each ray.
    requests: Vec<u32>,
    ignores_weights: bool,
}

/// The number of lights of a [`HashHost`].
const LIGHTS: u32 = 3;

impl HashHost {
    /// Returns a host whose answers do not depend on the weights of traced rays, like those of renderers.
    pub fn ignoring_weights() -> Self {
        HashHost { ignores_weights: true, ..HashHost::default() }
    }

    /// Returns a hash for the next request of the ray in `lane`.
    fn next(&mut self, lanes: LaneSet, lane: usize, request: &[f32]) -> u64 {
        let request = request.iter().map(|value| Constant::F32(*value));
        hash(self.count(lanes.base as usize + lane), request)
    }

    /// Counts a request of a ray; returns a hash of ray and count.
    fn count(&mut self, ray: usize) -> u64 {
        if self.requests.len() <= ray {
            self.requests.resize(ray + 1, 0);
        }
        self.requests[ray] += 1;
        mix(ray as u64) ^ u64::from(self.requests[ray])
    }

    fn next_ray(
        &mut self,
        lanes: LaneSet,
        lane: usize,
        rays: &RayLanes,
        weight: Option<&LaneFloats>,
    ) -> u64 {
        let vectors = rays.origin.iter().chain(&rays.direction).chain([&rays.limit]);
        let request: Vec<f32> = vectors.chain(weight).map(|values| values[lane]).collect();
        self.next(lanes, lane, &request)
    }
}

impl Host for HashHost {
    fn trace(&mut self, lanes: LaneSet, rays: &RayLanes, radiance: &mut LaneColors) {
        for lane in lanes.iter() {
            let weight = (!self.ignores_weights).then_some(&rays.weight);
            let hash = self.next_ray(lanes, lane, rays, weight);
            for (component, values) in radiance.iter_mut().enumerate() {
                values[lane] = unit(hash, component);
            }
        }
    }

    fn occluded(&mut self, lanes: LaneSet, rays: &RayLanes) -> u32 {
        lanes.iter().fold(0, |mask, lane| {
            let occluded = self.next_ray(lanes, lane, rays, None) & 1;
            mask | (occluded as u32) << lane
        })
    }

    fn light_count(&mut self) -> u32 {
        LIGHTS
    }

    fn light_sample(
        &mut self,
        lanes: LaneSet,
        index: u32,
        query: &LightQueryLanes,
        light: &mut LightLanes,
    ) -> u32 {
        let mut reached = 0;
        for lane in lanes.iter() {
            let vectors = query.point.iter().chain(&query.normal).chain([&query.cosine]);
            let mut request: Vec<f32> = vectors.map(|values| values[lane]).collect();
            request.push(index as f32);
            let hash = self.next(lanes, lane, &request);
            reached |= (u32::from(hash & 3 != 0)) << lane;
            let LightLanes { direction, distance, color, pdf } = &mut *light;
            let vectors = direction.iter_mut().chain([distance]).chain(color).chain([pdf]);
            for (component, values) in vectors.enumerate() {
                values[lane] = unit(hash, component);
            }
        }
        reached
    }

    fn ambient(&mut self) -> [f32; COLOR_COMPONENTS as usize] {
        std::array::from_fn(|component| unit(7, component))
    }

    fn rand(&mut self, lanes: LaneSet, values: &mut LaneFloats) {
        for lane in lanes.iter() {
            let hash = self.next(lanes, lane, &[]);
            values[lane] = unit(hash, 0);
        }
    }

    /// Queries without effects are not counted, since passes may remove and repeat them.
    fn query(&mut self, ray: u32, query: Query, operands: &[u32], results: &mut [u32]) {
        let start = match query.effect() {
            Effect::None => 0,
            Effect::Host | Effect::ReadsLocal(_) | Effect::WritesLocal(_) => {
                self.count(ray as usize)
            }
        };
        let operands = query.operand_scalars().zip(operands);
        let operands = operands.map(|(scalar, bits)| Constant::from_bits(scalar, *bits));
        let hash = hash(start ^ mix(query as u64), operands);
        for (component, (bits, scalar)) in
            results.iter_mut().zip(query.result_scalars()).enumerate()
        {
            let random = mix(hash.wrapping_add(component as u64));
            *bits = match scalar {
                Scalar::F32 => unit(hash, component).to_bits(),
                Scalar::I32 | Scalar::U32 => (random % 5) as u32,
                Scalar::Bool => u32::from(!random.is_multiple_of(4)),
            };
        }
    }
}

/// Returns a hash of constants from this start.
fn hash(start: u64, request: impl Iterator<Item = Constant>) -> u64 {
    request.fold(start, |hash, constant| mix(hash ^ u64::from(canonical(constant).bits())))
}

/// Returns a number in [0,1) from a hash.
fn unit(hash: u64, component: usize) -> f32 {
    (mix(hash.wrapping_add(component as u64)) >> 40) as f32 / (1 << 24) as f32
}

fn canonical(constant: Constant) -> Constant {
    match constant {
        Constant::F32(value) if value.is_nan() => Constant::F32(f32::from_bits(CANONICAL_NAN)),
        Constant::F32(_) | Constant::I32(_) | Constant::U32(_) | Constant::Bool(_) => constant,
    }
}
