//! The radiance along the rays of a packet: nearest hits, surfaces, materials, and for rays that
//! leave the scene the emission of its lights.

use rtsl::Method;

use crate::acceleration::{Hits, LANES, LaneMask, RayPacket};

use super::compiled::CompiledScene;
use super::host::{LaneContext, ShadingHost};
use super::intersection::Intersector;
use super::lane_vectors::{LaneVectors, mapped_vectors, normalized_or, store, store_numbers};
use super::surface::{Run, add_colors, prepare, runs};
use super::variables::variables;
use super::workspace::{Level, Problems, Workspace};

/// What rays are traced with.
pub struct Tracer<'a> {
    /// The scene.
    pub scene: &'a CompiledScene,
    /// Where problems go.
    pub problems: &'a Problems,
}

/// A colour for each lane, channel by channel.
pub type PacketColors = LaneVectors;

impl Tracer<'_> {
    /// The nearest hits.
    pub fn nearest(&self, workspace: &mut Workspace, rays: &RayPacket, lanes: LaneMask) -> Hits {
        let blocks = &mut workspace.intersection;
        let mut intersector = Intersector::new(self.scene, blocks, self.problems);
        self.scene.geometry.nearest(rays, lanes, &mut intersector, &mut workspace.visits)
    }

    /// The lanes that hit anything before their limits.
    pub fn any_hit(
        &self,
        workspace: &mut Workspace,
        rays: &RayPacket,
        lanes: LaneMask,
    ) -> LaneMask {
        let blocks = &mut workspace.intersection;
        let mut intersector = Intersector::new(self.scene, blocks, self.problems);
        self.scene.geometry.any(rays, lanes, &mut intersector, &mut workspace.visits)
    }
}

/// The radiance along the rays of `lanes`, which were spawned `depth` times.
pub fn radiance(
    tracer: &Tracer<'_>,
    workspace: &mut Workspace,
    rays: &RayPacket,
    lanes: LaneMask,
    context: &mut LaneContext,
    depth: u32,
) -> PacketColors {
    let mut colors = [[0.0; LANES]; 3];
    let mut level = workspace.take_level();
    let hits = tracer.nearest(workspace, rays, lanes);
    add_sky(tracer, workspace, rays, lanes & !hits.lanes(lanes), context, &mut colors);
    let runs = runs(tracer.scene, &hits, lanes);
    for run in &runs {
        prepare(tracer, run, rays, &hits, &mut level, context);
    }
    for shading in shadings(&runs) {
        let mut host = ShadingHost { tracer, workspace, context, depth };
        shade(&shading, &hits, &mut level, &mut host, &mut colors);
    }
    workspace.return_level(level);
    colors
}

/// What the lights emit towards rays that leave the scene.
fn add_sky(
    tracer: &Tracer<'_>,
    workspace: &mut Workspace,
    rays: &RayPacket,
    lanes: LaneMask,
    context: &mut LaneContext,
    colors: &mut PacketColors,
) {
    if lanes == 0 {
        return;
    }
    let v = variables();
    let blocks = &mut workspace.light;
    for light in &tracer.scene.lights {
        let call = tracer.scene.call(&light.instance, Method::Emission, tracer.problems);
        let Some(call) = call else { continue };
        let up = [[0.0; LANES], [0.0; LANES], [1.0; LANES]];
        let direction = mapped_vectors(&light.inverse, &rays.direction, lanes);
        store(&mut blocks.state, v.ray_direction, lanes, &normalized_or(&direction, &up, lanes));
        store_numbers(&mut blocks.state, v.time_seed, lanes, &rays.time);
        blocks.call(&call, lanes, None, context);
        add_colors(&blocks.state, v.emission_color, lanes, colors);
    }
}

/// A call of a material for the lanes that it shades.
struct Shading<'a> {
    what: Surface<'a>,
    method: Method,
    lanes: LaneMask,
}

/// What shades.
#[derive(Clone, Copy)]
enum Surface<'a> {
    /// A material, by its index.
    Material(u32),
    /// A shape that is its own material.
    Own(&'a Run<'a>),
}

impl Surface<'_> {
    fn is(&self, other: &Surface<'_>) -> bool {
        match (self, other) {
            (Surface::Material(one), Surface::Material(other)) => one == other,
            (Surface::Own(one), Surface::Own(other)) => std::ptr::eq(*one, *other),
            (Surface::Material(_), Surface::Own(_)) | (Surface::Own(_), Surface::Material(_)) => {
                false
            }
        }
    }
}

/// Groups lanes by what shades them: one call for each material.
fn shadings<'a>(runs: &'a [Run<'a>]) -> Vec<Shading<'a>> {
    let mut shadings: Vec<Shading<'a>> = Vec::new();
    let mut add = |what: Surface<'a>, method: Method, lanes: LaneMask| {
        let same = |shading: &&mut Shading<'a>| shading.method == method && shading.what.is(&what);
        match shadings.iter_mut().find(same) {
            Some(shading) => shading.lanes |= lanes,
            None => shadings.push(Shading { what, method, lanes }),
        }
    };
    for run in runs {
        let surface = match run.object.material {
            Some(material) => Surface::Material(material),
            None => Surface::Own(run),
        };
        add(surface, Method::Shade, run.lanes);
        if let Some(emitter) = run.object.emitter {
            add(Surface::Material(emitter), Method::Emission, run.lanes);
        }
    }
    shadings
}

fn shade(
    shading: &Shading<'_>,
    hits: &Hits,
    level: &mut Level,
    host: &mut ShadingHost<'_>,
    colors: &mut PacketColors,
) {
    let tracer = host.tracer;
    // A material that only emits has no `shade`.
    let methods = match shading.method {
        Method::Shade => [Method::Shade, Method::Emission],
        other => [other, other],
    };
    if let Surface::Own(run) = shading.what {
        run.number(tracer.scene, hits, &mut level.numbers);
    }
    let Level { blocks, kept_scratch, numbers } = level;
    let call = methods.into_iter().find_map(|method| match shading.what {
        Surface::Material(index) => {
            let material = &tracer.scene.materials[index as usize];
            tracer.scene.call(material, method, tracer.problems)
        }
        Surface::Own(run) => run.call(tracer, method, numbers),
    });
    let Some(call) = call else { return };
    let v = variables();
    let result = if call.method == Method::Shade { v.sample_color } else { v.emission_color };
    match shading.what {
        // The shape's own methods read what its `intersect` left.
        Surface::Own(_) => blocks.call(&call, shading.lanes, Some(kept_scratch), host),
        Surface::Material(_) => {
            blocks.clear_scratch(call.scratch_arrays);
            blocks.call(&call, shading.lanes, None, host)
        }
    };
    add_colors(&blocks.state, result, shading.lanes, colors);
}
