//! The kernels of an integrator's stages for the surface groups of a scene.

use std::collections::{BTreeMap, BTreeSet};
use std::ops::Range;
use std::sync::Arc;

use rtsl::{
    CallMode, CameraProgram, Diagnostic, EarlierKernels, Engine, Instance, Objects,
    ParameterValues, PreparedSurface, Program, Query, ReadResults, ResumedBy, ShapeClass,
    StageKernel, StageKernels, StageLights, StageRequest, StageScene, StageSurface, StagedProgram,
    SurfaceClass, SurfaceObject, TieredKernel,
};
use rtsl_scene::Scene;

use super::columns::Columns;
use super::frames::BlockSizes;
use super::moved_columns::MovedColumns;
use super::searched_objects::searched_objects;
use super::stage_lights::shape_object;
use crate::compiled::group_plan::Classes;
use crate::compiled::instance_classes::InstanceClassId;
use crate::compiled::material::MaterialSource;
use crate::compiled::object::is_own_material;
use crate::compiled::object_entry::ObjectEntry;
use crate::compiled::surface_group::GroupKey;
use crate::compiled::variables::visible_components;
use crate::lights::Lights;

/// An integrator's stages with their kernels.
pub struct StagedMethod {
    /// The stages.
    pub program: StagedProgram,
    /// The arrays of their ports.
    pub columns: Columns,
    /// Those that are moved with paths.
    pub moved: MovedColumns,
    kernels: KernelTable,
    /// For each object of the scene its surface.
    surfaces: Vec<Surface>,
    reads_depths: bool,
    reads_ray_types: bool,
    asks_host: bool,
    queries: BTreeSet<Query>,
    read_answers: Vec<(usize, usize)>,
    read_counts: Vec<usize>,
}

/// The kernels of stages, with what they were made for.
struct KernelTable {
    /// In the order of stages and groups; the stages without surfaces have a kernel for no group only. Those that search
    /// the scene come last, if it has few objects.
    made: Arc<StageKernels>,
    /// The index of the first kernel of each stage, then that of those that search.
    firsts: Vec<usize>,
    /// The requests, in the order of the kernels.
    requests: Vec<StageRequest>,
    /// The outputs that they store.
    outputs: Vec<String>,
    /// True if they store first hits.
    first_hits: bool,
}

/// The surface of an object.
#[derive(Clone, Copy, Debug, Default)]
pub struct Surface {
    /// Its group.
    pub group: u32,
    /// Its index among those of its group, of several elements that of the first.
    pub index: u32,
    /// True if each element has an index of its own.
    pub has_elements: bool,
}

impl Surface {
    /// Returns the index of an element's surface.
    pub fn index_of(self, element: u32) -> u32 {
        if self.has_elements { self.index + element } else { self.index }
    }
}

/// The prepared parts of a scene.
pub struct StageParts<'a> {
    /// The classes of the parts of surfaces.
    pub classes: Classes<'a>,
    /// The keys of the surface groups.
    pub keys: &'a [GroupKey],
    /// The entries of objects.
    pub objects: &'a [ObjectEntry],
    /// The lights, with their selection.
    pub lights: &'a Lights,
    /// The camera with whose rays paths begin.
    pub camera: &'a Arc<CameraProgram>,
    /// The results of the integrator that are read beside radiance.
    pub read: ReadResults<'a>,
    /// The dependence of kernels on the values of parameters.
    pub values: ParameterValues,
    /// Earlier stages, whose kernels are used again if they serve the scene.
    pub earlier: Option<&'a StagedMethod>,
}

/// The objects for which kernels of a group are called.
struct StageGroup {
    class: Option<Arc<SurfaceClass>>,
    objects: Arc<Objects>,
}

impl StageGroup {
    fn mode(&self) -> CallMode {
        if self.objects.len() == 1 { CallMode::Packet } else { CallMode::Stream }
    }
}

