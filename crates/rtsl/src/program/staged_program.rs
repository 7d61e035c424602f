//! Methods that wait for the renderer as stages: `radiance` of integrators, and the methods of materials that trace.

use std::collections::{BTreeMap, BTreeSet};
use std::ops::Range;
use std::sync::Arc;

use rtsl_abi::{CallMode, InstanceBlock, InstanceRun, Layout, ObjectForm, Objects};
use rtsl_integrate::camera::{PIXEL_COLUMNS, WEIGHT_COLUMNS};
use rtsl_integrate::contribution::{
    CONTRIBUTION_SCALARS, Contributions, MAX_CONTRIBUTIONS, contribution_column,
};
use rtsl_integrate::indexed_lights::{SHADOW_LIMIT, link_lights};
use rtsl_integrate::kept_requests::KeptRequests;
use rtsl_integrate::prepared_surface::{property_column, property_count};
use rtsl_integrate::sampler::{KEY_COLUMN, SAMPLE_COLUMN};
use rtsl_integrate::search::{GROUP_COLUMN, SEARCHES_COLUMN, SURFACE_COLUMN};
use rtsl_integrate::sequences::{DRAWN_COLUMN, Purpose};
use rtsl_integrate::shade_call::{SHADE_WEIGHT_COLUMNS, SHADED_SCALARS, shaded_column};
use rtsl_integrate::spawning::{CHILDREN_COLUMN, MAX_SPAWNS, Places, SPAWN_SCALARS, spawn_column};
use rtsl_integrate::stage::{
    Answer, DEPTH_COLUMN, MaterialStages, RAY_TYPE_COLUMN, SurfaceLinks, SurfaceMethod,
    TIME_COLUMN, link_stage,
};
use rtsl_integrate::stage_search::{LIT_COLUMNS, SHADOW_RAYS_COLUMN, StageSearch};
use rtsl_ir::{Function, Query, Scalar, Variable, VariableKind};
use rtsl_math::sampling::Sampler;
use rtsl_source::Diagnostic;
use rtsl_spec::Method;
use rtsl_stages::{MAX_ANSWERS, MAX_REQUEST, Port, ResumedBy, SlotId, Stage, Stages, Surface};

use super::camera_program::CameraProgram;
use super::program::Program;
use super::searched_scene::SearchedScene;
use super::stage_lights::{LinkedLights, StageLights};
use super::surface_class::{SurfaceClass, SurfaceObject, add_part, no_surface, own_shade};
use crate::codegen::kernel_compiler::KernelCompiler;
use crate::codegen::variant::{KnownMembers, Variant};
use crate::instance::instance::Instance;
use crate::{errors, nesting};

/// The stages of a method, from which kernels are made. Those of an integrator have one for each class of surfaces that
/// a stage meets; those of a material know no surfaces, whose properties are state.
///
/// All stages share one layout of scratch: the arrays of the [ports](Port) through which stages meet the host, those of
/// the paths' times, depths, keys, samples, counts and searches, and of the groups of surfaces that they have found,
/// which have the same places in all programs, then those of the class, and those of the frame.
#[derive(Debug)]
pub struct StagedProgram {
    program: Arc<Program>,
    method: Method,
    stages: Stages,
    /// The layout of the class, with the scratch of stages.
    layout: Layout,
    sampler: Sampler,
    /// The lights, if operations compute their samples.
    lights: Option<LinkedLights>,
    /// The objects of the scene, if it has few.
    searched: Option<Arc<SearchedScene>>,
    /// The searches that each stage makes at its end, if it does.
    search: Option<Arc<StageSearch>>,
    /// The camera, if stages follow its rays.
    camera: Option<Arc<CameraProgram>>,
    /// The method, if it is one of materials.
    material: Option<MaterialStages>,
    /// True if a path asks for the own colour of one surface at most after each search.
    shades_once: bool,
    values: ParameterValues,
}

