//! Measurements as a table and as JSON.

use std::fmt::Display;

use rtsl::{CallMode, Profile};
use serde::Serialize;

use super::coverage::Coverage;
use super::peak::Peak;
use super::timing::Times;

/// The measurement of one kernel.
#[derive(Debug, Serialize)]
#[serde(rename_all = "camelCase")]
pub struct Row {
    class: String,
    method: &'static str,
    /// Named `shape` in JSON, as scripts expect.
    #[serde(rename = "shape")]
    mode: &'static str,
    width: u32,
    /// The number of floats that the machine code computes at once; null without float arithmetic.
    vector: Option<u32>,
    /// The lanes of one call.
    lanes: u64,
    /// The number of calls timed together.
    calls: usize,
    /// The median.
    nanoseconds_per_lane: f64,
    tenth_percentile: f64,
    ninetieth_percentile: f64,
    /// The speed relative to the same call mode at width 1.
    speedup: f64,
    float_operations_per_lane: f64,
    divisions_per_lane: f64,
    square_roots_per_lane: f64,
    bytes_per_lane: f64,
    /// Fractions of the peak rates of float operations and bytes.
    share_of_peak_float_operations: f64,
    share_of_peak_bytes: f64,
    /// The fraction of time in which the divider is busy, including inactive lanes.
    divider_busy: f64,
    peak_gigaflops: f64,
    peak_gigabytes_per_second: f64,
    /// The fraction of active lanes in all operations.
    active_lanes: f64,
    branch_sides: usize,
    branch_sides_reached: usize,
}

/// The inputs of a row.
pub struct Measurement<'a> {
    pub class: &'a str,
    pub method: &'static str,
    pub mode: CallMode,
    pub width: u32,
    /// The number of floats that the machine code computes at once.
    pub vector: Option<u32>,
    /// The number of calls that were timed and profiled.
    pub calls: usize,
    pub times: Times,
    /// The median at width 1.
    pub one: f64,
    pub profile: &'a Profile,
    pub peak: Peak,
    pub coverage: Coverage,
}

impl Row {
    pub fn new(measurement: &Measurement<'_>) -> Row {
        let Measurement { class, method, mode, width, vector, calls, .. } = measurement;
        let Measurement { times, one, profile, peak, coverage, .. } = measurement;
        let per_lane = |count: u64| count as f64 / profile.rays.max(1) as f64;
        let operations = per_lane(profile.float_operations.active);
        let bytes = per_lane(profile.bytes().active);
        let divider_time = per_lane(profile.divisions.executed) / peak.divisions
            + per_lane(profile.square_roots.executed) / peak.square_roots;
        Row {
            class: (*class).to_owned(),
            method,
            mode: mode.name(),
            width: *width,
            vector: *vector,
            lanes: profile.rays / (*calls).max(1) as u64,
            calls: *calls,
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
            divider_busy: divider_time / times.median,
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

    /// Returns a line of JSON with its end.
    pub fn to_json(&self) -> String {
        serde_json::to_string(self).unwrap_or_default() + "\n"
    }

    /// Returns a line of the table.
    pub fn to_text(&self) -> String {
        let nanoseconds = |value: f64| match value {
            ..100.0 => format!("{value:.2}"),
            ..1000.0 => format!("{value:.1}"),
            _ => format!("{value:.0}"),
        };
        let spread = [self.tenth_percentile, self.ninetieth_percentile].map(nanoseconds);
        let percent = |share: f64| format!("{:.1}%", 100.0 * share);
        let cells = [
            self.mode.to_owned(),
            self.width.to_string(),
            self.vector.map_or("-".to_owned(), |floats| floats.to_string()),
            nanoseconds(self.nanoseconds_per_lane),
            spread.join(".."),
            format!("{:.1}", self.speedup),
            format!("{:.0}", self.float_operations_per_lane),
            format!("{:.1}", self.divisions_per_lane + self.square_roots_per_lane),
            format!("{:.0}", self.bytes_per_lane),
            percent(self.share_of_peak_float_operations),
            percent(self.divider_busy),
            percent(self.share_of_peak_bytes),
            percent(self.active_lanes),
        ];
        line(cells)
    }
}

/// Aligns cells in columns.
fn line<Cell: Display>(cells: [Cell; 13]) -> String {
    let [mode, rest @ ..] = cells;
    const WIDTHS: [usize; 12] = [5, 7, 9, 15, 8, 6, 9, 6, 7, 7, 7, 7];
    let rest = rest.iter().zip(WIDTHS).map(|(cell, width)| format!("{cell:>width$}"));
    format!("{mode:<13}{}\n", rest.collect::<String>())
}

/// Returns the heading above the rows of a method.
pub fn heading(class: &str, method: &str, lanes: usize, coverage: Coverage) -> String {
    let Coverage { reached, sides } = coverage;
    let rays = if lanes == 1 { "ray" } else { "rays" };
    let branches = match sides {
        0 => "no branches".to_owned(),
        _ => format!("{reached} of {sides} sides of branches reached"),
    };
    let names = [
        "shape",
        "width",
        "vector",
        "ns/lane",
        "10th..90th",
        "speedup",
        "flops",
        "div+sqrt",
        "bytes",
        "flops%",
        "div%",
        "bytes%",
        "active",
    ];
    format!("{class}.{method}: {lanes} {rays} a call, {branches}\n{}", line(names))
}
