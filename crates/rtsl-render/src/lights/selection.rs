//! Selection of a light for a point by a light hierarchy, whose cost grows slowly with the number of lights and which
//! prefers near and strong lights (Conty Estevez and Kulla, "Importance Sampling of Many Lights with Adaptive Tree
//! Splitting", HPG 2018).
//!
//! The strength and position of lights are estimated from a few samples of each, independent of their classes. They
//! only affect the selection probabilities: every light has a positive probability at every point, and each sample is
//! divided by it, so the result is unbiased.

use rtsl::{LightContent, LightNode, LightSelection};
use rtsl_bvh::Bounds;
use rtsl_math::MIN_NODE_PROBABILITY;

/// The estimates from the samples of a light.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LightProbe {
    /// The bounds of the light's points; `None` for a light at infinity.
    pub bounds: Option<Bounds>,
    /// Luminous intensity, averaged over directions. Not used for lights at infinity.
    pub strength: f32,
    /// True if there is light, and all of it comes from finite distances.
    pub is_near: bool,
}

/// The light hierarchy.
#[derive(Default)]
pub struct Selection {
    /// The lights at infinity.
    infinite: Vec<u32>,
    /// The hierarchy over the others: the root first, the two children of a node adjacent.
    nodes: Vec<Node>,
    /// For each light its position in the hierarchy.
    places: Vec<Place>,
    /// The probability of each light at infinity: all other lights together count as one of them.
    infinite_probability: f32,
}

#[derive(Clone, Copy, Debug)]
struct Node {
    center: [f32; 3],
    /// Half the diagonal of its box, squared: a lower bound of squared distances.
    radius2: f32,
    strength: f32,
    content: Content,
}

#[derive(Clone, Copy, Debug)]
enum Content {
    Light(u32),
    /// The index of the first of two nodes.
    Children(u32),
}

#[derive(Clone, Copy, Debug)]
enum Place {
    Infinite,
    /// The path from the root: a bit for each step, the first lowest, which is set if it leads to the second child, and
    /// the number of steps.
    Finite(u64, u32),
}

/// The least strength of a light, as a fraction of the mean: samples may have missed all of its light.
const MIN_STRENGTH: f32 = 1e-3;

impl Selection {
    /// Builds the hierarchy for the lights with these estimates.
    pub fn new(probes: &[LightProbe]) -> Self {
        let (infinite, finite): (Vec<u32>, Vec<u32>) =
            (0..probes.len() as u32).partition(|light| probes[*light as usize].bounds.is_none());
        let others = usize::from(!finite.is_empty());
        let mut selection = Selection {
            infinite_probability: 1.0 / (infinite.len() + others).max(1) as f32,
            infinite,
            nodes: Vec::with_capacity(2 * finite.len()),
            places: vec![Place::Infinite; probes.len()],
        };
        let strengths = finite.iter().map(|light| probes[*light as usize].strength);
        let mean = strengths.sum::<f32>() / finite.len().max(1) as f32;
        let least = if mean > 0.0 && mean.is_finite() { mean * MIN_STRENGTH } else { 1.0 };
        let mut leaves: Vec<Leaf> = finite
            .into_iter()
            .filter_map(|light| Leaf::new(light, &probes[light as usize], least))
            .collect();
        if !leaves.is_empty() {
            selection.nodes.push(Node::over(&leaves));
            selection.split(0, &mut leaves, (0, 0));
        }
        selection
    }

    /// Builds the subtree below a node. Halves have equal size, so the depth is logarithmic.
    fn split(&mut self, node: usize, leaves: &mut [Leaf], (way, steps): (u64, u32)) {
        if let [only] = leaves {
            self.places[only.light as usize] = Place::Finite(way, steps);
            return;
        }
        let axis = widest_axis(leaves);
        let middle = leaves.len() / 2;
        let order = |one: &Leaf, other: &Leaf| {
            one.center[axis].total_cmp(&other.center[axis]).then(one.light.cmp(&other.light))
        };
        leaves.select_nth_unstable_by(middle, order);
        let (first, second) = leaves.split_at_mut(middle);
        let children = self.nodes.len();
        self.nodes.extend([Node::over(first), Node::over(second)]);
        self.nodes[node].content = Content::Children(children as u32);
        self.split(children, first, (way, steps + 1));
        self.split(children + 1, second, (way | 1 << steps, steps + 1));
    }

