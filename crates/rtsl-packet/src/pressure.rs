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
        // Two positions more: those of what a region yields, and of values without a use after the last operation.
        let ending = vec![0; uses.position as usize + 3];
        let last = uses.last;
        let mut live = Live { kernel: self, last, ending, position: 0, ended: 0, now: 0, most: 0 };
        live.region(&self.body);
        live.most
    }

    /// Returns the bytes of the stack that the values in lanes need at least, if registers hold none of them: each has a
    /// lane for each ray.
    pub fn least_frame_bytes(&self) -> usize {
        self.live_lanes() as usize * self.width as usize * size_of::<f32>()
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

/// The number of values in use at a position.
struct Live<'a> {
    kernel: &'a Kernel,
    last: IndexVec<Value, u32>,
    /// The number of values whose last use is at each position.
    ending: Vec<u32>,
    position: u32,
    /// The position up to which values have ended.
    ended: u32,
    now: u32,
    most: u32,
}

impl Live<'_> {
    fn region(&mut self, region: &Region) {
        for op in &region.ops {
            self.position += 1;
            op.kind.regions().for_each(|region| self.region(region));
            while self.ended < self.position {
                self.ended += 1;
                self.now -= self.ending[self.ended as usize];
            }
            let ty = |value: &Value| self.kernel.ty(*value);
            let is_number = |value: &Value| ty(value).lanes && ty(value).scalar != Scalar::Bool;
            for value in op.results.iter().filter(is_number) {
                let end = self.last[value].max(self.position + 1);
                self.ending[end as usize] += 1;
                self.now += 1;
            }
            self.most = self.most.max(self.now);
        }
    }
}
