//! The material methods of a group of surfaces.

use std::sync::Arc;

use rtsl::{Kernel, LinkedMethod, Method, Objects, Outputs, Program, lookup_state};

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
#[derive(Default)]
pub struct MaterialKernels {
    /// `emission`.
    pub emission: Option<Arc<Kernel>>,
    /// The methods that scatter light, if the material samples a density or deltas.
    pub scattering: Option<ScatteringKernels>,
    /// `shade`, if the class has no other method.
    pub shade: Option<Arc<Kernel>>,
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

/// The methods of a material that the renderer may call.
const METHODS: [Method; 5] =
    [Method::Emission, Method::Bsdf, Method::EvaluatePdf, Method::SampleBsdf, Method::Shade];

/// Returns the methods of a material that the renderer calls for hits. `shade` is not among those of materials that
/// scatter.
pub fn called_methods(program: &Program) -> impl Iterator<Item = Method> {
    let scatters = program.has(Method::SampleBsdf);
    METHODS
        .into_iter()
        .filter(move |method| program.has(*method) && !(*method == Method::Shade && scatters))
}

impl MaterialKernels {
    /// Compiles the kernels of a program's instances.
    pub fn new(
        maker: &mut KernelMaker<'_>,
        program: &Arc<Program>,
        objects: &Objects,
        of: Batching,
    ) -> Self {
        let mut kernel = |method: Method| {
            let outputs = Outputs::ALL.without_scratch();
            maker.kernel(program, method, (of, objects), outputs)
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

/// True if a method always leaves a colour black.
fn leaves_black(method: &LinkedMethod, name: &str) -> bool {
    lookup_state(name).is_some_and(|variable| method.leaves_zero(variable))
}