impl StagedMethod {
    /// Links and compiles the stages for the groups of a scene.
    ///
    /// # Errors
    /// If linking, splitting or code generation fails.
    pub fn of_integrator(
        engine: &Engine,
        program: &Arc<Program>,
        integrator: &Instance,
        scene: &Scene,
        parts: &StageParts<'_>,
        lights: &StageLights<'_>,
    ) -> Result<StagedMethod, Diagnostic> {
        let StageParts { classes, values, .. } = parts;
        let sampler = classes.compiled.settings.sampler;
        let mut surfaces = vec![Surface::default(); scene.objects.len()];
        let (keys, members): (Vec<SurfaceKey>, Vec<Vec<u32>>) =
            by_class(scene, parts).into_iter().unzip();
        let surface_classes: Vec<Arc<SurfaceClass>> =
            keys.iter().map(|key| Arc::new(key.class(classes))).collect();
        SurfaceClass::link_methods(&surface_classes)?;
        let mut classed = Vec::new();
        for ((group, class), members) in (1..).zip(surface_classes).zip(&members) {
            let made = surfaces_of(scene, parts, &class, members, |object, index| {
                let is_mesh = scene.objects[object as usize].elements.is_some();
                let has_elements = is_mesh && class.shape.is_some();
                surfaces[object as usize] = Surface { group, index, has_elements };
            });
            classed.push((class, made));
        }
        let searched = searched_objects(classes, |object| surfaces[object as usize]);
        let camera = Some(parts.camera.clone());
        let of_scene = StageScene { lights, searched: searched.map(Arc::new), camera };
        let program = StagedProgram::new(program, sampler, of_scene, *values)?;
        let none =
            StageGroup { class: None, objects: Arc::new(program.objects(integrator, None, [])) };
        let mut groups = vec![none];
        groups.extend(classed.into_iter().map(|(class, surfaces)| {
            let objects = program.objects(integrator, Some(&class), surfaces);
            StageGroup { class: Some(class), objects: Arc::new(objects) }
        }));
        let table = KernelTable::new(engine, &program, &groups, parts.read, parts.earlier)?;
        Ok(StagedMethod::with_kernels(program, table, surfaces))
    }

    /// Compiles stages that know no surfaces, called for these objects.
    ///
    /// # Errors
    /// If linking, splitting or code generation fails.
    pub fn without_surfaces(
        engine: &Engine,
        program: StagedProgram,
        objects: Arc<Objects>,
        earlier: Option<&StagedMethod>,
    ) -> Result<StagedMethod, Diagnostic> {
        let groups = [StageGroup { class: None, objects }];
        let table = KernelTable::new(engine, &program, &groups, ReadResults::default(), earlier)?;
        Ok(StagedMethod::with_kernels(program, table, Vec::new()))
    }

    fn with_kernels(
        program: StagedProgram,
        table: KernelTable,
        surfaces: Vec<Surface>,
    ) -> StagedMethod {
        let kernels = table.all();
        let columns = Columns::new(&program);
        let (first, others) = table.split_after_first();
        let moved = MovedColumns::new(&program, &columns, first, others);
        let reads = |array: &usize| kernels.iter().any(|it| it.reads.contains(array));
        let [reads_depths, reads_ray_types] = [&columns.depth, &columns.ray_type].map(&reads);
        let read_counts = columns.counts.into_iter().filter(reads).collect();
        let asks_host = kernels.iter().any(|it| it.asks_host);
        let queries = queries(&program, kernels);
        let has_elements = surfaces.iter().any(|surface| surface.has_elements);
        let read_answers = read_answers(&program, &columns, has_elements, kernels);
        StagedMethod {
            program,
            columns,
            moved,
            kernels: table,
            surfaces,
            reads_depths,
            reads_ray_types,
            asks_host,
            queries,
            read_answers,
            read_counts,
        }
    }

    /// The kernel that finds nearest hits, unless stages do so at their ends, or a hierarchy is searched.
    pub fn nearest_search(&self) -> Option<&StageKernel> {
        self.kernels.made.nearest_search()
    }

