//! Reciprocity of materials that turn shading normals.
//!
//! If a material asks another with a turned normal, the cosine with this normal replaces that with the surface's. The
//! BSDF from `a` to `b` then has a factor that depends on `b` alone, and differs from that from `b` to `a` by a factor
//! of each direction. Around a cycle of three directions these factors cancel: the product of the values is the same
//! both ways around.

use glam::Vec3;

use super::meeting::Meeting;
use super::reciprocity::{MIN_PART, MIN_SUM, PAIRS, RELATIVE_ERROR, sum, values};
use crate::contract::Contract;
use crate::stop::Stop;
use crate::subject::Subject;
use crate::tally::Tally;

/// Checks random cycles.
///
/// # Errors
/// If a method cannot be compiled or does not terminate.
pub fn judge(subject: &Subject<'_>, tally: &mut Tally) -> Result<(), Stop> {
    let meeting = Meeting::new(0.0, 0.0, false);
    let stream = subject.stream(Contract::Reciprocity).at(3);
    let corners: [Vec<Vec3>; 3] = std::array::from_fn(|corner| {
        let stream = stream.at(corner as u64);
        (0..PAIRS as u64).map(|item| stream.direction(item).as_vec3()).collect()
    });
    let of = |from: usize, to: usize| {
        let rays = values(subject, &meeting, &corners[from], &corners[to])?;
        Ok::<_, Stop>(rays.vectors("rt_BSDFValue"))
    };
    let there = [of(0, 1)?, of(1, 2)?, of(2, 0)?];
    let back = [of(1, 0)?, of(2, 1)?, of(0, 2)?];
    let greatest = there.iter().chain(&back).flatten().filter(|value| value.is_finite());
    let greatest = greatest.fold(0.0, |most: f64, value| most.max(sum(*value)));
    for item in 0..PAIRS {
        let counts = |value: Vec3| value.is_finite() && sum(value) > MIN_PART * greatest;
        let all = there.iter().chain(&back).all(|values| counts(values[item]));
        let is_wide = |a: usize, b: usize| (corners[a][item] + corners[b][item]).length() > MIN_SUM;
        if !(all && is_wide(0, 1) && is_wide(1, 2) && is_wide(2, 0)) {
            continue;
        }
        let around = |ways: &[Vec<Vec3>; 3]| {
            ways.iter().map(|values| values[item].as_dvec3()).fold(glam::DVec3::ONE, |a, b| a * b)
        };
        let (a, b) = (around(&there), around(&back));
        let difference = (a - b).abs().max_element();
        let holds = difference <= 3.0 * RELATIVE_ERROR * a.abs().max(b.abs()).max_element();
        tally.test(holds, || {
            let [first, second, third] = [0, 1, 2].map(|corner| corners[corner][item]);
            format!(
                "from viewer {first} over {second} and {third} back the product of BSDF is {a}, the other way around {b}"
            )
        });
    }
    tally.note(
        "shading normals are turned, so cycles of three directions are compared, not pairs"
            .to_owned(),
    );
    Ok(())
}
