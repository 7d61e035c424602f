//! The subcommands, one file or folder each.

pub mod bench;
pub mod build;
pub mod check;
pub mod dap;
pub mod debug;
mod deferral;
pub mod eval;
pub mod explain;
pub mod fmt;
pub mod help;
pub mod import;
pub mod info;
pub mod lsp;
pub mod materialx;
pub mod pixel;
pub mod render;
pub mod scene;
mod shader;
pub mod test;
pub mod view;