/// The requests that stages keep until they end.
static KEPT_REQUESTS: [KeptRequests; 2] = [
    KeptRequests {
        query: Query::Contribute,
        effect: 7..10,
        greatest: MAX_CONTRIBUTIONS,
        column: contribution_column,
    },
    KeptRequests {
        query: Query::SpawnPath,
        effect: 10..11,
        greatest: MAX_SPAWNS,
        column: spawn_column,
    },
];

/// The scene with which the stages of an integrator are linked.
pub struct StageScene<'a> {
    /// Its lights. Kernels sample them if their methods permit it; else hosts do.
    pub lights: &'a StageLights<'a>,
    /// Its objects, if it has few: kernels search among them.
    pub searched: Option<Arc<SearchedScene>>,
    /// Its camera, if paths begin with its rays: a kernel computes them.
    pub camera: Option<Arc<CameraProgram>>,
}

/// The parts of a scene and a render with which stages are linked.
struct Parts {
    sampler: Sampler,
    lights: Option<LinkedLights>,
    searched: Option<Arc<SearchedScene>>,
    camera: Option<Arc<CameraProgram>>,
    material: Option<MaterialStages>,
    values: ParameterValues,
}

/// The state with the colours that methods of materials compute.
const COLORS: [&str; 2] = ["rt_SampleColor", "rt_EmissionColor"];

/// The dependence of the kernels of stages on the values of parameters.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ParameterValues {
    /// The values are final: kernels know the integers and booleans that all objects share, and load once what these
    /// have in common.
    Final,
    /// The values may change: kernels serve any others of the same classes.
    Changing,
}

/// A kernel of a stage that a host asks for.
#[derive(Clone, Debug)]
pub struct StageRequest {
    /// The index of the stage.
    pub stage: usize,
    /// The class of the stage's surface; `None` if the stage has none, or the path has met none.
    pub surface: Option<Arc<SurfaceClass>>,
    /// The objects for which the kernel is called: [`StagedProgram::objects`] of the class.
    pub objects: Arc<Objects>,
    /// [`CallMode::Packet`] for one object, [`CallMode::Stream`] for one each path.
    pub mode: CallMode,
}

impl StageRequest {
    /// True if the kernel of another request serves this one, in programs that are
    /// [alike](StagedProgram::is_like).
    pub fn is_like(&self, other: &StageRequest) -> bool {
        let has_like_surface =
            are_alike(self.surface.as_deref(), other.surface.as_deref(), SurfaceClass::is_like);
        (self.stage, self.mode) == (other.stage, other.mode)
            && self.objects.form() == other.objects.form()
            && has_like_surface
    }
}

impl StagedProgram {
    /// Splits the `radiance` of an integrator, whose paths take their numbers from this sampler. `values` are those of the
    /// integrator, the lights and the surfaces.
    ///
    /// # Errors
    /// If the class has no such method, linking passes a limit, or splitting does.
    pub fn new(
        program: &Arc<Program>,
        sampler: Sampler,
        scene: StageScene<'_>,
        values: ParameterValues,
    ) -> Result<StagedProgram, Diagnostic> {
        let StageScene { lights, searched, camera } = scene;
        let radiance = program.deferring_method(Method::Radiance)?;
        let lights = LinkedLights::new(lights, values);
        let parts = Parts { sampler, lights, searched, camera, material: None, values };
        StagedProgram::split(program, Method::Radiance, &radiance.function, parts)
    }

