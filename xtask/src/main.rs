//! The daily commands of RTSL's developers: `cargo xtask COMMAND`.
//!
//! Each command is a short list of calls of other programs, which are printed before they run, so that any of
//! them can be repeated by hand.

mod crates;
mod features;
mod long;
mod package;
mod prose;
mod python;
mod shell;

use std::process::ExitCode;

use shell::{Command, Failure, Result, cargo, say};

const HELP: &str = "\
The daily commands of RTSL's developers.

    cargo xtask COMMAND [ARGUMENTS]

  check [--texts]    formatting, lints, API documentation, prose, dependencies and their features;
                     --texts leaves out lints and API documentation, which take compilations
  test [ARGUMENTS]   all tests; with arguments, `cargo test ARGUMENTS`
  bless [ARGUMENTS]  as test, but writes the expectations, and lists the files that changed
  crates             renews the picture of the crates in the manual
  book [ARGUMENTS]   builds the manual with mdBook; `book serve` shows it in a browser
  package [--verify] makes the packages that would be published; --verify builds each from its package
  python [TEST...]   the tests and notebooks of the Python package, in a virtual environment that is made once;
                     --environment makes that and runs nothing
  long [PART...]     the tests that take too long for every day; `long --help` lists the parts

Commands print what they call. `test`, `bless`, `python` and `long` use the LLVM of the Rust toolchain, unless the
environment variable RTSL_LLVM names another.

Before a pull request: `cargo xtask check`, then `cargo xtask test`.
";

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    match run(&arguments) {
        Ok(()) => ExitCode::SUCCESS,
        Err(Failure(message)) => {
            eprintln!("error: {message}");
            ExitCode::FAILURE
        }
    }
}

fn run(arguments: &[String]) -> Result<()> {
    std::env::set_current_dir(shell::root())
        .map_err(|error| Failure(format!("the repository's folder: {error}")))?;
    let Some((command, rest)) = arguments.split_first() else {
        print!("{HELP}");
        return Ok(());
    };
    match command.as_str() {
        "help" | "-h" | "--help" => {
            print!("{HELP}");
            Ok(())
        }
        "check" if rest.is_empty() => check(),
        "check" if rest == ["--texts"] => check_texts(),
        "test" => test(rest),
        "bless" => bless(rest),
        "crates" if rest.is_empty() => crates::draw(),
        "book" => book(rest),
        "package" => package::run(rest),
        "python" => python::run(rest),
        "long" => long::run(rest),
        "check" => Err(Failure("`cargo xtask check` takes nothing but `--texts`".to_owned())),
        "crates" => Err(Failure("`cargo xtask crates` takes no arguments".to_owned())),
        other => {
            Err(Failure(format!("no command `{other}`; `cargo xtask help` lists the commands")))
        }
    }
}

fn check() -> Result<()> {
    check_texts()?;
    say("lints");
    cargo(["clippy", "--workspace", "--all-targets", "--quiet", "--", "-D", "warnings"]).run()?;
    say("documentation");
    cargo(["doc", "--workspace", "--no-deps", "--quiet"]).env("RUSTDOCFLAGS", "-D warnings").run()
}

/// The checks that need no compilation.
fn check_texts() -> Result<()> {
    say("dependencies between the crates");
    crates::check()?;
    say("features of dependencies");
    features::check()?;
    say("prose");
    prose::check()?;
    say("format");
    cargo(["fmt", "--all", "--check"]).run()
}

fn test(arguments: &[String]) -> Result<()> {
    // The members that are no default members too, in one call, so that dependencies are built once. The bindings of
    // Python, whose tests are those of the Python package, ask for other features of dependencies.
    let all = ["--workspace", "--exclude", "rtsl-python"].map(str::to_owned);
    let arguments = if arguments.is_empty() { &all[..] } else { arguments };
    cargo(["test"]).args(arguments).toolchain_llvm().run()
}

fn bless(arguments: &[String]) -> Result<()> {
    let tests = cargo(["test"]).args(arguments).toolchain_llvm().env("UPDATE_EXPECT", "1").run();
    say("files that differ from the last commit");
    Command::new("git").args(["status", "--short"]).run()?;
    tests
}

fn book(arguments: &[String]) -> Result<()> {
    let folders = [".", "docs", "book"];
    let Some(folder) = folders.iter().find(|it| shell::exists(&format!("{it}/book.toml"))) else {
        return Err(Failure("there is no book.toml in this checkout".to_owned()));
    };
    if !shell::is_installed("mdbook") {
        return Err(Failure("mdBook is missing: `cargo install --locked mdbook`".to_owned()));
    }
    let arguments = if arguments.is_empty() { &["build".to_owned()] } else { arguments };
    Command::new("mdbook").args(arguments).args([*folder]).run()
}
