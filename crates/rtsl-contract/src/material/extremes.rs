//! Rare inputs that occur in every picture: shading normals that differ from the surface's, grazing rays, zero
//! tangents.

use glam::{DVec3, Vec3};
use rtsl::Method;

use super::meeting::Meeting;
use super::path_methods::{ONLY_SHADES, scatters};
use crate::contract::Contract;
use crate::random::Stream;
use crate::rays::Rays;
use crate::report::Finding;
use crate::stop::Stop;
use crate::subject::Subject;
use crate::tally::Tally;
use crate::values::is_color;

const RAYS: usize = 2048;

/// Checks tilted normals and extreme rays.
///
/// # Errors
/// If a method cannot be compiled or does not terminate.
pub fn check(subject: &Subject<'_>) -> Result<[Finding; 2], Stop> {
    let tilted = run(subject, Contract::TiltedNormals, tilted_normals)?;
    let extreme = run(subject, Contract::ExtremeRays, extreme_rays)?;
    Ok([tilted, extreme])
}

fn run(
    subject: &Subject<'_>,
    contract: Contract,
    place: impl Fn(Stream, &mut Rays),
) -> Result<Finding, Stop> {
    let mut tally = Tally::new(contract);
    let stream = subject.stream(contract);
    let mut rays = Meeting::new(0.3, 0.4, false).rays(subject, stream, RAYS);
    place(stream, &mut rays);
    check_colors(subject, &mut rays, &mut tally)?;
    check_presence(subject, &mut rays, &mut tally)?;
    if scatters(subject) {
        check_densities(subject, &mut rays, &mut tally)?;
        check_samples(subject, &mut rays, &mut tally)?;
    }
    Ok(tally.finish(ONLY_SHADES))
}

/// Random rays and surfaces, with shading normals within 80 degrees of the surface's.
fn tilted_normals(stream: Stream, rays: &mut Rays) {
    let items = 0..RAYS as u64;
    let normal = |item| stream.direction(item);
    let tilted = |item| {
        let normal: DVec3 = normal(item);
        let (x, y) = normal.any_orthonormal_pair();
        let slope = 5.6 * f64::from(stream.number(item, 5));
        let (sine, cosine) =
            libm::sincos(std::f64::consts::TAU * f64::from(stream.number(item, 6)));
        (normal + slope * (cosine * x + sine * y)).normalize().as_vec3()
    };
    rays.set_ray_directions(items.clone().map(|item| stream.at(1).direction(item).as_vec3()));
    rays.set_vectors("rt_GeometricNormal", items.clone().map(|item| normal(item).as_vec3()));
    rays.set_vectors("rt_ShadingNormal", items.clone().map(tilted));
    rays.set_vectors(
        "rt_LightDirection",
        items.clone().map(|it| stream.at(2).direction(it).as_vec3()),
    );
    rays.set_vectors("rt_BSDFSeed", items.map(|item| stream.vector(item)));
}

