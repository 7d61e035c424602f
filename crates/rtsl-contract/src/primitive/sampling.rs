//! `generateSample` compared with `samplePDF` and `intersect`.
//!
//! A sample may be occluded by the primitive itself, and renderers then ignore it. Therefore only samples that a ray
//! hits first are counted, and their density over directions must be that of the point that a ray in that direction
//! hits. At grazing angles the density is unbounded, so angles of less than a few degrees are excluded on both sides.

use std::ops::Range;

use glam::{DVec3, Vec3};
use rtsl::{Method, Role};

use super::place::Place;
use super::shot::{Ray, Shot};
use crate::contract::Contract;
use crate::distribution::{Comparison, Samples, Source};
use crate::neighbours::{Verdict, judge};
use crate::random::Stream;
use crate::rays::Rays;
use crate::report::{Finding, Inputs};
use crate::statistics::significance;
use crate::stop::Stop;
use crate::subject::{Subject, batches};
use crate::tally::Tally;

/// The least cosine at which a point counts.
const MIN_COSINE: f32 = 0.1;
/// The tolerance of densities of the same point: small cosines have few digits.
const DENSITY_ERROR: f32 = 0.01;
/// The tolerance of a hit's distance from the sample, relative to the distance.
const DISTANCE_ERROR: f32 = 2e-3;
/// Points beside one, along the axes.
const BESIDE: usize = 6;

/// Checks the contracts of samples.
///
/// # Errors
/// If a method cannot be compiled or does not terminate.
pub fn check(subject: &Subject<'_>, place: &Place) -> Result<Vec<Finding>, Stop> {
    let mut tests = Tests {
        subject,
        place,
        points: Tally::new(Contract::SamplePoints),
        normals: Tally::new(Contract::SampleNormals),
        agreement: Tally::new(Contract::SampleAgreement),
        integral: Tally::new(Contract::SampleIntegral),
        distribution: Tally::new(Contract::SampleDistribution),
    };
    // Rounding decides at edges, for points and for the normals compared there.
    tests.points.allow(0.01);
    tests.normals.allow(0.01);
    let reason = if !subject.has(Method::GenerateSample) {
        "the class has no generateSample"
    } else {
        let viewpoints = viewpoints(subject, place)?;
        for (index, viewpoint) in viewpoints.iter().enumerate() {
            tests.check_from(*viewpoint, index, significance(viewpoints.len()))?;
        }
        "samples are not seen from where they were asked for"
    };
    let no_normals = if subject.has(Method::GenerateSample) && !subject.has(Method::ComputeNormal) {
        "the class has no computeNormal"
    } else {
        reason
    };
    let Tests { points, normals, agreement, integral, distribution, .. } = tests;
    Ok(vec![
        points.finish(reason),
        normals.finish(no_normals),
        agreement.finish(reason),
        integral.finish(reason),
        distribution.finish(reason),
    ])
}

/// Points from which the primitive is visible: far, near, close to its surface, and within its box.
fn viewpoints(subject: &Subject<'_>, place: &Place) -> Result<Vec<DVec3>, Stop> {
    let direction = DVec3::new(0.51, 0.62, -0.596).normalize();
    let far = place.center + 4.0 * place.radius * direction;
    let near = place.center - 1.3 * place.radius * direction;
    let within = place.center + 0.2 * place.radius * DVec3::new(-0.3, 0.5, 0.8).normalize();
    let mut all = vec![far, near, within];
    let stream = subject.stream(Contract::SamplePoints);
    let rays = (0..64).map(|item| {
        let origin = place.point_outside(stream, item);
        Ray::new(origin, place.point_within(stream.at(1), item) - origin, place.epsilon())
    });
    let shot = Shot::new(subject, rays.collect())?;
    let hit = (0..64).find(|ray| shot.hits[*ray].is_some());
    all.extend(hit.map(|ray| {
        let back = -shot.given[ray].direction.as_dvec3().normalize();
        shot.points[ray].as_dvec3() + 0.1 * place.radius * back
    }));
    Ok(all)
}

struct Tests<'a> {
    subject: &'a Subject<'a>,
    place: &'a Place,
    points: Tally,
    normals: Tally,
    agreement: Tally,
    integral: Tally,
    distribution: Tally,
}

/// The visible part of the primitive from a point, as samples and as a density.
struct ViewSource<'t, 'a> {
    tests: &'t mut Tests<'a>,
    from: Vec3,
    stream: Stream,
}

