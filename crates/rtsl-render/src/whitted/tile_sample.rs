//! One sample of every pixel of a tile, and sums of such samples: shared by image rendering and interactive sessions.

use rtsl::Method;
use rtsl_bvh::{LANES, LaneMask, lanes_of};
use rtsl_scene::Settings;

use super::shading::{PacketColors, radiance};
use super::workspace::Workspace;
use crate::compiled::tracer::Tracer;
use crate::lanes::eight::not_finite;
use crate::tiles::{CameraRays, Tile, camera_rays};

/// One sample of every pixel of a tile.
pub struct TileSample {
    /// The lanes whose pixels lie inside the image.
    pub lanes: LaneMask,
    /// The radiance of each, weighted by the camera; may be infinite or NaN.
    pub colors: PacketColors,
}

/// Takes one sample of every pixel of a tile. Its colours depend on the scene, the pixels and the index of the sample
/// alone.
pub fn sample_tile(
    tracer: &Tracer<'_>,
    workspace: &mut Workspace,
    tile: Tile,
    sample: u32,
) -> TileSample {
    let settings = &tracer.scene.settings;
    let lanes = tile.lanes(settings.width, settings.height);
    let mut camera = camera_rays(tracer, &mut workspace.camera, tile, sample);
    let CameraRays { rays, context, weights, .. } = &mut *camera;
    workspace.rays.camera += u64::from(lanes.count_ones());
    let mut colors = radiance(tracer, workspace, rays, lanes, context, 0);
    let finite = lanes & !not_finite(&colors, lanes);
    for (channel, weights) in colors.iter_mut().zip(weights) {
        lanes_of(lanes).for_each(|lane| channel[lane] *= weights[lane]);
    }
    let by_camera = not_finite(&colors, finite);
    if let Some(call) = tracer.scene.call(&tracer.scene.camera, Method::GenerateRay, tracer.errors)
    {
        call.report_not_finite(by_camera);
    }
    workspace.camera.keep(camera);
    develop(&mut colors, lanes, settings);
    TileSample { lanes, colors }
}

/// Makes colours of the radiances.
fn develop(colors: &mut PacketColors, lanes: LaneMask, settings: &Settings) {
    if settings.imaging.is_radiance() {
        return;
    }
    for lane in lanes_of(lanes) {
        let color = settings.imaging.develop([0, 1, 2].map(|channel: usize| colors[channel][lane]));
        (0..3).for_each(|channel| colors[channel][lane] = color[channel]);
    }
}

/// Sums of the samples of a tile's pixels.
pub type TileSums = [[f64; 3]; LANES];

/// Returns the mean of a pixel from the sum of so many samples.
pub fn mean(sum: [f64; 3], taken: u32) -> [f32; 3] {
    sum.map(|channel| (channel / f64::from(taken)) as f32)
}

impl TileSample {
    /// Adds the colours that are finite; returns the number of others, which count as black.
    pub fn add_to(&self, sums: &mut TileSums) -> u64 {
        let mut dropped = 0;
        for lane in lanes_of(self.lanes) {
            let color = [0, 1, 2].map(|channel: usize| self.colors[channel][lane]);
            if color.iter().all(|channel| channel.is_finite()) {
                (0..3).for_each(|channel| sums[lane][channel] += f64::from(color[channel]));
            } else {
                dropped += 1;
            }
        }
        dropped
    }
}
