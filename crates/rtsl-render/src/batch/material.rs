//! Materials of one program, and their methods for the surfaces of a group.

use std::collections::BTreeMap;
use std::sync::Arc;

use rtsl::{
    Engine, Instance, Kernel, LinkedMethod, Method, Objects, Outputs, Program, lookup_state,
};

use crate::scene::Scene;

use super::kernels::{KernelMaker, Of};

/// Materials of one program, by number.
pub struct MaterialClass {
    /// The program.
    pub program: Arc<Program>,
    /// The materials' members.
    pub objects: Arc<Objects>,
}

/// The materials of a scene by class.
#[derive(Default)]
pub struct MaterialClasses {
    /// The classes.
    pub classes: Vec<MaterialClass>,
    /// For each material of the scene its class, and its number there.
    pub numbers: Vec<(u32, u32)>,
}

impl MaterialClasses {
    /// Those of a scene.
    pub fn new(engine: &Engine, scene: &Scene) -> Self {
        let mut by_program: BTreeMap<usize, u32> = BTreeMap::new();
        let mut members: Vec<(Arc<Program>, Vec<&Instance>)> = Vec::new();
        let mut numbers = Vec::with_capacity(scene.materials.len());
        for material in &scene.materials {
            let program = engine.program(material);
            let next = members.len() as u32;
            let class = *by_program.entry(Arc::as_ptr(&program) as usize).or_insert(next);
            if class == next {
                members.push((program, Vec::new()));
            }
            let (_, instances) = &mut members[class as usize];
            numbers.push((class, instances.len() as u32));
            instances.push(material);
        }
        let classes = members.into_iter().map(|(program, instances)| {
            let objects = Arc::new(program.differing_objects(instances));
            MaterialClass { program, objects }
        });
        MaterialClasses { classes: classes.collect(), numbers }
    }
}

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
        of: Of,
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
