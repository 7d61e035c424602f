//! `rtsl fmt`: one style for the white space of shaders.

use std::path::{Path, PathBuf};
use std::time::Duration;

use clap::Args;
use rtsl::SourceMap;
use similar::TextDiff;

use crate::files::{read_text, text_of, unreadable, write_result};
use crate::outcome::{CommandResult, Failure, Outcome};
use crate::report::Reporter;

/// The greatest size of a file in bytes.
const MAX_BYTES: u64 = 1 << 24;
/// The greatest depth of folders.
const MAX_FOLDERS: usize = 64;

/// The command line of `rtsl fmt`.
#[derive(Debug, Args)]
pub struct FmtArguments {
    /// Shaders, and folders whose shaders (`.rtsl`) are formatted; `-` formats standard input to standard output.
    #[arg(required = true, value_name = "FILE")]
    files: Vec<PathBuf>,
    /// Change nothing: print the differences, and exit with 1 if there are any.
    #[arg(long)]
    check: bool,
}

/// Formats the files.
pub fn run(arguments: &FmtArguments, reporter: &Reporter) -> CommandResult {
    let mut files = Vec::new();
    for path in &arguments.files {
        collect(path, MAX_FOLDERS, true, &mut files)?;
    }
    let mut outcome = Outcome::Done;
    for file in &files {
        let Some(change) = formatted(file, reporter)? else {
            outcome = Outcome::InputAtFault;
            continue;
        };
        if arguments.check {
            if change.before != change.after {
                outcome = Outcome::InputAtFault;
                write_result(None, change.difference(file).as_bytes())?;
            }
        } else if is_standard_input(file) {
            write_result(None, change.after.as_bytes())?;
        } else if change.before != change.after {
            write_result(Some(file), change.after.as_bytes())?;
        }
    }
    Ok(outcome)
}

/// The time after which a comparison may find fewer equal lines: it is by the square of the lines that differ.
const MAX_TIME: Duration = Duration::from_secs(1);

/// A text before and after formatting.
struct Change {
    before: String,
    after: String,
}

impl Change {
    /// The differences, as `diff -u` writes them.
    fn difference(&self, file: &Path) -> String {
        let name = file.display().to_string();
        let difference =
            TextDiff::configure().timeout(MAX_TIME).diff_lines(&self.before, &self.after);
        difference.unified_diff().header(&name, &format!("{name} (formatted)")).to_string()
    }
}

/// Formats a file; `None` if it has errors, which are then reported.
fn formatted(file: &Path, reporter: &Reporter) -> Result<Option<Change>, Failure> {
    let before = read(file)?;
    let mut sources = SourceMap::new();
    let id = sources.add(file.display().to_string(), before.clone());
    match rtsl_format::format(id, &before) {
        Ok(after) => Ok(Some(Change { before, after })),
        Err(diagnostic) => {
            reporter.diagnostics(&sources, [&*diagnostic]);
            Ok(None)
        }
    }
}

/// Adds a file, or the shaders of a folder and its folders in the order of their names.
fn collect(
    path: &Path,
    depth: usize,
    is_named: bool,
    files: &mut Vec<PathBuf>,
) -> Result<(), Failure> {
    let is_shader = path.extension().is_some_and(|extension| extension == "rtsl");
    if !path.is_dir() || is_standard_input(path) {
        if is_named || is_shader {
            files.push(path.to_owned());
        }
        return Ok(());
    }
    // A link to a folder above would not end.
    let is_link = path.is_symlink() && !is_named;
    if depth == 0 || is_link {
        return Ok(());
    }
    let entries = std::fs::read_dir(path).and_then(Iterator::collect::<Result<Vec<_>, _>>);
    let mut paths: Vec<PathBuf> = entries
        .map_err(|error| unreadable(path, &error.to_string()))?
        .iter()
        .map(|it| it.path())
        .collect();
    paths.sort();
    for inner in paths {
        let is_hidden =
            inner.file_name().is_some_and(|name| name.to_string_lossy().starts_with('.'));
        if !is_hidden {
            collect(&inner, depth - 1, false, files)?;
        }
    }
    Ok(())
}

fn is_standard_input(path: &Path) -> bool {
    path.as_os_str() == "-"
}

fn read(file: &Path) -> Result<String, Failure> {
    match is_standard_input(file) {
        true => text_of(std::io::stdin().lock(), file, MAX_BYTES),
        false => read_text(file, MAX_BYTES),
    }
}
