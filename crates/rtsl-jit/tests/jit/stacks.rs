//! Kernels with large frames during requests run on separate stacks. If the system has no memory for these, a call
//! returns an error before anything has run, or uses the existing stacks.
#![cfg(target_os = "linux")]
#![allow(unsafe_code, reason = "limits the memory of its own process")]

use std::process::Command;

use rtsl_abi::{
    CallArguments, CallError, CallMode, CallStatus, InstanceBlock, Instances, LaneBlock, Layout,
};
use rtsl_ir::{Builder, OpKind, Scalar, Variable, VariableKind};
use rtsl_jit::{CompiledKernel, Llvm, OptLevel};
use rtsl_llvm::TargetFeatures;
use rtsl_packet::Kernel;
use rtsl_testing::functions::HashHost;

/// The number of values kept: 64 KiB for 16 rays at a time.
const KEPT: usize = 1_000;

/// The rays of three groups of chunks that could run as coroutines.
const RAYS: usize = 16 * 16 * 2 + 5;

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

fn call(kernel: &CompiledKernel, rays: usize) -> Result<(CallStatus, Vec<u32>), CallError> {
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
        host: &mut HashHost::default(),
    });
    status.map(|status| (status, scratch.words(1).to_vec()))
}

/// Limits the memory of the process, or removes the limit.
fn limit_memory(is_limited: bool) {
    let pages = std::fs::read_to_string("/proc/self/statm").unwrap();
    let pages: u64 = pages.split(' ').next().unwrap().parse().unwrap();
    // Some for the heap of the test, less than a stack.
    let used = (pages << 12) + (256 << 10);
    // Safety: the limits are read and written in local memory; the hard limit is unchanged.
    unsafe {
        let mut limit = libc::rlimit { rlim_cur: 0, rlim_max: 0 };
        assert_eq!(libc::getrlimit(libc::RLIMIT_AS, &mut limit), 0);
        limit.rlim_cur = if is_limited { used } else { limit.rlim_max };
        assert_eq!(libc::setrlimit(libc::RLIMIT_AS, &limit), 0);
    }
}

#[test]
fn calls_without_stacks_are_errors() {
    let program = std::env::current_exe().unwrap();
    let arguments = ["--exact", "stacks::stacks_run_out", "--ignored", "--nocapture"];
    let output = Command::new(program).args(arguments).output().unwrap();
    let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
    let (said, complained) = (text(&output.stdout), text(&output.stderr));
    assert!(output.status.success(), "{}\n{said}\n{complained}", output.status);
    assert!(said.contains("1 passed"), "{said}");
}

#[test]
#[ignore = "run by the test before it, in a process of its own"]
fn stacks_run_out() {
    let llvm = Llvm::load().unwrap_or_else(|error| panic!("{error}"));
    let features = TargetFeatures::new("", "", "");
    // The packet's chunks are separate; those of the leaf mode are not.
    for (mode, rays) in [(CallMode::Packet, RAYS), (CallMode::Packet, 1), (CallMode::Single, 1)] {
        let compile = || CompiledKernel::compile(&llvm, &[kernel(mode)], &features, OptLevel::O1);
        let kernel = compile().unwrap().remove(0);
        let work = move || {
            limit_memory(true);
            let without = call(&kernel, rays);
            limit_memory(false);
            // The first stack of this thread, needed for one ray.
            let one = call(&kernel, 1);
            assert!(one.is_ok());
            limit_memory(true);
            let with_one = call(&kernel, rays);
            limit_memory(false);
            (without, with_one, call(&kernel, rays))
        };
        // A thread that has no stacks yet.
        let (without, with_one, with_all) = std::thread::spawn(work).join().unwrap();
        match mode {
            CallMode::Single => assert!(without.is_ok(), "its frame is small"),
            _ => assert_eq!(without, Err(CallError::NoStack), "{mode:?}"),
        }
        assert!(with_all.is_ok());
        assert_eq!(with_one, with_all, "{mode:?}");
    }
}
