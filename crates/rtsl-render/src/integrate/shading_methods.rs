//! The methods that shade surfaces: `shade` of materials, which may trace rays and sample lights one by one.

use std::collections::BTreeSet;
use std::sync::{Arc, OnceLock};

use rayon::prelude::*;
use rtsl::{
    CallMode, Diagnostic, Instance, Kernel, LinkedMethod, Method, Objects, ParameterValues,
    Program, Query, StageLights, StagedProgram, Variant,
};
use rtsl_memory::on_all_processors;

use super::staged::StagedMethod;
use super::wavefront::PathHit;
use crate::compiled::material::{MaterialSource, shading_method};
use crate::compiled::render_scene::RenderScene;
use crate::compiled::surface_group::GroupKey;
use crate::compiled::variables::variables;

/// The methods that shade the surfaces of a scene.
#[derive(Default)]
pub struct ShadingMethods {
    methods: Vec<ShadingMethod>,
    /// For each group the index of its method; `None` if its surfaces are not shaded, or black.
    of_groups: Vec<Option<usize>>,
    /// The stage that samples the lights that methods name; `None` if hosts do, or no method names any.
    lights: Option<Box<StagedMethod>>,
}

/// The method that shades surfaces of one class of materials.
pub struct ShadingMethod {
    /// The class.
    pub program: Arc<Program>,
    /// [`Method::Shade`], or [`Method::Emission`] of materials that only emit.
    pub method: Method,
    /// True if it defers light.
    pub defers: bool,
    /// True if it adds the light of lights to the radiance of the path that asks for its colour, instead of the colour.
    pub adds_to_path: bool,
    /// The source of its instances.
    source: Source,
    /// The instances.
    pub objects: Arc<Objects>,
    /// The stages; `None` for engines without machine code.
    staged: Option<Box<StagedMethod>>,
    /// The whole method on the interpreter, once it is called.
    interpreted: OnceLock<Kernel>,
}

/// The parts of a scene from which the methods are made.
pub struct ShadingParts<'a> {
    pub scene: &'a RenderScene,
    pub materials: &'a [Arc<Instance>],
    /// The integrator.
    pub integrator: (&'a Arc<Program>, &'a Instance),
    /// The lights that methods name by their indices.
    pub lights: &'a StageLights<'a>,
    pub values: ParameterValues,
    /// True for methods that [defer](rtsl::Program::deferring_method) light.
    pub defers: bool,
    /// True for groups whose methods run as stages, if there is packet code. The others are called by the interpreter
    /// only, for samples that are evaluated again.
    pub runs_stages: &'a (dyn Fn(&GroupKey) -> bool + Sync),
}

/// The source of a method's instances: shapes of a traversal class that are their own materials, or materials.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum Source {
    Shapes(u32),
    Materials(MaterialSource),
}

impl Source {
    fn of(key: &GroupKey) -> Source {
        match key.material.0 {
            MaterialSource::Own => Source::Shapes(key.class),
            class => Source::Materials(class),
        }
    }
}

impl ShadingMethods {
    /// Compiles the methods of the groups for which `is_shaded` holds. Code of `earlier` methods is used again if it
    /// serves.
    ///
    /// # Errors
    /// If linking, splitting or code generation fails.
    pub fn new(
        parts: &ShadingParts<'_>,
        is_shaded: impl Fn(&GroupKey) -> bool,
        earlier: Option<&ShadingMethods>,
    ) -> Result<ShadingMethods, Diagnostic> {
        let scene = parts.scene;
        let mut wanted: Vec<(Source, Method, &Arc<Program>, bool)> = Vec::new();
        let of_groups = scene.keys.iter().map(|key| {
            let source = Source::of(key);
            let program = scene.classes().material_of(key);
            let method = shading_method(program).filter(|_| is_shaded(key))?;
            let known = wanted.iter().position(|(other, ..)| *other == source);
            Some(known.unwrap_or_else(|| {
                wanted.push((source, method, program, (parts.runs_stages)(key)));
                wanted.len() - 1
            }))
        });
        let of_groups = of_groups.collect();
        let methods = wanted.par_iter().map(|(source, method, program, runs_stages)| {
            let earlier = earlier.and_then(|it| it.like(program, *method));
            ShadingMethod::new(parts, program, *source, *method, *runs_stages, earlier)
        });
        let methods = on_all_processors(|| methods.collect::<Result<Vec<_>, _>>())?;
        let mut made = ShadingMethods { methods, of_groups, lights: None };
        if made.staged().any(StagedMethod::samples_lights) {
            made.lights = light_stage(parts, earlier)?.map(Box::new);
        }
        Ok(made)
    }

    /// Returns the index of the method that shades surfaces of a group.
    pub fn of_group(&self, group: u32) -> Option<usize> {
        self.of_groups.get(group as usize).copied().flatten()
    }

    /// Returns a method by its index.
    pub fn method(&self, index: usize) -> &ShadingMethod {
        &self.methods[index]
    }

    /// Returns the stage that samples lights for paths that wait for that; `None` if hosts do.
    pub fn lights(&self) -> Option<&StagedMethod> {
        self.lights.as_deref()
    }

    /// All stages.
    pub fn stages(&self) -> impl Iterator<Item = &StagedMethod> {
        self.staged().chain(self.lights())
    }

