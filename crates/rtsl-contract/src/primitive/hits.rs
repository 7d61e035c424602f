//! Contracts of `intersect`: hits lie within the bounds, are the closest, do not depend on the origin of the ray, are
//! found from both sides, and do not repeat at its origin.

use glam::DVec3;
use rtsl::Method;

use super::place::{Bounds, Place};
use super::shot::{Ray, Shot};
use crate::contract::Contract;
use crate::report::Finding;
use crate::stop::Stop;
use crate::subject::Subject;
use crate::tally::Tally;

const RAYS: u64 = 4096;
/// The fraction of rays that may fail because of rounding, at edges and silhouettes.
const ROUNDED_PART: f64 = 0.01;
/// The tolerance of positions, relative to the distances in the computation.
const POSITION_ERROR: f64 = 2e-5;
/// Faces whose normals enclose an angle with a smaller cosine meet at an edge.
const EDGE_COSINE: f32 = 0.9;
const NEVER_HIT: &str = "no ray hits it";

/// Checks `intersect` alone.
///
/// # Errors
/// If a method cannot be compiled or does not terminate.
pub fn check(subject: &Subject<'_>, place: &Place) -> Result<Vec<Finding>, Stop> {
    let shot = Shot::new(subject, random_rays(subject, place))?;
    Ok(vec![
        check_bounds(subject, place, &shot)?,
        check_limits(subject, &shot)?,
        check_lengths(subject, place, &shot)?,
        check_points(subject, place, &shot)?,
        check_within(subject, place, &shot)?,
        check_leaving(subject, place, shot)?,
    ])
}

/// Rays from outside and inside, with directions of all lengths, some of them along an axis.
fn random_rays(subject: &Subject<'_>, place: &Place) -> Vec<Ray> {
    let (origins, targets) =
        (subject.stream(Contract::Bounds), subject.stream(Contract::Bounds).at(1));
    let ray = |item: u64| {
        let origin = if item % 3 == 2 {
            place.point_within(origins, item)
        } else {
            place.point_outside(origins, item)
        };
        let target = place.point_within(targets, item);
        let mut way = target - origin;
        if item.is_multiple_of(16) {
            way = along_an_axis(way, (item / 16 % 3) as usize);
        }
        let length = 0.3 + 3.0 * f64::from(origins.number(item, 7));
        Ray::new(origin, length * way.normalize(), place.epsilon())
    };
    (0..RAYS).map(ray).collect()
}

fn along_an_axis(way: DVec3, axis: usize) -> DVec3 {
    let mut along = DVec3::ZERO;
    along[axis] = way[axis];
    along
}

fn check_bounds(subject: &Subject<'_>, place: &Place, shot: &Shot) -> Result<Finding, Stop> {
    let mut tally = Tally::new(Contract::Bounds);
    if !subject.has(Method::ComputeBounds) {
        return Ok(tally.finish("without computeBounds it has none: every ray is tested"));
    }
    let Bounds { least, greatest } = place.bounds;
    let is_box = least.cmple(greatest).all();
    tally.test(is_box, || format!("computeBounds gives a box from {least} to {greatest}"));
    for (ray, point) in shot.points.iter().enumerate() {
        let Some(t) = shot.hits[ray] else { continue };
        let Ray { origin, direction, .. } = shot.given[ray];
        let reach = f64::from(origin.length() + t.abs() * direction.length()) + place.radius;
        let allowed = (POSITION_ERROR * reach) as f32;
        let excess = (least - *point).max(*point - greatest).max_element();
        let message = || {
            format!(
                "the hit at {point} lies {excess} outside of the box from {least} to {greatest}"
            )
        };
        if tally.test(excess <= allowed, message) {
            tally.set_inputs(shot.inputs(subject, ray)?);
        }
    }
    Ok(tally.finish(NEVER_HIT))
}

