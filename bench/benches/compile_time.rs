//! How long compiling takes: text to callable kernel for every method of the standard library, with
//! LLVM warm, and a scene from the start of a process to the first tile.
//!
//! `cargo bench -p rtsl-bench --bench compile_time`; `RTSL_LLVM` chooses the LLVM.

use std::io::{BufRead, BufReader, Write};
use std::path::Path;
use std::process::{Command, Stdio};
use std::sync::Arc;
use std::time::{Duration, Instant};

use rtsl::library::{self, LibraryFile};
use rtsl::{
    Backend, Class, Compiler, Emit, EmitRequest, Engine, EngineOptions, Instance, Method,
    ParameterType, Scalar, Shape, Value,
};
use rtsl_render::{RenderRequest, render_scene};

/// The best of so many counts: what else the machine does only adds.
const REPETITIONS: usize = 5;
/// Renders the scene that follows and says when the first tile is done.
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
    print_library(&measure_library());
    print_cold_start();
}

fn options() -> EngineOptions {
    EngineOptions { backend: Backend::Jit, ..EngineOptions::default() }
}

/// One kernel's way.
struct Row {
    name: String,
    total: Duration,
    /// The ends of the stages.
    stages: Vec<Duration>,
}

const STAGES: [(&str, Option<Emit>); 5] = [
    ("check", None),
    ("link, optimise", Some(Emit::Ir)),
    ("packet, text", Some(Emit::Llvm)),
    ("LLVM passes", Some(Emit::OptimizedLlvm)),
    ("code", Some(Emit::Object)),
];

fn measure_library() -> Vec<Row> {
    let mut rows = Vec::new();
    for file in library::files() {
        let classes = classes(file);
        for class in &classes {
            for method in class.methods.keys() {
                let best = |work: &dyn Fn()| {
                    (0..REPETITIONS).map(|_| time(work)).min().unwrap_or_default()
                };
                let stages = STAGES.iter().map(|(_, emit)| {
                    best(&|| match emit {
                        None => drop(self::classes(file)),
                        Some(emit) => emit_method(class, *method, *emit),
                    })
                });
                let stages = stages.collect();
                let total = best(&|| make_kernel(file, &class.name, *method));
                rows.push(Row { name: format!("{}.{}", class.name, method.name()), total, stages });
            }
        }
    }
    rows
}

fn time(work: &dyn Fn()) -> Duration {
    let start = Instant::now();
    work();
    start.elapsed()
}

fn classes(file: &LibraryFile) -> Vec<Arc<Class>> {
    let unit = Compiler::default().compile(file.path, file.text).unit;
    unit.map(|unit| unit.classes().to_vec()).unwrap_or_default()
}

fn make_kernel(file: &LibraryFile, class: &str, method: Method) {
    let classes = classes(file);
    let class = classes.iter().find(|it| it.name == class).expect("it was there before");
    let (engine, _) = Engine::new(options()).expect("it was there before");
    let program = engine.program(&instance(class));
    program.kernel(method, Shape::Packet).expect("the library compiles");
}

fn emit_method(class: &Arc<Class>, method: Method, emit: Emit) {
    let (engine, _) = Engine::new(options()).expect("it was there before");
    let program = engine.program_of_class(class);
    let request = EmitRequest { emit, method, variant: Shape::Packet.into(), target: None };
    program.emit(&request).expect("the library compiles");
}

fn instance(class: &Arc<Class>) -> Arc<Instance> {
    let required = class.parameters.iter().filter(|it| it.required);
    let arguments = required.map(|it| (it.name.as_str(), some_value(&it.ty)));
    Instance::new(class, arguments).expect("parameters of the right types")
}

/// A value for a parameter that has no default.
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
        ParameterType::Reference(_) => Value::List(Vec::new()),
    }
}

fn milliseconds(duration: Duration) -> f64 {
    duration.as_secs_f64() * 1e3
}

fn print_library(rows: &[Row]) {
    let mut rows: Vec<&Row> = rows.iter().collect();
    rows.sort_by_key(|row| row.total);
    println!("text to kernel, {} methods of the standard library, ms:", rows.len());
    let print = |label: &str, row: &Row| {
        let mut last = 0.0;
        let stages = STAGES.iter().zip(&row.stages).map(|((name, emit), end)| {
            let end = milliseconds(*end);
            // Checking is no part of what the later forms take.
            let own = if emit.is_none() { end } else { end - std::mem::replace(&mut last, end) };
            format!("{name} {own:.2}")
        });
        let stages: Vec<String> = stages.collect();
        println!(
            "{label:>8} {:7.2}  {:<36} {}",
            milliseconds(row.total),
            row.name,
            stages.join(", ")
        );
    };
    let Some(last) = rows.len().checked_sub(1) else { return };
    print("median", rows[last / 2]);
    print("90 %", rows[last * 9 / 10]);
    rows.iter().rev().take(6).rev().for_each(|row| print("worst", row));
    for (index, (name, emit)) in STAGES.iter().enumerate() {
        let own = |row: &&Row| {
            let before =
                if emit.is_none() || index == 1 { Duration::ZERO } else { row.stages[index - 1] };
            milliseconds(row.stages[index].saturating_sub(before))
        };
        println!("{:>8} {:7.2}  {name}", "sum", rows.iter().map(own).sum::<f64>());
    }
    let total = rows.iter().map(|row| milliseconds(row.total)).sum::<f64>();
    println!("{:>8} {total:7.2}", "sum");
}

/// Renders the scene as this process's only work and prints a line at the first tile.
fn report_first_tile(scene: &str) {
    let progress = |_: usize, _: usize| {
        // The parent listens to the first of two threads.
        let mut out = std::io::stdout().lock();
        let _ = out.write_all(b"tile\n").and_then(|()| out.flush());
        std::process::exit(0);
    };
    let request = RenderRequest {
        scene: Path::new(scene).to_owned(),
        progress: Some(&progress),
        ..RenderRequest::default()
    };
    if let Err(messages) = render_scene(&request) {
        eprintln!("{messages:?}");
    }
}

fn print_cold_start() {
    let Ok(program) = std::env::current_exe() else { return };
    let mut times: Vec<Duration> = (0..20).filter_map(|_| first_tile(&program)).collect();
    times.sort();
    let (Some(best), Some(median)) = (times.first(), times.get(times.len() / 2)) else { return };
    println!(
        "three-spheres, process start to first tile, ms: best {:.0}, median {:.0}",
        milliseconds(*best),
        milliseconds(*median)
    );
}

fn first_tile(program: &Path) -> Option<Duration> {
    let start = Instant::now();
    let mut command = Command::new(program);
    let mut child = command.args([CHILD, SCENE]).stdout(Stdio::piped()).spawn().ok()?;
    let mut line = String::new();
    BufReader::new(child.stdout.take()?).read_line(&mut line).ok()?;
    let time = start.elapsed();
    child.wait().ok()?;
    (line == "tile\n").then_some(time)
}
