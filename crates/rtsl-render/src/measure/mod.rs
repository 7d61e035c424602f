//! How fast a scene is traced: what `rtsl bench SCENE` does.
//!
//! | kind | rays |
//! |---|---|
//! | primary | from the camera through every pixel, the camera's work included; nearest hits |
//! | shadow | from what primary rays hit towards the lights; any hit |
//! | secondary | from what primary rays hit, in directions by their cosine with the normal; nearest hits |
//! | random | from anywhere in the cube around the scene, in any direction; nearest hits |
//!
//! The last three are made before the clock starts. Random rays, and secondary rays in a scene of many
//! things, have nothing in common. A frame is one sample of every pixel, shaded, with all that follows.

mod clock;
mod rays;
mod report;
mod spread;

use std::time::Duration;

use rtsl::{Engine, Messages};
use rtsl_scene::reader::DiskFiles;

use self::clock::Clock;
use crate::compiled::runtime_errors::{RuntimeErrors, exhausted_budgets};
use crate::compiled::tracer::Tracer;
use crate::request::{LoadedScene, Prepared, RenderRequest};
use crate::statistics::{peak_memory_bytes, resident_memory_bytes};
use crate::tiles::{RenderThreads, tiles_of};

pub use self::report::{FrameMeasurement, RayMeasurement, SceneMeasurement};
pub use self::spread::Spread;

/// How often, and how long, rays of each kind are traced.
#[derive(Clone, Copy, Debug)]
pub struct Effort {
    /// How often, if time allows.
    pub repetitions: usize,
    /// After this time no repetition is begun but the first.
    pub time: Duration,
}

/// Measures a scene on the disk. What the request says of samples, time and progress has no meaning here.
///
/// # Errors
/// What is wrong with the scene, its shaders, or the machine.
pub fn measure_scene(
    request: &RenderRequest<'_>,
    effort: Effort,
) -> Result<(SceneMeasurement, Messages), Messages> {
    // Before all else, so that the compiler's library is no part of the scene's memory.
    Engine::warm_up();
    let before = resident_memory_bytes();
    let loaded = LoadedScene::new(request, &DiskFiles)?;
    let Prepared { scene, statistics, primitives, warnings } =
        Prepared::for_shading(request, loaded)?;
    let memory_bytes = resident_memory_bytes().saturating_sub(before);
    let peak_memory_bytes = peak_memory_bytes();
    if !request.general_kernels_only {
        scene.specialise();
        scene.wait_for_specialised();
    }
    let problems = RuntimeErrors::default();
    let size = [scene.settings.width, scene.settings.height];
    let clock = Clock {
        tracer: Tracer { scene: &scene, problems: &problems },
        threads: RenderThreads::new(request.threads)?,
        tiles: tiles_of(size[0], size[1]),
        effort,
    };
    let rays = clock.rays();
    let frame = clock.frame();
    let exhausted = exhausted_budgets(&scene, &problems);
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