    /// The kernel that finds out whether rays hit anything, unless stages do so at their ends, or a hierarchy is searched.
    pub fn any_search(&self) -> Option<&StageKernel> {
        self.kernels.made.any_search()
    }

    /// The kernel of the camera.
    ///
    /// # Panics
    /// If these are not the stages of an integrator.
    pub fn camera_kernel(&self) -> &Arc<TieredKernel> {
        let camera = self.kernels.made.camera();
        &camera.expect("the stages of integrators follow a camera").kernel
    }

    /// The data for which these are called.
    pub fn searched_objects(&self) -> Option<&Objects> {
        self.program.searched().map(|searched| &**searched.objects())
    }

    /// The answers to searches that anyone reads, with their arrays.
    pub fn read_answers(&self) -> &[(usize, usize)] {
        &self.read_answers
    }

    /// The arrays with counts of random sequences that anyone reads.
    pub fn read_counts(&self) -> &[usize] {
        &self.read_counts
    }

    /// True if a stage is about surfaces whose groups and indices kernels have found.
    pub fn finds_surfaces(&self, stage: usize) -> bool {
        let surface = self.program.stages()[stage].surface;
        surface == StageSurface::Answer && self.program.searched().is_some()
    }

    /// True if a kernel reads the number of surfaces that a path has met.
    pub fn reads_depths(&self) -> bool {
        self.reads_depths
    }

    /// True if paths wait for `shade` of surfaces.
    pub fn shades(&self) -> bool {
        self.program.stages().iter().any(|stage| stage.resumed_by == ResumedBy::Shade)
    }

    /// True if paths may spawn rays or calls of `shade`.
    pub fn spawns(&self) -> bool {
        let spawns = |event: ResumedBy| match event {
            ResumedBy::Trace | ResumedBy::Shade | ResumedBy::LightSample => true,
            ResumedBy::Start
            | ResumedBy::NearestHit
            | ResumedBy::Occluded
            | ResumedBy::Dispatch => false,
        };
        let stages = self.program.stages().iter();
        let mut kernels = self.kernels.all().iter();
        let of_kernels = [Query::OwnShade, Query::SpawnPath];
        self.is_of_material()
            || stages.map(|stage| stage.resumed_by).any(spawns)
            || kernels
                .any(|it| it.spawns > 0 || of_kernels.iter().any(|of| it.queries.contains(of)))
    }

    /// True if paths wait for samples of lights.
    pub fn samples_lights(&self) -> bool {
        self.program.stages().iter().any(|stage| stage.resumed_by == ResumedBy::LightSample)
    }

    /// True if a kernel reads the type of the ray that a path has searched along.
    pub fn reads_ray_types(&self) -> bool {
        self.reads_ray_types
    }

    /// True for a method of materials. Its stages are linked with no surface: the runtime prepares those that are found.
    pub fn is_of_material(&self) -> bool {
        self.program.is_of_material()
    }

    /// True if kernels make requests of a host that has to know the random sequences of paths.
    pub fn asks_host(&self) -> bool {
        self.asks_host
    }

    /// The queries about surfaces that a host answers, during calls of kernels or before them.
    pub fn queries(&self) -> &BTreeSet<Query> {
        &self.queries
    }

    /// Returns a kernel by its index: kernels are in the order of stages and groups.
    pub fn kernel(&self, kernel: usize) -> &StageKernel {
        &self.kernels.all()[kernel]
    }

    /// Returns the objects for which a kernel is called.
    pub fn objects_of(&self, kernel: usize) -> &Objects {
        &self.kernels.requests[kernel].objects
    }

    /// Returns the stage of a kernel.
    pub fn stage_of(&self, kernel: usize) -> usize {
        self.kernels.requests[kernel].stage
    }

