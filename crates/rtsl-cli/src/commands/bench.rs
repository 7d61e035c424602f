//! `rtsl bench`: how long methods take per ray, for each shape and width.

use std::path::PathBuf;
use std::sync::Arc;
use std::time::{Duration, Instant};

use clap::Args;
use rtsl::host::NoHost;
use rtsl::{
    Backend, CallArguments, Engine, EngineOptions, Instance, InstanceTable, Instances, LaneBlock,
    LaneIndices, LaneMask, MemberBlock, Method, Program, Role, Shape, new_state, set_defaults,
};
use serde::Serialize;
use serde_json::Value as JsonValue;

use super::eval::parse_setting;
use super::{
    CommandResult, Failure, Outcome, choose_class, compile_file, compiler, engine, instance,
};
use crate::arguments::{MathName, SearchPath};
use crate::files::write_result;
use crate::names::find_method;
use crate::report::Reporter;

/// How many rays a call has.
const LANES: usize = 1024;
/// How long each kernel is measured; the best call counts.
const LEAST_TIME: Duration = Duration::from_millis(40);

/// The command line of `rtsl bench`.
#[derive(Debug, Args)]
pub struct BenchArguments {
    /// The shader.
    #[arg(value_name = "FILE")]
    file: PathBuf,
    /// The method; all methods if not given.
    method: Option<String>,
    /// The class, where the file has several.
    #[arg(long)]
    class: Option<String>,
    /// A parameter of the instance; may be repeated.
    #[arg(long = "param", value_name = "NAME=VALUE", value_parser = parse_setting)]
    params: Vec<(String, JsonValue)>,
    /// How exact arithmetic is.
    #[arg(long, value_enum, default_value_t = MathName::Contract)]
    math: MathName,
    /// Print one JSON object a line for each kernel.
    #[arg(long)]
    json: bool,
    #[command(flatten)]
    search_path: SearchPath,
}

/// One measurement.
#[derive(Debug, Serialize)]
#[serde(rename_all = "camelCase")]
struct Measurement {
    class: String,
    method: &'static str,
    shape: &'static str,
    width: u32,
    nanoseconds_per_lane: f64,
    /// How many times as fast as width 1.
    speedup: f64,
}

/// Measures and prints.
pub fn run(arguments: &BenchArguments, reporter: &Reporter) -> CommandResult {
    let compiler = compiler(&arguments.search_path);
    let Some(unit) = compile_file(&compiler, &arguments.file, reporter) else {
        return Ok(Outcome::InputAtFault);
    };
    let class = choose_class(&unit, arguments.class.as_deref())?;
    let methods: Vec<Method> = match &arguments.method {
        Some(name) => vec![find_method(name).map_err(Failure::Usage)?],
        None => class.methods.keys().copied().collect(),
    };
    let instance = instance(&arguments.params, class, &unit)?;
    if !arguments.json {
        write_result(None, heading().as_bytes())?;
    }
    for method in methods {
        for shape in Shape::ALL {
            let measurements = measure_widths(arguments, &instance, method, shape, reporter)?;
            let text = if arguments.json {
                let lines = measurements.iter().map(serde_json::to_string);
                lines.map(|line| line.unwrap_or_default() + "\n").collect()
            } else {
                table_row(&measurements)
            };
            write_result(None, text.as_bytes())?;
        }
    }
    Ok(Outcome::Done)
}

fn measure_widths(
    arguments: &BenchArguments,
    instance: &Arc<Instance>,
    method: Method,
    shape: Shape,
    reporter: &Reporter,
) -> Result<Vec<Measurement>, Failure> {
    let mut measurements: Vec<Measurement> = Vec::new();
    for width in Engine::WIDTHS.into_iter().filter(|width| shape.width(*width) == *width) {
        let options = EngineOptions {
            backend: Backend::Jit,
            width: Some(width),
            math: arguments.math.into(),
            ..EngineOptions::default()
        };
        let engine = engine(options, reporter)?;
        let program = engine.program(instance);
        let time = measure(&program, instance, method, shape)?;
        let nanoseconds_per_lane = time.as_secs_f64() * 1e9 / LANES as f64;
        let one = measurements.first().map_or(nanoseconds_per_lane, |it| it.nanoseconds_per_lane);
        measurements.push(Measurement {
            class: program.class().name.clone(),
            method: method.name(),
            shape: shape.name(),
            width,
            nanoseconds_per_lane,
            speedup: one / nanoseconds_per_lane,
        });
    }
    Ok(measurements)
}

