//! Secondary rays, as the host of shaders sees them.

use rtsl_bvh::{LaneMask, RayPacket};

use super::workspace::Workspace;
use crate::compiled::tracer::Tracer;
use crate::lanes::eight::LaneVectors;
use crate::tiles::LaneContext;

/// A colour for each lane, channel by channel.
pub type PacketColors = LaneVectors;

/// Computes the radiance of secondary rays requested by `trace`.
pub trait SpawnedRays {
    /// Returns the radiance along the rays of `lanes`, whose depth is `depth`.
    fn radiance(
        &self,
        tracer: &Tracer<'_>,
        workspace: &mut Workspace,
        rays: &RayPacket,
        lanes: LaneMask,
        context: &mut LaneContext,
        depth: u32,
    ) -> PacketColors;
}
