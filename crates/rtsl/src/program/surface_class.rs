//! Classes of surfaces, for which the stages of integrators are linked.

use std::collections::BTreeMap;
use std::sync::Arc;

use rtsl_ir::Query;
use rtsl_spec::{Method, StateVariable, lookup_state};

use super::program::Program;
use crate::instance::instance::Instance;
use crate::link::linked_method::LinkedMethod;
use crate::link::stage::{Answer, SurfaceLinks, SurfaceMethod};

/// Surfaces with materials of one class, and emitters of one class.
#[derive(Clone, Debug)]
pub struct SurfaceClass {
    /// The materials.
    pub material: Arc<Program>,
    /// True if the materials are the shapes themselves, whose methods may read the scratch of `intersect`.
    pub is_own_material: bool,
    /// The materials of additional emission, which area lights have.
    pub emitter: Option<Arc<Program>>,
    /// True if light samples may choose the surfaces.
    pub is_sampled: bool,
}

/// The instances of the parts of one surface.
#[derive(Clone, Copy)]
pub struct SurfaceObject<'a> {
    /// The material.
    pub material: &'a Instance,
    /// The emitter, if the class has them.
    pub emitter: Option<&'a Instance>,
}

/// The path to the members of materials in linked stages.
const MATERIAL: &str = "material.";
/// The path to the members of emitters.
const EMITTER: &str = "emitter.";

impl SurfaceClass {
    /// Returns the programs of the parts, with the paths to their members.
    pub(crate) fn parts(&self) -> impl Iterator<Item = (&'static str, &Arc<Program>)> {
        let emitter = self.emitter.as_ref().map(|emitter| (EMITTER, emitter));
        [(MATERIAL, &self.material)].into_iter().chain(emitter)
    }

    /// Returns the answers to queries about such surfaces that need no host.
    pub(crate) fn links(&self, found: Option<bool>) -> SurfaceLinks {
        let mut answers = BTreeMap::new();
        self.link_emission(&mut answers);
        self.link_scattering(&mut answers);
        match &self.emitter {
            None => {
                answers.insert(Query::LightEmission, Answer::Zeros);
            }
            Some(emitter) => {
                if let Ok(method) = emitter.method(Method::Emission) {
                    insert(&mut answers, Query::LightEmission, &method, EMITTER);
                }
            }
        }
        if !self.is_sampled {
            answers.insert(Query::LightPdf, Answer::Zeros);
        }
        SurfaceLinks { answers, found }
    }

    /// Materials that only have `shade` emit what it returns.
    fn link_emission(&self, answers: &mut BTreeMap<Query, Answer>) {
        let has_only_shade =
            self.material.has(Method::Shade) && !self.material.has(Method::SampleBsdf);
        if has_only_shade {
            return;
        }
        match self.method(Method::Emission, "rt_EmissionColor") {
            None => {
                answers.insert(Query::Emission, Answer::Zeros);
            }
            Some(method) => self.insert(answers, Query::Emission, &method),
        }
    }

    fn link_scattering(&self, answers: &mut BTreeMap<Query, Answer>) {
        let scatters = self.material.has(Method::SampleBsdf);
        let sample = self.material.method(Method::SampleBsdf).ok().filter(|_| scatters);
        // Light samples contribute nothing to materials with deltas only.
        let value = self.method(Method::Bsdf, "rt_BSDFValue").filter(|_| scatters);
        let density = self.material.method(Method::EvaluatePdf).ok();
        let density = density.filter(|_| value.is_some());
        for (query, method) in
            [(Query::SampleBsdf, sample), (Query::Bsdf, value), (Query::BsdfPdf, density)]
        {
            match method {
                None => {
                    answers.insert(query, Answer::Zeros);
                }
                Some(method) => self.insert(answers, query, &method),
            }
        }
    }

    /// Returns a method of the materials, unless it always leaves its result zero.
    fn method(&self, method: Method, result: &str) -> Option<Arc<LinkedMethod>> {
        let is_zero =
            |method: &LinkedMethod, variable: &StateVariable| method.leaves_zero(variable);
        let linked = self.material.method(method).ok()?;
        let variable = lookup_state(result)?;
        (!is_zero(&linked, variable)).then_some(linked)
    }

    fn insert(
        &self,
        answers: &mut BTreeMap<Query, Answer>,
        query: Query,
        method: &Arc<LinkedMethod>,
    ) {
        if !(self.is_own_material && method.reads_scratch) {
            insert(answers, query, method, MATERIAL);
        }
    }
}

/// Returns the answers to queries about a surface that the scene does not have.
pub(crate) fn no_surface(found: Option<bool>) -> SurfaceLinks {
    let queries = Query::ALL.into_iter().filter(|query| query.is_of_surface());
    SurfaceLinks { answers: queries.map(|query| (query, Answer::Zeros)).collect(), found }
}

fn insert(
    answers: &mut BTreeMap<Query, Answer>,
    query: Query,
    method: &Arc<LinkedMethod>,
    prefix: &'static str,
) {
    if let Some(method) = SurfaceMethod::answering(query, method, prefix) {
        answers.insert(query, Answer::Method(method));
    }
}
