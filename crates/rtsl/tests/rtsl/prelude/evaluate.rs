//! Runs an expression of RTSL for many pairs of numbers.

use std::sync::{Arc, OnceLock};

use rtsl::{
    CallArguments, CallMode, Compiler, CompilerOptions, Engine, EngineOptions, Instance,
    InstanceBlock, Instances, Kernel, LaneBlock, Math, Method, Program, host, lookup_state,
    new_state,
};

/// The values of `expression`, a float in terms of the floats x and y, for each pair of these.
pub fn evaluate(expression: &str, inputs: &[[f32; 2]]) -> Vec<f32> {
    evaluate_with("", expression, inputs)
}

/// The same with arithmetic as exact as that.
pub fn evaluate_in(math: Math, expression: &str, inputs: &[[f32; 2]]) -> Vec<f32> {
    evaluate_in_with(math, "", expression, inputs)
}

/// The same with functions that the expression may call.
pub fn evaluate_with(declarations: &str, expression: &str, inputs: &[[f32; 2]]) -> Vec<f32> {
    evaluate_in_with(Math::Contract, declarations, expression, inputs)
}

/// The same with both.
pub fn evaluate_in_with(
    math: Math,
    declarations: &str,
    expression: &str,
    inputs: &[[f32; 2]],
) -> Vec<f32> {
    Probe::new(math, declarations, expression).values(inputs)
}

/// An expression of RTSL, compiled.
pub struct Probe {
    instance: Arc<Instance>,
    program: Arc<Program>,
    kernel: Arc<Kernel>,
}

impl Probe {
    /// Compiles it, with functions that it may call.
    pub fn new(math: Math, declarations: &str, expression: &str) -> Probe {
        let text = format!(
            "{declarations}\nclass Probe : rt_Texture;\nvoid lookup() {{\n    float x = rt_TextureUV.x;\n    \
             float y = rt_TextureUV.y;\n    rt_FloatTextureValue = {expression};\n}}\n"
        );
        let compilation = Compiler::new(CompilerOptions::default()).compile("probe.rtsl", &text);
        let report = compilation.report(false);
        let unit = compilation.unit.unwrap_or_else(|| panic!("{expression}: {report}"));
        let class = unit.class("Probe").expect("the class is there");
        let instance = Instance::new(class, []).expect("it has no parameters");
        let program = engine(math).program(&instance);
        let kernel = program
            .kernel(Method::Lookup, CallMode::Packet)
            .unwrap_or_else(|diagnostic| panic!("{expression}: {}", diagnostic.message));
        Probe { instance, program, kernel }
    }

    /// Its values for these x and y.
    pub fn values(&self, inputs: &[[f32; 2]]) -> Vec<f32> {
        Run::new(self, inputs.len()).values(inputs.iter().copied()).to_vec()
    }
}

/// A probe with the memory of its calls.
pub struct Run<'a> {
    probe: &'a Probe,
    block: InstanceBlock,
    state: LaneBlock,
    scratch: LaneBlock,
    count: usize,
}

impl<'a> Run<'a> {
    /// For that many x and y a call.
    pub fn new(probe: &'a Probe, count: usize) -> Run<'a> {
        let block = probe.program.block(&probe.instance);
        let scratch = probe.program.new_scratch(count);
        Run { probe, block, state: new_state(count), scratch, count }
    }

    /// The values of the probe for these x and y.
    pub fn values(&mut self, inputs: impl Iterator<Item = [f32; 2]> + Clone) -> &[f32] {
        for component in 0..2 {
            let array = self.state.floats_mut(component_of("rt_TextureUV") + component);
            for (lane, input) in array.iter_mut().zip(inputs.clone()) {
                *lane = input[component];
            }
        }
        let status = self.probe.kernel.call(CallArguments {
            state: &mut self.state,
            scratch: &mut self.scratch,
            count: self.count,
            mask: None,
            accepted: None,
            instances: Instances::One(&self.block),
            host: &mut host::NoHost,
        });
        assert!(!status.budget_exhausted);
        self.state.floats(component_of("rt_FloatTextureValue"))
    }
}

/// The value of an expression without variables, computed at run time.
pub fn value(expression: &str) -> f32 {
    evaluate(expression, &[[0.0; 2]])[0]
}

/// The factor by which there are fewer samples if the interpreter evaluates them.
pub fn thinning() -> usize {
    if engine(Math::Contract).llvm().is_some() { 1 } else { 64 }
}

/// Pairs of numbers in [0, 1) that fill the square evenly (the R2 sequence).
pub fn unit_pairs(count: usize) -> Vec<[f32; 2]> {
    let step = [0.754_877_666_246_692_7, 0.569_840_290_998_053_2];
    (0..count)
        .map(|index| step.map(|step: f64| ((index as f64 * step).fract() as f32).min(0.999_999_9)))
        .collect()
}

fn engine(math: Math) -> &'static Engine {
    static CONTRACT: OnceLock<Engine> = OnceLock::new();
    static STRICT: OnceLock<Engine> = OnceLock::new();
    static FAST: OnceLock<Engine> = OnceLock::new();
    let engine = match math {
        Math::Contract => &CONTRACT,
        Math::Strict => &STRICT,
        Math::Fast => &FAST,
    };
    let options = EngineOptions { math, ..EngineOptions::default() };
    engine.get_or_init(|| match Engine::new(options) {
        Ok((engine, _)) => engine,
        Err(diagnostic) => panic!("{}", diagnostic.message),
    })
}

fn component_of(variable: &str) -> usize {
    lookup_state(variable).expect("a state variable").first_component as usize
}
