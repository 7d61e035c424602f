//! Compile times: from text to callable kernel for every method of the standard library, with LLVM warm, and for a
//! scene from the start of a process to the first tile.
//!
//! `cargo bench -p rtsl-bench --bench compile_time`; `RTSL_LLVM` chooses the LLVM.

use std::io::{BufRead, BufReader, Write};
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::sync::Arc;
use std::time::{Duration, Instant};

use rtsl::library::{self, LibraryFile};
use rtsl::{
    Backend, CallMode, Class, Compiler, Emit, EmitRequest, Engine, EngineOptions, Instance, Method,
    ParameterType, Scalar, Value,
};
use rtsl_render::{Progress, RenderRequest, render_scene};

/// The number of repetitions, of which the best counts: disturbances only add time.
const REPETITIONS: usize = 5;
/// The argument that makes the process render a scene and report its first tile.
const CHILD: &str = "--first-tile";
const SCENE: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../scenes/three-spheres.pbrt");

fn main() {
    let arguments: Vec<String> = std::env::args().collect();
    if let Some(at) = arguments.iter().position(|it| it == CHILD) {
        return report_first_tile(&arguments[at + 1]);
    }
    let Ok((engine, _)) = Engine::new(options()) else {
        println!("no LLVM, no compile times");
        return;
    };
    let llvm = engine.llvm().map(|llvm| llvm.version().to_string()).unwrap_or_default();
    println!("LLVM {llvm}, width {}", engine.width());
    print_library(&mut measure_library());
    print_cold_start();
}

fn options() -> EngineOptions {
    EngineOptions { backend: Backend::Jit, ..EngineOptions::default() }
}

/// The times of one kernel.
struct Row {
    name: String,
    /// Elapsed time.
    clock: Duration,
    /// Processor time of all threads: on an idle machine the same.
    busy: Duration,
    /// The processor time of each of [`STAGES`].
    stages: Vec<Duration>,
}

/// The stages, and the form that each produces.
const STAGES: [(&str, Option<Emit>); 5] = [
    ("check", None),
    ("link, optimise", Some(Emit::Ir)),
    ("packet, text", Some(Emit::Llvm)),
    ("LLVM passes", Some(Emit::OptimizedLlvm)),
    ("code", Some(Emit::Assembly)),
];

fn measure_library() -> Vec<Row> {
    let mut rows = Vec::new();
    for file in library::files() {
        for class in classes(file) {
            // Integrators have no code for packets.
            for method in class.methods.keys().filter(|it| **it != Method::Radiance) {
                rows.push(measure(file, &class, *method));
            }
        }
    }
    rows
}

fn measure(file: &LibraryFile, class: &Arc<Class>, method: Method) -> Row {
    let best = |measure: fn(&dyn Fn()) -> Duration, work: &dyn Fn()| {
        (0..REPETITIONS).map(|_| measure(work)).min().unwrap_or_default()
    };
    let mut emitted = Duration::ZERO;
    let stages = STAGES.iter().map(|(_, emit)| match emit {
        None => best(busy_time, &|| drop(classes(file))),
        // The time for a form includes the stages before it.
        Some(emit) => {
            let time = best(busy_time, &|| emit_method(class, method, *emit));
            time.saturating_sub(std::mem::replace(&mut emitted, time))
        }
    });
    let stages = stages.collect();
    let all = || make_kernel(file, &class.name, method);
    let (clock, busy) = (best(time, &all), best(busy_time, &all));
    Row { name: format!("{}.{}", class.name, method.name()), clock, busy, stages }
}

fn time(work: &dyn Fn()) -> Duration {
    let start = Instant::now();
    work();
    start.elapsed()
}

/// The processor time of all threads of this process for some work; elapsed time if the system does not report it.
fn busy_time(work: &dyn Fn()) -> Duration {
    let before = running_time();
    let clock = time(work);
    let running = before.and_then(|before| running_time()?.checked_sub(before));
    running.unwrap_or(clock)
}

fn running_time() -> Option<Duration> {
    // The operating system updates a thread's time when it stops running.
    std::thread::yield_now();
    let threads = std::fs::read_dir("/proc/self/task").ok()?;
    let of_thread = |path: PathBuf| -> Option<u64> {
        let text = std::fs::read_to_string(path.join("schedstat")).ok()?;
        text.split_whitespace().next()?.parse().ok()
    };
    let nanoseconds = threads.map(|thread| of_thread(thread.ok()?.path()));
    nanoseconds.sum::<Option<u64>>().map(Duration::from_nanos)
}

fn classes(file: &LibraryFile) -> Vec<Arc<Class>> {
    let unit = Compiler::default().compile(file.path, file.text).unit;
    unit.map(|unit| unit.classes().to_vec()).unwrap_or_default()
}

fn make_kernel(file: &LibraryFile, class: &str, method: Method) {
    let classes = classes(file);
    let class = classes.iter().find(|it| it.name == class).expect("it was there before");
    let (engine, _) = Engine::new(options()).expect("it was there before");
    if let Some(llvm) = engine.llvm() {
        llvm.forget_modules().expect("the process goes on");
    }
    let program = engine.program(&instance(class));
    program.kernel(method, CallMode::Packet).expect("the library compiles");
}

