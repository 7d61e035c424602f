//! `rtsl lsp`: the language server.

use std::path::{Path, PathBuf};

use clap::Args;
use rtsl_lsp::ServerOptions;

use crate::arguments::SearchPath;
use crate::outcome::{CommandResult, Failure, Outcome};
use crate::project_file::ProjectFile;

/// The command line of `rtsl lsp`.
#[derive(Debug, Args)]
pub struct LspArguments {
    #[command(flatten)]
    search_path: SearchPath,
    /// The only way of messages, which editors name: standard input and output.
    #[arg(long)]
    stdio: bool,
}

/// Serves an editor until it ends the connection.
pub fn run(arguments: &LspArguments) -> CommandResult {
    let given = arguments.search_path.clone();
    let search_path =
        move |shader: &Path| given.with(ProjectFile::beside(shader, &given.folders())).folders();
    let program = std::env::current_exe().unwrap_or_else(|_| PathBuf::from("rtsl"));
    let search_path = Box::new(search_path);
    let options = ServerOptions { search_path, cache_folder: cache_folder(), program };
    match rtsl_lsp::run(options) {
        Ok(()) => Ok(Outcome::Done),
        Err(error) => Err(Failure::Usage(format!(
            "the connection to the editor ended: {error}; `rtsl lsp` is started by editors"
        ))),
    }
}

/// The user's folder for files that may be made again, if the environment names one.
fn cache_folder() -> Option<PathBuf> {
    let named = |variable: &str| std::env::var_os(variable).filter(|value| !value.is_empty());
    let home = || named("HOME").map(|home| PathBuf::from(home).join(".cache"));
    let cache = named("XDG_CACHE_HOME").map(PathBuf::from);
    let local = || named("LOCALAPPDATA").map(PathBuf::from);
    cache.or_else(home).or_else(local)
}
