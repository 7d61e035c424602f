//! Tiles of an image, the camera rays of their pixels, and the threads that render them.

mod camera;
mod camera_rays;
mod render_threads;
mod tile;
mod tile_samples;

pub use camera::Camera;
pub use camera_rays::{CameraMemory, CameraRays, camera_packet};
pub use render_threads::RenderThreads;
pub use tile::{TILE, Tile, tiles_of};
pub use tile_samples::{TileSamples, packets_of};
