//! Kernels for the values of a scene's camera, lights and materials, made while a long render goes
//! on. The image does not depend on when they come: their bits are those of the general kernels.
//!
//! Measured on two processors: three-spheres takes 6.5 and 7.2 s with them and 6.6 s without: no more than
//! runs differ by. Shapes are left alone: there are many, and each has few members.

use std::sync::{Arc, Once, OnceLock};
use std::time::Duration;

use rtsl::{Engine, Instance, Kernel, KernelRequest, Method, SpecialisedKernel};

use super::compiled_scene::{CompiledScene, ShaderInstance};

/// Renders that last no longer are done before it pays.
pub const SPECIALISE_AFTER: Duration = Duration::from_secs(1);

/// Scenes with more instances than this would compile to their end.
const MAX_INSTANCES: usize = 64;

/// The methods that are worth it.
const METHODS: [Method; 4] =
    [Method::GenerateRay, Method::Illumination, Method::Shade, Method::Emission];

/// The kernels of one instance, once they are asked for.
#[derive(Default)]
pub struct Specialised(OnceLock<Vec<(Method, SpecialisedKernel)>>);

impl Specialised {
    /// The best kernel of a method by now, if it was asked for.
    pub fn kernel(&self, method: Method) -> Option<&Kernel> {
        let mut kernels = self.0.get()?.iter();
        kernels.find(|(other, _)| *other == method).map(|(_, kernel)| &**kernel.kernel())
    }
}

/// What specialising a scene takes.
pub struct Specialisation {
    engine: Engine,
    /// The camera's, then those of the lights, then those of the materials.
    instances: Vec<Arc<Instance>>,
    begun: Once,
}

impl Specialisation {
    /// For the instances of a scene: its camera, lights and materials in this order.
    pub fn new(engine: &Engine, instances: Vec<Arc<Instance>>) -> Self {
        Specialisation { engine: engine.clone(), instances, begun: Once::new() }
    }
}

impl CompiledScene {
    /// Asks for kernels that know the values of the scene. Rendering uses each as soon as it is
    /// there.
    pub fn specialise(&self) {
        let Specialisation { engine, instances, begun } = &self.specialisation;
        begun.call_once(|| {
            if instances.len() > MAX_INSTANCES {
                return;
            }
            for (instance, placed) in instances.iter().zip(self.specialisable()) {
                let shader = self.shader(placed);
                let kernels = METHODS.into_iter().filter_map(|method| {
                    let variant = shader.variant(method)?.clone();
                    let request = KernelRequest::new(&shader.program, method, variant);
                    // Without one the general kernel goes on.
                    Some((method, engine.specialise(&request, instance).ok()?))
                });
                // Nobody else sets it.
                let _ = placed.specialised.0.set(kernels.collect());
            }
        });
    }

    /// Waits until all that [`CompiledScene::specialise`] asked for is there; how many kernels that
    /// are.
    pub fn wait_for_specialised(&self) -> usize {
        let instances = self.specialisable().filter_map(|it| it.specialised.0.get());
        let kernels = instances.flatten().map(|(_, kernel)| kernel);
        kernels.inspect(|kernel| kernel.wait()).filter(|kernel| kernel.is_specialised()).count()
    }

    fn specialisable(&self) -> impl Iterator<Item = &ShaderInstance> {
        let lights = self.lights.iter().map(|light| &light.instance);
        [&self.camera].into_iter().chain(lights).chain(&self.materials)
    }
}
