//! The loop over chunks: the mask of each chunk, and the stores of its outputs.
//!
//! A chunk is *full* if the call has no mask and all of the chunk's rays exist. This is tested once per chunk; a full
//! chunk's mask is a constant and its outputs are stored directly. Otherwise outputs are loaded, merged and stored, and
//! a chunk without active lanes is skipped.
//!
//! A function for a host's packets has no loop: see `callback`.
//!
//! A kernel that [interleaves](rtsl_packet::Kernel::interleave) has two functions: the first processes full chunks
//! only, several at a time, and leaves the remainder to the second. If the first can take its arguments in registers, a
//! third is called for both: see [`full_chunks`](crate::full_chunks).

use rtsl_abi::{CallMode, offsets};
use rtsl_ir::{Value, VariableKind};
use rtsl_packet::kernel::KernelOutput;

use crate::emitter::{Emitter, Part, PointerSource};
use crate::operand::{Label, LlvmType, Operand, memory_element};

/// The greatest number of outputs that are stored without a branch if there may be no hit, the accepted one included.
const MAX_UNCONDITIONAL: usize = 5;

/// The current chunk.
#[derive(Clone, Copy, Default)]
pub struct Chunk {
    /// The index of its first ray, i64.
    base: Option<Operand>,
    /// True if it is full, i1.
    full: Option<Operand>,
    /// The number of rays from its first on, i64.
    left: Option<Operand>,
}

/// The lanes in which an output is stored.
#[derive(Clone, Copy)]
enum Stored {
    All,
    /// Those whose bits are set.
    Where(Operand),
    /// Those whose words are 0.
    Except(Operand),
}

impl Emitter<'_, '_> {
    /// Returns the index of the chunk's first ray, i64.
    pub fn chunk_base(&self) -> Operand {
        self.chunk.base.expect("inside the loop over chunks")
    }

    /// True if all rays of all the function's chunks are active.
    pub fn is_full(&self) -> bool {
        self.part == Part::Full
    }

    /// Emits all chunks, from the end of the prologue to the jump to `done`.
    pub fn emit_chunks(&mut self, done: Label) {
        if self.callback.is_some() {
            return self.emit_packet(done);
        }
        match self.kernel.mode {
            CallMode::Packet | CallMode::CommonOrigin | CallMode::Stream if self.is_full() => {
                self.emit_full_chunks(done);
            }
            CallMode::Leaf if self.is_full() => self.emit_full_test(done),
            CallMode::Packet | CallMode::CommonOrigin | CallMode::Stream | CallMode::Leaf => {
                self.emit_chunk_loop(done);
            }
            CallMode::Single => self.emit_only_chunk(done),
        }
    }

    /// Emits the loop over chunks that are all full.
    fn emit_full_chunks(&mut self, done: Label) {
        let (start, width) = (self.new_label(), self.width);
        let before = self.block();
        let (base, next) = (self.new_local(), self.new_local());
        self.chunk.base = Some(base);
        self.jump(start);
        self.begin_block(start);
        let base_at = self.here();
        self.define_all_on(self.kernel.body.params[0]);
        self.emit_chunk_body();
        self.effect(format_args!("{next} = add nuw i64 {base}, {width}"));
        let more = self.instruction(format_args!("icmp ult i64 {next}, %count"));
        let end = self.block();
        self.branch(more, start, done);
        let index = LlvmType { element: "i64", count: 1 };
        self.insert_phi(base_at, base, index, &[(Operand::Int(0), before), (next, end)]);
    }

    /// Emits a test of as many objects as there are lanes.
    fn emit_full_test(&mut self, done: Label) {
        self.begin_only_chunk();
        self.define_all_on(self.kernel.body.params[0]);
        self.emit_locals();
        self.emit_instances();
        self.emit_ops(&self.kernel.body.ops);
        if let Some(accepted) = self.accepted() {
            self.store_nearest_of_chunk(self.kernel.body.params[0], accepted);
        }
        self.jump(done);
    }

    /// Emits the only lane of a single call, which is on.
    fn emit_only_chunk(&mut self, done: Label) {
        self.begin_only_chunk();
        self.define(self.kernel.body.params[0], Operand::Bool(true));
        self.emit_chunk_body();
        self.jump(done);
    }

