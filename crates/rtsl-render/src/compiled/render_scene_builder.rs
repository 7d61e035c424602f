//! Preparation of a scene for path tracing.

use std::collections::BTreeSet;
use std::sync::{Arc, OnceLock};
use std::time::{Duration, Instant};

use rayon::prelude::*;
use rtsl::{
    CameraProgram, Diagnostic, Diagnostics, Engine, Messages, ParameterValues, ReadResults,
    SamplerNumbers, SourceMap, diagnostic_codes as codes,
};
use rtsl_bvh::RAYS_OF_STREAM;
use rtsl_image::Aov;
use rtsl_memory::on_all_processors;
use rtsl_scene::{PATH_TRACER, Scene, WHITTED};

use super::group_plan::{Classes, GroupPlan};
use super::instance_classes::InstanceClasses;
use super::kernels::KernelMaker;
use super::material::{MaterialSource, is_shaded};
use super::object::is_own_material;
use super::object_class::ObjectClass;
use super::render_scene::RenderScene;
use super::runtime_errors::{RuntimeErrors, exhausted_budgets};
use super::surface_group::GroupKey;
use super::{BuildStep, SceneBuilder};
use crate::film::aov_plan::AovPlan;
use crate::integrate::camera::Camera;
use crate::integrate::integrator::Integrator;
use crate::integrate::shading_methods::{ShadingMethods, ShadingParts};
use crate::integrate::shading_texts::ShadingTexts;
use crate::integrate::staged::{StageParts, StagedMethod, Surface, searched_objects, stage_lights};
use crate::lights::{Lights, probe_lights};

/// Prepares scenes for path tracing.
#[derive(Clone, Copy)]
pub struct RenderSceneBuilder<'a> {
    scene: SceneBuilder<'a>,
    aovs: &'a [Aov],
    keeps_first_hits: bool,
    values: ParameterValues,
    earlier: Option<&'a RenderScene>,
}

impl<'a> RenderSceneBuilder<'a> {
    /// Creates a builder that makes kernels and acceleration structures by another one, for pictures without AOVs.
    pub fn new(scene: SceneBuilder<'a>) -> Self {
        RenderSceneBuilder {
            scene,
            aovs: &[],
            keeps_first_hits: false,
            values: ParameterValues::Final,
            earlier: None,
        }
    }

