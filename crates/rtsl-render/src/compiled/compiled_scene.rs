//! A scene with kernels for its shaders and an acceleration structure over its objects.

use std::sync::Arc;
use std::time::{Duration, Instant};

use rayon::prelude::*;
use rtsl::{
    Diagnostic, Diagnostics, Engine, Instance, InstanceBlock, Messages, Method, SourceMap,
    diagnostic_codes as codes,
};
use rtsl_bvh::{Bounds, Geometry, HitId};
use rtsl_math::{Affine, MovingTransform, Transform};
use rtsl_scene::{Scene, SceneObject, Settings};

use super::area_light::{AreaLight, MAX_SAMPLED_ELEMENTS};
use super::bounds::{BoundsMaker, element_bounds};
use super::extents::Extents;
use super::object_class::ObjectClass;
use super::placed_objects::{GroupItems, GroupMember, PlacedObjects};
use super::placement::Placement;
use super::shaders::{Purpose, Shader, ShaderTable, SurfaceNeeds, is_own_material};
use super::specialisation::{Specialisation, Specialised};

/// An instance prepared for the kernels of its shader.
pub struct ShaderInstance {
    /// The index of its shader.
    pub shader: usize,
    /// Its members.
    pub block: Arc<InstanceBlock>,
    /// The kernels specialised for its values.
    pub specialised: Specialised,
}

/// An object.
pub struct Object {
    /// Its shape.
    pub primitive: ShaderInstance,
    /// The transform from its own space to its group's. A moving object is placed by a moving instance of a group to
    /// itself.
    pub forward: Affine,
    /// The transform from its group's space to its own.
    pub inverse: Affine,
    /// The map of magnitudes for error bounds, from its group's space through its own and back.
    pub sizes: Affine,
    /// The factor by which volumes are scaled from its own space to its group's; positive.
    pub volume_scale: f32,
    /// The index of its material; `None` if the shape is its own material.
    pub material: Option<u32>,
    /// The index of the material whose emission it gives off besides.
    pub emitter: Option<u32>,
    /// True if its normals are flipped.
    pub reverse_orientation: bool,
}

/// A light.
pub struct Light {
    /// The light.
    pub instance: ShaderInstance,
    /// The transform from its own space to the world's.
    pub forward: Affine,
    /// The transform from the world's space to its own.
    pub inverse: Affine,
}

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

/// A scene prepared for rendering.
pub struct CompiledScene {
    /// Film, sampler and integrator.
    pub settings: Settings,
    /// All shaders.
    pub shaders: Vec<Shader>,
    /// The camera.
    pub camera: ShaderInstance,
    /// The transform from the camera's space to the world's; of a moving camera, at shutter open.
    pub camera_to_world: Affine,
    /// The same over the shutter interval, if it moves.
    pub camera_motion: Option<Arc<MovingTransform>>,
    /// The materials.
    pub materials: Vec<ShaderInstance>,
    /// The lights.
    pub lights: Vec<Light>,
    /// The area lights; their light indices come after those of `lights`.
    pub area_lights: Vec<AreaLight>,
    /// The value of `ambient()`.
    pub ambient: [f32; 3],
    /// The objects.
    pub objects: Vec<Object>,
    /// The acceleration structure. It depends on the bounds of shapes but not on their kernels, so that scenes with the
    /// same shapes can share it.
    pub geometry: Arc<Geometry>,
    /// The objects of the items in the geometry's groups.
    pub items: Vec<GroupItems>,
    /// The classes of the leaves of the geometry's trees.
    pub classes: Vec<ObjectClass>,
    /// The transforms from a group's space to the world's, for the instances of the geometry; of moving instances, at
    /// shutter open.
    pub instance_transforms: Vec<Affine>,
    /// The extents of its objects' bounding boxes.
    pub extents: Arc<Extents>,
    /// The value of `camera_epsilon` if the scene's settings do not set it.
    usual_camera_epsilon: f32,
    /// The least distance of hits of all rays but camera rays. Their origins are offset from surfaces, so it is 0
    /// unless the scene sets it.
    pub epsilon: f32,
    /// The greatest number of scratch arrays of a shader.
    pub scratch_arrays: usize,
    /// The SIMD width of the kernels in lanes.
    pub width: u32,
    /// The time for compiling kernels.
    pub compile_time: Duration,
    /// The time for bounds and the acceleration structure.
    pub build_time: Duration,
    /// Compiles kernels specialised for the scene's values; dropped last.
    pub specialisation: Specialisation,
}

