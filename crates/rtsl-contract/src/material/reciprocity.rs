//! Reciprocity of the BSDF. Materials that turn shading normals are not reciprocal; [`cycles`] checks the weaker
//! property that they have.

use glam::{DVec3, Vec3};
use rtsl::Method;

use super::cycles;
use super::meeting::Meeting;
use super::path_methods::{ONLY_SHADES, scatters};
use crate::contract::Contract;
use crate::random::Stream;
use crate::rays::Rays;
use crate::report::Finding;
use crate::stop::Stop;
use crate::subject::Subject;
use crate::tally::Tally;

/// The number of pairs of directions.
pub(super) const PAIRS: usize = 1024;
/// The relative tolerance: narrow lobes amplify rounding of directions.
pub(super) const RELATIVE_ERROR: f64 = 0.02;
/// The fraction of pairs that may fail because of rounding, in the tails of narrow lobes.
const ROUNDED_PART: f64 = 0.02;
/// Directions closer to opposite than this have no accurate half vector, so that narrow lobes amplify rounding.
pub(super) const MIN_SUM: f32 = 0.1;
/// Values below this fraction of the greatest are ignored.
pub(super) const MIN_PART: f64 = 1e-5;

/// Checks random pairs of directions and pairs made of samples.
///
/// # Errors
/// If a method cannot be compiled or does not terminate.
pub fn check(subject: &Subject<'_>) -> Result<Finding, Stop> {
    let mut tally = Tally::new(Contract::Reciprocity);
    tally.allow(ROUNDED_PART);
    if !scatters(subject) {
        return Ok(tally.finish(ONLY_SHADES));
    }
    let stream = subject.stream(Contract::Reciprocity);
    let mut ways = Ways::new(subject, stream)?;
    if ways.are_random(subject)? {
        return Ok(tally.finish("BSDF is a matter of chance: it calls rand()"));
    }
    if subject.turns_normals {
        cycles::judge(subject, &mut tally)?;
    } else {
        ways.judge(subject, &mut tally)?;
    }
    Ok(tally.finish("BSDF is black, or no number, in both directions of all pairs tried"))
}

/// Pairs of directions that point away from the surface, with the BSDF from one to the other.
struct Ways {
    normal: DVec3,
    views: Vec<Vec3>,
    lights: Vec<Vec3>,
    there: Rays,
    back: Rays,
}

impl Ways {
    fn new(subject: &Subject<'_>, stream: Stream) -> Result<Ways, Stop> {
        let meeting = Meeting::new(0.0, 0.0, false);
        let views: Vec<Vec3> =
            (0..PAIRS as u64).map(|item| stream.direction(item).as_vec3()).collect();
        let mut rays = meeting.rays(subject, stream, PAIRS);
        rays.set_ray_directions(views.iter().map(|view| -*view));
        rays.set_vectors("rt_BSDFSeed", (0..PAIRS as u64).map(|item| stream.vector(item)));
        subject.call(Method::SampleBsdf, &mut rays)?;
        let samples = rays.vectors("rt_LightDirection");
        let any = stream.at(1);
        let lights = samples.into_iter().enumerate().map(|(item, sample)| {
            let is_direction = (sample.length() - 1.0).abs() < 1e-3;
            if item % 2 == 0 && is_direction {
                sample
            } else {
                any.direction(item as u64).as_vec3()
            }
        });
        let lights: Vec<Vec3> = lights.collect();
        let there = values(subject, &meeting, &views, &lights)?;
        let back = values(subject, &meeting, &lights, &views)?;
        Ok(Ways { normal: meeting.normal, views, lights, there, back })
    }

    /// True if the same call returns other values with other random numbers.
    fn are_random(&mut self, subject: &Subject<'_>) -> Result<bool, Stop> {
        let before = self.there.vectors("rt_BSDFValue");
        self.there.renumber(subject.stream(Contract::Reciprocity).at(2), 0);
        subject.call(Method::Bsdf, &mut self.there)?;
        let after = self.there.vectors("rt_BSDFValue");
        let differ = |(a, b): (&Vec3, &Vec3)| a != b && a.is_finite();
        Ok(before.iter().zip(&after).any(differ))
    }