    /// Splits a method of a material that computes a colour, [`Method::Shade`] or [`Method::Emission`]. Its stages
    /// store the colour only; of `shade` that [defers](Program::deferring_method) light, its own part of it. `values` are
    /// those of the materials.
    ///
    /// # Errors
    /// If the class has no such method, linking passes a limit, or splitting does.
    pub fn of_material(
        program: &Arc<Program>,
        (method, defers): (Method, bool),
        sampler: Sampler,
        values: ParameterValues,
    ) -> Result<StagedProgram, Diagnostic> {
        let linked = match (method, defers) {
            (Method::Shade, true) => program.deferring_method(method)?,
            _ => program.method(method)?,
        };
        let adds_to_path = defers && !rtsl_stages::waits(&linked.function);
        let mut function = Function::clone(&linked.function);
        let variables = function.variables.clone();
        function.outputs.retain(|output| {
            let Variable { kind, name, .. } = &variables[output.variable.0 as usize];
            *kind == VariableKind::State && COLORS.contains(&name.as_str())
        });
        let material = Some(MaterialStages { adds_to_path });
        let parts = Parts { sampler, lights: None, searched: None, camera: None, material, values };
        StagedProgram::split(program, method, &function, parts)
    }

    /// Returns the stage that samples lights for the paths that wait for [`ResumedBy::LightSample`], in the arrays of
    /// whatever program; `None` if hosts have to. `program` is that of the integrator, before whose data the lights'
    /// comes.
    pub fn of_lights(
        program: &Arc<Program>,
        sampler: Sampler,
        lights: &StageLights<'_>,
        values: ParameterValues,
    ) -> Option<StagedProgram> {
        let lights = LinkedLights::new(lights, values);
        let lights = lights.filter(LinkedLights::has_indices)?;
        let stage = Stage {
            function: Function::new("illuminance"),
            resumed_by: ResumedBy::LightSample,
            surface: Surface::None,
            live: Vec::new(),
        };
        let stages =
            Stages { name: "illuminance".to_owned(), slots: Vec::new(), stages: vec![stage] };
        let lights = Some(lights);
        let parts = Parts { sampler, lights, searched: None, camera: None, material: None, values };
        Some(StagedProgram::with_stages(program, Method::Illumination, stages, parts))
    }

    fn split(
        program: &Arc<Program>,
        method: Method,
        function: &Function,
        parts: Parts,
    ) -> Result<StagedProgram, Diagnostic> {
        let stages = nesting::with_deep_stack(|| rtsl_stages::split(function));
        let stages = stages.map_err(|error| errors::splitting(&function.name, &error))?;
        let shades_once = Places::of(Query::OwnShade, function, None).can_be_kept(1);
        let program = StagedProgram::with_stages(program, method, stages, parts);
        Ok(StagedProgram { shades_once, ..program })
    }

    fn with_stages(
        program: &Arc<Program>,
        method: Method,
        stages: Stages,
        Parts { sampler, lights, searched, camera, material, values }: Parts,
    ) -> StagedProgram {
        let mut layout = program.layout().clone();
        let shared = shared_columns();
        let of_class = shared.len() as u32;
        layout.scratch.values_mut().for_each(|array| *array += of_class);
        let end = of_class + layout.scratch_arrays;
        layout.scratch.extend(shared.into_iter().zip(0..));
        let slots = (0..stages.slots.len() as u32).map(|slot| Port::Frame(SlotId(slot)).name());
        layout.scratch.extend(slots.zip(end..));
        layout.scratch_arrays = end + stages.slots.len() as u32;
        lights.iter().for_each(|lights| lights.add_to(&mut layout));
        searched.iter().for_each(|searched| add_part(&mut layout, "", &searched.layout));
        let search = searched.as_ref().and_then(|searched| stage_search(searched, &stages));
        let program = program.clone();
        StagedProgram {
            program,
            method,
            stages,
            layout,
            sampler,
            lights,
            searched,
            search,
            camera,
            material,
            shades_once: false,
            values,
        }
    }

    /// True if the light of lights is added to the radiance of the path that asks a material's method for its colour,
    /// instead of the colour.
    pub fn adds_to_path(&self) -> bool {
        self.material.is_some_and(|material| material.adds_to_path)
    }

    /// True if the integrator asks for the own colours of shaded surfaces.
    fn asks_own_shade(&self) -> bool {
        let asks = |stage: &Stage| stage.function.body.asks(|query| query == Query::OwnShade);
        self.stages.stages.iter().any(asks)
    }

