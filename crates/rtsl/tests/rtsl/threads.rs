//! All that hosts share among threads may be shared.

use std::sync::Arc;

use rtsl::aot::AotLibrary;
use rtsl::host::NoHost;
use rtsl::{
    CallArguments, CallMode, Class, Compilation, Compiler, Diagnostic, Engine, EngineOptions,
    Instance, InstanceBlock, Instances, Kernel, LaneBlock, LaneMask, LeafKernel, Method, Objects,
    Program, Role, SpecialisedKernel, Unit, Value, Variant, lookup_state, new_state, set_defaults,
};

fn is_for_all_threads<T: Send + Sync>() {}

#[test]
fn types_are_for_all_threads() {
    is_for_all_threads::<(Compiler, Compilation, Unit, Class, Diagnostic)>();
    is_for_all_threads::<(Instance, Value, InstanceBlock, Objects, LaneBlock, LaneMask)>();
    is_for_all_threads::<(Engine, Program, Kernel, LeafKernel, Variant, SpecialisedKernel)>();
    is_for_all_threads::<AotLibrary>();
}

/// Threads that begin at once ask one engine for the same and for different things.
#[test]
fn threads_share_an_engine() {
    let text = "class Ball : rt_Primitive; public float radius = 1.0;
        void intersect() { hit(-rt_RayOrigin.z - radius); }";
    let unit = Compiler::default().compile("ball.rtsl", text).unit.expect("it compiles");
    let (engine, _) = Engine::new(EngineOptions::default()).unwrap();
    let distances = std::thread::scope(|scope| {
        let (engine, class) = (&engine, unit.class("Ball").unwrap());
        let work = |number: u32| {
            scope.spawn(move || {
                let shape =
                    if number.is_multiple_of(2) { CallMode::Packet } else { CallMode::Single };
                (1..=20)
                    .map(|radius| distance(engine, class, radius as f32, shape))
                    .collect::<Vec<_>>()
            })
        };
        let threads: Vec<_> = (0..8).map(work).collect();
        threads.into_iter().map(|thread| thread.join().unwrap()).collect::<Vec<_>>()
    });
    let expected: Vec<f32> = (1..=20).map(|radius| 100.0 - radius as f32).collect();
    assert!(distances.iter().all(|found| *found == expected));
}

fn distance(engine: &Engine, class: &Arc<Class>, radius: f32, shape: CallMode) -> f32 {
    let ball = Instance::new(class, [("radius", radius.into())]).unwrap();
    let program = engine.program(&ball);
    let kernel = program.kernel(Method::Intersect, shape).unwrap();
    let mut state = new_state(1);
    set_defaults(&mut state, Role::Primitive);
    let first = |name| lookup_state(name).unwrap().first_component as usize;
    state.floats_mut(first("rt_RayOrigin") + 2)[0] = -100.0;
    let _ = kernel.call(CallArguments {
        state: &mut state,
        scratch: &mut program.new_scratch(1),
        count: 1,
        mask: None,
        accepted: Some(&mut LaneMask::new(1)),
        instances: Instances::One(&program.block(&ball)),
        host: &mut NoHost,
    });
    state.floats(first("rt_HitDistance"))[0]
}
