//! `rtsl eval`: calls one method on given values.

use std::io::BufReader;
use std::path::PathBuf;

use clap::Args;
use rtsl::DEFAULT_LOOP_BUDGET;
use rtsl_debug::first_not_finite;
use serde_json::Value as JsonValue;

use crate::arguments::{BackendName, EngineArguments, MathName, SearchPath};
use crate::eval::{Answer, Evaluation, Request, Session, answer_lines, parse_setting};
use crate::files::write_result;
use crate::json::Json;
use crate::outcome::{CommandResult, Failure, Outcome};
use crate::report::Reporter;
use crate::trace::{self, TraceName};

/// The command line of `rtsl eval`.
#[derive(Debug, Args)]
pub struct EvalArguments {
    /// The shader.
    #[arg(required_unless_present = "stdin", value_name = "FILE")]
    file: Option<PathBuf>,
    /// The method, or any function of the class or of the file: `f`, or `'f(float, vec3)'` if several have the name.
    /// Without one the file is only compiled.
    method: Option<String>,
    /// The class, if the file has several.
    #[arg(long)]
    class: Option<String>,
    /// A parameter of the instance; may be repeated. Values are numbers, `true`, `false`, lists
    /// such as `1,0,0`, or JSON.
    #[arg(long = "param", value_name = "NAME=VALUE", value_parser = parse_setting)]
    params: Vec<(String, JsonValue)>,
    /// An argument of a function that is no method; may be repeated.
    #[arg(long = "arg", value_name = "NAME=VALUE", value_parser = parse_setting)]
    args: Vec<(String, JsonValue)>,
    /// A state variable before the call; may be repeated.
    #[arg(long = "state", value_name = "NAME=VALUE", value_parser = parse_setting)]
    state: Vec<(String, JsonValue)>,
    /// A scratch member before the call; may be repeated.
    #[arg(long = "scratch", value_name = "NAME=VALUE", value_parser = parse_setting)]
    scratch: Vec<(String, JsonValue)>,
    /// The scene that an integrator asks; without one, rays hit nothing.
    #[arg(long, value_name = "FILE")]
    scene: Option<PathBuf>,
    /// The greatest number of loop iterations of one ray, in all loops together, and of the constructor; at most
    /// 1073741824. Requests of `--stdin` set their own.
    #[arg(long, value_name = "ITERATIONS", default_value_t = DEFAULT_LOOP_BUDGET)]
    budget: u32,
    /// Print what happens in the call: the calls of methods with their state, or with `lines` the values of variables
    /// too; and the first operation whose result is NaN or an infinity.
    #[arg(long, value_name = "DETAIL", value_enum, num_args = 0..=1, require_equals = true, default_missing_value = "calls")]
    trace: Option<TraceName>,
    /// Print the answer as JSON.
    #[arg(long)]
    json: bool,
    /// Read one JSON request per line from standard input, write one JSON answer per line.
    #[arg(long, conflicts_with_all = ["file", "method", "class", "params", "args", "state", "scratch", "scene", "trace"])]
    stdin: bool,
    #[command(flatten)]
    engine: EngineArguments,
    #[command(flatten)]
    search_path: SearchPath,
}

/// Calls the method, or answers all requests.
pub fn run(arguments: &EvalArguments, reporter: &Reporter) -> CommandResult {
    if arguments.stdin {
        let input = BufReader::new(std::io::stdin());
        answer_lines(input, std::io::stdout().lock(), &arguments.search_path)
            .map_err(Failure::Output)?;
        return Ok(Outcome::Done);
    }
    // Faults of the project file are reported here, not by the session.
    let files = [&arguments.file, &arguments.scene];
    for file in files.into_iter().flatten() {
        arguments.search_path.beside(file, reporter)?;
    }
    let mut session = Session::new(arguments.search_path.clone());
    let request = request(arguments);
    if arguments.json {
        let answer = session.answer(&request);
        write_result(None, answer.to_line().as_bytes())?;
        return Ok(if answer.ok { Outcome::Done } else { Outcome::InputAtFault });
    }
    let Evaluation { answer, compilation, further, recording } = session.evaluate(&request);
    if let Some(compilation) = compilation {
        reporter.compilation(&compilation);
    }
    further.iter().for_each(|diagnostic| reporter.diagnostic(diagnostic));
    let recording = recording.unwrap_or_default();
    if let Some((sources, warning)) = first_not_finite(&recording) {
        reporter.diagnostics(&sources, [&warning]);
    }
    write_result(None, (trace::lines(&recording) + &plain_text(&answer)).as_bytes())?;
    match answer.error {
        Some(error) => Err(Failure::Usage(error)),
        None if answer.ok => Ok(Outcome::Done),
        None => Ok(Outcome::InputAtFault),
    }
}

fn request(arguments: &EvalArguments) -> Request {
    let values = |list: &[(String, JsonValue)]| list.iter().cloned().collect();
    let backend = match arguments.engine.backend {
        BackendName::Auto => "auto",
        BackendName::Jit => "jit",
        BackendName::Interp => "interp",
    };
    let math = match arguments.engine.code.math {
        MathName::Contract => "contract",
        MathName::Strict => "strict",
        MathName::Fast => "fast",
    };
    Request {
        file: arguments.file.clone(),
        class: arguments.class.clone(),
        method: arguments.method.clone(),
        params: values(&arguments.params),
        args: values(&arguments.args),
        state: values(&arguments.state),
        scratch: values(&arguments.scratch),
        backend: Some(backend.to_owned()),
        width: arguments.engine.width,
        math: Some(math.to_owned()),
        budget: Some(arguments.budget),
        scene: arguments.scene.clone(),
        trace: arguments.trace,
        ..Request::default()
    }
}

/// Formats `name = value` lines with the values of the only ray.
pub fn plain_text(answer: &Answer) -> String {
    let mut text = String::new();
    if let Some(hit) = &answer.hit {
        text += &format!("hit = {}\n", plain_value(first_lane(hit)));
    }
    if let Some(result) = &answer.result {
        text += &format!("result = {}\n", plain_value(first_lane(result)));
    }
    let out = answer.out.iter().flatten();
    for (name, value) in out {
        text += &format!("{name} = {}\n", plain_value(first_lane(value)));
    }
    let state = answer.state.iter().flatten();
    for (name, value) in state.chain(answer.scratch.iter().flatten()) {
        text += &format!("{name} = {}\n", plain_value(first_lane(value)));
    }
    text
}

fn first_lane(value: &Json) -> &Json {
    match value {
        Json::Object(fields) => match fields.first() {
            Some((_, Json::List(lanes))) => lanes.first().unwrap_or(value),
            _ => value,
        },
        _ => value,
    }
}

fn plain_value(value: &Json) -> String {
    match value {
        Json::Text(text) => text.clone(),
        Json::Float(value) if !value.is_finite() => format!("{value:?}"),
        Json::Float(_) | Json::Integer(_) | Json::Bool(_) | Json::List(_) | Json::Object(_) => {
            serde_json::to_string(value).unwrap_or_default()
        }
    }
}