    pub fn begin_only_chunk(&mut self) {
        self.chunk.base = Some(Operand::Int(0));
    }

    /// Emits the body of a chunk whose mask is defined.
    pub fn emit_chunk_body(&mut self) {
        self.emit_locals();
        self.emit_instances();
        self.emit_ops(&self.kernel.body.ops);
        self.emit_outputs();
    }

    fn emit_chunk_loop(&mut self, done: Label) {
        if !self.kernel.keeps_nearest() {
            return self.emit_each_chunk(done);
        }
        self.begin_nearest();
        let finish = self.new_label();
        self.emit_each_chunk(finish);
        self.begin_block(finish);
        self.finish_nearest(done);
    }

    fn emit_each_chunk(&mut self, done: Label) {
        let (start, body) = (self.new_label(), self.new_label());
        let (skip, advance) = (self.new_label(), self.new_label());
        let width = self.width;
        let before = self.block();
        let (base, next) = (self.new_local(), self.new_local());
        self.chunk.base = Some(base);
        self.jump(start);
        self.begin_block(start);
        let first = self.begun;
        let base_at = self.here();
        self.insert_phi(
            base_at,
            base,
            LlvmType { element: "i64", count: 1 },
            &[(first, before), (next, advance)],
        );
        self.emit_mask(body, skip);
        self.emit_chunk_body();
        self.jump(advance);

        self.begin_block(skip);
        self.emit_skip();
        self.jump(advance);

        self.begin_block(advance);
        self.effect(format_args!("{next} = add nuw i64 {base}, {width}"));
        let more = self.instruction(format_args!("icmp ult i64 {next}, %count"));
        self.branch(more, start, done);
    }

    /// Emits the chunk's mask; begins the block `body` if any lane is on, else jumps to `skip`.
    fn emit_mask(&mut self, body: Label, skip: Label) {
        let width = self.width;
        let masks = self.pointer(PointerSource::Call, offsets::CALL_MASK);
        let unmasked = self.setup(format_args!("icmp eq ptr {masks}, null"));
        let param = self.kernel.body.params[0];
        if width == 1 {
            let masked = self.new_label();
            self.branch(unmasked, body, masked);
            self.begin_block(masked);
            let on = self.load_mask(masks);
            self.branch(on, body, skip);
            self.begin_block(body);
            return self.define(param, Operand::Bool(true));
        }
        let (partial, masked) = (self.new_label(), self.new_label());
        let base = self.chunk_base();
        let left = self.instruction(format_args!("sub nuw i64 %count, {base}"));
        let whole = self.instruction(format_args!("icmp uge i64 {left}, {width}"));
        let full = self.instruction(format_args!("and i1 {whole}, {unmasked}"));
        self.chunk.left = Some(left);
        self.chunk.full = Some(full);
        let start = self.block();
        self.branch(full, body, partial);

        self.begin_block(partial);
        let exists = self.emit_exists();
        let existing = self.crossing_bits(exists);
        self.branch(unmasked, body, masked);

        self.begin_block(masked);
        let asked = self.load_mask(masks);
        let ty = self.lanes("i1");
        let on = self.instruction(format_args!("and {ty} {asked}, {exists}"));
        let on_crossing = self.crossing_bits(on);
        let any = self.any_bit(on);
        self.branch(any, body, skip);

        self.begin_block(body);
        let (ty, all) = if self.values.masks_in_lanes {
            (self.lanes("i32"), self.constant_lanes("i32", Operand::Int(-1)))
        } else {
            (self.lanes("i1"), self.constant_lanes("i1", Operand::Bool(true)))
        };
        let incoming = [(all, start), (existing, partial), (on_crossing, masked)];
        let mask = self.phi(ty, &incoming);
        self.define_crossing(param, mask);
    }

    fn load_mask(&mut self, masks: Operand) -> Operand {
        let base = self.chunk_base();
        let ty = self.lanes("i32");
        let at = self.instruction(format_args!("getelementptr i32, ptr {masks}, i64 {base}"));
        let words = self.instruction(format_args!("load {ty}, ptr {at}, align 4"));
        self.bits_of_words(words)
    }

