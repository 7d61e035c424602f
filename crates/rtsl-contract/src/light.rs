//! What lights promise: `illumination` against `evaluatePDF` and `emission`.

use std::ops::Range;

use glam::{DVec3, Vec3};
use rtsl::{Method, Role};

use crate::distribution::{Comparison, Samples};
use crate::partition::Partition;
use crate::random::Stream;
use crate::rays::Rays;
use crate::statistics::significance;
use crate::stop::Stop;
use crate::subject::{Subject, batches};
use crate::tally::Tally;
use crate::values::{is_close, is_color, is_unit};
use crate::{Contract, Finding, Inputs};

/// Checks a light.
///
/// # Errors
/// If a method has no code, or does not end.
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

impl Tests<'_> {
    fn check_point(&mut self, point: &Point, index: usize, significance: f64) -> Result<(), Stop> {
        let stream = self.subject.stream(Contract::LightDistribution).at(index as u64);
        let mut samples = Samples::default();
        for numbers in batches(u64::from(self.subject.options.samples)) {
            let mut rays = self.rays_at(point, stream, numbers);
            self.subject.call(Method::Illumination, &mut rays)?;
            self.check_values(&rays, &mut samples)?;
            self.check_others(point, &rays)?;
        }
        if samples.has_densities() && self.subject.has(Method::EvaluatePdf) {
            self.compare(point, &samples, significance)?;
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

    /// What other methods say of the same directions.
    fn check_others(&mut self, point: &Point, rays: &Rays) -> Result<(), Stop> {
        let directions = rays.vectors("rt_LightDirection");
        let count = directions.len() as u64;
        let mut there = self.rays_at(point, Stream::new(0), 0..count);
        there.set_vectors("rt_LightDirection", directions.iter().copied());
        there.set_vectors("rt_RayDirection", directions.iter().copied());
        let has_density = self.subject.has(Method::EvaluatePdf);
        let has_emission = self.subject.has(Method::Emission);
        if has_density {
            self.subject.call(Method::EvaluatePdf, &mut there)?;
        }
        let densities = there.floats("rt_PDF").to_vec();
        if has_emission {
            self.subject.call(Method::Emission, &mut there)?;
        }
        let emitted = there.vectors("rt_EmissionColor");
        let colors = rays.vectors("rt_LightColor");
        for (ray, density) in rays.floats("rt_PDF").iter().enumerate().filter(|(_, it)| **it > 0.0)
        {
            let close = is_close(Vec3::splat(*density), Vec3::splat(densities[ray]));
            let message = || {
                format!(
                    "illumination gives direction {} with density {density}, evaluatePDF says {} of it",
                    directions[ray], densities[ray]
                )
            };
            if has_density && self.agreement.test(close, message) {
                self.agreement.set_inputs(self.subject.inputs(Method::EvaluatePdf, &there, ray)?);
            }
            let is_far = rays.floats("rt_LightDistance")[ray] == f32::INFINITY;
            let message = || {
                format!(
                    "towards {} illumination gives {}, emission {}",
                    directions[ray], colors[ray], emitted[ray]
                )
            };
            if has_emission
                && is_far
                && self.emission.test(is_close(colors[ray], emitted[ray]), message)
            {
                self.emission.set_inputs(self.subject.inputs(Method::Emission, &there, ray)?);
            }
        }
        Ok(())
    }

    fn compare(&mut self, point: &Point, samples: &Samples, significance: f64) -> Result<(), Stop> {
        let partition = Partition::new(point.normal, &samples.pilots);
        let integrals =
            partition.integrate(samples.count, |directions| self.densities(point, directions))?;
        let found = Comparison::new(&partition, &integrals, samples, significance);
        let place = format!("at {}", point.point.as_vec3());
        let message = || found.integral_message(&place, "have a density");
        if self.integral.test(found.integral_holds(), message) {
            self.integral.set_inputs(self.density_inputs(point, found.worst.direction)?);
        }
        if self.distribution.test(found.shape_holds(), || found.shape_message(&place)) {
            self.distribution.set_inputs(self.density_inputs(point, found.worst.direction)?);
        }
        Ok(())
    }

    fn densities(&self, point: &Point, directions: &[Vec3]) -> Result<Vec<f32>, Stop> {
        let mut all = Vec::with_capacity(directions.len());
        for numbers in batches(directions.len() as u64) {
            let batch = &directions[numbers.start as usize..numbers.end as usize];
            let mut rays = self.rays_at(point, Stream::new(0), 0..batch.len() as u64);
            rays.set_vectors("rt_LightDirection", batch.iter().copied());
            self.subject.call(Method::EvaluatePdf, &mut rays)?;
            let densities = rays.floats("rt_PDF").iter();
            all.extend(densities.map(|it| if it.is_finite() { it.max(0.0) } else { 0.0 }));
        }
        Ok(all)
    }

    fn density_inputs(&self, point: &Point, direction: Vec3) -> Result<Inputs, Stop> {
        let mut rays = self.rays_at(point, Stream::new(0), 0..1);
        rays.fill_vector("rt_LightDirection", direction);
        self.subject.inputs(Method::EvaluatePdf, &rays, 0)
    }

    fn rays_at(&self, point: &Point, stream: Stream, numbers: Range<u64>) -> Rays {
        let mut rays = self.subject.rays(Role::Light, stream, numbers);
        rays.fill_vector("rt_HitPoint", point.point.as_vec3());
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
