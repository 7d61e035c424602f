//! Guarantees of calls to their hosts, on both backends.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Arc;

use rtsl::host::{Host, LaneFloats, LaneSet, NoHost, RayLanes};
use rtsl::{
    Backend, CallArguments, CallMode, CallStatus, Class, Compiler, Emit, EmitRequest, Engine,
    EngineOptions, HostArguments, HostLanes, Instance, Instances, KernelRequest, LaneBlock,
    LaneIndices, LaneMask, LeafArguments, LeafTest, Method, OptLevel, Outputs, Program, Target,
    Variant, lookup_state, new_state, state_component_count,
};

use crate::common::class;

/// The interpreter, and machine code at every width where there is an LLVM.
fn engines(options: &EngineOptions) -> Vec<Engine> {
    let backends = Engine::WIDTHS.map(|width| (Backend::Jit, width));
    let all = [(Backend::Interpreter, 1)].into_iter().chain(backends);
    all.filter_map(|(backend, width)| {
        let options = EngineOptions { backend, width: Some(width), ..options.clone() };
        Engine::new(options).ok().map(|(engine, _)| engine)
    })
    .collect()
}

struct Call<'a> {
    class: &'a Arc<Class>,
    method: Method,
    count: usize,
    mask: Option<LaneMask>,
    host: &'a mut dyn Host,
}

fn call(engine: &Engine, call: Call<'_>) -> (CallStatus, LaneBlock) {
    let instance = Instance::new(call.class, []).unwrap();
    let program = engine.program(&instance);
    let kernel = program.kernel(call.method, CallMode::Packet).unwrap();
    let mut state = new_state(call.count);
    let status = kernel.call(CallArguments {
        state: &mut state,
        scratch: &mut program.new_scratch(call.count),
        count: call.count,
        mask: call.mask.as_ref(),
        accepted: None,
        instances: Instances::One(&program.block(&instance)),
        host: call.host,
    });
    (status, state)
}

fn component(name: &str) -> usize {
    lookup_state(name).unwrap().first_component as usize
}

/// `rand` is the ray's number; a limit on how often it may be asked.
struct Counting {
    asked: u32,
    limit: u32,
}

impl Host for Counting {
    fn occluded(&mut self, _: LaneSet, _: &RayLanes) -> u32 {
        // More lanes than asked: those that did not ask are not to be heard of.
        u32::MAX
    }

    fn ambient(&mut self) -> [f32; 3] {
        [0.25; 3]
    }

    fn rand(&mut self, lanes: LaneSet, values: &mut LaneFloats) {
        assert!(self.asked < self.limit, "the host has had enough");
        self.asked += 1;
        for lane in lanes.iter() {
            values[lane] = (lanes.base as usize + lane) as f32;
        }
    }
}

const RANDOM: &str = "
function Test.shade
state rt_SampleColor: f32[3]
{
  %r: f32 = rand
  %a: f32, %b: f32, %c: f32 = ambient
  return state:rt_SampleColor@0 = %r, state:rt_SampleColor@1 = %b
}";

#[test]
fn rays_that_take_no_part_are_left_alone() {
    let class = class(Method::Shade, RANDOM);
    for engine in engines(&EngineOptions::default()) {
        let mask = LaneMask::from_fn(21, |lane| lane % 3 == 1);
        let host = &mut Counting { asked: 0, limit: 100 };
        let arguments =
            Call { class: &class, method: Method::Shade, count: 21, mask: Some(mask), host };
        let (_, state) = call(&engine, arguments);
        let expected: Vec<f32> =
            (0..21).map(|lane| if lane % 3 == 1 { lane as f32 } else { 0.0 }).collect();
        assert_eq!(state.floats(component("rt_SampleColor")), expected);
        let ambient: Vec<f32> = (0..21).map(|it| if it % 3 == 1 { 0.25 } else { 0.0 }).collect();
        assert_eq!(state.floats(component("rt_SampleColor") + 1), ambient);
    }
}

#[test]
fn a_panic_of_the_host_goes_on_after_the_call() {
    let class = class(Method::Shade, RANDOM);
    for engine in engines(&EngineOptions::default()) {
        let host = &mut Counting { asked: 0, limit: 1 };
        let result = catch_unwind(AssertUnwindSafe(|| {
            let arguments =
                Call { class: &class, method: Method::Shade, count: 40, mask: None, host };
            call(&engine, arguments)
        }));
        let message = *result.err().unwrap().downcast::<&str>().unwrap();
        assert_eq!(message, "the host has had enough");
        assert_eq!(host.asked, 1);
    }
}