    /// Returns the mask of the lanes that have a ray.
    fn emit_exists(&mut self) -> Operand {
        let width = self.width;
        let left = self.chunk.left.expect("the chunk is begun");
        let left = self.instruction(format_args!("trunc i64 {left} to i32"));
        let left = self.splat_here("i32", left);
        let numbers: Vec<String> = (0..width).map(|lane| format!("i32 {lane}")).collect();
        let ty = self.lanes("i32");
        self.instruction(format_args!("icmp ugt {ty} {left}, <{}>", numbers.join(", ")))
    }

    fn crossing_bits(&mut self, bits: Operand) -> Operand {
        if self.values.masks_in_lanes { self.words_of_bits(bits) } else { bits }
    }

    // Outputs.

    fn accepted(&self) -> Option<Value> {
        self.kernel.accepted_output().map(|output| self.kernel.body.yields[output])
    }

    pub fn is_accepted(&self, output: KernelOutput) -> bool {
        self.kernel.variable(output.variable).variable.kind == VariableKind::Accepted
    }

    pub fn outputs(&self) -> impl Iterator<Item = (KernelOutput, Value)> {
        self.kernel.outputs.iter().copied().zip(self.kernel.body.yields.iter().copied())
    }

    fn emit_outputs(&mut self) {
        let mask = self.kernel.body.params[0];
        match self.accepted() {
            Some(accepted) if self.kernel.keeps_nearest() => self.keep_nearest(mask, accepted),
            Some(accepted) => self.emit_hit_outputs(mask, accepted),
            None if self.kernel.outputs.is_empty() => {}
            None if self.width == 1 || self.is_full() => self.store_outputs(Stored::All),
            None => {
                let (all, some, stored) = (self.new_label(), self.new_label(), self.new_label());
                let full = self.chunk.full.expect("the chunk is begun");
                self.prepare_outputs();
                self.branch(full, all, some);
                self.begin_block(all);
                self.store_outputs(Stored::All);
                self.jump(stored);
                self.begin_block(some);
                let bits = self.bits(mask);
                self.store_outputs(Stored::Where(bits));
                self.jump(stored);
                self.begin_block(stored);
            }
        }
    }

    /// Emits the outputs of a method that accepts hits: stored only in lanes that accept.
    fn emit_hit_outputs(&mut self, mask: Value, accepted: Value) {
        let (bits, words) = self.hits(mask, accepted);
        if self.stores_without_branch() {
            self.prepare_outputs();
            self.store_accepted(words);
            return self.store_outputs(Stored::Where(bits));
        }
        let (store, stored) = (self.new_label(), self.new_label());
        let any = match self.values.masks_in_lanes {
            true => self.any_word(words),
            false => self.any_bit(bits),
        };
        self.prepare_outputs();
        if self.callback.is_none() {
            self.store_accepted(words);
        }
        // Before the branch, since LLVM would derive the mask from its inverse if both were in one block.
        let kept = self.blends_with_memory().then(|| {
            let ty = self.lanes("i32");
            let ones = self.literal(ty, Operand::Int(-1));
            self.binary("xor", ty, words, ones)
        });
        self.branch(any, store, stored);
        self.begin_block(store);
        let stored_lanes = match kept {
            Some(kept) => Stored::Except(kept),
            None if self.width == 1 => Stored::All,
            None if self.values.masks_in_lanes => Stored::Where(self.bits_of_mask_words(words)),
            None => Stored::Where(bits),
        };
        self.store_outputs(stored_lanes);
        if let Some(callback) = self.callback {
            for (mark, word) in self.mark_words(callback.record) {
                let at = self.row_address(mark.row);
                self.store_some(stored_lanes, self.lanes("i32"), word, at);
            }
        }
        self.jump(stored);
        self.begin_block(stored);
    }

    /// Returns the lanes that are on and accept a hit, as bits and as words.
    pub fn hits(&mut self, mask: Value, accepted: Value) -> (Operand, Operand) {
        if self.values.masks_in_lanes {
            let (ty, accepted, on) = (self.lanes("i32"), self.words(accepted), self.words(mask));
            let words = self.instruction(format_args!("and {ty} {accepted}, {on}"));
            (self.bits_of_mask_words(words), words)
        } else {
            let (ty, accepted, on) = (self.lanes("i1"), self.bits(accepted), self.bits(mask));
            let bits = self.instruction(format_args!("and {ty} {accepted}, {on}"));
            (bits, self.words_of_bits(bits))
        }
    }

