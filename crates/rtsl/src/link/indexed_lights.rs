//! Samples of the lights that `illuminance` of a material names by their indices, as operations.
//!
//! A sample includes a shadow ray. Before a method is split into stages, [`separate_shadow_rays`] makes two operations
//! of each sample: the light at the point, which stages compute, and a ray that asks whether anything is on the way.

use std::sync::Arc;

use rtsl_ir::{
    BinaryOp, CompareOp, Constant, Function, Op, OpKind, Query, Region, Scalar, UnaryOp, Value,
    Variable, VariableKind,
};
use rtsl_math::sampling::Sampler;

use super::arithmetic::{Arithmetic, Vector};
use super::chosen_light::ChosenLight;
use super::lights::{LightLinks, LitPoint};
use super::linker::{Linker, Linking, Site};
use super::sequences::Purpose;

/// The member with the ambient light.
pub(crate) const AMBIENT: &str = "light.rt_Ambient";

/// The number of scalars of the surface that a material shades.
pub(crate) const SHADED_SCALARS: usize = 10;

/// The indices of the offset and of the two normals among them; the point comes first.
const OFFSET: usize = 3;
const NORMALS: [usize; 2] = [4, 7];

/// Returns the name of the scratch array with a scalar of the surface that a material shades: the point, the offset at
/// which rays that leave it begin, the geometric and the shading normal on the side from which the ray came.
pub(crate) fn shaded_column(index: usize) -> String {
    format!("shaded.{index}")
}

/// True for the scratch with such a scalar.
pub(crate) fn is_shaded_column(variable: &Variable) -> bool {
    (0..SHADED_SCALARS).any(|index| variable.name == shaded_column(index))
}

/// Makes a query and a shadow ray of each sample of a light.
pub(crate) fn separate_shadow_rays(function: &mut Function) {
    let mut body = std::mem::take(&mut function.body);
    separate_in(function, &mut body);
    function.body = body;
}

fn separate_in(function: &mut Function, region: &mut Region) {
    for mut op in std::mem::take(&mut region.ops) {
        op.kind.regions_mut().for_each(|inner| separate_in(function, inner));
        match op.kind {
            OpKind::LightSample { index, point, normal, cosine } => {
                let operands = [&[index][..], &point, &normal, &[cosine]].concat();
                separate(function, (&op, point), operands, &mut region.ops);
            }
            _ => region.ops.push(op),
        }
    }
}

/// Adds the operations for a sample, which has these operands.
fn separate(
    function: &mut Function,
    (sample, point): (&Op, Vector),
    operands: Vec<Value>,
    to: &mut Vec<Op>,
) {
    let query = Query::SampleIndexedLight;
    let scalars: Vec<Scalar> = query.result_scalars().collect();
    let light = function.new_values(&scalars);
    to.push(Op { results: light, precise: false, kind: OpKind::Query(query, operands) });
    let [found, x, y, z, distance, limit, red, green, blue, density] =
        std::array::from_fn(|index| light.get(index as u32));
    let mut then = Region::default();
    let ray = OpKind::Occluded { origin: point, direction: [x, y, z], limit };
    let occluded = function.push(&mut then.ops, Scalar::Bool, ray);
    let reaches =
        function.push(&mut then.ops, Scalar::Bool, OpKind::Unary(UnaryOp::Not, occluded));
    let mut otherwise = Region::default();
    let none = OpKind::Constant(Constant::Bool(false));
    let none = function.push(&mut otherwise.ops, Scalar::Bool, none);
    // What the light is does not depend on whether it reaches the point.
    let light = [x, y, z, distance, red, green, blue, density];
    then.yields = [&[reaches][..], &light].concat();
    otherwise.yields = [&[none][..], &light].concat();
    let kind = OpKind::If { condition: found, then, otherwise };
    to.push(Op { results: sample.results, precise: false, kind });
}

