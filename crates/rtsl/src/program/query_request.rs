//! Kernels that answer queries of hosts: the surfaces of hits, light samples, skies.

use std::collections::BTreeMap;
use std::sync::{Arc, Mutex, PoisonError};

use rtsl_abi::Layout;
use rtsl_integrate::host_query::QueryLink;
use rtsl_integrate::lights::LightLink;
use rtsl_integrate::query_columns::{HostQuery, QueryColumns};
use rtsl_integrate::surface::{Places, ShapeLinks};
use rtsl_link::Linked;
use rtsl_source::Diagnostic;
use rtsl_spec::Method;

use super::kernel_cache::KernelCell;
use super::program::Program;
use super::surface_class::{DESCRIBING, ShapeClass};
use crate::codegen::kernel::Kernel;
use crate::codegen::kernel_source::KernelSource;
use crate::codegen::variant::Variant;
use crate::nesting;

/// The form of a kernel that answers a query.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct QueryForm {
    /// The query.
    pub query: HostQuery,
    /// True if instances place groups of shapes.
    pub are_grouped: bool,
    /// True if light samples may choose the shapes.
    pub are_sampled: bool,
    /// The first of the [columns](QueryColumns), after the scratch arrays of the class.
    pub first_column: u32,
}

/// A kernel that answers a query about shapes, which are in the world or their group or have a
/// [placement](Variant::placed), or about lights. The same operations are parts of stages that know the classes, with
/// the same bits.
#[derive(Clone, Debug)]
pub struct QueryRequest {
    /// The program of the shapes or the lights.
    pub program: Arc<Program>,
    /// The form.
    pub form: QueryForm,
    /// The objects for which it is called.
    pub variant: Variant,
}

/// The kernels of a program's queries.
#[derive(Debug, Default)]
pub(super) struct QueryKernels {
    cells: Mutex<BTreeMap<(QueryForm, Variant), Arc<KernelCell>>>,
}

impl QueryKernels {
    fn cell(&self, form: QueryForm, variant: &Variant) -> Arc<KernelCell> {
        let mut cells = self.cells.lock().unwrap_or_else(PoisonError::into_inner);
        cells.entry((form, variant.clone())).or_default().clone()
    }
}

impl QueryRequest {
    /// Returns the kernel, made at the first call.
    ///
    /// # Errors
    /// If the class lacks a method, linking passes a limit, or code generation fails.
    pub fn kernel(&self) -> Result<Arc<Kernel>, Diagnostic> {
        let cell = self.program.queries().cell(self.form, &self.variant);
        cell.get_or_init(|| nesting::with_deep_stack(|| self.make()).map(Arc::new)).clone()
    }

    fn make(&self) -> Result<Kernel, Diagnostic> {
        let compiler = self.program.compiler();
        let layout = self.variant.layout(&self.layout());
        let mut function = self.link()?.function;
        // A trace shows methods as they are written.
        if compiler.options().trace.is_none() {
            function = compiler.optimise_stage(function, &self.variant, &layout);
        }
        let width = compiler.width();
        compiler.linked_kernel(KernelSource::new(&function, &self.variant, &layout, width))
    }

    fn link(&self) -> Result<Linked, Diagnostic> {
        let QueryRequest { program, form, .. } = self;
        let name = format!("{}.query", program.class().name);
        let link = QueryLink::new(name, program.compiler().options().trace.is_some());
        match form.query {
            HostQuery::Surface { needs, keeps_scratch } => {
                let mut shapes = self.shapes()?;
                if !keeps_scratch {
                    return link.surface(&shapes, needs, &[]);
                }
                let is_placed = self.variant.placed;
                let intersect = program.placed_method(Method::Intersect, is_placed)?;
                shapes.methods.insert(Method::Intersect, intersect);
                link.surface(&shapes, needs, program.scratch())
            }
            HostQuery::Density => {
                let density = Some(program.method(Method::SamplePdf)?);
                link.density(&ShapeLinks { density, ..self.shapes()? })
            }
            HostQuery::SampledPoint => {
                link.sampled_point(&self.shapes()?, &program.method(Method::GenerateSample)?)
            }
            HostQuery::SampledEmission(weighing) => {
                link.sampled_emission(&*program.method(Method::Emission)?, weighing)
            }
            HostQuery::SampledAlpha(weighing) => {
                link.sampled_alpha(&*program.method(Method::Lookup)?, weighing)
            }
            HostQuery::Illumination { is_placed, is_weighed } => {
                let illumination = Some(program.method(Method::Illumination)?);
                let light = LightLink { illumination, is_placed, is_weighed, ..self.light() };
                link.illumination(&light)
            }
            HostQuery::SkyEmission => {
                let emission = Some(program.method(Method::Emission)?);
                link.sky_emission(&LightLink { emission, ..self.light() })
            }
            HostQuery::SkyDensity => {
                let density = Some(program.method(Method::EvaluatePdf)?);
                link.sky_density(&LightLink { density, ..self.light() })
            }
        }
    }

    /// Links the methods that describe shapes.
    fn shapes(&self) -> Result<ShapeLinks, Diagnostic> {
        let QueryRequest { program, form, variant } = self;
        program.placed_method(Method::Intersect, variant.placed)?;
        for method in DESCRIBING.into_iter().filter(|method| program.has(*method)) {
            program.method(method)?;
        }
        let shapes =
            ShapeClass::with_prefix(program, String::new(), variant.placed, form.are_sampled);
        let shapes = shapes.expect("the methods are linked").links().clone();
        Ok(ShapeLinks { places: Places::Columns { are_grouped: form.are_grouped }, ..shapes })
    }

    /// A light without methods.
    fn light(&self) -> LightLink {
        LightLink {
            prefix: String::new(),
            illumination: None,
            emission: None,
            density: None,
            is_placed: true,
            is_weighed: false,
            places: Places::Columns { are_grouped: false },
        }
    }

    /// The layout of the class, with the columns.
    fn layout(&self) -> Layout {
        let mut layout = self.program.layout().clone();
        let first = self.form.first_column;
        layout.scratch.extend(QueryColumns::names().zip(first..));
        layout.scratch_arrays = first + QueryColumns::COUNT as u32;
        layout
    }
}
