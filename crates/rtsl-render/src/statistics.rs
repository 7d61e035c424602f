//! Statistics of a render, for `--stats`.

use std::ops::AddAssign;
use std::time::Duration;

use serde::Serialize;

/// Statistics of one render. Times are in seconds.
#[derive(Clone, Debug, Default, Serialize)]
pub struct Statistics {
    /// Time for reading the scene and finding, parsing and checking the classes of its shaders.
    pub load_seconds: f64,
    /// The compiler's part of that: from the text of shaders to classes.
    pub check_seconds: f64,
    /// Time for linking shaders, compiling kernels and loading LLVM.
    pub compile_seconds: f64,
    /// Time for bounds and the acceleration structure.
    pub build_seconds: f64,
    /// Time from the start of the first tile to the end of the last.
    pub render_seconds: f64,
    /// Time from the beginning to the start of the first tile.
    pub cold_start_seconds: f64,
    /// Rays traced, by kind.
    pub rays: RayCounts,
    /// All rays, divided by the time for rendering.
    pub rays_per_second: f64,
    /// Samples that were not finite and were counted as black.
    pub dropped_samples: u64,
    /// The methods whose values were not finite.
    pub not_finite: Vec<NotFinite>,
    /// The peak memory of the process in bytes; 0 if the system does not report it.
    pub peak_memory_bytes: u64,
    /// Columns and rows of the image.
    pub size: [usize; 2],
    /// Samples per pixel.
    pub samples_per_pixel: u32,
    /// The average number of samples that the path renderer took: less if it ended early, or reached the noise target.
    pub mean_samples: Option<f64>,
    /// The number of objects; those of instances are counted once.
    pub objects: usize,
    /// The classes of the objects, by their indices in `--aov class`.
    pub object_classes: Vec<String>,
    /// The number of threads.
    pub threads: usize,
    /// SIMD lanes.
    pub width: u32,
    /// The target machine of the code.
    pub target: String,
    /// The version of LLVM; none for the interpreter.
    pub llvm: Option<String>,
    /// True if the render was stopped before its end.
    pub cancelled: bool,
}

/// Values of a method that were not finite.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct NotFinite {
    /// The class that was called.
    pub class: String,
    /// Its method.
    pub method: &'static str,
    /// The number of values.
    pub count: u64,
}

/// Rays by kind.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct RayCounts {
    /// Camera rays.
    pub camera: u64,
    /// Rays spawned by `trace`.
    pub traced: u64,
    /// Shadow rays, including those of `occluded`.
    pub shadow: u64,
}

impl RayCounts {
    /// Returns the sum of all kinds.
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

/// The active lanes of the SIMD vectors in calls, out of all their lanes. Vectors without active lanes are skipped and
/// do not count.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct LaneUse {
    on: u64,
    all: u64,
}

impl LaneUse {
    /// No calls.
    pub const NONE: LaneUse = LaneUse { on: 0, all: 0 };

    /// Adds a call for a mask of lanes, in vectors of `width` lanes.
    pub fn add_call(&mut self, lanes: u64, width: u32) {
        let vector = u64::MAX >> (64 - width);
        let starts = (0..64).step_by(width as usize);
        let vectors = starts.filter(|start| lanes >> start & vector != 0).count() as u64;
        self.on += u64::from(lanes.count_ones());
        self.all += vectors * u64::from(width);
    }

    /// Adds a call for so many of the lanes of its vectors.
    pub fn add_vectors(&mut self, on: usize, all: usize) {
        self.on += on as u64;
        self.all += all as u64;
    }

    /// Returns the active lanes, and all.
    pub fn counts(&self) -> [u64; 2] {
        [self.on, self.all]
    }

    /// Returns the use with so many active lanes out of so many.
    pub fn of_counts([on, all]: [u64; 2]) -> Self {
        LaneUse { on, all }
    }

    /// Returns the fraction of active lanes; `None` without calls.
    pub fn part(&self) -> Option<f32> {
        (self.all > 0).then(|| (self.on as f64 / self.all as f64) as f32)
    }
}

impl AddAssign for LaneUse {
    fn add_assign(&mut self, other: LaneUse) {
        self.on += other.on;
        self.all += other.all;
    }
}

impl Statistics {
    /// Returns the statistics as JSON, for `--stats`.
    pub fn to_json(&self) -> String {
        // Cannot fail: the content is numbers, strings and fixed names.
        serde_json::to_string_pretty(self).unwrap_or_default()
    }

    /// Sets the time for rendering, and the rays per second that follow from it.
    pub fn set_render_time(&mut self, time: Duration) {
        self.render_seconds = time.as_secs_f64();
        if self.render_seconds > 0.0 {
            self.rays_per_second = self.rays.total() as f64 / self.render_seconds;
        }
    }
}

/// The peak memory of this process in bytes, as Linux reports it.
pub(crate) fn peak_memory_bytes() -> u64 {
    memory_bytes("VmHWM:")
}

/// The present memory of this process in bytes, as Linux reports it.
pub(crate) fn resident_memory_bytes() -> u64 {
    memory_bytes("VmRSS:")
}

/// The value of a line in `/proc/self/status`; 0 if there is none.
fn memory_bytes(name: &str) -> u64 {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let line = status.lines().find_map(|line| line.strip_prefix(name));
    let kibibytes = line.and_then(|rest| rest.trim().trim_end_matches("kB").trim().parse().ok());
    kibibytes.map_or(0, |kibibytes: u64| kibibytes * 1024)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lanes_count_where_their_vector_runs() {
        let part = |lanes: u64, width: u32| {
            let mut lane_use = LaneUse::default();
            lane_use.add_call(lanes, width);
            lane_use.part()
        };
        assert_eq!(part(u64::MAX, 8), Some(1.0));
        assert_eq!(part(0x0100_0000_0000_0001, 8), Some(0.125));
        assert_eq!(part(0xF, 16), Some(0.25));
        assert_eq!(part(0xF, 4), Some(1.0));
        assert_eq!(part(0x8001, 1), Some(1.0));
        assert_eq!(part(0, 8), None);
    }
}