/// The closest hit is found for every greater limit, and no hit for a lesser one.
fn check_limits(subject: &Subject<'_>, shot: &Shot) -> Result<Finding, Stop> {
    let mut tally = Tally::new(Contract::Limits);
    for factor in [1.001, 0.999] {
        let rays = shot.given.iter().zip(&shot.hits).map(|(ray, hit)| {
            let limit = hit.map_or(f32::INFINITY, |t| factor * t);
            Ray { limit, ..*ray }
        });
        let limited = Shot::new(subject, rays.collect())?;
        for (ray, hit) in shot.hits.iter().enumerate() {
            let Some(t) = hit else { continue };
            let (limit, epsilon) = (limited.given[ray].limit, limited.given[ray].epsilon);
            let expected = (factor > 1.0 && *t > epsilon).then_some(*t);
            let found = limited.hits[ray];
            let message = || {
                format!(
                    "with no limit the nearest hit is at {t}, with rt_HitDistance {limit} there is {}",
                    shown(found)
                )
            };
            if tally.test(found == expected, message) {
                tally.set_inputs(limited.inputs(subject, ray)?);
            }
        }
    }
    Ok(tally.finish(NEVER_HIT))
}

fn shown(hit: Option<f32>) -> String {
    hit.map_or("none".to_owned(), |t| format!("one at {t}"))
}

/// The hit does not depend on the length of the direction.
fn check_lengths(subject: &Subject<'_>, place: &Place, shot: &Shot) -> Result<Finding, Stop> {
    const FACTOR: f32 = 3.7;
    let mut tally = Tally::new(Contract::Lengths);
    tally.allow(ROUNDED_PART);
    let longer = shot.given.iter().map(|ray| Ray {
        direction: FACTOR * ray.direction,
        epsilon: ray.epsilon / FACTOR,
        ..*ray
    });
    let longer = Shot::new(subject, longer.collect())?;
    for ray in 0..shot.hits.len() {
        let holds = match (shot.hits[ray], longer.hits[ray]) {
            (None, None) => continue,
            (Some(_), Some(_)) => {
                let apart = shot.points[ray].distance(longer.points[ray]);
                f64::from(apart) <= 1e-3 * place.radius
            }
            (Some(_), None) | (None, Some(_)) => false,
        };
        let message = || {
            format!(
                "the hit is {}; with a direction {FACTOR} times as long it is {}",
                shown(shot.hits[ray]),
                shown(longer.hits[ray])
            )
        };
        if tally.test(holds, message) {
            tally.set_inputs(shot.inputs(subject, ray)?);
        }
    }
    Ok(tally.finish(NEVER_HIT))
}

/// A point that one ray hits is hit by another ray towards it.
fn check_points(subject: &Subject<'_>, place: &Place, shot: &Shot) -> Result<Finding, Stop> {
    let mut tally = Tally::new(Contract::Points);
    tally.allow(ROUNDED_PART);
    let stream = subject.stream(Contract::Points);
    let others = (0..shot.hits.len()).map(|ray| {
        let origin = place.point_outside(stream, ray as u64);
        Ray::new(origin, shot.points[ray].as_dvec3() - origin, place.epsilon())
    });
    let others = Shot::new(subject, others.collect())?;
    for ray in (0..shot.hits.len()).filter(|ray| shot.hits[*ray].is_some()) {
        // A closer hit may occlude it.
        let holds = others.hits[ray].is_some_and(|t| t <= 1.001);
        let message = || {
            format!(
                "a ray hits at {}; one towards that point from {} finds {}",
                shot.points[ray],
                others.given[ray].origin,
                shown(others.hits[ray])
            )
        };
        if tally.test(holds, message) {
            tally.set_inputs(others.inputs(subject, ray)?);
        }
    }
    Ok(tally.finish(NEVER_HIT))
}