const ENDLESS: &str = "
function Test.shade
state rt_SampleColor: f32[3]
state rt_HitDistance: f32[1]
{
  %zero: f32 = constant 0.0
  %one: f32 = constant 1.0
  %d: f32 = load state:rt_HitDistance@0
  %n: f32 = loop (%i: f32 = %zero) {
    %next: f32 = add %i, %one
    %again: bool = greater_equal %d, %zero
    repeat %again, %next
  }
  return state:rt_SampleColor@0 = %n
}";

#[test]
fn endless_loops_end_with_their_budget() {
    let class = class(Method::Shade, ENDLESS);
    let options = EngineOptions { loop_budget: Some(1000), ..EngineOptions::default() };
    for engine in engines(&options) {
        let arguments =
            Call { class: &class, method: Method::Shade, count: 5, mask: None, host: &mut NoHost };
        let (status, _) = call(&engine, arguments);
        assert!(status.budget_exhausted);
    }
}

/// Engines at all levels of optimisation, on both backends.
fn engines_of_all_levels(loop_budget: Option<u32>) -> Vec<Engine> {
    let levels = [OptLevel::O0, OptLevel::O1, OptLevel::O2, OptLevel::O3];
    let engines = levels.into_iter().flat_map(|optimization| {
        engines(&EngineOptions { optimization, loop_budget, ..EngineOptions::default() })
    });
    engines.collect()
}

/// A loop of a known number of rounds is unrolled, and does not count; that is so at every level.
#[test]
fn budgets_run_out_alike_at_every_level() {
    let text = "class Sums : rt_Texture;
        void lookup() {
            float sum = 0.0;
            for (int i = 0; i < 4; i++) sum += rt_TextureUV.x;
            for (int i = 0; i < int(rt_TextureUV.y); i++) sum += 1.0;
            rt_FloatTextureValue = sum;
        }";
    let unit = Compiler::default().compile("sums.rtsl", text).unit.expect("it compiles");
    let instance = Instance::new(unit.class("Sums").unwrap(), []).unwrap();
    for engine in engines_of_all_levels(Some(2)) {
        let program = engine.program(&instance);
        let block = program.block(&instance);
        for (rounds, sum, exhausted) in [(1.0, 9.0, false), (2.0, 10.0, false), (9.0, 11.0, true)] {
            for shape in [CallMode::Packet, CallMode::CommonOrigin, CallMode::Single] {
                let mut state = new_state(1);
                state.floats_mut(component("rt_TextureUV"))[0] = 2.0;
                state.floats_mut(component("rt_TextureUV") + 1)[0] = rounds;
                let status = program.kernel(Method::Lookup, shape).unwrap().call(CallArguments {
                    state: &mut state,
                    scratch: &mut program.new_scratch(1),
                    count: 1,
                    mask: None,
                    accepted: None,
                    instances: Instances::One(&block),
                    host: &mut NoHost,
                });
                let found = state.floats(component("rt_FloatTextureValue"))[0];
                let level = engine.options().optimization;
                assert_eq!((found, status.budget_exhausted), (sum, exhausted), "{level:?}");
            }
        }
    }
}

/// In the leaf shape all objects read what the ray's lane has, and each stores to its own: what a method sets is
/// stored there, also where it is what was read.
#[test]
fn what_a_method_leaves_as_it_was_reaches_the_lanes_of_objects_at_every_level() {
    let text = "class Keeps : rt_Primitive; output float kept; output float other;
        void intersect() { hit(1.0); }
        void computeNormal() {
            float old = kept;
            if (rt_HitPoint.x > 5.0) kept = old;
            rt_GeometricNormal = vec3(1.0);
        }";
    let unit = Compiler::default().compile("keeps.rtsl", text).unit.expect("it compiles");
    let instance = Instance::new(unit.class("Keeps").unwrap(), []).unwrap();
    for engine in engines_of_all_levels(None) {
        let program = engine.program(&instance);
        let objects = program.objects([&*instance; 4]);
        let read = Outputs::NONE.with_scratch();
        for variant in [Variant::new(CallMode::Leaf), Variant::new(CallMode::Leaf).reading(read)] {
            let kernel = program.kernel(Method::ComputeNormal, variant).unwrap();
            let mut scratch = program.new_scratch(4);
            for array in 0..2 {
                scratch.floats_mut(array).copy_from_slice(&[10.0, 11.0, 12.0, 13.0]);
            }
            let status = kernel.call(CallArguments {
                state: &mut new_state(4),
                scratch: &mut scratch,
                count: 4,
                mask: None,
                accepted: None,
                instances: Instances::Range(&objects, 0),
                host: &mut NoHost,
            });
            assert_eq!(status, CallStatus::default());
            let level = engine.options().optimization;
            assert_eq!(scratch.floats(0), [10.0; 4], "{level:?}");
            assert_eq!(scratch.floats(1), [10.0, 11.0, 12.0, 13.0], "{level:?}");
        }
    }
}