    /// Creates a builder for a scene whose values may change. What did not change since an earlier state, which is given
    /// with its scene, is used again.
    pub fn of_changing(
        engine: &'a Engine,
        scene: &Scene,
        earlier: Option<(&'a RenderScene, &Scene)>,
    ) -> Self {
        let builder = SceneBuilder::new(engine);
        let builder = match earlier {
            Some((earlier, of)) if scene.has_same_shapes(of) => {
                builder.same_shapes(&earlier.compiled)
            }
            Some((earlier, _)) => builder.moved_shapes(&earlier.compiled),
            None => builder,
        };
        let earlier = earlier.map(|(earlier, _)| earlier);
        RenderSceneBuilder { earlier, ..RenderSceneBuilder::new(builder).changing_values() }
    }

    /// Prepares for pictures with these AOVs. Their names are those of outputs of the scene's integrator, or of images
    /// that the renderer makes.
    #[must_use]
    pub fn aovs(self, aovs: &'a [Aov]) -> Self {
        RenderSceneBuilder { aovs, ..self }
    }

    /// Prepares for films that keep first hits, whatever the AOVs.
    #[must_use]
    pub fn keeping_first_hits(self) -> Self {
        RenderSceneBuilder { keeps_first_hits: true, ..self }
    }

    /// Makes kernels that do not depend on the values of parameters, so that the kernels of the integrator may be used
    /// [again](Self::earlier).
    #[must_use]
    pub fn changing_values(self) -> Self {
        RenderSceneBuilder { values: ParameterValues::Changing, ..self }
    }

    /// Uses the kernels of an earlier state of the scene again if only values of parameters changed since.
    #[must_use]
    pub fn earlier(self, earlier: &'a RenderScene) -> Self {
        RenderSceneBuilder { earlier: Some(earlier), ..self }
    }

    /// Compiles kernels for a scene and builds its acceleration structure. Warnings go to `messages`.
    ///
    /// # Errors
    /// If a class lacks a method that its use needs, there is no image of a name, or a kernel cannot be compiled.
    pub fn build(&self, scene: &Scene, messages: &mut Messages) -> Result<RenderScene, Messages> {
        let RenderSceneBuilder { scene: builder, aovs, keeps_first_hits, values, earlier } = *self;
        let engine = builder.engine();
        let instance = scene.integrator();
        let mut aovs = AovPlan::new(aovs, instance.class()).map_err(Messages::one)?;
        aovs.features.first_hits |= keeps_first_hits;
        let integrator =
            Integrator::new(engine, instance, &aovs.features).map_err(Messages::one)?;
        let compiled = builder.build(scene, messages)?;
        let start = Instant::now();
        let materials = InstanceClasses::new(engine, &scene.materials);
        let textures: Vec<_> = scene.objects.iter().filter_map(|it| it.alpha.clone()).collect();
        let alpha = InstanceClasses::new(engine, &textures);
        let classes = Classes { compiled: &compiled, materials: &materials, alpha: &alpha };
        let plan = GroupPlan::new(scene, classes);
        let made = KernelMaker::build_with(engine, |maker| {
            Lights::new(maker, scene, classes, &plan.objects)
        });
        let (lights, diagnostics) = made.map_err(|errors| failed(messages, errors))?;
        messages.push(SourceMap::new(), diagnostics);
        // Paths are incoherent, so searches of hierarchies need all kernels at once.
        let is_searched_by_kernels =
            engine.llvm().is_some() && searched_objects(&classes, |_| Surface::default()).is_some();
        if !is_searched_by_kernels {
            let has_streams = compiled.geometry.suits_stream(RAYS_OF_STREAM);
            let make = |class: &ObjectClass| class.make_all(has_streams);
            on_all_processors(|| compiled.classes.par_iter().for_each(make));
        }
        let sampler = compiled.settings.sampler;
        let numbers = earlier.map(|it| &it.numbers).filter(|it| *it.sampler() == sampler).cloned();
        let shading_texts = earlier.map(|it| it.shading_texts.clone());
        let mut made = RenderScene {
            compiled,
            compile_time: Duration::ZERO,
            engine: engine.clone(),
            keys: plan.keys,
            groups: Vec::new(),
            full_groups: OnceLock::new(),
            objects: plan.objects,
            materials,
            alpha,
            lights,
            numbers: numbers.unwrap_or_else(|| Arc::new(SamplerNumbers::new(engine, sampler))),
            shading_texts: shading_texts.unwrap_or_else(|| Arc::new(ShadingTexts::new(engine))),
            integrator,
            placed_camera: None,
            shading_methods: ShadingMethods::default(),
            own_shades: ShadingMethods::default(),
            aovs,
            titles: Vec::new(),
        };
        made.warn_of_shade(messages);
        made.select_lights(messages)?;
        made.compile_integrator(scene, values, earlier, messages)?;
        made.compile_time = made.compiled.compile_time + start.elapsed();
        Ok(made)
    }
}

impl RenderScene {
    /// Prepares a scene for pictures with these AOVs. Warnings go to `messages`; `listener` is called with the next
    /// step.
    ///
    /// # Errors
    /// As for [`RenderSceneBuilder::build`].
    pub fn new(
        scene: &Scene,
        engine: &Engine,
        aovs: &[Aov],
        messages: &mut Messages,
        listener: &dyn Fn(BuildStep),
    ) -> Result<Self, Messages> {
        let builder = SceneBuilder::new(engine).listener(listener);
        RenderSceneBuilder::new(builder).aovs(aovs).build(scene, messages)
    }

    /// Finds out how much light the lights send, by which they are selected, and which of them rays cannot find.
    fn select_lights(&mut self, messages: &mut Messages) -> Result<(), Messages> {
        let errors = RuntimeErrors::default();
        let probes = probe_lights(self, &errors);
        if errors.any() {
            return Err(exhausted_budgets(&self.compiled, &errors));
        }
        self.lights.select_by(&probes);
        for class in self.lights.remove_unreachable_skies(&probes) {
            messages.push_one(unreachable_emission(&class));
        }
        Ok(())
    }

