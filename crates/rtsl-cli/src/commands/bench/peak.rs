//! What the machine can do at a width, by kernels made for nothing else.

use std::sync::Arc;
use std::time::Duration;

use rtsl::{Class, Compiler, Engine, Instance, Method, Role, Shape};

use super::inputs::RaySource;
use super::objects::Objects;
use super::subject::KernelSubject;
use super::timing::time_in_turn;
use crate::commands::Failure;

/// The most that was reached.
#[derive(Clone, Copy, Debug, Default)]
pub struct Peak {
    /// Float operations in a nanosecond.
    pub float_operations: f64,
    /// Bytes loaded and stored in a nanosecond, with the calls' usual number of rays.
    pub bytes: f64,
}

/// How many chains of `fma` stand side by side. Few leave units idle that wait for results, many
/// take more registers than some machines have; the best counts.
const CHAINS: [usize; 3] = [6, 8, 10];
/// How many arrays each output of a kernel for memory is the sum of; the best counts.
const ADDENDS: [usize; 3] = [1, 2, 3];
/// How long each kernel is timed.
const TIME: Duration = Duration::from_millis(15);

impl Peak {
    /// Measures both, in calls for so many rays.
    ///
    /// # Errors
    /// If there is no LLVM.
    pub fn measure(engine: &Engine, lanes: usize) -> Result<Peak, Failure> {
        let mut peak = Peak::default();
        for text in CHAINS.map(chains_text) {
            let (operations, _) = rates(engine, (Method::Lookup, Role::Texture), &text, lanes)?;
            peak.float_operations = peak.float_operations.max(operations);
        }
        for text in ADDENDS.map(sums_text) {
            let (_, bytes) = rates(engine, (Method::Emission, Role::Light), &text, lanes)?;
            peak.bytes = peak.bytes.max(bytes);
        }
        Ok(peak)
    }
}

/// Float operations and bytes that a method of a text does in a nanosecond.
fn rates(
    engine: &Engine,
    (method, role): (Method, Role),
    text: &str,
    lanes: usize,
) -> Result<(f64, f64), Failure> {
    let compilation = Compiler::default().compile("peak.rtsl", text);
    let unit = compilation.unit.unwrap_or_default();
    let class = unit.class("Peak")?;
    let instance = instance(class)?;
    let program = engine.program(&instance);
    let objects = Objects::new(&program, &instance, lanes);
    let shape = Shape::Packet;
    let mut rays = RaySource::new(&program, &objects, (method, role), &[], 0)?;
    let inputs = rays.usual(lanes)?;
    let kernel = (shape, engine.width());
    let mut subjects = [KernelSubject::new(&program, method, kernel, &objects, &inputs)?];
    let times = time_in_turn(&mut subjects, TIME);
    let counts = &subjects[0].profile;
    let nanoseconds = times[0].tenth * lanes as f64;
    let rate = |count: u64| count as f64 / nanoseconds;
    Ok((rate(counts.float_operations.active), rate(counts.bytes().active)))
}

fn instance(class: &Arc<Class>) -> Result<Arc<Instance>, Failure> {
    let instance = Instance::new(class, []);
    instance.map_err(|problems| Failure::Diagnostics(problems.iter().cloned().collect()))
}

/// Independent chains of `fma` in registers.
fn chains_text(chains: usize) -> String {
    let repeat = |line: &dyn Fn(usize) -> String| (0..chains).map(line).collect::<String>();
    let begin = repeat(&|chain| format!("float x{chain} = {chain}.0 * rt_TextureUVW.x;\n"));
    let step = repeat(&|chain| format!("x{chain} = fma(x{chain}, scale, shift);\n")).repeat(4);
    let end = repeat(&|chain| format!(" + x{chain}"));
    format!(
        "class Peak : rt_Texture;\npublic float scale = 0.5;\npublic float shift = 0.25;\n\
         void lookup() {{\n{begin}for (int i = 0; i < 100; i++) {{\n{step}}}\n\
         rt_FloatTextureValue = 0.0{end};\n}}\n"
    )
}

/// Outputs that are sums of arrays: loads, stores, and next to nothing besides.
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