    /// Returns the light, if there is only one: it is always selected.
    pub fn only(&self) -> Option<u32> {
        (self.places.len() == 1).then_some(0)
    }

    /// Returns the selection for stages, which have other indices of lights.
    pub fn for_stages(&self, index_of: impl Fn(u32) -> usize) -> LightSelection {
        let nodes = self.nodes.iter().map(|node| LightNode {
            center: node.center,
            radius2: node.radius2,
            strength: node.strength,
            content: match node.content {
                Content::Light(light) => LightContent::Light(index_of(light)),
                Content::Children(first) => LightContent::Children(first as usize),
            },
        });
        LightSelection {
            infinite: self.infinite.iter().map(|light| index_of(*light)).collect(),
            nodes: nodes.collect(),
            probability: self.infinite_probability,
        }
    }

    /// Returns the way from the root of the hierarchy to a light as stages take it; `None` if the way is too long.
    pub fn way_to(&self, light: u32) -> Option<u32> {
        match self.places[light as usize] {
            Place::Infinite => Some(LightSelection::INFINITE),
            Place::Finite(way, steps) => LightSelection::way(way, steps),
        }
    }

    /// Selects a light for a point by a random number in [0,1). Returns it with its probability, which is positive.
    pub fn choose(&self, point: [f32; 3], random: f32) -> (u32, f32) {
        let probability = self.infinite_probability;
        let place = random / probability;
        if let Some(light) = self.infinite.get(place as usize) {
            return (*light, probability);
        }
        let Some(mut node) = self.nodes.first() else {
            return (self.infinite.last().copied().unwrap_or(0), probability);
        };
        let infinite = probability * self.infinite.len() as f32;
        let mut random = ((random - infinite) / (1.0 - infinite)).clamp(0.0, BELOW_ONE);
        let mut chosen = 1.0 - infinite;
        loop {
            match node.content {
                Content::Light(light) => return (light, chosen),
                Content::Children(children) => {
                    let [first, second] = self.children(children);
                    let part = first.part(second, point);
                    let is_second = random >= part;
                    let (start, width) = if is_second { (part, 1.0 - part) } else { (0.0, part) };
                    random = ((random - start) / width).clamp(0.0, BELOW_ONE);
                    chosen *= width;
                    node = if is_second { second } else { first };
                }
            }
        }
    }

    /// Returns the probability with which a light is selected for a point.
    pub fn probability(&self, light: u32, point: [f32; 3]) -> f32 {
        let infinite = self.infinite_probability;
        let Place::Finite(way, steps) = self.places[light as usize] else { return infinite };
        let mut probability = 1.0 - infinite * self.infinite.len() as f32;
        let mut node = self.nodes[0];
        for step in 0..steps {
            let Content::Children(children) = node.content else { break };
            let [first, second] = self.children(children);
            let part = first.part(second, point);
            let is_second = way >> step & 1 != 0;
            probability *= if is_second { 1.0 - part } else { part };
            node = if is_second { *second } else { *first };
        }
        probability
    }

    fn children(&self, first: u32) -> [&Node; 2] {
        [&self.nodes[first as usize], &self.nodes[first as usize + 1]]
    }
}

/// The greatest number below 1.
const BELOW_ONE: f32 = 1.0_f32.next_down();

impl Node {
    fn over(leaves: &[Leaf]) -> Self {
        let bounds = leaves.iter().fold(Bounds::EMPTY, |all, leaf| all.union(&leaf.bounds));
        let radius = 0.5 * bounds.diagonal();
        Node {
            center: bounds.center(),
            radius2: (radius * radius) as f32,
            strength: leaves.iter().map(|leaf| leaf.strength).sum(),
            content: Content::Light(leaves[0].light),
        }
    }

    /// An estimate of the light from the node at a point; positive.
    fn importance(&self, point: [f32; 3]) -> f32 {
        let square = |axis: usize| {
            let difference = point[axis] - self.center[axis];
            difference * difference
        };
        let distance2 = square(0) + square(1) + square(2);
        self.strength / distance2.max(self.radius2).max(f32::MIN_POSITIVE)
    }

