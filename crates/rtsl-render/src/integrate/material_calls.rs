//! Calls of the methods of materials.

use rtsl::{Kernel, Method};

use super::shading_batch::ShadingBatch;
use crate::compiled::calls::Callee;
use crate::compiled::material::MaterialSource;
use crate::compiled::render_scene::RenderScene;
use crate::compiled::runtime_errors::RuntimeErrors;
use crate::compiled::surface_group::SurfaceGroup;

impl SurfaceGroup {
    /// Calls a method of the batch's materials.
    pub fn call_material(
        &self,
        scene: &RenderScene,
        errors: &RuntimeErrors,
        method: Method,
        kernel: &Kernel,
        batch: &mut ShadingBatch,
    ) {
        let ShadingBatch { count, state, surfaces, scratch, objects, materials, random, .. } =
            batch;
        let (source, of) = self.key.material;
        let name = &scene.classes().material_of(&self.key).class().name;
        let callee = Callee { class: name, method, errors };
        match source {
            MaterialSource::Own => {
                let class = scene.compiled.class(self.key.class);
                let instances = of.instances(&class.objects, objects);
                let scratch = &mut surfaces.block;
                callee.call_for_first(kernel, *count, instances, state, scratch, random);
            }
            MaterialSource::Class(class) => {
                let class = &scene.materials[class];
                for array in 0..self.material_scratch {
                    scratch.words_mut(array).fill(0);
                }
                let instances = of.instances(&class.objects, materials);
                callee.call_for_first(kernel, *count, instances, state, scratch, random);
            }
        }
    }
}
