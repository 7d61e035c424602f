//! `rtsl bench`: the time of methods per ray, for each call mode and width, compared with the peak performance of the
//! machine; for an integrator, its paths per second in a scene; or, for a scene, its tracing speed.
//!
//! Packet code is run by an interpreter that counts operations ([`rtsl::PacketKernel`]); machine code of the same
//! kernel is timed for the same rays.

mod arguments;
mod call;
mod coverage;
mod host;
mod inputs;
mod integrator;
mod line_table;
mod lines;
mod objects;
mod peak;
mod random;
mod rays;
mod scene;
mod scene_lines;
mod settings;
mod subject;
mod table;
mod timing;
mod vectors;

use std::collections::BTreeMap;
use std::sync::Arc;
use std::time::Duration;

use rtsl::{
    Backend, CallMode, Diagnostic, Emit, EmitRequest, Engine, EngineOptions, Instance, LoopOwners,
    Math, Method, Program, Role, Variant, diagnostic_codes as codes,
};

pub use self::arguments::BenchArguments;
use self::call::count;
use self::coverage::{Coverage, coverage, covering_inputs};
pub use self::host::BenchHost;
pub use self::inputs::random_state;
use self::inputs::{Inputs, ORIGIN, RaySource};
use self::lines::Lines;
use self::objects::Objects;
use self::peak::Peak;
pub use self::random::Random;
use self::settings::Setting;
use self::subject::KernelSubject;
use self::table::{Measurement, Row};
use self::timing::{Times, time_in_turn};
use self::vectors::widest_arithmetic;
use super::shader::{choose_class, compile_file, compiler, engine, instance, traced_compiler};
use crate::files::write_result;
use crate::names::find_method;
use crate::outcome::{CommandResult, Failure, Outcome};
use crate::report::Reporter;

/// The number of loop iterations per ray after which a call counts as endless.
const ROUNDS_PER_RAY: u64 = 1 << 14;

/// Measures and prints.
pub fn run(arguments: &BenchArguments, reporter: &Reporter) -> CommandResult {
    let arguments = &arguments.with_project_files(reporter)?;
    if scene::is_scene(&arguments.file) {
        return match arguments.lines {
            true => scene_lines::run(arguments, reporter),
            false => scene::run(arguments, reporter),
        };
    }
    let compiler = match arguments.lines {
        true => traced_compiler(&arguments.search_path),
        false => compiler(&arguments.search_path),
    };
    let settings = arguments.state.iter().map(|(name, value)| Setting::parse(name, value));
    let settings = settings.collect::<Result<Vec<_>, _>>().map_err(Failure::Usage)?;
    let Some(unit) = compile_file(&compiler, &arguments.file, reporter) else {
        return Ok(Outcome::InputAtFault);
    };
    let class = choose_class(&unit, arguments.class.as_deref())?;
    let methods: Vec<Method> = match &arguments.method {
        Some(name) => vec![find_method(name).map_err(Failure::Usage)?],
        None => class.methods.keys().copied().collect(),
    };
    let instance = instance(&arguments.params, class, &unit, reporter)?;
    if let Some(scene) = integrator::scene_of(arguments, &methods)? {
        return integrator::run(arguments, scene, &instance, reporter);
    }
    if arguments.lines {
        let lines = Lines { arguments, settings: &settings, instance: &instance, reporter };
        return methods.into_iter().try_for_each(|it| lines.print(it)).map(|()| Outcome::Done);
    }
    let bench = Bench::new(arguments, settings, instance, reporter)?;
    for method in methods {
        bench.measure_method(method)?;
    }
    Ok(Outcome::Done)
}

/// The state of measuring all methods.
struct Bench<'a> {
    arguments: &'a BenchArguments,
    settings: Vec<Setting>,
    instance: Arc<Instance>,
    /// By width; width 1 is always included for comparison.
    machines: BTreeMap<u32, Machine>,
}

/// Code of one width, and the peak performance at that width.
struct Machine {
    program: Arc<Program>,
    peak: Peak,
}

/// The inputs of a method's calls.
struct MethodInputs {
    general: Inputs,
    common_origin: Inputs,
    coverage: Coverage,
}

impl<'a> Bench<'a> {
    fn new(
        arguments: &'a BenchArguments,
        settings: Vec<Setting>,
        instance: Arc<Instance>,
        reporter: &Reporter,
    ) -> Result<Self, Failure> {
        let mut machines = BTreeMap::new();
        for width in Engine::WIDTHS {
            if width == 1 || arguments.widths.is_empty() || arguments.widths.contains(&width) {
                let options = EngineOptions {
                    backend: Backend::Jit,
                    width: Some(width),
                    ..arguments.code.options()
                };
                let exact = EngineOptions { math: Math::default(), ..options.clone() };
                let peak = Peak::measure(&engine(exact, reporter)?, arguments.lanes as usize)?;
                let engine = engine(options, reporter)?;
                machines.insert(width, Machine { program: engine.program(&instance), peak });
            }
        }
        Ok(Bench { arguments, settings, instance, machines })
    }

    /// Returns the program at width 1.
    fn scalar_program(&self) -> &Program {
        &self.machines[&1].program
    }

