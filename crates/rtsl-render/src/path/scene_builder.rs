//! Preparation of a scene for path tracing.

use std::collections::BTreeSet;
use std::time::Instant;

use rayon::prelude::*;
use rtsl::{
    Diagnostic, Diagnostics, Engine, Messages, Method, SourceMap, diagnostic_codes as codes,
};
use rtsl_bvh::RAYS_OF_STREAM;
use rtsl_scene::Scene;

use super::group_plan::{Classes, GroupPlan};
use super::instance_classes::InstanceClasses;
use super::integrator::{Integrator, StageParts};
use super::kernels::KernelMaker;
use super::lights::Lights;
use super::material::MaterialSource;
use super::path_tracer::PathTracer;
use super::scene::BatchScene;
use super::surface_group::SurfaceGroup;
use crate::compiled::runtime_errors::{RuntimeErrors, exhausted_budgets};
use crate::compiled::shaders::is_own_material;
use crate::compiled::{BuildStep, CompiledScene, SceneBuilder};

impl BatchScene {
    /// Compiles kernels for a scene and builds its acceleration structure. Warnings go to `messages`; `listener` is
    /// called with the next step.
    ///
    /// # Errors
    /// If a class lacks a method that its use needs, or a kernel cannot be compiled.
    pub fn new(
        scene: &Scene,
        engine: &Engine,
        messages: &mut Messages,
        listener: &dyn Fn(BuildStep),
    ) -> Result<Self, Messages> {
        let builder = SceneBuilder::new(engine).listener(listener);
        let integrator = scene.integrator.as_ref().map(|it| Integrator::new(engine, it));
        let integrator = integrator.transpose().map_err(Messages::one)?;
        let calls_shade =
            integrator.as_ref().is_some_and(|it| it.calls_shade) || has_shade(engine, scene);
        let builder = if calls_shade { builder } else { builder.for_searches() };
        let compiled = builder.build(scene.clone(), messages)?;
        let start = Instant::now();
        let materials = InstanceClasses::new(engine, &scene.materials);
        let textures: Vec<_> = scene.objects.iter().filter_map(|it| it.alpha.clone()).collect();
        let alpha = InstanceClasses::new(engine, &textures);
        let classes = Classes { compiled: &compiled, materials: &materials, alpha: &alpha };
        let plan = GroupPlan::new(scene, classes);
        let made = KernelMaker::build_with(engine, |maker| {
            let groups = plan.keys.iter().map(|key| {
                let parts = classes.parts_of(key);
                SurfaceGroup::new(maker, *key, &parts, integrator.is_some())
            });
            let groups: Vec<SurfaceGroup> = groups.collect();
            (groups, Lights::new(maker, scene, classes, &plan.objects))
        });
        let ((groups, lights), diagnostics) = made.map_err(|errors| failed(messages, errors))?;
        messages.push(SourceMap::new(), diagnostics);
        // Paths are incoherent, so searches need all kernels at once.
        let has_streams = compiled.geometry.suits_stream(RAYS_OF_STREAM);
        compiled.classes.par_iter().for_each(|class| class.make_all(has_streams));
        if integrator.is_none() {
            warn_of_shade(&groups, &compiled, &materials, messages);
        }
        let compile_time = compiled.compile_time + start.elapsed();
        let description = scene;
        let mut scene = BatchScene {
            compiled,
            compile_time,
            groups,
            objects: plan.objects,
            materials,
            alpha,
            lights,
            integrator,
        };
        let errors = RuntimeErrors::default();
        let tracer = PathTracer { scene: &scene, errors: &errors, with_features: false };
        let probes = tracer.probe_lights();
        if errors.any() {
            return Err(exhausted_budgets(&scene.compiled, &errors));
        }
        scene.lights.select_by(&probes);
        scene.compile_stages(engine, description)?;
        Ok(scene)
    }
}

impl BatchScene {
    /// Compiles the stages of the integrator, if the scene names one written in RTSL.
    fn compile_stages(&mut self, engine: &Engine, description: &Scene) -> Result<(), Messages> {
        let Some(mut integrator) = self.integrator.take() else { return Ok(()) };
        let start = Instant::now();
        let BatchScene { compiled, materials, alpha, groups, objects, lights, .. } = &*self;
        let parts =
            StageParts { classes: Classes { compiled, materials, alpha }, groups, objects, lights };
        if let Some(instance) = &description.integrator {
            let made = integrator.compile(engine, instance, description, &parts);
            made.map_err(Messages::one)?;
        }
        self.compile_time += start.elapsed();
        self.integrator = Some(integrator);
        Ok(())
    }
}

/// True if surfaces of a scene have only `shade`.
pub(crate) fn has_shade(engine: &Engine, scene: &Scene) -> bool {
    scene.objects.iter().any(|object| {
        let material = match is_own_material(object) {
            true => &object.primitive,
            false => &scene.materials[object.material as usize],
        };
        let program = engine.program(material);
        program.has(Method::Shade) && !program.has(Method::SampleBsdf)
    })
}

/// Warns about materials that have only `shade`.
fn warn_of_shade(
    groups: &[SurfaceGroup],
    compiled: &CompiledScene,
    materials: &InstanceClasses,
    messages: &mut Messages,
) {
    let shading = groups.iter().filter(|group| group.material.shade.is_some());
    let classes: BTreeSet<&str> = shading
        .map(|group| match group.key.material.0 {
            MaterialSource::Own => compiled.class(group.key.class).name.as_str(),
            MaterialSource::Class(class) => materials[class].program.class().name.as_str(),
        })
        .collect();
    for class in classes {
        let message = format!("`{class}` has only `shade`, which does not support path tracing");
        messages.push_one(
            Diagnostic::new(codes::SHADE_ONLY, message).note(
                "the image shows the light that `shade` computes, which may not be all of it",
            ),
        );
    }
}

fn failed(messages: &mut Messages, diagnostics: Diagnostics) -> Messages {
    messages.push(SourceMap::new(), diagnostics);
    std::mem::take(messages)
}