    /// Returns the indices of the kernels of a stage: one for each group of surfaces after that for none.
    pub fn kernels_of(&self, stage: usize) -> Range<usize> {
        self.kernels.firsts[stage]..self.kernels.firsts[stage + 1]
    }

    /// The number of the kernels of all stages.
    pub fn kernel_count(&self) -> usize {
        self.kernels.requests.len()
    }

    /// True if all paths end after a kernel.
    pub fn ends_paths(&self, kernel: usize) -> bool {
        self.kernel(kernel).ends
    }

    /// Returns the number of operations of a kernel.
    pub fn operations_of(&self, kernel: usize) -> usize {
        self.kernel(kernel).operations
    }

    /// Has the background optimise the kernels, if it has not begun.
    pub fn optimise(&self, engine: &Engine) {
        self.kernels.made.optimise(engine);
    }

    /// Waits until the background has optimised the kernels, or failed to.
    pub fn wait_for_optimised(&self) {
        self.kernels.made.wait();
    }

    /// The addresses of the code.
    #[cfg(test)]
    pub fn code(&self) -> Vec<*const TieredKernel> {
        self.kernels.all().iter().map(|it| Arc::as_ptr(&it.kernel)).collect()
    }

    /// The numbers of arrays that the stages and their hosts access.
    pub fn block_sizes(&self) -> BlockSizes {
        let kernels = self.kernels.all().iter();
        let components = kernels.flat_map(|it| it.reads_state.iter().chain(&it.state));
        let of_kernels = components.max().map_or(0, |last| last + 1);
        BlockSizes {
            state: of_kernels.max(visible_components()),
            scratch: self.program.scratch_arrays(),
        }
    }

    /// The reads of state by the first stage, which is for no group.
    pub fn first_reads(&self) -> &[usize] {
        &self.kernel(0).reads_state
    }

    /// Returns the surface of an object of the scene.
    pub fn surface_of(&self, object: u32) -> Surface {
        self.surfaces[object as usize]
    }
}

/// The classes of the parts of surfaces that share the kernels of stages.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
struct SurfaceKey {
    /// The first traversal class of such shapes, if stages are linked with them, or they are materials themselves.
    shape: Option<u32>,
    /// True if stages are linked with the shapes. Those in instances have a place that depends on the time.
    is_linked: bool,
    material: MaterialSource,
    emitter: Option<InstanceClassId>,
    is_sampled: bool,
}

/// The greatest number of elements of an object that stages are linked with: each has data of its own in kernels. With
/// 4,096 instead, a book of 21,000 triangles had 0.88 of the rays a second, and five rooms 0.93 to 1.01 (Zen 5).
/// Without a limit, kernels of 3.5 million triangles took 0.4 GB.
const MAX_LINKED_ELEMENTS: u32 = 1 << 15;

/// Returns the objects of a scene by the classes of their parts.
fn by_class(scene: &Scene, parts: &StageParts<'_>) -> BTreeMap<SurfaceKey, Vec<u32>> {
    let StageParts { classes, keys, objects, .. } = parts;
    // The first items are in the world, the others in instances.
    let [placed, instanced]: [BTreeSet<u32>; 2] = [0, 1].map(|first| {
        let members = classes.compiled.items.iter().skip(first).flat_map(|items| items.members());
        members.map(|member| member.object).collect()
    });
    let mut by_class: BTreeMap<SurfaceKey, Vec<u32>> = BTreeMap::new();
    let mut linked: BTreeMap<(u32, bool), bool> = BTreeMap::new();
    // Meshes have a traversal class each.
    let mut first_classes: BTreeMap<(usize, bool), u32> = BTreeMap::new();
    for (object, entry) in (0..).zip(*objects).filter(|(object, _)| placed.contains(object)) {
        let GroupKey { class, material, emitter, is_sampled, .. } = keys[entry.group as usize];
        let shapes = classes.compiled.class(class);
        let kind = (Arc::as_ptr(shapes.program()).addr(), shapes.is_placed());
        let class = *first_classes.entry(kind).or_insert(class);
        let elements = scene.objects[object as usize].elements.unwrap_or(1);
        let is_linked = !instanced.contains(&object)
            && elements <= MAX_LINKED_ELEMENTS
            && *linked
                .entry((class, is_sampled))
                .or_insert_with(|| linked_shape(classes, class, is_sampled).is_some());
        let key = SurfaceKey {
            shape: (is_linked || material.0 == MaterialSource::Own).then_some(class),
            is_linked,
            material: material.0,
            emitter: emitter.map(|(class, _)| class),
            is_sampled,
        };
        by_class.entry(key).or_default().push(object);
    }
    by_class
}

