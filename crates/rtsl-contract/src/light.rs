//! Contracts of lights: `illumination` compared with `evaluatePDF` and `emission`.

use std::ops::Range;

use glam::{DVec3, Vec3};
use rtsl::{Method, Role};

use crate::contract::Contract;
use crate::distribution::{Comparison, Samples, Source};
use crate::neighbours::judge_directions;
use crate::random::Stream;
use crate::rays::Rays;
use crate::report::{Finding, Inputs};
use crate::statistics::significance;
use crate::stop::Stop;
use crate::subject::{Subject, batches};
use crate::tally::Tally;
use crate::values::{is_color, is_unit};

/// Checks a light.
///
/// # Errors
/// If a method cannot be compiled or does not terminate.
pub fn check(subject: &Subject<'_>) -> Result<Vec<Finding>, Stop> {
    let mut tests = Tests {
        subject,
        directions: Tally::new(Contract::LightDirections),
        values: Tally::new(Contract::LightValues),
        agreement: Tally::new(Contract::LightAgreement),
        integral: Tally::new(Contract::LightIntegral),
        distribution: Tally::new(Contract::LightDistribution),
        emission: Tally::new(Contract::LightEmission),
    };
    if subject.has(Method::Illumination) {
        let points = points();
        for (index, point) in points.iter().enumerate() {
            tests.check_point(point, index, significance(points.len()))?;
        }
    }
    Ok(tests.finish())
}

/// A point to be lit, and its normal.
struct Point {
    point: DVec3,
    normal: DVec3,
}

fn points() -> Vec<Point> {
    let point = |x, y, z, normal: DVec3| Point { point: DVec3::new(x, y, z), normal };
    vec![
        point(0.5, 1.5, -2.0, DVec3::Y),
        point(-0.3, -1.0, 0.4, DVec3::NEG_Z),
        point(20.0, 3.0, 11.0, DVec3::new(-0.6, -0.3, 0.2).normalize()),
        point(0.1, 0.2, 0.3, DVec3::new(0.48, 0.6, -0.64)),
    ]
}

struct Tests<'a> {
    subject: &'a Subject<'a>,
    directions: Tally,
    values: Tally,
    agreement: Tally,
    integral: Tally,
    distribution: Tally,
    emission: Tally,
}

/// The light at a point, as samples and as a density.
struct PointSource<'t, 'a> {
    tests: &'t mut Tests<'a>,
    point: &'t Point,
    stream: Stream,
}

impl Source for PointSource<'_, '_> {
    fn draw(&mut self, numbers: Range<u64>, samples: &mut Samples) -> Result<(), Stop> {
        for numbers in batches(numbers) {
            let mut rays = self.tests.rays_at(self.point, self.stream, numbers);
            self.tests.subject.call(Method::Illumination, &mut rays)?;
            self.tests.check_values(&rays, samples)?;
            self.tests.check_others(self.point, &rays)?;
        }
        Ok(())
    }

    fn densities(&mut self, directions: &[Vec3]) -> Result<Vec<f32>, Stop> {
        let densities = self.tests.densities(self.point, directions)?.into_iter();
        Ok(densities.map(|it| if it.is_finite() { it.max(0.0) } else { 0.0 }).collect())
    }
}

