//! `rtsl bench SHADER radiance --scene SCENE`: the paths per second of an integrator.

use std::path::Path;
use std::sync::Arc;
use std::time::Duration;

use rtsl::{Backend, Engine, EngineOptions, Instance, Method};
use rtsl_render::measure::{Effort, measure_integrator};
use rtsl_render::{Execution, Optimise, RenderRequest};
use rtsl_scene::LoadOptions;

use super::arguments::{BenchArguments, SceneArguments};
use crate::commands::render::report;
use crate::files::write_result;
use crate::outcome::{CommandResult, Failure, Outcome};
use crate::report::Reporter;

/// Returns the scene in which a class is measured as an integrator; `None` if its methods are measured one by one.
pub fn scene_of<'a>(
    arguments: &'a BenchArguments,
    methods: &[Method],
) -> Result<Option<&'a Path>, Failure> {
    let is_integrator = methods.contains(&Method::Radiance);
    match (&arguments.in_scene, is_integrator) {
        (Some(scene), true) => {
            check(arguments)?;
            Ok(Some(scene))
        }
        (Some(_), false) => {
            Err(Failure::Usage("`--scene` is for integrators: only `radiance` asks it".to_owned()))
        }
        (None, true) => Err(Failure::Usage(
            "`radiance` of an integrator is measured in a scene: name one with `--scene FILE.pbrt`"
                .to_owned(),
        )),
        (None, false) => Ok(None),
    }
}

/// Measures an integrator, once for each width.
pub fn run(
    arguments: &BenchArguments,
    scene: &Path,
    integrator: &Arc<Instance>,
    reporter: &Reporter,
) -> CommandResult {
    let widths = match &arguments.widths[..] {
        [] => Engine::WIDTHS.to_vec(),
        widths => widths.to_vec(),
    };
    for (index, width) in widths.into_iter().enumerate() {
        let request = request(arguments, scene, width);
        let (measurement, warnings) =
            match measure_integrator(&request, integrator, effort(arguments)) {
                Ok(measured) => measured,
                Err(messages) => {
                    report(&messages, reporter);
                    return Ok(Outcome::InputAtFault);
                }
            };
        let mut text = String::new();
        if index == 0 {
            report(&warnings, reporter);
        }
        if arguments.json {
            text += &measurement.to_json();
        } else {
            if index == 0 {
                text += &measurement.heading();
            }
            text += &measurement.to_text();
        }
        write_result(None, text.as_bytes())?;
    }
    Ok(Outcome::Done)
}

/// Rejects arguments that apply to single calls only.
fn check(arguments: &BenchArguments) -> Result<(), Failure> {
    let given = [
        ("`--state`", !arguments.state.is_empty()),
        ("`--call-mode`", !arguments.modes.is_empty()),
        ("`--reads`", arguments.variant.reads.is_some()),
        ("`--specialise`", arguments.variant.specialise),
    ];
    match given.into_iter().find(|(_, given)| *given) {
        Some((name, _)) => Err(Failure::Usage(format!("{name} does not apply to integrators"))),
        None => Ok(()),
    }
}

fn request(arguments: &BenchArguments, scene: &Path, width: u32) -> RenderRequest<'static> {
    let SceneArguments { size, threads, defines, input, repetitions: _ } = arguments.scene.clone();
    RenderRequest {
        scene: scene.to_owned(),
        load: LoadOptions {
            defines,
            search_path: arguments.search_path.folders(),
            ..input.options()
        },
        size,
        execution: Execution { threads, optimise: Optimise::First, ..Execution::default() },
        engine: EngineOptions {
            backend: Backend::Jit,
            width: Some(width),
            ..arguments.code.options()
        },
        ..RenderRequest::default()
    }
}

fn effort(arguments: &BenchArguments) -> Effort {
    Effort {
        repetitions: arguments.scene.repetitions as usize,
        time: Duration::from_millis(arguments.time.unwrap_or(1000).into()),
    }
}
