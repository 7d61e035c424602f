//! Surface groups: shapes of one traversal class with materials of one class, and the kernels that are called for them.

use std::collections::BTreeSet;
use std::sync::Arc;

use rtsl::{
    ATTRIBUTES, HitPlacement, Kernel, LinkedMethod, Method, Objects, Outputs, Program, Query,
    StateVariable, TO_OBJECT, TO_WORLD, Variant, lookup_state,
};

use super::group_plan::Classes;
use super::instance_classes::InstanceClassId;
use super::kernels::{Batching, KernelMaker};
use super::material::{MaterialKernels, MaterialSource, called_methods, is_shaded};
use super::object_class::ObjectClass;
use crate::surfaces::SurfaceNeeds;

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
    /// The surface properties to compute.
    pub needs: SurfaceNeeds,
    /// True if methods of the shapes may read normals, whether they are called or not: these are then normalised, as
    /// in stages.
    pub shapes_read_normals: bool,
    /// The shapes' methods.
    pub shape: ShapeKernels,
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

/// The methods of shapes.
#[derive(Default)]
pub struct ShapeKernels {
    /// `intersect`, if a method reads its scratch.
    pub hit: Option<Arc<Kernel>>,
    /// `computeNormal`.
    pub normal: Option<Arc<Kernel>>,
    /// `computeTextureCoordinates`.
    pub coordinates: Option<Arc<Kernel>>,
    /// `computeDerivatives`.
    pub derivatives: Option<Arc<Kernel>>,
    /// `samplePDF`.
    pub density: Option<Arc<Kernel>>,
    /// The parts of hits that `computeNormal` sets.
    pub placement: HitPlacement,
}

/// The programs and instances of a group's parts.
pub struct GroupParts<'a> {
    /// The shapes.
    pub class: &'a ObjectClass,
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
        let program = parts.class.program();
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
        if let MaterialSource::Class(_) = key.material.0 {
            // Materials have separate scratch.
            read.scratch = false;
        }
        // Every answer and every cut needs the properties that others are computed from.
        let is_prepared = !queries.is_empty() || parts.alpha.is_some();
        let is_sampled = key.is_sampled && queries.contains(&Query::LightPdf);
        let shape = is_prepared
            .then(|| ShapeKernels::new(maker, parts.class, (key.shape, is_sampled), &mut read));
        let mut kernel = |part: Option<(&Arc<Program>, &Objects)>, of, method: Method| {
            let (program, objects) = part?;
            let outputs = Outputs::ALL.without_scratch();
            maker.kernel(program, method, (of, objects), outputs)
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
            needs: read.needs(program),
            shapes_read_normals: program.has(Method::ComputeTextureCoordinates)
                || program.has(Method::ComputeDerivatives)
                || key.is_sampled && program.has(Method::SamplePdf),
            shape: shape.unwrap_or_default(),
            material: MaterialKernels::new(maker, material, (of, objects), queries),
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

    /// Returns the properties to compute for shapes of a program.
    fn needs(&self, shapes: &Program) -> SurfaceNeeds {
        let needs = SurfaceNeeds::of(self.state);
        SurfaceNeeds {
            // Widths are relative to surface parameters.
            derivatives: needs.derivatives || needs.footprints,
            inverse_directions: needs.inverse_directions || reads_inverse(shapes),
            ..needs
        }
    }
}

/// The methods of shapes that compute what other methods read of surfaces.
pub struct ShapeSurface {
    /// The methods.
    pub kernels: ShapeKernels,
    /// The properties to compute.
    pub needs: SurfaceNeeds,
}

impl ShapeSurface {
    /// Compiles the methods for readers that do not share scratch with the shapes.
    pub fn new(
        maker: &mut KernelMaker<'_>,
        shapes: &ObjectClass,
        of: Batching,
        readers: &[Arc<LinkedMethod>],
    ) -> Self {
        let mut read = Read::by(readers);
        read.scratch = false;
        let kernels = ShapeKernels::new(maker, shapes, (of, false), &mut read);
        ShapeSurface { kernels, needs: read.needs(shapes.program()) }
    }
}

impl ShapeKernels {
    /// Returns the kernel of a method, if the shapes have it and its results are read.
    pub fn kernel(&self, method: Method) -> Option<&Kernel> {
        let kernel = match method {
            Method::Intersect => &self.hit,
            Method::ComputeNormal => &self.normal,
            Method::ComputeTextureCoordinates => &self.coordinates,
            Method::ComputeDerivatives => &self.derivatives,
            Method::SamplePdf => &self.density,
            _ => return None,
        };
        kernel.as_deref()
    }

    /// Compiles the methods that compute `read`; their own inputs are added to it.
    fn new(
        maker: &mut KernelMaker<'_>,
        class: &ObjectClass,
        (of, is_sampled): (Batching, bool),
        read: &mut Read,
    ) -> Self {
        let program = class.program();
        let linked = |method: Method| program.method(method).ok();
        let mut methods = vec![Method::ComputeNormal];
        let needs = SurfaceNeeds::of(read.state);
        if (needs.derivatives || needs.footprints) && program.has(Method::ComputeDerivatives) {
            methods.push(Method::ComputeDerivatives);
            linked(Method::ComputeDerivatives).iter().for_each(|it| read.add(it));
        }
        if SurfaceNeeds::of(read.state).coordinates {
            methods.push(Method::ComputeTextureCoordinates);
        }
        if is_sampled {
            methods.push(Method::SamplePdf);
        }
        for method in &methods {
            linked(*method).iter().for_each(|it| read.scratch |= it.reads_scratch);
        }
        let mut surface = read.state;
        if needs.footprints {
            surface = surface
                .union(Outputs::state(["rt_dPdu", "rt_dPdv"].into_iter().filter_map(lookup_state)));
        }
        let mut kernel = |method: Method| {
            let outputs = match method {
                Method::ComputeTextureCoordinates | Method::ComputeDerivatives => surface,
                _ => Outputs::ALL.without_scratch(),
            };
            let is_called = methods.contains(&method);
            let objects = (of, &*class.objects);
            if is_called { maker.kernel(program, method, objects, outputs) } else { None }
        };
        let (normal, coordinates) =
            (kernel(Method::ComputeNormal), kernel(Method::ComputeTextureCoordinates));
        let (derivatives, density) =
            (kernel(Method::ComputeDerivatives), kernel(Method::SamplePdf));
        let hit = read.scratch.then(|| {
            let variant = Variant::new(of.shape()).of_objects(class.objects.form().clone());
            let variant = variant.reading(Outputs::NONE.with_scratch());
            let variant = if class.is_placed() { variant.placed() } else { variant };
            maker.kernel_of(program, Method::Intersect, variant)
        });
        let placement = linked(Method::ComputeNormal).map(|it| it.hit_placement);
        let placement = placement.unwrap_or_default();
        ShapeKernels { hit: hit.flatten(), normal, coordinates, derivatives, density, placement }
    }
}

/// True if a shape's method that is called for hits reads the reciprocal direction of rays.
fn reads_inverse(program: &Program) -> bool {
    let methods =
        [Method::ComputeNormal, Method::ComputeTextureCoordinates, Method::ComputeDerivatives];
    let linked: Vec<_> =
        methods.into_iter().filter_map(|method| program.method(method).ok()).collect();
    SurfaceNeeds::of(Read::by(&linked).state).inverse_directions
}

#[cfg(test)]
#[path = "surface_group_tests.rs"]
mod tests;
