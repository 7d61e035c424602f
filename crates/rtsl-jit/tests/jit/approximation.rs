//! Approximate operations against exact ones, with the text for every kind of machine that this one can run.

use rtsl_abi::{CallArguments, CallMode, InstanceBlock, Instances, LaneBlock, Layout};
use rtsl_ir::{Function, UnaryOp, evaluate};
use rtsl_jit::{CompiledKernel, Llvm, OptLevel};
use rtsl_llvm::{Estimates, TargetFeatures};

const RAYS: usize = 1024;

/// Reciprocal, inverse square root and square root of the state variable `rt_HitDistance`.
const TEXT: &str = "function Probe.shade
    state rt_HitDistance: f32[1]
    state rt_EmissionColor: f32[3]
    {
        %x: f32 = load state:rt_HitDistance@0
        %r: f32 = approximate_reciprocal %x
        %i: f32 = approximate_inverse_sqrt %x
        %s: f32 = approximate_sqrt %x
        return state:rt_EmissionColor@0 = %r, state:rt_EmissionColor@1 = %i,
            state:rt_EmissionColor@2 = %s
    }";

/// The operations of the three results, in order.
const OPERATIONS: [UnaryOp; 3] =
    [UnaryOp::ApproximateReciprocal, UnaryOp::ApproximateInverseSqrt, UnaryOp::ApproximateSqrt];

/// Returns the results of the three operations for each input, by operation.
fn run(features: &TargetFeatures, width: u32, inputs: &[f32]) -> [Vec<f32>; 3] {
    let function: Function = TEXT.parse().unwrap_or_else(|error| panic!("{error}"));
    let layout = Layout::new([], [], []);
    let kernel = rtsl_packet::lower(&function, &layout, CallMode::Packet, width)
        .unwrap_or_else(|error| panic!("{error}"));
    let llvm = Llvm::load().unwrap_or_else(|error| panic!("{error}"));
    let kernel = CompiledKernel::compile(&llvm, &[kernel], features, OptLevel::O2)
        .unwrap_or_else(|error| panic!("{error}"))
        .remove(0);
    let components = rtsl_spec::state_component_count();
    let first = |name| rtsl_spec::lookup_state(name).expect("a state variable").first_component;
    let mut state = LaneBlock::new(components as usize, inputs.len());
    let array = state.words_mut(first("rt_HitDistance") as usize);
    array.iter_mut().zip(inputs).for_each(|(word, input)| *word = input.to_bits());
    let status = kernel.call(CallArguments {
        state: &mut state,
        scratch: &mut LaneBlock::new(0, inputs.len()),
        count: inputs.len(),
        mask: None,
        accepted: None,
        instances: Instances::One(&InstanceBlock::new(&[], Vec::new())),
        host: &mut rtsl_ir::host::NoHost,
    });
    assert!(!status.budget_exhausted);
    let results = first("rt_EmissionColor") as usize;
    [0, 1, 2].map(|index| {
        let words = &state.words(results + index)[..inputs.len()];
        words.iter().map(|word| f32::from_bits(*word)).collect()
    })
}

/// Returns this machine's features, and variants with other dividers and instructions.
fn machines() -> Vec<TargetFeatures> {
    let llvm = Llvm::load().unwrap_or_else(|error| panic!("{error}"));
    let target = llvm.host();
    let host = TargetFeatures::new(target.triple(), target.cpu(), target.features());
    let slow_divider = TargetFeatures { divider_lanes: 1, ..host.clone() };
    let fast_divider = TargetFeatures { divider_lanes: 16, ..host.clone() };
    let lesser = match host.estimates {
        Estimates::None => Estimates::None,
        Estimates::Sse | Estimates::Avx | Estimates::Avx512 => Estimates::Sse,
    };
    let old = TargetFeatures { estimates: lesser, fma: false, ..slow_divider.clone() };
    vec![host, slow_divider, fast_divider, old]
}

/// Returns the error in units in the last place of the wanted value, which is a normal number.
fn error_of(found: f32, wanted: f32) -> f64 {
    let exponent = (f64::from(wanted.abs()).to_bits() >> 52) - 23;
    (f64::from(found) - f64::from(wanted)).abs() / f64::from_bits(exponent << 52)
}

#[test]
fn results_are_close() {
    // Four octaves, with even and odd exponents, and magnitudes of all sizes.
    let near = (0..RAYS / 2).map(|index| f32::from_bits(0x3f00_0000 + index as u32 * 0x0001_0003));
    let far = (0..RAYS / 2).map(|index| f32::from_bits(0x0080_0000 + index as u32 * 0x003e_0123));
    let greatest = 1.0 / f32::MIN_POSITIVE;
    let inputs: Vec<f32> = near.chain(far).filter(|input| *input <= greatest).collect();
    for machine in machines() {
        for width in [1, 4, 8, 16] {
            let results = run(&machine, width, &inputs);
            for (op, found) in OPERATIONS.into_iter().zip(results) {
                let exact = evaluate::unary(op, rtsl_ir::Scalar::F32).expect("of f32");
                for (input, found) in inputs.iter().zip(found) {
                    let wanted = f32::from_bits(exact(input.to_bits()));
                    let error = error_of(found, wanted);
                    assert!(
                        error <= 6.0,
                        "{} {input:e} is {found:e}, not {wanted:e}: {error} ulp, {width} lanes, {machine:?}",
                        op.name()
                    );
                }
            }
        }
    }
}

#[test]
fn edges_are_as_ever() {
    let infinity = f32::INFINITY;
    let inputs = [0.0, -0.0, infinity, -1.0, f32::NAN];
    for machine in machines() {
        for width in [1, 4, 8, 16] {
            let [reciprocal, inverse_sqrt, sqrt] = run(&machine, width, &inputs);
            assert_eq!(reciprocal[..3], [infinity, -infinity, 0.0], "{width}, {machine:?}");
            assert!(reciprocal[4].is_nan());
            assert_eq!(inverse_sqrt[..3], [infinity, -infinity, 0.0], "{width}, {machine:?}");
            assert!(inverse_sqrt[3].is_nan() && inverse_sqrt[4].is_nan());
            assert_eq!(sqrt[..2], [0.0, 0.0], "{width}, {machine:?}");
            assert!(sqrt[3].is_nan() && sqrt[4].is_nan());
        }
    }
}

/// A divider for 16 lanes is slow; two divisions of 8 lanes are not.
#[test]
fn machines_with_wide_registers_estimate_everything() {
    let function: Function = TEXT.parse().unwrap_or_else(|error| panic!("{error}"));
    let layout = Layout::new([], [], []);
    let kernel = rtsl_packet::lower(&function, &layout, CallMode::Packet, 16)
        .unwrap_or_else(|error| panic!("{error}"));
    let triple = "x86_64-unknown-linux-gnu";
    let text = |cpu| rtsl_llvm::emit([("probe", &kernel)], &TargetFeatures::new(triple, cpu, ""));
    let wide = text("x86-64-v4");
    assert!(!wide.contains("fdiv") && !wide.contains("@llvm.sqrt"), "{wide}");
    let narrow = text("x86-64-v3");
    assert_eq!(
        narrow.matches("call <8 x float> @llvm.x86.avx.rsqrt.ps.256").count(),
        2,
        "{narrow}"
    );
    assert!(narrow.contains("fdiv") && narrow.contains("@llvm.sqrt"), "{narrow}");
}