    /// True if the outputs of hits are stored even if no lane has one: a masked store takes as long as any other on
    /// targets with mask registers, and a branch that is predicted wrongly longer than several of them.
    fn stores_without_branch(&self) -> bool {
        let is_loop = self.callback.is_none() && self.width > 1;
        is_loop && self.module.target.mask_registers && self.outputs().count() <= MAX_UNCONDITIONAL
    }

    /// Splats uniform outputs before the branches that use them.
    fn prepare_outputs(&mut self) {
        let outputs: Vec<Value> = self.outputs().map(|(_, value)| value).collect();
        outputs.into_iter().for_each(|value| {
            self.crossing(value, true);
        });
    }

    /// Stores all outputs except the accepted one.
    fn store_outputs(&mut self, lanes: Stored) {
        let outputs: Vec<(KernelOutput, Value)> = self.outputs().collect();
        for (output, value) in outputs {
            if self.is_accepted(output) {
                continue;
            }
            let ty =
                self.lanes(memory_element(self.kernel.variable(output.variable).variable.scalar));
            let at = self.output_address(output);
            let new = self.memory_operand(value, true);
            self.store_some(lanes, ty, new, at);
        }
    }

    fn store_some(&mut self, lanes: Stored, ty: LlvmType, new: Operand, at: Operand) {
        let merged = match lanes {
            Stored::All => new,
            Stored::Where(bits) => {
                let old = self.load_to_merge(ty, at);
                self.select_lanes(bits, ty, new, old)
            }
            Stored::Except(kept) => return self.store_except(kept, ty, new, at),
        };
        self.effect(format_args!("store {ty} {merged}, ptr {at}, align 4"));
    }

    /// Stores the words of a mask to the accepted array; the words beyond the last ray are preserved.
    fn store_accepted(&mut self, words: Operand) {
        let ty = self.lanes("i32");
        let at = self.accepted_address();
        let Some(full) = self.chunk.full else {
            return self.effect(format_args!("store {ty} {words}, ptr {at}, align 4"));
        };
        let (all, some, stored) = (self.new_label(), self.new_label(), self.new_label());
        self.branch(full, all, some);
        self.begin_block(all);
        self.effect(format_args!("store {ty} {words}, ptr {at}, align 4"));
        self.jump(stored);
        self.begin_block(some);
        self.store_where_exists(at, words);
        self.jump(stored);
        self.begin_block(stored);
    }

    fn store_where_exists(&mut self, at: Operand, words: Operand) {
        let ty = self.lanes("i32");
        let exists = self.emit_exists();
        let old = self.load_to_merge(ty, at);
        let merged = self.select_lanes(exists, ty, words, old);
        self.effect(format_args!("store {ty} {merged}, ptr {at}, align 4"));
    }

    /// Loads the values to be stored back in inactive lanes. LLVM combines such a load, a select and a store into one
    /// masked store, which without mask registers is slower than the three on half of the machines (12 cycles on Zen
    /// 3). A volatile load prevents this.
    fn load_to_merge(&mut self, ty: LlvmType, at: Operand) -> Operand {
        let volatile = if self.values.masks_in_lanes { "volatile " } else { "" };
        self.instruction(format_args!("load {volatile}{ty}, ptr {at}, align 4"))
    }

    fn accepted_address(&mut self) -> Operand {
        let array = self.pointer(PointerSource::Call, offsets::CALL_ACCEPTED);
        let base = self.chunk_base();
        self.instruction(format_args!("getelementptr i32, ptr {array}, i64 {base}"))
    }

    /// Emits the code for a chunk without active rays.
    fn emit_skip(&mut self) {
        if self.accepted().is_none() || self.kernel.keeps_nearest() {
            return;
        }
        let at = self.accepted_address();
        if self.width == 1 {
            return self.effect(format_args!("store i32 0, ptr {at}, align 4"));
        }
        self.store_where_exists(at, Operand::Zero);
    }

    fn select_lanes(&mut self, bits: Operand, ty: LlvmType, a: Operand, b: Operand) -> Operand {
        let mask = self.lanes("i1");
        self.instruction(format_args!("select {mask} {bits}, {ty} {a}, {ty} {b}"))
    }
}
