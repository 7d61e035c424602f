//! Texts that ask for much: stack for the values that a method keeps, and work for the code generator. None of them
//! may crash its host or keep it waiting; what is too much is an error with a code.

use std::process::Command;
use std::sync::Arc;

use rtsl::ahead::AheadOptions;
use rtsl::host::{Host, LaneColors, LaneFloats, LaneSet, LightLanes, LightQueryLanes, RayLanes};
use rtsl::{
    Backend, CallArguments, Compiler, Diagnostic, Emit, EmitRequest, Engine, EngineOptions,
    Instance, Instances, Kernel, LaneIndices, LaneMask, Math, Method, Program, Shape, library,
    lookup_state, new_state,
};

/// The stack that a host's thread must have.
const STACK: usize = 512 << 10;

/// More than a chunk, and not a multiple of any width.
const COUNT: usize = 37;

/// Objects before those of a call.
const FIRST: u32 = 8;

/// Every method keeps this many values over a loop or a request, each 1 where its rays are at 1, and gives their sum.
fn text(method: Method, count: usize) -> String {
    let (head, source, middle, result) = match method {
        Method::Intersect => (
            "class T : rt_Primitive; void intersect() {",
            "rt_RayOrigin.x",
            "for (int k = 0; k < int(rt_RayOrigin.y); k++) r = r * r + s;",
            "hit(r);",
        ),
        Method::Shade => (
            "class T : rt_Material; void shade() {",
            "rt_HitPoint.x",
            "r += luminance(trace(rt_HitPoint, rt_RayDirection));",
            "rt_SampleColor = color(r);",
        ),
        _ => (
            "class T : rt_Texture; void lookup() {",
            "rt_TextureUV.x",
            "for (int k = 0; k < int(rt_TextureUV.y); k++) r = r * r + s;",
            "rt_FloatTextureValue = r;",
        ),
    };
    let kept: String = (0..count).map(|i| format!("float a{i} = p * s; p = a{i};\n")).collect();
    let used: String = (0..count).map(|i| format!("r += a{i};\n")).collect();
    format!("{head} float s = {source}, p = s, r = 0.0;\n{kept}{middle}\n{used}{result} }}")
}

fn output(method: Method) -> usize {
    let name = match method {
        Method::Intersect => "rt_HitDistance",
        Method::Shade => "rt_SampleColor",
        _ => "rt_FloatTextureValue",
    };
    lookup_state(name).expect("the table has it").first_component as usize
}

fn engine(width: u32) -> Engine {
    let options = EngineOptions {
        backend: Backend::Jit,
        width: Some(width),
        math: Math::Strict,
        ..EngineOptions::default()
    };
    Engine::new(options).expect("tests need an LLVM").0
}

fn instance(text: &str) -> Arc<Instance> {
    let compilation = Compiler::default().compile("t", text);
    let report = compilation.report(false);
    let unit = compilation.unit.unwrap_or_else(|| panic!("{report}"));
    Instance::new(unit.class("T").unwrap(), []).unwrap()
}

/// Answers nothing, or by shading again so many times.
struct Answers<'a> {
    again: u32,
    kernel: &'a Kernel,
    program: &'a Program,
    instance: &'a Instance,
    method: Method,
    shape: Shape,
    count: usize,
}

impl Answers<'_> {
    /// What the call gives for its first ray.
    fn call(&mut self) -> f32 {
        let mut state = new_state(COUNT);
        for name in ["rt_RayOrigin", "rt_HitPoint", "rt_TextureUV"] {
            let first = lookup_state(name).expect("the table has it").first_component as usize;
            state.floats_mut(first).fill(1.0);
        }
        let far = lookup_state("rt_HitDistance").expect("the table has it").first_component;
        state.floats_mut(far as usize).fill(f32::INFINITY);
        let block = self.program.block(self.instance);
        let objects = std::iter::repeat_n(self.instance, FIRST as usize + COUNT);
        let objects = self.program.objects(objects);
        let index = LaneIndices::new(COUNT);
        let _ = self.kernel.call(CallArguments {
            state: &mut state,
            scratch: &mut self.program.new_scratch(COUNT),
            count: if self.shape == Shape::Single { 1 } else { self.count },
            mask: None,
            accepted: Some(&mut LaneMask::new(COUNT)),
            instances: match self.shape {
                Shape::Packet | Shape::CommonOrigin | Shape::Single => Instances::One(&block),
                Shape::Stream => Instances::Many(&objects, &index),
                Shape::Leaf => Instances::Range(&objects, FIRST),
            },
            host: self,
        });
        state.floats(output(self.method))[0]
    }
}