    /// True if a host is asked for the own colours of surfaces with these materials, which may be their shapes.
    pub fn asks_own_shade_of(&self, material: &Program, is_own_material: bool) -> bool {
        self.asks_own_shade() && self.inlined_shade(material, is_own_material).is_none()
    }

    /// Returns the method of materials that becomes part of the stages that ask for own colours of their surfaces.
    fn inlined_shade(&self, material: &Program, is_own_material: bool) -> Option<SurfaceMethod> {
        let method = own_shade(material, is_own_material).filter(|_| self.shades_once)?;
        let is_lit = self.lights.as_ref().is_some_and(LinkedLights::has_indices);
        (is_lit || !method.method.asks(Query::UnshadowedLight)).then_some(method)
    }

    /// The camera; `None` if the paths do not begin with its rays.
    pub fn camera(&self) -> Option<&Arc<CameraProgram>> {
        self.camera.as_ref()
    }

    /// The objects among which kernels search; `None` if hosts search.
    pub fn searched(&self) -> Option<&Arc<SearchedScene>> {
        self.searched.as_ref()
    }

    /// True if each stage searches at its end for the paths that wait for the nearest hit, and for what blocks its
    /// contribution.
    pub fn searches_at_end(&self) -> bool {
        self.search.is_some()
    }

    /// The stages that begin with the answer to a search which the stage before has made.
    pub(crate) fn answered(&self) -> BTreeSet<i32> {
        self.search.as_ref().map_or_else(BTreeSet::new, |search| search.resumed.clone())
    }

    /// Returns the scratch array for that of the class with an index.
    pub fn class_array(&self, index: usize) -> usize {
        shared_columns().len() + index
    }

    /// True if kernels for another program's requests serve [like](StageRequest::is_like) requests of this one. Their
    /// objects may have other values if both programs permit that.
    pub fn is_like(&self, other: &StagedProgram) -> bool {
        Arc::ptr_eq(&self.program, &other.program)
            && self.method == other.method
            && self.sampler == other.sampler
            && [self.values, other.values] == [ParameterValues::Changing; 2]
            && are_alike(self.lights.as_ref(), other.lights.as_ref(), LinkedLights::is_like)
            && are_alike(
                self.searched.as_deref(),
                other.searched.as_deref(),
                SearchedScene::is_like,
            )
            && are_alike(self.camera.as_deref(), other.camera.as_deref(), CameraProgram::is_like)
    }

    /// True if kernels serve other values of parameters.
    pub(crate) fn values_may_change(&self) -> bool {
        self.values == ParameterValues::Changing
    }

    /// The program of the class.
    pub fn program(&self) -> &Arc<Program> {
        &self.program
    }

    /// True for a method of materials. Its stages are linked with no surface that they find: renderers prepare them.
    pub fn is_of_material(&self) -> bool {
        self.method != Method::Radiance
    }

    /// The method that was split.
    pub fn method(&self) -> Method {
        self.method
    }

    /// The stages; the first is the start.
    pub fn stages(&self) -> &[Stage] {
        &self.stages.stages
    }

    /// The number of scratch arrays of all stages.
    pub fn scratch_arrays(&self) -> usize {
        self.layout.scratch_arrays as usize
    }

    /// Returns the scratch array of a port.
    ///
    /// # Panics
    /// If the frame has no such slot, or no stage has such a port.
    pub fn array(&self, port: Port) -> usize {
        self.layout.scratch[&port.name()] as usize
    }

    /// The scratch array with the time of each path within the shutter.
    pub fn time_array(&self) -> usize {
        self.layout.scratch[TIME_COLUMN] as usize
    }

    /// The scratch array with the number of surfaces that each path has met before, as a float.
    pub fn depth_array(&self) -> usize {
        self.layout.scratch[DEPTH_COLUMN] as usize
    }

