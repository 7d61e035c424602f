//! Texts whose trees, regions, blocks and chains of values are as deep and as long as they may be, through all that is
//! made of a text and of the calls, on the stack that a host's thread must have: each gives a result or an error with a
//! code.

use std::time::{Duration, Instant};

use rtsl::aot::AotOptions;
use rtsl::host::NoHost;
use rtsl::{
    Backend, CallArguments, CallMode, Callback, Compiler, Diagnostic, Emit, EmitRequest, Engine,
    EngineOptions, Instance, Instances, LaneMask, Mark, MarkWord, Method, Numbers, OptLevel,
    Outputs, Program, RayRecord, Unit, Value, lookup_state, new_state,
};

/// The stack that a host's thread must have.
const STACK: usize = 512 << 10;

const METHOD: Method = Method::Intersect;

/// The rays of a call.
const COUNT: usize = 9;

/// A class whose `intersect` does this with `x`, which is known only when it is called, and `p`.
fn class(body: &str) -> String {
    format!(
        "class T : rt_Primitive; void intersect() {{ float x = rt_RayOrigin.x, p = x;\n{body}\nhit(p); }}"
    )
}

fn nested(open: &str, inner: &str, close: &str, depth: usize) -> String {
    class(&(open.repeat(depth) + inner + &close.repeat(depth)))
}

fn lines(count: usize, line: impl Fn(usize) -> String) -> String {
    (0..count).map(|index| line(index) + "\n").collect()
}

/// Texts whose depth is near what is allowed: regions nest 200 deep, of which a loop takes two, and syntax 1,024.
fn deep() -> Vec<(&'static str, String)> {
    let calls = lines(150, |i| match i {
        0 => "float f0(float x) { return x > 0.5 ? x : x * x; }".to_owned(),
        _ => {
            format!("float f{i}(float x) {{ if (x > {i}.5) return f{}(x * x); return x; }}", i - 1)
        }
    });
    let branches = "if (p > x * x) { p = p * x + 0.5; ".repeat(190) + "p = x;" + &"}".repeat(190);
    vec![
        ("expressions", class(&format!("p = {}p{};", "abs(x + ".repeat(400), ")".repeat(400)))),
        ("blocks", nested("{", "p = p * x;", "}", 900)),
        ("branches", class(&branches)),
        ("loops", nested("for (int i = 0; i < int(p); i++) { p = p * x; ", "p = x;", "}", 95)),
        (
            "loops that end early",
            nested("while (p > x) { p *= x; if (p > 9.0) break; p -= x; ", "p = x;", "}", 60),
        ),
        ("loops and branches", nested("if (p > 0.5) while (p < x) { p += x; ", "p = x;", "}", 64)),
        (
            "conditions",
            class(&format!(
                "p = {}x{};",
                "p > x ? p * x : (x < 0.5 ? x : ".repeat(90),
                ")".repeat(90)
            )),
        ),
        ("calls", calls + &class("p = f149(x);")),
        (
            "a chain of branches",
            class(
                &("if (p > x) p = x;\n".to_owned()
                    + &lines(180, |i| format!("else if (p > x * {i}.5) p = x + {i}.5;"))),
            ),
        ),
        (
            "a constructor",
            format!(
                "class T : rt_Primitive; public float b[]; [[element \"b\"]] public int e; float c;
                 constructor() {{ float x = float(e), p = x; {branches} c = p; }}
                 void intersect() {{ hit(rt_RayOrigin.x + c); }}"
            ),
        ),
    ]
}

/// Texts as long as they are told to be.
fn long(size: usize) -> Vec<(&'static str, String)> {
    let few = size / 20;
    let carried = lines(few, |i| format!("float c{i} = x * {i}.5;"));
    let changed = lines(few - 1, |i| format!("c{} = c{i} + x;", i + 1));
    let integers = lines(size, |i| format!("n = n * 3 + {};", i * i));
    let products = lines(size, |i| format!("float a{i} = x * {i}.5;"));
    let sum = lines(size, |i| format!(" + a{i}"));
    let stores = lines(size / 40, |i| format!("a[n = n * 3 + {i}] = p * x;"));
    vec![
        ("a chain of values", class(&lines(size, |i| format!("p = p * x + {i}.5;")))),
        (
            "a chain of integers",
            class(&format!(
                "int n = int(x); for (int k = 0; k < int(p); k++) {{ {integers} }} p = float(n);"
            )),
        ),
        ("one sum", class(&format!("p = x{};", " + x * p - 1.5".repeat(size)))),
        ("values of a block", class(&format!("{products} p = x{sum};"))),
        (
            "many branches",
            class(&lines(size / 2, |i| format!("if (p > {i}.5) p = p * x; else p = sqrt(p) - x;"))),
        ),
        (
            "many loops",
            class(&lines(size / 8, |i| {
                format!("for (int i = 0; i < int(x * {i}.5); i++) p = p * x + 0.5;")
            })),
        ),
        (
            "cases",
            class(&format!(
                "switch (int(x)) {{ {} }}",
                lines(size / 10, |i| format!("case {i}: p += {i}.5; break;"))
            )),
        ),
        (
            "carried values",
            class(&format!(
                "{carried} for (int k = 0; k < int(x); k++) {{ while (p > x) {{ p -= 1.0; {changed} }} }} p = c{};",
                few - 1
            )),
        ),
        ("locals", class(&format!("float a[9]; int n = int(x);\n{stores} p = a[n];"))),
    ]
}