impl Linker {
    /// Samples the light with an index.
    pub(super) fn indexed_sample(
        &mut self,
        caller: &Site<'_>,
        (links, sampler): (&LightLinks, &Sampler),
        operands: &[Value],
        to: &mut Vec<Op>,
    ) -> Linking<Vec<Value>> {
        let vector = |first: usize| [operands[first], operands[first + 1], operands[first + 2]];
        let (index, point, cone) = (operands[0], vector(1), (vector(4), operands[7]));
        let code = &mut Arithmetic { linker: &mut *self, to: &mut *to };
        let is_in_cone = code.has_cone(cone.1)?;
        let lit = code.lit_point(point, (cone.0, is_in_cone))?;
        let key = code.begin_sequence(Purpose::LightSample)?;
        if links.entries.is_empty() {
            return code.no_light();
        }
        let number = code.number_of_entry(links, index)?;
        let sample = self.sample_by_class(caller, (links, sampler), (&lit, key, number), to)?;
        let code = &mut Arithmetic { linker: self, to };
        let is_usable = code.is_usable_sample(&sample, cone, is_in_cone)?;
        Ok([&[is_usable][..], &sample].concat())
    }

    /// Returns direction, distance, length of the shadow ray, colour and density of a sample of the light with a number
    /// among those of all classes.
    fn sample_by_class(
        &mut self,
        caller: &Site<'_>,
        (links, sampler): (&LightLinks, &Sampler),
        (lit, key, number): (&LitPoint, Value, Value),
        to: &mut Vec<Op>,
    ) -> Linking<Vec<Value>> {
        let mut end = links.entries.len() as u32;
        let mut sample: Option<Vec<Value>> = None;
        for class in links.entry_classes.iter().rev() {
            let first = end - class.lights.len() as u32;
            let mut then = Region::default();
            then.yields = self.nested(|linker| {
                let code = &mut Arithmetic { linker, to: &mut then.ops };
                let chosen = ChosenLight::new(code, class, (number, first))?;
                linker.chosen_light = Some(Arc::new(chosen));
                let light = (links, class.lights[0]);
                let sample =
                    linker.undivided_sample(caller, light, (lit, key, sampler), &mut then.ops);
                linker.chosen_light = None;
                sample
            })?;
            sample = Some(match sample {
                None => {
                    to.append(&mut then.ops);
                    then.yields
                }
                Some(later) => {
                    let code = &mut Arithmetic { linker: &mut *self, to: &mut *to };
                    let end = code.word(end)?;
                    let condition = code.less(number, end)?;
                    self.branch(condition, then, later, to)?
                }
            });
            end = first;
        }
        Ok(sample.expect("there are lights"))
    }

    /// Returns a sample whose colour is not divided by a density with which rays find the light too.
    fn undivided_sample(
        &mut self,
        caller: &Site<'_>,
        (links, light): (&LightLinks, usize),
        (lit, key, sampler): (&LitPoint, Value, &Sampler),
        to: &mut Vec<Op>,
    ) -> Linking<Vec<Value>> {
        let (sample, is_weighed) =
            self.sampled_color(caller, (links, light), (lit, key, sampler), to)?;
        let code = &mut Arithmetic { linker: self, to };
        let (mut color, mut density) = (sample.color, sample.density);
        if !is_weighed {
            let one = code.float(1.0)?;
            let divided = code.weighed(&sample, one, is_weighed)?;
            color = [divided[4], divided[5], divided[6]];
            density = divided[7];
        }
        let ends = [sample.distance, sample.end];
        Ok([&sample.direction[..], &ends, &color, &[density]].concat())
    }
}

