//! Generated integrators: stages compute what the function computes, to the bit, by the same requests.

use rtsl_ir::host::{Host, LaneColors, LaneFloats, LaneSet, LightLanes, LightQueryLanes, RayLanes};
use rtsl_ir::{
    Constant, Effect, Function, Interpreter, OpKind, Outcome, Query, Region, Scalar, VariableKind,
};
use rtsl_opt::{Options, optimize};
use rtsl_stages::drive::Driver;
use rtsl_stages::{Port, ResumedBy, SplitError, Stages, Surface, split};
use rtsl_testing::functions::{Entropy, HashHost, Memory, seeded_function, seeded_integrator};

/// A host that records the requests that [`HashHost`] answers.
#[derive(Default)]
struct Recorder {
    host: HashHost,
    requests: Vec<Vec<u32>>,
}

impl Recorder {
    /// Passes preserve everything but the bits of NaNs.
    fn record(&mut self, kind: u32, floats: impl Iterator<Item = f32>) {
        let bits = |it: f32| if it.is_nan() { f32::NAN.to_bits() } else { it.to_bits() };
        self.requests.push([kind].into_iter().chain(floats.map(bits)).collect());
    }

    fn record_ray(&mut self, kind: u32, rays: &RayLanes) {
        let vectors = rays.origin.iter().chain(&rays.direction);
        self.record(kind, vectors.chain([&rays.limit, &rays.weight]).map(|lanes| lanes[0]));
    }
}

impl Host for Recorder {
    fn trace(&mut self, lanes: LaneSet, rays: &RayLanes, radiance: &mut LaneColors) {
        self.record_ray(0, rays);
        self.host.trace(lanes, rays, radiance);
    }

    fn occluded(&mut self, lanes: LaneSet, rays: &RayLanes) -> u32 {
        // The weight is unused, and keeps its value between requests.
        self.record_ray(1, &RayLanes { weight: Default::default(), ..rays.clone() });
        self.host.occluded(lanes, rays)
    }

    fn light_count(&mut self) -> u32 {
        self.host.light_count()
    }

    fn light_sample(
        &mut self,
        lanes: LaneSet,
        index: u32,
        query: &LightQueryLanes,
        light: &mut LightLanes,
    ) -> u32 {
        let vectors = query.point.iter().chain(&query.normal).chain([&query.cosine]);
        self.record(2 + index, vectors.map(|lanes| lanes[0]));
        self.host.light_sample(lanes, index, query, light)
    }

    fn ambient(&mut self) -> [f32; 3] {
        self.host.ambient()
    }

    fn query(&mut self, ray: u32, query: Query, operands: &[u32], results: &mut [u32]) {
        if query.effect() != Effect::None {
            let integers = query.operand_scalars().zip(operands);
            let integers = integers.filter(|(scalar, _)| *scalar != Scalar::F32);
            self.requests.push(integers.map(|(_, bits)| *bits).collect());
            let floats = query.operand_scalars().zip(operands);
            let floats = floats.filter(|(scalar, _)| *scalar == Scalar::F32);
            self.record(100 + query as u32, floats.map(|(_, bits)| f32::from_bits(*bits)));
        }
        self.host.query(ray, query, operands, results);
    }

    fn rand(&mut self, lanes: LaneSet, values: &mut LaneFloats) {
        self.record(200, std::iter::empty());
        self.host.rand(lanes, values);
    }
}

/// The content of the variables after a run, its outcome, and its requests.
type Result = (Vec<Vec<Constant>>, Outcome, Vec<Vec<u32>>);

fn result(
    function: &Function,
    seed: u64,
    run: impl FnOnce(&mut Memory, &mut Recorder) -> Outcome,
) -> Result {
    let inputs = Entropy::bytes(seed, 600);
    let mut memory = Memory::new(function, &mut Entropy::new(&inputs));
    let mut recorder = Recorder::default();
    let outcome = run(&mut memory, &mut recorder);
    (memory.snapshot(), outcome, recorder.requests)
}

fn unsplit(function: &Function, seed: u64) -> Result {
    let mut interpreter = Interpreter::prepare(function).unwrap();
    result(function, seed, |memory, host| interpreter.run(0, memory, host))
}

fn driven(function: &Function, stages: &Stages, seed: u64) -> Result {
    let mut driver = Driver::new(stages, &function.variables).unwrap().with_noise(seed);
    result(function, seed, |memory, host| driver.run(0, memory, host))
}

/// The shapes that the generated functions have, counted to show that the tests reach them.
#[derive(Debug, Default)]
struct Coverage {
    functions: usize,
    /// Functions that suspend in a branch in a loop.
    in_branches_in_loops: usize,
    in_nested_loops: usize,
    stages: usize,
    dispatches: usize,
    named_surfaces: usize,
    known_surfaces: usize,
    largest_frame: usize,
    shared_slots: usize,
}

