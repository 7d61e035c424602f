//! Functions for a host's packets: one chunk, whose rays, mask and instance are located by a
//! [record](rtsl_abi::RayRecord).

use rtsl_abi::{Mark, MarkWord, RayRecord, offsets};
use rtsl_packet::Kernel;

use crate::emitter::{Emitter, PointerSource};
use crate::operand::{Label, LlvmType, Operand};

/// A kernel to be called with a record, which [fits](Kernel::check_record) it.
#[derive(Clone, Copy)]
pub struct Callback<'a> {
    /// The kernel.
    pub kernel: &'a Kernel,
    /// The record.
    pub record: &'a RayRecord,
    /// The stride between the blocks of instances, in bytes.
    pub block_bytes: u32,
}

const WORD: LlvmType = LlvmType { element: "i32", count: 1 };

impl Emitter<'_, '_> {
    /// Returns the record's pointer that corresponds to one of a call.
    pub fn pointer_of_record(
        &mut self,
        callback: Callback<'_>,
        source: PointerSource,
        offset: u32,
    ) -> Operand {
        let record = callback.record;
        match (source, offset) {
            (PointerSource::Rays, _) => self.argument("ptr", record.rays),
            (PointerSource::State, offset) => {
                let row = record.rows[&(offset / 8)];
                self.row_address(row)
            }
            (PointerSource::Call, offsets::CALL_INSTANCE) => self.instance_address(callback),
            (source, offset) => unreachable!("{source:?} {offset} is nothing that records have"),
        }
    }

    /// Returns the function's entry, which skips the body if no ray is active. The mask is defined from there on. The
    /// remaining code is one block, which LLVM optimises better than two.
    pub fn check_mask(&mut self, callback: Callback<'_>, start: Label, done: Label) -> String {
        let mask = self.kernel.body.params[0];
        let Some(offset) = callback.record.mask else {
            self.define_all_on(mask);
            self.jump(start);
            return self.take_text();
        };
        let at = self.offset(Operand::Call, offset);
        let words = self.instruction(format_args!("load ptr, ptr {at}, align 8"));
        let words = self.load(self.lanes("i32"), words);
        let bits = self.bits_of_words(words);
        let any = self.any_bit(bits);
        match self.width {
            // The only lane is on in the body, which is entered only then.
            1 => self.define(mask, Operand::Bool(true)),
            _ => self.define(mask, bits),
        }
        self.branch(any, start, done);
        self.take_text()
    }

    /// Emits the only chunk, from the end of the prologue to the jump to `done`.
    pub fn emit_packet(&mut self, done: Label) {
        self.begin_only_chunk();
        self.emit_chunk_body();
        self.jump(done);
    }

    /// Returns the words of the record's marks, in lanes.
    pub fn mark_words(&mut self, record: &RayRecord) -> Vec<(Mark, Operand)> {
        let word = |emitter: &mut Self, mark: &Mark| {
            let word = match mark.word {
                MarkWord::Constant(bits) => {
                    return emitter.constant_lanes("i32", Operand::Int(bits as i32));
                }
                MarkWord::Argument(offset) => {
                    let at = emitter.offset(Operand::Call, offset);
                    emitter.load(WORD, at)
                }
                MarkWord::Behind { pointer, offset } => {
                    let at = emitter.offset(Operand::Call, pointer);
                    let pointer = emitter.instruction(format_args!("load ptr, ptr {at}, align 8"));
                    let at = emitter.offset(pointer, offset);
                    emitter.load(WORD, at)
                }
            };
            emitter.splat_here("i32", word)
        };
        record.marks.iter().map(|mark| (*mark, word(self, mark))).collect()
    }

    /// Returns the address of a row.
    pub fn row_address(&mut self, row: u32) -> Operand {
        let rays = self.pointer(PointerSource::Rays, 0);
        let bytes = u64::from(row) * u64::from(self.width) * 4;
        self.setup(format_args!("getelementptr i8, ptr {rays}, i64 {bytes}"))
    }

    fn instance_address(&mut self, callback: Callback<'_>) -> Operand {
        let Callback { kernel: _, record, block_bytes } = callback;
        let first = self.argument("ptr", record.instances);
        let Some(number) = record.number else { return first };
        let number = self.argument("i32", number);
        let number = self.setup(format_args!("zext i32 {number} to i64"));
        let bytes = self.setup(format_args!("mul nuw i64 {number}, {block_bytes}"));
        self.setup(format_args!("getelementptr i8, ptr {first}, i64 {bytes}"))
    }

    /// Loads a value from the argument.
    fn argument(&mut self, ty: &str, offset: u32) -> Operand {
        let at = self.setup(format_args!("getelementptr i8, ptr %call, i64 {offset}"));
        let align = if ty == "ptr" { 8 } else { 4 };
        self.setup(format_args!("load {ty}, ptr {at}, align {align}"))
    }
}
