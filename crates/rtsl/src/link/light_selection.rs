//! The selection of lights for samples as operations: lights at infinity, and a hierarchy of the others, whose
//! probabilities depend on the point that is lit.
//!
//! Renderers compute the same for lights that they do not link, with the same bits.

use rtsl_ir::{BinaryOp, CompareOp, Op, OpKind, Region, Scalar, Value};
use rtsl_math::MIN_NODE_PROBABILITY;

use super::arithmetic::{Arithmetic, Vector};
use super::linker::{Linker, Linking};

/// The member with the [scalars](LightSelection::scalars) of the hierarchy.
pub(crate) const NODES: &str = "light.rt_Nodes";
/// The scalars of a node.
const NODE_SCALARS: u32 = 5;
/// The indices of the squared radius and the strength among them; the centre comes first.
const RADIUS: u32 = 3;
const STRENGTH: u32 = 4;

/// The selection of lights for samples.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct LightSelection {
    /// The indices of lights at infinity.
    pub infinite: Vec<usize>,
    /// The hierarchy of the others: the root first, and children after their parents; empty without others.
    pub nodes: Vec<LightNode>,
    /// The probability of each light at infinity. All others together have the rest.
    pub probability: f32,
}

/// A node of the light hierarchy.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LightNode {
    /// The centre of its box.
    pub center: [f32; 3],
    /// Half the diagonal of its box, squared: a lower bound of squared distances.
    pub radius2: f32,
    /// Its luminous intensity; positive.
    pub strength: f32,
    /// Its contents.
    pub content: LightContent,
}

/// The contents of a node.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LightContent {
    /// The light with this index.
    Light(usize),
    /// Two nodes, of which the first has this index.
    Children(usize),
}

impl LightSelection {
    /// The way to a light at infinity.
    pub const INFINITE: u32 = 0;

    /// Returns the way from the root to a light as a number: above a bit for each step, the first lowest, which is set
    /// if it leads to the second child, a one. `None` if there are too many steps.
    pub fn way(steps: u64, count: u32) -> Option<u32> {
        (count < u32::BITS).then(|| 1 << count | steps as u32)
    }

    /// The indices of all lights that may be selected.
    pub(crate) fn lights(&self) -> Vec<usize> {
        let finite = self.nodes.iter().filter_map(|node| match node.content {
            LightContent::Light(light) => Some(light),
            LightContent::Children(_) => None,
        });
        self.infinite.iter().copied().chain(finite).collect()
    }

    /// True if the hierarchy is the same, whatever its [scalars](Self::scalars).
    pub(crate) fn is_like(&self, other: &LightSelection) -> bool {
        let contents = |selection: &LightSelection| -> Vec<LightContent> {
            selection.nodes.iter().map(|node| node.content).collect()
        };
        (&self.infinite, self.probability) == (&other.infinite, other.probability)
            && contents(self) == contents(other)
    }

    /// The scalars of the hierarchy, node by node.
    pub(crate) fn scalars(&self) -> Vec<f32> {
        let of = |node: &LightNode| {
            let [x, y, z] = node.center;
            // A lower bound of the squared distance that is not 0.
            [x, y, z, node.radius2.max(f32::MIN_POSITIVE), node.strength]
        };
        self.nodes.iter().flat_map(of).collect()
    }

    /// The probability of all lights that are not at infinity.
    fn finite_probability(&self) -> f32 {
        1.0 - self.probability * self.infinite.len() as f32
    }

    /// Returns the steps from the root to a light, true for second children.
    fn steps_to(&self, light: usize) -> Option<Vec<bool>> {
        self.steps_from(0, light).map(|mut steps| {
            steps.reverse();
            steps
        })
    }

