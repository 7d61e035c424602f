//! A caller's promise that directions have unit length: used where results may differ, else ignored.

use std::sync::Arc;

use rtsl::host::NoHost;
use rtsl::{
    Backend, CallArguments, CallMode, Class, Compiler, Engine, EngineOptions, Instance, Instances,
    LaneBlock, LaneMask, Math, Method, Variant, lookup_state, new_state,
};

const COUNT: usize = 33;

/// A sphere for directions of any length; what it knows of their length it leaves in scratch.
const SPHERE: &str = "
class Sphere : rt_Primitive;
public float radius = 1.0;
scratch float squared;
scratch float size;
scratch vec3 unit;
void intersect() {
    squared = dot(rt_RayDirection, rt_RayDirection);
    size = length(-rt_RayDirection);
    unit = normalize(rt_RayDirection);
    float b = dot(rt_RayOrigin, rt_RayDirection);
    float root = sqrt(b * b - squared * (dot(rt_RayOrigin, rt_RayOrigin) - radius * radius));
    hit((-b - root) / squared);
}";

fn sphere() -> Arc<Class> {
    let compilation = Compiler::default().compile("sphere.rtsl", SPHERE);
    let unit = compilation.unit.as_ref().unwrap_or_else(|| panic!("{}", compilation.report(false)));
    unit.classes()[0].clone()
}

fn engines(math: Math) -> Vec<Engine> {
    let backends = [(Backend::Interpreter, 1), (Backend::Jit, 1), (Backend::Jit, 8)];
    let engines = backends.into_iter().filter_map(|(backend, width)| {
        let width = Some(width);
        Engine::new(EngineOptions { backend, width, math, ..EngineOptions::default() }).ok()
    });
    engines.map(|(engine, _)| engine).collect()
}

/// State and scratch after a call for rays towards the sphere.
fn call(engine: &Engine, variant: Variant) -> (LaneBlock, LaneBlock) {
    let instance = Instance::new(&sphere(), []).expect("it has defaults");
    let program = engine.program(&instance);
    let kernel = program.kernel(Method::Intersect, variant).expect("it compiles");
    let component = |name| lookup_state(name).expect("a state variable").first_component as usize;
    let mut state = new_state(COUNT);
    for lane in 0..COUNT {
        let (sine, cosine) = (0.6_f32, 0.8_f32);
        let slope = lane as f32 * 0.006;
        let length = (slope * slope + 1.0).sqrt();
        let direction = [slope * sine / length, slope * cosine / length, 1.0 / length];
        for (index, value) in direction.into_iter().enumerate() {
            state.floats_mut(component("rt_RayDirection") + index)[lane] = value;
        }
        state.floats_mut(component("rt_RayOrigin") + 2)[lane] = -4.0;
        state.floats_mut(component("rt_HitDistance"))[lane] = f32::INFINITY;
    }
    let mut scratch = program.new_scratch(COUNT);
    let status = kernel.call(CallArguments {
        state: &mut state,
        scratch: &mut scratch,
        count: COUNT,
        mask: None,
        accepted: Some(&mut LaneMask::new(COUNT)),
        instances: Instances::One(&program.block(&instance)),
        host: &mut NoHost,
    });
    assert!(!status.budget_exhausted);
    (state, scratch)
}

#[test]
fn fast_takes_the_length_for_one() {
    for engine in engines(Math::Fast) {
        let general = call(&engine, CallMode::Packet.into());
        let special = call(&engine, Variant::new(CallMode::Packet).with_unit_directions());
        assert!(special.1.floats(0).iter().all(|squared| *squared == 1.0));
        assert!(special.1.floats(1).iter().all(|size| *size == 1.0));
        let blocks = [(&general.0, &special.0), (&general.1, &special.1)];
        for (general, special) in blocks {
            for array in 0..general.components() {
                for (a, b) in general.floats(array).iter().zip(special.floats(array)) {
                    assert!((a - b).abs() < 1e-5 || a == b, "{array}: {a:e} {b:e}");
                }
            }
        }
    }
}

#[test]
fn otherwise_the_promise_changes_nothing() {
    for math in [Math::Contract, Math::Strict] {
        for engine in engines(math) {
            let general = call(&engine, CallMode::Packet.into());
            let special = call(&engine, Variant::new(CallMode::Packet).with_unit_directions());
            for (general, special) in [(&general.0, &special.0), (&general.1, &special.1)] {
                for array in 0..general.components() {
                    assert_eq!(general.words(array), special.words(array), "{array}");
                }
            }
        }
    }
}
