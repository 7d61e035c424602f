//! `rtsl render --cluster`: starts the Python package, which renders on a cluster of Ray.

use std::ffi::{OsStr, OsString};
use std::path::{Path, PathBuf};
use std::process::Command;

use clap::ValueEnum;
use rtsl::{Diagnostic, diagnostic_codes as codes};

use super::{CHECKPOINT_EVERY, RenderArguments, check_output};
use crate::arguments::SearchPath;
use crate::outcome::{CommandResult, Failure, Outcome};
use crate::report::Reporter;

/// The environment variable that names the interpreter of Python.
const PYTHON_VARIABLE: &str = "RTSL_PYTHON";

/// Prints the versions of the packages, or lines without one.
const PROBE: &str = "import importlib.metadata as metadata
for name in ('rtsl', 'ray'):
    try:
        print(metadata.version(name))
    except metadata.PackageNotFoundError:
        print()
";

/// Renders on the cluster and writes the picture.
pub fn render_on(address: &str, arguments: &RenderArguments, reporter: &Reporter) -> CommandResult {
    if let Some(output) = &arguments.output {
        check_output(output)?;
    }
    let search_path = arguments.load.search_path.beside(&arguments.scene, reporter)?;
    let python = std::env::var_os(PYTHON_VARIABLE).map_or_else(usual_python, PathBuf::from);
    check_packages(&python)?;
    let mut command = Command::new(&python);
    command.args(["-m", "rtsl.cluster", "--version-of-command", env!("CARGO_PKG_VERSION")]);
    command.args(options(arguments, &search_path)).arg("--").arg(address).arg(&arguments.scene);
    run(&mut command).map_err(|error| no_python(&python, &error).into())
}

/// Runs the interpreter in the place of this process: signals that tell it to end reach the interpreter, which writes
/// the picture as it is.
#[cfg(unix)]
fn run(command: &mut Command) -> std::io::Result<Outcome> {
    use std::os::unix::process::CommandExt;

    Err(command.exec())
}

/// Runs the interpreter. An interrupt is sent to it, too, and it writes the picture as it is.
#[cfg(not(unix))]
fn run(command: &mut Command) -> std::io::Result<Outcome> {
    crate::signals::told_to_end();
    Ok(match command.status()?.success() {
        true => Outcome::Done,
        // The interpreter has said why.
        false => Outcome::InputAtFault,
    })
}

fn usual_python() -> PathBuf {
    PathBuf::from(if cfg!(windows) { "python" } else { "python3" })
}

/// Checks that the interpreter has the package in the version of the command, and Ray.
fn check_packages(python: &Path) -> Result<(), Failure> {
    let probed = Command::new(python).args(["-c", PROBE]).output();
    let probed = probed.map_err(|error| no_python(python, &error))?;
    let versions = String::from_utf8_lossy(&probed.stdout);
    let mut versions = versions.lines();
    let (own, version) = (versions.next().unwrap_or_default(), env!("CARGO_PKG_VERSION"));
    let place = python.display();
    if own != version {
        let message = match own {
            "" => format!("the interpreter `{place}` has no package `rtsl`"),
            own => format!(
                "the interpreter `{place}` has version {own} of the package `rtsl`, and the command version {version}"
            ),
        };
        let help = format!(
            "install the package of this version with `pip install './python[ray,llvm]'`, or name the interpreter \
             that has it with `{PYTHON_VARIABLE}`"
        );
        return Err(Diagnostic::new(codes::NO_CLUSTER, message).help(help).into());
    }
    if versions.next().unwrap_or_default().is_empty() {
        let message = format!("the interpreter `{place}` has no package `ray`");
        return Err(Diagnostic::new(codes::NO_CLUSTER, message).help("`pip install ray`").into());
    }
    Ok(())
}

fn no_python(python: &Path, error: &std::io::Error) -> Diagnostic {
    let message = format!("cannot start the interpreter `{}`: {error}", python.display());
    let help = format!("install Python, or name its interpreter with `{PYTHON_VARIABLE}`");
    Diagnostic::new(codes::NO_CLUSTER, message).help(help)
}

/// The options of the package for those of the command. The command line refuses the others with `--cluster`.
fn options(arguments: &RenderArguments, search_path: &SearchPath) -> Vec<OsString> {
    let mut options = Options(Vec::new());
    options.add("--output", arguments.output.as_ref());
    options.add("--spp", text(arguments.spp));
    options.add("--size", arguments.size.map(|(width, height)| format!("{width}x{height}")));
    options.add("--seed", text(arguments.seed));
    let aovs: Vec<&str> = arguments.aov.iter().map(rtsl_image::Aov::name).collect();
    options.add("--aov", (!aovs.is_empty()).then(|| aovs.join(",")));
    options.add("--renderer", arguments.renderer.as_ref());
    options.add("--integrator", arguments.load.integrator.as_ref());
    options.add("--camera", arguments.load.camera.as_ref());
    options.add_flag("--studio", arguments.load.studio);
    arguments.load.defines.iter().for_each(|define| options.add("--define", Some(define)));
    search_path.folders().iter().for_each(|folder| options.add("--include", Some(folder)));
    options.add("--noise", text(arguments.noise));
    options.add("--time", arguments.time.map(|time| time.as_secs_f64().to_string()));
    options.add("--threads", text(arguments.threads));
    options.add("--checkpoint", arguments.checkpoint.as_ref());
    let every = arguments.checkpoint_every.unwrap_or(CHECKPOINT_EVERY);
    options.add("--checkpoint-every", Some(every.as_secs_f64().to_string()));
    options.add_flag("--resume", arguments.resume);
    options.add("--stats", arguments.stats.as_ref());
    options.add("--exposure", Some(arguments.exposure.to_string()));
    options.add("--view", Some(name(&arguments.view)));
    options.add("--exr", Some(name(&arguments.exr)));
    options.add_flag("--exr-parts", arguments.exr_parts);
    options.add("--backend", Some(name(&arguments.engine.backend)));
    options.add("--width", text(arguments.engine.width));
    options.add("--math", Some(name(&arguments.engine.code.math)));
    options.0
}

struct Options(Vec<OsString>);

impl Options {
    /// Adds an option with its value, in one argument: a value may begin with a hyphen.
    fn add(&mut self, name: &str, value: Option<impl AsRef<OsStr>>) {
        if let Some(value) = value {
            let mut option = OsString::from(format!("{name}="));
            option.push(value);
            self.0.push(option);
        }
    }

    fn add_flag(&mut self, name: &str, is_given: bool) {
        self.0.extend(is_given.then(|| name.into()));
    }
}

fn text(value: Option<impl ToString>) -> Option<String> {
    value.map(|value| value.to_string())
}

/// The name of a value on the command line.
fn name(value: &impl ValueEnum) -> String {
    value.to_possible_value().map_or_else(String::new, |it| it.get_name().to_owned())
}
