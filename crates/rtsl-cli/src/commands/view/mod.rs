//! `rtsl view`: shows a scene in a window, if the program is built with the feature `view`.

#[cfg(feature = "view")]
mod window;

use std::path::PathBuf;

use clap::{Args, ValueEnum};

use crate::arguments::{EngineArguments, LoadArguments};
use crate::commands::pixel::parse_pixel;
use crate::commands::render::{parse_size, parse_threads};
use crate::outcome::CommandResult;
use crate::report::Reporter;

/// The command line of `rtsl view`.
#[derive(Debug, Args)]
#[command(after_help = "\
Drag to orbit, turn the wheel to come nearer, fly with w a s d, click to pick; h shows all keys.
Scenes that name no integrator by its class are shown by the interactive renderer.
Shaders beside the scene are watched: save one, in the editor of the window or in another, and the picture changes.")]
pub struct ViewArguments {
    /// The scene, in the format of pbrt-v4 with RTSL's class names, a glTF file, or a mesh (PLY, OBJ or STL), which is
    /// shown in a studio.
    #[arg(value_name = "SCENE")]
    scene: PathBuf,
    #[command(flatten)]
    load: LoadArguments,
    /// Columns and rows of the picture, overriding the scene's. Panes of the window are beside it.
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
    /// Open the pane at the right at first.
    #[arg(long, value_enum)]
    pane: Option<PaneName>,
    /// Show the parameters of this part of the scene at first, by its name or its class.
    #[arg(long, value_name = "NAME")]
    select: Option<String>,
    /// Show this quantity at first.
    #[arg(long, value_enum, value_name = "QUANTITY")]
    show: Option<ShownName>,
    /// Open a shader in the editor, at a line.
    #[arg(long, value_name = "FILE[:LINE]", value_parser = parse_place)]
    edit: Option<(PathBuf, Option<usize>)>,
    /// Inspect this pixel, and replay a sample of it in the editor: from the line of `--edit` on, or from its start.
    /// Columns and rows count from 0, from the top left.
    #[arg(long, value_name = "X,Y", value_parser = parse_pixel)]
    inspect: Option<[usize; 2]>,
    /// The sample of the pixel that is inspected, from 0.
    #[arg(long, value_name = "N", default_value_t = 0, requires = "inspect")]
    sample: u32,
    /// The exposure in stops, added to the scene's.
    #[arg(long, default_value_t = 0.0, allow_negative_numbers = true)]
    exposure: f32,
    #[command(flatten)]
    engine: EngineArguments,
}

/// The panes at the right, on command lines.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum PaneName {
    /// The parameters of the scene.
    Parameters,
    /// A pixel, and a replay of a sample of it.
    Inspector,
    /// The costs of shaders.
    Costs,
    /// The samples that are not finite.
    NotFinite,
}

/// The quantities that are displayed, on command lines.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum ShownName {
    /// The image.
    Image,
    /// The time per pixel.
    Time,
    /// The nodes of the hierarchy that each camera ray visits.
    Nodes,
    /// The share of SIMD lanes in use.
    Lanes,
    /// The pixels with samples that are not finite.
    NotFinite,
}

/// Parses a file with a line.
fn parse_place(text: &str) -> Result<(PathBuf, Option<usize>), String> {
    let line = text.rsplit_once(':').and_then(|(file, line)| Some((file, line.parse().ok()?)));
    match line {
        Some((_, 0)) => Err("lines count from 1".to_owned()),
        Some((file, line)) if !file.is_empty() => Ok((PathBuf::from(file), Some(line))),
        _ => Ok((PathBuf::from(text), None)),
    }
}

/// Opens the window and waits until it is closed.
#[cfg(feature = "view")]
pub fn run(arguments: &ViewArguments, reporter: &Reporter) -> CommandResult {
    window::show(arguments, reporter)
}

/// Tells how to build a program that has the viewer.
#[cfg(not(feature = "view"))]
pub fn run(_: &ViewArguments, reporter: &Reporter) -> CommandResult {
    reporter.message("error", "this `rtsl` was built without its viewer");
    let help = "`cargo view SCENE` in RTSL's repository builds and opens it; for other builds of `rtsl`, add \
                `--features view`";
    reporter.message("help", help);
    Ok(crate::outcome::Outcome::InputAtFault)
}
