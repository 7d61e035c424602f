//! Texts that ask for much: stack for the values that a method keeps, and work for the code generator. None of them
//! may crash its host or keep it waiting; what is too much is an error with a code.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::process::Command;
use std::sync::Arc;
use std::time::Instant;

use rtsl::aot::AotOptions;
use rtsl::host::{Host, LaneColors, LaneFloats, LaneSet, LightLanes, LightQueryLanes, RayLanes};
use rtsl::{
    Backend, CallArguments, CallMode, Callback, Compiler, Diagnostic, Emit, EmitRequest, Engine,
    EngineOptions, Instance, Instances, Kernel, LaneIndices, LaneMask, Math, Method, OptLevel,
    Outputs, Program, RayRecord, library, lookup_state, new_state,
};

/// The stack that a host's thread must have.
const STACK: usize = 512 << 10;

/// More than a chunk, and not a multiple of any width.
const COUNT: usize = 37;

/// Objects before those of a call.
const FIRST: u32 = 8;

/// A method of a class, what it reads and what it sets.
struct Subject {
    method: Method,
    role: &'static str,
    source: &'static str,
    output: &'static str,
    /// The statement that uses the result `r`.
    result: &'static str,
}

/// All methods that have kernels.
const SUBJECTS: [Subject; 15] = {
    const fn subject(
        method: Method,
        role: &'static str,
        source: &'static str,
        output: &'static str,
        result: &'static str,
    ) -> Subject {
        Subject { method, role, source, output, result }
    }
    const ORIGIN: &str = "rt_RayOrigin";
    const POINT: &str = "rt_HitPoint";
    [
        subject(
            Method::Lookup,
            "rt_Texture",
            "rt_TextureUV",
            "rt_FloatTextureValue",
            "rt_FloatTextureValue = r",
        ),
        subject(Method::Intersect, "rt_Primitive", ORIGIN, "rt_HitDistance", "hit(r)"),
        subject(Method::Shade, "rt_Material", POINT, "rt_SampleColor", "rt_SampleColor = color(r)"),
        subject(
            Method::GenerateRay,
            "rt_Camera",
            "rt_ScreenCoord",
            ORIGIN,
            "rt_RayOrigin = vec3(r)",
        ),
        subject(
            Method::ComputeBounds,
            "rt_Primitive",
            "rt_TimeSeed",
            "rt_BoundMin",
            "rt_BoundMin = vec3(r)",
        ),
        subject(
            Method::ComputeNormal,
            "rt_Primitive",
            POINT,
            "rt_GeometricNormal",
            "rt_GeometricNormal = vec3(r)",
        ),
        subject(
            Method::ComputeTextureCoordinates,
            "rt_Primitive",
            POINT,
            "rt_TextureUV",
            "rt_TextureUV = vec2(r)",
        ),
        subject(Method::ComputeDerivatives, "rt_Primitive", POINT, "rt_dsdu", "rt_dsdu = r"),
        subject(Method::GenerateSample, "rt_Primitive", ORIGIN, "rt_PDF", "rt_PDF = r"),
        subject(Method::SamplePdf, "rt_Primitive", ORIGIN, "rt_PDF", "rt_PDF = r"),
        subject(Method::Bsdf, "rt_Material", POINT, "rt_BSDFValue", "rt_BSDFValue = color(r)"),
        subject(
            Method::SampleBsdf,
            "rt_Material",
            POINT,
            "rt_BSDFValue",
            "rt_BSDFValue = color(r)",
        ),
        subject(Method::EvaluatePdf, "rt_Material", POINT, "rt_PDF", "rt_PDF = r"),
        subject(
            Method::Emission,
            "rt_Material",
            POINT,
            "rt_EmissionColor",
            "rt_EmissionColor = color(r)",
        ),
        subject(
            Method::Illumination,
            "rt_Light",
            POINT,
            "rt_LightColor",
            "rt_LightColor = color(r)",
        ),
    ]
};

fn subject(method: Method) -> &'static Subject {
    SUBJECTS.iter().find(|it| it.method == method).expect("all methods stand there")
}

