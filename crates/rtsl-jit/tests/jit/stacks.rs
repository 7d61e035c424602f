//! Calls from within calls: a host that answers requests by calling kernels gets an error where the stack of its thread
//! ends, and nothing has run then.
#![cfg(all(target_os = "linux", target_env = "gnu"))]

use std::panic::{AssertUnwindSafe, catch_unwind};

use rtsl_abi::{
    CallArguments, CallError, CallMode, CallStatus, InstanceBlock, Instances, LaneBlock, Layout,
};
use rtsl_ir::host::{Host, LaneColors, LaneSet, RayLanes};
use rtsl_ir::{Builder, OpKind, Scalar, Variable, VariableKind};
use rtsl_jit::{CompiledKernel, Llvm, OptLevel};
use rtsl_llvm::TargetFeatures;
use rtsl_packet::Kernel;

/// The number of values kept: 64 KiB for 16 rays at a time.
const KEPT: usize = 1_000;

/// The rays of a call: three chunks.
const RAYS: usize = 37;

/// Keeps values during a request for a ray, and returns their sum with the answer.
fn kernel(mode: CallMode) -> Kernel {
    let mut builder = Builder::new("Keeps.shade");
    let (kind, name) = (VariableKind::Scratch, "kept".to_owned());
    let variable = builder.variable(Variable { kind, name, scalar: Scalar::F32, len: 2 });
    let x = builder.load(variable, 0);
    let mut kept = vec![x];
    for _ in 0..KEPT {
        let product = builder.multiply(*kept.last().unwrap(), x);
        kept.push(product);
    }
    let (origin, direction) = ([x; 3], [x; 3]);
    let answer = builder.push(OpKind::Trace { origin, direction, limit: x, weight: x });
    let sum = kept.into_iter().fold(answer.get(0), |sum, value| builder.add(sum, value));
    builder.output(variable, 1, sum);
    let function = builder.finish();
    let layout = Layout::new([], [], &function.variables);
    rtsl_packet::lower(&function, &layout, mode, 16).unwrap()
}

fn compiled(mode: CallMode) -> CompiledKernel {
    let llvm = Llvm::load().unwrap_or_else(|error| panic!("{error}"));
    let features = TargetFeatures::new("", "", "");
    CompiledKernel::compile(&llvm, &[kernel(mode)], &features, OptLevel::O1).unwrap().remove(0)
}

/// Answers with the number of levels below, by a call of the kernel for each request.
struct Deeper<'a> {
    kernel: &'a CompiledKernel,
    /// The rays of each call.
    rays: usize,
    /// The number of further levels.
    levels: u32,
    /// Panics if a call is refused, instead of answering 0.
    insists: bool,
    /// The levels that answers came from, and the requests.
    reached: u32,
    requests: u32,
}

impl<'a> Deeper<'a> {
    fn new(kernel: &'a CompiledKernel, rays: usize, levels: u32) -> Self {
        Deeper { kernel, rays, levels, insists: false, reached: 0, requests: 0 }
    }

    fn call(&mut self) -> Result<(CallStatus, Vec<f32>), CallError> {
        let (kernel, rays) = (self.kernel, self.rays);
        let (mut state, mut scratch) = (LaneBlock::new(0, rays), LaneBlock::new(2, rays));
        for (index, x) in scratch.floats_mut(0).iter_mut().enumerate() {
            *x = 1.0 - index as f32 * 1e-4;
        }
        let status = kernel.try_call(CallArguments {
            state: &mut state,
            scratch: &mut scratch,
            count: rays,
            mask: None,
            accepted: None,
            instances: Instances::One(&InstanceBlock::new(&[], Vec::new())),
            host: self,
        });
        status.map(|status| (status, scratch.floats(1).to_vec()))
    }
}

impl Host for Deeper<'_> {
    fn trace(&mut self, lanes: LaneSet, _: &RayLanes, radiance: &mut LaneColors) {
        self.requests += 1;
        if self.levels == 0 {
            return;
        }
        let levels = self.levels - 1;
        // One of the chunks descends: all would take exponential time.
        let mut inner = Deeper { levels, requests: 0, ..*self };
        if lanes.base > 0 {
            return;
        }
        let called = inner.call();
        let reached = match called {
            Ok(_) => 1 + inner.reached,
            Err(error) if self.insists => panic!("level {levels}: {error}"),
            Err(error) => {
                assert_eq!((error, inner.requests), (CallError::NoStack, 0), "nothing has run");
                0
            }
        };
        self.reached = reached;
        lanes.iter().for_each(|lane| radiance[0][lane] = reached as f32);
    }
}

/// Does work on a thread with a stack of this size.
fn on_stack<T: Send>(kib: usize, work: impl FnOnce() -> T + Send) -> T {
    std::thread::scope(|scope| {
        let thread = std::thread::Builder::new().stack_size(kib << 10);
        thread.spawn_scoped(scope, work).unwrap().join().unwrap()
    })
}

#[test]
fn calls_that_are_too_deep_are_errors() {
    for (mode, rays) in [(CallMode::Packet, RAYS), (CallMode::Packet, 1), (CallMode::Single, 1)] {
        let kernel = compiled(mode);
        let depth = |kib| {
            on_stack(kib, || {
                let mut host = Deeper::new(&kernel, rays, u32::MAX);
                host.call().map(|(_, sums)| (host.reached, host.requests, sums))
            })
        };
        // The vectors of a packet take 64 KiB a level, the values of one ray 4.
        let at_least = if mode == CallMode::Single { 40 } else { 10 };
        // The system may give a thread the stack of one that has ended, if it is not more than four times as large.
        let (reached, requests, sums) = depth(2048).unwrap();
        let (more, ..) = depth(16384).unwrap();
        assert!((at_least..2000).contains(&reached), "{mode:?}: {reached} levels");
        assert!(more > reached * 3 / 2, "{mode:?}: {reached} levels, then {more}");
        assert_eq!(requests, rays.div_ceil(kernel.width()) as u32);
        // As deep as that and no deeper, by the host's own limit.
        let limited = on_stack(16384, || Deeper::new(&kernel, rays, reached).call());
        assert_eq!(limited.unwrap().1, sums, "{mode:?}");
    }
}

#[test]
fn small_stacks_are_refused_and_512_kib_suffice() {
    let kernel = compiled(CallMode::Packet);
    let call = || {
        let mut host = Deeper::new(&kernel, RAYS, 0);
        (host.call().map(|_| ()), host.requests)
    };
    assert_eq!(on_stack(160, call), (Err(CallError::NoStack), 0));
    assert_eq!(on_stack(512, call), (Ok(()), 3));
}

#[test]
fn panics_of_deep_calls_pass_all_levels() {
    let kernel = compiled(CallMode::Packet);
    let message = on_stack(2048, || {
        let mut host = Deeper { insists: true, ..Deeper::new(&kernel, RAYS, u32::MAX) };
        let result = catch_unwind(AssertUnwindSafe(|| host.call()));
        (*result.err().unwrap().downcast::<String>().unwrap(), host.requests)
    });
    assert!(message.0.contains("the calling thread's stack has too little room"), "{}", message.0);
    assert_eq!(message.1, 1, "a host that has panicked is not asked again");
}
