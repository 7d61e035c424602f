//! Normals and derivatives compared with differences between hits of neighbouring rays.

use glam::{DVec2, DVec3, Vec2, Vec3};
use rtsl::Method;

use super::place::Place;
use super::shot::{Ray, Shot};
use crate::contract::Contract;
use crate::report::Finding;
use crate::stop::Stop;
use crate::subject::Subject;
use crate::tally::Tally;

const RAYS: u64 = 2048;
/// The distance of neighbours, relative to the size.
const STEP: f64 = 0.01;
/// The tolerance of a normal in radians, for curvature and rounding.
const ANGLE_ERROR: f64 = 0.03;
/// The relative tolerance of a difference compared with derivatives.
const DERIVATIVE_ERROR: f64 = 0.05;
/// Neighbours lie on one smooth piece of the surface if their midpoint is as close to the hit as this fraction of their
/// distance.
const SMOOTH_PART: f64 = 0.02;
const NO_NEIGHBOURS: &str = "no ray hits a smooth piece of it";

const COORDINATES: &str = "rt_TextureUV";

/// A property of a hit that a method sets.
#[derive(Clone, Copy)]
struct SurfaceValue {
    name: &'static str,
    variable: &'static str,
    method: Method,
}

const SURFACE_VALUES: [SurfaceValue; 5] = [
    SurfaceValue::new("normal", "rt_GeometricNormal", Method::ComputeNormal),
    SurfaceValue::new("normal for shading", "rt_ShadingNormal", Method::ComputeNormal),
    SurfaceValue::new("texture coordinates", COORDINATES, Method::ComputeTextureCoordinates),
    SurfaceValue::new("rt_dPdu", "rt_dPdu", Method::ComputeDerivatives),
    SurfaceValue::new("rt_dPdv", "rt_dPdv", Method::ComputeDerivatives),
];

impl SurfaceValue {
    const fn new(name: &'static str, variable: &'static str, method: Method) -> SurfaceValue {
        SurfaceValue { name, variable, method }
    }
}

/// Checks the results of later methods for hits.
///
/// # Errors
/// If a method cannot be compiled or does not terminate.
pub fn check(subject: &Subject<'_>, place: &Place) -> Result<Vec<Finding>, Stop> {
    let patches = Patches::new(subject, place)?;
    Ok(vec![
        patches.check_values(subject)?,
        patches.check_normals(subject)?,
        patches.check_sides(subject, place)?,
        patches.check_derivatives(subject)?,
    ])
}

/// Hits with four neighbours each: two along each of two directions across the ray.
struct Patches {
    middle: Shot,
    neighbours: [Shot; 4],
    /// The texture coordinates of the neighbours.
    coordinates: [Vec<Vec2>; 4],
}

/// The differences between neighbours along two directions.
struct Differences {
    points: [DVec3; 2],
    coordinates: [DVec2; 2],
}

impl Patches {
    fn new(subject: &Subject<'_>, place: &Place) -> Result<Patches, Stop> {
        let (origins, targets) =
            (subject.stream(Contract::Normals), subject.stream(Contract::Normals).at(1));
        let ray = |item: u64| {
            let origin = place.point_outside(origins, item);
            let way = place.point_within(targets, item) - origin;
            Ray::new(origin, way.normalize(), place.epsilon())
        };
        let mut middle = Shot::new(subject, (0..RAYS).map(ray).collect())?;
        let neighbour = |x: f64, y: f64| {
            let rays = middle.given.iter().zip(&middle.points).map(|(ray, point)| {
                let (across, along) = ray.direction.as_dvec3().normalize().any_orthonormal_pair();
                let target = point.as_dvec3() + STEP * place.radius * (x * across + y * along);
                let origin = ray.origin.as_dvec3();
                Ray::new(origin, (target - origin).normalize(), place.epsilon())
            });
            Shot::new(subject, rays.collect())
        };
        let mut neighbours = [
            neighbour(-1.0, 0.0)?,
            neighbour(1.0, 0.0)?,
            neighbour(0.0, -1.0)?,
            neighbour(0.0, 1.0)?,
        ];
        for shot in neighbours.iter_mut().chain([&mut middle]) {
            shot.then(subject, Method::ComputeNormal)?;
            shot.then(subject, Method::ComputeTextureCoordinates)?;
            shot.then(subject, Method::ComputeDerivatives)?;
        }
        let coordinates = neighbours.each_ref().map(Shot::coordinates);
        Ok(Patches { middle, neighbours, coordinates })
    }

