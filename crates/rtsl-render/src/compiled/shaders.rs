//! The shaders of a scene, with exactly the kernels that it calls; their kernels store only outputs that are read.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

use rtsl::{
    CallMode, Diagnostics, Engine, Instance, InstanceBlock, Kernel, KernelRequest, LinkedMethod,
    Method, Outputs, Program, Role, Variant, lookup_state,
};
use rtsl_scene::{Scene, SceneObject};

use super::intersect_variants::{hit_variant, packet_variant};
use super::placement::inverse;
use super::shader_instance::ShaderInstance;

/// A class with the kernels that a scene calls.
pub struct Shader {
    /// The linked class.
    pub program: Arc<Program>,
    kernels: BTreeMap<Method, (Variant, Arc<Kernel>)>,
    /// The surface properties that its shading methods read.
    surface: SurfaceNeeds,
    /// True if methods called for hits of its shapes read the reciprocal directions of rays.
    pub reads_inverse_directions: bool,
    /// True if methods called for hits read the scratch of `intersect`.
    pub reads_hit_scratch: bool,
    /// The methods called for hits of its shapes, with the outputs that are read.
    hit_methods: Vec<(Method, Outputs)>,
}

impl Shader {
    /// Returns the kernel of a method, if the class has it and the scene uses it.
    pub fn kernel(&self, method: Method) -> Option<&Kernel> {
        self.kernels.get(&method).map(|(_, kernel)| &**kernel)
    }

    /// Returns the methods called for hits of its shapes, with the outputs that are read.
    pub fn hit_methods(&self) -> &[(Method, Outputs)] {
        &self.hit_methods
    }

    /// Returns the variant of a method's kernel.
    pub fn variant(&self, method: Method) -> Option<&Variant> {
        self.kernels.get(&method).map(|(variant, _)| variant)
    }

    /// Returns the surface properties that shading reads.
    pub fn surface_needs(&self) -> SurfaceNeeds {
        self.surface
    }
}

/// The surface properties that are read besides normals.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct SurfaceNeeds {
    /// Texture coordinates.
    pub coordinates: bool,
    /// Derivatives.
    pub derivatives: bool,
    /// The reciprocal directions of rays.
    pub inverse_directions: bool,
    /// The widths of rays.
    pub footprints: bool,
}

impl SurfaceNeeds {
    /// Returns the properties that are in either.
    pub fn union(self, other: SurfaceNeeds) -> SurfaceNeeds {
        SurfaceNeeds {
            coordinates: self.coordinates || other.coordinates,
            derivatives: self.derivatives || other.derivatives,
            inverse_directions: self.inverse_directions || other.inverse_directions,
            footprints: self.footprints || other.footprints,
        }
    }

    /// Returns the properties needed for reading these outputs.
    pub fn of(read: Outputs) -> SurfaceNeeds {
        let any = |names: &[&str]| read.intersection(named(names)) != Outputs::NONE;
        SurfaceNeeds {
            coordinates: any(&COORDINATES),
            derivatives: any(&DERIVATIVES),
            inverse_directions: any(&["rt_InverseRayDirection"]),
            footprints: any(&FOOTPRINTS),
        }
    }
}

/// The state variables for which texture coordinates are computed.
const COORDINATES: [&str; 2] = ["rt_TextureUV", "rt_TextureUVW"];
const FOOTPRINTS: [&str; 2] = ["rt_du", "rt_dv"];
const DERIVATIVES: [&str; 6] = ["rt_dPdu", "rt_dPdv", "rt_dsdu", "rt_dsdv", "rt_dtdu", "rt_dtdv"];

fn named(names: &[&str]) -> Outputs {
    Outputs::state(names.iter().filter_map(|name| lookup_state(name)))
}

/// True if a shape's class is also a material, whose methods shade it.
pub fn is_own_material(object: &SceneObject) -> bool {
    object.primitive.class().roles.contains(&Role::Material)
}