/// The method keeps this many values over a loop or a request, each 1 where its rays are at 1, and gives their sum.
fn text(method: Method, count: usize) -> String {
    let Subject { role, source, result, .. } = subject(method);
    let (first, rounds) = match *source {
        "rt_TimeSeed" => (source.to_string(), "0.0 * s".to_owned()),
        _ => (format!("{source}.x"), format!("{source}.y")),
    };
    let middle = match method {
        Method::Shade => "r += luminance(trace(rt_HitPoint, rt_RayDirection));".to_owned(),
        _ => format!("for (int k = 0; k < int({rounds}); k++) r = r * r + s;"),
    };
    let kept: String = (0..count).map(|i| format!("float a{i} = p * s; p = a{i};\n")).collect();
    let used: String = (0..count).map(|i| format!("r += a{i};\n")).collect();
    let name = method.name();
    // Without it, shapes would receive one that contains `intersect`.
    let normal = match method {
        Method::Intersect => "void computeNormal() { rt_GeometricNormal = rt_HitPoint; }",
        _ => "",
    };
    format!(
        "class T : {role}; {normal} void {name}() {{ float s = {first}, p = s, r = 0.0;\n{kept}{middle}\n{used}{result}; }}"
    )
}

fn component(state: &str) -> usize {
    lookup_state(state).expect("the table has it").first_component as usize
}

fn engine(width: u32) -> Engine {
    engine_at(width, OptLevel::O2)
}

fn engine_at(width: u32, optimization: OptLevel) -> Engine {
    let options = EngineOptions {
        backend: Backend::Jit,
        width: Some(width),
        math: Math::Strict,
        optimization,
        ..EngineOptions::default()
    };
    Engine::new(options).expect("tests need an LLVM").0
}

fn instance(text: &str) -> Arc<Instance> {
    try_instance(text).unwrap_or_else(|errors| panic!("{errors:?}"))
}

fn try_instance(text: &str) -> Result<Arc<Instance>, Vec<Diagnostic>> {
    let compilation = Compiler::default().compile("t", text);
    let Some(unit) = compilation.unit else {
        return Err(compilation.diagnostics.iter().cloned().collect());
    };
    Ok(Instance::new(unit.class("T").unwrap(), []).unwrap())
}

/// Answers nothing, or by shading again so many times.
struct Answers<'a> {
    again: u32,
    kernel: &'a Kernel,
    program: &'a Program,
    instance: &'a Instance,
    method: Method,
    shape: CallMode,
    count: usize,
}

impl Answers<'_> {
    /// The result of the call for its first ray.
    fn call(&mut self) -> f32 {
        let mut state = new_state(COUNT);
        state.floats_mut(component("rt_HitDistance")).fill(f32::INFINITY);
        let Subject { source, output, .. } = subject(self.method);
        state.floats_mut(component(source)).fill(1.0);
        let block = self.program.block(self.instance);
        let objects = std::iter::repeat_n(self.instance, FIRST as usize + COUNT);
        let objects = self.program.objects(objects);
        let index = LaneIndices::new(COUNT);
        let _ = self.kernel.call(CallArguments {
            state: &mut state,
            scratch: &mut self.program.new_scratch(COUNT),
            count: if self.shape == CallMode::Single { 1 } else { self.count },
            mask: None,
            accepted: Some(&mut LaneMask::new(COUNT)),
            instances: match self.shape {
                CallMode::Packet | CallMode::CommonOrigin | CallMode::Single => {
                    Instances::One(&block)
                }
                CallMode::Stream => Instances::Many(&objects, &index),
                CallMode::Leaf => Instances::Range(&objects, FIRST),
            },
            host: self,
        });
        state.floats(component(output))[0]
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
    shape: CallMode,
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
    let test = format!("bounds::{test}");
    let arguments = ["--exact", &test, "--ignored", "--nocapture"];
    let output = Command::new(program).args(arguments).output().unwrap();
    let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
    let (said, complained) = (text(&output.stdout), text(&output.stderr));
    assert!(output.status.success(), "{}\n{said}\n{complained}", output.status);
    assert!(said.contains("1 passed"), "{said}");
}

fn on_small_stack(work: impl FnOnce() + Send) {
    on_stack(STACK, work);
}

fn on_stack<T: Send>(bytes: usize, work: impl FnOnce() -> T + Send) -> T {
    std::thread::scope(|scope| {
        let thread = std::thread::Builder::new().stack_size(bytes);
        thread.spawn_scoped(scope, work).unwrap().join().unwrap()
    })
}

