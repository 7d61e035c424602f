//! Measurement of an integrator: paths per second in a scene.

use std::fmt::Write;
use std::sync::Arc;
use std::time::Instant;

use rtsl::{Engine, Instance, Messages};
use rtsl_scene::reader::DiskFiles;
use serde::Serialize;

use super::{Effort, Spread};
use crate::request::{LoadedScene, Prepared, RenderRequest};
use crate::schedule;
use crate::schedule::render::RenderOptions;
use crate::statistics::RayCounts;

/// The number of samples per pixel unless a request has another: those of a wavefront.
const SAMPLES: u32 = 16;

/// The speed of an integrator in a scene, at one width.
#[derive(Clone, Debug, Serialize)]
#[serde(rename_all = "camelCase")]
pub struct IntegratorMeasurement {
    /// The integrator's class.
    pub class: String,
    /// The scene's file.
    pub scene: String,
    /// Columns and rows of the image.
    pub size: [usize; 2],
    /// The samples per pixel.
    pub samples: u32,
    /// The number of threads.
    pub threads: usize,
    /// SIMD lanes.
    pub width: u32,
    /// The target machine of the code.
    pub target: String,
    /// The time for reading the scene and checking its shaders.
    pub load_seconds: f64,
    /// The time for compiling kernels.
    pub compile_seconds: f64,
    /// The time for bounds and the acceleration structure.
    pub build_seconds: f64,
    /// Millions of paths, which are samples, per second.
    pub million_paths_per_second: Spread,
    /// Millions of rays of all kinds per second, computed from the median.
    pub million_rays_per_second: f64,
    /// The number of paths of an image.
    pub paths: u64,
    /// The number of their rays, by kind.
    pub rays: RayCounts,
    /// The number of images rendered.
    pub repetitions: usize,
}

/// Measures an integrator in a scene on the disk, in place of the scene's own: the time for whole images, without that
/// for compiling. The request's time limit and progress are ignored.
///
/// # Errors
/// Any error of the scene, its shaders, or the machine.
pub fn measure_integrator(
    request: &RenderRequest<'_>,
    integrator: &Arc<Instance>,
    effort: Effort,
) -> Result<(IntegratorMeasurement, Messages), Messages> {
    Engine::warm_up();
    let request = RenderRequest { samples: request.samples.or(Some(SAMPLES)), ..request.clone() };
    let loaded = LoadedScene::new(&request, &DiskFiles)?.with_integrator(integrator);
    let Prepared { scene, statistics, warnings, .. } = Prepared::new(&request, loaded)?;
    let options = RenderOptions { execution: request.execution, ..RenderOptions::default() };
    let start = Instant::now();
    let (mut seconds, mut rays, mut threads) = (Vec::new(), RayCounts::default(), 0);
    while seconds.is_empty() || seconds.len() < effort.repetitions && start.elapsed() < effort.time
    {
        let rendered = schedule::render(&scene, options)?.rendered;
        seconds.push(rendered.time.as_secs_f64());
        (rays, threads) = (rendered.rays, rendered.threads);
    }
    let settings = &scene.compiled.settings;
    let million_paths_per_second =
        Spread::of(seconds.iter().map(|time| rays.camera as f64 / time / 1e6));
    let measurement = IntegratorMeasurement {
        class: integrator.class().name.clone(),
        scene: request.scene.display().to_string(),
        size: [settings.width, settings.height],
        samples: settings.sampler.samples_per_pixel(),
        threads,
        width: statistics.width,
        target: statistics.target,
        load_seconds: statistics.load_seconds,
        compile_seconds: statistics.compile_seconds,
        build_seconds: statistics.build_seconds,
        million_paths_per_second,
        million_rays_per_second: million_paths_per_second.median * rays_of_path(&rays),
        paths: rays.camera,
        rays,
        repetitions: seconds.len(),
    };
    Ok((measurement, warnings))
}

/// Returns the number of rays of all kinds for each path.
fn rays_of_path(rays: &RayCounts) -> f64 {
    rays.total() as f64 / rays.camera as f64
}

impl IntegratorMeasurement {
    /// Returns one line of JSON.
    pub fn to_json(&self) -> String {
        // Cannot fail: the content is numbers, strings and fixed names.
        serde_json::to_string(self).unwrap_or_default() + "\n"
    }

    /// Returns the heading of the table, which the measurements at all widths share.
    pub fn heading(&self) -> String {
        let Self { class, scene, size: [columns, rows], samples, threads, rays, .. } = self;
        let rays = rays_of_path(rays);
        format!(
            "{class}.radiance in {scene}: {columns}x{rows}, {samples} samples, {threads} threads, \
             {rays:.2} rays a path\n\
             width  Mpaths/s     10th..90th   ns/path   Mrays/s compile ms\n"
        )
    }

    /// Returns a row of the table.
    pub fn to_text(&self) -> String {
        let Spread { median, tenth_percentile, ninetieth_percentile } =
            self.million_paths_per_second;
        let spread = format!("{tenth_percentile:.3}..{ninetieth_percentile:.3}");
        let mut text = String::new();
        // Writing to a string cannot fail.
        let _ = writeln!(
            text,
            "{:5} {median:9.3} {spread:>14} {:9.1} {:9.3} {:10.0}",
            self.width,
            1e3 / median,
            self.million_rays_per_second,
            self.compile_seconds * 1e3,
        );
        text
    }
}