#[test]
fn sizes_that_do_not_fit_are_refused() {
    let class = class(Method::Shade, RANDOM);
    for engine in engines(&EngineOptions::default()) {
        let instance = Instance::new(&class, []).unwrap();
        let program = engine.program(&instance);
        let kernel = program.kernel(Method::Shade, CallMode::Packet).unwrap();
        let block = program.block(&instance);
        let refused = |state: &mut LaneBlock, mask: Option<LaneMask>| {
            catch_unwind(AssertUnwindSafe(|| {
                kernel.call(CallArguments {
                    state,
                    scratch: &mut program.new_scratch(8),
                    count: 8,
                    mask: mask.as_ref(),
                    accepted: None,
                    instances: Instances::One(&block),
                    host: &mut NoHost,
                })
            }))
            .is_err()
        };
        assert!(!refused(&mut new_state(8), Some(LaneMask::new(8))));
        assert!(refused(&mut new_state(7), None));
        assert!(refused(&mut LaneBlock::new(3, 8), None));
        assert!(refused(&mut new_state(8), Some(LaneMask::new(7))));
        // `shade` stores two components and touches nothing else.
        let color = component("rt_SampleColor") as u32;
        let sparse =
            |present: &[u32]| LaneBlock::sparse(state_component_count() as usize, present, 8);
        assert!(!refused(&mut sparse(&[color + 1, color]), None));
        assert!(refused(&mut sparse(&[color + 1, color + 2]), None));
        assert!(program.kernel(Method::Bsdf, CallMode::Packet).is_err());
    }
}

/// A method that reads one component of what rays of these shapes have in common, and leaves others alone.
const DEPTH: &str = "class Depth : rt_Primitive; scratch vec2 variable;
    void intersect() { if (hit(rt_RayOrigin.z + 2.0)) variable.y = rt_RayDirection.y; }
    void computeNormal() { rt_GeometricNormal = vec3(rt_RayOrigin.z, variable.y, 1.0); }";

fn depth() -> Arc<Instance> {
    let unit = Compiler::default().compile("depth.rtsl", DEPTH).unit.expect("it compiles");
    Instance::new(unit.class("Depth").unwrap(), []).unwrap()
}