const SHAPES: [CallMode; 5] =
    [CallMode::Packet, CallMode::CommonOrigin, CallMode::Stream, CallMode::Leaf, CallMode::Single];

/// Of methods that keep so many values; gives how many kernels were refused.
fn keep_values(
    engines: &[Engine],
    subjects: &[Subject],
    counts: &[usize],
    shapes: &[CallMode],
) -> usize {
    let mut refused = 0;
    for Subject { method, .. } in subjects {
        for &count in counts {
            let method = *method;
            let instance = match try_instance(&text(method, count)) {
                Ok(instance) => instance,
                Err(errors) => {
                    let codes: Vec<_> = errors.iter().map(|it| it.code.as_str()).collect();
                    println!("{} {count}: {codes:?}", method.name());
                    // It has more values than the lowering allows, as has each method that the language derives from it.
                    let is_too_large = codes.iter().all(|it| *it == "E0451");
                    assert!(is_too_large && count > 60_000, "{errors:?}");
                    refused += 1;
                    continue;
                }
            };
            let instance = &*instance;
            let cases = engines.iter().flat_map(|it| shapes.iter().map(move |shape| (it, *shape)));
            for (engine, shape) in cases {
                let start = Instant::now();
                let case = Case { engine, instance, method, shape, count: COUNT, again: 0 };
                let (width, result) = (engine.width(), case.run());
                let shown = result.as_ref().map_err(|error| error.code.as_str());
                let (name, shape, time) = (method.name(), shape.name(), start.elapsed());
                println!("{name} {count} {shape} {width}: {shown:?} {time:.1?}");
                match result {
                    Ok(sum) => assert_eq!(sum, count as f32),
                    Err(error) => {
                        let codes = ["E0509", "E0510", "E0511"];
                        assert!(codes.contains(&error.code.as_str()), "{error:?}");
                        // A value is computed and used.
                        assert!(2 * count > 65_000, "{error:?}");
                        refused += 1;
                    }
                }
            }
        }
    }
    refused
}

#[test]
fn kept_values_never_crash_a_host_of_little_stack() {
    in_own_process("methods_and_shapes_keep_values");
}

#[test]
#[ignore = "run by the test before it, in a process of its own"]
fn methods_and_shapes_keep_values() {
    on_small_stack(|| {
        let engines = [1, 16].map(engine);
        let wide = &engines[1..];
        let [lookup, intersect, shade, others @ ..] = &SUBJECTS;
        let one = std::slice::from_ref;
        let refused = [
            keep_values(&engines, &SUBJECTS[..3], &[10], &SHAPES),
            keep_values(wide, &SUBJECTS[1..3], &[500], &SHAPES),
            keep_values(wide, others, &[300], &[CallMode::Packet]),
            // Of 16 rays at a time four fit.
            keep_values(wide, one(intersect), &[9_000], &[CallMode::Leaf]),
            keep_values(wide, one(shade), &[2_000, 9_000], &[CallMode::Packet]),
            // 640 KiB for 16 rays, more than the whole stack.
            keep_values(wide, one(lookup), &[10_000], &[CallMode::Packet]),
            keep_values(wide, one(lookup), &[70_000], &[CallMode::Single]),
        ];
        assert_eq!(refused, [0, 0, 0, 0, 0, 0, 1]);
    });
}

/// Any number of values is kept or refused: in `intersect`, which leaves test, and `shade`, whose chunks wait, in all
/// call modes.
#[test]
#[ignore = "takes a quarter of an hour"]
fn all_call_modes_keep_any_number_of_values_or_refuse() {
    on_small_stack(|| {
        let engines = [1, 16].map(engine);
        let most = [30_000, 35_000, 60_000, 100_000];
        keep_values(&engines, &SUBJECTS[1..3], &[10, 100, 1_000, 3_000, 10_000], &SHAPES);
        keep_values(&engines, &SUBJECTS[1..3], &most, &[CallMode::Leaf, CallMode::Packet]);
    });
}