impl CompiledScene {
    /// Makes kernels for a scene and builds its acceleration structure. Warnings go to `messages`.
    ///
    /// # Errors
    /// If a class lacks a method that its use needs, or a kernel cannot be compiled.
    pub fn new(scene: Scene, engine: &Engine, messages: &mut Messages) -> Result<Self, Messages> {
        Self::with_progress(scene, engine, messages, &|_| {})
    }

    /// Like [`CompiledScene::new`]; calls `listener` with the next step.
    ///
    /// # Errors
    /// As for [`CompiledScene::new`].
    pub fn with_progress(
        scene: Scene,
        engine: &Engine,
        messages: &mut Messages,
        listener: &dyn Fn(BuildStep),
    ) -> Result<Self, Messages> {
        Self::with_shapes(&Shapes::New, Purpose::Shading, scene, engine, messages, listener)
    }

    /// Like [`CompiledScene::with_progress`], with only the kernels that searches need.
    ///
    /// # Errors
    /// As for [`CompiledScene::new`].
    pub(crate) fn for_searches(
        scene: Scene,
        engine: &Engine,
        messages: &mut Messages,
        listener: &dyn Fn(BuildStep),
    ) -> Result<Self, Messages> {
        Self::with_shapes(&Shapes::New, Purpose::Searching, scene, engine, messages, listener)
    }

    /// Like [`CompiledScene::new`], for a scene whose shapes and placements
    /// [are the same](Scene::has_same_shapes) as those of this one: the acceleration structure is kept.
    ///
    /// # Errors
    /// As for [`CompiledScene::new`].
    pub fn with_other_shaders(
        &self,
        scene: Scene,
        engine: &Engine,
        messages: &mut Messages,
    ) -> Result<Self, Messages> {
        Self::with_shapes(&Shapes::Same(self), Purpose::Shading, scene, engine, messages, &|_| {})
    }

    /// Like [`CompiledScene::new`], for a scene of which this may be an earlier state: if shapes only moved, or changed
    /// their parameters, the trees are refitted.
    ///
    /// # Errors
    /// As for [`CompiledScene::new`].
    pub fn with_moved_shapes(
        &self,
        scene: Scene,
        engine: &Engine,
        messages: &mut Messages,
    ) -> Result<Self, Messages> {
        Self::with_shapes(&Shapes::Moved(self), Purpose::Shading, scene, engine, messages, &|_| {})
    }

    /// Replaces the values of the instances in which `scene` differs from `earlier`, from which this was compiled.
    /// Nothing is compiled. Returns false without any effect if that does not suffice, because a shape or the class of
    /// an instance changed.
    pub fn replace_values(&mut self, earlier: &Scene, scene: &Scene, engine: &Engine) -> bool {
        if !scene.has_same_shapes(earlier) || scene.ambient != earlier.ambient {
            return false;
        }
        let before = earlier.shading_instances();
        let changed = before.zip(scene.shading_instances()).zip(self.shading_instances());
        let changed =
            changed.enumerate().filter(|(_, ((before, now), _))| !Arc::ptr_eq(before, now));
        let mut blocks = Vec::new();
        for (index, ((_, now), placed)) in changed {
            let program = engine.program(now);
            if !Arc::ptr_eq(&program, &self.shader(placed).program) {
                return false;
            }
            blocks.push((index, program.block(now)));
        }
        for (index, block) in blocks {
            if let Some(placed) = self.shading_instances_mut().nth(index) {
                placed.block = Arc::new(block);
                placed.specialised = Specialised::default();
            }
        }
        true
    }

    /// The camera, the materials and the lights, in the order of [`Scene::shading_instances`].
    fn shading_instances(&self) -> impl Iterator<Item = &ShaderInstance> {
        let lights = self.lights.iter().map(|light| &light.instance);
        [&self.camera].into_iter().chain(&self.materials).chain(lights)
    }

    fn shading_instances_mut(&mut self) -> impl Iterator<Item = &mut ShaderInstance> {
        let lights = self.lights.iter_mut().map(|light| &mut light.instance);
        [&mut self.camera].into_iter().chain(&mut self.materials).chain(lights)
    }

