//! The integration tests of `rtsl-cli`, as one program: linking is most of the work of building tests.

mod bench;
mod cache;
#[cfg(unix)]
mod cluster;
mod command;
mod commands;
mod dap;
mod debug;
mod documented_commands;
mod files;
mod fmt;
mod framing;
mod functions;
mod guide;
mod import;
mod info;
mod integrators;
mod lsp;
mod materialx;
mod memory_limits;
mod messages;
mod neovim;
mod printing;
mod project_file;
mod readme;
mod resume;
mod scene;
#[cfg(target_os = "linux")]
mod signals;
