//! Calls with a host's arrays access no byte past them: each array ends at an inaccessible page.
//!
//! A separate test program, since an access past an array ends the process.
#![cfg(target_os = "linux")]
#![allow(unsafe_code, reason = "maps pages, and hands out pointers to them")]

use rtsl_abi::{
    CallError, CallMode, CallStatus, HostArguments, HostLanes, InstanceBlock, Instances,
    LaneIndices, Layout, ObjectForm, Objects,
};
use rtsl_ir::{Builder, CompareOp, Constant, Function, Scalar, UnaryOp, Variable, VariableKind};
use rtsl_jit::{CompiledKernel, Llvm, OptLevel};
use rtsl_llvm::TargetFeatures;
use rtsl_packet::{Kernel, interleave};
use rtsl_spec::{lookup_state, state_component_count};
use rtsl_testing::functions::HashHost;

/// The largest page of any machine.
const PAGE: usize = 64 << 10;

/// A page followed by an inaccessible one.
struct Guarded {
    start: *mut u8,
}

impl Guarded {
    fn new() -> Guarded {
        // Safety: a new mapping at an address of the system's choice, whose second half becomes inaccessible.
        let start = unsafe {
            let (access, flags) =
                (libc::PROT_READ | libc::PROT_WRITE, libc::MAP_PRIVATE | libc::MAP_ANONYMOUS);
            let start = libc::mmap(std::ptr::null_mut(), 2 * PAGE, access, flags, -1, 0);
            assert!(start != libc::MAP_FAILED, "there is memory");
            assert_eq!(libc::mprotect(start.byte_add(PAGE), PAGE, libc::PROT_NONE), 0);
            start
        };
        Guarded { start: start.cast() }
    }

    /// Returns the last `count` words before the guard page.
    fn words(&self, count: usize) -> *mut f32 {
        assert!(count * 4 <= PAGE);
        // Safety: within the first page, or at its end.
        unsafe { self.start.add(PAGE - count * 4).cast() }
    }

    fn integers(&mut self, count: usize) -> &mut [i32] {
        // Safety: that many words are before the guard page; any bits are a number, and they are borrowed mutably along
        // with this.
        unsafe { std::slice::from_raw_parts_mut(self.words(count).cast(), count) }
    }
}

impl Drop for Guarded {
    fn drop(&mut self) {
        // Safety: the mapping of `new`.
        unsafe { libc::munmap(self.start.cast(), 2 * PAGE) };
    }
}

/// Reads state, scratch and a member, stores state and scratch, and with `accepts` accepts a hit.
fn function(accepts: bool) -> Function {
    let mut builder = Builder::new("Guarded.intersect");
    let mut variable = |kind, name: &str, len| {
        builder.variable(Variable { kind, name: name.to_owned(), scalar: Scalar::F32, len })
    };
    let origin = variable(VariableKind::State, "rt_RayOrigin", 3);
    let distance = variable(VariableKind::State, "rt_HitDistance", 1);
    let kept = variable(VariableKind::Scratch, "kept", 2);
    let member = variable(VariableKind::Member, "scale", 1);
    let (x, z) = (builder.load(origin, 0), builder.load(origin, 2));
    let (old, scale) = (builder.load(kept, 1), builder.load(member, 0));
    let root = builder.unary(UnaryOp::Sqrt, x);
    let sum = builder.fma(root, scale, old);
    builder.output(distance, 0, sum);
    builder.output(kept, 0, z);
    if accepts {
        let (kind, scalar) = (VariableKind::Accepted, Scalar::Bool);
        let accepted = builder.variable(Variable { kind, name: "hit".to_owned(), scalar, len: 1 });
        let limit = builder.constant(Constant::F32(0.5));
        let hit = builder.compare(CompareOp::Less, z, limit);
        builder.output(accepted, 0, hit);
    }
    builder.finish()
}