impl Host for Answers<'_> {
    fn trace(&mut self, lanes: LaneSet, _: &RayLanes, radiance: &mut LaneColors) {
        let mut value = 0.0;
        if self.again > 0 {
            self.again -= 1;
            value = self.call();
            self.again += 1;
        }
        for channel in radiance {
            lanes.iter().for_each(|lane| channel[lane] = value);
        }
    }

    fn occluded(&mut self, _: LaneSet, _: &RayLanes) -> u32 {
        0
    }

    fn light_count(&mut self) -> u32 {
        0
    }

    fn light_sample(&mut self, _: LaneSet, _: u32, _: &LightQueryLanes, _: &mut LightLanes) -> u32 {
        0
    }

    fn ambient(&mut self) -> [f32; 3] {
        [0.0; 3]
    }

    fn rand(&mut self, _: LaneSet, _: &mut LaneFloats) {}
}

struct Case<'a> {
    engine: &'a Engine,
    instance: &'a Instance,
    method: Method,
    shape: Shape,
    count: usize,
    again: u32,
}

impl Case<'_> {
    fn run(&self) -> Result<f32, Diagnostic> {
        let program = self.engine.program(self.instance);
        let kernel = program.kernel(self.method, self.shape)?;
        let mut answers = Answers {
            again: self.again,
            kernel: &kernel,
            program: &program,
            instance: self.instance,
            method: self.method,
            shape: self.shape,
            count: self.count,
        };
        Ok(answers.call())
    }
}

/// Runs an ignored test of this file in a process of its own, whose crash is this process's failed assertion.
fn in_own_process(test: &str) {
    let program = std::env::current_exe().unwrap();
    let arguments = ["--exact", test, "--ignored", "--nocapture"];
    let output = Command::new(program).args(arguments).output().unwrap();
    let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
    let (said, complained) = (text(&output.stdout), text(&output.stderr));
    assert!(output.status.success(), "{}\n{said}\n{complained}", output.status);
    assert!(said.contains("1 passed"), "{said}");
}

fn on_small_stack(work: impl FnOnce() + Send + 'static) {
    let thread = std::thread::Builder::new().stack_size(STACK).spawn(work);
    thread.unwrap().join().unwrap();
}

#[test]
fn kept_values_never_crash_a_host_of_little_stack() {
    in_own_process("all_methods_and_shapes_keep_values");
}

#[test]
#[ignore = "run by the test before it, in a process of its own"]
fn all_methods_and_shapes_keep_values() {
    const SHAPES: [Shape; 5] =
        [Shape::Packet, Shape::CommonOrigin, Shape::Stream, Shape::Leaf, Shape::Single];
    on_small_stack(|| {
        let engines = [1, 16].map(engine);
        let mut refused = 0;
        for method in [Method::Lookup, Method::Intersect, Method::Shade] {
            // The dearest sizes once.
            let counts: &[usize] = match method {
                Method::Lookup => &[10, 1_000, 35_000],
                Method::Shade => &[10, 1_000, 3_000, 6_000],
                _ => &[10, 1_000],
            };
            for &count in counts {
                let instance = &*instance(&text(method, count));
                let cases = engines.iter().flat_map(|it| SHAPES.map(|shape| (it, shape)));
                for (engine, shape) in
                    cases.filter(|(_, it)| count <= 1_000 || *it == Shape::Packet)
                {
                    println!("{} {count} {} {}", method.name(), shape.name(), engine.width());
                    let case = Case { engine, instance, method, shape, count: COUNT, again: 0 };
                    match case.run() {
                        Ok(sum) => assert_eq!(sum, count as f32),
                        Err(error) => {
                            assert!(count > 3_000, "{error:?}");
                            assert!(["E0510", "E0511"].contains(&error.code.as_str()), "{error:?}");
                            refused += 1;
                        }
                    }
                }
            }
        }
        // Of 6,000 values 16 lanes are too large for the stack; 35,000 are too much work.
        assert_eq!(refused, 1 + 2);
    });
}

