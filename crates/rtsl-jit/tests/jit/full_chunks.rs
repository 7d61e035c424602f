//! Calls whose rays fill whole chunks, which pass their arguments in registers, against calls with a mask of all rays.

use rtsl_abi::{CallArguments, CallMode, InstanceBlock, Instances, LaneBlock, LaneMask, Layout};
use rtsl_ir::Function;
use rtsl_jit::{CompiledKernel, Llvm, OptLevel};
use rtsl_llvm::{FullChunks, TargetFeatures};
use rtsl_packet::Kernel;

const TEXT: &str = "function Probe.intersect
    member radius: f32[1]
    state rt_HitDistance: f32[1]
    state rt_Epsilon: f32[1]
    scratch object: f32[1]
    accepted hit: bool[1]
    {
        %t: f32 = load state:rt_HitDistance@0
        %e: f32 = load state:rt_Epsilon@0
        %r: f32 = load member:radius@0
        %x: f32 = subtract %e, %r
        %c: bool = less %x, %t
        return accepted:hit@0 = %c, state:rt_HitDistance@0 = %x, scratch:object@0 = %r
    }";

/// Returns the function's packet code and its block.
fn kernel(width: u32, interleave: Option<u32>) -> (Kernel, InstanceBlock) {
    let function: Function = TEXT.parse().unwrap_or_else(|error| panic!("{error}"));
    let layout = Layout::new(&function.variables[..1], [], &function.variables[3..4]);
    let mut kernel = rtsl_packet::lower(&function, &layout, CallMode::Packet, width)
        .unwrap_or_else(|error| panic!("{error}"));
    kernel.interleave = interleave;
    (kernel, InstanceBlock::new(&[3.0_f32.to_bits()], Vec::new()))
}

/// The distances, the scratch and the accepted rays after a call.
type Results = (Vec<u32>, Vec<u32>, Vec<u32>);

fn call(
    kernel: &CompiledKernel,
    block: &InstanceBlock,
    count: usize,
    mask: Option<&LaneMask>,
) -> Results {
    let first =
        |name| rtsl_spec::lookup_state(name).expect("a state variable").first_component as usize;
    let (distance, epsilon) = (first("rt_HitDistance"), first("rt_Epsilon"));
    let lanes = count + 16;
    let mut state = LaneBlock::new(rtsl_spec::state_component_count() as usize, lanes);
    for lane in 0..lanes {
        state.floats_mut(distance)[lane] = (lane % 5) as f32;
        state.floats_mut(epsilon)[lane] = (lane % 7) as f32;
    }
    let mut scratch = LaneBlock::new(1, lanes);
    let mut accepted = LaneMask::from_fn(lanes, |lane| lane % 2 == 0);
    let status = kernel.call(CallArguments {
        state: &mut state,
        scratch: &mut scratch,
        count,
        mask,
        accepted: Some(&mut accepted),
        instances: Instances::One(block),
        host: &mut rtsl_ir::host::NoHost,
    });
    assert!(!status.budget_exhausted);
    (state.words(distance).to_vec(), scratch.words(0).to_vec(), accepted.words().to_vec())
}

#[test]
fn results_are_those_of_a_call_with_a_mask() {
    let llvm = Llvm::load().unwrap_or_else(|error| panic!("{error}"));
    let target = llvm.host();
    let features = TargetFeatures::new(target.triple(), target.cpu(), target.features());
    for (width, interleave) in [(4, 1), (4, 2), (8, 1), (8, 2), (16, 1), (16, 2), (16, 4)] {
        let (packet, block) = kernel(width, Some(interleave));
        let full = FullChunks::of(&packet, "kernel").expect("it needs only arrays and a block");
        assert_eq!((full.symbol.as_str(), full.rays), ("kernel.full", width * interleave));
        let kernel = CompiledKernel::compile(&llvm, &[packet], &features, OptLevel::O2)
            .unwrap_or_else(|error| panic!("{error}"))
            .remove(0);
        for count in [0, 1, 4, 8, 16, 24, 32, 63, 64, 65, 128] {
            let all = LaneMask::from_fn(count + 16, |_| true);
            let masked = call(&kernel, &block, count, Some(&all));
            let found = call(&kernel, &block, count, None);
            assert_eq!(found, masked, "{count} rays, {width} lanes, {interleave} interleaved");
        }
    }
}

#[test]
fn kernels_that_do_not_interleave_have_no_function_for_full_chunks() {
    assert_eq!(FullChunks::of(&kernel(8, None).0, "kernel"), None);
}
