//! The language server of RTSL: [`run`] speaks the Language Server Protocol 3.17 over standard input and output.
//!
//! One thread answers one message after another; analyses take milliseconds, and what takes longer runs in processes of
//! its own meanwhile. Diagnostics are published when no message waits, so that each pause of typing has one analysis.
//!
//! # Source
//!
//! `server` has the loop over messages; `workspace` the texts, open ones and those on disk; `answer` the answers
//! of `rtsl_ide` as messages; `place` offsets as positions and paths as URIs; `library` the files of the standard
//! library, which editors open from a folder.
//!
//! Costs of lines and values of pixels come from runs of the program in processes of their own: `child` runs one,
//! `jobs` has those that run for requests, `look` reads their output and keeps the notes beside lines, and `editor`
//! tells of their progress.

mod answer;
mod capabilities;
mod child;
mod editor;
mod jobs;
mod library;
mod look;
mod place;
mod server;
mod workspace;

use std::path::{Path, PathBuf};

use lsp_server::Connection;

pub use server::ServerError;

/// A function from a shader to the folders in which its includes and modules are searched.
pub type SearchPath = Box<dyn Fn(&Path) -> Vec<PathBuf>>;

/// The parts of the server that its caller gives.
pub struct ServerOptions {
    /// Returns the folders in which a shader's includes and modules are searched.
    pub search_path: SearchPath,
    /// The user's folder for files that may be made again, in which files of the standard library are written for
    /// editors to show; a temporary folder if `None`.
    pub cache_folder: Option<PathBuf>,
    /// The program `rtsl`, whose commands `bench` and `render` give costs of lines and values of pixels.
    pub program: PathBuf,
}

/// Serves an editor on standard input and output until it ends the connection.
///
/// # Errors
/// If messages break the protocol, or cannot be read or written.
pub fn run(options: ServerOptions) -> Result<(), ServerError> {
    let (connection, threads) = Connection::stdio();
    let result = serve(&connection, options);
    drop(connection);
    threads.join()?;
    result
}

/// Serves an editor on a connection.
///
/// # Errors
/// As [`run`].
pub fn serve(connection: &Connection, options: ServerOptions) -> Result<(), ServerError> {
    server::Server::start(connection, options)?.run()
}
