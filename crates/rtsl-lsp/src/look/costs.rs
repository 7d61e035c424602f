//! The costs of lines: the output of `rtsl bench --lines --json`.

use std::collections::BTreeMap;

use serde::Deserialize;
use serde_json::{Map, Value, json};

use super::{LineNote, Look, TextNotes, from_zero};

/// The cost of a line in one kernel, or in all kernels of a scene.
#[derive(Debug, Deserialize)]
#[serde(rename_all = "camelCase")]
struct LineCost {
    scene: Option<String>,
    class: Option<String>,
    method: Option<String>,
    width: u32,
    file: Option<String>,
    line: Option<u32>,
    cycles_per_ray: f64,
    cost: f64,
    active_lanes: Option<f64>,
    conditions: u64,
    diverged: u64,
}

/// Reads the notes of lines from the output.
///
/// # Errors
/// If the output is none of this program's.
pub fn costs(output: &[u8]) -> Result<Look, String> {
    let mut texts = BTreeMap::<String, BTreeMap<u32, Vec<LineCost>>>::new();
    let mut width = None;
    let mut without_line = 0.0;
    for cost in serde_json::Deserializer::from_slice(output).into_iter::<LineCost>() {
        let cost = cost.map_err(|error| format!("the costs of lines cannot be read: {error}"))?;
        width = Some(cost.width);
        match (&cost.file, cost.line) {
            (Some(file), Some(line)) => {
                let lines = texts.entry(file.clone()).or_default();
                lines.entry(from_zero(line)).or_default().push(cost);
            }
            _ => without_line += cost.cost,
        }
    }
    let texts = texts.into_iter().map(|(name, lines)| {
        let notes = lines.into_iter().map(|(line, costs)| note(line, costs)).collect();
        TextNotes { name, notes, faults: Vec::new() }
    });
    let summary = Map::from_iter([
        ("width".to_owned(), json!(width)),
        ("costWithoutLine".to_owned(), json!(without_line)),
    ]);
    Ok(Look { texts: texts.collect(), summary })
}

/// The note of a line. Methods that call the same function each have a cost of its lines: the greatest one is shown.
fn note(line: u32, mut costs: Vec<LineCost>) -> LineNote {
    costs.sort_by(|left, right| right.cost.total_cmp(&left.cost));
    let tooltip: Vec<String> = costs.iter().map(LineCost::tooltip).collect();
    let first = costs.first();
    LineNote {
        line,
        label: first.map(LineCost::label).unwrap_or_default(),
        tooltip: tooltip.join("\n\n"),
        data: first.map(LineCost::data).unwrap_or_default(),
    }
}

impl LineCost {
    /// The share of conditions at which rays diverged, if there are any.
    fn divergence(&self) -> Option<f64> {
        (self.conditions > 0).then(|| self.diverged as f64 / self.conditions as f64)
    }

    fn label(&self) -> String {
        let mut parts = vec![match self.cost {
            cost if cost < 0.0005 => "< 0.1 %".to_owned(),
            cost => format!("{:.1} %", 100.0 * cost),
        }];
        // A line whose lanes are all on needs no remark.
        if let Some(active) = self.active_lanes.filter(|active| *active < 0.995) {
            parts.push(format!("{:.0} % of lanes on", 100.0 * active));
        }
        if let Some(diverged) = self.divergence().filter(|_| self.diverged > 0) {
            parts.push(format!("diverges {:.0} %", (100.0 * diverged).max(1.0)));
        }
        parts.join(" · ")
    }

    fn tooltip(&self) -> String {
        let (subject, unit) = match (&self.scene, &self.class, &self.method) {
            (Some(scene), ..) => (format!("all shaders of `{scene}`"), "path"),
            (None, Some(class), Some(method)) => (format!("`{class}.{method}`"), "ray"),
            _ => ("the shader".to_owned(), "ray"),
        };
        let mut text = format!(
            "{:.2} % of the estimated time of {subject}: {:.2} cycles a {unit}, {} rays at a time.",
            100.0 * self.cost,
            self.cycles_per_ray,
            self.width,
        );
        match self.active_lanes {
            Some(active) => text += &format!("\n{:.1} % of the lanes are on.", 100.0 * active),
            None => text += "\nAll rays share the work.",
        }
        if let Some(diverged) = self.divergence() {
            let (share, conditions) = (100.0 * diverged, self.conditions);
            text += &format!("\nRays diverge at {share:.1} % of {conditions} conditions.");
        }
        text
    }

    fn data(&self) -> Map<String, Value> {
        Map::from_iter([
            ("cost".to_owned(), json!(self.cost)),
            ("cyclesPerRay".to_owned(), json!(self.cycles_per_ray)),
            ("activeLanes".to_owned(), json!(self.active_lanes)),
            ("conditions".to_owned(), json!(self.conditions)),
            ("diverged".to_owned(), json!(self.diverged)),
        ])
    }
}
