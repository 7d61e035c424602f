//! What a render did and how long it took, for `--stats`.

use std::ops::AddAssign;
use std::time::Duration;

use serde::Serialize;

/// Figures of one render. Times are in seconds.
#[derive(Clone, Debug, Default, Serialize)]
pub struct Statistics {
    /// Reading the scene and finding, parsing and checking the classes of its shaders.
    pub load_seconds: f64,
    /// Of that, the compiler's part: from the text of shaders to classes.
    pub check_seconds: f64,
    /// Linking shaders and making their kernels; loading LLVM besides.
    pub compile_seconds: f64,
    /// Bounds and the acceleration structure.
    pub build_seconds: f64,
    /// From the first tile begun to the last done.
    pub render_seconds: f64,
    /// From the beginning until the first tile was begun.
    pub cold_start_seconds: f64,
    /// Rays traced, by kind.
    pub rays: RayCounts,
    /// All rays, by the time for rendering.
    pub rays_per_second: f64,
    /// Samples that were not finite and were counted as black.
    pub dropped_samples: u64,
    /// The most memory that the process held, in bytes; 0 where the system does not tell.
    pub peak_memory_bytes: u64,
    /// Columns and rows of the image.
    pub size: [usize; 2],
    /// Samples a pixel.
    pub samples_per_pixel: u32,
    /// Objects, those of instances counted once.
    pub objects: usize,
    /// The classes of the objects, by the numbers that `--aov class` gives them.
    pub object_classes: Vec<String>,
    /// Threads that rendered.
    pub threads: usize,
    /// SIMD lanes.
    pub width: u32,
    /// The machine that code was made for.
    pub target: String,
    /// The LLVM that made it; nothing where the interpreter ran.
    pub llvm: Option<String>,
    /// Whether the render was stopped before its end.
    pub cancelled: bool,
}

/// Rays by kind.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct RayCounts {
    /// From the camera.
    pub camera: u64,
    /// Spawned by `trace`.
    pub traced: u64,
    /// Towards lights, and those of `occluded`.
    pub shadow: u64,
}

impl RayCounts {
    /// All of them.
    pub fn total(&self) -> u64 {
        self.camera + self.traced + self.shadow
    }
}

impl AddAssign for RayCounts {
    fn add_assign(&mut self, other: RayCounts) {
        self.camera += other.camera;
        self.traced += other.traced;
        self.shadow += other.shadow;
    }
}

impl Statistics {
    /// The figures as JSON, for `--stats`.
    pub fn to_json(&self) -> String {
        // Numbers, strings and fixed names: there is nothing that could fail.
        serde_json::to_string_pretty(self).unwrap_or_default()
    }

    pub(crate) fn set_render_time(&mut self, time: Duration) {
        self.render_seconds = time.as_secs_f64();
        if self.render_seconds > 0.0 {
            self.rays_per_second = self.rays.total() as f64 / self.render_seconds;
        }
    }
}

/// The most memory that this process held, in bytes, as Linux tells it.
pub(crate) fn peak_memory_bytes() -> u64 {
    memory_bytes("VmHWM:")
}

/// The memory that this process holds, in bytes, as Linux tells it.
pub(crate) fn resident_memory_bytes() -> u64 {
    memory_bytes("VmRSS:")
}

/// A line of what Linux tells; 0 where there is none.
fn memory_bytes(name: &str) -> u64 {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let line = status.lines().find_map(|line| line.strip_prefix(name));
    let kibibytes = line.and_then(|rest| rest.trim().trim_end_matches("kB").trim().parse().ok());
    kibibytes.map_or(0, |kibibytes: u64| kibibytes * 1024)
}
