//! Surface groups: shapes of one traversal class with materials of one class, and the kernels that are called for them.

use std::collections::BTreeSet;
use std::sync::Arc;

use rtsl::{
    ATTRIBUTES, Kernel, LinkedMethod, Method, Objects, Outputs, Program, Query, StateVariable,
    SurfaceNeeds, TO_OBJECT, TO_WORLD, lookup_state,
};

use super::CompiledScene;
use super::group_plan::Classes;
use super::instance_classes::InstanceClassId;
use super::kernels::{Batching, KernelMaker};
use super::material::{MaterialKernels, MaterialSource, called_methods, is_shaded};
use crate::surfaces::{ReadSurfaces, SurfaceKernels};

/// The key of a surface group.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct GroupKey {
    /// The traversal class.
    pub class: u32,
    /// The object by its index in the class, if the class has few: calls for one object read its members once.
    pub shape: Batching,
    /// The materials.
    pub material: (MaterialSource, Batching),
    /// The materials of additional emission.
    pub emitter: Option<(InstanceClassId, Batching)>,
    /// The alpha textures.
    pub alpha: Option<(InstanceClassId, Batching)>,
    /// True if light sampling can select the surfaces, so that hits need densities.
    pub is_sampled: bool,
}

/// A group of surfaces that are shaded together.
pub struct SurfaceGroup {
    /// The key.
    pub key: GroupKey,
    /// The kernels that compute surfaces, if anything is asked about them.
    pub surfaces: Option<SurfaceKernels>,
    /// True if indices of objects, instances and elements are read.
    pub needs_numbers: bool,
    /// The materials' methods.
    pub material: MaterialKernels,
    /// The emitters' `emission`.
    pub emitter: Option<Arc<Kernel>>,
    /// The textures' `lookup`.
    pub alpha: Option<Arc<Kernel>>,
    /// The number of scratch arrays of the material.
    pub material_scratch: usize,
    /// The methods of the material that take random numbers.
    pub drawing: BTreeSet<Method>,
    /// True if the emitters' `emission` takes them.
    pub emitter_draws: bool,
}

/// The programs and instances of a group's parts.
pub struct GroupParts<'a> {
    /// The traversal classes of shapes.
    pub compiled: &'a CompiledScene,
    /// The materials.
    pub material: (&'a Arc<Program>, &'a Objects),
    /// The emitters.
    pub emitter: Option<(&'a Arc<Program>, &'a Objects)>,
    /// The alpha textures.
    pub alpha: Option<(&'a Arc<Program>, &'a Objects)>,
}

impl GroupKey {
    /// True if the material has only `shade`.
    pub fn is_shaded(&self, classes: &Classes<'_>) -> bool {
        is_shaded(classes.material_of(self))
    }
}

impl SurfaceGroup {
    /// Compiles the kernels of a group that answer these queries.
    pub fn new(
        maker: &mut KernelMaker<'_>,
        key: GroupKey,
        parts: &GroupParts<'_>,
        queries: &BTreeSet<Query>,
    ) -> Self {
        let (material, objects) = parts.material;
        let (_, of) = key.material;
        let linked = |program: &Program, method: Method| program.method(method).ok();
        let methods = called_methods(material, queries);
        let mut readers: Vec<Arc<LinkedMethod>> =
            methods.iter().filter_map(|method| linked(material, *method)).collect();
        let emitter = parts.emitter.filter(|_| queries.contains(&Query::LightEmission));
        let emission = emitter.and_then(|(emitter, _)| linked(emitter, Method::Emission));
        let lookup = parts.alpha.and_then(|(texture, _)| linked(texture, Method::Lookup));
        readers.extend(emission.into_iter().chain(lookup));
        let mut read = Read::by(readers.iter());
        if queries.contains(&Query::SurfaceProperties) {
            let properties = SURFACE_PROPERTIES.iter().filter_map(|name| lookup_state(name));
            read.state = read.state.union(Outputs::state(properties));
            let emitter = parts.emitter.map(|(emitter, _)| emitter);
            read.add_properties_of_materials(LINKED_METHODS, [Some(material), emitter]);
        }
        // Every answer and every cut needs the properties that others are computed from.
        let is_prepared = !queries.is_empty() || parts.alpha.is_some();
        let reads = ReadSurfaces {
            needs: read.needs(),
            // Other materials have separate scratch.
            keeps_scratch: read.scratch && key.material.0 == MaterialSource::Own,
            are_sampled: key.is_sampled,
            has_densities: key.is_sampled && queries.contains(&Query::LightPdf),
        };
        let surfaces = || SurfaceKernels::new(maker, parts.compiled, key.class, key.shape, reads);
        let surfaces = is_prepared.then(surfaces).flatten();
        let mut kernel = |part: Option<(&Arc<Program>, &Objects)>, of, method: Method| {
            let (program, objects) = part?;
            let outputs = Outputs::ALL.without_scratch();
            maker.kernel(program, method, of, objects, outputs)
        };
        let emitter_kernel = key.emitter.and_then(|(_, of)| kernel(emitter, of, Method::Emission));
        let alpha = key.alpha.and_then(|(_, of)| kernel(parts.alpha, of, Method::Lookup));
        let draws = |program: &Program, method: Method| {
            linked(program, method).is_some_and(|it| it.draws_numbers())
        };
        let drawing = methods.into_iter().filter(|it| draws(material, *it)).collect();
        let emitter_draws = parts.emitter.is_some_and(|(it, _)| draws(it, Method::Emission));
        let material_scratch = match key.material.0 {
            MaterialSource::Own => 0,
            MaterialSource::Class(_) => material.layout().scratch_arrays as usize,
        };
        SurfaceGroup {
            key,
            surfaces,
            needs_numbers: read.any(&NUMBERS),
            material: MaterialKernels::new(maker, material, of, objects, queries),
            emitter: emitter_kernel,
            alpha,
            material_scratch,
            drawing,
            emitter_draws,
        }
    }
}

