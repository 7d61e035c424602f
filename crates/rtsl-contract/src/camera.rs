//! Contracts of cameras: a ray for every point of the image and of the lens.

use glam::{Vec2, Vec3};
use rtsl::{Method, Role};

use crate::contract::Contract;
use crate::random::Stream;
use crate::rays::Rays;
use crate::report::Finding;
use crate::stop::Stop;
use crate::subject::Subject;
use crate::tally::Tally;
use crate::values::is_color;

const RAYS: u64 = 4096;
/// Aspect ratios of images.
const ASPECTS: [f32; 3] = [1.0, 1.777, 0.3];

/// Checks a camera.
///
/// # Errors
/// If a method cannot be compiled or does not terminate.
pub fn check(subject: &Subject<'_>) -> Result<Vec<Finding>, Stop> {
    let mut rays = Tally::new(Contract::CameraRays);
    let mut weights = Tally::new(Contract::CameraWeights);
    let mut limits = Tally::new(Contract::CameraLimits);
    if subject.has(Method::GenerateRay) {
        for aspect in ASPECTS {
            let mut state = places(subject, aspect);
            subject.call(Method::GenerateRay, &mut state)?;
            check_rays(subject, &state, [&mut rays, &mut weights, &mut limits])?;
        }
    }
    let reason = "the class has no generateRay";
    Ok([rays, weights, limits].map(|tally| tally.finish(reason)).into())
}

/// Points of the image and of the lens, including corners and edges.
fn places(subject: &Subject<'_>, aspect: f32) -> Rays {
    const LAST: f32 = 1.0 - 1.0 / (1 << 24) as f32;
    const EDGES: [f32; 4] = [0.0, 1.0, 0.5, 0.25];
    let stream: Stream = subject.stream(Contract::CameraRays);
    let mut rays = subject.rays(Role::Camera, stream, 0..RAYS);
    let edge = |item: u64, dimension: u32| {
        EDGES[(stream.number(item, dimension) * EDGES.len() as f32) as usize]
    };
    let screen = |item: u64| match item % 4 {
        0 => Vec2::new(edge(item, 5), edge(item, 6)),
        _ => Vec2::new(stream.number(item, 0), stream.number(item, 1)),
    };
    let lens = |item: u64| match item % 8 {
        0 => Vec2::new(edge(item, 7).min(LAST), edge(item, 8).min(LAST)),
        _ => Vec2::new(stream.number(item, 2), stream.number(item, 3)),
    };
    rays.set_pairs("rt_ScreenCoord", (0..RAYS).map(screen));
    rays.set_pairs("rt_LensCoord", (0..RAYS).map(lens));
    rays.set_floats("rt_TimeSeed", (0..RAYS).map(|item| stream.number(item, 4)));
    rays.fill("rt_du", 1.0 / (256.0 * aspect));
    rays.fill("rt_dv", 1.0 / 256.0);
    rays
}

fn check_rays(
    subject: &Subject<'_>,
    state: &Rays,
    [rays, weights, limits]: [&mut Tally; 3],
) -> Result<(), Stop> {
    let (origins, directions) = (state.vectors("rt_RayOrigin"), state.vectors("rt_RayDirection"));
    let colors = state.vectors("rt_SampleColor");
    let (epsilons, distances) = (state.floats("rt_Epsilon"), state.floats("rt_HitDistance"));
    for ray in 0..state.count() {
        let inputs = || subject.inputs(Method::GenerateRay, state, ray);
        let (origin, direction, color) = (origins[ray], directions[ray], colors[ray]);
        let is_ray = origin.is_finite() && direction.is_finite() && direction != Vec3::ZERO;
        let message = || format!("generateRay gives origin {origin} and direction {direction}");
        if rays.test(is_ray, message) {
            rays.set_inputs(inputs()?);
        }
        if weights.test(is_color(color), || format!("generateRay gives rt_SampleColor {color}")) {
            weights.set_inputs(inputs()?);
        }
        let (epsilon, distance) = (epsilons[ray], distances[ray]);
        let message =
            || format!("generateRay gives rt_Epsilon {epsilon} and rt_HitDistance {distance}");
        if limits.test(epsilon >= 0.0 && distance > epsilon, message) {
            limits.set_inputs(inputs()?);
        }
    }
    Ok(())
}
