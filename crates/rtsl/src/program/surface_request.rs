//! Kernels that compute the surfaces of hits, for hosts that call methods of materials by themselves.

use std::collections::BTreeMap;
use std::sync::{Arc, Mutex, PoisonError};

use rtsl_abi::Layout;
use rtsl_integrate::hit_surface::{SurfaceColumns, SurfaceResults, link_hit_surface};
use rtsl_integrate::surface::Places;
use rtsl_ir::Function;
use rtsl_source::Diagnostic;
use rtsl_spec::Method;

use super::kernel_cache::KernelCell;
use super::program::Program;
use super::surface_class::{DESCRIBING, ShapeClass};
use crate::codegen::kernel::Kernel;
use crate::codegen::kernel_compiler::KernelCompiler;
use crate::codegen::kernel_source::KernelSource;
use crate::codegen::variant::Variant;
use crate::nesting;

/// The form of a kernel that computes surfaces.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct SurfaceForm {
    /// The results.
    pub results: SurfaceResults,
    /// True if instances place groups of shapes.
    pub are_grouped: bool,
    /// True if light samples may choose the surfaces.
    pub are_sampled: bool,
    /// The first of the [columns](SurfaceColumns), after the scratch arrays of the class.
    pub first_column: u32,
}

/// A kernel that computes surfaces, of shapes that are in the world or their group, or have a
/// [placement](Variant::placed). The same operations are parts of stages that know the shapes, with the same bits.
#[derive(Clone, Debug)]
pub struct SurfaceRequest {
    /// The program of the shapes.
    pub program: Arc<Program>,
    /// The form.
    pub form: SurfaceForm,
    /// The objects for which it is called.
    pub variant: Variant,
}

/// The kernels of a program's surfaces.
#[derive(Debug, Default)]
pub(super) struct SurfaceKernels {
    cells: Mutex<BTreeMap<(SurfaceForm, Variant), Arc<KernelCell>>>,
}

impl SurfaceKernels {
    fn cell(&self, form: SurfaceForm, variant: &Variant) -> Arc<KernelCell> {
        let mut cells = self.cells.lock().unwrap_or_else(PoisonError::into_inner);
        cells.entry((form, variant.clone())).or_default().clone()
    }
}

impl SurfaceRequest {
    /// Returns the kernel, made at the first call.
    ///
    /// # Errors
    /// If linking passes a limit, or code generation fails.
    pub fn kernel(&self) -> Result<Arc<Kernel>, Diagnostic> {
        let cell = self.program.surfaces().cell(self.form, &self.variant);
        cell.get_or_init(|| nesting::with_deep_stack(|| self.make()).map(Arc::new)).clone()
    }

    fn make(&self) -> Result<Kernel, Diagnostic> {
        let compiler = self.program.compiler();
        let layout = self.layout();
        let function = self.link(compiler, &layout)?;
        let layout = self.variant.layout(&layout);
        compiler.linked_kernel(KernelSource::new(
            &function,
            &self.variant,
            &layout,
            compiler.width(),
        ))
    }

    fn link(&self, compiler: &KernelCompiler, layout: &Layout) -> Result<Function, Diagnostic> {
        let SurfaceRequest { program, form, variant } = self;
        let intersect = program.placed_method(Method::Intersect, variant.placed)?;
        for method in DESCRIBING.into_iter().filter(|method| program.has(*method)) {
            program.method(method)?;
        }
        let of = (variant.placed, form.are_sampled);
        let shapes = ShapeClass::with_prefix(program, String::new(), of);
        let mut shapes = shapes.expect("the methods are linked").links().clone();
        shapes.places = Places::Columns { are_grouped: form.are_grouped };
        if let SurfaceResults::Surface { keeps_scratch: true, .. } = form.results {
            shapes.methods.insert(Method::Intersect, intersect);
        }
        if form.results == SurfaceResults::Density {
            shapes.density = Some(program.method(Method::SamplePdf)?);
        }
        let name = format!("{}.surface", program.class().name);
        let is_traced = compiler.options().trace.is_some();
        let linked = link_hit_surface(name, &shapes, program.scratch(), form.results, is_traced)?;
        Ok(match is_traced {
            true => linked.function,
            false => compiler.optimise_stage(linked.function, variant, layout),
        })
    }

    /// The layout of the class, with the columns.
    fn layout(&self) -> Layout {
        let mut layout = self.program.layout().clone();
        let first = self.form.first_column;
        layout.scratch.extend(SurfaceColumns::names().zip(first..));
        layout.scratch_arrays = first + SurfaceColumns::COUNT as u32;
        layout
    }
}