#[test]
#[ignore = "takes a quarter of an hour"]
fn all_methods_keep_any_number_of_values_or_refuse() {
    on_small_stack(|| {
        let engines = [engine(16)];
        keep_values(&engines, &SUBJECTS, &[3_000, 10_000, 30_000], &[CallMode::Stream]);
        keep_values(&engines, &SUBJECTS, &[60_000, 100_000], &[CallMode::Packet]);
    });
}

/// A callback computes exactly as many rays at a time as its host asks for, so the stack limits its values.
#[test]
#[ignore = "takes minutes"]
fn callbacks_keep_any_number_of_values_or_refuse() {
    on_small_stack(|| {
        for count in [10, 100, 1_000, 3_000, 5_000, 6_000, 10_000, 30_000, 35_000, 60_000] {
            let instance = instance(&text(Method::Intersect, count));
            // As many values as 256 KiB hold; for one ray the limit of operations comes first. No count is near these.
            for (width, most) in [(1, 65_536), (4, 16_384), (8, 8_192), (16, 4_096)] {
                let start = Instant::now();
                let made = engine(width).program(&instance).callback(&callback(width));
                println!("callback {count} {width}: {:.1?}", start.elapsed());
                assert_eq!(made.is_ok(), count < most, "{count} {width} {made:?}");
                let code = made.err().map(|it| it.code.as_str());
                assert!(matches!(code, None | Some("E0510" | "E0511")), "{count} {width} {code:?}");
            }
        }
    });
}

#[test]
fn hosts_that_shade_again_get_an_error_where_large_frames_have_no_room() {
    in_own_process("a_host_shades_again");
}

#[test]
#[ignore = "run by the test before it, in a process of its own"]
fn a_host_shades_again() {
    let (engine, kept, method) = (engine(16), 2_000, Method::Shade);
    let instance = instance(&text(method, kept));
    for (shape, count) in
        [(CallMode::Packet, 1), (CallMode::CommonOrigin, 2), (CallMode::Packet, 17)]
    {
        println!("{} {count}", shape.name());
        let (engine, instance) = (&engine, &*instance);
        let case = Case { engine, instance, method, shape, count, again: 9 };
        // 128 KiB a level.
        assert_eq!(on_stack(4 << 20, || case.run()), Ok(10.0 * kept as f32));
        // Systems other than these do not tell the room of a stack.
        if cfg!(any(all(target_os = "linux", target_env = "gnu"), target_os = "macos")) {
            let refused = on_stack(STACK, || catch_unwind(AssertUnwindSafe(|| case.run())));
            let message = *refused.unwrap_err().downcast::<String>().unwrap();
            assert!(message.contains("stack has too little room"), "{message}");
        }
    }
}

fn callback(width: u32) -> Callback {
    let components = |name| (component(name) as u32..).take(3);
    let rays = components("rt_RayOrigin").chain(components("rt_RayDirection"));
    let rows = rays.chain(components("rt_HitDistance").take(1)).zip(0..).collect();
    let record =
        RayRecord { rays: 0, mask: None, instances: 8, number: None, rows, marks: Vec::new() };
    let distance = lookup_state("rt_HitDistance").expect("the table has it");
    Callback { width, outputs: Outputs::state([distance]), record }
}

/// Callbacks and libraries have exactly the width that a host asks for; kernels may compute fewer rays at a time.
#[test]
fn too_much_stack_is_an_error_that_says_what_is_needed() {
    let instance = instance(&text(Method::Intersect, 4_500));
    // Straight code of so many values is made at once.
    let (engine, modes) = (engine_at(16, OptLevel::O0), vec![(CallMode::Packet, 16)]);
    let program = engine.program(&instance);
    let options = AotOptions { modes, ..AotOptions::default() };
    let library = engine.aot_library(&[program.class().clone()], &options).unwrap();
    let errors = [
        ("`T.hit`", program.callback(&callback(16)).unwrap_err()),
        ("`rtsl_T_intersect_packet16`", library.object(None).unwrap_err()),
    ];
    for (name, error) in errors {
        assert_eq!(error.code.as_str(), "E0510");
        let needed = error.message.strip_prefix(name).expect(&error.message);
        let needed = needed.strip_prefix(" needs ").expect(&error.message);
        let (needed, rest) = needed.split_once(' ').unwrap();
        assert_eq!(rest, "KiB of stack for 16 rays at a time, where 256 KiB are allowed");
        // 4,500 vectors of 64 bytes, and little else.
        assert!((281..300).contains(&needed.parse::<u32>().unwrap()), "{needed}");
    }
}