/// The use of a scene's shaders.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Purpose {
    /// Shading hits: the kernels include `shade` of materials, and the methods of shapes that provide its inputs.
    Shading,
    /// Finding hits only. Other kernels are compiled by the caller.
    Searching,
}

/// Programs by first use, with the methods that the scene calls.
pub struct ShaderTable<'a> {
    engine: &'a Engine,
    entries: Vec<Entry>,
    by_address: BTreeMap<usize, usize>,
}

struct Entry {
    program: Arc<Program>,
    methods: BTreeSet<Method>,
    /// The properties of its shapes' surfaces that are read.
    surface_read: Outputs,
    /// The kinds of its objects that are not elements: with a transform (true) or without (false).
    placements: BTreeSet<bool>,
    /// True if its shapes are their own materials.
    is_own_material: bool,
}

impl Entry {
    fn linked(&self, method: Method) -> Option<Arc<LinkedMethod>> {
        self.program.method(method).ok()
    }

    fn want(&mut self, methods: impl IntoIterator<Item = Method>) {
        let has = |method: &Method| self.program.has(*method);
        self.methods.extend(methods.into_iter().filter(has));
    }

    /// A material that only emits has no `shade`.
    fn want_shading(&mut self) {
        let shades = self.program.has(Method::Shade);
        self.want([if shades { Method::Shade } else { Method::Emission }]);
    }

    /// The state that its shading methods read.
    fn shading_read(&self) -> Outputs {
        let shading = [Method::Shade, Method::Emission].into_iter();
        let shading = shading.filter(|method| self.methods.contains(method));
        let read = shading.filter_map(|method| self.linked(method));
        let read = read.map(|linked| Outputs::state(linked.reads.iter().copied()));
        read.fold(Outputs::NONE, Outputs::union)
    }

    /// True if methods called for hits of its shapes read the reciprocal directions of rays.
    fn reads_inverse_directions(&self) -> bool {
        let read = self.hit_methods_of_shapes().filter_map(|method| self.linked(method));
        let mut read = read.map(|linked| Outputs::state(linked.reads.iter().copied()));
        read.any(|read| SurfaceNeeds::of(read).inverse_directions)
    }

    /// Adds the methods that compute the surface properties that are read.
    fn want_surface(&mut self) {
        if self.surface_read.intersection(named(&DERIVATIVES)) != Outputs::NONE {
            self.want([Method::ComputeDerivatives]);
            // Derivatives may be computed from texture coordinates.
            if let Some(linked) = self.linked(Method::ComputeDerivatives) {
                let read = Outputs::state(linked.reads.iter().copied());
                self.surface_read = self.surface_read.union(read);
            }
        }
        if self.surface_read.intersection(named(&COORDINATES)) != Outputs::NONE {
            self.want([Method::ComputeTextureCoordinates]);
        }
    }

    /// True if a method that the scene calls reads the scratch of `intersect`.
    fn reads_hit_scratch(&self) -> bool {
        let reads = |method: &Method| match method {
            Method::ComputeNormal
            | Method::ComputeTextureCoordinates
            | Method::ComputeDerivatives
            | Method::Shade
            | Method::Emission => self.linked(*method).is_none_or(|linked| linked.reads_scratch),
            // Not called for hits.
            Method::GenerateRay
            | Method::Radiance
            | Method::Intersect
            | Method::ComputeBounds
            | Method::GenerateSample
            | Method::SamplePdf
            | Method::Lookup
            | Method::Bsdf
            | Method::SampleBsdf
            | Method::EvaluatePdf
            | Method::Illumination => false,
        };
        self.methods.iter().any(reads)
    }

    /// The outputs of a method that are read.
    fn read_of(&self, method: Method) -> Outputs {
        match method {
            Method::ComputeTextureCoordinates | Method::ComputeDerivatives => self.surface_read,
            _ => Outputs::ALL.without_scratch(),
        }
    }

