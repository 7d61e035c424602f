//! Points and directions so close to another that rounding may not distinguish them.
//!
//! Two methods may find the edge of a light or of a lobe at positions that differ by rounding: one generates a
//! direction just inside, and the other sees it just outside. Such a direction may then have the value of a
//! neighbouring one. The same holds for points whose density has a tiny cosine.

use glam::Vec3;

use crate::stop::Stop;
use crate::values::is_close;

/// Angles to neighbours in radians. The cosine of a small angle represents it with few digits, so that edges computed
/// from it differ by as much.
const ANGLES: [f32; 3] = [1e-6, 1e-5, 1e-4];
/// The greatest number of items in a call for which neighbours are examined: more cannot all lie at edges.
const MAX_NEIGHBOURS: usize = 256;

/// The comparison of two methods' values for one item.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Verdict {
    /// The values agree.
    Agree,
    /// One value agrees with the other's for neighbours of the item.
    Rounded,
    /// The values differ.
    Differ,
}

/// Compares the values generated with directions with those `stated` for them; `values_towards` returns the values of
/// other directions. For directions that do not count, rounding is not accepted as an explanation.
///
/// # Errors
/// Those of the function.
pub fn judge_directions(
    directions: &[Vec3],
    given: &[Vec3],
    stated: &[Vec3],
    counts: impl Fn(usize) -> bool,
    values_towards: impl FnOnce(&[Vec3]) -> Result<Vec<Vec3>, Stop>,
) -> Result<Vec<Verdict>, Stop> {
    judge(given, stated, is_close, counts, |items| {
        let beside: Vec<Vec3> = items.iter().flat_map(|item| around(directions[*item])).collect();
        values_towards(&beside)
    })
}

/// Compares the values `given` with those `stated`, item by item, by `is_close`. Where they differ for few items that
/// count, rounding explains the difference if the given value lies between those of the item's neighbours:
/// `values_beside` returns these for all neighbours of the first of its items, then for as many of the next.
///
/// # Errors
/// Those of the function.
pub fn judge(
    given: &[Vec3],
    stated: &[Vec3],
    is_close: impl Fn(Vec3, Vec3) -> bool,
    counts: impl Fn(usize) -> bool,
    values_beside: impl FnOnce(&[usize]) -> Result<Vec<Vec3>, Stop>,
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
    let values = values_beside(&differ)?;
    let neighbours = (values.len() / differ.len()).max(1);
    for (item, values) in differ.into_iter().zip(values.chunks(neighbours)) {
        let value = given[item];
        let is_between = clamped(value, values).is_some_and(|clamped| is_close(value, clamped));
        if value.is_finite() && is_between {
            verdicts[item] = Verdict::Rounded;
        }
    }
    Ok(verdicts)
}

fn around(direction: Vec3) -> impl Iterator<Item = Vec3> {
    let (x, y) = direction.normalize().any_orthonormal_pair();
    ANGLES.into_iter().flat_map(move |angle| {
        // Six directions, at equal angles.
        let ways = [x, 0.5 * x + 0.866_025_4 * y, 0.866_025_4 * y - 0.5 * x];
        ways.into_iter().flat_map(move |way| [direction + angle * way, direction - angle * way])
    })
}

/// Returns the value nearest to `value` between the least and the greatest of those that are finite.
fn clamped(value: Vec3, values: &[Vec3]) -> Option<Vec3> {
    let mut bounds: Option<(Vec3, Vec3)> = None;
    for it in values.iter().filter(|it| it.is_finite()) {
        let (least, greatest) = bounds.unwrap_or((*it, *it));
        bounds = Some((least.min(*it), greatest.max(*it)));
    }
    bounds.map(|(least, greatest)| value.clamp(least, greatest))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// White on one side of an edge, black on the other.
    fn half(directions: &[Vec3]) -> Result<Vec<Vec3>, Stop> {
        Ok(directions.iter().map(|it| if it.x > 0.0 { Vec3::ONE } else { Vec3::ZERO }).collect())
    }

    fn judged(direction: Vec3, given: Vec3, stated: Vec3) -> Verdict {
        let Ok(verdicts) = judge_directions(&[direction], &[given], &[stated], |_| true, half)
        else {
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
        let verdicts = judge_directions(&[at_edge], &[Vec3::ONE], &[Vec3::NAN], |_| true, nowhere);
        assert!(verdicts.is_ok_and(|it| it == [Verdict::Differ]));
    }
}