    /// Returns the steps from a node to a light, the last first.
    fn steps_from(&self, node: usize, light: usize) -> Option<Vec<bool>> {
        match self.nodes.get(node)?.content {
            LightContent::Light(other) => (other == light).then(Vec::new),
            LightContent::Children(first) => [false, true].into_iter().find_map(|is_second| {
                let mut steps = self.steps_from(first + usize::from(is_second), light)?;
                steps.push(is_second);
                Some(steps)
            }),
        }
    }
}

/// A selected light.
#[derive(Clone, Copy)]
pub(super) struct Selected {
    /// Its number.
    pub number: Value,
    /// The probability of its selection.
    pub probability: Value,
}

/// The selection during which operations are added.
#[derive(Clone, Copy)]
struct Choosing<'a> {
    selection: &'a LightSelection,
    point: Vector,
    number_of: &'a dyn Fn(usize) -> u32,
}

impl Linker {
    /// Selects a light for a point by a random number in [0,1). The selection has lights; `number_of` returns the numbers
    /// of lights with these indices.
    pub(super) fn choose_light(
        &mut self,
        selection: &LightSelection,
        (point, random): (Vector, Value),
        number_of: &dyn Fn(usize) -> u32,
        to: &mut Vec<Op>,
    ) -> Linking<Selected> {
        let mut infinite = selection.infinite.as_slice();
        let code = &mut Arithmetic { linker: &mut *self, to: &mut *to };
        let probability = code.float(selection.probability)?;
        let mut selected = if selection.nodes.is_empty() {
            let (last, others) = infinite.split_last().expect("there are lights");
            infinite = others;
            Selected { number: code.word(number_of(*last))?, probability }
        } else {
            let before = code.float(selection.probability * infinite.len() as f32)?;
            let finite = code.float(selection.finite_probability())?;
            let offset = code.binary(BinaryOp::Subtract, random, before)?;
            let random = code.part_of_unit(offset, finite)?;
            let choosing = Choosing { selection, point, number_of };
            choosing.choose(self, 0, (random, finite), to)?
        };
        let code = &mut Arithmetic { linker: self, to };
        let place = code.divide(random, probability)?;
        for (index, light) in infinite.iter().enumerate().rev() {
            let bound = code.float((index + 1) as f32)?;
            // NaN selects the first.
            let is_later = code.compare(CompareOp::GreaterEqual, place, bound)?;
            let number = code.word(number_of(*light))?;
            selected = Selected {
                number: code.select(is_later, selected.number, number)?,
                probability: code.select(is_later, selected.probability, probability)?,
            };
        }
        Ok(selected)
    }

    /// Returns the probability with which a light is selected for a point; `None` if it never is.
    pub(super) fn probability_of(
        &mut self,
        selection: &LightSelection,
        light: usize,
        point: Vector,
        to: &mut Vec<Op>,
    ) -> Linking<Option<Value>> {
        let code = &mut Arithmetic { linker: self, to };
        if selection.infinite.contains(&light) {
            return code.float(selection.probability).map(Some);
        }
        let Some(steps) = selection.steps_to(light) else { return Ok(None) };
        let mut probability = code.float(selection.finite_probability())?;
        let mut node = 0;
        for is_second in steps {
            let LightContent::Children(first) = selection.nodes[node].content else { break };
            let parts = code.parts_of_children(selection, first, point)?;
            probability = code.multiply(probability, parts[usize::from(is_second)])?;
            node = first + usize::from(is_second);
        }
        Ok(Some(probability))
    }

    /// Returns the probability with which the light at the end of a [way](LightSelection::way) is selected for a point.
    pub(super) fn probability_at(
        &mut self,
        selection: &LightSelection,
        (way, has_infinite): (Value, bool),
        point: Vector,
        to: &mut Vec<Op>,
    ) -> Linking<Value> {
        let code = &mut Arithmetic { linker: &mut *self, to: &mut *to };
        let at_infinity = code.float(selection.probability)?;
        if selection.nodes.is_empty() {
            return Ok(at_infinity);
        }
        let finite = code.float(selection.finite_probability())?;
        let probability = self.probability_below(selection, (0, way), finite, point, to)?;
        if !has_infinite {
            return Ok(probability);
        }
        let code = &mut Arithmetic { linker: self, to };
        let none = code.word(LightSelection::INFINITE)?;
        let is_infinite = code.compare(CompareOp::Equal, way, none)?;
        code.select(is_infinite, at_infinity, probability)
    }