/// Combinations of extreme but valid inputs.
fn extreme_rays(stream: Stream, rays: &mut Rays) {
    const LAST: f32 = 1.0 - 1.0 / (1 << 24) as f32;
    let graze = |height: f32| Vec3::new(0.6, -height, 0.8);
    let directions = [
        Vec3::NEG_Y,
        Vec3::Y,
        graze(0.0),
        graze(1e-7),
        graze(-1e-7),
        graze(1e-3),
        1e-4 * Vec3::NEG_Y,
        1e4 * graze(0.5),
        Vec3::X,
        Vec3::new(-1.0, -1.0, 0.0),
    ];
    let lights = [
        Vec3::Y,
        Vec3::NEG_Y,
        Vec3::X,
        Vec3::new(-0.6, 0.0, -0.8),
        Vec3::new(0.6, 1e-7, 0.8),
        Vec3::new(0.6, 0.8, 0.0),
        Vec3::new(0.0, -0.6, 0.8),
    ];
    let tangents = [Vec3::X, Vec3::ZERO, Vec3::Y, 1e-12 * Vec3::Z, 1e12 * Vec3::X];
    let seeds = [0.0, LAST, 0.5, 0.25, 1e-7];
    let pick = |item: u64, dimension: u32, count: usize| {
        ((stream.number(item, dimension) * count as f32) as usize).min(count - 1)
    };
    let items = 0..RAYS as u64;
    rays.set_ray_directions(items.clone().map(|it| directions[pick(it, 0, directions.len())]));
    rays.set_vectors(
        "rt_LightDirection",
        items.clone().map(|it| lights[pick(it, 1, lights.len())]),
    );
    rays.fill_vector("rt_GeometricNormal", Vec3::Y);
    rays.fill_vector("rt_ShadingNormal", Vec3::Y);
    rays.set_vectors("rt_dPdu", items.clone().map(|it| tangents[pick(it, 2, tangents.len())]));
    rays.set_vectors("rt_dPdv", items.clone().map(|it| tangents[pick(it, 3, tangents.len())]));
    let seed = |item| Vec3::from_array([4, 5, 6].map(|it| seeds[pick(item, it, seeds.len())]));
    rays.set_vectors("rt_BSDFSeed", items.map(seed));
}

fn check_colors(subject: &Subject<'_>, rays: &mut Rays, tally: &mut Tally) -> Result<(), Stop> {
    for (method, value) in [(Method::Bsdf, "rt_BSDFValue"), (Method::Emission, "rt_EmissionColor")]
    {
        if !subject.has(method) {
            continue;
        }
        subject.call(method, rays)?;
        for (ray, color) in rays.vectors(value).into_iter().enumerate() {
            let message = || format!("{} gives {color}", method.name());
            if tally.test(is_color(color), message) {
                tally.set_inputs(subject.inputs(method, rays, ray)?);
            }
        }
    }
    Ok(())
}

fn check_presence(subject: &Subject<'_>, rays: &mut Rays, tally: &mut Tally) -> Result<(), Stop> {
    if !subject.has(Method::Presence) {
        return Ok(());
    }
    subject.call(Method::Presence, rays)?;
    for (ray, presence) in rays.floats("rt_Presence").to_vec().into_iter().enumerate() {
        let message = || format!("presence gives {presence}");
        if tally.test((0.0..=1.0).contains(&presence), message) {
            tally.set_inputs(subject.inputs(Method::Presence, rays, ray)?);
        }
    }
    Ok(())
}

fn check_densities(subject: &Subject<'_>, rays: &mut Rays, tally: &mut Tally) -> Result<(), Stop> {
    subject.call(Method::EvaluatePdf, rays)?;
    for (ray, density) in rays.floats("rt_PDF").to_vec().into_iter().enumerate() {
        let message = || format!("evaluatePDF gives {density}");
        if tally.test(density.is_finite() && density >= 0.0, message) {
            tally.set_inputs(subject.inputs(Method::EvaluatePdf, rays, ray)?);
        }
    }
    Ok(())
}

fn check_samples(subject: &Subject<'_>, rays: &mut Rays, tally: &mut Tally) -> Result<(), Stop> {
    subject.call(Method::SampleBsdf, rays)?;
    for ray in 0..rays.count() {
        let direction = rays.vector("rt_LightDirection", ray);
        let value = rays.vector("rt_BSDFValue", ray);
        let density = rays.floats("rt_PDF")[ray];
        let is_black = value == Vec3::ZERO;
        let is_sample = is_color(value) && density.is_finite() && density >= 0.0;
        let is_direction = is_black || (direction.length() - 1.0).abs() < 1e-3;
        let message = || {
            format!("sampleBSDF gives direction {direction}, value {value} and density {density}")
        };
        if tally.test(is_sample && is_direction, message) {
            tally.set_inputs(subject.inputs(Method::SampleBsdf, rays, ray)?);
        }
    }
    Ok(())
}
