//! `rtsl test`: checks the contracts between classes and renderers.

mod pictures;
mod scene;

use std::fmt::Write;
use std::path::PathBuf;
use std::sync::Arc;

use clap::Args;
use rtsl::{Class, Engine, EngineOptions, Instance, Method, Unit, Value};
use rtsl_contract::{
    Finding, Inputs, Options, Outcome as Found, Report, Setting, TEXTURE, check, settings,
};
use serde_json::Value as JsonValue;

use super::check::is_scene;
use super::shader::{compile_file, compiler_of, engine, value_failure};
use crate::arguments::{EngineArguments, SearchPath};
use crate::eval::{parse_setting, parse_value};
use crate::files::write_result;
use crate::json::Json;
use crate::outcome::{CommandResult, Failure, Outcome};
use crate::report::Reporter;

/// The command line of `rtsl test`.
#[derive(Debug, Args)]
#[command(after_help = "\
Each class is checked with its defaults, and with numbers spread over the ranges that its annotations give.
What it refers to and must have is simple: a grey texture, a matte material. Of a scene, the camera, the materials,
the lights and the shapes are checked as they are there.

Example: is the density of this material that of its samples, and does it reflect too much?
    rtsl test velvet.rtsl --param sharpness=8")]
pub struct TestArguments {
    /// The shader, or a scene, whose name ends with `.pbrt`, `.gltf` or `.glb`.
    #[arg(value_name = "FILE")]
    file: PathBuf,
    /// Check this class only.
    #[arg(long)]
    class: Option<String>,
    /// A parameter of all instances; may be repeated. The syntax of values is that of `rtsl eval`.
    #[arg(long = "param", value_name = "NAME=VALUE", value_parser = parse_setting)]
    params: Vec<(String, JsonValue)>,
    /// The number of samples for each test of a distribution: four times as many detect deviations half as large.
    #[arg(long, default_value_t = Options::default().samples, value_parser = clap::value_parser!(u32).range(1000..=10_000_000))]
    samples: u32,
    /// The seed of random numbers.
    #[arg(long, default_value_t = Options::default().seed)]
    seed: u64,
    /// Print one JSON object per line for each instance.
    #[arg(long)]
    json: bool,
    #[command(flatten)]
    engine: EngineArguments,
    #[command(flatten)]
    search_path: SearchPath,
}

/// Checks the classes of the file, one after the other.
pub fn run(arguments: &TestArguments, reporter: &Reporter) -> CommandResult {
    let usual = rtsl_contract::engine_options();
    let options = EngineOptions {
        loop_budget: usual.loop_budget,
        optimization: usual.optimization,
        ..arguments.engine.options()
    };
    let engine = engine(options, reporter)?;
    if is_scene(&arguments.file) {
        return Ok(outcome(scene::check_scene(arguments, &engine, reporter)?, reporter));
    }
    let compiler = compiler_of(&arguments.file, &arguments.search_path, reporter)?;
    let Some(unit) = compile_file(&compiler, &arguments.file, reporter) else {
        return Ok(Outcome::InputAtFault);
    };
    let classes: Vec<&Arc<Class>> = match &arguments.class {
        Some(name) => vec![unit.class(name)?],
        None => unit.classes().iter().collect(),
    };
    let tests = Tests { arguments, unit: &unit, engine };
    let mut broken = 0;
    for class in &classes {
        broken += tests.check_class(class)?;
    }
    Ok(outcome(broken, reporter))
}

fn outcome(broken: usize, reporter: &Reporter) -> Outcome {
    if broken == 0 {
        return Outcome::Done;
    }
    let plural = if broken == 1 { "contract is" } else { "contracts are" };
    reporter.message("error", &format!("{broken} {plural} broken"));
    Outcome::InputAtFault
}

struct Tests<'a> {
    arguments: &'a TestArguments,
    unit: &'a Unit,
    engine: Engine,
}

/// A class with a setting and its report.
struct Checked<'a> {
    class: &'a Class,
    setting: &'a Setting,
    report: Report,
}