/// The result of a call of no rays whose arrays have so many lanes.
fn call_of_no_rays(
    program: &Program,
    lanes: usize,
    instances: Instances<'_>,
    call: impl FnOnce(CallArguments<'_>) -> CallStatus,
) -> CallStatus {
    call(CallArguments {
        state: &mut new_state(lanes),
        scratch: &mut program.new_scratch(lanes),
        count: 0,
        mask: None,
        accepted: Some(&mut LaneMask::new(0)),
        instances,
        host: &mut NoHost,
    })
}

#[test]
fn a_call_of_no_rays_does_nothing_in_any_shape() {
    let instance = depth();
    for engine in engines(&EngineOptions::default()) {
        let program = engine.program(&instance);
        let objects = Arc::new(program.objects([&*instance]));
        let (block, index) = (program.block(&instance), LaneIndices::new(0));
        for (shape, lanes, instances) in [
            (CallMode::Packet, 0, Instances::One(&block)),
            (CallMode::CommonOrigin, 0, Instances::One(&block)),
            (CallMode::Stream, 0, Instances::Many(&objects, &index)),
            // The lane of the ray that objects share.
            (CallMode::Leaf, 1, Instances::Range(&objects, 0)),
        ] {
            for method in [Method::Intersect, Method::ComputeNormal] {
                let kernel = program.kernel(method, shape).unwrap();
                let packets = program.packet_kernel(method, shape).unwrap();
                let found = [
                    call_of_no_rays(&program, lanes, instances, |call| kernel.call(call)),
                    call_of_no_rays(&program, lanes, instances, |call| {
                        packets.run(call, u64::MAX).status
                    }),
                ];
                assert_eq!(found, [CallStatus::default(); 2], "{shape:?}, {method:?}");
            }
        }
        let kernel = program.kernel(Method::Intersect, CallMode::Leaf).unwrap().for_leaves(objects);
        let (state, scratch) = (&mut new_state(1), &mut program.new_scratch(1));
        let tests = &mut [LeafTest::new(0, 0)];
        tests[0].set_nearest(Some(7));
        let host = &mut NoHost;
        let status = kernel.call(LeafArguments { state, scratch, count: 0, tests, host });
        assert_eq!((status, tests[0].nearest()), (CallStatus::default(), None));
    }
}

/// A call may omit the arrays of variables that its method does not use, also those that its rays share.
#[test]
fn arrays_that_a_method_does_not_touch_may_be_missing() {
    let instance = depth();
    for engine in engines(&EngineOptions::default()) {
        let program = engine.program(&instance);
        let block = program.block(&instance);
        for shape in [CallMode::Packet, CallMode::CommonOrigin, CallMode::Single] {
            let kernel = program.kernel(Method::ComputeNormal, shape).unwrap();
            let components: Vec<u32> = kernel.state_components().iter().collect();
            assert!(!components.contains(&(component("rt_RayOrigin") as u32)));
            let mut state = LaneBlock::sparse(state_component_count() as usize, &components, 1);
            state.floats_mut(component("rt_RayOrigin") + 2)[0] = 5.0;
            let status = kernel.call(CallArguments {
                state: &mut state,
                scratch: &mut program.new_scratch(1),
                count: 1,
                mask: None,
                accepted: None,
                instances: Instances::One(&block),
                host: &mut NoHost,
            });
            assert_eq!(status, CallStatus::default());
            assert_eq!(state.floats(component("rt_GeometricNormal")), [5.0], "{shape:?}");
            // The same with arrays of the host's own.
            let lanes = engine.width() as usize;
            let mut arrays = vec![vec![0.0; lanes]; components.len()];
            let mut state = HostLanes::new(state_component_count() as usize, lanes);
            for (component, array) in components.iter().zip(&mut arrays) {
                state.bind(*component as usize, array);
            }
            let mut scratch = [vec![0.0; lanes], vec![0.0; lanes]];
            let mut own = HostLanes::new(2, lanes);
            scratch.iter_mut().enumerate().for_each(|(array, it)| own.bind(array, it));
            let status = kernel.call_host(HostArguments {
                state: &mut state,
                scratch: &mut own,
                count: 1,
                mask: None,
                accepted: None,
                instances: Instances::One(&block),
                host: &mut NoHost,
            });
            assert_eq!(status, Ok(CallStatus::default()), "{shape:?}");
        }
    }
}

#[test]
fn instances_of_one_class_share_their_program_and_kernels() {
    let class = class(Method::Shade, RANDOM);
    let engine = &engines(&EngineOptions::default())[0];
    let instances = [(); 2].map(|()| Instance::new(&class, []).unwrap());
    let programs = [engine.program(&instances[0]), engine.program(&instances[1])];
    assert!(Arc::ptr_eq(&programs[0], &programs[1]));
    let requests: Vec<_> = [Method::Shade; 3]
        .map(|method| KernelRequest::new(&programs[0], method, CallMode::Packet))
        .into();
    let kernels: Vec<_> = engine.compile_all(&requests).into_iter().map(Result::unwrap).collect();
    assert!(Arc::ptr_eq(&kernels[0], &kernels[2]));
    let method = programs[0].method(Method::Shade).unwrap();
    assert!(method.reads.is_empty());
    assert_eq!(method.writes.iter().map(|it| it.name).collect::<Vec<_>>(), ["rt_SampleColor"]);
}

#[test]
fn every_form_can_be_printed() {
    let class = class(Method::Shade, RANDOM);
    let (engine, _) = Engine::new(EngineOptions { width: Some(8), ..Default::default() }).unwrap();
    let program = engine.program_of_class(&class);
    let mut forms = vec![
        (Emit::Ir, "function Test.shade"),
        (Emit::Packet, "kernel Test.shade packet W=8"),
        (Emit::Llvm, "define void"),
    ];
    if engine.llvm().is_some() {
        forms.extend([(Emit::OptimizedLlvm, "define void"), (Emit::Assembly, "ymm")]);
    }
    for (emit, part) in forms {
        let target = Target::by_name("x86-64-v3");
        let request =
            EmitRequest { emit, method: Method::Shade, variant: CallMode::Packet.into(), target };
        let text = program.emit(&request).unwrap();
        assert!(String::from_utf8_lossy(&text).contains(part), "{emit:?}");
    }
}