    /// The kernels that take one instance. Those of elements are compiled with the elements.
    fn requests(&self) -> Vec<(Method, KernelRequest)> {
        let of_instances = |method: &&Method| {
            **method != Method::Intersect
                && (!self.hit_methods_of_shapes().any(|it| it == **method)
                    || !self.placements.is_empty())
        };
        let methods = self.methods.iter().filter(of_instances).map(|method| {
            let variant = Variant::new(CallMode::Packet).reading(self.read_of(*method));
            (*method, KernelRequest::new(&self.program, *method, variant))
        });
        methods.collect()
    }

    /// The kernels of `intersect`, which take objects.
    fn intersect_requests(&self) -> Vec<KernelRequest> {
        let mut requests = Vec::new();
        let mut request = |variant: Variant| {
            requests.push(KernelRequest::new(&self.program, Method::Intersect, variant));
        };
        for is_placed in &self.placements {
            request(packet_variant(&self.program, *is_placed));
            if self.reads_hit_scratch() {
                request(hit_variant(&self.program, *is_placed));
            }
        }
        requests
    }

    /// The methods of the class that are called for hits of its shapes.
    fn hit_methods_of_shapes(&self) -> impl Iterator<Item = Method> {
        let of_shapes =
            [Method::ComputeNormal, Method::ComputeTextureCoordinates, Method::ComputeDerivatives];
        let own = self.is_own_material.then_some([Method::Shade, Method::Emission]);
        let all = of_shapes.into_iter().chain(own.into_iter().flatten());
        all.filter(|method| self.methods.contains(method))
    }
}

impl<'a> ShaderTable<'a> {
    /// Returns the number of shaders.
    pub fn len(&self) -> usize {
        self.entries.len()
    }

    /// Collects the shaders of a scene.
    pub fn new(engine: &'a Engine, scene: &Scene, purpose: Purpose) -> Self {
        let mut table = ShaderTable { engine, entries: Vec::new(), by_address: BTreeMap::new() };
        table.add_searched(scene);
        if purpose == Purpose::Shading {
            table.add_shading(scene);
            table.add_surfaces(scene);
        }
        table
    }

    /// Returns the engine that compiles the kernels.
    pub fn engine(&self) -> &Engine {
        self.engine
    }

    /// Adds all instances, with the methods that generate rays and find hits.
    fn add_searched(&mut self, scene: &Scene) {
        self.entry(&scene.camera).want([Method::GenerateRay]);
        for light in &scene.lights {
            self.entry(&light.light);
        }
        for material in &scene.materials {
            self.entry(material);
        }
        for object in &scene.objects {
            let entry = self.entry(&object.primitive);
            entry.want([Method::Intersect, Method::ComputeBounds]);
            if object.elements.is_none() {
                entry.placements.insert(!inverse(object.fixed_transform()).is_identity());
            }
        }
    }

    fn add_shading(&mut self, scene: &Scene) {
        for light in &scene.lights {
            self.entry(&light.light).want([Method::Illumination, Method::Emission]);
        }
        for material in &scene.materials {
            // Every material is compiled, so that errors in unused ones are reported too.
            self.entry(material).want_shading();
        }
        for object in &scene.objects {
            let entry = self.entry(&object.primitive);
            entry.want([Method::ComputeNormal]);
            if is_own_material(object) {
                entry.is_own_material = true;
                entry.want_shading();
            }
            if let Some(emitter) = object.emitter {
                entry.want([Method::GenerateSample]);
                self.entry(&scene.materials[emitter as usize]).want([Method::Emission]);
            }
        }
    }

