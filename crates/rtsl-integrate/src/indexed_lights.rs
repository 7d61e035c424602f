//! Samples of the lights that `illuminance` of a material names by their indices.
//!
//! Paths wait for such a sample ([`ResumedBy::LightSample`]). One function, which is linked once for a scene, computes
//! those of all paths that wait, whatever their materials; renderers trace the shadow rays then.

use std::sync::Arc;

use rtsl_ir::{Constant, Index, Op, OpKind, Output, Region, Scalar, Value, Variable, VariableKind};
use rtsl_link::{Linked, Linker, Linking};
use rtsl_math::sampling::Sampler;
use rtsl_source::Diagnostic;
use rtsl_stages::{MAX_ANSWERS, Port, ResumedBy};

use crate::arithmetic::{Arithmetic, Vector};
use crate::lights::{ENTRIES, LightLinks, LitPoint, SampleWeight};
use crate::sequences::Purpose;
use crate::shade_call::ShadedSurface;
use crate::stage::SurfaceLinks;
use crate::stage_linker::StageLinker;

/// The number of answers to a request, and that of its operands but the index.
const ANSWERS: &[Scalar] = ResumedBy::LightSample.answers();
const REQUEST: &[u32] = ResumedBy::LightSample.request();

/// The port after those of answers, with the greatest parameter at which something on the shadow ray blocks it.
pub const SHADOW_LIMIT: Port = Port::Answer(MAX_ANSWERS as u32);

/// Links the function that samples lights for paths which request that: it reads the operands of requests, and stores
/// the answers, of which the first is true if there is light unless something is on the shadow ray.
///
/// # Errors
/// If linking passes a limit.
pub fn link_lights(links: &LightLinks, sampler: Sampler) -> Result<Linked, Diagnostic> {
    let mut linker = StageLinker::new("illuminance");
    linker.surface = Some(Arc::new(SurfaceLinks { sampler: Some(sampler), ..Default::default() }));
    let mut body = Region::default();
    let code = &mut Arithmetic { linker: &mut linker, to: &mut body.ops };
    let mut operands = Vec::new();
    for port in REQUEST {
        let scalar = Port::request_scalar(*port);
        operands.push(code.column(&Port::Request(*port).name(), scalar)?);
    }
    let code = &mut Arithmetic { linker: &mut linker, to: &mut body.ops };
    let (surface, key) = (code.shaded_columns()?, code.begin_sequence(Purpose::LightSample)?);
    let sample =
        linker.light_with_limit(links, &sampler, &surface, key, &operands, &mut body.ops)?;
    let [light @ .., limit] = sample.as_slice() else { unreachable!("samples have limits") };
    let answers = (0..).map(Port::Answer).zip(ANSWERS).zip(light);
    let limit = ((SHADOW_LIMIT, &Scalar::F32), limit);
    for ((port, scalar), value) in answers.chain([limit]) {
        let (kind, name) = (VariableKind::Scratch, port.name());
        let variable = linker.intern_variable(Variable { kind, name, scalar: *scalar, len: 1 });
        linker.out.outputs.push(Output { variable, component: 0 });
        body.yields.push(*value);
    }
    linker.out.body = body;
    linker.pass_on_values()?;
    Ok(linker.finish())
}

impl StageLinker {
    /// Samples the light with an index for a point of a surface, with numbers of the sequence with a key. Returns the
    /// answers to a request, then the limit of the shadow ray.
    pub(crate) fn light_with_limit(
        &mut self,
        links: &LightLinks,
        sampler: &Sampler,
        surface: &ShadedSurface,
        key: Value,
        operands: &[Value],
        to: &mut Vec<Op>,
    ) -> Linking<Vec<Value>> {
        let vector = |first: usize| [operands[first], operands[first + 1], operands[first + 2]];
        let (index, point, axis, cosine) = (operands[0], vector(1), vector(4), operands[7]);
        let code = &mut Arithmetic { linker: &mut *self, to: &mut *to };
        let lit = code.lit_point(surface, point, axis, cosine)?;
        if links.entries.is_empty() {
            return code.no_light();
        }
        let number = code.number_of_entry(links, index)?;
        let sample = self.sample_by_class(links, number, to, &mut |linker, class, to| {
            let (sample, is_found) = linker.sampled_color(class, &lit, key, sampler, to)?;
            let code = &mut Arithmetic { linker, to };
            let (divides, probability) = (code.boolean(false)?, code.float(1.0)?);
            let weight = SampleWeight { divides, is_found, probability };
            let (color, density) = code.weighed(sample.color, sample.density, weight)?;
            let ends = [sample.distance, sample.end];
            Ok([&sample.direction[..], &ends, &color, &[density]].concat())
        })?;
        let code = &mut Arithmetic { linker: self, to };
        let [x, y, z, distance, limit, red, green, blue, density] =
            sample.try_into().expect("a sample has nine scalars");
        let operands = [&[x, y, z, red, green, blue][..], &axis, &[cosine]].concat();
        let is_usable = code.call("rt_isSampleInCone", &operands)?[0];
        Ok(vec![is_usable, x, y, z, distance, red, green, blue, density, limit])
    }
}

impl Arithmetic<'_> {
    /// The point that is lit, with the normals on the side for which light is requested: that from which the ray came,
    /// or the other if there is a cone around an axis that points there.
    fn lit_point(
        &mut self,
        surface: &ShadedSurface,
        point: Vector,
        axis: Vector,
        cosine: Value,
    ) -> Linking<LitPoint> {
        let ShadedSurface { normals, offset, .. } = *surface;
        let operands = [&normals[0][..], &axis, &[cosine]].concat();
        let side = self.call("rt_litSide", &operands)?[0];
        let normals = [self.scaled(normals[0], side)?, self.scaled(normals[1], side)?];
        Ok(LitPoint { point, normals, offset })
    }

    /// The number of the light with an index, among those of all classes.
    fn number_of_entry(&mut self, links: &LightLinks, index: Value) -> Linking<Value> {
        let number = self.bitcast(Scalar::U32, index)?;
        if links.entries.iter().copied().eq(0..links.entries.len() as u32) {
            return Ok(number);
        }
        let (kind, len) = (VariableKind::Member, links.entries.len() as u32);
        let table = Variable { kind, name: ENTRIES.to_owned(), scalar: Scalar::U32, len };
        let table = self.linker.intern_variable(table);
        let kind = OpKind::Load(table, Index::Dynamic(index));
        Ok(self.linker.emit(self.to, kind, &[Scalar::U32], false)?.get(0))
    }

    /// The answers to a request in a scene without lights, and a limit.
    fn no_light(&mut self) -> Linking<Vec<Value>> {
        let zeros = ANSWERS.iter().chain([&Scalar::F32]).map(|scalar| Constant::zero(*scalar));
        zeros.map(|zero| self.linker.constant(self.to, zero)).collect()
    }
}