/// Two rays against each other on one line that hit at two points find both sides of a solid. A ray from between them
/// hits the farther one.
fn check_within(subject: &Subject<'_>, place: &Place, shot: &Shot) -> Result<Finding, Stop> {
    /// The least distance of the points, relative to the radius: closer ones are one point, or lie at an edge.
    const THICKNESS: f64 = 0.05;
    let mut tally = Tally::new(Contract::Within);
    tally.allow(ROUNDED_PART);
    let against = shot.given.iter().zip(&shot.points).map(|(ray, point)| {
        let direction = ray.direction.as_dvec3().normalize();
        Ray::new(point.as_dvec3() + 4.0 * place.radius * direction, -direction, place.epsilon())
    });
    let against = Shot::new(subject, against.collect())?;
    let between = shot.points.iter().zip(&against.points).map(|(near, far)| {
        let origin = 0.5 * (near.as_dvec3() + far.as_dvec3());
        Ray::new(origin, far.as_dvec3() - origin, place.epsilon())
    });
    let between = Shot::new(subject, between.collect())?;
    for ray in 0..shot.hits.len() {
        let (near, far) = (shot.points[ray], against.points[ray]);
        let along = (far - near).dot(shot.given[ray].direction.normalize());
        let is_solid = shot.hits[ray].is_some()
            && against.hits[ray].is_some()
            && f64::from(along) > THICKNESS * place.radius;
        if !is_solid {
            continue;
        }
        let message = || {
            format!(
                "rays from outside hit at {near} and, against each other, at {far}; one from between them to the latter finds {}",
                shown(between.hits[ray])
            )
        };
        if tally.test(between.hits[ray].is_some_and(|t| t <= 1.001), message) {
            tally.set_inputs(between.inputs(subject, ray)?);
        }
    }
    Ok(tally.finish("no line meets it twice"))
}

/// Rays that leave a point of the surface, to either side, do not hit it immediately.
fn check_leaving(subject: &Subject<'_>, place: &Place, mut shot: Shot) -> Result<Finding, Stop> {
    let mut tally = Tally::new(Contract::Leaving);
    // As many rays at silhouettes fail because of rounding.
    tally.allow(0.002);
    shot.then(subject, Method::ComputeNormal)?;
    let normals = shot.vectors("rt_GeometricNormal");
    let (offsets, is_set) = (shot.floats("rt_SurfaceOffset"), subject.has(Method::ComputeNormal));
    let stream = subject.stream(Contract::Leaving);
    let leaving = (0..shot.hits.len()).map(|ray| {
        let (origin, normal) = (shot.points[ray].as_dvec3(), normals[ray].as_dvec3());
        let sideways = stream.direction(ray as u64);
        let side = if sideways.dot(normal) < 0.0 { -1.0 } else { 1.0 };
        // At least a few degrees from the surface: a curved surface may be hit again at smaller angles.
        let away = sideways + 0.3 * side * normal;
        let away = if away.is_finite() { away.normalize() } else { sideways };
        // Renderers begin rays at the offset that the shape sets.
        let offset = if is_set { side * f64::from(offsets[ray]) } else { 0.0 };
        Ray::new(origin + offset * normal.normalize_or_zero(), away, place.epsilon())
    });
    let mut leaving = Shot::new(subject, leaving.collect())?;
    leaving.then(subject, Method::ComputeNormal)?;
    let found = leaving.vectors("rt_GeometricNormal");
    for ray in (0..shot.hits.len()).filter(|ray| shot.hits[*ray].is_some()) {
        // A ray from beside an edge soon meets the face beyond it.
        if leaving.hits[ray].is_some() && normals[ray].dot(found[ray]).abs() < EDGE_COSINE {
            continue;
        }
        let t = leaving.hits[ray].unwrap_or(f32::INFINITY);
        let distance = f64::from(t * leaving.given[ray].direction.length());
        let message = || {
            format!(
                "a ray that leaves the surface at {} hits it again after {distance}, where rt_Epsilon is {}",
                shot.points[ray], leaving.given[ray].epsilon
            )
        };
        if tally.test(distance > 10.0 * place.epsilon(), message) {
            tally.set_inputs(leaving.inputs(subject, ray)?);
        }
    }
    Ok(tally.finish(NEVER_HIT))
}