impl Arithmetic<'_> {
    /// True if light is taken from within a cone.
    fn has_cone(&mut self, cosine: Value) -> Linking<Value> {
        let none = self.float(f32::NEG_INFINITY)?;
        self.compare(CompareOp::NotEqual, cosine, none)
    }

    /// The point that is lit, with the normals on the side for which light is requested: that from which the ray came,
    /// or the other if there is a cone around an axis that points there.
    fn lit_point(&mut self, point: Vector, (axis, has_cone): (Vector, Value)) -> Linking<LitPoint> {
        let mut shaded = |index: usize| self.column(&shaded_column(index), Scalar::F32);
        let offset = shaded(OFFSET)?;
        let mut normals = Vec::new();
        for first in NORMALS {
            normals.push([shaded(first)?, shaded(first + 1)?, shaded(first + 2)?]);
        }
        let cosine = self.products(normals[0], axis)?;
        let zero = self.float(0.0)?;
        let is_behind = self.less(cosine, zero)?;
        let is_turned = self.and(is_behind, has_cone)?;
        let (back, front) = (self.float(-1.0)?, self.float(1.0)?);
        let side = self.select(is_turned, back, front)?;
        let geometric = self.scaled(normals[0], side)?;
        let shading = self.scaled(normals[1], side)?;
        Ok(LitPoint { point, normals: [geometric, shading], offset })
    }

    /// The number of the light with an index, among those of all classes.
    fn number_of_entry(&mut self, links: &LightLinks, index: Value) -> Linking<Value> {
        let order: Vec<usize> =
            links.entry_classes.iter().flat_map(|class| class.lights.iter().copied()).collect();
        let number_of = |light: usize| {
            order.iter().position(|other| *other == light).map_or(0, |number| number as u32)
        };
        let index = self.bitcast(Scalar::U32, index)?;
        if links.entries.iter().map(|light| number_of(*light)).eq(0..links.entries.len() as u32) {
            return Ok(index);
        }
        let mut number = self.word(number_of(links.entries[0]))?;
        for (entry, light) in (0..).zip(&links.entries).skip(1) {
            let (entry, own) = (self.word(entry)?, self.word(number_of(*light))?);
            let is_it = self.compare(CompareOp::Equal, index, entry)?;
            number = self.select(is_it, own, number)?;
        }
        Ok(number)
    }

    /// True if a sample is not black, and comes from within the cone if there is one.
    fn is_usable_sample(
        &mut self,
        sample: &[Value],
        (axis, cosine): (Vector, Value),
        has_cone: Value,
    ) -> Linking<Value> {
        let zero = self.float(0.0)?;
        let mut is_lit = self.compare(CompareOp::NotEqual, sample[5], zero)?;
        for channel in &sample[6..8] {
            let other = self.compare(CompareOp::NotEqual, *channel, zero)?;
            is_lit = self.binary(BinaryOp::Or, is_lit, other)?;
        }
        let square = self.products(axis, axis)?;
        let length = self.root(square)?;
        let has_length = self.compare(CompareOp::Greater, length, zero)?;
        let unit = self.each(|it, component| it.divide(axis[component], length))?;
        let nowhere = self.vector([0.0; 3])?;
        let axis = self.select_vector(has_length, unit, nowhere)?;
        let of_sample = self.products(axis, [sample[0], sample[1], sample[2]])?;
        let is_within = self.compare(CompareOp::GreaterEqual, of_sample, cosine)?;
        let has_no_cone = self.unary(UnaryOp::Not, has_cone)?;
        let is_within = self.binary(BinaryOp::Or, has_no_cone, is_within)?;
        self.and(is_lit, is_within)
    }

    /// The results of a query in a scene without lights.
    fn no_light(&mut self) -> Linking<Vec<Value>> {
        let zeros = Query::SampleIndexedLight.result_scalars().map(Constant::zero);
        zeros.map(|zero| self.linker.constant(self.to, zero)).collect()
    }

    /// The number of lights.
    pub fn light_count(&mut self, links: &LightLinks) -> Linking<Value> {
        self.linker.constant(self.to, Constant::I32(links.entries.len() as i32))
    }

    /// The ambient light.
    pub fn ambient(&mut self) -> Linking<Vec<Value>> {
        let kind = VariableKind::Member;
        let member = Variable { kind, name: AMBIENT.to_owned(), scalar: Scalar::F32, len: 3 };
        (0..3).map(|channel| self.load(member.clone(), channel)).collect()
    }
}
