//! The `rtsl` command: a thin shell over the crates `rtsl`, `rtsl-contract`, `rtsl-debug` and `rtsl-render`, and with
//! the feature `view` over `rtsl-view`.
//!
//! Exit codes: 0 done; 1 the input has errors, which diagnostics report; 2 wrong usage. Diagnostics go to standard
//! error, results to standard output or to the file that `-o` names.

mod arguments;
mod command_line;
mod commands;
mod debug;
mod eval;
mod files;
mod json;
mod layout_json;
mod names;
mod outcome;
mod progress_line;
mod project_file;
mod report;
mod signals;
mod spans;
mod timings;
mod trace;

use std::process::ExitCode;

use clap::CommandFactory;

use crate::command_line::{Arguments, Command};
use crate::outcome::{Failure, INPUT_AT_FAULT, Outcome, WRONG_USAGE};
use crate::report::Reporter;
use crate::spans::Spans;

/// Runs the command line of this process and returns its exit code.
pub fn main() -> ExitCode {
    rtsl_memory::limit_arenas();
    let arguments = command_line::parse();
    let reporter = Reporter::new(arguments.color, arguments.verbose > 0);
    let spans = Spans::record(arguments.verbose, arguments.command.wants_timings());
    if arguments.command.runs_code() && !arguments.no_cache {
        keep_code(&reporter);
    }
    let result = match arguments.command {
        Command::Check(arguments) => commands::check::run(&arguments, &reporter),
        Command::Build(arguments) => commands::build::run(&arguments, &reporter, &spans),
        Command::Eval(arguments) => commands::eval::run(&arguments, &reporter),
        Command::Debug(arguments) => commands::debug::run(&arguments, &reporter),
        Command::Dap(arguments) => commands::dap::run(&arguments),
        Command::Test(arguments) => commands::test::run(&arguments, &reporter),
        Command::Bench(arguments) => commands::bench::run(&arguments, &reporter),
        Command::Render(arguments) => commands::render::run(&arguments, &reporter),
        Command::Scene(arguments) => commands::scene::run(&arguments, &reporter),
        Command::Fmt(arguments) => commands::fmt::run(&arguments, &reporter),
        Command::Lsp(arguments) => commands::lsp::run(&arguments),
        Command::Import(arguments) => commands::import::run(&arguments, &reporter),
        Command::MaterialX(arguments) => commands::materialx::run(&arguments, &reporter),
        Command::View(arguments) => commands::view::run(&arguments, &reporter),
        Command::Info(arguments) => commands::info::run(&arguments, &reporter),
        Command::Explain(arguments) => commands::explain::run(&arguments),
        Command::Help(arguments) => commands::help::run(&arguments, Arguments::command()),
    };
    match result {
        Ok(Outcome::Done) => ExitCode::SUCCESS,
        Ok(Outcome::InputAtFault) | Err(Failure::Reported) => ExitCode::from(INPUT_AT_FAULT),
        Err(Failure::Usage(message)) => {
            reporter.message("error", &message);
            reporter.message("help", "`rtsl help` lists the commands and topics");
            ExitCode::from(WRONG_USAGE)
        }
        Err(Failure::Diagnostics(diagnostics)) => {
            diagnostics.iter().for_each(|diagnostic| reporter.diagnostic(diagnostic));
            ExitCode::from(INPUT_AT_FAULT)
        }
        // The reader of the output has closed it: `rtsl explain | head`.
        Err(Failure::Output(error)) if error.kind() == std::io::ErrorKind::BrokenPipe => {
            ExitCode::SUCCESS
        }
        Err(Failure::Output(error)) => {
            reporter.message("error", &format!("cannot write the result: {error}"));
            ExitCode::from(INPUT_AT_FAULT)
        }
    }
}

/// Uses the cache of machine code. A folder that can't be used is worth a warning if the user named it.
fn keep_code(reporter: &Reporter) {
    if let Err(error) = rtsl::Engine::keep_code()
        && std::env::var_os("RTSL_CACHE").is_some()
    {
        reporter.message("warning", &format!("machine code is not kept: {error}"));
        reporter
            .message("help", "RTSL_CACHE is to name a folder that only you may write, of mode 700");
    }
}