    fn measure_method(&self, method: Method) -> Result<(), Failure> {
        let objects =
            Objects::new(self.scalar_program(), &self.instance, self.arguments.lanes as usize);
        let inputs = MethodInputs::new(
            self.scalar_program(),
            method,
            &objects,
            &self.settings,
            self.arguments,
        )?;
        let (mut subjects, mut vectors) = (Vec::new(), Vec::new());
        for (mode, width) in self.kernels(method)? {
            let program = &self.machines[&width].program;
            let inputs = inputs.of_mode(mode);
            let variant = self.variant(program, mode);
            subjects.push(KernelSubject::new(program, method, &variant, &objects, inputs)?);
            vectors.push(floats_at_once(program, method, variant)?);
        }
        let time = Duration::from_millis(self.arguments.time.unwrap_or(50).into());
        let times = time_in_turn(&mut subjects, time);
        let kernels = subjects.iter().zip(times).zip(vectors);
        let kernels: Vec<_> =
            kernels.map(|((subject, times), vector)| (subject, times, vector)).collect();
        self.print(method, &kernels, inputs.coverage)
    }

    fn variant(&self, program: &Program, mode: CallMode) -> Variant {
        let variant = self.arguments.variant.reading(mode);
        if self.arguments.variant.specialise {
            variant.knowing(program.known_members(&self.instance))
        } else {
            variant
        }
    }

    /// Returns the kernels to measure, in the order of the table. Those of each call mode begin with width 1, for
    /// comparison.
    fn kernels(&self, method: Method) -> Result<Vec<(CallMode, u32)>, Failure> {
        let reads = &self.scalar_program().method(method)?.reads;
        let is_of_use = |mode: CallMode| match mode {
            // Otherwise it is the same as the packet call mode.
            CallMode::CommonOrigin => reads.iter().any(|variable| variable.name == ORIGIN),
            CallMode::Packet | CallMode::Stream | CallMode::Leaf | CallMode::Single => true,
        };
        let mut modes = CallMode::ALL.to_vec();
        match &self.arguments.modes[..] {
            [] => modes.retain(|mode| is_of_use(*mode)),
            asked => modes.retain(|mode| asked.contains(mode)),
        }
        let widths = self.machines.keys();
        let kernels = modes.iter().flat_map(|mode| widths.clone().map(|width| (*mode, *width)));
        Ok(kernels.filter(|(mode, width)| mode.width(*width) == *width).collect())
    }

    /// True if a kernel was requested: call modes with a single width are always shown.
    fn is_width_asked(&self, mode: CallMode, width: u32) -> bool {
        let asked = &self.arguments.widths;
        asked.is_empty() || asked.iter().any(|asked| mode.width(*asked) == width)
    }

    fn print(
        &self,
        method: Method,
        kernels: &[(&KernelSubject<'_>, Times, Option<u32>)],
        coverage: Coverage,
    ) -> Result<(), Failure> {
        let class = &self.scalar_program().class().name;
        let lanes = self.arguments.lanes as usize;
        let mut text = String::new();
        if !self.arguments.json {
            text += &table::heading(class, method.name(), lanes, coverage);
        }
        let mut one = f64::NAN;
        for (subject, times, vector) in kernels {
            let KernelSubject { mode, width, profile, .. } = subject;
            if *width == 1 {
                one = times.median;
            }
            if !self.is_width_asked(*mode, *width) {
                continue;
            }
            let row = Row::new(&Measurement {
                class,
                method: method.name(),
                mode: *mode,
                width: *width,
                vector: *vector,
                calls: subject.calls(),
                times: *times,
                one,
                profile,
                peak: self.machines[width].peak,
                coverage,
            });
            text += &if self.arguments.json { row.to_json() } else { row.to_text() };
        }
        write_result(None, text.as_bytes())
    }
}

impl MethodInputs {
    /// Makes inputs for the calls of a method, which reach as many sides of branches as possible.
    fn new(
        program: &Program,
        method: Method,
        objects: &Objects,
        settings: &[Setting],
        arguments: &BenchArguments,
    ) -> Result<MethodInputs, Failure> {
        let lanes = arguments.lanes as usize;
        let packets = program.packet_kernel(method, CallMode::Packet)?;
        let role = program.class().role_of(method).unwrap_or(Role::Primitive);
        let mut rays = RaySource::new(program, objects, method, role, settings, arguments.seed)?;
        let most_rounds = ROUNDS_PER_RAY * lanes as u64;
        let inputs = |rays: &mut RaySource<'_>| {
            let inputs = covering_inputs(&packets, objects, rays, lanes, most_rounds);
            inputs.ok_or_else(|| endless(program, method))
        };
        let general = inputs(&mut rays)?;
        rays.start_at_one_point();
        let common_origin = inputs(&mut rays)?;
        let profile =
            count(&packets, objects.of_mode(CallMode::Packet), &general, u64::MAX).profile;
        Ok(MethodInputs { general, common_origin, coverage: coverage(&profile) })
    }

    fn of_mode(&self, mode: CallMode) -> &Inputs {
        match mode {
            CallMode::Packet | CallMode::Stream | CallMode::Leaf | CallMode::Single => {
                &self.general
            }
            CallMode::CommonOrigin => &self.common_origin,
        }
    }
}

/// Returns the number of floats that the machine code of a kernel computes at once, if it computes with floats.
fn floats_at_once(
    program: &Program,
    method: Method,
    variant: Variant,
) -> Result<Option<u32>, Diagnostic> {
    let request = EmitRequest { emit: Emit::Assembly, method, variant, target: None };
    let assembly = program.emit(&request)?;
    Ok(widest_arithmetic(&String::from_utf8_lossy(&assembly)))
}

fn endless(program: &Program, method: Method) -> Diagnostic {
    let owners = LoopOwners::of(&program.class().name, method, [program]);
    Diagnostic::new(
        codes::BUDGET_EXHAUSTED,
        format!("{} went round its loops {ROUNDS_PER_RAY} times a ray", owners.subject()),
    )
    .help("its loop may never end for random rays; `--state` chooses others")
}
