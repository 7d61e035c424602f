//! `sampleBSDF` against `evaluatePDF` and `BSDF`, one meeting of ray and surface after the other.

use glam::Vec3;
use rtsl::Method;

use super::ONLY_SHADES;
use super::meeting::Meeting;
use super::throughput::{Throughput, Weights};
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

/// Checks all that samples say.
///
/// # Errors
/// If a method has no code, or does not end.
pub fn check(subject: &Subject<'_>) -> Result<Vec<Finding>, Stop> {
    let mut tests = Tests::new(subject);
    if super::scatters(subject) {
        let meetings = Meeting::all();
        for (index, meeting) in meetings.iter().enumerate() {
            tests.check_meeting(meeting, index, significance(meetings.len()))?;
        }
    }
    Ok(tests.finish())
}

struct Tests<'a> {
    subject: &'a Subject<'a>,
    directions: Tally,
    values: Tally,
    agreement: Tally,
    integral: Tally,
    distribution: Tally,
    throughput: Throughput,
}

impl<'a> Tests<'a> {
    fn new(subject: &'a Subject<'a>) -> Tests<'a> {
        Tests {
            subject,
            directions: Tally::new(Contract::ScatteredDirections),
            values: Tally::new(Contract::ScatteredValues),
            agreement: Tally::new(Contract::ScatteredAgreement),
            integral: Tally::new(Contract::ScatteredIntegral),
            distribution: Tally::new(Contract::ScatteredDistribution),
            throughput: Throughput::default(),
        }
    }

    fn check_meeting(
        &mut self,
        meeting: &Meeting,
        index: usize,
        significance: f64,
    ) -> Result<(), Stop> {
        let stream = self.subject.stream(Contract::ScatteredDistribution).at(index as u64);
        let mut samples = Samples::default();
        let mut weights = Weights::new(meeting);
        for numbers in batches(u64::from(self.subject.options.samples)) {
            let count = (numbers.end - numbers.start) as usize;
            let mut rays = meeting.rays(self.subject, stream, count);
            rays.renumber(stream, numbers.start);
            rays.set_vectors("rt_BSDFSeed", numbers.map(|item| stream.vector(item)));
            self.subject.call(Method::SampleBsdf, &mut rays)?;
            self.check_batch(meeting, &rays, &mut samples, &mut weights)?;
        }
        self.throughput.add(weights, significance);
        self.compare(meeting, &samples, significance)
    }

    /// Checks each sample by itself, and keeps those that are right so far.
    fn check_batch(
        &mut self,
        meeting: &Meeting,
        rays: &Rays,
        samples: &mut Samples,
        weights: &mut Weights,
    ) -> Result<(), Stop> {
        let directions = rays.vectors("rt_LightDirection");
        let values = rays.vectors("rt_BSDFValue");
        let densities = rays.floats("rt_PDF");
        let mut there = meeting.rays(self.subject, Stream::new(0), rays.count());
        there.set_vectors("rt_LightDirection", directions.iter().copied());
        self.subject.call(Method::Bsdf, &mut there)?;
        self.subject.call(Method::EvaluatePdf, &mut there)?;
        let values_there = there.vectors("rt_BSDFValue");
        let densities_there = there.floats("rt_PDF");
        for (ray, direction) in directions.into_iter().enumerate() {
            let (value, density) = (values[ray], densities[ray]);
            self.check_sample(meeting, rays, ray)?;
            samples.add(direction, density);
            if is_color(value) && direction.is_finite() && density >= 0.0 {
                weights.add(direction, value, density);
            }
            if density == 0.0 || !is_color(value) || !density.is_finite() {
                continue;
            }
            let message = || {
                format!(
                    "{meeting}: sampleBSDF gives value {value} and density {density}, but towards the same direction BSDF is {} and evaluatePDF {}",
                    values_there[ray], densities_there[ray]
                )
            };
            let agree = is_close(value, values_there[ray])
                && is_close(Vec3::splat(density), Vec3::splat(densities_there[ray]));
            if self.agreement.test(agree, message) {
                self.agreement.set_inputs(self.subject.inputs(Method::SampleBsdf, rays, ray)?);
            }
        }
        Ok(())
    }

    /// Whether a sample is one: a direction, a value and a density.
    fn check_sample(&mut self, meeting: &Meeting, rays: &Rays, ray: usize) -> Result<(), Stop> {
        let direction = rays.vector("rt_LightDirection", ray);
        let value = rays.vector("rt_BSDFValue", ray);
        let density = rays.floats("rt_PDF")[ray];
        let inputs = || self.subject.inputs(Method::SampleBsdf, rays, ray);
        let is_value = is_color(value) && density.is_finite() && density >= 0.0;
        let message = || format!("{meeting}: sampleBSDF gives value {value}, density {density}");
        if self.values.test(is_value, message) {
            self.values.set_inputs(inputs()?);
        }
        // Nobody looks at the direction of a sample that is black.
        let is_given_up = density == 0.0 && value == Vec3::ZERO;
        let message = || {
            let length = direction.length();
            format!("{meeting}: sampleBSDF gives direction {direction}, whose length is {length}")
        };
        if !is_given_up && self.directions.test(is_unit(direction), message) {
            self.directions.set_inputs(inputs()?);
        }
        Ok(())
    }

    /// Compares samples with the density, as a whole and cell by cell.
    fn compare(
        &mut self,
        meeting: &Meeting,
        samples: &Samples,
        significance: f64,
    ) -> Result<(), Stop> {
        let partition = Partition::new(meeting.normal, &samples.pilots);
        let integrals =
            partition.integrate(samples.count, |directions| self.densities(meeting, directions))?;
        let found = Comparison::new(&partition, &integrals, samples, significance);
        let place = meeting.to_string();
        let message = || found.integral_message(&place, "have a density");
        if self.integral.test(found.integral_holds(), message) {
            self.integral.set_inputs(self.density_inputs(meeting, found.worst.direction)?);
        }
        if self.distribution.test(found.shape_holds(), || found.shape_message(&place)) {
            self.distribution.set_inputs(self.density_inputs(meeting, found.worst.direction)?);
        }
        Ok(())
    }

    /// The density towards directions; what is none counts as broken and as 0.
    fn densities(&mut self, meeting: &Meeting, directions: &[Vec3]) -> Result<Vec<f32>, Stop> {
        let mut all = Vec::with_capacity(directions.len());
        let mut rays = None;
        for numbers in batches(directions.len() as u64) {
            let batch = &directions[numbers.start as usize..numbers.end as usize];
            let rays =
                rays.get_or_insert_with(|| meeting.rays(self.subject, Stream::new(0), batch.len()));
            rays.truncate(batch.len());
            rays.restart();
            rays.set_vectors("rt_LightDirection", batch.iter().copied());
            self.subject.call(Method::EvaluatePdf, rays)?;
            for (ray, density) in rays.floats("rt_PDF").iter().enumerate() {
                let is_density = density.is_finite() && *density >= 0.0;
                let message = || format!("{meeting}: evaluatePDF gives {density}");
                if self.values.test(is_density, message) {
                    self.values.set_inputs(self.subject.inputs(Method::EvaluatePdf, rays, ray)?);
                }
                all.push(if is_density { *density } else { 0.0 });
            }
        }
        Ok(all)
    }

    fn density_inputs(&self, meeting: &Meeting, direction: Vec3) -> Result<Inputs, Stop> {
        let mut rays = meeting.rays(self.subject, Stream::new(0), 1);
        rays.fill_vector("rt_LightDirection", direction);
        self.subject.inputs(Method::EvaluatePdf, &rays, 0)
    }

    fn finish(self) -> Vec<Finding> {
        let tallies =
            [self.directions, self.values, self.agreement, self.integral, self.distribution];
        // Of a class that scatters, some may have nothing to test: all its samples are deltas.
        let is_sampled = super::scatters(self.subject);
        let reason = if is_sampled { "no sample has a density" } else { ONLY_SHADES };
        let mut findings: Vec<Finding> =
            tallies.into_iter().map(|tally| tally.finish(reason)).collect();
        findings.push(self.throughput.finish());
        findings
    }
}