fn engine(backend: Backend, optimization: OptLevel) -> Engine {
    let options =
        EngineOptions { backend, width: Some(8), optimization, ..EngineOptions::default() };
    Engine::new(options).expect("tests need an LLVM").0
}

fn callback() -> Callback {
    let state = |name| lookup_state(name).expect("the table has it");
    let first = |name| state(name).first_component;
    let rows = (0..3).flat_map(|axis| {
        [(first("rt_RayOrigin") + axis, axis), (first("rt_RayDirection") + axis, 3 + axis)]
    });
    let rows = rows.chain([(first("rt_HitDistance"), 6)]).collect();
    let marks = vec![Mark { row: 7, word: MarkWord::Constant(1) }];
    let record = RayRecord { rays: 0, mask: None, instances: 8, number: None, rows, marks };
    Callback { width: 8, outputs: Outputs::state([state("rt_HitDistance")]), record }
}

/// Calls with rays from x = 0.25, for which no loop runs long.
fn call(program: &Program, instance: &Instance, run: impl FnOnce(CallArguments<'_>)) {
    let mut state = new_state(COUNT);
    let first = |name| lookup_state(name).expect("the table has it").first_component as usize;
    state.floats_mut(first("rt_RayOrigin")).fill(0.25);
    state.floats_mut(first("rt_HitDistance")).fill(f32::INFINITY);
    run(CallArguments {
        state: &mut state,
        scratch: &mut program.new_scratch(COUNT),
        count: COUNT,
        mask: None,
        accepted: Some(&mut LaneMask::new(COUNT)),
        instances: Instances::One(&program.block(instance)),
        host: &mut NoHost,
    });
}

/// Makes everything that can be made of a text, and collects the errors.
struct Maker<'a> {
    unit: &'a Unit,
    instance: &'a Instance,
    stage: Instant,
    longest: Duration,
    errors: Vec<Diagnostic>,
}

impl Maker<'_> {
    fn note<T>(&mut self, stage: &str, result: Result<T, Diagnostic>) -> Option<T> {
        let time = std::mem::replace(&mut self.stage, Instant::now()).elapsed();
        self.longest = self.longest.max(time);
        let error = result.as_ref().err().map(|it| it.message.clone()).unwrap_or_default();
        println!("    {stage}: {time:.2?} {error}");
        result.map_err(|error| self.errors.push(error)).ok()
    }

    fn interpret(&mut self) {
        let engine = engine(Backend::Interpreter, OptLevel::O2);
        for emit in [Emit::Ir, Emit::Packet, Emit::Llvm] {
            let request = EmitRequest {
                emit,
                method: METHOD,
                variant: CallMode::Packet.into(),
                target: None,
            };
            let text = engine.program(self.instance).emit(&request);
            self.note(&format!("{emit:?}"), text);
        }
        let program = engine.program(self.instance);
        let kernel = program.kernel(METHOD, CallMode::Packet);
        if let Some(kernel) = self.note("interpreter", kernel) {
            call(&program, self.instance, |call| assert!(!kernel.call(call).budget_exhausted));
        }
        let kernel = program.packet_kernel(METHOD, CallMode::Packet);
        if let Some(kernel) = self.note("packets", kernel) {
            call(&program, self.instance, |call| assert!(!kernel.run(call, 1 << 20).cut_short));
        }
        if self.instance.element_count().is_some() {
            self.note("elements", program.elements(self.instance));
        }
        let library = engine.aot_library(self.unit.classes(), &AotOptions::default());
        if let Some(library) = self.note("library", library) {
            self.note("C++", Ok(library.cpp()));
        }
    }

    fn compile(&mut self, level: OptLevel) {
        let engine = engine(Backend::Jit, level);
        let program = engine.program(self.instance);
        let kernel = program.kernel(METHOD, CallMode::Packet);
        if let Some(kernel) = self.note(&format!("kernel {level:?}"), kernel) {
            call(&program, self.instance, |call| assert!(!kernel.call(call).budget_exhausted));
        }
        self.note("callback", program.callback(&callback()));
        let emit = Emit::OptimizedLlvm;
        let request =
            EmitRequest { emit, method: METHOD, variant: CallMode::Leaf.into(), target: None };
        self.note("LLVM's passes", program.emit(&request));
    }
}