fn lowered(function: &Function, mode: CallMode, width: u32, interleave: Option<u32>) -> Kernel {
    let variables = |kind| function.variables.iter().filter(move |variable| variable.kind == kind);
    let layout = Layout::new(
        variables(VariableKind::Member),
        variables(VariableKind::Buffer),
        variables(VariableKind::Scratch),
    );
    let mut kernel = rtsl_packet::lower(function, &layout, mode, width).unwrap();
    kernel.interleave = interleave::choose(&kernel, interleave);
    kernel
}

/// Calls the kernel for so many rays with arrays of so many lanes.
fn call(
    kernel: &CompiledKernel,
    count: usize,
    lanes: usize,
    masked: bool,
    instances: Instances<'_>,
) -> Result<CallStatus, CallError> {
    let arrays = || (0..5).map(|_| Guarded::new()).collect::<Vec<_>>();
    let (state_arrays, scratch_arrays) = (arrays(), arrays());
    let first = |name| lookup_state(name).unwrap().first_component as usize;
    let (origin, distance) = (first("rt_RayOrigin"), first("rt_HitDistance"));
    let mut state = vec![std::ptr::null_mut(); state_component_count() as usize];
    for (component, array) in [origin, origin + 1, origin + 2, distance].iter().zip(&state_arrays) {
        state[*component] = array.words(lanes);
    }
    let scratch: Vec<*mut f32> = scratch_arrays[..2].iter().map(|it| it.words(lanes)).collect();
    let (mut mask, mut accepted) = (Guarded::new(), Guarded::new());
    for (lane, word) in mask.integers(lanes).iter_mut().enumerate() {
        *word = -i32::from(lane % 3 != 1);
    }
    // Safety: each array has that many lanes, and is not used otherwise.
    let (mut state, mut scratch) =
        unsafe { (HostLanes::from_table(&state, lanes), HostLanes::from_table(&scratch, lanes)) };
    kernel.call_host(HostArguments {
        state: &mut state,
        scratch: &mut scratch,
        count,
        mask: masked.then_some(mask.integers(lanes)),
        accepted: Some(accepted.integers(lanes)),
        instances,
        host: &mut HashHost::default(),
    })
}

#[test]
fn no_byte_past_a_hosts_arrays_is_touched() {
    let llvm = Llvm::load().unwrap_or_else(|error| panic!("{error}"));
    let features = TargetFeatures::new("", "", "");
    let block = InstanceBlock::new(&[2.0_f32.to_bits()], Vec::new());
    for (width, interleave) in [(1, None), (4, None), (4, Some(4)), (8, Some(2)), (16, Some(2))] {
        for mode in [CallMode::Single, CallMode::Packet, CallMode::CommonOrigin, CallMode::Stream] {
            let kernels = [true, false].map(|it| lowered(&function(it), mode, width, interleave));
            let kernels = CompiledKernel::compile(&llvm, &kernels, &features, OptLevel::O2);
            for kernel in kernels.unwrap() {
                let width = kernel.width();
                let words = kernel.signature().object_words.unwrap_or(0);
                let objects = Objects::of_instances(ObjectForm::new(0..words), [&block; 3]);
                for count in [0, 1, 2, width - 1, width, width + 1, 4 * width, 67] {
                    let mut indices = LaneIndices::new(count);
                    indices.as_mut_slice().fill(2);
                    let instances = match mode {
                        CallMode::Stream => Instances::Many(&objects, &indices),
                        _ => Instances::One(&block),
                    };
                    let lanes = count.next_multiple_of(width);
                    for masked in [false, true] {
                        let status = call(&kernel, count, lanes, masked, instances);
                        let expected = match mode {
                            CallMode::Single if count != 1 || masked => Err(CallError::NotOneRay),
                            _ => Ok(CallStatus::default()),
                        };
                        assert_eq!(status, expected, "{mode:?}, width {width}, {count} rays");
                    }
                    if lanes > 0 && mode != CallMode::Single {
                        let status = call(&kernel, count, lanes - 1, false, instances);
                        let given = lanes - 1;
                        let error = CallError::TooFewLanes { rays: count, needed: lanes, given };
                        assert_eq!(status, Err(error));
                    }
                }
            }
        }
    }
}
