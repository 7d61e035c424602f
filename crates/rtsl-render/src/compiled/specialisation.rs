//! Specialisation: kernels for the values of a scene's camera, lights and materials, compiled while a long render runs.
//! The image does not depend on when they are ready, because they compute the same bits as the general kernels.
//!
//! Measured on two processors: three-spheres takes 6.5 and 7.2 s with them and 6.6 s without, which is within the
//! variation of runs. Shapes are not specialised: there are many, and each has few members.

use std::sync::{Arc, Once};
use std::time::Duration;

use rtsl::{Engine, Instance, KernelRequest, Method};

use super::shader_instance::ShaderInstance;
use super::shaders::Shader;

/// The time after which specialisation starts: shorter renders would not benefit.
pub const SPECIALISE_AFTER: Duration = Duration::from_secs(1);

/// The greatest number of instances: more would compile until the end of the render.
const MAX_INSTANCES: usize = 64;

/// The methods that benefit from specialisation.
const METHODS: [Method; 4] =
    [Method::GenerateRay, Method::Illumination, Method::Shade, Method::Emission];

/// The state of a scene's specialisation.
pub struct Specialisation {
    engine: Engine,
    /// The camera's instance, then those of the lights, then those of the materials.
    instances: Vec<Arc<Instance>>,
    begun: Once,
}

impl Specialisation {
    /// Prepares specialisation for the instances of a scene: its camera, lights and materials, in this order.
    pub fn new(engine: &Engine, instances: Vec<Arc<Instance>>) -> Self {
        Specialisation { engine: engine.clone(), instances, begun: Once::new() }
    }

    /// Requests specialised kernels, at the first call, for these instances of the compiled scene with their shaders, in
    /// the same order.
    pub fn begin<'a>(&self, placed: impl Iterator<Item = (&'a Shader, &'a ShaderInstance)>) {
        let Specialisation { engine, instances, begun } = self;
        begun.call_once(|| {
            if instances.len() > MAX_INSTANCES {
                return;
            }
            for (instance, (shader, placed)) in instances.iter().zip(placed) {
                let kernels = METHODS.into_iter().filter_map(|method| {
                    let variant = shader.variant(method)?.clone();
                    let request = KernelRequest::new(&shader.program, method, variant);
                    // Without a specialised kernel, the general kernel is used.
                    Some((method, engine.specialise(&request, instance).ok()?))
                });
                // This is the only place that sets it.
                let _ = placed.specialised.0.set(kernels.collect());
            }
        });
    }
}
