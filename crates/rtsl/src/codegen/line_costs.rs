//! The record of the work of lines.

use std::collections::BTreeMap;
use std::fmt;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use rtsl_ir::Source;
use rtsl_packet::line_work::LineWork;

/// The record of the work that methods do on the engine of these [options](crate::EngineOptions::costs), by lines of
/// their texts, if these are [compiled for it](crate::CompilerOptions::traced). Clones share it.
///
/// ```
/// use rtsl::{CallArguments, CallMode, Compiler, CompilerOptions, Engine, EngineOptions, Instance, Instances};
/// use rtsl::{LineCosts, Method, host::NoHost};
///
/// let text = "class Half : rt_Texture;\nvoid lookup() {\n    rt_FloatTextureValue = 0.5 * rt_TextureUV.x;\n}";
/// let compiler = Compiler::new(CompilerOptions { traced: true, ..CompilerOptions::default() });
/// let unit = compiler.compile("half.rtsl", text).unit.expect("it compiles");
/// let half = Instance::new(unit.class("Half")?, [])?;
///
/// let costs = LineCosts::default();
/// let (engine, _) = Engine::new(EngineOptions { costs: Some(costs.clone()), ..EngineOptions::default() })?;
/// let program = engine.program(&half);
/// program.kernel(Method::Lookup, CallMode::Packet)?.call(CallArguments {
///     state: &mut rtsl::new_state(64),
///     scratch: &mut program.new_scratch(64),
///     count: 64,
///     mask: None,
///     accepted: None,
///     instances: Instances::One(&program.block(&half)),
///     host: &mut NoHost,
/// });
/// let texts = costs.take();
/// let dearest = texts[0].lines.iter().max_by_key(|line| line.millicycles).expect("it has lines");
/// assert_eq!((&*texts[0].name, dearest.line), ("half.rtsl", 3));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Default)]
pub struct LineCosts(Arc<Mutex<Record>>);

/// The work of the lines of a text.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct TextCosts {
    /// The name of the text; empty for work whose line is not known.
    pub name: Arc<str>,
    /// The text; `None` for work whose line is not known.
    pub source: Option<Arc<Source>>,
    /// The lines with work, in their order.
    pub lines: Vec<LineWork>,
}

impl TextCosts {
    /// Returns the time of all lines, in thousandths of a cycle.
    pub fn millicycles(&self) -> u64 {
        self.lines.iter().map(|line| line.millicycles).sum()
    }
}

#[derive(Default)]
struct Record {
    kernels: Vec<KernelCosts>,
    sources: BTreeMap<String, Arc<Source>>,
}

/// The work of a kernel, which its clones share.
#[derive(Clone, Debug, Default)]
pub(crate) struct KernelCosts(Arc<Mutex<Vec<LineWork>>>);

impl LineCosts {
    /// Returns the work since the last call, by the names of texts.
    pub fn take(&self) -> Vec<TextCosts> {
        let record = self.record();
        let mut texts: BTreeMap<Arc<str>, BTreeMap<u32, LineWork>> = BTreeMap::new();
        let done = record.kernels.iter().flat_map(KernelCosts::take);
        for work in done.filter(|work| work.millicycles > 0) {
            let lines = texts.entry(work.source.clone()).or_default();
            lines.entry(work.line).or_default().add(&work);
        }
        let text = |(name, lines): (Arc<str>, BTreeMap<u32, LineWork>)| TextCosts {
            source: record.sources.get(&*name).cloned(),
            lines: lines.into_values().collect(),
            name,
        };
        texts.into_iter().map(text).collect()
    }

    /// Begins to record the work of a kernel, whose lines are of these texts.
    pub(super) fn of_kernel(&self, sources: &[Arc<Source>]) -> KernelCosts {
        let costs = KernelCosts::default();
        let mut record = self.record();
        record.kernels.push(costs.clone());
        record.sources.extend(sources.iter().map(|source| (source.name.clone(), source.clone())));
        costs
    }

    fn record(&self) -> MutexGuard<'_, Record> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl KernelCosts {
    /// Adds the work of a call. The lines are the same in each.
    pub fn add(&self, lines: &[LineWork]) {
        let mut sums = self.lines();
        sums.resize_with(lines.len(), LineWork::default);
        sums.iter_mut().zip(lines).for_each(|(sum, line)| sum.add(line));
    }

    fn take(&self) -> Vec<LineWork> {
        std::mem::take(&mut *self.lines())
    }

    fn lines(&self) -> MutexGuard<'_, Vec<LineWork>> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl PartialEq for LineCosts {
    fn eq(&self, other: &Self) -> bool {
        Arc::ptr_eq(&self.0, &other.0)
    }
}

impl Eq for LineCosts {}

impl fmt::Debug for LineCosts {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        out.write_str("LineCosts")
    }
}