    /// The scratch array with the type of the ray that each path has searched along last, see
    /// [`RayType::value`](rtsl_spec::RayType::value).
    pub fn ray_type_array(&self) -> usize {
        self.layout.scratch[RAY_TYPE_COLUMN] as usize
    }

    /// The scratch array with the key of each path's sequences of numbers.
    pub fn key_array(&self) -> usize {
        self.layout.scratch[KEY_COLUMN] as usize
    }

    /// The scratch arrays that count each path's light samples, and its calls of materials that draw random numbers.
    pub fn count_arrays(&self) -> [usize; 2] {
        Purpose::ALL.map(|purpose| self.layout.scratch[purpose.column()] as usize)
    }

    /// The scratch array that counts the numbers of `rand()`.
    pub fn drawn_array(&self) -> usize {
        self.layout.scratch[DRAWN_COLUMN] as usize
    }

    /// The scratch arrays with the surface that a material shades: the point, the offset at which rays that leave it
    /// begin, the geometric and the shading normal on the side from which the ray came.
    pub fn shaded_arrays(&self) -> [usize; SHADED_SCALARS] {
        std::array::from_fn(|index| self.layout.scratch[&shaded_column(index)] as usize)
    }

    /// The scratch arrays with the contributions of a stage at each of a few places, black if it makes none: the origin,
    /// the direction and the length of a ray, and the colour that arrives if nothing is on it.
    pub fn contribution_arrays(&self) -> [[usize; CONTRIBUTION_SCALARS]; MAX_CONTRIBUTIONS] {
        std::array::from_fn(|place| {
            let array = |index| self.layout.scratch[&contribution_column(place, index)] as usize;
            std::array::from_fn(array)
        })
    }

    /// The scratch arrays with the factor of the light that a material's method defers.
    pub fn shade_weight_arrays(&self) -> [usize; 3] {
        SHADE_WEIGHT_COLUMNS.map(|column| self.layout.scratch[column] as usize)
    }

    /// The scratch arrays with the paths that a stage spawns at each of a few places: the ray's origin, direction and
    /// limit, the product of the weights from the camera on, the greatest weight, which is 0 without a path, the key of
    /// the path's sequences, and the number of surfaces that its parent has met before the one that is shaded.
    pub fn spawn_arrays(&self) -> [[usize; SPAWN_SCALARS]; MAX_SPAWNS] {
        std::array::from_fn(|place| {
            std::array::from_fn(|index| self.layout.scratch[&spawn_column(place, index)] as usize)
        })
    }

    /// The scratch array that counts the rays that a path has spawned.
    pub fn children_array(&self) -> usize {
        self.layout.scratch[CHILDREN_COLUMN] as usize
    }

    /// The scratch array with the group of the surface that [a search](crate::SearchedScene) has found, which hosts
    /// number; 0 for none.
    pub fn group_array(&self) -> usize {
        self.layout.scratch[GROUP_COLUMN] as usize
    }

    /// The scratch array with the index of that surface among the objects of its group; 0 for none.
    pub fn surface_array(&self) -> usize {
        self.layout.scratch[SURFACE_COLUMN] as usize
    }

    /// The scratch arrays with the sum of the contributions to each path that nothing blocked.
    pub fn lit_arrays(&self) -> [usize; 3] {
        LIT_COLUMNS.map(|column| self.layout.scratch[column] as usize)
    }

    /// The scratch array with the number of contributions to each path for which stages have searched.
    pub fn shadow_rays_array(&self) -> usize {
        self.layout.scratch[SHADOW_RAYS_COLUMN] as usize
    }

    /// The scratch arrays with the weight of each path's radiance.
    pub fn weight_arrays(&self) -> [usize; 3] {
        WEIGHT_COLUMNS.map(|column| self.layout.scratch[column] as usize)
    }

