//! Samples of shapes that give off light.
//!
//! The shape's `generateSample` chooses a point and its density, in the shape's space. A ray then goes
//! from the point to be lit towards it; where it finds the shape there, the sample brings the
//! emission that this ray sees. So a lamp lights with what a traced ray of the same direction shows,
//! and one ray answers for what stands between, the lamp's own other side included.
//!
//! A map that scales unevenly turns directions of equal share into shares of unequal size; the
//! density follows by the map's Jacobian, so any placement of a shape will do. Emission may ask for
//! random numbers, but for no light.
//!
//! Of a mesh each face is a light of its own, if it has few. Meshes of many faces, shapes within
//! instances, and shapes without `generateSample` are seen but not sampled.

use rtsl::host::{LaneSet, LightLanes, LightQueryLanes};
use rtsl::{LaneBlock, Method};

use crate::acceleration::{Hits, LANES, LaneMask, RayPacket, lanes_of};
use crate::math::{dot, normalize_or};

use super::compiled::{Object, ShaderInstance};
use super::host::{LaneContext, lane_vector, within_cone};
use super::shading::Tracer;
use super::surface::{prepare, runs};
use super::variables::{number, set_number, set_vector, variables, vector};
use super::workspace::{CallBlocks, Level, Workspace};

/// A shape that is sampled.
pub struct AreaLight {
    /// Its place among the items of the scene, by which hits name it.
    pub member: u32,
    /// The index of its object.
    pub object: u32,
    /// The object's shape, or the element of it that is sampled.
    pub primitive: ShaderInstance,
    /// The index of the material whose emission it gives off.
    pub emitter: u32,
    /// How much larger a volume of the shape's space is in the world's; positive.
    pub volume_scale: f64,
}

/// Of a mesh with more elements none is sampled: each of them would cost a ray for every point.
pub const MOST_SAMPLED_ELEMENTS: u32 = 64;

/// How far from a sample, relative to its distance, the shape may be found: rounding of silhouettes.
const TOLERANCE: f32 = 1e-3;

/// Samples of one light for the lanes of a request, which `context` counts as the request does.
/// Returns the lanes that it reaches.
pub fn sample(
    tracer: &Tracer<'_>,
    workspace: &mut Workspace,
    context: &mut LaneContext,
    light: &AreaLight,
    lanes: LaneSet,
    query: &LightQueryLanes,
    answer: &mut LightLanes,
) -> u32 {
    let normals = generate(tracer, &mut workspace.light, context, light, lanes, query, answer);
    let usable = lanes.iter().filter(|lane| is_usable(answer, *lane));
    let usable = usable.filter(|lane| within_cone(*lane, query, answer));
    let reaching = usable.fold(0, |mask: LaneMask, lane| mask | 1 << lane);
    if reaching == 0 {
        return 0;
    }
    let rays = rays(tracer, context, reaching, query, answer);
    workspace.rays.shadow += u64::from(reaching.count_ones());
    let mut level = workspace.take_level();
    let hits = tracer.nearest(workspace, &rays, reaching);
    let found = lanes_of(reaching).filter(|lane| is_found(light, &hits, answer, *lane));
    let found = found.fold(0, |mask: LaneMask, lane| mask | 1 << lane);
    let lit = emission(tracer, &mut level, context, light, (&rays, &hits), found, &normals, answer);
    workspace.return_level(level);
    lit as u32
}

/// The normals of samples, in world space; zero where the class sets none.
type Normals = [[f32; 3]; LANES];

/// Runs `generateSample`; directions, distances and densities go to `answer`.
fn generate(
    tracer: &Tracer<'_>,
    blocks: &mut CallBlocks,
    context: &mut LaneContext,
    light: &AreaLight,
    lanes: LaneSet,
    query: &LightQueryLanes,
    answer: &mut LightLanes,
) -> Normals {
    let mut normals = [[0.0; 3]; LANES];
    let object = &tracer.scene.objects[light.object as usize];
    let Some(call) = tracer.scene.call(&light.primitive, Method::GenerateSample, tracer.problems)
    else {
        return normals;
    };
    let v = variables();
    for lane in lanes.iter() {
        let state = &mut blocks.state;
        let origin = object.inverse.point(lane_vector(&query.point, lane));
        set_vector(state, v.ray_origin, lane, origin);
        set_number(state, v.epsilon, lane, tracer.scene.epsilon);
        set_number(state, v.time_seed, lane, context.time[lane]);
    }
    blocks.clear_scratch(call.scratch_arrays);
    blocks.call(&call, LaneMask::from(lanes.active), None, context);
    for lane in lanes.iter() {
        place(light, object, &blocks.state, lane, query, answer);
        let normal = vector(&blocks.state, v.geometric_normal, lane);
        normals[lane] = object.normal_to_group(normal);
    }
    normals
}