impl Tests<'_> {
    /// Checks all settings of a class; returns the number of broken contracts.
    fn check_class(&self, class: &Arc<Class>) -> Result<usize, Failure> {
        let given = self.given(class)?;
        let mut broken = 0;
        // Keeps the compiled code from setting to setting.
        let mut program = None;
        for (index, setting) in self.settings(class).iter().enumerate() {
            let instance = setting
                .instance(class, &given)
                .map_err(|errors| Failure::Diagnostics(errors.into_vec()))?;
            program.get_or_insert_with(|| self.engine.program(&instance));
            let report = self.check(&instance, index == 0)?;
            broken += report.broken().count();
            let checked = Checked { class, setting, report };
            let text = if self.arguments.json {
                self.json_line(&checked)
            } else {
                self.text(&checked, index == 0)
            };
            write_result(None, text.as_bytes())?;
        }
        Ok(broken)
    }

    /// Code does not depend on parameters, so the bits are compared for the first instance only.
    fn check(&self, instance: &Arc<Instance>, compare_bits: bool) -> Result<Report, Failure> {
        let TestArguments { samples, seed, .. } = *self.arguments;
        let mut report = check(&self.engine, instance, &Options { samples, seed, compare_bits })?;
        let is_integrator = instance.class().methods.contains_key(&Method::Radiance);
        if compare_bits && is_integrator && report.holds() {
            let loop_budget = rtsl_contract::engine_options().loop_budget;
            report.findings.push(pictures::check(instance, loop_budget));
        }
        Ok(report)
    }

    /// Returns the parameters of the command line that the class has; reports those that no class has.
    fn given(&self, class: &Class) -> Result<Vec<(String, Value)>, Failure> {
        let has = |class: &Class, name: &str| class.parameters.iter().any(|it| it.name == name);
        let is_wanted = |name: &str| {
            let is_others = self.unit.classes().iter().any(|other| has(other, name));
            has(class, name) || self.arguments.class.is_some() || !is_others
        };
        let wanted = self.arguments.params.iter().filter(|(name, _)| is_wanted(name));
        let values = wanted.map(|(name, json)| {
            Ok((name.clone(), parse_value(json, self.unit).map_err(value_failure)?))
        });
        values.collect()
    }

    /// Returns the settings of a class, without the parameters of the command line.
    fn settings(&self, class: &Class) -> Vec<Setting> {
        let names: Vec<&str> = self.arguments.params.iter().map(|(name, _)| &**name).collect();
        settings(class, &names)
    }

    /// Formats all findings of the first setting, and only the broken contracts of others.
    fn text(&self, checked: &Checked<'_>, is_first: bool) -> String {
        let Checked { class, setting, report } = checked;
        let roles: Vec<&str> = class.roles.iter().map(|role| role.name()).collect();
        let own = setting.shown.iter().map(|(name, value)| format!("{name}={value}"));
        let shown: Vec<String> = self.shown_params().chain(own).collect();
        let shown = if shown.is_empty() { "defaults".to_owned() } else { shown.join(" ") };
        let mut text = format!("{} ({}), {shown}\n", class.name, roles.join(", "));
        let is_shown = |finding: &&Finding| is_first || matches!(finding.outcome, Found::Broken(_));
        for finding in report.findings.iter().filter(is_shown) {
            text += &finding.to_text(&|inputs| self.command(checked, inputs));
        }
        if !is_first {
            let is_held = |finding: &&Finding| matches!(finding.outcome, Found::Held(_));
            let held = report.findings.iter().filter(is_held).count();
            text += &format!("  held    {held} contracts\n");
        }
        text + "\n"
    }

    /// The parameters in the syntax of the command line.
    fn shown_params(&self) -> impl Iterator<Item = String> {
        self.arguments.params.iter().map(|(name, value)| format!("{name}={value}"))
    }

    /// Returns the command that repeats a call.
    fn command(&self, checked: &Checked<'_>, inputs: &Inputs) -> String {
        let Checked { class, setting, .. } = checked;
        let file = self.arguments.file.display();
        let mut command = format!("try: rtsl eval {file} {}", inputs.method.name());
        if self.unit.classes().len() > 1 {
            let _ = write!(command, " --class {}", class.name);
        }
        for param in self.shown_params() {
            let _ = write!(command, " --param '{param}'");
        }
        let is_texture = |(_, value): &&(String, String)| value == TEXTURE;
        for (name, value) in setting.shown.iter().filter(|it| !is_texture(it)) {
            let _ = write!(command, " --param {name}={value}");
        }
        for state in inputs.to_string().split_whitespace() {
            let _ = write!(command, " --state {state}");
        }
        // The command line takes no textures.
        let textures = setting.shown.iter().filter(is_texture).map(|(name, _)| name.as_str());
        let textures: Vec<&str> = textures.collect();
        if !textures.is_empty() {
            let _ = write!(command, " # without the textures of {}", textures.join(", "));
        }
        command
    }

    fn json_line(&self, checked: &Checked<'_>) -> String {
        let Checked { class, setting, report } = checked;
        let text = |it: &str| Json::Text(it.to_owned());
        let shown = setting.shown.iter().map(|(name, value)| (name.clone(), text(value)));
        let fields = vec![
            ("class".to_owned(), text(&class.name)),
            ("setting".to_owned(), Json::Object(shown.collect())),
            ("holds".to_owned(), Json::Bool(report.holds())),
            (
                "contracts".to_owned(),
                Json::List(report.findings.iter().map(json_finding).collect()),
            ),
        ];
        serde_json::to_string(&Json::Object(fields)).unwrap_or_default() + "\n"
    }
}

fn json_finding(finding: &Finding) -> Json {
    let text = |it: &str| Json::Text(it.to_owned());
    let (outcome, message) = match &finding.outcome {
        Found::Held(note) => ("held", note.as_deref()),
        Found::Broken(failure) => ("broken", Some(failure.message.as_str())),
        Found::NotApplicable(reason) => ("not applicable", Some(reason.as_str())),
    };
    let mut fields = vec![
        ("contract", text(&finding.contract.name())),
        ("promise", text(finding.contract.promise())),
        ("outcome", text(outcome)),
    ];
    fields.extend(message.map(|message| ("message", text(message))));
    if let Found::Broken(failure) = &finding.outcome {
        fields.push(("broken", Json::Integer(failure.broken as i64)));
        fields.push(("tested", Json::Integer(failure.tested as i64)));
        if let Some(inputs) = &failure.inputs {
            fields.push(("method", text(inputs.method.name())));
            let state = inputs.state.iter().map(|(name, values)| {
                (name.to_string(), Json::List(values.iter().map(|it| Json::Float(*it)).collect()))
            });
            fields.push(("state", Json::Object(state.collect())));
        }
    }
    Json::Object(fields.into_iter().map(|(name, value)| (name.to_owned(), value)).collect())
}
