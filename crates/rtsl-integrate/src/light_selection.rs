//! The selection of lights for samples: the data, and calls of its text, `prelude/renderer/lights.rtsl`.

use std::collections::BTreeMap;

use rtsl_ir::{Constant, Op, Scalar, Value, Variable, VariableKind};
use rtsl_link::Linking;

use crate::arithmetic::{Arithmetic, Vector};
use crate::stage_linker::StageLinker;

/// The members with the fields of the hierarchy's nodes, and the numbers of their scalars.
const NODE_FIELDS: [(&str, Scalar, u32); 4] = [
    ("light.rt_Center", Scalar::F32, 3),
    ("light.rt_Radius2", Scalar::F32, 1),
    ("light.rt_Strength", Scalar::F32, 1),
    ("light.rt_Content", Scalar::I32, 1),
];
/// The member with the numbers of lights at infinity.
const INFINITE: &str = "light.rt_Infinite";

/// The function of the text that selects a light.
pub const SELECT: &str = "rt_selectLight";
/// The function of the text for the probability of a light.
pub const PROBABILITY: &str = "rt_lightProbability";

/// The selection of lights for samples.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct LightSelection {
    /// The indices of lights at infinity.
    pub infinite: Vec<usize>,
    /// The hierarchy of the others: the root first, its children next, and children after their parents; empty without
    /// others.
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
    pub fn lights(&self) -> Vec<usize> {
        let finite = self.nodes.iter().filter_map(|node| match node.content {
            LightContent::Light(light) => Some(light),
            LightContent::Children(_) => None,
        });
        self.infinite.iter().copied().chain(finite).collect()
    }

    /// True if the code is the same, whatever the data.
    pub(crate) fn is_like(&self, other: &LightSelection) -> bool {
        let form = |it: &LightSelection| (it.infinite.len(), it.nodes.len(), it.levels());
        (form(self), self.probability) == (form(other), other.probability)
    }

    /// Returns the members with the data, by their names. `number_of` returns the numbers of lights with these indices.
    pub fn members(&self, number_of: impl Fn(usize) -> u32) -> Vec<(&'static str, Vec<u32>)> {
        let is_in_order = |node: &LightNode| match node.content {
            LightContent::Children(first) => first == 1,
            LightContent::Light(_) => true,
        };
        assert!(self.nodes.first().is_none_or(is_in_order), "the root's children are next to it");
        let mut fields = NODE_FIELDS.map(|(name, ..)| (name, Vec::new()));
        for LightNode { center, radius2, strength, content } in &self.nodes {
            fields[0].1.extend(center.map(f32::to_bits));
            // A lower bound of the squared distance that is not 0.
            fields[1].1.push(radius2.max(f32::MIN_POSITIVE).to_bits());
            fields[2].1.push(strength.to_bits());
            fields[3].1.push(match content {
                LightContent::Light(light) => !number_of(*light),
                LightContent::Children(first) => *first as u32,
            });
        }
        let infinite = self.infinite.iter().map(|light| number_of(*light)).collect();
        let members = fields.into_iter().chain([(INFINITE, infinite)]);
        members.filter(|(_, words)| !words.is_empty()).collect()
    }

    /// Returns the members that take the places of the buffers of the selection's text, each with its data. The numbers
    /// of lights are their indices.
    pub fn tables(&self) -> [(Variable, Vec<u32>); NODE_FIELDS.len() + 1] {
        let mut data: BTreeMap<&str, Vec<u32>> =
            self.members(|light| light as u32).into_iter().collect();
        self.arrays().map(|array| {
            let words = data.remove(&*array.name).unwrap_or_default();
            (array, words)
        })
    }

    /// The numbers by which the selection's text knows its form: that of lights at infinity, that of levels, and the
    /// probability of each light at infinity.
    pub fn form(&self) -> [Constant; 3] {
        let count = Constant::I32(self.infinite.len() as i32);
        [count, Constant::I32(self.levels()), Constant::F32(self.probability)]
    }

    /// The number of levels of the hierarchy below the root; -1 without nodes.
    fn levels(&self) -> i32 {
        let mut depths = vec![0; self.nodes.len()];
        for (index, node) in self.nodes.iter().enumerate() {
            if let LightContent::Children(first) = node.content {
                let below = depths[index] + 1;
                depths[first..first + 2].fill(below);
            }
        }
        depths.into_iter().max().unwrap_or(-1)
    }

    /// The way to a light; `None` if it is never selected, or there are too many steps.
    fn way_to(&self, light: usize) -> Option<u32> {
        if self.infinite.contains(&light) {
            return Some(LightSelection::INFINITE);
        }
        let mut ways = vec![(0, 0); self.nodes.len()];
        for (index, node) in self.nodes.iter().enumerate() {
            let (steps, count): (u64, u32) = ways[index];
            match node.content {
                LightContent::Light(other) if other == light => {
                    return LightSelection::way(steps, count);
                }
                LightContent::Light(_) => {}
                LightContent::Children(first) => {
                    ways[first] = (steps, count + 1);
                    ways[first + 1] = (steps | 1_u64.wrapping_shl(count), count + 1);
                }
            }
        }
        None
    }

    /// The variables of the nodes' fields.
    fn node_fields(&self) -> [Variable; NODE_FIELDS.len()] {
        let count = self.nodes.len() as u32;
        NODE_FIELDS.map(|(name, scalar, len)| member(name, scalar, len * count))
    }

    /// The same, and that of the numbers of lights at infinity.
    fn arrays(&self) -> [Variable; NODE_FIELDS.len() + 1] {
        let [center, radius, strength, content] = self.node_fields();
        let infinite = member(INFINITE, Scalar::U32, self.infinite.len() as u32);
        [center, radius, strength, content, infinite]
    }
}