/// Takes a sample from the shape's space to the world's.
fn place(
    light: &AreaLight,
    object: &Object,
    state: &LaneBlock,
    lane: usize,
    query: &LightQueryLanes,
    answer: &mut LightLanes,
) {
    let v = variables();
    let local = vector(state, v.hit_point, lane);
    let local_way = subtract(local, vector(state, v.ray_origin, lane));
    let way = subtract(object.forward.point(local), lane_vector(&query.point, lane));
    let direction = normalize_or(way, [0.0; 3]);
    let distance = dot(way, way).sqrt();
    // The Jacobian of directions under a linear map: its stretch along the direction, cubed, over
    // its determinant.
    let stretch = f64::from(distance) / f64::from(dot(local_way, local_way).sqrt());
    let scale = stretch * stretch * stretch / light.volume_scale;
    (0..3).for_each(|axis| answer.direction[axis][lane] = direction[axis]);
    answer.distance[lane] = distance;
    answer.pdf[lane] = (f64::from(number(state, v.pdf, lane)) * scale) as f32;
}

fn subtract(a: [f32; 3], b: [f32; 3]) -> [f32; 3] {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

fn is_usable(answer: &LightLanes, lane: usize) -> bool {
    let positive = |x: f32| x > 0.0 && x.is_finite();
    positive(answer.pdf[lane]) && positive(answer.distance[lane])
}

/// Rays from the points to be lit to a little behind the samples.
fn rays(
    tracer: &Tracer<'_>,
    context: &LaneContext,
    lanes: LaneMask,
    query: &LightQueryLanes,
    answer: &LightLanes,
) -> RayPacket {
    let mut packet = RayPacket::default();
    for lane in lanes_of(lanes) {
        let point = lane_vector(&query.point, lane);
        packet.set(lane, point, lane_vector(&answer.direction, lane));
        packet.epsilon[lane] = tracer.scene.epsilon;
        packet.limit[lane] = answer.distance[lane] * (1.0 + TOLERANCE);
        packet.time[lane] = context.time[lane];
    }
    packet
}

/// Whether a ray found the light itself, at the sample's distance.
fn is_found(light: &AreaLight, hits: &Hits, answer: &LightLanes, lane: usize) -> bool {
    // The id of no hit names no member.
    hits.id[lane].outer() == light.member
        && hits.distance[lane] >= answer.distance[lane] * (1.0 - TOLERANCE)
}

/// Runs `emission` where rays found the light; returns the lanes that are lit.
#[expect(clippy::too_many_arguments, reason = "what is known of a sample so far")]
fn emission(
    tracer: &Tracer<'_>,
    level: &mut Level,
    context: &mut LaneContext,
    light: &AreaLight,
    (rays, hits): (&RayPacket, &Hits),
    found: LaneMask,
    normals: &Normals,
    answer: &mut LightLanes,
) -> LaneMask {
    let emitter = &tracer.scene.materials[light.emitter as usize];
    let call = tracer.scene.call(emitter, Method::Emission, tracer.problems);
    let Some(call) = call.filter(|_| found != 0) else { return 0 };
    for run in &runs(tracer.scene, hits, found) {
        prepare(tracer, run, rays, hits, level, context);
    }
    level.blocks.clear_scratch(call.scratch_arrays);
    level.blocks.call(&call, found, None, context);
    let mut lit = 0;
    for lane in lanes_of(found) {
        let color = vector(&level.blocks.state, variables().emission_color, lane);
        (0..3).for_each(|axis| answer.color[axis][lane] = color[axis]);
        let same_side =
            is_same_side(normals[lane], context.geometric_normal(lane), rays.direction_of(lane));
        if same_side && color != [0.0; 3] {
            lit |= 1 << lane;
        }
    }
    lit
}

/// Whether a ray found the side that was sampled: of a thin lamp, both lie within the tolerance.
fn is_same_side(sampled: [f32; 3], found: [f32; 3], direction: [f32; 3]) -> bool {
    dot(sampled, direction) * dot(found, direction) >= 0.0
}