/// Returns the shapes of a traversal class as parts of kernels; `None` if stages are not linked with them.
fn linked_shape(classes: &Classes<'_>, class: u32, is_sampled: bool) -> Option<ShapeClass> {
    let shapes = classes.compiled.class(class);
    ShapeClass::new(shapes.program(), shapes.is_placed(), is_sampled)
}

impl SurfaceKey {
    /// Returns the programs of the parts.
    fn class(&self, classes: &Classes<'_>) -> SurfaceClass {
        let program = |class: InstanceClassId| classes.materials[class].program.clone();
        let material = match (self.material, self.shape) {
            (MaterialSource::Class(class), _) => program(class),
            (MaterialSource::Own, shape) => {
                let shape = shape.expect("shapes that are materials are parts of keys");
                classes.compiled.class(shape).program().clone()
            }
        };
        let shape = self.shape.filter(|_| self.is_linked);
        SurfaceClass {
            material,
            is_own_material: self.material == MaterialSource::Own,
            emitter: self.emitter.map(program),
            is_sampled: self.is_sampled,
            shape: shape.and_then(|shape| linked_shape(classes, shape, self.is_sampled)),
        }
    }
}

/// Returns the surfaces of objects that differ in their parts. `assign` is called with each object and the index of its
/// surface.
fn surfaces_of<'a>(
    scene: &'a Scene,
    parts: &StageParts<'_>,
    class: &SurfaceClass,
    objects: &[u32],
    mut assign: impl FnMut(u32, u32),
) -> Vec<SurfaceObject<'a>> {
    let mut indices: BTreeMap<(usize, usize), u32> = BTreeMap::new();
    let (mut distinct, mut next) = (Vec::new(), 0);
    for object in objects {
        let placed = &scene.objects[*object as usize];
        let material: &Instance = match is_own_material(placed) {
            true => &placed.primitive,
            false => &scene.materials[placed.material as usize],
        };
        let emitter = placed.emitter.map(|emitter| &*scene.materials[emitter as usize]);
        let address = |instance: &Instance| std::ptr::from_ref(instance).addr();
        let surface = |shape| SurfaceObject { material, emitter, shape };
        let shape = class.shape.as_ref().and_then(|_| shape_object(scene, parts, *object));
        let key = (address(material), emitter.map_or(0, address));
        let index = match (shape, indices.get(&key)) {
            (None, Some(index)) => *index,
            // Each shape has a place of its own.
            (shape, _) => {
                let (index, is_any) = (next, shape.is_none());
                next += shape.as_ref().map_or(1, |shape| shape.count() as u32);
                distinct.push(surface(shape));
                if is_any {
                    indices.insert(key, index);
                }
                index
            }
        };
        assign(*object, index);
    }
    distinct
}

/// Returns the queries about surfaces that kernels leave to a host.
fn queries(program: &StagedProgram, kernels: &[StageKernel]) -> BTreeSet<Query> {
    let shades = program.stages().iter().any(|stage| stage.resumed_by == ResumedBy::Shade);
    let shaded = shades.then_some(Query::Shade);
    let kernels = kernels.iter();
    let prepared = kernels.clone().any(|kernel| kernel.prepared.is_some());
    let prepared = prepared.then_some(Query::SurfaceProperties);
    let asked = kernels.flat_map(|kernel| kernel.queries.iter().copied());
    asked.filter(|query| query.is_of_surface()).chain(prepared).chain(shaded).collect()
}

