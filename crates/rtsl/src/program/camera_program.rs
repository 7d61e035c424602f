//! The camera of a scene as a part of stages.

use std::sync::Arc;

use rtsl_abi::{CallMode, InstanceBlock, Layout};
use rtsl_integrate::camera::{
    CAMERA, CameraLinks, EPSILON, FILTER, MAP, PIXEL_COLUMNS, SIZE, WEIGHT_COLUMNS, link_camera,
};
use rtsl_integrate::sampler::{KEY_COLUMN, SAMPLE_COLUMN};
use rtsl_ir::Function;
use rtsl_math::sampling::{PixelFilter, Sampler};
use rtsl_source::Diagnostic;
use rtsl_spec::Method;

use super::members::Members;
use super::program::Program;
use super::staged_program::{joined, shared_scratch};
use super::surface_class::add_part;
use crate::codegen::kernel_compiler::KernelCompiler;
use crate::codegen::variant::Variant;

/// A class of cameras with a sampler and a pixel filter. Its kernel computes the rays of samples: it reads the pixels
/// and the indices of samples in [arrays](CameraArrays), and stores the rays in the world as state, and their times,
/// weights and keys in arrays that stages read.
#[derive(Debug)]
pub struct CameraProgram {
    program: Arc<Program>,
    links: CameraLinks,
    layout: Layout,
    arrays: CameraArrays,
}

/// The scratch arrays of a camera's kernel, by index.
#[derive(Clone, Copy, Debug)]
pub struct CameraArrays {
    /// The column and the row of each sample's pixel, counted from the top left of the image.
    pub pixels: [usize; 2],
    /// The index of each sample.
    pub sample: usize,
    /// The key of each path's numbers.
    pub key: usize,
    /// The weight of each path's radiance.
    pub weights: [usize; 3],
}

/// The image that a camera makes, and its place.
#[derive(Clone, Copy, Debug)]
pub struct CameraView {
    /// The width and the height of the image in pixels, below 2^31.
    pub size: [u32; 2],
    /// The map from the camera's space to the world: the images of the axes, then that of the origin.
    pub map: [[f32; 3]; 4],
    /// The least distance of hits, unless the camera sets another.
    pub epsilon: f32,
}

impl CameraProgram {
    /// Links a class of cameras.
    ///
    /// # Errors
    /// If linking passes a limit.
    pub fn new(
        program: &Arc<Program>,
        sampler: Sampler,
        filter: &PixelFilter,
    ) -> Result<CameraProgram, Diagnostic> {
        let method = Method::GenerateRay;
        let generate = program.has(method).then(|| program.method(method)).transpose()?;
        let links = CameraLinks { generate, sampler, filter: filter.clone() };
        let mut layout = shared_scratch();
        add_part(&mut layout, CAMERA, program.layout());
        // The layout is the same whatever the view.
        let view = CameraView { size: [1; 2], map: [[0.0; 3]; 4], epsilon: 0.0 };
        let (members, _) = view.members(&links.filter).finish();
        add_part(&mut layout, "", &members);
        let arrays = CameraArrays::of(&layout);
        Ok(CameraProgram { program: program.clone(), links, layout, arrays })
    }

    /// The program of the class.
    pub fn program(&self) -> &Arc<Program> {
        &self.program
    }

    /// Returns the data for which the kernel is called.
    ///
    /// # Panics
    /// If the camera belongs to another program.
    pub fn block(&self, camera: &InstanceBlock, view: &CameraView) -> InstanceBlock {
        let (_, members) = view.members(&self.links.filter).finish();
        joined(&[camera.clone(), members])
    }

    /// The scratch arrays through which the kernel meets a host.
    pub fn arrays(&self) -> &CameraArrays {
        &self.arrays
    }

    /// The number of scratch arrays.
    pub fn scratch_arrays(&self) -> usize {
        self.layout.scratch_arrays as usize
    }

    /// True if the kernel of another program serves this one, whatever the data.
    pub fn is_like(&self, other: &CameraProgram) -> bool {
        Arc::ptr_eq(&self.program, &other.program)
            && (self.links.sampler, &self.links.filter)
                == (other.links.sampler, &other.links.filter)
    }

    /// Returns the linked and optimised function, with the layout of its kernel and its variant.
    pub(crate) fn link(
        &self,
        has_footprints: bool,
        compiler: &KernelCompiler,
    ) -> Result<(Function, Layout, Variant), Diagnostic> {
        let name = format!("{}.{}", self.program.class().name, Method::GenerateRay.name());
        let linked = link_camera(name, &self.links, has_footprints)?.function;
        let variant = Variant::new(CallMode::Packet);
        let function = compiler.optimise_stage(linked, &variant, &self.layout);
        Ok((function, self.layout.clone(), variant))
    }
}

impl CameraArrays {
    fn of(layout: &Layout) -> CameraArrays {
        let array = |column: &str| layout.scratch[column] as usize;
        CameraArrays {
            pixels: PIXEL_COLUMNS.map(array),
            sample: array(SAMPLE_COLUMN),
            key: array(KEY_COLUMN),
            weights: WEIGHT_COLUMNS.map(array),
        }
    }
}

impl CameraView {
    /// The members beside those of the class, with the tables of the pixel filter.
    fn members(&self, filter: &PixelFilter) -> Members {
        let CameraView { size, map, epsilon } = self;
        let mut members = Members::default();
        members.add(SIZE, *size);
        members.add(MAP, map.as_flattened().iter().map(|it| it.to_bits()));
        members.add(EPSILON, [epsilon.to_bits()]);
        for (axis, table) in filter.tables().into_iter().flatten().enumerate() {
            let parts = FILTER.iter().zip([table.distances(), table.sign_changes()]);
            for (names, part) in parts.filter(|(_, part)| !part.is_empty()) {
                members.add(names[axis], part.iter().map(|it| it.to_bits()));
            }
        }
        members
    }
}
