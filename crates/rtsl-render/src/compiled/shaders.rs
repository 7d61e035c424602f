//! The shaders of a scene, with the kernels that generate its rays, find its hits and bound its shapes. The callers of
//! other methods compile their kernels.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

use rtsl::{
    CallMode, Diagnostics, Engine, Instance, Kernel, KernelRequest, Method, Outputs, Program,
    Variant,
};
use rtsl_scene::Scene;

use super::intersect_variants::packet_variant;
use super::placement::inverse;
use super::shader_instance::ShaderInstance;

/// A class with the kernels that take one instance.
pub struct Shader {
    /// The linked class.
    pub program: Arc<Program>,
    kernels: BTreeMap<Method, Arc<Kernel>>,
}

impl Shader {
    /// Returns the kernel of a method, if the class has it and searches use it.
    pub fn kernel(&self, method: Method) -> Option<&Kernel> {
        self.kernels.get(&method).map(|kernel| &**kernel)
    }
}

/// Programs by first use, with the methods that searches call.
pub struct ShaderTable<'a> {
    engine: &'a Engine,
    entries: Vec<Entry>,
    by_address: BTreeMap<usize, usize>,
}

struct Entry {
    program: Arc<Program>,
    /// The methods that take one instance.
    methods: BTreeSet<Method>,
    /// The kinds of its objects that are not elements: with a transform (true) or without (false).
    placements: BTreeSet<bool>,
}

impl Entry {
    fn want(&mut self, method: Method) {
        if self.program.has(method) {
            self.methods.insert(method);
        }
    }

    /// The kernels that take one instance.
    fn requests(&self) -> Vec<(Method, KernelRequest)> {
        let methods = self.methods.iter().map(|method| {
            let outputs = Outputs::ALL.without_scratch();
            let variant = Variant::new(CallMode::Packet).reading(outputs);
            (*method, KernelRequest::new(&self.program, *method, variant))
        });
        methods.collect()
    }

    /// The kernels of `intersect`, which take objects. Those of elements are compiled with the elements.
    fn intersect_requests(&self) -> Vec<KernelRequest> {
        let request = |is_placed: &bool| {
            let variant = packet_variant(&self.program, *is_placed);
            KernelRequest::new(&self.program, Method::Intersect, variant)
        };
        self.placements.iter().map(request).collect()
    }
}

impl<'a> ShaderTable<'a> {
    /// Returns the number of shaders.
    pub fn len(&self) -> usize {
        self.entries.len()
    }

    /// Collects the shaders of a scene.
    pub fn new(engine: &'a Engine, scene: &Scene) -> Self {
        let mut table = ShaderTable { engine, entries: Vec::new(), by_address: BTreeMap::new() };
        table.entry(&scene.camera);
        for light in &scene.lights {
            table.entry(&light.light);
        }
        for material in &scene.materials {
            table.entry(material);
        }
        for object in &scene.objects {
            let entry = table.entry(&object.primitive);
            entry.want(Method::ComputeBounds);
            if object.elements.is_none() {
                entry.placements.insert(!inverse(object.fixed_transform()).is_identity());
            }
        }
        table
    }

    /// Returns the engine that compiles the kernels.
    pub fn engine(&self) -> &Engine {
        self.engine
    }

    fn entry(&mut self, instance: &Instance) -> &mut Entry {
        let program = self.engine.program(instance);
        let address = Arc::as_ptr(&program) as usize;
        let index = *self.by_address.entry(address).or_insert_with(|| {
            let (methods, placements) = (BTreeSet::new(), BTreeSet::new());
            self.entries.push(Entry { program, methods, placements });
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
            for ((method, _), kernel) in requests.into_iter().zip(kernels.by_ref()) {
                match kernel {
                    Ok(kernel) => {
                        made.insert(method, kernel);
                    }
                    Err(diagnostic) => diagnostics.push(diagnostic),
                }
            }
            shaders.push(Shader { program: entry.program.clone(), kernels: made });
        }
        // Programs keep these kernels for the objects that will request them.
        diagnostics.extend(kernels.filter_map(Result::err));
        shaders
    }
}
