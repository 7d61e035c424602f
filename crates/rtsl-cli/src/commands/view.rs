//! `rtsl view`: shows a scene in a window.

use std::path::PathBuf;

use clap::Args;
use rtsl_image::ImageFormat;
use rtsl_render::session::{Session, SessionOptions};
use rtsl_view::{ViewError, ViewOptions, view};

use crate::arguments::{EngineArguments, InputArguments, SearchPath};
use crate::commands::render::{parse_size, parse_threads, report};
use crate::outcome::{CommandResult, Failure, Outcome};
use crate::report::Reporter;

/// The command line of `rtsl view`.
#[derive(Debug, Args)]
#[command(after_help = "\
Drag to orbit, turn the wheel to come nearer, fly with w a s d, click to pick; h shows all keys.
Shaders beside the scene are watched: save one, and the picture changes.")]
pub struct ViewArguments {
    /// The scene, in the format of pbrt-v4 with RTSL's class names.
    #[arg(value_name = "SCENE")]
    scene: PathBuf,
    /// Columns and rows of the window, overriding the scene's.
    #[arg(long, value_name = "WxH", value_parser = parse_size)]
    size: Option<(usize, usize)>,
    /// Samples per pixel that are taken while the camera does not move, overriding the scene's.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..))]
    spp: Option<u32>,
    /// The number of threads; that of all processors if not given. Never changes the picture.
    #[arg(long, value_name = "N", value_parser = parse_threads)]
    threads: Option<usize>,
    /// Close after so many frames, or when all samples are taken, whichever is first.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(1..))]
    frames: Option<u64>,
    /// Write a picture of the window to this file before it closes automatically, and when F12 is pressed.
    #[arg(long, value_name = "FILE.png")]
    screenshot: Option<PathBuf>,
    /// Set a parameter of the scene: `camera.fov=30`, `lamp.intensity=10,9,8`; may be repeated.
    #[arg(short = 'D', long = "define", value_name = "NAME.PARAMETER=VALUE")]
    defines: Vec<String>,
    /// The exposure in stops, added to the scene's.
    #[arg(long, default_value_t = 0.0, allow_negative_numbers = true)]
    exposure: f32,
    #[command(flatten)]
    engine: EngineArguments,
    #[command(flatten)]
    search_path: SearchPath,
    #[command(flatten)]
    input: InputArguments,
}

/// Opens the window and waits until it is closed.
pub fn run(arguments: &ViewArguments, reporter: &Reporter) -> CommandResult {
    let is_png = |path: &PathBuf| matches!(ImageFormat::from_path(path), Ok(ImageFormat::Png));
    if let Some(path) = arguments.screenshot.as_ref().filter(|path| !is_png(path)) {
        return Err(Failure::Usage(format!("`{}` does not end in .png", path.display())));
    }
    let options = SessionOptions {
        defines: arguments.defines.clone(),
        search_path: arguments.search_path.search_path.clone(),
        input_memory: arguments.input.input_memory,
        size: arguments.size,
        samples: arguments.spp,
        threads: arguments.threads,
        engine: arguments.engine.options(),
        exposure: arguments.exposure,
    };
    let (session, warnings) = match Session::open(&arguments.scene, options) {
        Ok(opened) => opened,
        Err(messages) => {
            report(&messages, reporter);
            return Ok(Outcome::InputAtFault);
        }
    };
    report(&warnings, reporter);
    let options = ViewOptions {
        title: format!("{} - RTSL", arguments.scene.display()),
        frames: arguments.frames,
        screenshot: arguments.screenshot.clone(),
    };
    match view(session, options) {
        Ok(()) => Ok(Outcome::Done),
        Err(error @ ViewError::NoDisplay(_)) => {
            reporter.message("error", &error.to_string());
            reporter
                .message("help", "`rtsl render` needs no display; `xvfb-run rtsl view` brings one");
            Ok(Outcome::InputAtFault)
        }
        Err(error @ ViewError::Screenshot(_)) => Err(Failure::Output(std::io::Error::other(error))),
    }
}
