//! Integrators written in RTSL.
//!
//! An engine with machine code runs them as [stages](staged). Without, and where they are evaluated for given rays, the
//! whole of `radiance` runs on the interpreter, ray by ray, and each query is answered at once: a search with one ray,
//! a call of a material's method with one lane. This defines the meaning of integrators; stages have the same bits.
//!
//! # Random numbers
//!
//! Numbers depend on the pixel, the sample and the queries of the path before, never on other paths. `sample1D` and
//! `sample2D` are functions of the dimension. Every query for a light, a sky, a shadow ray or `shade`, and every other
//! one whose method takes random numbers, has a separate sequence for its methods: the sequence's index counts such
//! queries since the last search, among the sequences of that search; light samples are counted apart. So the numbers
//! of one surface are stratified over the samples of a pixel, whatever the surfaces before it have asked.

mod evaluation;
mod host;
mod light;
mod light_sample;
mod numbers;
mod shaded_surface;
mod shading;
mod staged;
mod surface;
mod suspect;
mod tracing;

use std::collections::BTreeSet;
use std::sync::Arc;

use rtsl::{
    CallMode, Diagnostic, Engine, Instance, InstanceBlock, Kernel, Method, ParameterType, Program,
    Query, StageLights,
};
use rtsl_scene::Scene;

pub use evaluation::Evaluation;
pub use shaded_surface::ShadedSurface;
pub use staged::{StageParts, StagedMethod, searched_objects, stage_lights};
pub use tracing::IntegratorMemory;

/// An integrator, prepared for a scene.
pub struct Integrator {
    program: Arc<Program>,
    /// `radiance` on the interpreter.
    kernel: Kernel,
    /// The stages, if there is machine code.
    pub staged: Option<StagedMethod>,
    block: InstanceBlock,
    /// The first scratch arrays of the outputs that are features of pixels, if the class has them.
    features: FeatureArrays,
    /// True if it calls `shade` of materials.
    pub calls_shade: bool,
    /// True if it asks for the emission of materials. Those that have nothing but `shade` emit what it computes.
    pub asks_emission: bool,
    /// True if it samples directions of materials.
    pub scatters: bool,
}

/// The outputs of integrators that are features of pixels.
pub const FEATURE_OUTPUTS: [&str; 2] = ["albedo", "normal"];

/// The first scratch arrays of an integrator's outputs of these names.
#[derive(Clone, Copy, Default)]
struct FeatureArrays {
    albedo: Option<usize>,
    normal: Option<usize>,
}

impl FeatureArrays {
    /// Returns the arrays in the scratch of stages.
    fn in_stages(self, staged: &StagedMethod) -> FeatureArrays {
        let array = |array: Option<usize>| array.map(|array| staged.program.class_array(array));
        FeatureArrays { albedo: array(self.albedo), normal: array(self.normal) }
    }
}

impl Integrator {
    /// Prepares an instance for the interpreter.
    ///
    /// # Errors
    /// If its class has no `radiance`, or linking passes a limit.
    pub fn new(engine: &Engine, instance: &Arc<Instance>) -> Result<Integrator, Diagnostic> {
        let program = engine.program(instance);
        let radiance = program.method(Method::Radiance)?;
        let [calls_shade, asks_emission, scatters] =
            [Query::Shade, Query::Emission, Query::SampleBsdf].map(|query| radiance.asks(query));
        let kernel = program.interpreted_kernel(Method::Radiance, CallMode::Packet)?;
        let array = |name: &str| {
            let mut outputs = program.class().outputs.iter();
            let (_, ty) = outputs.find(|(output, _)| output == name)?;
            let is_vector = matches!(ty, ParameterType::Color | ParameterType::Vector(_, 3));
            let first = program.layout().scratch.get(name).filter(|_| is_vector)?;
            Some(*first as usize)
        };
        let [albedo, normal] = FEATURE_OUTPUTS.map(array);
        let features = FeatureArrays { albedo, normal };
        let block = program.block(instance);
        Ok(Integrator {
            kernel,
            staged: None,
            block,
            features,
            calls_shade,
            asks_emission,
            scatters,
            program,
        })
    }

    /// Compiles the stages for a scene; returns `None` if the engine makes no machine code.
    ///
    /// # Errors
    /// If linking, splitting or code generation fails.
    pub fn stages(
        &self,
        engine: &Engine,
        (instance, scene): (&Instance, &Scene),
        parts: &StageParts<'_>,
        lights: &StageLights<'_>,
    ) -> Result<Option<StagedMethod>, Diagnostic> {
        let integrator = (&self.program, instance);
        let staged = engine
            .llvm()
            .map(|_| StagedMethod::of_integrator(engine, integrator, scene, (parts, lights)));
        staged.transpose()
    }

    /// The program of the class.
    pub fn program(&self) -> &Arc<Program> {
        &self.program
    }

    /// The queries about surfaces that kernels leave to a host.
    pub fn queries(&self) -> BTreeSet<Query> {
        match &self.staged {
            Some(staged) => staged.queries().clone(),
            None => Query::of_surfaces().collect(),
        }
    }

    /// True if it reads the widths of camera rays.
    pub fn reads_widths(&self) -> bool {
        self.staged.as_ref().is_none_or(StagedMethod::reads_widths)
    }

    /// Returns the name of the class.
    pub fn name(&self) -> &str {
        &self.program.class().name
    }
}
