//! Contracts of integrators: a finite radiance for every ray, in a scene whose radiance is known.

use glam::Vec3;
use rtsl::{Method, Role};

use crate::contract::Contract;
use crate::furnace::Furnace;
use crate::report::Finding;
use crate::stop::Stop;
use crate::subject::Subject;
use crate::tally::Tally;

const RAYS: u64 = 64;

/// The distance from the middle of the furnace within which rays begin.
const REACH: f32 = 0.9;

/// Checks an integrator.
///
/// # Errors
/// If a method cannot be compiled or does not terminate.
pub fn check(subject: &Subject<'_>) -> Result<Vec<Finding>, Stop> {
    let mut tally = Tally::new(Contract::Radiance);
    if subject.has(Method::Radiance) {
        let stream = subject.stream(Contract::Radiance);
        let mut rays = subject.rays(Role::Integrator, stream, 0..RAYS);
        let inside = |item: u64| REACH * (2.0 * stream.vector(item) - 1.0) / 3.0_f32.sqrt();
        rays.set_vectors("rt_RayOrigin", (0..RAYS).map(inside));
        let direction = |item: u64| (stream.vector(RAYS + item) - 0.5).normalize_or(Vec3::Z);
        rays.set_vectors("rt_RayDirection", (0..RAYS).map(direction));
        rays.set_floats("rt_TimeSeed", (0..RAYS).map(|item| stream.number(item, 9)));
        let mut furnace = Furnace::new(stream, RAYS as usize);
        subject.call_with(Method::Radiance, &mut rays, Some(&mut furnace))?;
        for (ray, color) in rays.vectors("rt_SampleColor").into_iter().enumerate() {
            let message =
                || format!("radiance gives rt_SampleColor {color} inside a glowing sphere");
            if tally.test(color.is_finite(), message) {
                tally.set_inputs(subject.inputs(Method::Radiance, &rays, ray)?);
            }
        }
    }
    Ok(vec![tally.finish("the class has no radiance")])
}
