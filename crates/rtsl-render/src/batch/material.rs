//! The methods of materials for the surfaces of a group.

use std::sync::Arc;

use rtsl::{Kernel, LinkedMethod, Method, Objects, Outputs, Program, lookup_state};

use super::kernels::{Batching, KernelMaker};

/// Whose methods a surface has for its material.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum MaterialSource {
    /// The shape's own class.
    Own,
    /// Materials of this class.
    Class(u32),
}

/// The methods of materials.
#[derive(Default)]
pub struct MaterialKernels {
    /// `emission`.
    pub emission: Option<Arc<Kernel>>,
    /// How it scatters light, if it does so by a density or by deltas.
    pub scattering: Option<ScatteringKernels>,
    /// `shade`, where that is all that the class has.
    pub shade: Option<Arc<Kernel>>,
}

/// The methods that scatter light.
pub struct ScatteringKernels {
    /// `sampleBSDF`.
    pub sample: Arc<Kernel>,
    /// `BSDF` and `evaluatePDF`; `None` where no light sample can be scattered, since every direction is a
    /// delta.
    pub evaluate: Option<EvaluationKernels>,
}

/// The methods that say how light of one direction is scattered.
pub struct EvaluationKernels {
    /// `BSDF`.
    pub bsdf: Arc<Kernel>,
    /// `evaluatePDF`.
    pub density: Arc<Kernel>,
}

/// The methods of a material that the renderer may call.
const METHODS: [Method; 5] =
    [Method::Emission, Method::Bsdf, Method::EvaluatePdf, Method::SampleBsdf, Method::Shade];

/// The methods of a material that the renderer calls for hits. Those of materials that scatter leave `shade` to
/// others.
pub fn called_methods(program: &Program) -> impl Iterator<Item = Method> {
    let scatters = program.has(Method::SampleBsdf);
    METHODS
        .into_iter()
        .filter(move |method| program.has(*method) && !(*method == Method::Shade && scatters))
}

impl MaterialKernels {
    /// Those of a program's instances.
    pub fn new(
        maker: &mut KernelMaker<'_>,
        program: &Arc<Program>,
        objects: &Objects,
        of: Batching,
    ) -> Self {
        let mut kernel = |method: Method| {
            let outputs = Outputs::ALL.without_scratch();
            maker.kernel(program, method, (of, objects.form()), outputs)
        };
        if !program.has(Method::SampleBsdf) {
            let emission = kernel(Method::Emission);
            return MaterialKernels { emission, scattering: None, shade: kernel(Method::Shade) };
        }
        let emits =
            program.method(Method::Emission).is_ok_and(|it| !leaves_black(&it, "rt_EmissionColor"));
        let emission = if emits { kernel(Method::Emission) } else { None };
        let scatters_lights =
            program.method(Method::Bsdf).is_ok_and(|it| !leaves_black(&it, "rt_BSDFValue"));
        let evaluate = if scatters_lights {
            let (bsdf, density) = (kernel(Method::Bsdf), kernel(Method::EvaluatePdf));
            bsdf.zip(density).map(|(bsdf, density)| EvaluationKernels { bsdf, density })
        } else {
            None
        };
        let sample = kernel(Method::SampleBsdf);
        let scattering = sample.map(|sample| ScatteringKernels { sample, evaluate });
        MaterialKernels { emission, scattering, shade: None }
    }
}

/// Whether a method leaves a colour black whatever it is called for.
fn leaves_black(method: &LinkedMethod, name: &str) -> bool {
    lookup_state(name).is_some_and(|variable| method.leaves_zero(variable))
}
