//! Contracts of primitives.

mod hits;
mod sampling;
mod shot;
mod surface;

use glam::{DVec3, Vec3};
use rtsl::{Method, Role};

use crate::Finding;
use crate::random::Stream;
use crate::stop::Stop;
use crate::subject::Subject;

/// Checks a primitive.
///
/// # Errors
/// If a method cannot be compiled or does not terminate.
pub fn check(subject: &Subject<'_>) -> Result<Vec<Finding>, Stop> {
    let place = Place::find(subject)?;
    let mut findings = hits::check(subject, &place)?;
    findings.extend(surface::check(subject, &place)?);
    findings.extend(sampling::check(subject, &place)?);
    Ok(findings)
}

/// The position of the primitive.
struct Place {
    bounds: Bounds,
    /// A point within the bounds.
    center: DVec3,
    /// Half of the diagonal; for an unbounded primitive, the radius of the part that is tested.
    radius: f64,
}

/// The corners of its box.
#[derive(Clone, Copy)]
struct Bounds {
    least: Vec3,
    greatest: Vec3,
}

impl Place {
    /// The radius of the part of an unbounded primitive that is tested.
    const OPEN_RADIUS: f64 = 3.0;

    fn find(subject: &Subject<'_>) -> Result<Place, Stop> {
        let mut rays = subject.rays(Role::Primitive, Stream::new(0), 0..1);
        let mut bounds = Bounds { least: Vec3::NEG_INFINITY, greatest: Vec3::INFINITY };
        if subject.has(Method::ComputeBounds) {
            subject.call(Method::ComputeBounds, &mut rays)?;
            bounds.least = rays.vector("rt_BoundMin", 0);
            bounds.greatest = rays.vector("rt_BoundMax", 0);
        }
        let diagonal = bounds.greatest.as_dvec3() - bounds.least.as_dvec3();
        let is_finite = diagonal.is_finite() && bounds.least.is_finite();
        Ok(if is_finite {
            let center = 0.5 * (bounds.greatest.as_dvec3() + bounds.least.as_dvec3());
            Place { bounds, center, radius: 0.5 * diagonal.length() }
        } else {
            Place { bounds, center: DVec3::ZERO, radius: Place::OPEN_RADIUS }
        })
    }

    /// The least distance at which a renderer accepts hits.
    fn epsilon(&self) -> f64 {
        1e-4 * self.radius.max(1e-3 * self.center.length())
    }

    /// A uniform point in the ball around the box.
    fn point_within(&self, stream: Stream, item: u64) -> DVec3 {
        let radius = libm::cbrt(f64::from(stream.number(item, 5)));
        self.center + self.radius * radius * stream.direction(item)
    }

    fn point_outside(&self, stream: Stream, item: u64) -> DVec3 {
        let distance = 1.5 + 3.0 * f64::from(stream.number(item, 6));
        self.center + self.radius * distance * stream.direction(item)
    }
}
