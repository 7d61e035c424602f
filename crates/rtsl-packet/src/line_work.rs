//! The work of packet code by lines of the source.

use std::collections::BTreeMap;
use std::sync::Arc;

use rtsl_ir::Value;

use crate::Kernel;
use crate::estimate::busy_cycles;
use crate::kernel::{Op, OpKind};
use crate::profile::Count;

/// The work of a line of the source.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct LineWork {
    /// The name of the source; empty for work whose line is not known.
    pub source: Arc<str>,
    /// The line, from 1; 0 if it is not known.
    pub line: u32,
    /// The estimated time for which the execution units of a machine are busy, in thousandths of a cycle.
    pub millicycles: u64,
    /// The operations on lanes.
    pub lanes: Count,
    /// The conditions of branches and loops that were reached, each time by a chunk of rays.
    pub conditions: u64,
    /// Those at which the rays of the chunk diverged.
    pub divergences: u64,
}

impl LineWork {
    /// Returns the share of the lanes that are on, from 0 to 1; `None` if all rays share the work.
    pub fn active_share(&self) -> Option<f64> {
        share(self.lanes.active, self.lanes.executed)
    }

    /// Returns the share of the conditions at which rays diverged, from 0 to 1; `None` if the line has none.
    pub fn diverged_share(&self) -> Option<f64> {
        share(self.divergences, self.conditions)
    }

    /// Adds the work of the same line in another run.
    pub fn add(&mut self, other: &LineWork) {
        self.source.clone_from(&other.source);
        self.line = other.line;
        self.millicycles += other.millicycles;
        self.lanes.add(other.lanes, 1);
        self.conditions += other.conditions;
        self.divergences += other.divergences;
    }
}

fn share(part: u64, of: u64) -> Option<f64> {
    (of > 0).then(|| part as f64 / of as f64)
}

/// The lines of a kernel's values.
#[derive(Clone, Debug)]
pub(crate) struct Lines {
    /// By value, the index of its line among [`Lines::none`]; empty if the kernel has no places.
    of: Vec<usize>,
    none: Vec<LineWork>,
}

impl Lines {
    pub fn of(kernel: &Kernel) -> Lines {
        if kernel.places.is_empty() {
            return Lines { of: Vec::new(), none: Vec::new() };
        }
        let place = |index: usize| {
            let place = kernel.places.get(Value(index as u32));
            place.map_or((String::new(), 0), |it| (it.source.name.clone(), it.line()))
        };
        let lines: Vec<(String, u32)> = (0..kernel.values.len()).map(place).collect();
        let mut indices: BTreeMap<(String, u32), usize> =
            lines.iter().map(|line| (line.clone(), 0)).collect();
        indices.entry((String::new(), 0)).or_default();
        indices.values_mut().zip(0..).for_each(|(index, next)| *index = next);
        let none = indices.keys().map(|(source, line)| LineWork {
            source: source.as_str().into(),
            line: *line,
            ..LineWork::default()
        });
        Lines { none: none.collect(), of: lines.iter().map(|line| indices[line]).collect() }
    }

    /// Returns each line without work.
    pub fn none(&self) -> Vec<LineWork> {
        self.none.clone()
    }

    /// Counts an operation executed while the lanes `active` are on.
    pub fn count(&self, work: &mut [LineWork], kernel: &Kernel, op: &Op, active: u32) {
        let value = match op.kind {
            OpKind::Store { value, .. } => Some(value),
            _ => op.results.iter().next(),
        };
        let Some(index) = value.and_then(|value| self.of.get(value.0 as usize)) else { return };
        let line = &mut work[*index];
        line.millicycles += (busy_cycles(kernel, &op.kind) * 1000.0) as u64;
        if value.is_some_and(|value| kernel.ty(value).lanes) {
            line.lanes.executed += u64::from(kernel.width);
            line.lanes.active += u64::from(active.count_ones());
        }
    }

    /// Counts a condition of a branch or loop for the lanes for which it holds and does not hold.
    pub fn count_condition(&self, work: &mut [LineWork], mask: Value, held: u32, failed: u32) {
        if let Some(index) = self.of.get(mask.0 as usize) {
            work[*index].conditions += 1;
            work[*index].divergences += u64::from(held != 0 && failed != 0);
        }
    }
}
