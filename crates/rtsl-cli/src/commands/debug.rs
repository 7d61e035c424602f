//! `rtsl debug`: walks over a recorded run in the terminal.

use std::io::{self, BufWriter};
use std::path::PathBuf;

use clap::Args;
use rtsl::TraceLimits;
use rtsl_render::RenderRequest;
use rtsl_scene::{LoadOptions, RENDERERS};
use serde_json::Value as JsonValue;

use super::pixel::parse_pixel;
use super::render::parse_size;
use crate::arguments::SearchPath;
use crate::debug::{
    Commands, DEFAULT_KEPT, MAX_KEPT, PixelTarget, Recorded, Target, Terminal, record,
};
use crate::eval::{Request, parse_setting};
use crate::outcome::{CommandResult, Failure, Outcome};
use crate::report::Reporter;

/// The command line of `rtsl debug`.
#[derive(Debug, Args)]
#[command(after_help = "The commands of the debugger: `help` in a session lists them.")]
pub struct DebugArguments {
    /// A scene with `--pixel`, or a shader with a method.
    #[arg(value_name = "FILE")]
    file: PathBuf,
    /// The method, or any function of the class or of the file, as in `rtsl eval`.
    #[arg(required_unless_present = "pixel", conflicts_with = "pixel")]
    method: Option<String>,
    /// Debug a sample of this pixel of a scene. Columns and rows count from 0, from the top left.
    #[arg(long, value_name = "X,Y", value_parser = parse_pixel)]
    pixel: Option<[usize; 2]>,
    /// The sample of the pixel, from 0.
    #[arg(long, value_name = "N", default_value_t = 0, conflicts_with = "method")]
    sample: u32,
    /// The renderer, overriding the scene's integrator.
    #[arg(long, value_name = "NAME", value_parser = RENDERERS, conflicts_with = "method")]
    renderer: Option<String>,
    /// The integrator, overriding the scene's.
    #[arg(long, value_name = "NAME", conflicts_with_all = ["renderer", "method"])]
    integrator: Option<String>,
    /// Samples per pixel, overriding the scene's.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..), conflicts_with = "method")]
    spp: Option<u32>,
    /// Columns and rows, overriding the scene's.
    #[arg(long, value_name = "WxH", value_parser = parse_size, conflicts_with = "method")]
    size: Option<(usize, usize)>,
    /// The seed of the sampler, overriding the scene's.
    #[arg(long, value_name = "N", conflicts_with = "method")]
    seed: Option<u64>,
    /// Set a parameter of the scene: `camera.fov=30`; may be repeated.
    #[arg(
        short = 'D',
        long = "define",
        value_name = "NAME.PARAMETER=VALUE",
        conflicts_with = "method"
    )]
    defines: Vec<String>,
    /// The class, if the file has several.
    #[arg(long, conflicts_with = "pixel")]
    class: Option<String>,
    /// A parameter of the instance; may be repeated.
    #[arg(long = "param", value_name = "NAME=VALUE", value_parser = parse_setting, conflicts_with = "pixel")]
    params: Vec<(String, JsonValue)>,
    /// An argument of a function that is no method; may be repeated.
    #[arg(long = "arg", value_name = "NAME=VALUE", value_parser = parse_setting, conflicts_with = "pixel")]
    args: Vec<(String, JsonValue)>,
    /// A state variable before the call; may be repeated.
    #[arg(long = "state", value_name = "NAME=VALUE", value_parser = parse_setting, conflicts_with = "pixel")]
    state: Vec<(String, JsonValue)>,
    /// A scratch member before the call; may be repeated.
    #[arg(long = "scratch", value_name = "NAME=VALUE", value_parser = parse_setting, conflicts_with = "pixel")]
    scratch: Vec<(String, JsonValue)>,
    /// The scene that an integrator asks; without one, rays hit nothing.
    #[arg(long, value_name = "FILE", conflicts_with = "pixel")]
    scene: Option<PathBuf>,
    /// The greatest number of entries that the recording keeps: statements, assignments, calls. Each takes about 150
    /// bytes.
    #[arg(long, value_name = "ENTRIES", default_value_t = DEFAULT_KEPT, value_parser = parse_kept)]
    keep: usize,
    /// Begin the recording after so many entries.
    #[arg(long, value_name = "ENTRIES", default_value_t = 0)]
    skip: u64,
    /// Read the commands from this file, not from standard input.
    #[arg(long, value_name = "FILE")]
    commands: Option<PathBuf>,
    #[command(flatten)]
    search_path: SearchPath,
}

/// Records the run and executes commands.
pub fn run(arguments: &DebugArguments, reporter: &Reporter) -> CommandResult {
    let commands = match &arguments.commands {
        Some(file) => {
            let text = std::fs::read_to_string(file);
            let failed = |error| Failure::Usage(format!("`{}`: {error}", file.display()));
            Commands::of_text(text.map_err(failed)?)
        }
        None => Commands::of_stdin(),
    };
    let search_path = arguments.search_path.beside(&arguments.file, reporter)?;
    let limits = TraceLimits { skip: arguments.skip, keep: arguments.keep };
    let recorded = match record(&target(arguments, &search_path), limits, &arguments.search_path) {
        Ok(recorded) => recorded,
        Err(errors) => {
            eprintln!("{}", errors.trim_end());
            return Ok(Outcome::InputAtFault);
        }
    };
    let Recorded { warnings, result, .. } = &recorded;
    eprint!("{warnings}");
    print!("{result}");
    let output = BufWriter::new(io::stdout().lock());
    let is_done = Terminal::new(recorded, output).run(commands).map_err(Failure::Output)?;
    Ok(if is_done { Outcome::Done } else { Outcome::InputAtFault })
}

fn target(arguments: &DebugArguments, search_path: &SearchPath) -> Target {
    let values = |list: &[(String, JsonValue)]| list.iter().cloned().collect();
    match arguments.pixel {
        Some(pixel) => Target::Pixel(Box::new(PixelTarget {
            request: RenderRequest {
                scene: arguments.file.clone(),
                load: LoadOptions {
                    integrator: arguments.renderer.clone().or_else(|| arguments.integrator.clone()),
                    defines: arguments.defines.clone(),
                    search_path: search_path.folders(),
                    ..LoadOptions::default()
                },
                size: arguments.size,
                samples: arguments.spp,
                seed: arguments.seed,
                ..RenderRequest::default()
            },
            pixel,
            sample: arguments.sample,
        })),
        None => Target::Method(Box::new(Request {
            file: Some(arguments.file.clone()),
            class: arguments.class.clone(),
            method: arguments.method.clone(),
            params: values(&arguments.params),
            args: values(&arguments.args),
            state: values(&arguments.state),
            scratch: values(&arguments.scratch),
            scene: arguments.scene.clone(),
            ..Request::default()
        })),
    }
}

fn parse_kept(text: &str) -> Result<usize, String> {
    let kept = text.parse().ok().filter(|kept| (1..=MAX_KEPT).contains(kept));
    kept.ok_or_else(|| format!("expected a number from 1 to {MAX_KEPT}"))
}
