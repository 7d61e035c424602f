//! `rtsl bench --lines`: the cost of a method by lines of the text.
//!
//! The interpreter of packet code runs the method for the rays of `rtsl bench`. Each operation has the line from which
//! it was made, an estimate of the time for which it keeps a machine busy, and the lanes that are on while it runs.

use std::collections::BTreeMap;
use std::sync::Arc;

use rtsl::{
    Backend, CallMode, EngineOptions, Instance, LineWork, Method, Profile, Program, Source, Variant,
};
use serde::Serialize;

use super::call::count;
use super::objects::Objects;
use super::settings::Setting;
use super::{BenchArguments, MethodInputs};
use crate::commands::shader::engine;
use crate::files::write_result;
use crate::outcome::Failure;
use crate::report::Reporter;

/// The width if none is asked for.
const USUAL_WIDTH: u32 = 8;

/// The costs of the lines of a class.
pub struct Lines<'a> {
    pub arguments: &'a BenchArguments,
    pub settings: &'a [Setting],
    pub instance: &'a Arc<Instance>,
    pub reporter: &'a Reporter,
}

impl Lines<'_> {
    /// Prints the lines of a method.
    pub fn print(&self, method: Method) -> Result<(), Failure> {
        let arguments = self.arguments;
        let mode = arguments.modes.first().copied().unwrap_or(CallMode::Packet);
        let width = mode.width(arguments.widths.first().copied().unwrap_or(USUAL_WIDTH));
        let options = EngineOptions {
            backend: Backend::Interpreter,
            width: Some(width),
            ..arguments.code.options()
        };
        let program = engine(options, self.reporter)?.program(self.instance);
        let objects = Objects::new(&program, self.instance, arguments.lanes as usize);
        let inputs = MethodInputs::new(&program, method, &objects, (self.settings, arguments))?;
        let packets = program.packet_kernel(method, self.variant(&program, mode))?;
        let call = inputs.of_mode(mode);
        let profile = count(&packets, objects.of_mode(mode), call, u64::MAX).profile;
        let class = &program.class().name;
        let head = Head { class, method: method.name(), mode: mode.name(), width };
        let text = match arguments.json {
            true => json_text(&head, &profile),
            false => plain_text(&head, &profile, &sources(&program, method)?),
        };
        write_result(None, text.as_bytes())
    }

    fn variant(&self, program: &Program, mode: CallMode) -> Variant {
        let variant = self.arguments.variant.reading(mode);
        match self.arguments.variant.specialise {
            true => variant.knowing(program.known_members(self.instance)),
            false => variant,
        }
    }
}

/// The kernel whose lines are shown.
struct Head<'a> {
    class: &'a str,
    method: &'static str,
    mode: &'static str,
    width: u32,
}

/// The texts of a method's operations, by their names.
fn sources(program: &Program, method: Method) -> Result<BTreeMap<String, Arc<Source>>, Failure> {
    let linked = program.method(method)?;
    let sources = linked.sources();
    Ok(sources.iter().map(|source| (source.name.clone(), source.clone())).collect())
}

fn plain_text(
    head: &Head<'_>,
    profile: &Profile,
    sources: &BTreeMap<String, Arc<Source>>,
) -> String {
    let total = total(profile);
    let Head { class, method, mode, width } = head;
    let mut text = format!(
        "{class}.{method}: {} rays, {mode}, {width} at a time; about {:.1} cycles a ray\n",
        profile.rays,
        total / profile.rays.max(1) as f64,
    );
    let mut source = None;
    for work in profile.lines.iter().filter(|work| work.millicycles > 0) {
        if source != Some(&work.source) {
            source = Some(&work.source);
            let name = if work.line == 0 { "(no line)" } else { &work.source };
            text += &format!("   cost active  diverge  {name}\n");
        }
        let share = Share::new(work, total);
        let line = sources
            .get(&work.source)
            .and_then(|source| source.text.lines().nth(work.line.checked_sub(1)? as usize));
        let row = format!(
            "{:>6.1}% {} {} {:>5}  {}",
            100.0 * share.cost,
            percent(share.active, 6),
            percent(share.diverged, 8),
            if work.line == 0 { String::new() } else { work.line.to_string() },
            line.unwrap_or_default(),
        );
        text += row.trim_end();
        text.push('\n');
    }
    text
}

fn percent(share: Option<f64>, width: usize) -> String {
    let shown = share.map_or(String::new(), |share| format!("{:.1}%", 100.0 * share));
    format!("{shown:>width$}")
}

/// The estimated time of all lines, in cycles.
fn total(profile: &Profile) -> f64 {
    profile.lines.iter().map(|work| work.millicycles).sum::<u64>() as f64 / 1000.0
}

/// The shares of a line.
struct Share {
    /// Of the time.
    cost: f64,
    /// Of the lanes that are on; `None` if all rays share its work.
    active: Option<f64>,
    /// Of the conditions, at which rays diverged; `None` if it has none.
    diverged: Option<f64>,
}

impl Share {
    fn new(work: &LineWork, total: f64) -> Share {
        let share = |part: u64, of: u64| (of > 0).then(|| part as f64 / of as f64);
        Share {
            cost: work.millicycles as f64 / 1000.0 / total.max(f64::MIN_POSITIVE),
            active: share(work.lanes.active, work.lanes.executed),
            diverged: share(work.divergences, work.conditions),
        }
    }
}

/// A line as JSON.
#[derive(Serialize)]
#[serde(rename_all = "camelCase")]
struct JsonLine<'a> {
    class: &'a str,
    method: &'a str,
    /// Named as in the other lines of the command.
    shape: &'a str,
    width: u32,
    file: Option<&'a str>,
    line: Option<u32>,
    cycles_per_ray: f64,
    cost: f64,
    active_lanes: Option<f64>,
    conditions: u64,
    diverged: u64,
}

fn json_text(head: &Head<'_>, profile: &Profile) -> String {
    let total = total(profile);
    let lines = profile.lines.iter().filter(|work| work.millicycles > 0).map(|work| {
        let share = Share::new(work, total);
        let is_known = work.line > 0;
        let line = JsonLine {
            class: head.class,
            method: head.method,
            shape: head.mode,
            width: head.width,
            file: is_known.then_some(&work.source),
            line: is_known.then_some(work.line),
            cycles_per_ray: work.millicycles as f64 / 1000.0 / profile.rays.max(1) as f64,
            cost: share.cost,
            active_lanes: share.active,
            conditions: work.conditions,
            diverged: work.divergences,
        };
        serde_json::to_string(&line).unwrap_or_default() + "\n"
    });
    lines.collect()
}
