//! Calls and packet code that would make machine code access foreign memory are refused: arguments that do not fit, and
//! packet code that violates invariants.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Arc;

use rtsl_abi::{
    BoundBuffer, CallArguments, CallMode, InstanceBlock, Instances, LaneBlock, LaneIndices,
    LaneMask, Layout, LeafArguments, LeafTest, ObjectForm, Objects,
};
use rtsl_ir::{Builder, Function, Index, OpKind, Scalar, Variable, VariableKind};
use rtsl_jit::{CompiledKernel, JitError, LeafKernel, Llvm, OptLevel};
use rtsl_llvm::TargetFeatures;
use rtsl_packet::Kernel;
use rtsl_testing::functions::HashHost;

const RAYS: usize = 4;

/// Reads a member and the second element of a buffer of pairs into scratch; with `accepts` also accepts a hit.
fn function(accepts: bool) -> Function {
    let mut builder = Builder::new("Reads.lookup");
    let mut variable = |kind, name: &str, len| {
        builder.variable(Variable { kind, name: name.to_owned(), scalar: Scalar::F32, len })
    };
    let member = variable(VariableKind::Member, "scale", 1);
    let buffer = variable(VariableKind::Buffer, "pairs", 2);
    let kept = variable(VariableKind::Scratch, "kept", 2);
    let (scale, index) = (builder.load(member, 0), builder.constant(rtsl_ir::Constant::I32(3)));
    let element = builder.push(OpKind::Load(buffer, Index::Dynamic(index))).get(0);
    builder.output(kept, 0, scale);
    builder.output(kept, 1, element);
    if accepts {
        let (kind, scalar) = (VariableKind::Accepted, Scalar::Bool);
        let accepted = builder.variable(Variable { kind, name: "hit".to_owned(), scalar, len: 1 });
        let hit = builder.constant(rtsl_ir::Constant::Bool(true));
        builder.output(accepted, 0, hit);
    }
    builder.finish()
}

fn kernel(mode: CallMode) -> Kernel {
    lowered(&function(false), mode)
}

fn lowered(function: &Function, mode: CallMode) -> Kernel {
    let variables = |kind| function.variables.iter().filter(move |variable| variable.kind == kind);
    let layout = Layout::new(
        variables(VariableKind::Member),
        variables(VariableKind::Buffer),
        variables(VariableKind::Scratch),
    );
    rtsl_packet::lower(function, &layout, mode, 4).unwrap()
}

/// Compiles with target names that would break the text.
fn compile(kernels: &[Kernel]) -> Result<Vec<CompiledKernel>, JitError> {
    let llvm = Llvm::load().unwrap_or_else(|error| panic!("{error}"));
    let features = TargetFeatures::new("none", "\" ptr", "");
    CompiledKernel::compile(&llvm, kernels, &features, OptLevel::O1)
}

fn block(element_words: u32) -> InstanceBlock {
    let words = [1.0_f32, 2.0, 3.0, 4.0].map(f32::to_bits).into();
    InstanceBlock::new(&[0, 0, 0, 0, 1], vec![BoundBuffer { offset: 0, words, element_words }])
}

/// Returns the element of the buffer that the call stores, or the error.
fn call(mode: CallMode, block: &InstanceBlock, scratch_arrays: usize, count: usize) -> Option<f32> {
    let kernel = compile(&[kernel(mode)]).unwrap().remove(0);
    call_for(&kernel, Instances::One(block), scratch_arrays, count)
}

fn call_for(
    kernel: &CompiledKernel,
    instances: Instances<'_>,
    scratch_arrays: usize,
    count: usize,
) -> Option<f32> {
    let mut state = LaneBlock::new(rtsl_spec::state_component_count() as usize, RAYS);
    let mut scratch = LaneBlock::new(scratch_arrays, RAYS);
    let call = AssertUnwindSafe(|| {
        let _ = kernel.call(CallArguments {
            state: &mut state,
            scratch: &mut scratch,
            count,
            mask: None,
            accepted: Some(&mut LaneMask::new(RAYS)),
            instances,
            host: &mut HashHost::default(),
        });
        scratch.floats(1)[0]
    });
    catch_unwind(call).ok()
}

#[test]
fn calls_that_do_not_fit_are_refused() {
    let fitting = block(2);
    assert_eq!(call(CallMode::Packet, &fitting, 2, RAYS), Some(4.0));
    assert_eq!(call(CallMode::Single, &fitting, 2, 1), Some(4.0));
    assert_eq!(call(CallMode::Packet, &fitting, 2, RAYS + 1), None, "too many rays");
    assert_eq!(call(CallMode::Packet, &fitting, 1, RAYS), None, "too little scratch");
    assert_eq!(call(CallMode::Single, &fitting, 2, 2), None, "more than one ray");
    assert_eq!(call(CallMode::Stream, &fitting, 2, RAYS), None, "one instance for all rays");
    assert_eq!(call(CallMode::Leaf, &fitting, 2, RAYS), None, "an instance that is no lanes");
    assert_eq!(call(CallMode::Packet, &block(1), 2, RAYS), None, "elements of another size");
    let numbers_only = InstanceBlock::new(&[64; 5], Vec::new());
    assert_eq!(call(CallMode::Packet, &numbers_only, 2, RAYS), None, "no buffer, but numbers");
    let short = InstanceBlock::new(fitting.words().split_at(4).0, fitting.buffers().to_vec());
    assert_eq!(call(CallMode::Packet, &short, 2, RAYS), None, "too small an instance");
}

