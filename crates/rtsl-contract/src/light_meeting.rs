//! Consistency of rays and light samples: a ray that hits a light must find the radiance of its samples.
//!
//! Integrators divide the light between samples of lights, which they weight by `rt_PDF`, and rays that they trace.
//! Rays that leave the scene find what is infinitely far away: a sample there with a density must be found by a ray in
//! its direction, and `evaluatePDF` be there, so that both techniques can be weighted. No ray finds a sample at a
//! finite distance, whose weight is 1, as that of all samples of a light without `emission`: `emission` must be black
//! there, or the light counts twice.

use std::ops::Range;

use glam::Vec3;
use rtsl::{Method, Role};

use crate::contract::Contract;
use crate::random::Stream;
use crate::rays::Rays;
use crate::report::Finding;
use crate::stop::Stop;
use crate::subject::{Subject, batches};
use crate::tally::Tally;

/// The number of samples for each point: each is compared individually, so that few suffice.
const SAMPLES: u64 = 4096;

/// Points to be lit, around the origin and away from it.
const POINTS: [Vec3; 3] =
    [Vec3::new(0.4, 1.2, -1.5), Vec3::new(-0.2, -0.8, 0.3), Vec3::new(12.0, 2.0, 7.0)];

/// Checks the rays towards a light's samples.
///
/// # Errors
/// If a method cannot be compiled or does not terminate.
pub fn check(subject: &Subject<'_>) -> Result<Finding, Stop> {
    let mut tally = Tally::new(Contract::LightMeeting);
    if !subject.has(Method::Illumination) {
        return Ok(tally.finish("the class has no illumination"));
    }
    if !subject.has(Method::Emission) {
        return Ok(tally.finish(
            "the class has no emission: no ray meets it, and renderers divide its samples by their densities",
        ));
    }
    for (index, point) in POINTS.into_iter().enumerate() {
        let stream = subject.stream(Contract::LightMeeting).at(index as u64);
        for numbers in batches(0..SAMPLES) {
            let mut samples = rays_at(subject, point, stream, numbers);
            subject.call(Method::Illumination, &mut samples)?;
            check_samples(subject, point, &samples, &mut tally)?;
        }
    }
    Ok(tally.finish("no sample has a density"))
}

/// Compares samples that have a density with the radiance of rays in their directions.
fn check_samples(
    subject: &Subject<'_>,
    point: Vec3,
    samples: &Rays,
    tally: &mut Tally,
) -> Result<(), Stop> {
    let directions = samples.vectors("rt_LightDirection");
    let mut leaving = rays_at(subject, point, Stream::new(0), 0..directions.len() as u64);
    leaving.set_vectors("rt_RayDirection", directions.iter().copied());
    subject.call(Method::Emission, &mut leaving)?;
    let has_density = subject.has(Method::EvaluatePdf);
    let (colors, emitted) = (samples.vectors("rt_LightColor"), leaving.vectors("rt_EmissionColor"));
    let distances = samples.floats("rt_LightDistance");
    for (ray, density) in samples.floats("rt_PDF").iter().enumerate().filter(|(_, it)| **it > 0.0) {
        let (color, distance) = (colors[ray], distances[ray]);
        // Samples at infinity are compared by `LightEmission`.
        let is_far = distance == f32::INFINITY;
        let message = || {
            if is_far {
                return format!(
                    "illumination gives a sample of density {density}, and rays meet the light, but the class has no evaluatePDF to weigh the two by"
                );
            }
            format!(
                "illumination gives {color} at distance {distance}; a ray towards {} goes on beyond, and emission gives {} for it",
                directions[ray], emitted[ray]
            )
        };
        let holds = if is_far { has_density } else { emitted[ray] == Vec3::ZERO };
        if tally.test(holds, message) {
            tally.set_inputs(subject.inputs(Method::Illumination, samples, ray)?);
        }
    }
    Ok(())
}

fn rays_at(subject: &Subject<'_>, point: Vec3, stream: Stream, numbers: Range<u64>) -> Rays {
    let mut rays = subject.rays(Role::Light, stream, numbers);
    rays.fill_vector("rt_HitPoint", point);
    rays.fill_vector("rt_RayOrigin", point);
    rays.fill_vector("rt_GeometricNormal", Vec3::Y);
    rays.fill_vector("rt_ShadingNormal", Vec3::Y);
    rays
}
