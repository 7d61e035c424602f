//! The schedule of a render: tiles, their order, threads, parts that are rendered elsewhere, and checkpoints.

pub(crate) mod checkpoints;
pub(crate) mod partial_render;
pub(crate) mod render;
pub(crate) mod render_identity;
pub(crate) mod render_threads;
pub(crate) mod tile;
pub(crate) mod tile_order;
pub(crate) mod tile_samples;
pub(crate) mod visits;

pub use checkpoints::Checkpoints;
pub use partial_render::{Part, PartialRender, WorkCounts};
pub use render::{RenderOptions, RenderedImage, render};
pub use render_identity::RenderIdentity;
pub use tile::TILE;