    /// Returns the probability of the light at the end of a way from a node, which has a probability.
    fn probability_below(
        &mut self,
        selection: &LightSelection,
        (node, way): (usize, Value),
        probability: Value,
        point: Vector,
        to: &mut Vec<Op>,
    ) -> Linking<Value> {
        let LightContent::Children(first) = selection.nodes[node].content else {
            return Ok(probability);
        };
        let code = &mut Arithmetic { linker: &mut *self, to: &mut *to };
        let parts = code.parts_of_children(selection, first, point)?;
        let (one, none) = (code.word(1)?, code.word(0)?);
        let step = code.and(way, one)?;
        let is_second = code.compare(CompareOp::NotEqual, step, none)?;
        let part = code.select(is_second, parts[1], parts[0])?;
        let probability = code.multiply(probability, part)?;
        let way = code.binary(BinaryOp::ShiftRight, way, one)?;
        let is_leaf = |node: usize| matches!(selection.nodes[node].content, LightContent::Light(_));
        if is_leaf(first) && is_leaf(first + 1) {
            return Ok(probability);
        }
        let below = |linker: &mut Self, node: usize| {
            linker.nested(|linker| {
                let mut region = Region::default();
                let ops = &mut region.ops;
                let at = (node, way);
                let below = linker.probability_below(selection, at, probability, point, ops)?;
                region.yields = vec![below];
                Ok(region)
            })
        };
        let (then, otherwise) = (below(self, first + 1)?, below(self, first)?);
        let kind = OpKind::If { condition: is_second, then, otherwise };
        Ok(self.emit(to, kind, &[Scalar::F32], false)?.get(0))
    }
}

impl Choosing<'_> {
    /// Selects a light below a node, which has a probability, by a random number in [0,1).
    fn choose(
        self,
        linker: &mut Linker,
        node: usize,
        (random, probability): (Value, Value),
        to: &mut Vec<Op>,
    ) -> Linking<Selected> {
        let code = &mut Arithmetic { linker: &mut *linker, to: &mut *to };
        let first = match self.selection.nodes[node].content {
            LightContent::Light(light) => {
                return Ok(Selected { number: code.word((self.number_of)(light))?, probability });
            }
            LightContent::Children(first) => first,
        };
        let [part, other] = code.parts_of_children(self.selection, first, self.point)?;
        let is_second = code.compare(CompareOp::GreaterEqual, random, part)?;
        let half = |linker: &mut Linker, is_second: bool| {
            linker.nested(|linker| {
                let mut region = Region::default();
                let code = &mut Arithmetic { linker: &mut *linker, to: &mut region.ops };
                let (offset, width) = match is_second {
                    true => (code.binary(BinaryOp::Subtract, random, part)?, other),
                    false => (random, part),
                };
                let random = code.part_of_unit(offset, width)?;
                let probability = code.multiply(probability, width)?;
                let node = first + usize::from(is_second);
                let selected = self.choose(linker, node, (random, probability), &mut region.ops)?;
                region.yields = vec![selected.number, selected.probability];
                Ok(region)
            })
        };
        let (then, otherwise) = (half(linker, true)?, half(linker, false)?);
        let kind = OpKind::If { condition: is_second, then, otherwise };
        let results = linker.emit(to, kind, &[Scalar::U32, Scalar::F32], false)?;
        Ok(Selected { number: results.get(0), probability: results.get(1) })
    }
}

