//! Measurement of tracing speed: the implementation of `rtsl bench SCENE`.
//!
//! | kind | rays |
//! |---|---|
//! | primary | from the camera through every pixel, including the camera's method; closest hits |
//! | shadow | from hits of primary rays towards the lights; any hit |
//! | secondary | from hits of primary rays, in cosine-distributed directions; closest hits |
//! | random | from random points in the cube around the scene, in random directions; closest hits |
//!
//! The last three are generated before timing starts. Random rays, and secondary rays in a complex scene, are
//! incoherent. A frame is one sample of every pixel, including shading and secondary rays.

mod clock;
mod hit_surfaces;
mod integrator;
mod lines;
mod rays;
mod report;
mod spread;

use rtsl::{Engine, Messages};
use rtsl_scene::Settings;
use rtsl_scene::reader::DiskFiles;

use crate::compiled::runtime_errors::{RuntimeErrors, exhausted_budgets};
use crate::request::{LoadedScene, Prepared, RenderRequest};
use crate::schedule::render_threads::RenderThreads;
use crate::schedule::tile::tiles_of;
use crate::statistics::{peak_memory_bytes, resident_memory_bytes};
use clock::Clock;

pub(crate) use crate::measure::lines::lines_of;
pub use clock::Effort;
pub use integrator::{IntegratorMeasurement, measure_integrator};
pub use lines::{SceneLines, measure_lines, measure_lines_of};
pub use report::{FrameMeasurement, RayMeasurement, SceneMeasurement};
pub use spread::Spread;

/// Measures a scene on the disk. The request's samples, time limit and progress are ignored.
///
/// # Errors
/// Any error of the scene, its shaders, or the machine.
pub fn measure_scene(
    request: &RenderRequest<'_>,
    effort: Effort,
) -> Result<(SceneMeasurement, Messages), Messages> {
    // First, so that the compiler's library does not count as memory of the scene.
    Engine::warm_up();
    let before = resident_memory_bytes();
    let mut loaded = LoadedScene::new(request, &DiskFiles)?;
    loaded.prefer_interactive();
    let Prepared { scene, statistics, primitives, warnings } = Prepared::new(request, loaded)?;
    let memory_bytes = resident_memory_bytes().saturating_sub(before);
    let peak_memory_bytes = peak_memory_bytes();
    scene.wait_for_optimised();
    let errors = RuntimeErrors::default();
    let Settings { width, height, .. } = scene.compiled.settings;
    let size = [width, height];
    let clock = Clock {
        scene: &scene,
        errors: &errors,
        threads: RenderThreads::new(request.execution.threads)?,
        tiles: tiles_of(size[0], size[1]),
        effort,
    };
    let rays = clock.rays();
    let frame = clock.frame();
    let exhausted = exhausted_budgets(&scene.compiled, &errors);
    if exhausted.has_errors() {
        return Err(exhausted);
    }
    let measurement = SceneMeasurement {
        scene: request.scene.display().to_string(),
        size,
        threads: clock.threads.count(),
        width: statistics.width,
        target: statistics.target,
        primitives,
        load_seconds: statistics.load_seconds,
        compile_seconds: statistics.compile_seconds,
        build_seconds: statistics.build_seconds,
        memory_bytes,
        peak_memory_bytes,
        rays,
        frame,
    };
    Ok((measurement, warnings))
}
