//! Packet code against the single-ray interpreter: the same bits for every call mode and width, under random masks.
//! Also tests the counts of runs.

use expect_test::{Expect, expect};
use proptest::prelude::*;
use rtsl_abi::{CallMode, Layout};
use rtsl_ir::{Function, Interpreter, Storage as _, VariableId, VariableKind};
use rtsl_packet::Kernel;
use rtsl_packet::interpreter::{self, Outcome, Rays, Storage};
use rtsl_testing::functions::{Entropy, HashHost, Memory, function, seeded_function};

/// Full chunks and a partial one at every width.
const RAYS: u32 = 37;
const WIDTHS: [u32; 4] = [1, 4, 8, 16];

fn lower(function: &Function, mode: CallMode, width: u32) -> Kernel {
    let variables = |kind| function.variables.iter().filter(move |variable| variable.kind == kind);
    let layout = Layout::new(
        variables(VariableKind::Member),
        variables(VariableKind::Buffer),
        variables(VariableKind::Scratch),
    );
    let kernel = rtsl_packet::lower(function, &layout, mode, width).unwrap();
    rtsl_packet::verify(&kernel).unwrap();
    kernel
}

/// The memory of all rays. A uniform variable is that of ray 0.
#[derive(Clone)]
struct RayMemories<'a> {
    kernel: &'a Kernel,
    rays: Vec<Memory>,
}

impl<'a> RayMemories<'a> {
    fn random(kernel: &'a Kernel, function: &Function, seed: u64) -> Self {
        let bytes = Entropy::bytes(seed ^ 0x5eed, 1 << 15);
        let entropy = &mut Entropy::new(&bytes);
        RayMemories { kernel, rays: (0..RAYS).map(|_| Memory::new(function, entropy)).collect() }
    }

    fn ray_of(&self, variable: VariableId, ray: u32) -> &Memory {
        let ray = if self.kernel.variable(variable).varies { ray } else { 0 };
        &self.rays[ray as usize]
    }
}

impl Storage for RayMemories<'_> {
    fn load(&self, variable: VariableId, index: u32, ray: u32) -> u32 {
        self.ray_of(variable, ray).load(variable, index)
    }

    fn elements(&self, buffer: VariableId, ray: u32) -> u32 {
        self.ray_of(buffer, ray).elements(buffer)
    }

    fn store(&mut self, variable: VariableId, component: u32, ray: u32, bits: u32) {
        self.rays[ray as usize].store(variable, component, bits);
    }
}

/// One ray's view, for the single-ray interpreter: inputs from before the call.
struct OneRay<'a> {
    before: &'a RayMemories<'a>,
    ray: u32,
    after: &'a mut Memory,
}

impl rtsl_ir::Storage for OneRay<'_> {
    fn load(&self, variable: VariableId, index: u32) -> u32 {
        Storage::load(self.before, variable, index, self.ray)
    }

    fn elements(&self, buffer: VariableId) -> u32 {
        Storage::elements(self.before, buffer, self.ray)
    }

    fn store(&mut self, variable: VariableId, component: u32, bits: u32) {
        self.after.store(variable, component, bits);
    }
}

fn check(function: &Function, seed: u64) {
    for mode in CallMode::ALL {
        for width in WIDTHS {
            let kernel = lower(function, mode, width);
            let before = RayMemories::random(&kernel, function, seed);
            for masked in [false, true] {
                let is_on = |ray: u32| !masked || (seed ^ u64::from(ray)).is_multiple_of(3);
                check_call(function, &before, &is_on, seed);
            }
        }
    }
}

fn check_call(
    function: &Function,
    before: &RayMemories<'_>,
    is_on: &dyn Fn(u32) -> bool,
    seed: u64,
) {
    let kernel = before.kernel;
    let mut expected = before.clone();
    let mut single = Interpreter::prepare(function).unwrap();
    let mut host = HashHost::default();
    let accepted = function
        .outputs
        .iter()
        .find(|output| function.variable(output.variable).kind == VariableKind::Accepted);
    let mut budget_exceeded = false;
    let count = if kernel.mode == CallMode::Single { 1 } else { RAYS };
    let mut nearest: Option<(u32, Memory)> = None;
    for ray in 0..count {
        if kernel.keeps_nearest() {
            if is_on(ray) {
                let mut after = before.rays[0].clone();
                let mut storage = OneRay { before, ray, after: &mut after };
                let outcome = single.run(ray, &mut storage, &mut host);
                budget_exceeded |= outcome.budget_exceeded;
                let is_nearer = nearest.as_ref().is_none_or(|(_, nearest)| {
                    distance(function, &after) < distance(function, nearest)
                });
                if outcome.accepted && is_nearer {
                    nearest = Some((ray, after));
                }
            }
            continue;
        }
        let after = &mut expected.rays[ray as usize];
        let mut hit = false;
        if is_on(ray) {
            let mut storage = OneRay { before, ray, after };
            let outcome = single.run(ray, &mut storage, &mut host);
            budget_exceeded |= outcome.budget_exceeded;
            hit = outcome.accepted;
        }
        if let Some(output) = accepted {
            after.store(output.variable, 0, hit.into());
        }
    }
    let mut found = before.clone();
    let rays = Rays { count, is_on, round_limit: u64::MAX };
    let outcome = interpreter::Interpreter::new(kernel.clone()).run(
        rays,
        &mut found,
        &mut HashHost::default(),
    );
    assert_eq!(outcome.budget_exceeded, budget_exceeded);
    assert_eq!(outcome.nearest, nearest.as_ref().map(|(object, _)| *object), "{function}{kernel}");
    if let Some((_, after)) = nearest {
        let outputs = function.outputs.iter().map(|output| output.variable);
        let kept =
            |variable: &VariableId| function.variable(*variable).kind != VariableKind::Accepted;
        for output in outputs.filter(kept) {
            (0..).zip(after.bits(output)).for_each(|(component, bits)| {
                expected.rays[0].store(output, component, *bits);
            });
        }
    }
    for ray in 0..count as usize {
        let (expected, found) = (expected.rays[ray].snapshot(), found.rays[ray].snapshot());
        let (mode, width) = (kernel.mode.name(), kernel.width);
        assert_eq!(found, expected, "seed {seed}, {mode} {width}, ray {ray}\n{function}{kernel}");
    }
}