impl Tests<'_> {
    fn check_point(&mut self, point: &Point, index: usize, significance: f64) -> Result<(), Stop> {
        let stream = self.subject.stream(Contract::LightDistribution).at(index as u64);
        let mut samples = Samples::default();
        let count = u64::from(self.subject.options.samples);
        let mut source = PointSource { tests: self, point, stream };
        source.draw(0..count, &mut samples)?;
        if !(samples.has_densities() && source.tests.subject.has(Method::EvaluatePdf)) {
            return Ok(());
        }
        // Proposals use other random numbers than samples.
        let proposals = stream.at(1);
        let found = Comparison::new(&mut source, &samples, point.normal, proposals, significance)?;
        let place = format!("at {}", point.point.as_vec3());
        let message = || found.integral_message(&place, "have a density");
        if self.integral.test(found.integral_holds(), message) {
            self.integral.set_inputs(self.density_inputs(point, found.worst_direction())?);
        }
        if self.distribution.test(found.shape_holds(), || found.shape_message(&place)) {
            self.distribution.set_inputs(self.density_inputs(point, found.worst_direction())?);
        }
        Ok(())
    }

    fn check_values(&mut self, rays: &Rays, samples: &mut Samples) -> Result<(), Stop> {
        let (directions, colors) =
            (rays.vectors("rt_LightDirection"), rays.vectors("rt_LightColor"));
        let (densities, distances) = (rays.floats("rt_PDF"), rays.floats("rt_LightDistance"));
        for (ray, direction) in directions.into_iter().enumerate() {
            let (color, density, distance) = (colors[ray], densities[ray], distances[ray]);
            samples.add(direction, density);
            let is_sample =
                is_color(color) && density.is_finite() && density >= 0.0 && distance > 0.0;
            let message = || {
                format!(
                    "illumination gives colour {color}, density {density} and distance {distance}"
                )
            };
            if self.values.test(is_sample, message) {
                self.values.set_inputs(self.subject.inputs(Method::Illumination, rays, ray)?);
            }
            let message = || {
                let length = direction.length();
                format!("illumination gives direction {direction}, whose length is {length}")
            };
            let is_black = color == Vec3::ZERO && density == 0.0;
            if !is_black && self.directions.test(is_unit(direction), message) {
                self.directions.set_inputs(self.subject.inputs(Method::Illumination, rays, ray)?);
            }
        }
        Ok(())
    }

    /// Compares the samples with other methods for the same directions.
    fn check_others(&mut self, point: &Point, rays: &Rays) -> Result<(), Stop> {
        let directions = rays.vectors("rt_LightDirection");
        if self.subject.has(Method::EvaluatePdf) {
            self.check_agreement(point, rays, &directions)?;
        }
        if self.subject.has(Method::Emission) {
            self.check_emission(point, rays, &directions)?;
        }
        Ok(())
    }

    fn check_agreement(
        &mut self,
        point: &Point,
        rays: &Rays,
        directions: &[Vec3],
    ) -> Result<(), Stop> {
        let given: Vec<Vec3> = rays.floats("rt_PDF").iter().map(|it| Vec3::splat(*it)).collect();
        let stated = self.splat_densities(point, directions)?;
        let is_sample = |ray: usize| given[ray].x > 0.0;
        let verdicts = judge_directions(directions, &given, &stated, is_sample, |beside| {
            self.splat_densities(point, beside)
        })?;
        for ray in (0..given.len()).filter(|ray| is_sample(*ray)) {
            let message = || {
                format!(
                    "illumination gives direction {} with density {}, evaluatePDF says {} of it",
                    directions[ray], given[ray].x, stated[ray].x
                )
            };
            if self.agreement.judge(verdicts[ray], message) {
                self.agreement.set_inputs(self.density_inputs(point, directions[ray])?);
            }
        }
        Ok(())
    }

    /// Compares the emission of a light at infinity with its samples.
    fn check_emission(
        &mut self,
        point: &Point,
        rays: &Rays,
        directions: &[Vec3],
    ) -> Result<(), Stop> {
        let colors = rays.vectors("rt_LightColor");
        let emitted = self.emitted(point, directions)?;
        let (densities, distances) = (rays.floats("rt_PDF"), rays.floats("rt_LightDistance"));
        let is_far_sample = |ray: usize| densities[ray] > 0.0 && distances[ray] == f32::INFINITY;
        let verdicts = judge_directions(directions, &colors, &emitted, is_far_sample, |beside| {
            self.emitted(point, beside)
        })?;
        for ray in (0..colors.len()).filter(|ray| is_far_sample(*ray)) {
            let message = || {
                format!(
                    "towards {} illumination gives {}, emission {}",
                    directions[ray], colors[ray], emitted[ray]
                )
            };
            if self.emission.judge(verdicts[ray], message) {
                let rays = self.rays_towards(point, &[directions[ray]]);
                self.emission.set_inputs(self.subject.inputs(Method::Emission, &rays, 0)?);
            }
        }
        Ok(())
    }

    /// Returns `emission` in these directions.
    fn emitted(&self, point: &Point, directions: &[Vec3]) -> Result<Vec<Vec3>, Stop> {
        let mut rays = self.rays_towards(point, directions);
        self.subject.call(Method::Emission, &mut rays)?;
        Ok(rays.vectors("rt_EmissionColor"))
    }

    /// Returns `evaluatePDF` for these directions.
    fn densities(&self, point: &Point, directions: &[Vec3]) -> Result<Vec<f32>, Stop> {
        let mut all = Vec::with_capacity(directions.len());
        for numbers in batches(0..directions.len() as u64) {
            let batch = &directions[numbers.start as usize..numbers.end as usize];
            let mut rays = self.rays_towards(point, batch);
            self.subject.call(Method::EvaluatePdf, &mut rays)?;
            all.extend_from_slice(rays.floats("rt_PDF"));
        }
        Ok(all)
    }

    /// The densities in all three components, so that they can be compared like colours.
    fn splat_densities(&self, point: &Point, directions: &[Vec3]) -> Result<Vec<Vec3>, Stop> {
        let densities = self.densities(point, directions)?;
        Ok(densities.into_iter().map(Vec3::splat).collect())
    }

    fn density_inputs(&self, point: &Point, direction: Vec3) -> Result<Inputs, Stop> {
        let rays = self.rays_towards(point, &[direction]);
        self.subject.inputs(Method::EvaluatePdf, &rays, 0)
    }

    fn rays_towards(&self, point: &Point, directions: &[Vec3]) -> Rays {
        let mut rays = self.rays_at(point, Stream::new(0), 0..directions.len() as u64);
        rays.set_vectors("rt_LightDirection", directions.iter().copied());
        rays.set_vectors("rt_RayDirection", directions.iter().copied());
        rays
    }

    fn rays_at(&self, point: &Point, stream: Stream, numbers: Range<u64>) -> Rays {
        let mut rays = self.subject.rays(Role::Light, stream, numbers);
        rays.fill_vector("rt_HitPoint", point.point.as_vec3());
        rays.fill_vector("rt_RayOrigin", point.point.as_vec3());
        rays.fill_vector("rt_GeometricNormal", point.normal.as_vec3());
        rays.fill_vector("rt_ShadingNormal", point.normal.as_vec3());
        rays
    }

    fn finish(self) -> Vec<Finding> {
        const NO_DENSITY: &str = "a light without extent: no sample has a density";
        let has_density = self.subject.has(Method::EvaluatePdf);
        let dense = if has_density { NO_DENSITY } else { "the class has no evaluatePDF" };
        let has_emission = self.subject.has(Method::Emission);
        let emission = if has_emission {
            "no sample with a density lies infinitely far away"
        } else {
            "the class has no emission"
        };
        vec![
            self.directions.finish("the class has no illumination"),
            self.values.finish("the class has no illumination"),
            self.agreement.finish(dense),
            self.integral.finish(dense),
            self.distribution.finish(dense),
            self.emission.finish(emission),
        ]
    }
}