    fn with_shapes(
        shapes: &Shapes<'_>,
        purpose: Purpose,
        scene: Scene,
        engine: &Engine,
        messages: &mut Messages,
        listener: &dyn Fn(BuildStep),
    ) -> Result<Self, Messages> {
        if purpose == Purpose::Shading && scene.objects.iter().any(|object| object.alpha.is_some())
        {
            let message = "alpha has no effect on the interactive renderer: surfaces are opaque";
            messages.push_one(Diagnostic::new(codes::IGNORED_SETTING, message));
        }
        let start = Instant::now();
        let shaders = ShaderTable::new(engine, &scene, purpose);
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
        let compiled = Builder { table: &shaders, shaders: &shaders_done }.build(scene, shapes);
        let mut compiled = compiled.map_err(|problem| {
            messages.push_one(problem);
            std::mem::take(messages)
        })?;
        compiled.shaders = shaders_done;
        compiled.compile_time = compile_time;
        compiled.build_time = start.elapsed();
        Ok(compiled)
    }

    /// Returns the least distance of a camera ray's hit, unless the camera sets another.
    pub fn camera_epsilon(&self) -> f32 {
        self.settings.epsilon.unwrap_or(self.usual_camera_epsilon)
    }

    /// Returns the shader of an instance.
    pub fn shader(&self, instance: &ShaderInstance) -> &Shader {
        &self.shaders[instance.shader]
    }

    /// Returns the placement of an instance of the geometry.
    pub fn placement(&self, instance: u32) -> Option<Placement<'_>> {
        let forward = *self.instance_transforms.get(instance as usize)?;
        Some(Placement::new(self.geometry.instances.get(instance as usize)?, forward))
    }

    /// Returns the surface properties that the material of an object, its emitter and its own methods read.
    pub fn needs(&self, object: &Object) -> SurfaceNeeds {
        let own = object.material.is_none().then_some(object.primitive.shader);
        let others = [object.material, object.emitter].into_iter().flatten();
        let others = others.map(|material| self.materials[material as usize].shader);
        let needs = own.into_iter().chain(others).map(|it| self.shaders[it].surface_needs());
        let shape = &self.shaders[object.primitive.shader];
        let own = SurfaceNeeds {
            inverse_directions: shape.reads_inverse_directions,
            ..SurfaceNeeds::default()
        };
        needs.fold(own, SurfaceNeeds::union)
    }
}

/// The parts of an earlier scene that can be reused.
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

struct Builder<'a> {
    table: &'a ShaderTable<'a>,
    shaders: &'a [Shader],
}