    /// Returns the differences for a hit with neighbours on one smooth piece.
    fn differences(&self, ray: usize) -> Option<Differences> {
        self.middle.hits[ray]?;
        self.neighbours.iter().all(|shot| shot.hits[ray].is_some()).then_some(())?;
        let point = self.middle.points[ray].as_dvec3();
        let [a, b, c, d] = [0, 1, 2, 3].map(|it| self.neighbours[it].points[ray].as_dvec3());
        let points = [b - a, d - c];
        let is_smooth = [(a + b, points[0]), (c + d, points[1])]
            .into_iter()
            .all(|(sum, across)| (0.5 * sum - point).length() <= SMOOTH_PART * across.length());
        let coordinates = self.coordinates.each_ref().map(|it| it[ray].as_dvec2());
        let [a, b, c, d] = coordinates;
        is_smooth.then_some(Differences { points, coordinates: [b - a, d - c] })
    }

    /// Checks the values that each of the class's methods sets; renderers ignore variables that none sets.
    fn check_values(&self, subject: &Subject<'_>) -> Result<Finding, Stop> {
        let mut tally = Tally::new(Contract::SurfaceValues);
        let own: Vec<SurfaceValue> =
            SURFACE_VALUES.into_iter().filter(|it| subject.has(it.method)).collect();
        if own.is_empty() {
            return Ok(tally.finish("no method says more of a hit than where it is"));
        }
        let values: Vec<Vec<Vec3>> = own.iter().map(|it| self.values_of(it)).collect();
        for ray in (0..self.middle.hits.len()).filter(|ray| self.middle.hits[*ray].is_some()) {
            let is_finite = values.iter().all(|values| values[ray].is_finite());
            let message = || {
                let shown = own.iter().zip(&values).map(|(it, values)| match it.variable {
                    COORDINATES => format!("{} {}", it.name, values[ray].truncate()),
                    _ => format!("{} {}", it.name, values[ray]),
                });
                let shown: Vec<String> = shown.collect();
                format!(
                    "at {}: {}; normals of no length count as NaN",
                    self.middle.points[ray],
                    shown.join(", ")
                )
            };
            if tally.test(is_finite, message) {
                tally.set_inputs(self.middle.inputs(subject, ray)?);
            }
        }
        Ok(tally.finish(NO_NEIGHBOURS))
    }

    fn values_of(&self, value: &SurfaceValue) -> Vec<Vec3> {
        if value.variable == COORDINATES {
            return self.middle.coordinates().into_iter().map(|it| it.extend(0.0)).collect();
        }
        self.middle.vectors(value.variable)
    }

    fn check_normals(&self, subject: &Subject<'_>) -> Result<Finding, Stop> {
        let mut tally = Tally::new(Contract::Normals);
        tally.allow(0.01);
        if !subject.has(Method::ComputeNormal) {
            return Ok(tally.finish("the class has no computeNormal"));
        }
        let normals = self.middle.vectors("rt_GeometricNormal");
        for (ray, normal) in normals.into_iter().enumerate() {
            let Some(Differences { points: [across, along], .. }) = self.differences(ray) else {
                continue;
            };
            let expected = across.cross(along).normalize();
            let sine = expected.cross(normal.as_dvec3()).length();
            let message = || {
                let expected =
                    if expected.dot(normal.as_dvec3()) < 0.0 { -expected } else { expected };
                format!(
                    "at {} the normal is {normal}, neighbouring hits say {}",
                    self.middle.points[ray],
                    expected.as_vec3()
                )
            };
            if tally.test(sine <= ANGLE_ERROR, message) {
                tally.set_inputs(self.middle.inputs(subject, ray)?);
            }
        }
        Ok(tally.finish(NO_NEIGHBOURS))
    }

