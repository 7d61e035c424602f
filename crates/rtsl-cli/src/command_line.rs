//! The command line.

use std::path::Path;

use clap::error::ErrorKind;
use clap::{ArgAction, CommandFactory, Parser, Subcommand};

use crate::arguments::Color;
use crate::commands::bench::BenchArguments;
use crate::commands::build::BuildArguments;
use crate::commands::check::CheckArguments;
use crate::commands::dap::DapArguments;
use crate::commands::debug::DebugArguments;
use crate::commands::eval::EvalArguments;
use crate::commands::explain::ExplainArguments;
use crate::commands::fmt::FmtArguments;
use crate::commands::help::HelpArguments;
use crate::commands::import::ImportArguments;
use crate::commands::info::InfoArguments;
use crate::commands::lsp::LspArguments;
use crate::commands::materialx::MaterialXArguments;
use crate::commands::render::RenderArguments;
use crate::commands::scene::SceneArguments;
use crate::commands::test::TestArguments;
use crate::commands::view::ViewArguments;

/// RTSL, the Ray Tracing Shading Language: check, compile, run and render.
#[derive(Debug, Parser)]
#[command(name = "rtsl", version, disable_help_subcommand = true)]
pub struct Arguments {
    /// Colours of diagnostics; `auto`: on a terminal, unless NO_COLOR is set
    #[arg(long, global = true, value_enum, default_value_t = Color::Auto)]
    pub color: Color,
    /// Write each stage of the work to standard error when it ends, with its time; twice: the passes of the compiler
    /// and the wavefronts of the path renderer, too
    #[arg(short, long, global = true, action = ArgAction::Count)]
    pub verbose: u8,
    /// Compile everything anew. Otherwise machine code is kept in `~/.cache/rtsl/kernels`, or the folder that the
    /// environment variable RTSL_CACHE names, for the next time that it is needed. Never changes results
    #[arg(long, global = true)]
    pub no_cache: bool,
    /// The subcommand.
    #[command(subcommand)]
    pub command: Command,
}

/// Parses the command line of this process. A wrong one ends the process.
pub fn parse() -> Arguments {
    let given = || std::env::args_os().skip(1);
    let dashed = given().find_map(|argument| as_option(argument.to_str()?));
    match dashed {
        Some(problem) => Arguments::command().error(ErrorKind::UnknownArgument, problem).exit(),
        None => Arguments::parse(),
    }
}

/// The problem of an argument that begins with a dash of print, which word processors and web pages write in place of
/// `-` or `--`, unless a file has this name.
fn as_option(argument: &str) -> Option<String> {
    const DASHES: [char; 6] =
        ['\u{2010}', '\u{2011}', '\u{2012}', '\u{2013}', '\u{2014}', '\u{2212}'];
    let name = argument.trim_start_matches(DASHES);
    if name.len() == argument.len() || Path::new(argument).exists() {
        return None;
    }
    let dash = if name.trim_start_matches('-').chars().nth(1).is_some() { "--" } else { "-" };
    let option = format!("{dash}{}", name.trim_start_matches('-'));
    Some(format!("`{argument}` begins with a dash of print: write `{option}`"))
}

/// The subcommands.
#[derive(Debug, Subcommand)]
pub enum Command {
    /// Check shaders and scenes and report what is wrong with them.
    Check(CheckArguments),
    /// Format shaders.
    Fmt(FmtArguments),
    /// Show a stage of compiling a shader, or write it to a file.
    Build(BuildArguments),
    /// Call one method on given values and print its results.
    Eval(EvalArguments),
    /// Walk over a recorded call of a method, or sample of a pixel, forwards and backwards.
    Debug(DebugArguments),
    /// Serve the debugger to an editor, in the Debug Adapter Protocol.
    Dap(DapArguments),
    /// Check the contracts between classes and renderers: sampling densities, bounds, energy conservation and others.
    Test(TestArguments),
    /// Measure the time of methods per ray, for each call mode and width, or the speed of an integrator or a scene.
    Bench(BenchArguments),
    /// Render a scene to a picture.
    Render(RenderArguments),
    /// Show what is in a scene, or convert it to the format of pbrt-v4.
    Scene(SceneArguments),
    /// Translate a program of Shadertoy to a class.
    Import(ImportArguments),
    /// Translate the materials of a MaterialX document to classes.
    #[command(name = "materialx")]
    MaterialX(MaterialXArguments),
    /// Show a scene in a window: fly through it, set parameters, edit its shaders.
    View(ViewArguments),
    /// Show information on this program and the machine, or on a class.
    Info(InfoArguments),
    /// Serve an editor: the Language Server Protocol on standard input and output.
    Lsp(LspArguments),
    /// Explain the code of an error or a warning.
    Explain(ExplainArguments),
    /// Print the help of a command, or a part of the book.
    Help(HelpArguments),
}

impl Command {
    /// True if the command runs methods, for which machine code is kept.
    pub fn runs_code(&self) -> bool {
        match self {
            Command::Eval(_)
            | Command::Debug(_)
            | Command::Dap(_)
            | Command::Test(_)
            | Command::Bench(_)
            | Command::Render(_)
            | Command::View(_)
            | Command::Lsp(_) => true,
            Command::Check(_)
            | Command::Fmt(_)
            | Command::Build(_)
            | Command::Scene(_)
            | Command::Import(_)
            | Command::MaterialX(_)
            | Command::Info(_)
            | Command::Explain(_)
            | Command::Help(_) => false,
        }
    }

    /// True if the command prints the times of its stages.
    pub fn wants_timings(&self) -> bool {
        matches!(self, Command::Build(arguments) if arguments.timings)
    }
}