fn emit_method(class: &Arc<Class>, method: Method, emit: Emit) {
    let (engine, _) = Engine::new(options()).expect("it was there before");
    let program = engine.program_of_class(class);
    let request = EmitRequest { emit, method, variant: CallMode::Packet.into(), target: None };
    program.emit(&request).expect("the library compiles");
}

fn instance(class: &Arc<Class>) -> Arc<Instance> {
    let required = class.parameters.iter().filter(|it| it.required);
    let arguments = required.map(|it| (it.name.as_str(), some_value(&it.ty)));
    Instance::new(class, arguments).expect("parameters of the right types")
}

/// A value for a parameter without a default.
fn some_value(ty: &ParameterType) -> Value {
    let scalar = |scalar: &Scalar| match scalar {
        Scalar::F32 => Value::Float(0.75),
        Scalar::I32 => Value::Int(2),
        Scalar::U32 => Value::Uint(2),
        Scalar::Bool => Value::Bool(true),
    };
    match ty {
        ParameterType::Scalar(it) => scalar(it),
        ParameterType::Vector(it, count) => Value::List((0..*count).map(|_| scalar(it)).collect()),
        ParameterType::Color => Value::Float(0.75),
        ParameterType::Matrix(columns, rows) => {
            Value::List(vec![Value::Float(0.75); usize::from(columns * rows)])
        }
        ParameterType::Struct(_, fields) => {
            Value::Struct(fields.iter().map(|(name, ty)| (name.clone(), some_value(ty))).collect())
        }
        ParameterType::Array(element, count) => {
            Value::List(vec![some_value(element); *count as usize])
        }
        ParameterType::Buffer(element) => Value::List(vec![some_value(element); 5]),
        ParameterType::Textured(value) => some_value(value),
        ParameterType::Reference(_) => Value::List(Vec::new()),
    }
}

fn milliseconds(duration: Duration) -> f64 {
    duration.as_secs_f64() * 1e3
}

fn print_library(rows: &mut [Row]) {
    rows.sort_by_key(|row| row.busy);
    println!("text to kernel, {} methods of the standard library, ms:", rows.len());
    println!("{:>8} {:>7} {:>7}", "", "clock", "busy");
    let Some(last) = rows.len().checked_sub(1) else { return };
    print_row("median", &rows[last / 2]);
    print_row("90 %", &rows[last * 9 / 10]);
    rows[last.saturating_sub(4)..].iter().for_each(|row| print_row("worst", row));
    let sum = |value: &dyn Fn(&Row) -> Duration| rows.iter().map(value).sum();
    let stages = (0..STAGES.len()).map(|stage| sum(&|row| row.stages[stage])).collect();
    let (clock, busy) = (sum(&|row| row.clock), sum(&|row| row.busy));
    print_row("sum", &Row { name: "all".to_owned(), clock, busy, stages });
}

fn print_row(label: &str, row: &Row) {
    let Row { name, clock, busy, stages } = row;
    let stages = STAGES.iter().zip(stages);
    let stages = stages.map(|((name, _), time)| format!("{name} {:.2}", milliseconds(*time)));
    let stages: Vec<String> = stages.collect();
    let (clock, busy) = (milliseconds(*clock), milliseconds(*busy));
    println!("{label:>8} {clock:7.2} {busy:7.2}  {name:<30} {}", stages.join(", "));
}

/// Renders the scene in this process and prints a line at the first tile.
fn report_first_tile(scene: &str) {
    let progress = |progress: Progress| {
        let Progress::Rendering(_) = progress else { return };
        // The parent waits for the line from whichever thread is first.
        let mut out = std::io::stdout().lock();
        let _ = out.write_all(b"tile\n").and_then(|()| out.flush());
        std::process::exit(0);
    };
    if let Err(error) = Engine::keep_code() {
        eprintln!("{error}");
    }
    let request = RenderRequest {
        scene: Path::new(scene).to_owned(),
        progress: Some(&progress),
        ..RenderRequest::default()
    };
    if let Err(messages) = render_scene(&request) {
        eprintln!("{messages:?}");
    }
}

/// Prints the times without a cache of machine code, and with one that has what the scene needs.
fn print_cold_start() {
    let Ok(program) = std::env::current_exe() else { return };
    let folder = std::env::temp_dir().join(format!("rtsl-compile-time-{}", std::process::id()));
    first_tile(&program, &folder);
    for (name, cache) in [("", Path::new("")), (" from the cache", &folder)] {
        let mut times: Vec<Duration> =
            (0..20).filter_map(|_| first_tile(&program, cache)).collect();
        times.sort();
        let (Some(best), Some(median)) = (times.first(), times.get(times.len() / 2)) else { break };
        println!(
            "three-spheres{name}, process start to first tile, ms: best {:.0}, median {:.0}",
            milliseconds(*best),
            milliseconds(*median)
        );
    }
    let _ = std::fs::remove_dir_all(folder);
}

fn first_tile(program: &Path, cache: &Path) -> Option<Duration> {
    let start = Instant::now();
    let mut command = Command::new(program);
    command.args([CHILD, SCENE]).env("RTSL_CACHE", cache).stdout(Stdio::piped());
    let mut child = command.spawn().ok()?;
    let mut line = String::new();
    BufReader::new(child.stdout.take()?).read_line(&mut line).ok()?;
    let time = start.elapsed();
    child.wait().ok()?;
    (line == "tile\n").then_some(time)
}