    /// The scratch array with the number of searches of each path.
    pub fn searches_array(&self) -> usize {
        self.layout.scratch[SEARCHES_COLUMN] as usize
    }

    /// The scratch array with the index of each path's sample.
    pub fn sample_array(&self) -> usize {
        self.layout.scratch[SAMPLE_COLUMN] as usize
    }

    /// Returns the objects for which kernels of a class of surfaces are called, by index: the members of the integrator
    /// with those of each surface's parts. Without a class there is one, the integrator.
    ///
    /// # Panics
    /// If an instance belongs to another program.
    pub fn objects<'a>(
        &self,
        integrator: &Instance,
        class: Option<&SurfaceClass>,
        surfaces: impl IntoIterator<Item = SurfaceObject<'a>>,
    ) -> Objects {
        let own = [self.program.block(integrator)];
        let lights = self.lights.iter().flat_map(|lights| lights.blocks.iter().cloned());
        let searched = self.searched.iter().map(|searched| searched.block().clone());
        let own = joined(&own.into_iter().chain(lights).chain(searched).collect::<Vec<_>>());
        let Some(class) = class else {
            return Objects::of_instances(ObjectForm::new([]), [own]);
        };
        let runs = surfaces.into_iter().map(|surface| class.run(&surface));
        let mut layout = Layout::default();
        class.add_to(&mut layout);
        let objects = self.objects_of(&layout, &runs.collect::<Vec<_>>());
        if objects.is_empty() {
            return objects;
        }
        let shared = joined(&[own.clone(), InstanceBlock::clone(objects.shared())]);
        objects.after(own.words().len() as u32, shared)
    }

    /// Returns the objects for which kernels of a material's method are called.
    ///
    /// # Panics
    /// If an instance belongs to another program.
    pub fn materials<'a>(&self, materials: impl IntoIterator<Item = &'a Instance>) -> Objects {
        let materials = materials.into_iter();
        let runs = materials.map(|material| InstanceRun::new(self.program.block(material), 1));
        self.objects_of(&self.layout, &runs.collect::<Vec<_>>())
    }

    /// Returns objects with these data.
    fn objects_of(&self, layout: &Layout, runs: &[InstanceRun]) -> Objects {
        let differs = |word: u32| {
            let word_of = |run: &InstanceRun| run.first().words()[word as usize];
            runs.iter().any(|run| run.differ_in(word))
                || runs.windows(2).any(|pair| word_of(&pair[0]) != word_of(&pair[1]))
        };
        let count = runs.iter().map(InstanceRun::count).sum();
        let may_differ = |place: &Range<u32>| count > 1 && self.may_change(place, &runs[0]);
        let differing =
            layout.variables().filter(|place| may_differ(place) || place.clone().any(differs));
        let form = ObjectForm::new(differing.flatten()).of_count(count);
        Objects::of_runs(form, runs)
    }

    /// True if objects may differ in a variable at this place later, although they have the same words now: in data
    /// that hosts do not bind.
    fn may_change(&self, place: &Range<u32>, objects: &InstanceRun) -> bool {
        let mut bound = objects.first().buffers().iter();
        self.values == ParameterValues::Changing
            && !bound.any(|buffer| place.contains(&buffer.offset))
    }

    /// Returns the linked and optimised function of a request, with the layout of its kernel and its variant.
    /// Methods of surfaces draw random numbers if they `may_draw`.
    pub(crate) fn link(
        &self,
        request: &StageRequest,
        may_draw: bool,
        compiler: &KernelCompiler,
    ) -> Result<(Function, Layout, Variant), Diagnostic> {
        let StageRequest { stage, surface, objects, mode } = request;
        let linked = self.link_surface(*stage, surface.as_deref(), may_draw)?;
        let layout = self.layout_for(surface.as_deref());
        let known = match self.values {
            ParameterValues::Final => known_choices(&linked, &layout, objects),
            ParameterValues::Changing => KnownMembers::default(),
        };
        let variant = Variant::new(*mode).of_objects(objects.form().clone()).knowing(known);
        let mut function = compiler.optimise_stage(linked, &variant, &layout);
        // What hosts shade contributes and spawns in between.
        if !function.body.asks(|query| query == Query::OwnShade) {
            KEPT_REQUESTS.iter().for_each(|requests| requests.keep(&mut function));
        }
        let layout = variant.layout(&layout);
        Ok((function, layout, variant))
    }

    /// Returns a stage with the methods of a surface.
    fn link_surface(
        &self,
        stage: usize,
        surface: Option<&SurfaceClass>,
        may_draw: bool,
    ) -> Result<Function, Diagnostic> {
        if let (Method::Illumination, Some(lights)) = (self.method, &self.lights) {
            return Ok(link_lights(&lights.links, self.sampler)?.function);
        }
        let stage = &self.stages.stages[stage];
        // A stage after a search that has no queries about surfaces is the same whatever was found.
        let found = (stage.surface == Surface::Answer).then_some(surface.is_some());
        let asks_own_shade = self.asks_own_shade();
        let links = match surface {
            Some(class) => {
                let asks = asks_own_shade.then_some(class);
                let shade =
                    asks.and_then(|it| self.inlined_shade(&it.material, it.is_own_material));
                class.links(found, may_draw, shade)
            }
            None if self.method == Method::Radiance => no_surface(found),
            // A material is linked with no surface that it finds: renderers prepare them.
            None => SurfaceLinks::default(),
        };
        let inlined = links.answers.get(&Query::OwnShade).and_then(Answer::method);
        let inlined = inlined.map(|method| &*method.function);
        let places = |query: Query| Places::of(query, &stage.function, inlined);
        // What hosts call adds light and spawns paths in between.
        let asks_host = inlined.is_none()
            && surface.is_some()
            && stage.function.body.asks(|query| query == Query::OwnShade);
        let contributions = match asks_host || self.search.is_none() {
            true => Contributions::Requested,
            false => Contributions::of(places(Query::Contribute)),
        };
        let links = SurfaceLinks {
            sampler: Some(self.sampler),
            lights: self.lights.as_ref().map(|lights| lights.links.clone()),
            follows_search: stage.resumed_by == ResumedBy::NearestHit,
            material: self.material,
            contributions,
            search: self.search.clone(),
            ..links
        };
        Ok(link_stage(&stage.function, links)?.function)
    }

    /// The layout of the stages without surfaces.
    pub(crate) fn layout(&self) -> &Layout {
        &self.layout
    }

    /// Returns the layout for a class of surfaces: the members of the integrator, then those of the parts.
    fn layout_for(&self, class: Option<&SurfaceClass>) -> Layout {
        let mut layout = self.layout.clone();
        class.into_iter().for_each(|class| class.add_to(&mut layout));
        layout
    }
}

