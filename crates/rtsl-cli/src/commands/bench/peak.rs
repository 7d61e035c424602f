//! Peak performance of the machine at a width, measured by kernels made for this purpose.

use std::sync::Arc;
use std::time::Duration;

use rtsl::{CallMode, Class, Compiler, Engine, Instance, Method, Profile, Role, Variant};

use super::inputs::RaySource;
use super::objects::Objects;
use super::subject::KernelSubject;
use super::timing::time_in_turn;
use crate::outcome::Failure;

/// The peak rates, per nanosecond.
#[derive(Clone, Copy, Debug, Default)]
pub struct Peak {
    /// Float operations.
    pub float_operations: f64,
    /// Divisions.
    pub divisions: f64,
    /// Square roots.
    pub square_roots: f64,
    /// Bytes loaded and stored, in calls with the usual number of rays.
    pub bytes: f64,
}

/// The numbers of independent chains of operations. Few chains leave units idle, many exceed the registers of some
/// machines; the best result counts.
const CHAINS: [usize; 3] = [6, 8, 10];
/// The number of chains for the divider, which is not pipelined deeply.
const DIVIDER_CHAINS: [usize; 1] = [6];
/// The number of rays in calls that compute and hardly access memory.
const COMPUTING_LANES: usize = 64;
/// The numbers of arrays whose sum each output of a memory kernel is; the best result counts.
const ADDENDS: [usize; 3] = [1, 2, 3];
/// The time for measuring each kernel.
const TIME: Duration = Duration::from_millis(15);

impl Peak {
    /// Measures all rates; memory in calls with this many rays.
    ///
    /// # Errors
    /// If there is no LLVM.
    pub fn measure(engine: &Engine, lanes: usize) -> Result<Peak, Failure> {
        let computing = |chains: &[usize], step: &str, count: fn(&Profile) -> u64| {
            let texts = chains.iter().map(|chains| chains_text(*chains, step));
            best_rate(engine, Method::Lookup, Role::Texture, texts, COMPUTING_LANES, count)
        };
        let sums = ADDENDS.into_iter().map(sums_text);
        let moving = |profile: &Profile| profile.bytes().executed;
        Ok(Peak {
            float_operations: computing(&CHAINS, "fma(x, scale, shift)", |profile| {
                profile.float_operations.executed
            })?,
            divisions: computing(&DIVIDER_CHAINS, "shift / (x + scale)", |profile| {
                profile.divisions.executed
            })?,
            square_roots: computing(&DIVIDER_CHAINS, "sqrt(x + scale)", |profile| {
                profile.square_roots.executed
            })?,
            bytes: best_rate(engine, Method::Emission, Role::Light, sums, lanes, moving)?,
        })
    }
}

/// Returns the best rate among some texts, by the counter `count`.
fn best_rate(
    engine: &Engine,
    method: Method,
    role: Role,
    texts: impl Iterator<Item = String>,
    lanes: usize,
    count: fn(&Profile) -> u64,
) -> Result<f64, Failure> {
    let mut best: f64 = 0.0;
    for text in texts {
        best = best.max(rate(engine, method, role, &text, lanes, count)?);
    }
    Ok(best)
}

fn rate(
    engine: &Engine,
    method: Method,
    role: Role,
    text: &str,
    lanes: usize,
    count: fn(&Profile) -> u64,
) -> Result<f64, Failure> {
    let compilation = Compiler::default().compile("peak.rtsl", text);
    let unit = compilation.unit.unwrap_or_default();
    let class = unit.class("Peak")?;
    let instance = instance(class)?;
    let program = engine.program(&instance);
    let objects = Objects::new(&program, &instance, lanes);
    let mut rays = RaySource::new(&program, &objects, method, role, &[], 0)?;
    let inputs = rays.usual(lanes);
    let variant = Variant::new(CallMode::Packet);
    let mut subjects = [KernelSubject::new(&program, method, &variant, &objects, &inputs)?];
    let times = time_in_turn(&mut subjects, TIME);
    // Times are per ray, and the profile counts the operations of all calls that are timed together.
    let profile = &subjects[0].profile;
    let nanoseconds = times[0].tenth * profile.rays as f64;
    Ok(count(profile) as f64 / nanoseconds)
}

fn instance(class: &Arc<Class>) -> Result<Arc<Instance>, Failure> {
    let instance = Instance::new(class, []);
    instance.map_err(|errors| Failure::Diagnostics(errors.iter().cloned().collect()))
}

/// The text of independent chains in registers; a step of a chain is an expression in `x`.
fn chains_text(chains: usize, step: &str) -> String {
    let repeat = |line: &dyn Fn(usize) -> String| (0..chains).map(line).collect::<String>();
    let begin = repeat(&|chain| format!("float x{chain} = abs({chain}.0 * rt_TextureUVW.x);\n"));
    let steps = repeat(&|chain| format!("x{chain} = STEP(x{chain});\n")).repeat(4);
    let end = repeat(&|chain| format!(" + x{chain}"));
    format!(
        "#define STEP(x) {step}\nclass Peak : rt_Texture;\n\
         public float scale = 0.5;\npublic float shift = 0.25;\n\
         void lookup() {{\n{begin}for (int i = 0; i < 40; i++) {{\n{steps}}}\n\
         rt_FloatTextureValue = 0.0{end};\n}}\n"
    )
}

/// The text of outputs that are sums of arrays, dominated by loads and stores.
fn sums_text(addends: usize) -> String {
    let arrays = |output: usize| (0..addends).map(move |addend| format!("a{output}{addend}"));
    let members = (0..3).flat_map(arrays).map(|array| format!("scratch float {array};\n"));
    let sums = (0..3).map(|output| arrays(output).collect::<Vec<_>>().join(" + "));
    format!(
        "class Peak : rt_Light;\n{}void emission() {{\nrt_EmissionColor = color({});\n}}\n",
        members.collect::<String>(),
        sums.collect::<Vec<_>>().join(", ")
    )
}
