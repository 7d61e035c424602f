//! `rtsl scene`: the contents of a scene, and its conversion to the format of pbrt-v4.

mod contents;
mod convert;
mod info;

use clap::{Args, Subcommand};

use self::convert::ConvertArguments;
use self::info::InfoArguments;
use crate::outcome::CommandResult;
use crate::report::Reporter;

/// The command line of `rtsl scene`.
#[derive(Debug, Args)]
pub struct SceneArguments {
    /// The subcommand.
    #[command(subcommand)]
    command: SceneCommand,
}

/// The subcommands.
#[derive(Debug, Subcommand)]
enum SceneCommand {
    /// Show what is in a scene: settings, classes, triangles, images, lights, files, and what is not supported.
    Info(InfoArguments),
    /// Convert a scene of pbrt version 1, 2 or 3, or a glTF file, to the format of pbrt-v4.
    Convert(ConvertArguments),
}

/// Runs the subcommand.
pub fn run(arguments: &SceneArguments, reporter: &Reporter) -> CommandResult {
    match &arguments.command {
        SceneCommand::Info(arguments) => info::run(arguments, reporter),
        SceneCommand::Convert(arguments) => convert::run(arguments, reporter),
    }
}