    /// The probability of selecting this node rather than another.
    fn part(&self, other: &Node, point: [f32; 3]) -> f32 {
        let (one, other) = (self.importance(point), other.importance(point));
        let part = one / (one + other);
        // Infinite importances do not determine a ratio.
        if part.is_nan() {
            0.5
        } else {
            part.clamp(MIN_NODE_PROBABILITY, 1.0 - MIN_NODE_PROBABILITY)
        }
    }
}

/// A light during the construction of the hierarchy.
#[derive(Clone, Copy, Debug)]
struct Leaf {
    light: u32,
    bounds: Bounds,
    center: [f32; 3],
    strength: f32,
}

impl Leaf {
    fn new(light: u32, probe: &LightProbe, least: f32) -> Option<Self> {
        let bounds = probe.bounds?;
        let strength = if probe.strength.is_finite() { probe.strength.max(least) } else { least };
        Some(Leaf { light, bounds, center: bounds.center(), strength })
    }
}

fn widest_axis(leaves: &[Leaf]) -> usize {
    let width = |axis: usize| {
        let centers = leaves.iter().map(|leaf| leaf.center[axis]);
        let (least, greatest) = centers
            .fold((f32::INFINITY, f32::NEG_INFINITY), |(least, greatest), it| {
                (least.min(it), greatest.max(it))
            });
        greatest - least
    };
    [1, 2]
        .into_iter()
        .fold(0, |widest, axis| if width(axis) > width(widest) { axis } else { widest })
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn probe() -> impl Strategy<Value = LightProbe> {
        let place = prop::array::uniform3(-10.0_f32..10.0);
        let size = prop::array::uniform3(0.0_f32..2.0);
        let finite = (place, size).prop_map(|(place, size)| {
            Bounds::new(place, std::array::from_fn(|axis| place[axis] + size[axis]))
        });
        let strength = prop_oneof![Just(0.0), 0.0_f32..10.0, Just(f32::INFINITY), Just(f32::NAN)];
        (prop_oneof![1 => Just(None), 4 => finite], strength)
            .prop_map(|(bounds, strength)| LightProbe { bounds, strength, is_near: false })
    }

    proptest! {
        #[test]
        fn lights_are_chosen_as_often_as_it_says(
            probes in prop::collection::vec(probe(), 1..12),
            point in prop::array::uniform3(-12.0_f32..12.0),
        ) {
            const COUNT: u32 = 1 << 14;
            let selection = Selection::new(&probes);
            let all: Vec<f32> = (0..probes.len() as u32).map(|it| selection.probability(it, point)).collect();
            prop_assert!((all.iter().sum::<f32>() - 1.0).abs() < 1e-4, "{all:?}");
            prop_assert!(all.iter().all(|it| *it > 0.0));
            let mut chosen = vec![0_u32; probes.len()];
            for index in 0..COUNT {
                let (light, probability) = selection.choose(point, (index as f32 + 0.5) / COUNT as f32);
                prop_assert_eq!(probability.to_bits(), all[light as usize].to_bits());
                chosen[light as usize] += 1;
            }
            for (probability, count) in all.iter().zip(chosen) {
                let expected = probability * COUNT as f32;
                prop_assert!((expected - count as f32).abs() < 4.0 + 1e-2 * expected, "{expected} {count}");
            }
        }
    }

    #[test]
    fn near_and_strong_lights_are_chosen_often() {
        let at = |x: f32| Bounds::new([x, 0.0, 0.0], [x, 0.0, 0.0]);
        let probes = [(1.0, 1.0), (10.0, 1.0), (10.5, 50.0), (100.0, 1.0)];
        let probes =
            probes.map(|(x, strength)| LightProbe { bounds: at(x), strength, is_near: true });
        let selection = Selection::new(&probes);
        let [near, weak, strong, far] = [0, 1, 2, 3].map(|it| selection.probability(it, [0.0; 3]));
        assert!(near > 0.5 && strong > weak && weak > far, "{near} {weak} {strong} {far}");
    }
}
