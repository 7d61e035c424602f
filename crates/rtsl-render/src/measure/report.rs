//! The results of a measurement, as JSON and as text.

use std::fmt::Write;

use serde::Serialize;

use super::Spread;

/// The tracing speed of a scene.
#[derive(Clone, Debug, Serialize)]
#[serde(rename_all = "camelCase")]
pub struct SceneMeasurement {
    /// The scene's file.
    pub scene: String,
    /// Columns and rows of the image.
    pub size: [usize; 2],
    /// The number of threads.
    pub threads: usize,
    /// SIMD lanes.
    pub width: u32,
    /// The target machine of the code.
    pub target: String,
    /// The number of primitives: shapes, and the triangles of meshes; those of instances are counted once.
    pub primitives: u64,
    /// The time for reading the scene and checking its shaders.
    pub load_seconds: f64,
    /// The time for compiling kernels.
    pub compile_seconds: f64,
    /// The time for bounds and the acceleration structure.
    pub build_seconds: f64,
    /// The increase of the process's memory from before the scene was read until it was built; 0 if the system does not
    /// report it.
    pub memory_bytes: u64,
    /// The peak memory of the process until then, everything included.
    pub peak_memory_bytes: u64,
    /// The results for each kind of ray.
    pub rays: Vec<RayMeasurement>,
    /// The results for frames.
    pub frame: FrameMeasurement,
}

/// The tracing speed of a kind of ray.
#[derive(Clone, Debug, Serialize)]
#[serde(rename_all = "camelCase")]
pub struct RayMeasurement {
    /// The kind.
    pub kind: &'static str,
    /// Millions of rays per second.
    pub million_rays_per_second: Spread,
    /// The number of rays.
    pub rays: u64,
    /// The fraction of rays that hit something.
    pub hits: f64,
    /// The number of repetitions.
    pub repetitions: usize,
}

/// The rendering speed of frames.
#[derive(Clone, Debug, Serialize)]
#[serde(rename_all = "camelCase")]
pub struct FrameMeasurement {
    /// Milliseconds per frame.
    pub milliseconds: Spread,
    /// Computed from the median.
    pub frames_per_second: f64,
    /// The number of rays of all kinds in a frame.
    pub rays: u64,
    /// The number of frames rendered.
    pub repetitions: usize,
}

impl SceneMeasurement {
    /// Returns one line of JSON.
    pub fn to_json(&self) -> String {
        // Cannot fail: the content is numbers, strings and fixed names.
        serde_json::to_string(self).unwrap_or_default() + "\n"
    }

    /// Returns a table.
    pub fn to_text(&self) -> String {
        let mut text = self.heading();
        text += "rays         Mrays/s     10th..90th   ns/ray    hits\n";
        for RayMeasurement { kind, million_rays_per_second: speed, hits, .. } in &self.rays {
            let Spread { median, tenth_percentile, ninetieth_percentile } = speed;
            let spread = format!("{tenth_percentile:.2}..{ninetieth_percentile:.2}");
            let (nanoseconds, hits) = (1e3 / median, hits * 100.0);
            // Writing to a string cannot fail.
            let _ =
                writeln!(text, "{kind:10} {median:9.2} {spread:>14} {nanoseconds:8.1} {hits:6.1}%");
        }
        let FrameMeasurement { milliseconds, frames_per_second, rays, .. } = &self.frame;
        let Spread { median, tenth_percentile, ninetieth_percentile } = milliseconds;
        let speed = *rays as f64 / median / 1e3;
        let _ = writeln!(
            text,
            "frame: {median:.1} ms ({tenth_percentile:.1}..{ninetieth_percentile:.1}), \
             {frames_per_second:.1} a second; {rays} rays, {speed:.2} million a second"
        );
        text
    }

    fn heading(&self) -> String {
        let Self { scene, size: [columns, rows], threads, width, primitives, .. } = self;
        // In small scenes kernels take more memory than shapes.
        let each = if *primitives < 10_000 {
            String::new()
        } else {
            format!(", {:.0} bytes a primitive", self.memory_bytes as f64 / *primitives as f64)
        };
        format!(
            "{scene}: {primitives} primitives, {columns}x{rows}, {threads} threads, width {width}\n\
             load {:.0} ms, compile {:.0} ms, build {:.1} ms; memory {:.1} MiB{each}\n",
            self.load_seconds * 1e3,
            self.compile_seconds * 1e3,
            self.build_seconds * 1e3,
            self.memory_bytes as f64 / f64::from(1 << 20),
        )
    }
}