    /// Checks that normals point outward on a closed surface, which every ray hits an even number of times.
    fn check_sides(&self, subject: &Subject<'_>, place: &Place) -> Result<Finding, Stop> {
        let mut tally = Tally::new(Contract::Outward);
        tally.allow(0.01);
        if !subject.has(Method::ComputeNormal) {
            return Ok(tally.finish("the class has no computeNormal"));
        }
        if !self.is_closed(subject, place)? {
            return Ok(tally.finish("the surface is open: it has no inside"));
        }
        let normals = self.middle.vectors("rt_GeometricNormal");
        for (ray, normal) in normals.into_iter().enumerate() {
            if self.middle.hits[ray].is_none() {
                continue;
            }
            let cosine = self.middle.given[ray].direction.dot(normal);
            let message = || {
                format!(
                    "a ray from outside first hits at {}, where the normal {normal} points inward",
                    self.middle.points[ray]
                )
            };
            if tally.test(cosine < 1e-3, message) {
                tally.set_inputs(self.middle.inputs(subject, ray)?);
            }
        }
        Ok(tally.finish(NO_NEIGHBOURS))
    }

    fn is_closed(&self, subject: &Subject<'_>, place: &Place) -> Result<bool, Stop> {
        /// More hits are not expected of any surface.
        const MAX_HITS: usize = 8;
        let mut counts = vec![0_usize; self.middle.given.len()];
        let mut rays = self.middle.given.clone();
        for _ in 0..MAX_HITS {
            let shot = Shot::new(subject, rays.clone())?;
            for (ray, hit) in shot.hits.iter().enumerate() {
                match hit {
                    Some(t) => {
                        counts[ray] += 1;
                        rays[ray].epsilon = t + place.epsilon() as f32;
                    }
                    None => rays[ray].epsilon = f32::INFINITY,
                }
            }
        }
        let hitting = counts.iter().filter(|count| **count > 0).count();
        let odd = counts.iter().filter(|count| *count % 2 == 1).count();
        Ok(hitting > 0 && odd as f64 <= 0.02 * hitting as f64)
    }

    fn check_derivatives(&self, subject: &Subject<'_>) -> Result<Finding, Stop> {
        let mut tally = Tally::new(Contract::Derivatives);
        tally.allow(0.02);
        let has_both = subject.has(Method::ComputeDerivatives)
            && subject.has(Method::ComputeTextureCoordinates);
        if !has_both {
            return Ok(tally.finish("the class does not give both coordinates and derivatives"));
        }
        let (u, v) = (self.middle.vectors("rt_dPdu"), self.middle.vectors("rt_dPdv"));
        let middle = self.middle.coordinates();
        for ray in 0..u.len() {
            let Some(Differences { points, coordinates }) = self.differences(ray) else { continue };
            if !self.is_smooth_in_coordinates(ray, middle[ray].as_dvec2()) {
                continue;
            }
            for (point, step) in points.into_iter().zip(coordinates) {
                let predicted = step.x * u[ray].as_dvec3() + step.y * v[ray].as_dvec3();
                let holds = (predicted - point).length() <= DERIVATIVE_ERROR * point.length();
                let message = || {
                    format!(
                        "at {} a step of {} in texture coordinates is one of {} in space; rt_dPdu and rt_dPdv say {}",
                        self.middle.points[ray],
                        step.as_vec2(),
                        point.as_vec3(),
                        predicted.as_vec3()
                    )
                };
                if tally.test(holds, message) {
                    tally.set_inputs(self.middle.inputs(subject, ray)?);
                }
            }
        }
        Ok(tally.finish("texture coordinates do not vary smoothly anywhere"))
    }

    /// True if coordinates change evenly from neighbour to neighbour, without a seam.
    fn is_smooth_in_coordinates(&self, ray: usize, middle: DVec2) -> bool {
        [(0, 1), (2, 3)].into_iter().all(|(before, behind)| {
            let before = self.coordinates[before][ray].as_dvec2();
            let behind = self.coordinates[behind][ray].as_dvec2();
            let across = (behind - before).length();
            across > 0.0 && (0.5 * (before + behind) - middle).length() <= SMOOTH_PART * across
        })
    }
}
