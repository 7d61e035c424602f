//! An interactive session: a scene that is rendered while camera, parameters and shaders change.
//!
//! The session does not depend on a window and starts no background thread. The host calls [`Session::advance`]
//! repeatedly, each time with the time that it can spare, and copies [`Session::film`] to its screen. After a change
//! the next call renders a whole frame, at a lower resolution if a full frame would take too long, so that the image is
//! always consistent; then samples are added, pass by pass, up to the scene's number.
//!
//! Samples are those of an offline render: after all passes the film has the bits of [`crate::schedule::render()`].

mod control;
mod enlargement;
mod film;
mod options;
mod picked;
mod probe;
mod renderer;
mod resolution;
mod scatter;
#[allow(clippy::module_inception, reason = "the noun of the folder is the noun of the file")]
mod session;
mod status;
mod tile_sample;
mod view_mode;

pub use control::{Control, ControlKind, Thing};
pub use film::{Dropped, DroppedPixel, Film};
pub use options::SessionOptions;
pub use picked::Picked;
pub use probe::{Probe, ProbedPixel};
pub use session::{Reloaded, Session};
pub use status::Status;
pub use view_mode::{Display, ViewMode};
