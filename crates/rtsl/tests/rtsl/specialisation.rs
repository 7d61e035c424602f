//! Kernels for known values, made behind general ones: the same bits whichever is called, the
//! parameters of the moment at every call.

use std::sync::Arc;

use rtsl::host::NoHost;
use rtsl::{
    Backend, CallArguments, CallMode, Class, Compiler, Engine, EngineOptions, Instance,
    InstanceBlock, Instances, Kernel, KernelRequest, Method, SpecialisedKernel, Value,
    lookup_state, new_state,
};

const COUNT: usize = 19;

/// A loop, a branch, an index and an untaken division, all decided by members.
const WAVES: &str = "
class Waves : rt_Texture;
public int count = 3;
public bool inverted = false;
public float gain[4] = float[4](0.5, 0.25, 0.125, 2.0);
public float height = 1.0;
public float unread = 1.0;
void lookup() {
    float sum = 0.0;
    for (int i = 0; i < count; ++i) {
        sum += gain[i & 3] * sin(rt_TextureUV.x * float(i + 1) + rt_TextureUV.y / height);
    }
    rt_FloatTextureValue = inverted ? 1.0 / sum : sum * height;
}";

fn waves() -> Arc<Class> {
    let compilation = Compiler::default().compile("waves.rtsl", WAVES);
    let unit = compilation.unit.as_ref().unwrap_or_else(|| panic!("{}", compilation.report(false)));
    unit.classes()[0].clone()
}

fn instance(class: &Arc<Class>, count: i32, inverted: bool, height: f32) -> Arc<Instance> {
    let arguments = [
        ("count", Value::Int(count)),
        ("inverted", Value::Bool(inverted)),
        ("height", Value::Float(height)),
    ];
    Instance::new(class, arguments).expect("arguments of the right types")
}

fn engine(backend: Backend, width: u32) -> Option<Engine> {
    let options = EngineOptions { backend, width: Some(width), ..EngineOptions::default() };
    Engine::new(options).ok().map(|(engine, _)| engine)
}

fn engines() -> Vec<Engine> {
    let backends = [(Backend::Interpreter, 1), (Backend::Jit, 1), (Backend::Jit, 8)];
    backends.into_iter().filter_map(|(backend, width)| engine(backend, width)).collect()
}

fn bits(kernel: &Kernel, block: &InstanceBlock) -> Vec<u32> {
    let component = |name| lookup_state(name).unwrap().first_component as usize;
    let mut state = new_state(COUNT);
    let uv = component("rt_TextureUV");
    for lane in 0..COUNT {
        state.floats_mut(uv)[lane] = lane as f32 * 0.37 - 2.0;
        state.floats_mut(uv + 1)[lane] = lane as f32 * -0.21 + 1.0;
    }
    let _ = kernel.call(CallArguments {
        state: &mut state,
        scratch: &mut rtsl::LaneBlock::new(0, COUNT),
        count: COUNT,
        mask: None,
        accepted: None,
        instances: Instances::One(block),
        host: &mut NoHost,
    });
    state.words(component("rt_FloatTextureValue")).to_vec()
}

/// The interpreter's result for an instance, without specialisation.
fn oracle(instance: &Instance) -> Vec<u32> {
    let engine = engine(Backend::Interpreter, 1).expect("the interpreter is always there");
    let program = engine.program(instance);
    let kernel = program.kernel(Method::Lookup, CallMode::Packet).unwrap();
    bits(&kernel, &program.block(instance))
}

fn specialised(engine: &Engine, instance: &Instance) -> SpecialisedKernel {
    let program = engine.program(instance);
    let request = KernelRequest::new(&program, Method::Lookup, CallMode::Packet);
    engine.specialise(&request, instance).unwrap()
}

#[test]
fn both_kernels_give_the_oracles_bits_and_a_change_counts_at_once() {
    let class = waves();
    let values = [(3, false, 1.0), (0, true, 0.0), (4, true, -2.5), (40, false, 3.0)];
    let instances = values.map(|(count, on, height)| instance(&class, count, on, height));
    for engine in engines() {
        let program = engine.program(&instances[0]);
        let general = program.kernel(Method::Lookup, CallMode::Packet).unwrap();
        let mut kernel = specialised(&engine, &instances[0]);
        for instance in instances.iter().chain(&instances[..1]) {
            kernel.set_instance(instance);
            let expected = oracle(instance);
            assert_eq!(bits(kernel.kernel(), kernel.block()), expected, "at once");
            kernel.wait();
            assert!(kernel.is_specialised() && kernel.error().is_none());
            assert!(!Arc::ptr_eq(kernel.kernel(), &general));
            assert_eq!(bits(kernel.kernel(), kernel.block()), expected, "specialised");
        }
    }
}