/// The time of the fastest call for [`LANES`] rays, or as many calls for one.
fn measure(
    program: &Program,
    instance: &Instance,
    method: Method,
    shape: Shape,
) -> Result<Duration, Failure> {
    let kernel = program.kernel(method, shape)?;
    let block = Arc::new(program.block(instance));
    let table = InstanceTable::new(vec![block.clone()]);
    let indices = LaneIndices::new(LANES);
    let members = MemberBlock::new(vec![block.clone(); LANES]);
    let given = test_state(program, method);
    let scratch = program.new_scratch(LANES);
    let count = match shape {
        Shape::Packet | Shape::CommonOrigin | Shape::Stream | Shape::Leaf => LANES,
        Shape::Single => 1,
    };
    let call = || {
        // A method may change what it reads, as `intersect` does with `rt_HitDistance`.
        let (mut state, mut scratch) = (given.clone(), scratch.clone());
        let mut accepted = LaneMask::new(LANES);
        let instances = match shape {
            Shape::Packet | Shape::CommonOrigin | Shape::Single => Instances::One(&block),
            Shape::Stream => Instances::Many(&table, &indices),
            Shape::Leaf => Instances::Range(&members, 0),
        };
        let start = Instant::now();
        for _ in 0..LANES / count {
            let _ = kernel.call(CallArguments {
                state: &mut state,
                scratch: &mut scratch,
                count,
                mask: None,
                accepted: Some(&mut accepted),
                instances,
                host: &mut NoHost,
            });
        }
        start.elapsed()
    };
    call();
    let (mut best, begun) = (Duration::MAX, Instant::now());
    while begun.elapsed() < LEAST_TIME {
        best = best.min(call());
    }
    Ok(best)
}

/// State that differs from ray to ray as rays through an image do.
fn test_state(program: &Program, method: Method) -> LaneBlock {
    let mut state = new_state(LANES);
    let roles = program.class().roles.iter().copied();
    if let Some(role) = roles.clone().find(|role| method.roles().contains(role)) {
        set_defaults(&mut state, role);
        vary(&mut state, role);
    }
    state
}

fn vary(state: &mut LaneBlock, role: Role) {
    let mut set = |name: &str, component: usize, value: &dyn Fn(f32, f32) -> f32| {
        let Some(variable) = rtsl::lookup_state(name).filter(|_| role.row(name).is_some()) else {
            return;
        };
        let floats = state.floats_mut(variable.first_component as usize + component);
        for (lane, float) in floats.iter_mut().enumerate() {
            *float = value((lane % 32) as f32 / 32.0, (lane / 32) as f32 / 32.0);
        }
    };
    set("rt_ScreenCoord", 0, &|x, _| x);
    set("rt_ScreenCoord", 1, &|_, y| y);
    set("rt_RayOrigin", 2, &|_, _| -5.0);
    set("rt_RayDirection", 0, &|x, _| 0.6 * x - 0.3);
    set("rt_RayDirection", 1, &|_, y| 0.6 * y - 0.3);
    set("rt_RayDirection", 2, &|_, _| 1.0);
    set("rt_TextureUV", 0, &|x, _| x);
    set("rt_TextureUV", 1, &|_, y| y);
    for (component, scale) in [1.0, 2.0, 3.0].into_iter().enumerate() {
        set("rt_TextureUVW", component, &move |x, y| scale * x + y);
        set("rt_HitPoint", component, &move |x, y| scale * x - y);
        set("rt_BSDFSeed", component, &move |x, y| (x + y) / (1.0 + scale));
    }
    for name in ["rt_ShadingNormal", "rt_GeometricNormal", "rt_LightDirection"] {
        set(name, 0, &|_, _| 0.0);
        set(name, 1, &|_, _| 0.6);
        set(name, 2, &|_, _| -0.8);
    }
}

fn heading() -> String {
    let widths = Engine::WIDTHS.iter().map(|width| format!("{:>20}", format!("width {width}")));
    format!("{:<34}{}\n", "nanoseconds per lane", widths.collect::<String>())
}

fn table_row(measurements: &[Measurement]) -> String {
    let Some(first) = measurements.first() else { return String::new() };
    let name = format!("{} {}", first.method, first.shape);
    let cells = measurements.iter().map(|it| {
        format!("{:>20}", format!("{:.2} ({:.1}x)", it.nanoseconds_per_lane, it.speedup))
    });
    format!("{name:<34}{}\n", cells.collect::<String>())
}