fn member(name: &str, scalar: Scalar, len: u32) -> Variable {
    Variable { kind: VariableKind::Member, name: name.to_owned(), scalar, len }
}

/// A selected light.
#[derive(Clone, Copy)]
pub(crate) struct Selected {
    /// Its number.
    pub number: Value,
    /// The probability of its selection.
    pub probability: Value,
}

impl StageLinker {
    /// Selects a light for a point by a random number in [0,1). The selection has lights.
    pub(crate) fn choose_light(
        &mut self,
        selection: &LightSelection,
        point: Vector,
        random: Value,
        to: &mut Vec<Op>,
    ) -> Linking<Selected> {
        let code = &mut Arithmetic { linker: &mut *self, to: &mut *to };
        let form = code.form_of(selection)?;
        let operands = [&form[..], &point, &[random]].concat();
        let selected = self.call_text_with(SELECT, &operands, &selection.arrays(), to)?;
        Ok(Selected { number: selected[0], probability: selected[1] })
    }

    /// Returns the probability with which a light is selected for a point; `None` if it never is.
    pub(crate) fn probability_of(
        &mut self,
        selection: &LightSelection,
        light: usize,
        point: Vector,
        to: &mut Vec<Op>,
    ) -> Linking<Option<Value>> {
        let Some(way) = selection.way_to(light) else { return Ok(None) };
        let way = self.constant(to, Constant::U32(way))?;
        self.probability_at(selection, way, point, to).map(Some)
    }

    /// Returns the probability with which the light at the end of a [way](LightSelection::way) is selected for a point.
    pub(crate) fn probability_at(
        &mut self,
        selection: &LightSelection,
        way: Value,
        point: Vector,
        to: &mut Vec<Op>,
    ) -> Linking<Value> {
        let code = &mut Arithmetic { linker: &mut *self, to: &mut *to };
        let form = code.form_of(selection)?;
        let operands = [&form[..], &[way], &point].concat();
        let arrays = selection.node_fields();
        Ok(self.call_text_with(PROBABILITY, &operands, &arrays, to)?[0])
    }
}

impl Arithmetic<'_> {
    /// Adds the constants of the selection's [form](LightSelection::form).
    fn form_of(&mut self, selection: &LightSelection) -> Linking<[Value; 3]> {
        let [count, levels, probability] = selection.form();
        let mut constant = |value| self.linker.constant(self.to, value);
        Ok([constant(count)?, constant(levels)?, constant(probability)?])
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
        let ways = [5, 0, 2, 3, 1].map(|light| selection.way_to(light));
        assert_eq!(ways, [Some(0b10), Some(0b101), Some(0b111), Some(0), None]);
        assert_eq!(LightSelection::default().way_to(0), None);
        assert_eq!((selection.levels(), LightSelection::default().levels()), (2, -1));
    }

    #[test]
    fn ways_are_numbers() {
        assert_eq!(LightSelection::way(0, 0), Some(1));
        assert_eq!(LightSelection::way(0b01, 2), Some(0b101));
        assert_eq!(LightSelection::way(0, 32), None);
    }

    #[test]
    fn the_table_has_the_numbers_of_lights() {
        let members = selection().members(|light| light as u32 + 10);
        let [(_, centers), (_, radii), (_, strengths), (_, contents), (name, infinite)] =
            members.try_into().unwrap();
        assert_eq!((centers.len(), strengths.len()), (15, 5));
        assert_eq!(radii[0], f32::MIN_POSITIVE.to_bits());
        assert_eq!(contents, [1, !15, 3, !10, !12]);
        assert_eq!((name, infinite), (INFINITE, vec![13]));
    }
}
