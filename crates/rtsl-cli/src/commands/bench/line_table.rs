//! The table of the costs of lines, and its JSON.

use rtsl::{LineWork, Source};
use serde::Serialize;

/// Returns the estimated time of lines, in thousandths of a cycle.
pub fn total(lines: &[LineWork]) -> u64 {
    lines.iter().map(|work| work.millicycles).sum()
}

/// Returns the table of the lines of one text, with a heading. `total` is the time of which their costs are shares.
pub fn table(lines: &[LineWork], source: Option<&Source>, total: u64) -> String {
    let lines: Vec<&LineWork> = lines.iter().filter(|work| work.millicycles > 0).collect();
    let Some(first) = lines.first() else { return String::new() };
    let name = if first.line == 0 { "(no line)" } else { &*first.source };
    let mut text = format!("   cost active  diverge  {name}\n");
    for work in lines {
        let line =
            source.and_then(|source| source.text.lines().nth(work.line.checked_sub(1)? as usize));
        let row = format!(
            "{:>6.1}% {} {} {:>5}  {}",
            100.0 * cost(work, total),
            percent(work.active_share(), 6),
            percent(work.diverged_share(), 8),
            if work.line == 0 { String::new() } else { work.line.to_string() },
            line.unwrap_or_default(),
        );
        text += row.trim_end();
        text.push('\n');
    }
    text
}

/// Returns an object of JSON for each line, with the members of `head` before its own.
pub fn json_lines(head: &impl Serialize, lines: &[LineWork], total: u64, rays: u64) -> String {
    let lines = lines.iter().filter(|work| work.millicycles > 0).map(|work| {
        let is_known = work.line > 0;
        let line = JsonLine {
            head,
            file: is_known.then_some(&work.source),
            line: is_known.then_some(work.line),
            cycles_per_ray: work.millicycles as f64 / 1000.0 / rays.max(1) as f64,
            cost: cost(work, total),
            active_lanes: work.active_share(),
            conditions: work.conditions,
            diverged: work.divergences,
        };
        serde_json::to_string(&line).unwrap_or_default() + "\n"
    });
    lines.collect()
}

fn percent(share: Option<f64>, width: usize) -> String {
    let shown = share.map_or(String::new(), |share| format!("{:.1}%", 100.0 * share));
    format!("{shown:>width$}")
}

/// The share of the time, from 0 to 1.
fn cost(work: &LineWork, total: u64) -> f64 {
    work.millicycles as f64 / total.max(1) as f64
}

/// A line as JSON.
#[derive(Serialize)]
#[serde(rename_all = "camelCase")]
struct JsonLine<'a, Head> {
    #[serde(flatten)]
    head: &'a Head,
    file: Option<&'a str>,
    line: Option<u32>,
    cycles_per_ray: f64,
    cost: f64,
    active_lanes: Option<f64>,
    conditions: u64,
    diverged: u64,
}