    /// Compiles the stages of the integrator, and the methods of surfaces that these are not linked with.
    fn compile_integrator(
        &mut self,
        scene: &Scene,
        values: ParameterValues,
        earlier: Option<&RenderScene>,
        messages: &mut Messages,
    ) -> Result<(), Messages> {
        let features = &self.aovs.features;
        let outputs: Vec<&str> = features.outputs().iter().map(|output| &*output.name).collect();
        let settings = &self.compiled.settings;
        let camera = self.compiled.shader(&self.compiled.camera).program.clone();
        let camera = CameraProgram::new(&camera, settings.sampler, &settings.filter);
        let camera = Arc::new(camera.map_err(Messages::one)?);
        let parts = StageParts {
            camera: &camera,
            classes: self.classes(),
            keys: &self.keys,
            objects: &self.objects,
            lights: &self.lights,
            read: ReadResults { outputs: &outputs, first_hits: features.first_hits },
            values,
            earlier: earlier.and_then(|earlier| earlier.integrator.staged.as_ref()),
        };
        let lights = stage_lights(&self.engine, scene, &parts);
        let of_methods = ShadingParts {
            scene: self,
            materials: &scene.materials,
            integrator: (self.integrator.program(), scene.integrator()),
            lights: &lights,
            values,
            defers: false,
            runs_stages: &|_| true,
        };
        let is_shaded = |key: &GroupKey| {
            self.integrator.calls_shade
                || self.integrator.asks_emission && key.is_shaded(&self.classes())
        };
        let of_surfaces = earlier.map(|earlier| &earlier.shading_methods);
        let (staged, methods) = on_all_processors(|| {
            rayon::join(
                || self.integrator.stages(&self.engine, scene, &parts, &lights),
                || ShadingMethods::new(&of_methods, is_shaded, of_surfaces),
            )
        });
        let staged = staged.map_err(Messages::one)?;
        let runs_stages = |key: &GroupKey| self.asks_own_shade(staged.as_ref(), key);
        let of_own = ShadingParts { defers: true, runs_stages: &runs_stages, ..of_methods };
        let is_asked = |_: &GroupKey| self.integrator.asks_own_shade;
        let own = earlier.map(|earlier| &earlier.own_shades);
        let own_shades = ShadingMethods::new(&of_own, is_asked, own).map_err(Messages::one)?;
        let kernel = match &staged {
            Some(staged) => staged.camera_kernel().clone(),
            None => self.engine.camera_kernel(&camera).map_err(Messages::one)?,
        };
        self.placed_camera = Some(Camera::new(camera, kernel, &self.compiled));
        self.integrator.staged = staged;
        self.shading_methods = methods.map_err(Messages::one)?;
        self.own_shades = own_shades;
        let mut queries = self.integrator.queries();
        queries.extend(self.shading_methods.queries());
        queries.extend(self.own_shades.queries());
        let made = self.make_groups(&queries);
        let (groups, diagnostics) = made.map_err(|errors| failed(messages, errors))?;
        messages.push(SourceMap::new(), diagnostics);
        self.groups = groups;
        Ok(())
    }

    /// True if a host is asked for the own colours of shaded surfaces of a group.
    fn asks_own_shade(&self, staged: Option<&StagedMethod>, key: &GroupKey) -> bool {
        let material = self.classes().material_of(key);
        match staged {
            None => false,
            Some(staged) => {
                let is_own_material = key.material.0 == MaterialSource::Own;
                staged.program.asks_own_shade_of(material, is_own_material)
            }
        }
    }

    /// Warns about materials that have only `shade`, unless the integrator calls it by itself or scatters no light.
    fn warn_of_shade(&self, messages: &mut Messages) {
        let calls_shade = self.integrator.calls_shade || self.integrator.asks_own_shade;
        if calls_shade || !self.integrator.scatters {
            return;
        }
        let classes = self.classes();
        let shaded = self.keys.iter().filter(|key| key.is_shaded(&classes));
        let names: BTreeSet<&str> =
            shaded.map(|key| classes.material_of(key).class().name.as_str()).collect();
        for class in names {
            let message =
                format!("`{class}` has only `shade`, which does not support path tracing");
            messages.push_one(Diagnostic::new(codes::SHADE_ONLY, message).note(
                "the image shows the light that `shade` computes, which may not be all of it",
            ));
        }
    }
}

/// Returns the class of the integrator of a scene that names none: the one that its settings select, or else the path
/// tracer if all surfaces support it.
pub fn integrator_of(engine: &Engine, scene: &Scene) -> &'static str {
    match scene.settings.integrator {
        Some(integrator) => integrator,
        None if has_shade(engine, scene) => WHITTED,
        None => PATH_TRACER,
    }
}

/// True if surfaces of a scene have only `shade`.
fn has_shade(engine: &Engine, scene: &Scene) -> bool {
    scene.objects.iter().any(|object| {
        let material = match is_own_material(object) {
            true => &object.primitive,
            false => &scene.materials[object.material as usize],
        };
        is_shaded(&engine.program(material))
    })
}

/// The warning about a light whose samples claim that rays that leave the scene find them, at finite distances.
fn unreachable_emission(class: &str) -> Diagnostic {
    let message = format!(
        "`emission` of the light `{class}` has no effect: its samples lie at finite distances"
    );
    Diagnostic::new(codes::UNREACHABLE_EMISSION, message)
        .note("rays that leave the scene find what is infinitely far away")
        .help("leave out `emission`, or `rt_LightDistance` if the light is behind everything")
        .help("a light that rays are to find near by is a shape with an area light")
}

fn failed(messages: &mut Messages, diagnostics: Diagnostics) -> Messages {
    messages.push(SourceMap::new(), diagnostics);
    std::mem::take(messages)
}
