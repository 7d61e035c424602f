//! Inputs that take both sides of every branch, as far as they can be found.

use rtsl::{CallMode, Decision, PacketKernel, Profile};

use super::call::count;
use super::inputs::{Inputs, RaySource};
use super::objects::Objects;

/// The number of batches of further rays.
const BATCHES: usize = 24;
const BATCH: usize = 64;
/// At least one of this many rays is kept from the first draw.
const REPLACED_PART: usize = 2;
/// Rays with this many times as many loop iterations as usual ones are excluded: they would take most of the time, or
/// all of it.
const MAX_ROUNDS: u64 = 8;

/// The branch coverage of inputs.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Coverage {
    /// The number of sides that some ray takes.
    pub reached: usize,
    /// The number of all sides: two for each condition that varies between rays.
    pub sides: usize,
}

/// For each condition: true if some ray satisfied it, and true if some ray did not.
type Sides = Vec<[bool; 2]>;

/// Returns usual rays, with further ones mixed in for the sides that the usual ones do not take; `None` if the usual
/// ones exceed `round_limit` loop iterations. `kernel` runs one ray at a time.
pub fn covering_inputs(
    kernel: &PacketKernel,
    objects: &Objects,
    source: &mut RaySource<'_>,
    lanes: usize,
    round_limit: u64,
) -> Option<Inputs> {
    let run = |rays: &Inputs, round_limit: u64| {
        let run = count(kernel, objects.of_mode(CallMode::Packet), rays, round_limit);
        (!run.cut_short).then_some(run.profile)
    };
    let mut inputs = source.usual(lanes);
    let profile = run(&inputs, round_limit)?;
    let ray_rounds = MAX_ROUNDS * (1 + profile.rounds / lanes as u64);
    let mut needed: Vec<usize> = first_rays(&profile).map(|(_, ray)| ray).collect();
    let mut seen = sides(&profile);
    let mut replaceable = (0..lanes).step_by(REPLACED_PART);
    for batch in 0..BATCHES {
        if seen.iter().all(|sides| *sides == [true; 2]) {
            break;
        }
        // More usual rays are drawn before unusual ones.
        let candidates =
            if batch < BATCHES / 4 { source.usual(BATCH) } else { source.unusual(BATCH) };
        let Some(profile) = run(&candidates, ray_rounds * BATCH as u64) else { continue };
        let news = first_rays(&profile).filter(|((decision, side), _)| !seen[*decision][*side]);
        let news: Vec<((usize, usize), usize)> = news.collect();
        let mut copied: Vec<usize> = Vec::new();
        for ((decision, side), ray) in news {
            if !copied.contains(&ray) {
                if run(&candidates.lane(ray), ray_rounds).is_none() {
                    continue;
                }
                let Some(lane) = replaceable.find(|lane| !needed.contains(lane)) else { break };
                inputs.copy_lane(lane, &candidates, ray);
                needed.push(lane);
                copied.push(ray);
            }
            seen[decision][side] = true;
        }
    }
    Some(inputs)
}

/// Returns the coverage of a profile.
pub fn coverage(profile: &Profile) -> Coverage {
    let sides = sides(profile);
    let reached = sides.iter().flatten().filter(|reached| **reached).count();
    Coverage { reached, sides: 2 * sides.len() }
}

fn sides(profile: &Profile) -> Sides {
    let sides = |decision: &Decision| [decision.held.is_some(), decision.failed.is_some()];
    profile.decisions.iter().map(sides).collect()
}

/// For each side that was taken (the decision, and 0 for true or 1 for false), the first ray that took it.
fn first_rays(profile: &Profile) -> impl Iterator<Item = ((usize, usize), usize)> {
    profile.decisions.iter().enumerate().flat_map(|(index, decision)| {
        let sides = [decision.held, decision.failed].into_iter().enumerate();
        sides.filter_map(move |(side, ray)| Some(((index, side), ray? as usize)))
    })
}
