//! Contracts of integrators: a finite radiance for every ray, in a scene whose radiance is known, and no more than is
//! emitted there.

use glam::Vec3;
use rtsl::{Method, Query, Role};

use crate::contract::Contract;
use crate::furnace::Furnace;
use crate::random::Stream;
use crate::rays::Rays;
use crate::report::Finding;
use crate::statistics::{Mean, normal_quantile};
use crate::stop::Stop;
use crate::subject::Subject;
use crate::tally::Tally;

const RAYS: u64 = 64;
/// The number of rays whose mean radiance is compared with that of the furnace.
const RAYS_OF_MEAN: u64 = 1 << 12;

/// The distance from the middle of the furnace within which rays begin.
const REACH: f32 = 0.9;

/// The error of rounding that a mean radiance of 1 may have.
const ROUNDING: f64 = 1e-4;
/// The probability with which the mean of a correct integrator is reported as too large.
const FALSE_ALARM: f64 = 1e-9;

/// Checks an integrator.
///
/// # Errors
/// If a method cannot be compiled or does not terminate.
pub fn check(subject: &Subject<'_>) -> Result<Vec<Finding>, Stop> {
    Ok(vec![check_values(subject)?, check_mean(subject)?])
}

/// Radiance is finite.
fn check_values(subject: &Subject<'_>) -> Result<Finding, Stop> {
    let mut tally = Tally::new(Contract::Radiance);
    if subject.has(Method::Radiance) {
        let rays = called(subject, subject.stream(Contract::Radiance), RAYS)?;
        for (ray, color) in rays.vectors("rt_SampleColor").into_iter().enumerate() {
            let message =
                || format!("radiance gives rt_SampleColor {color} inside a glowing sphere");
            if tally.test(color.is_finite(), message) {
                tally.set_inputs(subject.inputs(Method::Radiance, &rays, ray)?);
            }
        }
    }
    Ok(tally.finish("the class has no radiance"))
}

/// The mean radiance is at most that of the furnace, for integrators that transport light.
fn check_mean(subject: &Subject<'_>) -> Result<Finding, Stop> {
    let mut tally = Tally::new(Contract::Furnace);
    if subject.asks(Method::Radiance, &[Query::SampleBsdf, Query::Emission])? {
        let rays = called(subject, subject.stream(Contract::Furnace), RAYS_OF_MEAN)?;
        let mut mean = Mean::default();
        let colors = rays.vectors("rt_SampleColor").into_iter().filter(|color| color.is_finite());
        colors.for_each(|color| mean.add(f64::from(color.max_element())));
        let noise = normal_quantile(FALSE_ALARM) * mean.deviation();
        let holds = mean.mean() - noise <= 1.0 + ROUNDING;
        tally.test(holds, || {
            format!(
                "radiance gives {:.4} on average inside a sphere whose radiance is at most 1",
                mean.mean()
            )
        });
    }
    Ok(tally.finish("the integrator does not scatter light"))
}

/// Calls `radiance` for a number of rays inside the furnace.
fn called(subject: &Subject<'_>, stream: Stream, count: u64) -> Result<Rays, Stop> {
    let mut rays = subject.rays(Role::Integrator, stream, 0..count);
    let inside = |item: u64| REACH * (2.0 * stream.vector(item) - 1.0) / 3.0_f32.sqrt();
    rays.set_vectors("rt_RayOrigin", (0..count).map(inside));
    let direction = |item: u64| (stream.vector(count + item) - 0.5).normalize_or(Vec3::Z);
    rays.set_vectors("rt_RayDirection", (0..count).map(direction));
    rays.set_floats("rt_TimeSeed", (0..count).map(|item| stream.number(item, 9)));
    let mut furnace = Furnace::new(stream, count as usize);
    subject.call_with(Method::Radiance, &mut rays, Some(&mut furnace))?;
    Ok(rays)
}
