//! The material methods of a group of surfaces.

use std::collections::BTreeSet;
use std::sync::Arc;

use rtsl::{Kernel, LinkedMethod, Method, Objects, Outputs, Program, Query, lookup_state};

use super::instance_classes::InstanceClassId;
use super::kernels::{Batching, KernelMaker};

/// The class whose methods are a surface's material.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum MaterialSource {
    /// The shape's own class.
    Own,
    /// Materials of this class.
    Class(InstanceClassId),
}

/// The kernels of material methods.
pub struct MaterialKernels {
    /// `emission`.
    pub emission: Option<Arc<Kernel>>,
    /// The methods that scatter light, if the material samples a density or deltas.
    pub scattering: Option<ScatteringKernels>,
    /// True if the class has only `shade`.
    pub is_shaded: bool,
}

/// The methods that scatter light.
pub struct ScatteringKernels {
    /// `sampleBSDF`.
    pub sample: Arc<Kernel>,
    /// `BSDF` and `evaluatePDF`; `None` if all directions are deltas, so that light samples contribute nothing.
    pub evaluate: Option<EvaluationKernels>,
}

/// The methods that evaluate the BSDF for a given direction.
pub struct EvaluationKernels {
    /// `BSDF`.
    pub bsdf: Arc<Kernel>,
    /// `evaluatePDF`.
    pub density: Arc<Kernel>,
}

/// The methods of a material that the renderer may call, with the queries that call them.
const METHODS: [(Method, &[Query]); 4] = [
    (Method::Emission, &[Query::Emission]),
    (Method::Bsdf, &SCATTERING),
    (Method::EvaluatePdf, &SCATTERING),
    (Method::SampleBsdf, &SCATTERING),
];

/// Queries about scattering, whose methods are compiled together.
const SCATTERING: [Query; 3] = [Query::Bsdf, Query::BsdfPdf, Query::SampleBsdf];

/// Returns the methods of a material that these queries call for hits.
pub fn called_methods(program: &Program, queries: &BTreeSet<Query>) -> Vec<Method> {
    let is_called = |(method, by): &(Method, &[Query])| {
        program.has(*method) && by.iter().any(|query| queries.contains(query))
    };
    let called = METHODS.into_iter().filter(is_called).map(|(method, _)| method);
    let shading = shading_method(program).filter(|_| shades(queries));
    let emitted = is_shaded(program) && queries.contains(&Query::Emission);
    called.chain(shading).chain(emitted.then_some(Method::Shade)).collect()
}

/// True if any query calls `shade` of materials.
fn shades(queries: &BTreeSet<Query>) -> bool {
    [Query::Shade, Query::OwnShade].iter().any(|query| queries.contains(query))
}

/// Returns the method that `shade` of a surface calls: materials that only emit have no `shade`.
pub fn shading_method(program: &Program) -> Option<Method> {
    [Method::Shade, Method::Emission].into_iter().find(|method| program.has(*method))
}

/// True if a material has only `shade`.
pub fn is_shaded(program: &Program) -> bool {
    program.has(Method::Shade) && !program.has(Method::SampleBsdf)
}

impl MaterialKernels {
    /// Compiles the kernels of a program's instances that answer these queries.
    pub fn new(
        maker: &mut KernelMaker<'_>,
        program: &Arc<Program>,
        of: Batching,
        objects: &Objects,
        queries: &BTreeSet<Query>,
    ) -> Self {
        let methods = called_methods(program, queries);
        let mut kernel = |method: Method| {
            let outputs = Outputs::ALL.without_scratch();
            let is_called = methods.contains(&method);
            if is_called { maker.kernel(program, method, of, objects, outputs) } else { None }
        };
        let leaves_black = |method: Method, color: &str| {
            program.method(method).is_ok_and(|it| leaves_black(&it, color))
        };
        let emits = !leaves_black(Method::Emission, "rt_EmissionColor");
        let emission = if emits { kernel(Method::Emission) } else { None };
        let scatters_lights = !leaves_black(Method::Bsdf, "rt_BSDFValue");
        let evaluate = if scatters_lights {
            let (bsdf, density) = (kernel(Method::Bsdf), kernel(Method::EvaluatePdf));
            bsdf.zip(density).map(|(bsdf, density)| EvaluationKernels { bsdf, density })
        } else {
            None
        };
        let sample = kernel(Method::SampleBsdf);
        let scattering = sample.map(|sample| ScatteringKernels { sample, evaluate });
        MaterialKernels { emission, scattering, is_shaded: is_shaded(program) }
    }
}

/// True if a method always leaves a colour black.
fn leaves_black(method: &LinkedMethod, name: &str) -> bool {
    lookup_state(name).is_some_and(|variable| method.leaves_zero(variable))
}
