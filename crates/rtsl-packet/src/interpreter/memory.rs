//! Loads, stores and outputs.

use rtsl_ir::host::MAX_LANES;
use rtsl_ir::{Index, IndexVec, Value, VariableId, VariableKind};

use super::{Execution, Hit, Lanes};
use crate::Kernel;

/// Allocates the memory of a kernel's locals.
pub(super) fn locals(kernel: &Kernel) -> IndexVec<VariableId, Vec<Lanes>> {
    let len =
        |kind: VariableKind, len: u32| if kind == VariableKind::Local { len as usize } else { 0 };
    let variables = kernel.variables.iter().map(|it| len(it.variable.kind, it.variable.len));
    variables.map(|len| vec![[0; MAX_LANES]; len]).collect()
}

impl Execution<'_> {
    pub(super) fn clear_locals(&mut self) {
        self.locals.iter_mut().for_each(|local| local.fill([0; MAX_LANES]));
    }

    pub(super) fn load(&mut self, result: Value, variable: VariableId, index: Index) {
        self.define(result, |it, lane| it.element(variable, index, lane));
    }

    fn element(&self, id: VariableId, index: Index, lane: usize) -> u32 {
        let kernel_variable = self.kernel.variable(id);
        let variable = &kernel_variable.variable;
        let ray = if kernel_variable.varies { self.base + lane as u32 } else { 0 };
        if kernel_variable.varies
            && variable.kind != VariableKind::Local
            && self.chunk >> lane & 1 == 0
        {
            return self.noise(variable.scalar, lane);
        }
        match variable.kind {
            VariableKind::Local => {
                let index = self.clamped(index, lane, variable.len.into());
                self.locals[id][index as usize][lane]
            }
            VariableKind::Buffer => {
                let scalars = u64::from(self.storage.elements(id, ray)) * u64::from(variable.len);
                let index = self.clamped(index, lane, scalars);
                if scalars == 0 { 0 } else { self.storage.load(id, index, ray) }
            }
            VariableKind::State
            | VariableKind::Scratch
            | VariableKind::Member
            | VariableKind::Parameter
            | VariableKind::Accepted => {
                self.storage.load(id, self.clamped(index, lane, variable.len.into()), ray)
            }
        }
    }

    /// Returns the index clamped to `0..count`; 0 if `count` is 0.
    fn clamped(&self, index: Index, lane: usize, count: u64) -> u32 {
        let index = match index {
            Index::Constant(index) => return index,
            Index::Dynamic(value) => self.get(value, lane) as i32,
        };
        let last = count.saturating_sub(1).min(i32::MAX as u64) as i32;
        index.clamp(0, last) as u32
    }

    pub(super) fn store(
        &mut self,
        id: VariableId,
        index: Index,
        value: Value,
        mask: Option<Value>,
    ) {
        let variable = self.kernel.variable(id);
        let on = mask.map_or(u32::MAX, |mask| self.lanes_of(mask));
        for lane in (0..MAX_LANES).filter(|lane| on >> lane & 1 != 0) {
            let index = self.clamped(index, lane, variable.variable.len.into());
            self.locals[id][index as usize][lane] = self.get(value, lane);
        }
    }

    pub(super) fn length(&mut self, result: Value, buffer: VariableId) {
        let varies = self.kernel.variable(buffer).varies;
        self.define(result, |it, lane| {
            if varies && it.chunk >> lane & 1 == 0 {
                return 0;
            }
            let ray = if varies { it.base + lane as u32 } else { 0 };
            it.storage.elements(buffer, ray).min(i32::MAX as u32)
        });
    }

    // Outputs.

    pub(super) fn store_outputs(&mut self) {
        let kernel = self.kernel;
        let stored = self.store_accepted();
        let on = stored.unwrap_or(self.chunk);
        for (output, value) in kernel.outputs.iter().zip(&kernel.body.yields) {
            let kind = kernel.variable(output.variable).variable.kind;
            if kind == VariableKind::Accepted {
                continue;
            }
            self.outcome.profile.count_output(kind, kernel.width, on);
            for lane in (0..MAX_LANES).filter(|lane| on >> lane & 1 != 0) {
                let (ray, bits) = (self.base + lane as u32, self.get(*value, lane));
                self.storage.store(output.variable, output.component, ray, bits);
            }
        }
    }

    /// Stores the accepted output, if the kernel has one, and returns the lanes that accept a hit.
    fn store_accepted(&mut self) -> Option<u32> {
        let kernel = self.kernel;
        let mut outputs = kernel.outputs.iter().zip(&kernel.body.yields);
        let is_accepted =
            |variable| kernel.variable(variable).variable.kind == VariableKind::Accepted;
        let (output, value) = outputs.find(|(output, _)| is_accepted(output.variable))?;
        // A uniform value is also true in the lanes beyond the last ray.
        let accepted = self.lanes_of(*value) & self.chunk;
        self.outcome.profile.count_output(VariableKind::Accepted, kernel.width, self.chunk);
        self.store_acceptance(output.variable, accepted);
        Some(accepted)
    }

    /// Keeps the nearest of the hits of this chunk and the previous ones.
    pub(super) fn keep_nearest(&mut self) {
        let kernel = self.kernel;
        let value = |output: usize| kernel.body.yields[output];
        let Some(accepted) = kernel.accepted_output() else { return };
        let hits = self.lanes_of(value(accepted)) & self.chunk;
        self.outcome.profile.count_output(VariableKind::Accepted, kernel.width, self.chunk);
        for lane in (0..MAX_LANES).filter(|lane| hits >> lane & 1 != 0) {
            let distance = kernel.distance_output().map_or(0, |it| self.get(value(it), lane));
            // `min` turns NaN into infinity.
            let distance = f32::from_bits(distance).min(f32::INFINITY);
            if self.nearest.as_ref().is_none_or(|nearest| distance < nearest.distance) {
                let bits = kernel.body.yields.iter().map(|value| self.get(*value, lane));
                let (object, bits) = (self.base + lane as u32, bits.collect());
                self.nearest = Some(Hit { object, distance, bits });
            }
        }
    }

    /// Stores the nearest hit at the end of the call.
    pub(super) fn store_nearest(&mut self) {
        let Some(Hit { object, distance: _, bits }) = self.nearest.take() else { return };
        self.outcome.nearest = Some(object);
        for (output, bits) in self.kernel.outputs.iter().zip(bits) {
            let kind = self.kernel.variable(output.variable).variable.kind;
            if kind != VariableKind::Accepted {
                self.outcome.profile.count_output(kind, 1, 1);
                self.storage.store(output.variable, output.component, 0, bits);
            }
        }
    }

    /// Stores false for a chunk without active rays.
    pub(super) fn store_nothing_accepted(&mut self) {
        if self.kernel.keeps_nearest() {
            return;
        }
        let mut outputs = self.kernel.outputs.iter();
        let is_accepted =
            |variable| self.kernel.variable(variable).variable.kind == VariableKind::Accepted;
        if let Some(output) = outputs.find(|output| is_accepted(output.variable)) {
            self.store_acceptance(output.variable, 0);
        }
    }

    fn store_acceptance(&mut self, variable: VariableId, accepted: u32) {
        let end = (self.base + self.kernel.width).min(self.rays.count);
        for ray in self.base..end {
            self.storage.store(variable, 0, ray, accepted >> (ray - self.base) & 1);
        }
    }
}
