//! `sampleBSDF` compared with `evaluatePDF` and `BSDF`, for one geometry of ray and surface after the other.

use std::ops::Range;

use glam::Vec3;
use rtsl::Method;

use super::meeting::Meeting;
use super::path_methods::{ONLY_SHADES, scatters};
use super::throughput::{Throughput, Weights};
use crate::contract::Contract;
use crate::distribution::{Comparison, Samples, Source};
use crate::neighbours::{Verdict, judge_directions};
use crate::random::Stream;
use crate::rays::Rays;
use crate::report::{Finding, Inputs};
use crate::statistics::significance;
use crate::stop::Stop;
use crate::subject::{Subject, batches};
use crate::tally::Tally;
use crate::values::{is_color, is_unit};

/// Checks all contracts of samples.
///
/// # Errors
/// If a method cannot be compiled or does not terminate.
pub fn check(subject: &Subject<'_>) -> Result<Vec<Finding>, Stop> {
    let mut tests = Tests::new(subject);
    if scatters(subject) {
        let meetings = Meeting::all();
        for (index, meeting) in meetings.iter().enumerate() {
            tests.check_meeting(meeting, index, significance(meetings.len()))?;
        }
    }
    Ok(tests.finish())
}

/// True if `BSDF` and `evaluatePDF` apply to a sample: it is valid and not a delta.
fn is_compared(value: Vec3, density: f32) -> bool {
    density != 0.0 && density.is_finite() && is_color(value)
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

/// The values of `BSDF` and `evaluatePDF` for some directions; the density is in all three components.
struct Stated {
    values: Vec<Vec3>,
    densities: Vec<Vec3>,
}

/// The scattering of a surface for one geometry, as samples and as a density.
struct MeetingSource<'t, 'a> {
    tests: &'t mut Tests<'a>,
    meeting: &'t Meeting,
    stream: Stream,
    weights: Weights,
}

impl Source for MeetingSource<'_, '_> {
    fn draw(&mut self, numbers: Range<u64>, samples: &mut Samples) -> Result<(), Stop> {
        let MeetingSource { tests, meeting, stream, weights } = self;
        for numbers in batches(numbers) {
            let count = (numbers.end - numbers.start) as usize;
            let mut rays = meeting.rays(tests.subject, *stream, count);
            rays.renumber(*stream, numbers.start);
            rays.set_vectors("rt_BSDFSeed", numbers.map(|item| stream.vector(item)));
            tests.subject.call(Method::SampleBsdf, &mut rays)?;
            tests.check_batch(meeting, &rays, samples, weights)?;
        }
        Ok(())
    }

    fn densities(&mut self, directions: &[Vec3]) -> Result<Vec<f32>, Stop> {
        self.tests.densities(self.meeting, directions)
    }
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
        let count = u64::from(self.subject.options.samples);
        let weights = Weights::new(meeting);
        let mut source = MeetingSource { tests: self, meeting, stream, weights };
        source.draw(0..count, &mut samples)?;
        // Proposals use other random numbers than samples.
        let proposals = stream.at(1);
        let found =
            Comparison::new(&mut source, &samples, meeting.normal, proposals, significance)?;
        let MeetingSource { weights, .. } = source;
        self.throughput.add(weights, significance);
        self.judge(meeting, &found)
    }

    /// Checks each sample individually, and keeps the valid ones.
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
        let stated = self.stated(meeting, &directions)?;
        let verdicts = self.verdicts(meeting, rays, &stated)?;
        for (ray, direction) in directions.into_iter().enumerate() {
            let (value, density) = (values[ray], densities[ray]);
            self.check_sample(meeting, rays, ray)?;
            samples.add(direction, density);
            weights.add(direction, value, density);
            if !is_compared(value, density) {
                continue;
            }
            let message = || {
                format!(
                    "{meeting}: sampleBSDF gives value {value} and density {density}, but towards the same direction BSDF is {} and evaluatePDF {}",
                    stated.values[ray], stated.densities[ray].x
                )
            };
            if self.agreement.judge(verdicts[ray], message) {
                self.agreement.set_inputs(self.subject.inputs(Method::SampleBsdf, rays, ray)?);
            }
        }
        Ok(())
    }

    /// Compares the value and the density of samples with those stated for their directions.
    fn verdicts(
        &self,
        meeting: &Meeting,
        rays: &Rays,
        stated: &Stated,
    ) -> Result<Vec<Verdict>, Stop> {
        let directions = rays.vectors("rt_LightDirection");
        let given = rays.vectors("rt_BSDFValue");
        let densities: Vec<Vec3> =
            rays.floats("rt_PDF").iter().map(|it| Vec3::splat(*it)).collect();
        let counts = |ray: usize| is_compared(given[ray], densities[ray].x);
        let values = judge_directions(&directions, &given, &stated.values, counts, |beside| {
            Ok(self.stated(meeting, beside)?.values)
        })?;
        let densities =
            judge_directions(&directions, &densities, &stated.densities, counts, |beside| {
                Ok(self.stated(meeting, beside)?.densities)
            })?;
        Ok(values.into_iter().zip(densities).map(|(value, density)| value.max(density)).collect())
    }

    /// Returns `BSDF` and `evaluatePDF` for these directions.
    fn stated(&self, meeting: &Meeting, directions: &[Vec3]) -> Result<Stated, Stop> {
        let mut rays = meeting.rays(self.subject, Stream::new(0), directions.len());
        rays.set_vectors("rt_LightDirection", directions.iter().copied());
        self.subject.call(Method::Bsdf, &mut rays)?;
        self.subject.call(Method::EvaluatePdf, &mut rays)?;
        let densities = rays.floats("rt_PDF").iter().map(|it| Vec3::splat(*it)).collect();
        Ok(Stated { values: rays.vectors("rt_BSDFValue"), densities })
    }

    /// Checks the direction, the value and the density of a sample.
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
        // Renderers ignore the direction of a black sample.
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

    /// Checks the comparison of samples with the density, as a whole and cell by cell.
    fn judge(&mut self, meeting: &Meeting, found: &Comparison) -> Result<(), Stop> {
        let place = meeting.to_string();
        let message = || found.integral_message(&place, "have a density");
        if self.integral.test(found.integral_holds(), message) {
            self.integral.set_inputs(self.density_inputs(meeting, found.worst_direction())?);
        }
        if self.distribution.test(found.shape_holds(), || found.shape_message(&place)) {
            self.distribution.set_inputs(self.density_inputs(meeting, found.worst_direction())?);
        }
        Ok(())
    }

    /// Returns the densities of directions; an invalid one breaks a contract and becomes 0.
    fn densities(&mut self, meeting: &Meeting, directions: &[Vec3]) -> Result<Vec<f32>, Stop> {
        let mut all = Vec::with_capacity(directions.len());
        let mut rays = None;
        for numbers in batches(0..directions.len() as u64) {
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
        // A class that scatters may have only delta samples.
        let is_sampled = scatters(self.subject);
        let reason = if is_sampled { "no sample has a density" } else { ONLY_SHADES };
        let mut findings: Vec<Finding> =
            tallies.into_iter().map(|tally| tally.finish(reason)).collect();
        findings.push(self.throughput.finish(is_sampled));
        findings
    }
}
