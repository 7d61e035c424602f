//! Preparation of a scene for rendering: kernels are compiled, bounds computed, trees built.

use std::sync::Arc;
use std::time::{Duration, Instant};

use rayon::prelude::*;
use rtsl::{Diagnostic, Diagnostics, Engine, Messages, SourceMap};
use rtsl_bvh::{Bounds, Geometry};
use rtsl_math::Transform;
use rtsl_memory::on_all_processors;
use rtsl_scene::{PlacedLight, Scene, SceneObject};

use super::bounds::{BoundsMaker, element_bounds};
use super::compiled_scene::CompiledScene;
use super::extents::Extents;
use super::light::Light;
use super::object::Object;
use super::placed_objects::{GroupItems, PlacedObjects};
use super::placement::inverse;
use super::shaders::{Shader, ShaderTable};

/// A step of preparing a scene.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum BuildStep {
    /// Compiling kernels.
    Kernels {
        /// The number of shaders.
        shaders: usize,
    },
    /// Computing bounds and building the acceleration structure.
    Hierarchy,
}

/// Prepares scenes for rendering.
#[derive(Clone, Copy)]
pub struct SceneBuilder<'a> {
    engine: &'a Engine,
    shapes: Shapes<'a>,
    listener: &'a dyn Fn(BuildStep),
}

impl<'a> SceneBuilder<'a> {
    /// Creates a builder that compiles kernels by `engine` and reuses nothing.
    pub fn new(engine: &'a Engine) -> Self {
        SceneBuilder { engine, shapes: Shapes::New, listener: &|_| {} }
    }

    /// Calls `listener` with each step when it begins.
    #[must_use]
    pub fn listener(self, listener: &'a dyn Fn(BuildStep)) -> Self {
        SceneBuilder { listener, ..self }
    }

    /// Reuses the acceleration structure of a scene whose shapes and placements
    /// [are the same](Scene::has_same_shapes).
    #[must_use]
    pub fn same_shapes(self, earlier: &'a CompiledScene) -> Self {
        SceneBuilder { shapes: Shapes::Same(earlier), ..self }
    }

    /// Refits the trees of a scene that may be an earlier state, if shapes only moved or changed their parameters since.
    #[must_use]
    pub fn moved_shapes(self, earlier: &'a CompiledScene) -> Self {
        SceneBuilder { shapes: Shapes::Moved(earlier), ..self }
    }

    /// Returns the engine.
    pub(crate) fn engine(&self) -> &'a Engine {
        self.engine
    }

    /// Makes the kernels that searches of a scene need, and builds its acceleration structure. Warnings go to `messages`.
    ///
    /// # Errors
    /// If a class lacks a method that its use needs, or a kernel cannot be compiled.
    pub fn build(&self, scene: &Scene, messages: &mut Messages) -> Result<CompiledScene, Messages> {
        let SceneBuilder { engine, shapes, listener } = *self;
        let start = Instant::now();
        let shaders = ShaderTable::new(engine, scene);
        listener(BuildStep::Kernels { shaders: shaders.len() });
        let mut diagnostics = Diagnostics::new();
        let shaders_done = shaders.compile(&mut diagnostics);
        let failed = diagnostics.has_errors();
        messages.push(SourceMap::new(), diagnostics);
        if failed {
            return Err(std::mem::take(messages));
        }
        let compile_time = start.elapsed();
        listener(BuildStep::Hierarchy);
        let start = Instant::now();
        let compiled = Assembly { table: &shaders, shaders: &shaders_done }.scene(scene, &shapes);
        let mut compiled = compiled.map_err(|problem| {
            messages.push_one(problem);
            std::mem::take(messages)
        })?;
        compiled.shaders = shaders_done;
        compiled.compile_time = compile_time;
        compiled.build_time = start.elapsed();
        Ok(compiled)
    }
}

