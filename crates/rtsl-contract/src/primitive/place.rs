//! The position of a primitive.

use glam::{DVec3, Vec3};
use rtsl::{Method, Role};

use crate::random::Stream;
use crate::stop::Stop;
use crate::subject::Subject;

/// The position of the primitive.
pub struct Place {
    /// Its box; infinite for an unbounded primitive.
    pub bounds: Bounds,
    /// A point within the bounds.
    pub center: DVec3,
    /// Half of the diagonal; for an unbounded primitive, the radius of the part that is tested.
    pub radius: f64,
}

/// The corners of its box.
#[derive(Clone, Copy)]
pub struct Bounds {
    /// The least coordinates.
    pub least: Vec3,
    /// The greatest coordinates.
    pub greatest: Vec3,
}

impl Place {
    /// The radius of the part of an unbounded primitive that is tested.
    const OPEN_RADIUS: f64 = 3.0;

    /// Calls `computeBounds`, if the class has it.
    ///
    /// # Errors
    /// If the method cannot be compiled or does not terminate.
    pub fn find(subject: &Subject<'_>) -> Result<Place, Stop> {
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
    pub fn epsilon(&self) -> f64 {
        1e-4 * self.radius.max(1e-3 * self.center.length())
    }

    /// A uniform point in the ball around the box.
    pub fn point_within(&self, stream: Stream, item: u64) -> DVec3 {
        let radius = libm::cbrt(f64::from(stream.number(item, 5)));
        self.center + self.radius * radius * stream.direction(item)
    }

    /// A point outside the ball around the box.
    pub fn point_outside(&self, stream: Stream, item: u64) -> DVec3 {
        let distance = 1.5 + 3.0 * f64::from(stream.number(item, 6));
        self.center + self.radius * distance * stream.direction(item)
    }
}