#[test]
fn large_frames_do_not_wait_on_the_stack_of_a_host_that_shades_again() {
    in_own_process("a_host_shades_again");
}

#[test]
#[ignore = "run by the test before it, in a process of its own"]
fn a_host_shades_again() {
    on_small_stack(|| {
        let (engine, kept, method) = (&engine(16), 2_000, Method::Shade);
        let instance = &*instance(&text(method, kept));
        for (shape, count) in [(Shape::Packet, 1), (Shape::CommonOrigin, 2), (Shape::Packet, 17)] {
            println!("{} {count}", shape.name());
            let case = Case { engine, instance, method, shape, count, again: 9 };
            assert_eq!(case.run(), Ok(10.0 * kept as f32));
        }
    });
}

#[test]
fn too_much_stack_is_an_error_that_says_what_is_needed() {
    let instance = instance(&text(Method::Lookup, 6_000));
    let program = engine(16).program(&instance);
    let error = program.kernel(Method::Lookup, Shape::Packet).unwrap_err();
    assert_eq!(error.code.as_str(), "E0510");
    let needed = error.message.strip_prefix("`T.lookup` needs ").expect(&error.message);
    let (needed, rest) = needed.split_once(' ').unwrap();
    assert_eq!(rest, "KiB of stack for 16 rays at a time, where 256 KiB are allowed");
    // 6,000 vectors of 64 bytes, and little else.
    assert!((375..400).contains(&needed.parse::<u32>().unwrap()), "{needed}");
}

#[test]
fn macros_that_expand_to_too_much_work_are_an_error() {
    let repeat = "#define A D D D D D D D D D D D D D D D D\n\
                  #define B A A A A A A A A A A A A A A A A\n";
    let slots = format!(
        "class T : rt_Texture;\n#define D a[n=n*3+1] = a[n>>3] * y;\n{repeat}void lookup() {{
         int n = int(rt_TextureUV.x * 100.0); float y = rt_TextureUV.y; float a[17];
         B B B B B B B B rt_FloatTextureValue = a[n]; }}"
    );
    let instance = instance(&slots);
    let program = engine(8).program(&instance);
    let error = program.kernel(Method::Lookup, Shape::Packet).unwrap_err();
    assert_eq!(error.code.as_str(), "E0511");
    assert_eq!(
        error.message,
        "`T.lookup` has 81979 operations with all the functions that it calls, where 65536 are allowed"
    );
    let shapes = vec![(Shape::Packet, 8)];
    let options = AheadOptions { shapes, ..AheadOptions::default() };
    let library = engine(8).ahead(&[program.class().clone()], &options);
    assert_eq!(library.map(drop).unwrap_err().code.as_str(), "E0511");
}

#[test]
fn the_librarys_methods_are_far_below_the_limits() {
    // An operation is a line of packet code.
    const MOST_LINES: usize = 4_096;
    let options = EngineOptions { backend: Backend::Interpreter, ..EngineOptions::default() };
    let (engine, _) = Engine::new(options).unwrap();
    for file in library::files() {
        let unit = Compiler::default().compile(file.path, file.text).unit.unwrap();
        for class in unit.classes() {
            let program = engine.program_of_class(class);
            for &method in class.methods.keys() {
                let (emit, variant) = (Emit::Packet, Shape::Packet.into());
                let request = EmitRequest { emit, method, variant, target: None };
                let text = String::from_utf8(program.emit(&request).unwrap()).unwrap();
                let lines = text.lines().count();
                assert!(lines < MOST_LINES, "{}.{}: {lines}", class.name, method.name());
            }
        }
    }
}

#[test]
fn long_methods_compile_in_time_by_their_length() {
    // 17,000 operations in a row: straight code. A second in a build with optimisations; half a minute otherwise.
    let sines: String = (0..700).map(|i| format!("p = sin(p * x + {i}.5);\n")).collect();
    let text = format!(
        "class T : rt_Texture; void lookup() {{ float x = rt_TextureUV.x, p = x;\n{sines}rt_FloatTextureValue = p; }}"
    );
    let instance = instance(&text);
    let program = engine(8).program(&instance);
    let start = std::time::Instant::now();
    assert!(program.kernel(Method::Lookup, Shape::Packet).is_ok());
    assert!(start.elapsed().as_secs() < 60, "{:?}", start.elapsed());
}
