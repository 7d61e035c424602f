//! Directions so close to one that rounding may tell them apart.
//!
//! Two methods may find the edge of a light or of a lobe at places that differ by rounding: one gives a direction just
//! within, and the other sees it just outside. What such a direction has is what some direction beside it has.

use glam::Vec3;

use crate::stop::Stop;
use crate::values::is_close;

/// How far beside, in radians. The cosine of a small angle has few digits of it, so that edges found by one are this far
/// apart.
const ANGLES: [f32; 3] = [1e-6, 1e-5, 1e-4];
/// How many directions are looked at beside one.
const COUNT: usize = 6 * ANGLES.len();
/// More directions of a call than these do not lie at edges.
const MAX_NEIGHBOURS: usize = 256;

/// How what two methods say of one direction stands to each other.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Verdict {
    /// They say the same.
    Agree,
    /// One says what the other says of directions beside.
    Rounded,
    /// They say different things.
    Differ,
}

/// Judges what was given with each direction by what is `stated` of it; `values_towards` states what others have. Rounding
/// explains nothing of directions that do not count.
///
/// # Errors
/// Those of the function.
pub fn judge(
    directions: &[Vec3],
    given: &[Vec3],
    stated: &[Vec3],
    counts: impl Fn(usize) -> bool,
    values_towards: impl FnOnce(&[Vec3]) -> Result<Vec<Vec3>, Stop>,
) -> Result<Vec<Verdict>, Stop> {
    let verdict = |(given, stated): (&Vec3, &Vec3)| {
        if is_close(*given, *stated) { Verdict::Agree } else { Verdict::Differ }
    };
    let mut verdicts: Vec<Verdict> = given.iter().zip(stated).map(verdict).collect();
    let differ: Vec<usize> = (0..verdicts.len())
        .filter(|item| verdicts[*item] == Verdict::Differ && counts(*item))
        .collect();
    if differ.is_empty() || differ.len() > MAX_NEIGHBOURS {
        return Ok(verdicts);
    }
    let beside: Vec<Vec3> = differ.iter().flat_map(|item| around(directions[*item])).collect();
    let values = values_towards(&beside)?;
    for (item, values) in differ.into_iter().zip(values.chunks(COUNT)) {
        if lies_between(given[item], values) {
            verdicts[item] = Verdict::Rounded;
        }
    }
    Ok(verdicts)
}

fn around(direction: Vec3) -> impl Iterator<Item = Vec3> {
    let (x, y) = direction.normalize().any_orthonormal_pair();
    ANGLES.into_iter().flat_map(move |angle| {
        // Six ways, at equal angles.
        let ways = [x, 0.5 * x + 0.866_025_4 * y, 0.866_025_4 * y - 0.5 * x];
        ways.into_iter().flat_map(move |way| [direction + angle * way, direction - angle * way])
    })
}

/// Whether a value lies between the least and the greatest of those that are numbers.
fn lies_between(value: Vec3, values: &[Vec3]) -> bool {
    let mut bounds: Option<(Vec3, Vec3)> = None;
    for it in values.iter().filter(|it| it.is_finite()) {
        let (least, greatest) = bounds.unwrap_or((*it, *it));
        bounds = Some((least.min(*it), greatest.max(*it)));
    }
    bounds.is_some_and(|(least, greatest)| {
        value.is_finite() && is_close(value, value.clamp(least, greatest))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// White on one side of an edge, black on the other.
    fn half(directions: &[Vec3]) -> Result<Vec<Vec3>, Stop> {
        Ok(directions.iter().map(|it| if it.x > 0.0 { Vec3::ONE } else { Vec3::ZERO }).collect())
    }

    fn judged(direction: Vec3, given: Vec3, stated: Vec3) -> Verdict {
        let Ok(verdicts) = judge(&[direction], &[given], &[stated], |_| true, half) else {
            panic!("nothing stops it")
        };
        verdicts[0]
    }

    #[test]
    fn rounding_explains_values_of_either_side_at_an_edge_alone() {
        let at_edge = Vec3::new(2e-7, 0.6, 0.8);
        let beside = Vec3::new(2e-3, 0.6, 0.8).normalize();
        assert_eq!(judged(at_edge, Vec3::ONE, Vec3::ONE), Verdict::Agree);
        assert_eq!(judged(at_edge, Vec3::ZERO, Vec3::ONE), Verdict::Rounded);
        assert_eq!(judged(at_edge, 1.1 * Vec3::ONE, Vec3::ONE), Verdict::Differ);
        assert_eq!(judged(beside, Vec3::ZERO, Vec3::ONE), Verdict::Differ);
    }

    #[test]
    fn rounding_explains_nothing_that_is_no_number() {
        let at_edge = Vec3::new(2e-7, 0.6, 0.8);
        assert_eq!(judged(at_edge, Vec3::NAN, Vec3::ONE), Verdict::Differ);
        let nowhere = |directions: &[Vec3]| Ok(vec![Vec3::NAN; directions.len()]);
        let verdicts = judge(&[at_edge], &[Vec3::ONE], &[Vec3::NAN], |_| true, nowhere);
        assert!(verdicts.is_ok_and(|it| it == [Verdict::Differ]));
    }
}
