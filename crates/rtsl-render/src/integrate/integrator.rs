//! Integrators written in RTSL.
//!
//! An engine with machine code runs them as [stages](super::staged). Without, and where they are evaluated for given
//! rays, the whole of `radiance` runs on the interpreter, ray by ray, and each query is answered at once: a search with
//! one ray, a call of a material's method with one lane. This defines the meaning of integrators; stages have the same
//! bits.
//!
//! # Random numbers
//!
//! Numbers depend on the pixel, the sample and the queries of the path before, never on other paths. `sample1D` and
//! `sample2D` are functions of the dimension. Every query for a light, a sky, a shadow ray or `shade`, and every other
//! one whose method takes random numbers, has a separate sequence for its methods: the sequence's index counts such
//! queries since the last search, among the sequences of that search; light samples are counted apart. So the numbers
//! of one surface are stratified over the samples of a pixel, whatever the surfaces before it have asked.

use std::collections::BTreeSet;
use std::sync::Arc;

use rtsl::{
    CallMode, Diagnostic, Engine, Instance, InstanceBlock, Kernel, Method, Program, Query,
    StageLights,
};
use rtsl_scene::Scene;

use super::output_columns::{OutputColumn, output_columns};
use super::staged::{StageParts, StagedMethod};
use crate::film::features::Features;

/// An integrator, prepared for a scene.
pub struct Integrator {
    pub program: Arc<Program>,
    /// `radiance` on the interpreter.
    pub kernel: Kernel,
    /// The stages, if there is packet code.
    pub staged: Option<StagedMethod>,
    pub block: InstanceBlock,
    /// The columns of the components of kept outputs.
    pub outputs: Vec<OutputColumn>,
    /// True if it calls `shade` of materials, and waits for all its light.
    pub calls_shade: bool,
    /// True if it calls `shade` of materials, and takes its light as it comes.
    pub asks_own_shade: bool,
    /// True if it asks for the emission of materials. Those that have nothing but `shade` emit what it computes.
    pub asks_emission: bool,
    /// True if it samples directions of materials.
    pub scatters: bool,
}

impl Integrator {
    /// Prepares an instance for the interpreter. Of its outputs, those among the features are kept.
    ///
    /// # Errors
    /// If its class has no `radiance`, or linking passes a limit.
    pub fn new(
        engine: &Engine,
        instance: &Arc<Instance>,
        features: &Features,
    ) -> Result<Integrator, Diagnostic> {
        let program = engine.program(instance);
        let radiance = program.deferring_method(Method::Radiance)?;
        let [calls_shade, asks_own_shade, asks_emission, scatters] =
            [Query::Shade, Query::OwnShade, Query::Emission, Query::SampleBsdf]
                .map(|query| radiance.asks(query));
        let kernel = program.interpreted_deferring_kernel(Method::Radiance, CallMode::Packet)?;
        let outputs = output_columns(&program, features);
        let block = program.block(instance);
        Ok(Integrator {
            kernel,
            staged: None,
            block,
            outputs,
            calls_shade,
            asks_own_shade,
            asks_emission,
            scatters,
            program,
        })
    }

    /// Compiles the stages for the integrator's scene; returns `None` if the engine runs no packet code.
    ///
    /// # Errors
    /// If linking, splitting or code generation fails.
    pub fn stages(
        &self,
        engine: &Engine,
        scene: &Scene,
        parts: &StageParts<'_>,
        lights: &StageLights<'_>,
    ) -> Result<Option<StagedMethod>, Diagnostic> {
        let (program, integrator) = (&self.program, scene.integrator());
        let staged = engine.runs_packets().then(|| {
            StagedMethod::of_integrator(engine, program, integrator, scene, parts, lights)
        });
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

    /// Returns the name of the class.
    pub fn name(&self) -> &str {
        &self.program.class().name
    }
}
