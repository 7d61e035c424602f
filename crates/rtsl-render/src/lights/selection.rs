//! The light hierarchy, which prefers near and strong lights (Conty Estevez and Kulla, "Importance Sampling of Many
//! Lights with Adaptive Tree Splitting", HPG 2018). Lights are selected by it in `prelude/renderer/lights.rtsl`.
//!
//! The strength and position of lights are estimated from a few samples of each, independent of their classes. They
//! only affect the selection probabilities: every light has a positive probability at every point, and each sample is
//! divided by it, so the result is unbiased.

use rtsl::{LightContent, LightNode, LightSelection};
use rtsl_bvh::Bounds;

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

/// The light hierarchy with the ways to its lights.
#[derive(Default)]
pub struct Selection {
    lights: LightSelection,
    /// For each light the [way](LightSelection::way) to it.
    ways: Vec<u32>,
}

/// The least strength of a light, as a fraction of the mean: samples may have missed all of its light.
const MIN_STRENGTH: f32 = 1e-3;

impl Selection {
    /// Builds the hierarchy for the lights with these estimates.
    pub fn new(probes: &[LightProbe]) -> Self {
        let (infinite, finite): (Vec<usize>, Vec<usize>) =
            (0..probes.len()).partition(|light| probes[*light].bounds.is_none());
        let others = usize::from(!finite.is_empty());
        let lights = LightSelection {
            probability: 1.0 / (infinite.len() + others).max(1) as f32,
            infinite,
            nodes: Vec::with_capacity(2 * finite.len()),
        };
        let mut selection =
            Selection { lights, ways: vec![LightSelection::INFINITE; probes.len()] };
        let strengths = finite.iter().map(|light| probes[*light].strength);
        let mean = strengths.sum::<f32>() / finite.len().max(1) as f32;
        let least = if mean > 0.0 && mean.is_finite() { mean * MIN_STRENGTH } else { 1.0 };
        let leaf = |light: usize| Leaf::new(light, &probes[light], least);
        let mut leaves: Vec<Leaf> = finite.into_iter().filter_map(leaf).collect();
        if !leaves.is_empty() {
            selection.lights.nodes.push(node_over(&leaves));
            selection.split(0, &mut leaves, 0, 0);
        }
        selection
    }

    /// Builds the subtree below a node. Halves have equal size, so the depth is logarithmic.
    fn split(&mut self, node: usize, leaves: &mut [Leaf], way: u64, steps: u32) {
        if let [only] = leaves {
            let way = LightSelection::way(way, steps);
            self.ways[only.light] = way.expect("lights have numbers of 32 bits");
            return;
        }
        let axis = widest_axis(leaves);
        let middle = leaves.len() / 2;
        let order = |one: &Leaf, other: &Leaf| {
            one.center[axis].total_cmp(&other.center[axis]).then(one.light.cmp(&other.light))
        };
        leaves.select_nth_unstable_by(middle, order);
        let (first, second) = leaves.split_at_mut(middle);
        let nodes = &mut self.lights.nodes;
        let children = nodes.len();
        nodes.extend([node_over(first), node_over(second)]);
        nodes[node].content = LightContent::Children(children);
        self.split(children, first, way, steps + 1);
        self.split(children + 1, second, way | 1 << steps, steps + 1);
    }

    /// Returns the light, if there is only one: it is always selected.
    pub fn only(&self) -> Option<u32> {
        (self.ways.len() == 1).then_some(0)
    }

    /// The selection.
    pub fn lights(&self) -> &LightSelection {
        &self.lights
    }

    /// Returns the selection for stages, which have other indices of lights.
    pub fn for_stages(&self, index_of: impl Fn(usize) -> usize) -> LightSelection {
        let mut selection = self.lights.clone();
        selection.infinite.iter_mut().for_each(|light| *light = index_of(*light));
        for node in &mut selection.nodes {
            if let LightContent::Light(light) = &mut node.content {
                *light = index_of(*light);
            }
        }
        selection
    }

    /// Returns the [way](LightSelection::way) to a light.
    pub fn way_to(&self, light: u32) -> u32 {
        self.ways[light as usize]
    }
}

/// Returns the node over leaves, as if it were the first of them.
fn node_over(leaves: &[Leaf]) -> LightNode {
    let bounds = leaves.iter().fold(Bounds::EMPTY, |all, leaf| all.union(&leaf.bounds));
    let radius = 0.5 * bounds.diagonal();
    LightNode {
        center: bounds.center(),
        radius2: (radius * radius) as f32,
        strength: leaves.iter().map(|leaf| leaf.strength).sum(),
        content: LightContent::Light(leaves[0].light),
    }
}

/// A light during the construction of the hierarchy.
#[derive(Clone, Copy, Debug)]
struct Leaf {
    light: usize,
    bounds: Bounds,
    center: [f32; 3],
    strength: f32,
}

impl Leaf {
    fn new(light: usize, probe: &LightProbe, least: f32) -> Option<Self> {
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
    use rtsl::{Engine, EngineOptions, LaneBlock, LightSelector};

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

    fn selector(selection: &Selection) -> LightSelector {
        let engine = Engine::new(EngineOptions::default()).expect("an engine").0;
        engine.light_selector(selection.lights()).expect("kernels")
    }

    /// Arrays for so many calls for one point.
    fn arrays(point: [f32; 3], first: usize, count: usize) -> LaneBlock {
        let mut arrays = LaneBlock::new(LightSelector::ARRAYS, count);
        (0..3).for_each(|axis| arrays.floats_mut(first + axis)[..count].fill(point[axis]));
        arrays
    }

    /// The probabilities of all lights at a point.
    fn probabilities(selection: &Selection, point: [f32; 3]) -> Vec<f32> {
        let count = selection.ways.len();
        let mut arrays = arrays(point, 1, count);
        arrays.words_mut(0)[..count].copy_from_slice(&selection.ways);
        selector(selection).probabilities(&mut arrays, count);
        arrays.floats(4)[..count].to_vec()
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(48))]
        #[test]
        fn lights_are_chosen_as_often_as_it_says(
            probes in prop::collection::vec(probe(), 1..12),
            point in prop::array::uniform3(-12.0_f32..12.0),
        ) {
            const COUNT: usize = 1 << 14;
            let selection = Selection::new(&probes);
            let all = probabilities(&selection, point);
            prop_assert!((all.iter().sum::<f32>() - 1.0).abs() < 1e-4, "{all:?}");
            prop_assert!(all.iter().all(|it| *it > 0.0));
            let mut chosen = vec![0_u32; probes.len()];
            let mut arrays = arrays(point, 0, COUNT);
            for (index, random) in arrays.floats_mut(3)[..COUNT].iter_mut().enumerate() {
                *random = (index as f32 + 0.5) / COUNT as f32;
            }
            selector(&selection).select(&mut arrays, COUNT);
            for (light, probability) in arrays.words(4).iter().zip(arrays.words(5)).take(COUNT) {
                prop_assert_eq!(*probability, all[*light as usize].to_bits());
                chosen[*light as usize] += 1;
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
        let all = probabilities(&Selection::new(&probes), [0.0; 3]);
        let [near, weak, strong, far] = all.try_into().expect("there are four");
        assert!(near > 0.5 && strong > weak && weak > far, "{near} {weak} {strong} {far}");
    }
}