/// Returns the searches that stages make at their ends; `None` if paths wait for anything but searches: the answers to
/// other requests have other types.
fn stage_search(searched: &SearchedScene, stages: &Stages) -> Option<Arc<StageSearch>> {
    let is_search = |stage: &Stage| match stage.resumed_by {
        ResumedBy::Start | ResumedBy::Dispatch | ResumedBy::NearestHit | ResumedBy::Occluded => {
            true
        }
        ResumedBy::Trace | ResumedBy::LightSample | ResumedBy::Shade => false,
    };
    let resumed =
        (0..).zip(&stages.stages).filter(|(_, it)| it.resumed_by == ResumedBy::NearestHit);
    let (links, resumed) = (searched.links.clone(), resumed.map(|(stage, _)| stage).collect());
    let search = || Arc::new(StageSearch { links, resumed });
    stages.stages.iter().all(is_search).then(search)
}

/// True if both are there and alike, or neither is.
fn are_alike<T>(own: Option<&T>, other: Option<&T>, is_like: impl Fn(&T, &T) -> bool) -> bool {
    match (own, other) {
        (Some(own), Some(other)) => is_like(own, other),
        (own, other) => own.is_none() && other.is_none(),
    }
}

/// True if operations compute all random numbers that surfaces of these requests draw.
pub(crate) fn may_draw(requests: &[StageRequest]) -> bool {
    let mut surfaces = requests.iter().filter_map(|request| request.surface.as_ref());
    surfaces.all(|surface| surface.may_draw())
}