/// The state with the properties of surfaces that integrators may read.
const SURFACE_PROPERTIES: [&str; 6] =
    ["rt_TextureUV", "rt_TextureUVW", "rt_dPdu", "rt_dPdv", "rt_du", "rt_dv"];

/// The methods of materials that stages are linked with.
const LINKED_METHODS: [Method; 4] =
    [Method::Emission, Method::Bsdf, Method::SampleBsdf, Method::EvaluatePdf];

/// The state with properties of surfaces that materials alone read, which few do.
const PROPERTIES_OF_MATERIALS: [&str; 3] = [ATTRIBUTES, TO_OBJECT, TO_WORLD];

/// The state with the indices of what a ray hits.
const NUMBERS: [&str; 3] = ["rt_ObjectNumber", "rt_InstanceNumber", "rt_ElementNumber"];

/// Returns the surface properties that methods read.
pub fn needs_of<'a>(methods: impl IntoIterator<Item = &'a Arc<LinkedMethod>>) -> SurfaceNeeds {
    Read::by(methods).needs()
}

/// The surface properties that methods read.
struct Read {
    state: Outputs,
    scratch: bool,
}

impl Read {
    fn by<'a>(methods: impl IntoIterator<Item = &'a Arc<LinkedMethod>>) -> Self {
        let mut read = Read { state: Outputs::NONE, scratch: false };
        methods.into_iter().for_each(|method| read.add(method));
        read
    }

    fn add(&mut self, method: &LinkedMethod) {
        let reads: &[&'static StateVariable] = &method.reads;
        self.state = self.state.union(Outputs::state(reads.iter().copied()));
        self.scratch |= method.reads_scratch;
    }

    /// Adds the properties that materials alone read, if these methods read them.
    fn add_properties_of_materials<const N: usize>(
        &mut self,
        methods: [Method; N],
        materials: [Option<&Arc<Program>>; 2],
    ) {
        let programs = materials.into_iter().flatten();
        let linked = programs.flat_map(|it| methods.map(|method| it.method(method).ok()));
        let read = Read::by(linked.flatten().collect::<Vec<_>>().iter());
        let properties = PROPERTIES_OF_MATERIALS.iter().filter_map(|name| lookup_state(name));
        let read = read.state.intersection(Outputs::state(properties));
        self.state = self.state.union(read);
    }

    /// Returns the properties to compute.
    fn needs(&self) -> SurfaceNeeds {
        SurfaceNeeds::of(|variable| self.state.has_state(variable))
    }

    /// True if any of these state variables is read.
    fn any(&self, names: &[&str]) -> bool {
        names.iter().filter_map(|name| lookup_state(name)).any(|it| self.state.has_state(it))
    }
}

#[cfg(test)]
#[path = "surface_group_tests.rs"]
mod tests;
