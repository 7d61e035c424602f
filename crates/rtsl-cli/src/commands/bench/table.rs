//! Measurements, for people and for programs.

use rtsl::{Profile, Shape};
use serde::Serialize;

use super::coverage::Coverage;
use super::peak::Peak;
use super::timing::Times;

/// One kernel, measured and counted.
#[derive(Debug, Serialize)]
#[serde(rename_all = "camelCase")]
pub struct Row {
    class: String,
    method: &'static str,
    shape: &'static str,
    width: u32,
    lanes: u64,
    /// The median.
    nanoseconds_per_lane: f64,
    tenth_percentile: f64,
    ninetieth_percentile: f64,
    /// How many times as fast as the same shape at width 1.
    speedup: f64,
    float_operations_per_lane: f64,
    divisions_per_lane: f64,
    square_roots_per_lane: f64,
    bytes_per_lane: f64,
    /// Of the float operations and bytes that kernels made for nothing else reach.
    share_of_peak_float_operations: f64,
    share_of_peak_bytes: f64,
    peak_gigaflops: f64,
    peak_gigabytes_per_second: f64,
    /// Of the lanes in which operations were done, the share of those that were on.
    active_lanes: f64,
    branch_sides: usize,
    branch_sides_reached: usize,
}

/// What a row is made of.
pub struct Measurement<'a> {
    pub class: &'a str,
    pub method: &'static str,
    pub shape: Shape,
    pub width: u32,
    pub times: Times,
    /// The median at width 1.
    pub one: f64,
    pub profile: &'a Profile,
    pub peak: Peak,
    pub coverage: Coverage,
}

impl Row {
    pub fn new(measurement: &Measurement<'_>) -> Row {
        let Measurement { class, method, shape, width, times, one, profile, peak, coverage } =
            measurement;
        let per_lane = |count: u64| count as f64 / profile.rays.max(1) as f64;
        let operations = per_lane(profile.float_operations.active);
        let bytes = per_lane(profile.bytes().active);
        Row {
            class: (*class).to_owned(),
            method,
            shape: shape.name(),
            width: *width,
            lanes: profile.rays,
            nanoseconds_per_lane: times.median,
            tenth_percentile: times.tenth,
            ninetieth_percentile: times.ninetieth,
            speedup: one / times.median,
            float_operations_per_lane: operations,
            divisions_per_lane: per_lane(profile.divisions.active),
            square_roots_per_lane: per_lane(profile.square_roots.active),
            bytes_per_lane: bytes,
            share_of_peak_float_operations: operations / times.median / peak.float_operations,
            share_of_peak_bytes: bytes / times.median / peak.bytes,
            peak_gigaflops: peak.float_operations,
            peak_gigabytes_per_second: peak.bytes,
            active_lanes: match profile.lanes.executed {
                0 => 1.0,
                executed => profile.lanes.active as f64 / executed as f64,
            },
            branch_sides: coverage.sides,
            branch_sides_reached: coverage.reached,
        }
    }

    /// As a line of JSON, its end included.
    pub fn to_json(&self) -> String {
        serde_json::to_string(self).unwrap_or_default() + "\n"
    }

    /// As a line of the table.
    pub fn to_text(&self) -> String {
        let spread = format!("{:.2}..{:.2}", self.tenth_percentile, self.ninetieth_percentile);
        let percent = |share: f64| format!("{:.1}%", 100.0 * share);
        let divider = self.divisions_per_lane + self.square_roots_per_lane;
        format!(
            "{:<13}{:>6}{:>9.2}{:>16}{:>8.1}{:>8.1}{:>9.1}{:>7.0}{:>8}{:>8}{:>7}\n",
            self.shape,
            self.width,
            self.nanoseconds_per_lane,
            spread,
            self.speedup,
            self.float_operations_per_lane,
            divider,
            self.bytes_per_lane,
            percent(self.share_of_peak_float_operations),
            percent(self.share_of_peak_bytes),
            percent(self.active_lanes),
        )
    }
}

/// What stands above the rows of a method.
pub fn heading(class: &str, method: &str, lanes: usize, coverage: Coverage) -> String {
    let Coverage { reached, sides } = coverage;
    let branches = match sides {
        0 => "no branches".to_owned(),
        _ => format!("{reached} of {sides} sides of branches reached"),
    };
    format!(
        "{class}.{method}: {lanes} rays a call, {branches}\n\
         {:<13}{:>6}{:>9}{:>16}{:>8}{:>8}{:>9}{:>7}{:>8}{:>8}{:>7}\n",
        "shape",
        "width",
        "ns/lane",
        "10th..90th",
        "speedup",
        "flops",
        "div+sqrt",
        "bytes",
        "flops%",
        "bytes%",
        "active",
    )
}