#[test]
fn values_used_before_are_there_at_once_and_old_ones_are_forgotten() {
    let class = waves();
    let engine = engine(Backend::Interpreter, 1).unwrap();
    let of = |height: usize| instance(&class, 3, false, height as f32);
    let mut kernel = specialised(&engine, &of(0));
    kernel.wait();
    let first = kernel.kernel().clone();
    kernel.set_instance(&of(1));
    kernel.wait();
    kernel.set_instance(&of(0));
    assert!(kernel.is_specialised(), "it is kept");
    assert!(Arc::ptr_eq(kernel.kernel(), &first));
    for height in 2..200 {
        kernel.set_instance(&of(height));
        kernel.wait();
    }
    kernel.set_instance(&of(0));
    kernel.wait();
    assert!(!Arc::ptr_eq(kernel.kernel(), &first), "memory is bounded");
}

#[test]
fn members_that_the_method_does_not_read_make_no_new_kernel() {
    let class = waves();
    let engine = engine(Backend::Interpreter, 1).unwrap();
    let mut kernel = specialised(&engine, &Instance::new(&class, []).unwrap());
    kernel.wait();
    let before = kernel.kernel().clone();
    kernel.set_instance(&Instance::new(&class, [("unread", Value::Float(7.0))]).unwrap());
    assert!(Arc::ptr_eq(kernel.kernel(), &before));
}

/// Threads that call while the kernel is exchanged under them all see the same bits.
#[test]
fn the_moment_of_the_exchange_does_not_matter() {
    let class = waves();
    for engine in engines() {
        for round in 0..8 {
            let instance = instance(&class, 4, round % 2 == 0, 1.5 + round as f32);
            let expected = oracle(&instance);
            let kernel = specialised(&engine, &instance);
            std::thread::scope(|scope| {
                for _ in 0..2 {
                    scope.spawn(|| {
                        while !kernel.is_specialised() {
                            assert_eq!(bits(kernel.kernel(), kernel.block()), expected);
                        }
                        assert_eq!(bits(kernel.kernel(), kernel.block()), expected);
                    });
                }
            });
        }
    }
}

#[test]
fn known_members_leave_no_loop_and_no_branch() {
    let class = waves();
    let engine = engine(Backend::Interpreter, 1).unwrap();
    let instance = instance(&class, 2, true, 1.0);
    let program = engine.program(&instance);
    let request = |variant| rtsl::EmitRequest {
        emit: rtsl::Emit::Ir,
        method: Method::Lookup,
        variant,
        target: None,
    };
    let text = |variant: rtsl::Variant| {
        String::from_utf8(program.emit(&request(variant)).unwrap()).unwrap()
    };
    let general = rtsl::Variant::new(CallMode::Packet);
    let known = general.clone().knowing(program.known_members(&instance));
    for word in ["loop", "member:count", "member:inverted", "load member:height"] {
        assert!(text(general.clone()).contains(word), "{word}");
        assert!(!text(known.clone()).contains(word), "{word}");
    }
}

#[test]
fn choices_that_objects_share_are_known() {
    let class = waves();
    let engine = engine(Backend::Interpreter, 1).unwrap();
    let text = |counts: [i32; 2], heights: [f32; 2]| {
        let instances = [0, 1].map(|it| instance(&class, counts[it], true, heights[it]));
        let program = engine.program(&instances[0]);
        let objects = program.differing_objects(instances.iter().map(|it| &**it));
        let variant = rtsl::Variant::new(CallMode::Stream).of_objects(objects.form().clone());
        let request = rtsl::EmitRequest {
            emit: rtsl::Emit::Ir,
            method: Method::Lookup,
            variant: variant.knowing(program.known_choices(&objects)),
            target: None,
        };
        String::from_utf8(program.emit(&request).unwrap()).unwrap()
    };
    let read = |text: &str| {
        ["count", "inverted", "height"].map(|name| text.contains(&format!("load member:{name}")))
    };
    assert_eq!(read(&text([2, 2], [1.0, 1.0])), [false, false, true]);
    assert_eq!(read(&text([2, 3], [1.0, 2.0])), [true, false, true]);
}

#[test]
fn a_kernel_may_outlive_its_engine() {
    let class = waves();
    let instance = instance(&class, 4, false, 1.0);
    for engine in engines() {
        let kernel = specialised(&engine, &instance);
        drop(engine);
        kernel.wait();
        assert_eq!(bits(kernel.kernel(), kernel.block()), oracle(&instance));
    }
}