    fn judge(&self, subject: &Subject<'_>, tally: &mut Tally) -> Result<(), Stop> {
        let (there, back) = (self.there.vectors("rt_BSDFValue"), self.back.vectors("rt_BSDFValue"));
        // NaN is handled by another contract.
        let are_finite = |pair: usize| there[pair].is_finite() && back[pair].is_finite();
        let greatest = (0..PAIRS)
            .filter(|pair| are_finite(*pair))
            .fold(0.0, |most: f64, pair| most.max(sum(there[pair])).max(sum(back[pair])));
        let counts = |pair: usize| {
            are_finite(pair)
                && (self.views[pair] + self.lights[pair]).length() > MIN_SUM
                && sum(there[pair]).max(sum(back[pair])) > MIN_PART * greatest
        };
        let scale = self.scale(&there, &back, counts);
        for pair in (0..PAIRS).filter(|pair| counts(*pair)) {
            let factor = match self.passes(pair) {
                None => 1.0,
                Some(true) => scale,
                Some(false) => 1.0 / scale,
            };
            let (a, b) = (there[pair].as_dvec3(), factor * back[pair].as_dvec3());
            let difference = (a - b).abs().max_element();
            let holds = difference <= RELATIVE_ERROR * a.abs().max(b.abs()).max_element();
            let message = || {
                format!(
                    "towards light {} from viewer {} BSDF is {}, with both exchanged {}",
                    self.lights[pair], self.views[pair], there[pair], back[pair]
                )
            };
            if tally.test(holds, message) {
                tally.set_inputs(subject.inputs(Method::Bsdf, &self.there, pair)?);
            }
        }
        if scale != 1.0 {
            tally.note(format!(
                "light that comes through from outside is {scale:.3} times that from behind, taken for the square of the ratio of indices"
            ));
        }
        Ok(())
    }

    /// Returns `None` for reflection; for transmission, true if the viewer is outside.
    fn passes(&self, pair: usize) -> Option<bool> {
        let side = |direction: Vec3| direction.as_dvec3().dot(self.normal) > 0.0;
        let (view, light) = (side(self.views[pair]), side(self.lights[pair]));
        (view != light).then_some(view)
    }

    /// The median ratio of transmitted light seen from outside to that seen from behind.
    fn scale(&self, there: &[Vec3], back: &[Vec3], counts: impl Fn(usize) -> bool) -> f64 {
        let ratio = |pair: usize| {
            let from_outside = self.passes(pair)?;
            let (outside, behind) =
                if from_outside { (there[pair], back[pair]) } else { (back[pair], there[pair]) };
            let ratio = sum(outside) / sum(behind);
            (counts(pair) && ratio.is_finite() && ratio > 0.0).then_some(ratio)
        };
        let mut ratios: Vec<f64> = (0..PAIRS).filter_map(ratio).collect();
        ratios.sort_by(f64::total_cmp);
        let median = ratios.get(ratios.len() / 2).copied().unwrap_or(1.0);
        if (median - 1.0).abs() < RELATIVE_ERROR { 1.0 } else { median }
    }
}

pub(super) fn sum(value: Vec3) -> f64 {
    f64::from(value.x) + f64::from(value.y) + f64::from(value.z)
}

pub(super) fn values(
    subject: &Subject<'_>,
    meeting: &Meeting,
    views: &[Vec3],
    lights: &[Vec3],
) -> Result<Rays, Stop> {
    let mut rays = meeting.rays(subject, subject.stream(Contract::Reciprocity), views.len());
    rays.set_ray_directions(views.iter().map(|view| -*view));
    rays.set_vectors("rt_LightDirection", lights.iter().copied());
    subject.call(Method::Bsdf, &mut rays)?;
    Ok(rays)
}
