//! What was measured, for programs and for people.

use std::fmt::Write;

use serde::Serialize;

use super::Spread;

/// How fast a scene is traced.
#[derive(Clone, Debug, Serialize)]
#[serde(rename_all = "camelCase")]
pub struct SceneMeasurement {
    /// The scene's file.
    pub scene: String,
    /// Columns and rows of the image.
    pub size: [usize; 2],
    /// Threads that traced.
    pub threads: usize,
    /// SIMD lanes.
    pub width: u32,
    /// The machine that code was made for.
    pub target: String,
    /// What rays can hit: shapes, and of meshes the triangles; those of instances counted once.
    pub primitives: u64,
    /// Reading the scene and checking its shaders.
    pub load_seconds: f64,
    /// Making kernels.
    pub compile_seconds: f64,
    /// Bounds and the acceleration structure.
    pub build_seconds: f64,
    /// What the process holds more than before the scene was read, once it is built; 0 where the
    /// system does not tell.
    pub memory_bytes: u64,
    /// The most that the process held until then, all else included.
    pub peak_memory_bytes: u64,
    /// Rays, kind by kind.
    pub rays: Vec<RayMeasurement>,
    /// A frame.
    pub frame: FrameMeasurement,
}

/// How fast rays of a kind are traced.
#[derive(Clone, Debug, Serialize)]
#[serde(rename_all = "camelCase")]
pub struct RayMeasurement {
    /// The kind.
    pub kind: &'static str,
    /// Rays a second, in millions.
    pub million_rays_per_second: Spread,
    /// How many there are.
    pub rays: u64,
    /// The share of them that hits something.
    pub hits: f64,
    /// How often they were traced.
    pub repetitions: usize,
}

/// How fast frames are rendered.
#[derive(Clone, Debug, Serialize)]
#[serde(rename_all = "camelCase")]
pub struct FrameMeasurement {
    /// Milliseconds for one.
    pub milliseconds: Spread,
    /// By the median.
    pub frames_per_second: f64,
    /// Rays of all kinds that one takes.
    pub rays: u64,
    /// How many were rendered.
    pub repetitions: usize,
}

impl SceneMeasurement {
    /// As one line of JSON.
    pub fn to_json(&self) -> String {
        // Numbers, strings and fixed names: there is nothing that could fail.
        serde_json::to_string(self).unwrap_or_default() + "\n"
    }

    /// As a table.
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
        // In small scenes kernels take more than shapes do.
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