impl Source for ViewSource<'_, '_> {
    fn draw(&mut self, numbers: Range<u64>, samples: &mut Samples) -> Result<(), Stop> {
        batches(numbers)
            .try_for_each(|numbers| self.tests.sample(self.from, self.stream, numbers, samples))
    }

    fn densities(&mut self, directions: &[Vec3]) -> Result<Vec<f32>, Stop> {
        self.tests.densities_towards(self.from, directions)
    }
}

impl Tests<'_> {
    fn check_from(&mut self, from: DVec3, index: usize, significance: f64) -> Result<(), Stop> {
        let from = from.as_vec3();
        let stream = self.subject.stream(Contract::SampleDistribution).at(index as u64);
        let mut samples = Samples::default();
        let axis = (self.place.center - from.as_dvec3()).try_normalize().unwrap_or(DVec3::Z);
        let count = u64::from(self.subject.options.samples);
        let mut source = ViewSource { tests: self, from, stream };
        source.draw(0..count, &mut samples)?;
        // Proposals use other random numbers than samples.
        let proposals = stream.at(1);
        let found = Comparison::new(&mut source, &samples, axis, proposals, significance)?;
        let place = format!("from {from}");
        let message = || found.integral_message(&place, "are seen");
        if self.integral.test(found.integral_holds(), message) {
            self.integral.set_inputs(self.density_inputs(from, found.worst_direction())?);
        }
        if self.distribution.test(found.shape_holds(), || found.shape_message(&place)) {
            self.distribution.set_inputs(self.density_inputs(from, found.worst_direction())?);
        }
        Ok(())
    }

    /// Adds samples, checked one by one. Samples that are not visible have no density.
    fn sample(
        &mut self,
        from: Vec3,
        stream: Stream,
        numbers: Range<u64>,
        samples: &mut Samples,
    ) -> Result<(), Stop> {
        let mut rays = self.subject.rays(Role::Primitive, stream, numbers);
        rays.fill_vector("rt_RayOrigin", from);
        self.subject.call(Method::GenerateSample, &mut rays)?;
        let points = rays.vectors("rt_HitPoint");
        let normals: Vec<Vec3> =
            rays.vectors("rt_GeometricNormal").into_iter().map(Vec3::normalize).collect();
        let given = rays.floats("rt_PDF").to_vec();
        let (density_rays, there) = self.density_at(from, &points, &normals)?;
        let verdicts = self.verdicts(from, &points, &normals, &given, &there)?;
        let towards = points.iter().map(|point| self.ray(from, *point - from)).collect();
        let mut shot = Shot::new(self.subject, towards)?;
        shot.then(self.subject, Method::ComputeNormal)?;
        let found_normals = shot.vectors("rt_GeometricNormal");
        for (item, point) in points.into_iter().enumerate() {
            let (density, normal) = (given[item], normals[item]);
            let hit = shot.hits[item];
            let is_aslant = self.is_aslant(normal, point - from);
            let message = || {
                format!(
                    "from {from}: generateSample gives {point} with density {density}; a ray towards it finds {}",
                    hit.map_or("nothing".to_owned(), |t| format!("a hit at {t} of the way"))
                )
            };
            let is_found = hit.is_some_and(|t| t <= 1.0 + DISTANCE_ERROR);
            let is_sample = point.is_finite() && density.is_finite() && density >= 0.0;
            if self.points.test(is_sample && (is_found || !is_aslant), message) {
                self.points.set_inputs(shot.inputs(self.subject, item)?);
            }
            let is_seen = hit.is_some_and(|t| (t - 1.0).abs() <= DISTANCE_ERROR) && is_aslant;
            if is_seen && self.subject.has(Method::ComputeNormal) {
                self.check_normal(point, normal, found_normals[item]);
            }
            let message = || {
                format!(
                    "from {from}: generateSample gives {point} with density {density}, samplePDF says {} of it",
                    there[item]
                )
            };
            if is_seen && self.agreement.test(verdicts[item] != Verdict::Differ, message) {
                let inputs = self.subject.inputs(Method::SamplePdf, &density_rays, item)?;
                self.agreement.set_inputs(inputs);
            }
            samples.add(point - from, if is_seen { density } else { 0.0 });
        }
        Ok(())
    }

    /// Compares the densities of samples with those of `samplePDF` at their points, up to the rounding of points: where
    /// a cosine is tiny, their last digits decide.
    fn verdicts(
        &self,
        from: Vec3,
        points: &[Vec3],
        normals: &[Vec3],
        given: &[f32],
        stated: &[f32],
    ) -> Result<Vec<Verdict>, Stop> {
        let splat = |densities: &[f32]| densities.iter().copied().map(Vec3::splat).collect();
        let (given, stated): (Vec<Vec3>, Vec<Vec3>) = (splat(given), splat(stated));
        let is_close = |a: Vec3, b: Vec3| (a.x - b.x).abs() <= DENSITY_ERROR * a.x.abs();
        judge(
            &given,
            &stated,
            is_close,
            |_| true,
            |items| {
                let beside: Vec<Vec3> =
                    items.iter().flat_map(|item| points_beside(points[*item], from)).collect();
                let normals: Vec<Vec3> =
                    items.iter().flat_map(|item| [normals[*item]; BESIDE]).collect();
                let (_, densities) = self.density_at(from, &beside, &normals)?;
                // The density is unbounded where the cosine vanishes; as a bound of others it counts.
                Ok(densities.iter().map(|it| Vec3::splat(it.clamp(f32::MIN, f32::MAX))).collect())
            },
        )
    }

    /// True if the surface is not seen at a grazing angle, so that the sample counts. Always true without
    /// `computeNormal`.
    fn is_aslant(&self, normal: Vec3, direction: Vec3) -> bool {
        !self.subject.has(Method::ComputeNormal)
            || normal.dot(direction.normalize()).abs() >= MIN_COSINE
    }

    fn check_normal(&mut self, point: Vec3, normal: Vec3, found: Vec3) {
        let message = || {
            format!("at {point} generateSample says the normal is {normal}, computeNormal {found}")
        };
        self.normals.test(normal.dot(found) > 0.99, message);
    }

    /// Returns the inputs of `samplePDF` for the point that is visible in a direction.
    fn density_inputs(&self, from: Vec3, direction: Vec3) -> Result<Inputs, Stop> {
        let shot = Shot::new(self.subject, vec![self.ray(from, direction)])?;
        let (rays, _) = self.density_at(from, &shot.points, &[Vec3::Z])?;
        self.subject.inputs(Method::SamplePdf, &rays, 0)
    }

    fn ray(&self, from: Vec3, direction: Vec3) -> Ray {
        Ray::new(from.as_dvec3(), direction.as_dvec3(), self.place.epsilon())
    }

    /// Returns `samplePDF` of the points that are visible in these directions; 0 if there is none.
    fn densities_towards(&mut self, from: Vec3, directions: &[Vec3]) -> Result<Vec<f32>, Stop> {
        let mut all = Vec::with_capacity(directions.len());
        for numbers in batches(0..directions.len() as u64) {
            let batch = &directions[numbers.start as usize..numbers.end as usize];
            let towards = batch.iter().map(|it| self.ray(from, *it)).collect();
            let mut shot = Shot::new(self.subject, towards)?;
            shot.then(self.subject, Method::ComputeNormal)?;
            let normals = shot.vectors("rt_GeometricNormal");
            let (_, densities) = self.density_at(from, &shot.points, &normals)?;
            for (ray, density) in densities.into_iter().enumerate() {
                let counts = shot.hits[ray].is_some() && self.is_aslant(normals[ray], batch[ray]);
                all.push(if counts && density.is_finite() { density.max(0.0) } else { 0.0 });
            }
        }
        Ok(all)
    }

    /// Returns `samplePDF` of points.
    fn density_at(
        &self,
        from: Vec3,
        points: &[Vec3],
        normals: &[Vec3],
    ) -> Result<(Rays, Vec<f32>), Stop> {
        let count = points.len() as u64;
        let mut rays = self.subject.rays(Role::Primitive, Stream::new(0), 0..count);
        rays.fill_vector("rt_RayOrigin", from);
        rays.set_vectors("rt_HitPoint", points.iter().copied());
        rays.set_vectors("rt_GeometricNormal", normals.iter().copied());
        if self.subject.has(Method::SamplePdf) {
            self.subject.call(Method::SamplePdf, &mut rays)?;
        }
        let densities = rays.floats("rt_PDF").to_vec();
        Ok((rays, densities))
    }
}

/// Points that rounding may put in the place of one that is seen from `from`: some units in the last place away.
fn points_beside(point: Vec3, from: Vec3) -> [Vec3; BESIDE] {
    let error = 4.0 * f32::EPSILON * point.abs().max_element().max(from.abs().max_element());
    let [x, y, z] = [Vec3::X, Vec3::Y, Vec3::Z].map(|axis| error * axis);
    [point + x, point - x, point + y, point - y, point + z, point - z]
}