impl Arithmetic<'_> {
    /// A position within an interval as a number in [0,1), given its distance from the start, and the width.
    fn part_of_unit(&mut self, offset: Value, width: Value) -> Linking<Value> {
        let (zero, last) = (self.float(0.0)?, self.float(1.0_f32.next_down())?);
        let part = self.divide(offset, width)?;
        self.clamped(part, zero, last)
    }

    /// The probabilities of two nodes, of which the first has this index, for a point.
    fn parts_of_children(
        &mut self,
        selection: &LightSelection,
        first: usize,
        point: Vector,
    ) -> Linking<[Value; 2]> {
        let one = self.importance(selection, first, point)?;
        let other = self.importance(selection, first + 1, point)?;
        let both = self.add(one, other)?;
        let part = self.divide(one, both)?;
        // Infinite importances do not determine a ratio.
        let zero = self.float(0.0)?;
        let is_number = self.compare(CompareOp::GreaterEqual, part, zero)?;
        let (half, whole) = (self.float(0.5)?, self.float(1.0)?);
        let part = self.select(is_number, part, half)?;
        let least = self.float(MIN_NODE_PROBABILITY)?;
        let greatest = self.float(1.0 - MIN_NODE_PROBABILITY)?;
        let part = self.clamped(part, least, greatest)?;
        Ok([part, self.binary(BinaryOp::Subtract, whole, part)?])
    }

    /// An estimate of the light from a node at a point; positive.
    fn importance(
        &mut self,
        selection: &LightSelection,
        node: usize,
        point: Vector,
    ) -> Linking<Value> {
        let len = NODE_SCALARS * selection.nodes.len() as u32;
        let start = NODE_SCALARS * node as u32;
        let center = self.member(NODES, len, start)?;
        let [_, radius2, strength] = self.member(NODES, len, start + RADIUS - 1)?;
        debug_assert_eq!(STRENGTH, RADIUS + 1);
        let difference = self.difference(point, center)?;
        let distance2 = self.products(difference, difference)?;
        let distance2 = self.larger(distance2, radius2)?;
        self.divide(strength, distance2)
    }

    /// A number within bounds; NaN stays.
    fn clamped(&mut self, a: Value, least: Value, greatest: Value) -> Linking<Value> {
        let is_less = self.less(a, least)?;
        let a = self.select(is_less, least, a)?;
        let is_greater = self.compare(CompareOp::Greater, a, greatest)?;
        self.select(is_greater, greatest, a)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn selection() -> LightSelection {
        let node = |content: LightContent| LightNode {
            center: [1.0, 2.0, 3.0],
            radius2: 0.0,
            strength: 4.0,
            content,
        };
        LightSelection {
            infinite: vec![3],
            nodes: vec![
                node(LightContent::Children(1)),
                node(LightContent::Light(5)),
                node(LightContent::Children(3)),
                node(LightContent::Light(0)),
                node(LightContent::Light(2)),
            ],
            probability: 0.5,
        }
    }

    #[test]
    fn lights_are_found_in_the_hierarchy() {
        let selection = selection();
        assert_eq!(selection.steps_to(5), Some(vec![false]));
        assert_eq!(selection.steps_to(0), Some(vec![true, false]));
        assert_eq!(selection.steps_to(2), Some(vec![true, true]));
        assert_eq!(selection.steps_to(3), None);
        assert_eq!(LightSelection::default().steps_to(0), None);
    }

    #[test]
    fn ways_are_numbers() {
        assert_eq!(LightSelection::way(0, 0), Some(1));
        assert_eq!(LightSelection::way(0b01, 2), Some(0b101));
        assert_eq!(LightSelection::way(0, 32), None);
    }

    #[test]
    fn squared_distances_are_not_zero() {
        let scalars = selection().scalars();
        assert_eq!(scalars.len(), 5 * NODE_SCALARS as usize);
        assert_eq!(scalars[..5], [1.0, 2.0, 3.0, f32::MIN_POSITIVE, 4.0]);
    }
}
