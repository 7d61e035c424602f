//! `rtsl bench --lines`: the cost of a method by lines of the text.
//!
//! The interpreter of packet code runs the method for the rays of `rtsl bench`. Each operation has the line from which
//! it was made, an estimate of the time for which it keeps a machine busy, and the lanes that are on while it runs.

use std::collections::BTreeMap;
use std::sync::Arc;

use rtsl::{Backend, CallMode, EngineOptions, Instance, Method, Profile, Program, Source, Variant};
use serde::Serialize;

use super::call::count;
use super::line_table::{json_lines, table, total};
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
        let inputs = MethodInputs::new(&program, method, &objects, self.settings, arguments)?;
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
#[derive(Serialize)]
struct Head<'a> {
    class: &'a str,
    method: &'static str,
    /// Named as in the other lines of the command.
    #[serde(rename = "shape")]
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
    let total = total(&profile.lines);
    let Head { class, method, mode, width } = head;
    let mut text = format!(
        "{class}.{method}: {} rays, {mode}, {width} at a time; about {:.1} cycles a ray\n",
        profile.rays,
        total as f64 / 1000.0 / profile.rays.max(1) as f64,
    );
    for lines in profile.lines.chunk_by(|a, b| a.source == b.source) {
        let source = lines.first().and_then(|line| sources.get(&*line.source));
        text += &table(lines, source.map(|it| &**it), total);
    }
    text
}

fn json_text(head: &Head<'_>, profile: &Profile) -> String {
    json_lines(head, &profile.lines, total(&profile.lines), profile.rays)
}
