//! The methods that shade surfaces: `shade` of materials, which may trace rays and sample lights one by one.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

use rtsl::{
    CallMode, Diagnostic, Instance, Kernel, Method, Objects, ParameterValues, Program, Query,
    StagedProgram, Variant,
};

use super::integrator::StagedMethod;
use super::material::{MaterialSource, shading_method};
use super::scene::BatchScene;
use super::surface_group::GroupKey;
use super::wavefront::PathHit;
use crate::compiled::variables::variables;

/// The methods that shade the surfaces of a scene.
#[derive(Default)]
pub struct ShadingMethods {
    methods: Vec<ShadingMethod>,
    /// For each group the index of its method; `None` if its surfaces are not shaded, or black.
    of_groups: Vec<Option<usize>>,
}

/// The method that shades surfaces of one class of materials.
pub struct ShadingMethod {
    /// The class.
    pub program: Arc<Program>,
    /// [`Method::Shade`], or [`Method::Emission`] of materials that only emit.
    pub method: Method,
    /// The source of its instances.
    source: Source,
    /// The instances.
    pub objects: Arc<Objects>,
    /// The code for a host that the interpreter asks.
    pub code: ShadingCode,
}

/// The code of a method that shades.
pub enum ShadingCode {
    /// The stages.
    Staged(Box<StagedMethod>),
    /// The whole method on the interpreter, for engines without machine code.
    Interpreted(Kernel),
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
    /// Compiles the methods of the groups for which `is_shaded` holds.
    ///
    /// # Errors
    /// If linking, splitting or code generation fails.
    pub fn new(
        scene: &BatchScene,
        materials: &[Arc<Instance>],
        is_shaded: impl Fn(&GroupKey) -> bool,
        (values, earlier): (ParameterValues, Option<&ShadingMethods>),
    ) -> Result<ShadingMethods, Diagnostic> {
        let mut made = ShadingMethods::default();
        let mut indices: BTreeMap<Source, Option<usize>> = BTreeMap::new();
        for key in &scene.keys {
            let source = Source::of(key);
            let index = match indices.get(&source) {
                _ if !is_shaded(key) => None,
                Some(index) => *index,
                None => {
                    let program = scene.classes().material_of(key);
                    let method = shading_method(program).map(|method| {
                        let earlier = earlier.and_then(|it| it.like(program, method));
                        let place = (source, method);
                        ShadingMethod::new(scene, materials, program, place, (values, earlier))
                    });
                    let index = method.is_some().then_some(made.methods.len());
                    made.methods.extend(method.transpose()?);
                    indices.insert(source, index);
                    index
                }
            };
            made.of_groups.push(index);
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

    /// The greatest number of scratch arrays of the stages.
    pub fn stage_arrays(&self) -> usize {
        let arrays = self.methods.iter().filter_map(ShadingMethod::staged);
        arrays.map(|staged| staged.program.scratch_arrays()).max().unwrap_or(0)
    }

    /// The queries about surfaces that a host answers for the stages, or before them; on the interpreter it answers all.
    pub fn queries(&self) -> BTreeSet<Query> {
        let methods = self.methods.iter().filter_map(ShadingMethod::staged);
        methods.flat_map(|staged| staged.queries().iter().copied()).collect()
    }

    /// The addresses of the code.
    #[cfg(test)]
    pub fn code(&self) -> impl Iterator<Item = *const Kernel> + '_ {
        self.methods.iter().filter_map(ShadingMethod::staged).flat_map(StagedMethod::code)
    }

    fn like(&self, program: &Arc<Program>, method: Method) -> Option<&StagedMethod> {
        let mut methods = self.methods.iter();
        let is_same =
            |it: &&ShadingMethod| Arc::ptr_eq(&it.program, program) && it.method == method;
        methods.find(is_same)?.staged()
    }
}

impl ShadingMethod {
    fn new(
        scene: &BatchScene,
        materials: &[Arc<Instance>],
        program: &Arc<Program>,
        (source, method): (Source, Method),
        (values, earlier): (ParameterValues, Option<&StagedMethod>),
    ) -> Result<ShadingMethod, Diagnostic> {
        let made = |objects: Arc<Objects>, code: ShadingCode| ShadingMethod {
            program: program.clone(),
            method,
            source,
            objects,
            code,
        };
        let own = match source {
            Source::Shapes(class) => Some(scene.compiled.class(class).objects.clone()),
            Source::Materials(_) => None,
        };
        let instances = (0..).zip(materials).filter_map(|(index, material)| {
            let (class, _) = scene.materials.place(index);
            (source == Source::Materials(MaterialSource::Class(class))).then_some(&**material)
        });
        if scene.engine.llvm().is_none() {
            let objects = own.unwrap_or_else(|| Arc::new(program.differing_objects(instances)));
            let variant = Variant::new(CallMode::Stream).of_objects(objects.form().clone());
            let kernel = program.interpreted_kernel(method, variant)?;
            return Ok(made(objects, ShadingCode::Interpreted(kernel)));
        }
        let sampler = scene.compiled.settings.sampler;
        let staged = StagedProgram::of_material(program, method, sampler, values)?;
        let objects = own.unwrap_or_else(|| Arc::new(staged.materials(instances)));
        let staged = StagedMethod::of_materials(&scene.engine, staged, objects.clone(), earlier)?;
        Ok(made(objects, ShadingCode::Staged(Box::new(staged))))
    }

    /// Returns the stages, if there is machine code.
    pub fn staged(&self) -> Option<&StagedMethod> {
        match &self.code {
            ShadingCode::Staged(staged) => Some(staged),
            ShadingCode::Interpreted(_) => None,
        }
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
    pub fn object_of(&self, scene: &BatchScene, hit: &PathHit) -> u32 {
        match self.source {
            Source::Shapes(class) => {
                scene.compiled.class(class).index_of(hit.object, hit.element).unwrap_or(0)
            }
            Source::Materials(_) => scene.objects[hit.object as usize].material,
        }
    }
}