/// Returns the answers to searches that kernels, the preparation of surfaces or the sorting of paths read, with their
/// arrays.
fn read_answers(
    program: &StagedProgram,
    columns: &Columns,
    has_elements: bool,
    kernels: &[StageKernel],
) -> Vec<(usize, usize)> {
    let surfaces = program.stages().iter().map(|stage| columns.surface(stage.surface));
    // Surfaces are known by their objects, those of meshes by their elements as well.
    let sorted: BTreeSet<usize> = surfaces
        .flat_map(|[object, _, element]| {
            [object].into_iter().chain(has_elements.then_some(element))
        })
        .collect();
    let prepared = kernels.iter().filter_map(|kernel| kernel.prepared.as_ref());
    let prepared: BTreeSet<usize> = prepared.flat_map(PreparedSurface::arrays).collect();
    let is_read = |array: &usize| {
        let is_read = kernels.iter().any(|it| it.reads.contains(array));
        is_read || sorted.contains(array) || prepared.contains(array)
    };
    let answers = columns.answers.iter().copied().enumerate();
    answers.filter(|(_, array)| is_read(array)).collect()
}

impl KernelTable {
    /// Makes a kernel for each stage and group, or takes over those of earlier stages.
    fn new(
        engine: &Engine,
        program: &StagedProgram,
        groups: &[StageGroup],
        read: ReadResults<'_>,
        earlier: Option<&StagedMethod>,
    ) -> Result<KernelTable, Diagnostic> {
        let requests: Vec<Vec<StageRequest>> =
            (0..program.stages().len()).map(|stage| requests(program, groups, stage)).collect();
        let mut firsts = vec![0];
        firsts.extend(requests.iter().scan(0, |end, of_stage| {
            *end += of_stage.len();
            Some(*end)
        }));
        let requests: Vec<StageRequest> = requests.into_iter().flatten().collect();
        let outputs: Vec<String> = read.outputs.iter().map(|name| (*name).to_owned()).collect();
        let first_hits = read.first_hits;
        let serves = |earlier: &&StagedMethod| {
            let table = &earlier.kernels;
            let mut pairs = requests.iter().zip(&table.requests);
            earlier.program.is_like(program)
                && (&outputs, first_hits) == (&table.outputs, table.first_hits)
                && requests.len() == table.requests.len()
                && pairs.all(|(now, earlier)| now.is_like(earlier))
        };
        let made = match earlier.filter(serves) {
            Some(earlier) => earlier.kernels.made.clone(),
            None => {
                let earlier = earlier.map(|earlier| EarlierKernels {
                    program: &earlier.program,
                    requests: &earlier.kernels.requests,
                    kernels: &earlier.kernels.made,
                });
                Arc::new(engine.stage_kernels(program, &requests, read, earlier)?)
            }
        };
        Ok(KernelTable { made, firsts, requests, outputs, first_hits })
    }

    fn all(&self) -> &[StageKernel] {
        &self.made.kernels
    }

    /// The kernels of the first stage, and those of the others.
    fn split_after_first(&self) -> (&[StageKernel], &[StageKernel]) {
        let (first, end) = (self.firsts[1], self.requests.len());
        (&self.all()[..first], &self.all()[first..end])
    }
}

/// Returns the requests for a stage: one for each group, or for none if the stage has no surface.
fn requests(program: &StagedProgram, groups: &[StageGroup], stage: usize) -> Vec<StageRequest> {
    let has_surface = program.stages()[stage].surface != StageSurface::None;
    let count = if has_surface { groups.len() } else { 1 };
    let request = |group: &StageGroup| StageRequest {
        stage,
        surface: group.class.clone(),
        objects: group.objects.clone(),
        mode: group.mode(),
    };
    groups[..count].iter().map(request).collect()
}
