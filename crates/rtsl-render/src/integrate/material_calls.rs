//! Calls of the methods of materials.

use rtsl::{Kernel, Method};

use super::path_tracer::PathTracer;
use super::shading_batch::ShadingBatch;
use crate::compiled::calls::Callee;
use crate::compiled::material::MaterialSource;
use crate::compiled::surface_group::SurfaceGroup;

impl PathTracer<'_> {
    /// Calls a method of the batch's materials.
    pub fn call_material(
        &self,
        group: &SurfaceGroup,
        method: Method,
        kernel: &Kernel,
        batch: &mut ShadingBatch,
    ) {
        let ShadingBatch { count, state, surfaces, scratch, objects, materials, random, .. } =
            batch;
        let (source, of) = group.key.material;
        let callee = Callee { class: self.material_name(group), method, errors: self.errors };
        match source {
            MaterialSource::Own => {
                let class = self.scene.compiled.class(group.key.class);
                let instances = of.instances(&class.objects, objects);
                let scratch = &mut surfaces.block;
                callee.call_for_first(kernel, *count, instances, state, scratch, random);
            }
            MaterialSource::Class(class) => {
                let class = &self.scene.materials[class];
                for array in 0..group.material_scratch {
                    scratch.words_mut(array).fill(0);
                }
                let instances = of.instances(&class.objects, materials);
                callee.call_for_first(kernel, *count, instances, state, scratch, random);
            }
        }
    }
}