impl Builder<'_> {
    fn build(&self, scene: Scene, shapes: &Shapes<'_>) -> Result<CompiledScene, Diagnostic> {
        let objects: Vec<Object> = scene.objects.iter().map(|it| self.object(it)).collect();
        let placed = PlacedObjects::new(&scene, &objects);
        let (geometry, extents, usual_camera_epsilon) = match shapes {
            Shapes::Same(earlier) => {
                (earlier.geometry.clone(), earlier.extents.clone(), earlier.usual_camera_epsilon)
            }
            Shapes::New | Shapes::Moved(_) => std::thread::scope(|scope| {
                // Kernels are compiled while the trees are built.
                scope.spawn(|| placed.prepare_classes(&scene, &objects, self.shaders));
                let bounds = self.bounds(&scene)?;
                let camera_epsilon = usual_camera_epsilon(&scene.objects, &bounds);
                let extents = Arc::new(Extents::new(&bounds));
                let geometry = placed.geometry(&bounds, shapes.earlier());
                Ok((Arc::new(geometry), extents, camera_epsilon))
            })?,
        };
        let classes = placed.classes(&geometry, &scene, &objects, self.shaders)?;
        let PlacedObjects { groups: items, instances, .. } = placed;
        let scratch = self.shaders.iter().map(|it| it.program.layout().scratch_arrays as usize);
        let area_lights = self.area_lights(&scene, &items);
        Ok(CompiledScene {
            usual_camera_epsilon,
            epsilon: scene.settings.epsilon.unwrap_or(0.0),
            extents,
            settings: scene.settings.clone(),
            shaders: Vec::new(),
            camera: self.table.instance(&scene.camera),
            camera_to_world: scene.camera_to_world.affine(),
            camera_motion: scene.camera_motion.clone(),
            materials: scene.materials.iter().map(|it| self.table.instance(it)).collect(),
            lights: scene.lights.iter().map(|light| self.light(light)).collect(),
            area_lights,
            ambient: scene.ambient,
            objects,
            geometry,
            items,
            classes,
            instance_transforms: instances.iter().map(|it| it.transform.affine()).collect(),
            scratch_arrays: scratch.max().unwrap_or(0),
            width: self.table.engine().width(),
            compile_time: Duration::ZERO,
            build_time: Duration::ZERO,
            specialisation: self.specialisation(&scene),
        })
    }

    fn specialisation(&self, scene: &Scene) -> Specialisation {
        let lights = scene.lights.iter().map(|light| &light.light);
        let instances = [&scene.camera].into_iter().chain(lights).chain(&scene.materials);
        Specialisation::new(self.table.engine(), instances.cloned().collect())
    }

    fn light(&self, light: &rtsl_scene::PlacedLight) -> Light {
        Light {
            instance: self.table.instance(&light.light),
            forward: light.transform.affine(),
            inverse: inverse(light.transform),
        }
    }

    /// The area lights of the world.
    fn area_lights(&self, scene: &Scene, items: &[GroupItems]) -> Vec<AreaLight> {
        let has = |instance: &Instance, method: Method| {
            let shader = self.table.instance(instance).shader;
            self.shaders[shader].kernel(method).is_some()
        };
        let mut lights = Vec::new();
        let world = items.first().into_iter().flat_map(GroupItems::members);
        let world = world.map(|member| (*member, None));
        for (member, instance) in world.chain(moving_members(scene, items)) {
            let object = &scene.objects[member.object as usize];
            let Some(emitter) = object.emitter else { continue };
            let sampled = has(&object.primitive, Method::GenerateSample)
                && has(&scene.materials[emitter as usize], Method::Emission)
                && object.elements.is_none_or(|count| count <= MAX_SAMPLED_ELEMENTS);
            let volume_scale = object.fixed_transform().volume_scale();
            let id = |item: u32| match instance {
                None => HitId::new(item, 0),
                Some(instance) => HitId::new(items[0].count() + instance, item),
            };
            let primitives = if sampled { self.table.items(object) } else { Vec::new() };
            lights.extend((member.first..).zip(primitives).map(|(item, primitive)| AreaLight {
                id: id(item),
                instance,
                object: member.object,
                primitive,
                emitter,
                volume_scale,
            }));
        }
        lights
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
            material: (!is_own_material(object)).then_some(object.material),
            emitter: object.emitter,
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
                    own.into_par_iter().map(placed).collect()
                }
                None => vec![placed(maker.bounds(shader, &instance))],
            })
        });
        bounds.collect()
    }
}

/// The moving objects of the world, with the instances that place them.
fn moving_members<'a>(
    scene: &'a Scene,
    items: &'a [GroupItems],
) -> impl Iterator<Item = (GroupMember, Option<u32>)> {
    let moves = |object: &&u32| scene.objects[**object as usize].motion.is_some();
    let moving = scene.world.iter().filter(moves).count();
    // Their groups come after those of the scene, their instances after the scene's.
    let groups = items.iter().skip(1 + scene.groups.len()).take(moving);
    let first = scene.instances.len() as u32;
    groups.zip(first..).flat_map(|(group, instance)| {
        group.members().iter().map(move |member| (*member, Some(instance)))
    })
}

/// Returns the inverse of a placement.
pub fn inverse(transform: Transform) -> Affine {
    // The reader rejects transforms without an inverse.
    transform.inverse().map_or(Affine::IDENTITY, Transform::affine)
}

/// The least distance of a camera ray's hit: 1e-4 of the scene's scale. The scale is the median diagonal of the
/// objects' boxes, so that one large floor does not hide small objects near the camera, but at least a hundredth of the
/// diagonal of the scene.
fn usual_camera_epsilon(objects: &[SceneObject], own_bounds: &[Vec<Option<Bounds>>]) -> f32 {
    let placed = objects.iter().zip(own_bounds).flat_map(|(object, bounds)| {
        let bounds = bounds.iter().flatten();
        bounds.filter_map(|own| match object.motion {
            None => Some(*own),
            Some(_) => own.transformed(object.transform),
        })
    });
    let bounds: Vec<Bounds> = placed.collect();
    if bounds.is_empty() {
        return 1e-4;
    }
    let mut diagonals: Vec<f64> = bounds.par_iter().map(Bounds::diagonal).collect();
    let middle = diagonals.len() / 2;
    let (_, median, _) = diagonals.select_nth_unstable_by(middle, f64::total_cmp);
    let all = bounds.iter().fold(Bounds::EMPTY, |all, bounds| all.union(bounds));
    let scale = median.max(all.diagonal() / 100.0);
    if scale > 0.0 { (scale * 1e-4) as f32 } else { 1e-4 }
}
