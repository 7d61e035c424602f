//! Integrators written in RTSL, one path after another.
//!
//! The kernel of an integrator runs on the interpreter, ray by ray, and each of its queries is answered at once: a
//! search with one ray, a call of a material's method with one lane. This defines the meaning of integrators, and any
//! class renders pictures; it is not fast.
//!
//! # Random numbers
//!
//! Numbers depend on the pixel, the sample and the queries of the path before, never on other paths. `sample1D` and
//! `sample2D` are functions of the dimension. Every query that calls methods of materials or lights has a separate
//! sequence, from which these methods take their numbers: the sequence's index counts the queries since the last
//! search, among the sequences of that search. So the numbers of one surface are stratified over the samples of a
//! pixel, whatever the surfaces before it have asked.

mod evaluation;
mod host;
mod light;
mod numbers;
mod surface;
mod tracing;

use std::sync::Arc;

use rtsl::{
    CallMode, Diagnostic, Engine, Instance, InstanceBlock, Kernel, Method, ParameterType, Program,
    Query,
};

pub use evaluation::Evaluation;
pub use tracing::IntegratorMemory;

/// An integrator with its kernel.
pub struct Integrator {
    program: Arc<Program>,
    kernel: Arc<Kernel>,
    block: InstanceBlock,
    /// The first scratch arrays of the outputs that are features of pixels, if the class has them.
    features: FeatureArrays,
    /// True if it calls `shade` of materials.
    pub calls_shade: bool,
}

/// The first scratch arrays of an integrator's outputs of these names.
#[derive(Clone, Copy, Default)]
struct FeatureArrays {
    albedo: Option<usize>,
    normal: Option<usize>,
}

impl Integrator {
    /// Makes the kernel of an instance.
    ///
    /// # Errors
    /// If its class has no `radiance`, or linking passes a limit.
    pub fn new(engine: &Engine, instance: &Arc<Instance>) -> Result<Integrator, Diagnostic> {
        let program = engine.program(instance);
        let calls_shade = program.method(Method::Radiance)?.asks(Query::Shade);
        let kernel = program.kernel(Method::Radiance, CallMode::Packet)?;
        let array = |name: &str| {
            let mut outputs = program.class().outputs.iter();
            let (_, ty) = outputs.find(|(output, _)| output == name)?;
            let is_vector = matches!(ty, ParameterType::Color | ParameterType::Vector(_, 3));
            let first = program.layout().scratch.get(name).filter(|_| is_vector)?;
            Some(*first as usize)
        };
        let features = FeatureArrays { albedo: array("albedo"), normal: array("normal") };
        let block = program.block(instance);
        Ok(Integrator { kernel, block, features, calls_shade, program })
    }

    /// Returns the name of the class.
    pub fn name(&self) -> &str {
        &self.program.class().name
    }
}