/// Makes all that is made of a text. Gives the errors, and the longest time that anything took.
fn make_all(name: &str, text: &str, levels: &[OptLevel]) -> (Vec<Diagnostic>, Duration) {
    println!("{name}");
    let start = Instant::now();
    let compilation = Compiler::default().compile("t", text);
    let unit = match &compilation.unit {
        Some(unit) => unit,
        None => panic!("{name}: {}", compilation.report(false)),
    };
    let class = unit.class("T").unwrap();
    let elements = class.parameters.iter().any(|it| it.name == "b");
    let buffer = elements.then(|| ("b", Value::Numbers(Numbers::floats([0.5; 3]))));
    let instance = &*Instance::new(class, buffer).unwrap();
    let longest = start.elapsed();
    let mut maker = Maker { unit, instance, stage: Instant::now(), longest, errors: Vec::new() };
    maker.interpret();
    levels.iter().for_each(|level| maker.compile(*level));
    (maker.errors, maker.longest)
}

fn on_small_stack(work: impl FnOnce() + Send + 'static) {
    let thread = std::thread::Builder::new().stack_size(STACK).spawn(work);
    thread.unwrap().join().unwrap();
}

#[test]
fn deep_texts_need_no_stack_of_the_host() {
    on_small_stack(|| {
        for (name, text) in deep() {
            let (errors, _) = make_all(name, &text, &[OptLevel::O1]);
            assert_eq!(errors, [], "{name}");
        }
    });
}

/// Methods that methods call through references stand in them as regions.
#[test]
fn methods_that_call_each_other_nest_as_deep_as_is_allowed() {
    on_small_stack(|| {
        let branch = |depth: usize, inner: &str| {
            "if (rt_TextureUV.x > 0.5) { ".repeat(depth) + inner + &"}".repeat(depth)
        };
        let last = branch(100, "rt_FloatTextureValue = rt_TextureUV.y;");
        for (depth, expected) in [(150, None), (190, Some("E0509"))] {
            let first = branch(depth, "rt_FloatTextureValue = luminance(next.lookup());");
            let text = format!(
                "class Last : rt_Texture; void lookup() {{ {last} }}
                 class T : rt_Texture; public rt_Texture next; void lookup() {{ {first} }}"
            );
            let unit = Compiler::default().compile("t", &text).unit.unwrap();
            let last = Instance::new(unit.class("Last").unwrap(), []).unwrap();
            let instance =
                Instance::new(unit.class("T").unwrap(), [("next", last.into())]).unwrap();
            for backend in [Backend::Interpreter, Backend::Jit] {
                let program = engine(backend, OptLevel::O2).program(&instance);
                let error = program.kernel(Method::Lookup, CallMode::Packet).err();
                assert_eq!(error.map(|it| it.code.as_str()), expected, "{depth}");
            }
        }
    });
}

#[test]
fn long_texts_need_no_stack_of_the_host() {
    on_small_stack(|| {
        for (name, text) in long(400) {
            let (errors, _) = make_all(name, &text, &[OptLevel::O2]);
            assert_eq!(errors, [], "{name}");
        }
    });
}

/// Texts beyond the limits are errors; all others compile, however long that takes.
#[test]
#[ignore = "takes ten minutes"]
fn the_longest_texts_end() {
    const LEVELS: [OptLevel; 4] = [OptLevel::O0, OptLevel::O1, OptLevel::O2, OptLevel::O3];
    on_small_stack(|| {
        for size in [6_000, 15_000, 60_000] {
            for (name, text) in long(size) {
                let (errors, longest) = make_all(&format!("{name}, {size}"), &text, &LEVELS);
                println!("    {longest:.2?}");
                for error in errors {
                    let code = error.code.as_str();
                    assert!(
                        ["E0509", "E0510", "E0511"].contains(&code),
                        "{name}, {size}: {error:?}"
                    );
                }
            }
        }
    });
}