/// The parts of an earlier scene that can be reused.
#[derive(Clone, Copy)]
enum Shapes<'a> {
    /// None.
    New,
    /// The shapes are those of this scene, at the same places.
    Same(&'a CompiledScene),
    /// The shapes may be those of this scene, at other places.
    Moved(&'a CompiledScene),
}

impl Shapes<'_> {
    /// The geometry to be refitted.
    fn earlier(&self) -> Option<(&Geometry, &[GroupItems])> {
        match self {
            Shapes::New | Shapes::Same(_) => None,
            Shapes::Moved(earlier) => Some((&earlier.geometry, &earlier.items)),
        }
    }
}

/// The parts of a scene that its instances and objects are made of.
struct Assembly<'a> {
    table: &'a ShaderTable<'a>,
    shaders: &'a [Shader],
}

impl Assembly<'_> {
    /// Returns the scene without its shaders and times.
    fn scene(&self, scene: &Scene, shapes: &Shapes<'_>) -> Result<CompiledScene, Diagnostic> {
        let objects: Vec<Object> = scene.objects.iter().map(|it| self.object(it)).collect();
        let placed = PlacedObjects::new(scene, &objects, self.shaders);
        let (geometry, extents) = match shapes {
            Shapes::Same(earlier) => (earlier.geometry.clone(), earlier.extents.clone()),
            Shapes::New | Shapes::Moved(_) => std::thread::scope(|scope| {
                // Kernels are compiled while the trees are built.
                scope.spawn(|| placed.prepare_classes(scene, &objects, self.shaders));
                let bounds = self.bounds(scene)?;
                let extents = Arc::new(Extents::new(&bounds));
                let geometry = placed.geometry(scene, bounds, shapes.earlier());
                Ok((Arc::new(geometry), extents))
            })?,
        };
        let classes = placed.classes(&geometry, scene, &objects, self.shaders)?;
        let instances = placed.instances(scene).map(|it| Transform::from(it.transform).affine());
        let instance_transforms = instances.collect();
        let PlacedObjects { groups: items, .. } = placed;
        let scratch = self.shaders.iter().map(|it| it.program.layout().scratch_arrays as usize);
        Ok(CompiledScene {
            epsilon: scene.settings.epsilon.unwrap_or(0.0),
            extents,
            settings: scene.settings.clone(),
            shaders: Vec::new(),
            camera: self.table.instance(&scene.camera),
            camera_to_world: scene.camera_to_world.affine(),
            camera_motion: scene.camera_motion.clone(),
            lights: scene.lights.iter().map(placed_light).collect(),
            ambient: scene.ambient,
            objects,
            geometry,
            items,
            classes,
            instance_transforms,
            scratch_arrays: scratch.max().unwrap_or(0),
            width: self.table.engine().width(),
            is_traced: self.table.engine().options().trace.is_some(),
            compile_time: Duration::ZERO,
            build_time: Duration::ZERO,
        })
    }

    fn object(&self, object: &SceneObject) -> Object {
        let forward = object.fixed_transform().affine();
        let inverse = inverse(object.fixed_transform());
        Object {
            primitive: self.table.instance(&object.primitive),
            forward,
            inverse,
            sizes: forward.of_sizes().after(&inverse.of_sizes()),
            volume_scale: object.fixed_transform().volume_scale() as f32,
            reverse_orientation: object.reverse_orientation,
        }
    }

    /// The bounds of all objects, or of their elements, in the spaces of their groups; `None` for unbounded ones.
    fn bounds(&self, scene: &Scene) -> Result<Vec<Vec<Option<Bounds>>>, Diagnostic> {
        let mut maker = BoundsMaker::default();
        let bounds = scene.objects.iter().map(|object| {
            let instance = self.table.instance(&object.primitive);
            let shader = &self.shaders[instance.shader];
            let placed =
                |own: Option<Bounds>| own.and_then(|own| own.transformed(object.fixed_transform()));
            Ok(match object.elements {
                Some(count) => {
                    let own = element_bounds(&shader.program, &object.primitive, count)?;
                    on_all_processors(|| own.into_par_iter().map(placed).collect())
                }
                None => vec![placed(maker.bounds(shader, &instance))],
            })
        });
        bounds.collect()
    }
}

fn placed_light(light: &PlacedLight) -> Light {
    Light { forward: light.transform.affine(), inverse: inverse(light.transform) }
}
