//! The number of vector registers that a kernel's code needs.

use rtsl_ir::{IndexVec, Scalar, Value};

use crate::Kernel;
use crate::kernel::Region;

impl Kernel {
    /// Returns the greatest number of numbers in lanes of the body that are in use at the same time, in the order of its
    /// operations. Masks and splats of uniform values are not counted, and a value used in a loop counts up to its last
    /// use in one iteration.
    pub fn live_lanes(&self) -> u32 {
        let mut uses = Uses { last: IndexVec::filled(self.values.len(), 0), position: 0 };
        uses.region(&self.body);
        let mut live =
            Live { kernel: self, last: uses.last, position: 0, now: Vec::new(), most: 0 };
        live.region(&self.body);
        live.most
    }
}

/// The position of the last use of each value; operations are numbered in their order.
struct Uses {
    last: IndexVec<Value, u32>,
    position: u32,
}

impl Uses {
    fn region(&mut self, region: &Region) {
        for op in &region.ops {
            self.position += 1;
            op.kind.for_each_operand(|value| self.last[value] = self.position);
            op.kind.regions().for_each(|region| self.region(region));
        }
        region.yields.iter().for_each(|value| self.last[*value] = self.position + 1);
    }
}

/// The values in use at a position.
struct Live<'a> {
    kernel: &'a Kernel,
    last: IndexVec<Value, u32>,
    position: u32,
    now: Vec<Value>,
    most: u32,
}

impl Live<'_> {
    fn region(&mut self, region: &Region) {
        for op in &region.ops {
            self.position += 1;
            op.kind.regions().for_each(|region| self.region(region));
            let (last, position) = (&self.last, self.position);
            self.now.retain(|value| last[*value] > position);
            let ty = |value: &Value| self.kernel.ty(*value);
            let is_number = |value: &Value| ty(value).lanes && ty(value).scalar != Scalar::Bool;
            self.now.extend(op.results.iter().filter(is_number));
            self.most = self.most.max(self.now.len() as u32);
        }
    }
}