/// If straight code would need half a MiB for 16 rays at a time, kernels compute fewer rays at a time, and code of a
/// fixed width is optimised.
#[test]
fn long_methods_with_many_blocks_need_little_stack() {
    let loops: String = (0..700)
        .map(|i| format!("for (int i = 0; i < int(y * {i}.0); i++) p = p * x + float(i);\n"))
        .collect();
    let instance = instance(&format!(
        "class T : rt_Primitive; void intersect() {{ float x = rt_RayOrigin.x, y = rt_RayOrigin.y, p = x;\n{loops}hit(p); }}"
    ));
    let engine = engine(16);
    let (method, shape) = (Method::Intersect, CallMode::Packet);
    let case = Case { engine: &engine, instance: &instance, method, shape, count: COUNT, again: 0 };
    assert_eq!(case.run(), Ok(1.0));
    assert!(engine.program(&instance).callback(&callback(16)).is_ok());
}

#[test]
fn macros_that_expand_to_too_much_work_are_an_error() {
    let repeat = "#define A D D D D D D D D D D D D D D D D\n\
                  #define B A A A A A A A A A A A A A A A A\n";
    let locals = format!(
        "class T : rt_Texture;\n#define D a[n=n*3+1] = a[n>>3] * y;\n{repeat}void lookup() {{
         int n = int(rt_TextureUV.x * 100.0); float y = rt_TextureUV.y; float a[17];
         B B B B B B B B B B B B B B rt_FloatTextureValue = a[n]; }}"
    );
    let instance = instance(&locals);
    let program = engine(8).program(&instance);
    let error = program.kernel(Method::Lookup, CallMode::Packet).unwrap_err();
    assert_eq!(error.code.as_str(), "E0511");
    assert_eq!(
        error.message,
        "`T.lookup` has 143419 operations with all the functions that it calls, where 131072 are allowed"
    );
    let modes = vec![(CallMode::Packet, 8)];
    let options = AotOptions { modes, ..AotOptions::default() };
    let library = engine(8).aot_library(&[program.class().clone()], &options);
    assert_eq!(library.map(drop).unwrap_err().code.as_str(), "E0511");
}

#[test]
fn the_librarys_methods_are_far_below_the_limits() {
    // An operation is a line of packet code; an eighth of the operations that a kernel may have.
    const MAX_LINES: usize = 16_384;
    let options = EngineOptions { backend: Backend::Interpreter, ..EngineOptions::default() };
    let (engine, _) = Engine::new(options).unwrap();
    for file in library::files() {
        let unit = Compiler::default().compile(file.path, file.text).unit.unwrap();
        for class in unit.classes() {
            let program = engine.program_of_class(class);
            // Those of integrators have no packet code.
            for &method in class.methods.keys().filter(|it| **it != Method::Radiance) {
                let (emit, variant) = (Emit::Packet, CallMode::Packet.into());
                let request = EmitRequest { emit, method, variant, target: None };
                let text = String::from_utf8(program.emit(&request).unwrap()).unwrap();
                let lines = text.lines().count();
                assert!(lines < MAX_LINES, "{}.{}: {lines}", class.name, method.name());
            }
        }
    }
}

/// LLVM's passes take time by the square of a method's length, so long methods go without them, whatever level is asked
/// for.
#[test]
fn long_methods_are_compiled_straight_at_every_level() {
    // 17,000 operations in a row.
    let sines: String = (0..700).map(|i| format!("p = sin(p * x + {i}.5);\n")).collect();
    let text = format!(
        "class T : rt_Texture; void lookup() {{ float x = rt_TextureUV.x, p = x;\n{sines}rt_FloatTextureValue = p; }}"
    );
    let instance = instance(&text);
    let [one, other] = [OptLevel::O1, OptLevel::O3].map(|level| {
        let variant = CallMode::Packet.into();
        let request =
            EmitRequest { emit: Emit::Assembly, method: Method::Lookup, variant, target: None };
        engine_at(8, level).program(&instance).emit(&request).expect("it is not too much work")
    });
    assert!(one == other, "{} and {} bytes of assembly", one.len(), other.len());
}