/// The names of the scratch arrays with properties of paths.
pub(crate) const PATH_COLUMNS: [&str; 21] = [
    TIME_COLUMN,
    DEPTH_COLUMN,
    RAY_TYPE_COLUMN,
    KEY_COLUMN,
    SAMPLE_COLUMN,
    Purpose::LightSample.column(),
    Purpose::MaterialCall.column(),
    DRAWN_COLUMN,
    CHILDREN_COLUMN,
    GROUP_COLUMN,
    SURFACE_COLUMN,
    SEARCHES_COLUMN,
    LIT_COLUMNS[0],
    LIT_COLUMNS[1],
    LIT_COLUMNS[2],
    SHADOW_RAYS_COLUMN,
    WEIGHT_COLUMNS[0],
    WEIGHT_COLUMNS[1],
    WEIGHT_COLUMNS[2],
    PIXEL_COLUMNS[0],
    PIXEL_COLUMNS[1],
];

/// Returns the layout of the scratch arrays that all programs have at the same places, without members.
pub(super) fn shared_scratch() -> Layout {
    let scratch: BTreeMap<String, u32> = shared_columns().into_iter().zip(0..).collect();
    Layout { scratch_arrays: scratch.len() as u32, scratch, ..Layout::default() }
}

/// Returns the names of the scratch arrays, each of one scalar, that all programs have at the same places: all but
/// those of the class and the frame.
fn shared_columns() -> Vec<String> {
    let answers = (0..MAX_ANSWERS as u32).map(Port::Answer);
    let requests = (0..MAX_REQUEST).map(Port::Request);
    let surface = (0..3).map(Port::Surface);
    let others = surface.chain([SHADOW_LIMIT, Port::Next]);
    let ports = answers.chain(requests).chain(others).map(Port::name);
    let own = PATH_COLUMNS.map(str::to_owned);
    let contribution = (0..MAX_CONTRIBUTIONS).flat_map(|place| {
        (0..CONTRIBUTION_SCALARS).map(move |index| contribution_column(place, index))
    });
    let properties = (0..property_count()).map(property_column);
    let shaded = (0..SHADED_SCALARS).map(shaded_column);
    let weight = SHADE_WEIGHT_COLUMNS.map(str::to_owned);
    let spawns = (0..MAX_SPAWNS)
        .flat_map(|place| (0..SPAWN_SCALARS).map(move |index| spawn_column(place, index)));
    let of_stage = contribution.chain(spawns).chain(properties).chain(shaded).chain(weight);
    ports.chain(own).chain(of_stage).collect()
}

/// Returns the blocks of parts as one, in their order.
pub(super) fn joined(parts: &[InstanceBlock]) -> InstanceBlock {
    let parts = parts.iter().map(|part| InstanceRun::new(part.clone(), 1));
    InstanceRun::joined(&parts.collect::<Vec<_>>()).first().clone()
}

/// Returns the integers and booleans that all objects share: they select between parts of methods.
fn known_choices(function: &Function, layout: &Layout, objects: &Objects) -> KnownMembers {
    let shared = objects.shared().words();
    let choices = function.variables.iter().filter(|it| it.scalar != Scalar::F32);
    let words = choices.filter_map(|variable| {
        let first = *layout.members.get(&variable.name)?;
        Some(first..first + variable.len)
    });
    let known = words.flatten().filter(|word| !objects.form().overlaps(*word, 1));
    KnownMembers::new(known.map(|word| (word, shared[word as usize])).collect())
}