    /// The queries about surfaces that a host answers for the stages, or before them; on the interpreter it answers all.
    pub fn queries(&self) -> BTreeSet<Query> {
        self.staged().flat_map(|staged| staged.queries().iter().copied()).collect()
    }

    fn staged(&self) -> impl Iterator<Item = &StagedMethod> {
        self.methods.iter().filter_map(ShadingMethod::staged)
    }

    fn like(&self, program: &Arc<Program>, method: Method) -> Option<&StagedMethod> {
        let mut methods = self.methods.iter();
        let is_same =
            |it: &&ShadingMethod| Arc::ptr_eq(&it.program, program) && it.method == method;
        methods.find(is_same)?.staged()
    }
}

/// Returns a method that shades surfaces, which may defer light.
fn shading(
    program: &Program,
    method: Method,
    defers: bool,
) -> Result<Arc<LinkedMethod>, Diagnostic> {
    match (method, defers) {
        (Method::Shade, true) => program.deferring_method(method),
        _ => program.method(method),
    }
}

/// Compiles the stage that samples lights; `None` if their methods need a host.
fn light_stage(
    parts: &ShadingParts<'_>,
    earlier: Option<&ShadingMethods>,
) -> Result<Option<StagedMethod>, Diagnostic> {
    let ShadingParts { scene, integrator: (program, integrator), lights, values, .. } = *parts;
    let sampler = scene.compiled.settings.sampler;
    let staged = StagedProgram::of_lights(program, sampler, lights, values);
    let compile = |staged: StagedProgram| {
        let objects = Arc::new(staged.objects(integrator, None, []));
        let earlier = earlier.and_then(ShadingMethods::lights);
        StagedMethod::without_surfaces(&scene.engine, staged, objects, earlier)
    };
    staged.map(compile).transpose()
}

impl ShadingMethod {
    fn new(
        parts: &ShadingParts<'_>,
        program: &Arc<Program>,
        source: Source,
        method: Method,
        runs_stages: bool,
        earlier: Option<&StagedMethod>,
    ) -> Result<ShadingMethod, Diagnostic> {
        let ShadingParts { scene, materials, values, defers, .. } = *parts;
        let linked = shading(program, method, defers)?;
        let adds_to_path = defers && !rtsl::waits(&linked.function);
        let own = match source {
            Source::Shapes(class) => Some(scene.compiled.class(class).objects.clone()),
            Source::Materials(_) => None,
        };
        let instances = (0..).zip(materials).filter_map(|(index, material)| {
            let (class, _) = scene.materials.place(index);
            (source == Source::Materials(MaterialSource::Class(class))).then_some(&**material)
        });
        let instances: Vec<&Instance> = instances.collect();
        let differing = || Arc::new(program.differing_objects(instances.iter().copied()));
        let objects = own.clone().unwrap_or_else(differing);
        let made = |staged: Option<StagedMethod>| ShadingMethod {
            program: program.clone(),
            method,
            defers,
            adds_to_path,
            source,
            objects: objects.clone(),
            staged: staged.map(Box::new),
            interpreted: OnceLock::new(),
        };
        if !scene.engine.runs_packets() {
            let made = made(None);
            made.interpreted()?;
            return Ok(made);
        }
        if !runs_stages {
            return Ok(made(None));
        }
        let sampler = scene.compiled.settings.sampler;
        let staged = StagedProgram::of_material(program, (method, defers), sampler, values)?;
        let objects = own.unwrap_or_else(|| Arc::new(staged.materials(instances.iter().copied())));
        let staged = StagedMethod::without_surfaces(&scene.engine, staged, objects, earlier)?;
        Ok(made(Some(staged)))
    }

    /// Returns the stages, if there is packet code.
    pub fn staged(&self) -> Option<&StagedMethod> {
        self.staged.as_deref()
    }

    /// Returns the whole method on the interpreter, called for [`Self::objects`].
    ///
    /// # Errors
    /// If linking passes a limit.
    pub fn interpreted(&self) -> Result<&Kernel, Diagnostic> {
        if let Some(kernel) = self.interpreted.get() {
            return Ok(kernel);
        }
        let variant = Variant::new(CallMode::Stream).of_objects(self.objects.form().clone());
        let kernel = match (self.method, self.defers) {
            (Method::Shade, true) => {
                self.program.interpreted_deferring_kernel(self.method, variant)?
            }
            _ => self.program.interpreted_kernel(self.method, variant)?,
        };
        Ok(self.interpreted.get_or_init(|| kernel))
    }

    /// The first component of state with the colour.
    pub fn color(&self) -> usize {
        match self.method {
            Method::Shade => variables().sample_color,
            _ => variables().emission_color,
        }
    }

    /// True if it reads scratch of the shape's `intersect`.
    pub fn shares_scratch(&self) -> bool {
        matches!(self.source, Source::Shapes(_))
    }

    /// Returns the index among the instances of that which shades a surface.
    pub fn object_of(&self, scene: &RenderScene, hit: &PathHit) -> u32 {
        match self.source {
            Source::Shapes(class) => {
                scene.compiled.class(class).index_of(hit.object, hit.element).unwrap_or(0)
            }
            Source::Materials(_) => scene.objects[hit.object as usize].material,
        }
    }
}