    /// Adds the surface properties that shading reads.
    fn add_surfaces(&mut self, scene: &Scene) {
        for object in &scene.objects {
            let own = is_own_material(object);
            let surface = if own { &object.primitive } else { material(scene, object.material) };
            let emitter = object.emitter.map(|emitter| material(scene, emitter));
            let read = [surface].into_iter().chain(emitter);
            let read = read.map(|it| self.entry(it).shading_read());
            let read = read.fold(Outputs::NONE, Outputs::union);
            let entry = self.entry(&object.primitive);
            entry.surface_read = entry.surface_read.union(read);
        }
        self.entries.iter_mut().for_each(Entry::want_surface);
    }

    fn entry(&mut self, instance: &Instance) -> &mut Entry {
        let program = self.engine.program(instance);
        let address = Arc::as_ptr(&program) as usize;
        let index = *self.by_address.entry(address).or_insert_with(|| {
            self.entries.push(Entry {
                program,
                methods: BTreeSet::new(),
                surface_read: Outputs::NONE,
                placements: BTreeSet::new(),
                is_own_material: false,
            });
            self.entries.len() - 1
        });
        &mut self.entries[index]
    }

    /// Returns an instance of the scene prepared for its shader.
    pub fn instance(&self, instance: &Instance) -> ShaderInstance {
        let program = self.engine.program(instance);
        let shader = self.by_address.get(&(Arc::as_ptr(&program) as usize)).copied();
        let (shader, block) = (shader.unwrap_or(0), Arc::new(program.block(instance)));
        ShaderInstance { shader, block }
    }

    /// Returns an object of the scene, or each of its elements if it has any, prepared for its shader; empty if they
    /// cannot be created, which compiling reports.
    pub fn items(&self, object: &SceneObject) -> Vec<ShaderInstance> {
        let whole = self.instance(&object.primitive);
        if object.elements.is_none() {
            return vec![whole];
        }
        let program = self.engine.program(&object.primitive);
        let Ok(elements) = program.elements(&object.primitive) else { return Vec::new() };
        let shared = elements.shared();
        let items = (0..elements.len()).map(|element| {
            let mut words = shared.words().to_vec();
            for (position, word) in elements.form().words().iter().enumerate() {
                words[*word as usize] = elements.word(element, position);
            }
            let block = Arc::new(InstanceBlock::new(&words, shared.buffers().to_vec()));
            ShaderInstance { shader: whole.shader, block }
        });
        items.collect()
    }

    /// Compiles the kernels. Errors and warnings of linking go to `diagnostics`.
    pub fn compile(&self, diagnostics: &mut Diagnostics) -> Vec<Shader> {
        let of_instances: Vec<_> = self.entries.iter().map(Entry::requests).collect();
        let of_objects: Vec<_> = self.entries.iter().map(Entry::intersect_requests).collect();
        let requests = of_instances.iter().flatten().map(|(_, request)| request);
        let requests: Vec<KernelRequest> =
            requests.chain(of_objects.iter().flatten()).cloned().collect();
        let mut kernels = self.engine.compile_all(&requests).into_iter();
        let mut shaders = Vec::with_capacity(self.entries.len());
        for (entry, requests) in self.entries.iter().zip(of_instances) {
            let mut made = BTreeMap::new();
            for ((method, request), kernel) in requests.into_iter().zip(kernels.by_ref()) {
                match kernel {
                    Ok(kernel) => {
                        made.insert(method, (request.variant, kernel));
                    }
                    Err(diagnostic) => diagnostics.push(diagnostic),
                }
            }
            let hit_methods = entry.hit_methods_of_shapes();
            shaders.push(Shader {
                program: entry.program.clone(),
                kernels: made,
                surface: SurfaceNeeds::of(entry.shading_read()),
                reads_inverse_directions: entry.reads_inverse_directions(),
                reads_hit_scratch: entry.reads_hit_scratch(),
                hit_methods: hit_methods.map(|method| (method, entry.read_of(method))).collect(),
            });
        }
        // Programs keep these kernels for the objects that will request them.
        diagnostics.extend(kernels.filter_map(Result::err));
        shaders
    }
}

fn material(scene: &Scene, index: u32) -> &Instance {
    &scene.materials[index as usize]
}
