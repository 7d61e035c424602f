//! `rtsl bench SCENE`: rays and frames per second.

use std::path::Path;
use std::time::Duration;

use rtsl::EngineOptions;
use rtsl_render::measure::{Effort, measure_scene};
use rtsl_render::{Execution, RenderRequest};
use rtsl_scene::LoadOptions;

use super::arguments::{BenchArguments, SceneArguments};
use crate::commands::render::report;
use crate::files::write_result;
use crate::outcome::{CommandResult, Failure, Outcome};
use crate::report::Reporter;

/// True if a file is a scene, by its name.
pub fn is_scene(path: &Path) -> bool {
    path.extension().is_some_and(|ending| ending.eq_ignore_ascii_case("pbrt"))
}

/// Measures the scene, once for each requested width.
pub fn run(arguments: &BenchArguments, reporter: &Reporter) -> CommandResult {
    check(arguments)?;
    let widths: Vec<Option<u32>> = match &arguments.widths[..] {
        [] => vec![None],
        widths => widths.iter().copied().map(Some).collect(),
    };
    for width in widths {
        let measured = measure_scene(&request(arguments, width), effort(arguments));
        let (measurement, warnings) = match measured {
            Ok(measured) => measured,
            Err(messages) => {
                report(&messages, reporter);
                return Ok(Outcome::InputAtFault);
            }
        };
        report(&warnings, reporter);
        let text = if arguments.json { measurement.to_json() } else { measurement.to_text() };
        write_result(None, text.as_bytes())?;
    }
    Ok(Outcome::Done)
}

/// Rejects arguments that apply to methods only.
pub fn check(arguments: &BenchArguments) -> Result<(), Failure> {
    let given = [
        ("a method", arguments.method.is_some()),
        ("`--scene`", arguments.in_scene.is_some()),
        ("`--class`", arguments.class.is_some()),
        ("`--param`", !arguments.params.is_empty()),
        ("`--state`", !arguments.state.is_empty()),
        ("`--call-mode`", !arguments.modes.is_empty()),
    ];
    match given.into_iter().find(|(_, given)| *given) {
        Some((name, _)) => Err(Failure::Usage(format!("{name} does not apply to scenes"))),
        None => Ok(()),
    }
}

pub fn request(arguments: &BenchArguments, width: Option<u32>) -> RenderRequest<'static> {
    let SceneArguments { size, threads, defines, input, repetitions: _ } = arguments.scene.clone();
    RenderRequest {
        scene: arguments.file.clone(),
        load: LoadOptions {
            defines,
            search_path: arguments.search_path.folders(),
            ..input.options()
        },
        size,
        execution: Execution { threads, ..Execution::default() },
        engine: EngineOptions { width, ..arguments.code.options() },
        ..RenderRequest::default()
    }
}

fn effort(arguments: &BenchArguments) -> Effort {
    Effort {
        repetitions: arguments.scene.repetitions as usize,
        time: Duration::from_millis(arguments.time.unwrap_or(1000).into()),
    }
}