#[test]
fn objects_that_do_not_fit_are_refused() {
    let objects = |words: u32, element_words: u32| {
        let instances = std::iter::repeat_n(block(element_words), 19);
        Arc::new(Objects::of_instances(ObjectForm::new(0..words), instances))
    };
    let test = lowered(&function(true), CallMode::Leaf);
    let kernels = [kernel(CallMode::Stream), kernel(CallMode::Leaf), test];
    let [stream, leaf, test] = compile(&kernels).unwrap().try_into().unwrap();
    let (fitting, short) = (objects(6, 2), objects(5, 2));
    let range =
        |objects: &Objects, first| call_for(&leaf, Instances::Range(objects, first), 2, RAYS);
    assert_eq!(range(&fitting, 8), Some(4.0));
    assert_eq!(range(&fitting, 4), None, "the first is not the first of a block");
    assert_eq!(range(&fitting, 16), None, "objects past the last");
    assert_eq!(range(&fitting, u32::MAX - 7), None, "no such objects");
    assert_eq!(range(&short, 8), None, "another form");
    assert_eq!(range(&objects(6, 1), 8), None, "elements of another size");
    let mut indices = LaneIndices::new(RAYS);
    indices.as_mut_slice().fill(18);
    let many =
        |indices: &LaneIndices| call_for(&stream, Instances::Many(&fitting, indices), 2, RAYS);
    assert_eq!(many(&indices), Some(4.0));
    indices.as_mut_slice()[1] = 19;
    assert_eq!(many(&indices), None, "no such object");
    let packet = compile(&[kernel(CallMode::Packet)]).unwrap().remove(0);
    let one = call_for(&packet, Instances::Object(&fitting, 3), 2, RAYS);
    assert_eq!(one, None, "the kernel takes an instance");

    let prepared = |kernel: &CompiledKernel, objects: &Arc<Objects>| {
        let make = AssertUnwindSafe(|| LeafKernel::new(kernel, objects.clone()));
        catch_unwind(make).ok()
    };
    assert!(prepared(&leaf, &fitting).is_none() && prepared(&test, &short).is_none());
    let prepared = prepared(&test, &fitting).unwrap();
    let call = |ray, first, count, lanes| {
        let mut state = LaneBlock::new(rtsl_spec::state_component_count() as usize, lanes);
        let mut scratch = LaneBlock::new(2, lanes);
        let call = AssertUnwindSafe(|| {
            let host = &mut HashHost::default();
            let (state, scratch) = (&mut state, &mut scratch);
            let tests = &mut [LeafTest::new(0, 0), LeafTest::new(ray, first)];
            let _ = prepared.call(LeafArguments { state, scratch, count, tests, host });
            assert_eq!(tests.map(|test| test.nearest()), [Some(0), Some(first)]);
            scratch.floats(1)[ray as usize]
        });
        catch_unwind(call).ok()
    };
    assert_eq!(call(3, 8, 4, RAYS), Some(4.0));
    assert_eq!(call(3, 8, 4, 3), None, "a ray without a lane");
    assert_eq!(call(u32::MAX, 8, 4, RAYS), None, "a ray that no block has");
    assert_eq!(call(3, 16, 4, RAYS), None, "objects past the last");
    assert_eq!(call(3, 12, 4, RAYS), None, "the first is not the first of a block");
}

#[test]
fn packet_code_that_breaks_the_rules_is_refused() {
    let break_rule = |change: fn(&mut Kernel)| {
        let mut kernel = kernel(CallMode::Stream);
        change(&mut kernel);
        matches!(compile(&[kernel]), Err(JitError::InvalidKernel(_)))
    };
    assert!(!break_rule(|_| {}));
    assert!(break_rule(|kernel| kernel.mode = CallMode::Packet));
    assert!(break_rule(|kernel| kernel.variables[0].varies = false));
    assert!(break_rule(|kernel| kernel.width = 3));
    assert!(break_rule(|kernel| kernel.outputs[0].component = 7));
}

#[test]
#[should_panic(expected = "entries of buffers lap over")]
fn buffers_have_entries_of_their_own() {
    let buffer = |offset| BoundBuffer { offset, words: [0; 4].into(), element_words: 1 };
    let _ = InstanceBlock::new(&[0; 8], vec![buffer(2), buffer(0)]);
}
