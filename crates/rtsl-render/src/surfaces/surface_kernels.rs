//! The kernels that compute surfaces of shapes of one class, and their calls.

use std::sync::Arc;

use rtsl::host::Host;
use rtsl::{
    CallArguments, HostQuery, Instances, Kernel, LaneBlock, Method, Program, QueryForm,
    SurfaceNeeds,
};

use super::places::Places;
use crate::compiled::CompiledScene;
use crate::compiled::calls::Callee;
use crate::compiled::kernels::{Batching, KernelMaker};
use crate::compiled::runtime_errors::RuntimeErrors;
use crate::integrate::query_block::QueryBlock;
use crate::integrate::wavefront::PathHit;

/// The kernels for shapes of a traversal class.
pub struct SurfaceKernels {
    class: u32,
    surface: Arc<Kernel>,
    density: Option<Arc<Kernel>>,
    /// The method whose name errors of calls have: the first that has a loop.
    looping: Method,
}

/// The results that are read.
#[derive(Clone, Copy, Debug, Default)]
pub struct ReadSurfaces {
    /// The properties.
    pub needs: SurfaceNeeds,
    /// True if methods of the same class read the scratch that `intersect` leaves.
    pub keeps_scratch: bool,
    /// True if light samples may choose the surfaces.
    pub are_sampled: bool,
    /// True if their densities are read.
    pub has_densities: bool,
}

/// Hits with the memory of their surfaces.
pub struct SurfaceCall<'a> {
    /// The hits.
    pub hits: &'a [PathHit],
    /// The shapes.
    pub instances: Instances<'a>,
    /// The state that the kernels store.
    pub state: &'a mut LaneBlock,
    /// The columns, with the scratch of the shapes.
    pub columns: &'a mut QueryBlock,
    /// The random numbers of methods.
    pub host: &'a mut dyn Host,
}

/// The methods of shapes that compute surfaces, in the order of their calls.
const METHODS: [Method; 5] = [
    Method::Intersect,
    Method::ComputeNormal,
    Method::SamplePdf,
    Method::ComputeTextureCoordinates,
    Method::ComputeDerivatives,
];

impl SurfaceKernels {
    /// Compiles the kernels for shapes; `None` while requests are collected.
    pub fn new(
        maker: &mut KernelMaker<'_>,
        scene: &CompiledScene,
        class: u32,
        of: Batching,
        read: ReadSurfaces,
    ) -> Option<SurfaceKernels> {
        let ReadSurfaces { needs, keeps_scratch, are_sampled, has_densities } = read;
        let are_grouped = scene.is_placed_by_instances(class);
        let shapes = scene.class(class);
        let program = shapes.program();
        let mut kernel = |query: HostQuery| {
            let first_column = scene.scratch_arrays as u32;
            let form = QueryForm { query, are_grouped, are_sampled, first_column };
            maker.query(program, of, &shapes.objects, shapes.is_placed(), form)
        };
        let density = if has_densities { kernel(HostQuery::Density) } else { None };
        let surface = kernel(HostQuery::Surface { needs, keeps_scratch })?;
        let looping = METHODS.into_iter().find(|method| has_loop(program, *method));
        let looping = looping.unwrap_or(Method::ComputeNormal);
        Some(SurfaceKernels { class, surface, density, looping })
    }

    /// The traversal class.
    pub fn class(&self) -> u32 {
        self.class
    }

    /// The kernel of the surfaces.
    pub fn surface(&self) -> &Kernel {
        &self.surface
    }

    /// The kernel of the densities with which light samples find surfaces, if they are read.
    pub fn density(&self) -> Option<&Kernel> {
        self.density.as_deref()
    }

    /// Calls a kernel for hits, whose rays are in the columns.
    pub fn call(
        &self,
        kernel: &Kernel,
        scene: &CompiledScene,
        errors: &RuntimeErrors,
        SurfaceCall { hits, instances, state, columns, host }: SurfaceCall<'_>,
    ) {
        let places = Places::new(scene, self.class);
        places.store(hits, columns);
        let callee = Callee { class: &scene.class(self.class).name, method: self.looping, errors };
        let (count, mask, accepted) = (hits.len(), None, None);
        let scratch = &mut columns.block;
        callee
            .call(kernel, CallArguments { state, scratch, count, mask, accepted, instances, host });
    }
}

fn has_loop(program: &Program, method: Method) -> bool {
    program.method(method).is_ok_and(|linked| linked.has_loops())
}
