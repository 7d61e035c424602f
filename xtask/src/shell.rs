//! Calls of other programs.

use std::ffi::{OsStr, OsString};
use std::path::{Path, PathBuf};
use std::process::{self, Stdio};

/// The reason why a command failed, for people.
#[derive(Debug)]
pub struct Failure(pub String);

/// The outcome of a command.
pub type Result<T> = std::result::Result<T, Failure>;

/// A call of a program.
pub struct Command {
    program: OsString,
    arguments: Vec<OsString>,
    variables: Vec<(&'static str, OsString)>,
}

impl Command {
    /// A call without arguments.
    pub fn new(program: impl AsRef<OsStr>) -> Command {
        let program = program.as_ref().to_owned();
        Command { program, arguments: Vec::new(), variables: Vec::new() }
    }

    /// Adds arguments.
    pub fn args<A: AsRef<OsStr>>(mut self, arguments: impl IntoIterator<Item = A>) -> Command {
        self.arguments.extend(arguments.into_iter().map(|it| it.as_ref().to_owned()));
        self
    }

    /// Sets an environment variable of the program.
    pub fn env(mut self, name: &'static str, value: impl AsRef<OsStr>) -> Command {
        self.variables.push((name, value.as_ref().to_owned()));
        self
    }

    /// Names the LLVM of the Rust toolchain in `RTSL_LLVM`, unless that is set or the toolchain has none.
    pub fn toolchain_llvm(self) -> Command {
        match toolchain_llvm() {
            Some(folder) if std::env::var_os("RTSL_LLVM").is_none() => {
                self.env("RTSL_LLVM", folder)
            }
            _ => self,
        }
    }

    /// Prints the call, runs the program in the repository's root, and waits for its end.
    ///
    /// # Errors
    ///
    /// If the program can't be started or fails.
    pub fn run(self) -> Result<()> {
        let text = self.text();
        eprintln!("$ {text}");
        let status = self.process().status();
        match status {
            Ok(status) if status.success() => Ok(()),
            Ok(status) => Err(Failure(format!("`{text}` failed: {status}"))),
            Err(error) => Err(Failure(format!("`{text}` does not start: {error}"))),
        }
    }

    /// Runs the program and returns what it prints.
    ///
    /// # Errors
    ///
    /// If the program can't be started, fails, or prints anything but UTF-8.
    pub fn output(self) -> Result<String> {
        let text = self.text();
        let output = self.process().stderr(Stdio::inherit()).output();
        let output =
            output.map_err(|error| Failure(format!("`{text}` does not start: {error}")))?;
        match String::from_utf8(output.stdout) {
            Ok(printed) if output.status.success() => Ok(printed),
            _ => Err(Failure(format!("`{text}` failed: {}", output.status))),
        }
    }

    fn process(&self) -> process::Command {
        let mut process = process::Command::new(&self.program);
        process.args(&self.arguments);
        process.envs(self.variables.iter().map(|(name, value)| (name, value)));
        process
    }

    /// The call as a line of a shell.
    fn text(&self) -> String {
        let variables = self.variables.iter();
        let variables = variables.map(|(name, value)| format!("{name}={}", quoted(value)));
        // The path that Cargo gives for itself says nothing.
        let is_cargo = self.program == cargo_program();
        let program = if is_cargo { "cargo".to_owned() } else { quoted(&self.program) };
        let arguments = self.arguments.iter().map(|it| quoted(it));
        variables.chain([program]).chain(arguments).collect::<Vec<_>>().join(" ")
    }
}

/// A call of the Cargo that runs this program.
pub fn cargo<const N: usize>(arguments: [&str; N]) -> Command {
    Command::new(cargo_program()).args(arguments)
}

fn cargo_program() -> OsString {
    std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into())
}

fn quoted(word: &OsStr) -> String {
    let word = word.to_string_lossy();
    if word.is_empty() || word.contains([' ', '\'', '"', '$', '*', '(', ')', '&', ';']) {
        return format!("'{}'", word.replace('\'', r"'\''"));
    }
    word.into_owned()
}

/// Prints the title of a step.
pub fn say(title: &str) {
    println!("\n== {title}");
}

/// The repository's root.
pub fn root() -> PathBuf {
    // Asked for when it runs: a build folder that was copied may bring a program compiled elsewhere.
    let package = std::env::var_os("CARGO_MANIFEST_DIR");
    let package = package.unwrap_or_else(|| env!("CARGO_MANIFEST_DIR").into());
    Path::new(&package).join("..")
}

/// The files that Git tracks and whose paths match a pattern, relative to the repository's root.
///
/// # Errors
///
/// If Git can't be run.
pub fn tracked_files(patterns: &[&str]) -> Result<Vec<String>> {
    let output = Command::new("git").args(["ls-files", "-z", "--"]).args(patterns).output()?;
    Ok(output.split_terminator('\0').map(str::to_owned).collect())
}

/// True if there is a file or folder of this path, seen from the repository's root.
pub fn exists(path: &str) -> bool {
    root().join(path).exists()
}

/// True if `PROGRAM --version` succeeds.
pub fn is_installed(program: &str) -> bool {
    let mut process = process::Command::new(program);
    process.arg("--version").stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::null());
    process.status().is_ok_and(|status| status.success())
}

/// The folder of the Rust toolchain that holds a libLLVM.
fn toolchain_llvm() -> Option<PathBuf> {
    let sysroot = Command::new("rustc").args(["--print", "sysroot"]).output().ok()?;
    let folder = Path::new(sysroot.trim()).join("lib");
    let mut files = std::fs::read_dir(&folder).ok()?.flatten();
    files.any(|file| file.file_name().to_string_lossy().starts_with("libLLVM")).then_some(folder)
}