/// The key by which hits are compared.
fn distance(function: &Function, memory: &Memory) -> f32 {
    let mut variables = function.variables.iter();
    let variable = variables.position(|variable| variable.name == "rt_HitDistance").unwrap();
    f32::from_bits(memory.bits(VariableId(variable as u32))[0]).min(f32::INFINITY)
}

#[test]
fn generated_functions_agree() {
    (0..60).for_each(|seed| check(&seeded_function(seed, 100), seed));
    (100..106).for_each(|seed| check(&seeded_function(seed, 900), seed));
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 60, ..ProptestConfig::default() })]

    #[test]
    fn any_function_agrees(bytes in proptest::collection::vec(any::<u8>(), 0..300)) {
        check(&function(&bytes), 5);
    }
}

/// The rays of a call as a storage: ray `i` has `i / 4` in every float.
struct Ramp;

impl Storage for Ramp {
    fn load(&self, _: VariableId, _: u32, ray: u32) -> u32 {
        (ray as f32 / 4.0).to_bits()
    }

    fn elements(&self, _: VariableId, _: u32) -> u32 {
        3
    }

    fn store(&mut self, _: VariableId, _: u32, _: u32, _: u32) {}
}

fn count(text: &str, width: u32, count: u32, round_limit: u64) -> Outcome {
    let function: Function = text.parse().unwrap_or_else(|error| panic!("{error}"));
    rtsl_ir::verify::verify(&function).unwrap();
    let kernel = lower(&function, CallMode::Packet, width);
    let rays = Rays { count, is_on: &|ray| ray != 1, round_limit };
    interpreter::Interpreter::new(kernel).run(rays, &mut Ramp, &mut HashHost::default())
}

fn check_count(text: &str, width: u32, expected: Expect) {
    expected.assert_eq(&count(text, width, 6, u64::MAX).profile.to_string());
}

const ARITHMETIC: &str = "function f member m: f32[1] state rt_du: f32[1] state rt_dv: f32[1] {
    %x: f32 = load state:rt_du@0
    %m: f32 = load member:m@0
    %mm: f32 = multiply %m, %m
    %fma: f32 = fma %x, %mm, %x
    %root: f32 = sqrt %fma
    %quotient: f32 = divide %root, %x
    %negative: f32 = negate %quotient
    %n: i32 = convert %negative
    %n2: i32 = add %n, %n
    %y: f32 = convert %n2
    return state:rt_dv@0 = %y
}";

#[test]
fn arithmetic_is_counted_by_lanes_that_are_on() {
    check_count(
        ARITHMETIC,
        4,
        expect![[r#"
        rays: 6
        lanes: 45 of 72
        float operations: 21 of 33
        divisions: 5 of 8
        square roots: 5 of 8
        conversions: 10 of 16
        integer operations: 5 of 8
        logic: 5 of 8
        bytes loaded from state: 20 of 32
        bytes stored to state: 20 of 32
        bytes loaded from members: 4 of 4
    "#]],
    );
}

#[test]
fn one_ray_at_a_time_wastes_no_lane() {
    check_count(
        ARITHMETIC,
        1,
        expect![[r#"
        rays: 6
        lanes: 45 of 45
        float operations: 21 of 21
        divisions: 5 of 5
        square roots: 5 of 5
        conversions: 10 of 10
        integer operations: 5 of 5
        logic: 5 of 5
        bytes loaded from state: 20 of 20
        bytes stored to state: 20 of 20
        bytes loaded from members: 4 of 4
    "#]],
    );
}

/// A branch taken from ray 3 on, with a loop that makes `2 i` iterations for ray `i`.
const BRANCH: &str = "function f state rt_du: f32[1] {
    %x: f32 = load state:rt_du@0
    %step: f32 = constant 0.125
    %zero: f32 = constant 0.0
    %limit: f32 = constant 0.75
    %far: bool = greater_equal %x, %limit
    %result: f32 = if %far {
        %end: f32 = loop (%at: f32 = %zero) {
            %next: f32 = add %at, %step
            %again: bool = less %next, %x
            repeat %again, %next
        }
        yield %end
    } else {
        yield %x
    }
    return state:rt_du@0 = %result
}";

#[test]
fn branches_and_rounds_are_counted() {
    check_count(
        BRANCH,
        4,
        expect![[r#"
        rays: 6
        lanes: 95 of 232
        float operations: 16 of 16
        comparisons: 29 of 72
        selects: 27 of 72
        logic: 29 of 72
        bytes loaded from state: 20 of 32
        bytes stored to state: 20 of 32
        branches: 2 taken, 0 not taken
        rounds of loops: 16
        decision 0: held ray 3, failed never
        decision 1: held ray 3, failed ray 0
        decision 2: held ray 3, failed never
        decision 3: held ray 3, failed ray 3
    "#]],
    );
}

#[test]
fn a_limit_of_rounds_ends_loops() {
    assert!(!count(BRANCH, 4, 6, 100).cut_short);
    let outcome = count(BRANCH, 4, 6, 5);
    assert!(outcome.cut_short);
    assert_eq!(outcome.profile.rounds, 5);
}