impl Coverage {
    fn add(&mut self, function: &Function, stages: &Stages) {
        self.functions += 1;
        let is_within = |outer: &[bool]| suspends_within(&function.body, outer);
        self.in_branches_in_loops += usize::from(is_within(&[true, false]));
        self.in_nested_loops += usize::from(is_within(&[true, true]));
        let count = |fits: &dyn Fn(ResumedBy, Surface) -> bool| {
            stages.stages.iter().filter(|stage| fits(stage.resumed_by, stage.surface)).count()
        };
        self.stages += stages.stages.len();
        self.dispatches += count(&|event, _| event == ResumedBy::Dispatch);
        self.named_surfaces +=
            count(&|event, surface| event != ResumedBy::Dispatch && surface == Surface::Request);
        self.known_surfaces += count(&|_, surface| surface == Surface::Answer);
        self.largest_frame = self.largest_frame.max(stages.slots.len());
        let live: usize = stages.stages.iter().map(|stage| stage.live.len()).sum();
        self.shared_slots += usize::from(live > stages.slots.len());
    }

    /// The functions have what is to be tested, often.
    fn check(&self) {
        let parts = [
            self.in_branches_in_loops * 12,
            self.in_nested_loops * 20,
            self.dispatches,
            self.named_surfaces * 6,
            self.known_surfaces * 3,
            self.shared_slots * 2,
        ];
        assert!(parts.iter().all(|part| *part > self.functions), "{self:?}");
    }
}

/// True if an operation that suspends lies in these regions, one somewhere in another: bodies of loops are `true`.
fn suspends_within(region: &Region, outer: &[bool]) -> bool {
    region.ops.iter().any(|op| {
        let is_loop = matches!(op.kind, OpKind::Loop { .. });
        let inner = match outer.split_first() {
            Some((first, rest)) if *first == is_loop => rest,
            _ => outer,
        };
        outer.is_empty() && ResumedBy::of(&op.kind).is_some()
            || op.kind.regions().any(|region| suspends_within(region, inner))
    })
}

fn check(function: &Function, seed: u64, coverage: &mut Coverage) {
    let stages = match split(function) {
        Ok(stages) => stages,
        Err(SplitError::Operations) => return,
        Err(error) => panic!("{seed}: {error}\n{function}"),
    };
    coverage.add(function, &stages);
    if seed.is_multiple_of(16) {
        let text = stages.to_string();
        assert_eq!(text.parse::<Stages>().unwrap().to_string(), text);
    }
    for run in 0..3 {
        let seed = seed ^ run << 40;
        let (expected, found) = (unsplit(function, seed), driven(function, &stages, seed));
        assert!(expected == found, "{seed}\n{function}\n{stages}\n{expected:?}\n{found:?}");
    }
}

fn optimized(mut function: Function) -> Function {
    let options = Options { contract: true, budget: Some(1 << 20), ..Options::default() };
    optimize(&mut function, &options);
    function
}

/// `RTSL_ORACLE` multiplies the number of functions.
fn scaled(count: u64) -> u64 {
    let factor = std::env::var("RTSL_ORACLE").ok().and_then(|text| text.parse().ok());
    count * factor.unwrap_or(1_u64)
}

#[test]
fn stages_compute_what_optimized_integrators_compute() {
    let mut coverage = Coverage::default();
    for seed in 10_000..10_000 + scaled(800) {
        let size = 100 + seed as usize % 9 * 150;
        check(&optimized(seeded_integrator(seed, size)), seed, &mut coverage);
    }
    coverage.check();
}

/// Unoptimised functions have what passes remove: loops that never repeat, values that nobody uses.
#[test]
fn stages_compute_what_integrators_compute() {
    let mut coverage = Coverage::default();
    for seed in 0..scaled(600) {
        let size = 100 + seed as usize % 9 * 150;
        check(&seeded_integrator(seed, size), seed, &mut coverage);
    }
    coverage.check();
}

/// Functions without queries, as backends are tested with.
#[test]
fn stages_compute_what_methods_compute() {
    let mut coverage = Coverage::default();
    for seed in 0..scaled(600) {
        let function = seeded_function(seed, 900);
        if function.variables.iter().all(|it| it.kind != VariableKind::Accepted) {
            check(&function, seed, &mut coverage);
        }
    }
    assert!(coverage.in_branches_in_loops > 60, "{coverage:?}");
}

/// Exchanges two slots of one type that a stage stores.
fn broken(stages: &Stages) -> Option<Stages> {
    let mut broken = stages.clone();
    for stage in &mut broken.stages {
        let Function { outputs, variables, .. } = &mut stage.function;
        let variable = |index: usize| &variables[outputs[index].variable.0 as usize];
        let is_slot = |index: &usize| matches!(Port::of(variable(*index)), Some(Port::Frame(_)));
        let slots: Vec<usize> = (0..outputs.len()).filter(is_slot).collect();
        for pair in slots.windows(2) {
            if variable(pair[0]).scalar == variable(pair[1]).scalar {
                outputs.swap(pair[0], pair[1]);
                return Some(broken);
            }
        }
    }
    None
}

/// The comparison of this file finds broken stages.
#[test]
fn broken_stages_compute_something_else() {
    let (mut found, mut count) = (0, 0);
    for seed in 0..400 {
        let function = optimized(seeded_integrator(seed, 900));
        let Some(stages) = broken(&split(&function).unwrap()) else { continue };
        count += 1;
        let differs = |seed| unsplit(&function, seed) != driven(&function, &stages, seed);
        found += usize::from((0..8).any(|run| differs(seed ^ run << 40)));
    }
    assert!(count > 50 && found * 2 > count, "{found} of {count}");
}
