//! The representation of values of packet code in LLVM text.
//!
//! A uniform value is a scalar. Where lanes are required it is splatted: once per call if the prologue computes it,
//! else at the first use, and again in regions where that splat is not visible.
//!
//! A mask has up to two forms: *bits*, `<W x i1>`, which instructions take and return, and on targets without mask
//! registers also *words*, `<W x i32>` of 0 and -1. On those targets LLVM keeps bits that live across blocks in a form
//! that costs several instructions each way. So words cross blocks, and each block converts them to bits again (a sign
//! test, which selects and mask tests absorb).

use std::fmt::Write;

use rtsl_ir::{Scalar, Value};
use rtsl_packet::Kernel;

use crate::emitter::Emitter;
use crate::negation::negated_values;
use crate::operand::{LlvmType, Operand, register_element};

/// The forms of one value emitted so far.
#[derive(Clone, Copy, Debug, Default)]
struct Forms {
    /// A uniform value, or lanes of numbers.
    plain: Option<Operand>,
    /// A uniform number splatted to all lanes.
    splat: Option<Operand>,
    /// The bits of a mask, and the block in which they may be used; any block on targets with mask registers.
    bits: Option<(Operand, u32)>,
    /// The words of a mask.
    words: Option<Operand>,
    in_prologue: bool,
}

/// The forms of all values.
pub struct Values {
    forms: Vec<Forms>,
    /// True if masks cross blocks as words.
    pub masks_in_lanes: bool,
    /// The number of blocks begun.
    epoch: u32,
    in_prologue: bool,
    /// Values whose splat is visible only in the open region and those nested in it.
    splatted: Vec<Value>,
    /// The prologue's negated floats, by the results.
    pub negated: std::collections::BTreeMap<Value, Value>,
    /// Splats of constants, by element type.
    constants: std::collections::BTreeMap<(&'static str, Operand), Operand>,
}

impl Values {
    pub fn new(kernel: &Kernel, masks_in_lanes: bool) -> Values {
        Values {
            forms: vec![Forms::default(); kernel.values.len()],
            masks_in_lanes,
            epoch: 0,
            in_prologue: false,
            splatted: Vec::new(),
            negated: negated_values(kernel),
            constants: Default::default(),
        }
    }

    pub fn begin_prologue(&mut self) {
        self.in_prologue = true;
    }

    pub fn end_prologue(&mut self) {
        self.in_prologue = false;
    }

    pub fn begin_block(&mut self) {
        self.epoch += 1;
    }

    /// Returns the position to which [`Values::end_region`] reverts.
    pub fn begin_region(&self) -> usize {
        self.splatted.len()
    }

    /// Removes the splats made in a region.
    pub fn end_region(&mut self, begin: usize) {
        for value in self.splatted.drain(begin..) {
            let forms = &mut self.forms[value.0 as usize];
            forms.splat = None;
            forms.words = None;
            forms.bits = None;
        }
    }

    fn forms(&self, value: Value) -> Forms {
        self.forms[value.0 as usize]
    }

    fn forms_mut(&mut self, value: Value) -> &mut Forms {
        &mut self.forms[value.0 as usize]
    }

    /// Returns the bits of a mask if they may be used in this block.
    fn fresh_bits(&self, value: Value) -> Option<Operand> {
        let (bits, epoch) = self.forms(value).bits?;
        (!self.masks_in_lanes || epoch == self.epoch).then_some(bits)
    }
}

impl Emitter<'_, '_> {
    // Definitions.

    /// Defines a value as `operand`, in register form: for a mask its bits.
    pub fn define(&mut self, value: Value, operand: Operand) {
        let ty = self.kernel.ty(value);
        if ty.lanes && ty.scalar == Scalar::Bool {
            return self.define_bits(value, operand);
        }
        let in_prologue = self.values.in_prologue;
        let forms = Forms { plain: Some(operand), in_prologue, ..Forms::default() };
        *self.values.forms_mut(value) = forms;
    }

    fn define_bits(&mut self, value: Value, bits: Operand) {
        let words = self.values.masks_in_lanes.then(|| self.words_of_bits(bits));
        let bits = Some((bits, self.values.epoch));
        *self.values.forms_mut(value) = Forms { bits, words, ..Forms::default() };
    }

    /// Defines a mask with all lanes on.
    pub fn define_all_on(&mut self, mask: Value) {
        if self.width == 1 {
            return self.define(mask, Operand::Bool(true));
        }
        let (element, on) = match self.values.masks_in_lanes {
            true => ("i32", Operand::Int(-1)),
            false => ("i1", Operand::Bool(true)),
        };
        let all = self.constant_lanes(element, on);
        self.define_crossing(mask, all);
    }

    /// Defines a value in the form in which values cross blocks.
    pub fn define_crossing(&mut self, value: Value, operand: Operand) {
        let ty = self.kernel.ty(value);
        if self.values.masks_in_lanes && ty.lanes && ty.scalar == Scalar::Bool {
            let forms = Forms { words: Some(operand), ..Forms::default() };
            *self.values.forms_mut(value) = forms;
        } else {
            self.define(value, operand);
        }
    }

    // Uses.

    /// Returns a uniform value.
    pub fn uniform(&self, value: Value) -> Operand {
        self.values.forms(value).plain.expect("a uniform value is defined before its use")
    }

    /// Returns a value as lanes if `lanes`, else as a uniform one; masks as bits.
    pub fn operand(&mut self, value: Value, lanes: bool) -> Operand {
        match (lanes, self.scalar(value)) {
            (false, _) => self.uniform(value),
            (true, Scalar::Bool) => self.bits(value),
            (true, _) => self.numbers(value),
        }
    }

    /// Returns numbers in lanes.
    fn numbers(&mut self, value: Value) -> Operand {
        let forms = self.values.forms(value);
        let plain = forms.plain.expect("a value is defined before its use");
        if self.is_lanes(value) || self.width == 1 {
            return plain;
        }
        if let Some(splat) = forms.splat {
            return splat;
        }
        let element = register_element(self.scalar(value));
        let negated = self.values.negated.get(&value).copied();
        let splat = match (plain, negated) {
            (_, Some(negated)) => {
                let (negated, ty) = (self.numbers(negated), self.lanes(element));
                self.splats(format_args!("fneg {ty} {negated}"))
            }
            (Operand::Local(_), None) if forms.in_prologue => self.splat_once(element, plain),
            (Operand::Local(_), None) => {
                self.values.splatted.push(value);
                self.splat_here(element, plain)
            }
            (constant, None) => return self.constant_lanes(element, constant),
        };
        self.values.forms_mut(value).splat = Some(splat);
        splat
    }

    /// Returns the bits of a mask, or of a uniform bool in all lanes.
    pub fn bits(&mut self, value: Value) -> Operand {
        if self.width == 1 && !self.is_lanes(value) {
            return self.uniform(value);
        }
        if let Some(bits) = self.values.fresh_bits(value) {
            return bits;
        }
        let bits = if self.values.masks_in_lanes {
            let words = self.words(value);
            self.bits_of_mask_words(words)
        } else {
            return self.splat_bits(value);
        };
        self.values.forms_mut(value).bits = Some((bits, self.values.epoch));
        bits
    }

    /// Returns the words of a mask, or of a uniform bool in all lanes.
    pub fn words(&mut self, value: Value) -> Operand {
        if let Some(words) = self.values.forms(value).words {
            return words;
        }
        if self.is_lanes(value) || self.width == 1 || !self.values.masks_in_lanes {
            let bits = self.bits(value);
            return self.words_of_bits(bits);
        }
        let condition = self.uniform(value);
        let words = match condition {
            Operand::Bool(known) => {
                return self.constant_lanes("i32", Operand::Int(-i32::from(known)));
            }
            _ if self.values.forms(value).in_prologue => {
                let word = self.splats(format_args!("sext i1 {condition} to i32"));
                self.splat_once("i32", word)
            }
            _ => {
                self.values.splatted.push(value);
                let word = self.instruction(format_args!("sext i1 {condition} to i32"));
                self.splat_here("i32", word)
            }
        };
        self.values.forms_mut(value).words = Some(words);
        words
    }

    /// Returns a uniform bool in all bits.
    fn splat_bits(&mut self, value: Value) -> Operand {
        let condition = self.uniform(value);
        let (width, ty) = (self.width, self.lanes("i1"));
        let all = self.instruction(format_args!("sext i1 {condition} to i{width}"));
        self.instruction(format_args!("bitcast i{width} {all} to {ty}"))
    }

    /// Returns the form in which masks cross blocks; for other values the only form.
    pub fn crossing(&mut self, value: Value, lanes: bool) -> Operand {
        let mask = lanes && self.scalar(value) == Scalar::Bool;
        if mask && self.values.masks_in_lanes {
            return self.words(value);
        }
        self.operand(value, lanes)
    }

    /// Returns the type of [`Emitter::crossing`].
    pub fn crossing_type(&self, value: Value) -> LlvmType {
        let ty = self.kernel.ty(value);
        if ty.lanes && ty.scalar == Scalar::Bool && self.values.masks_in_lanes {
            return self.lanes("i32");
        }
        self.register_type(value)
    }

    // Masks.

    /// Converts bits to lanes of 0 and -1.
    pub fn words_of_bits(&mut self, bits: Operand) -> Operand {
        let (from, to) = (self.lanes("i1"), self.lanes("i32"));
        if !self.values.masks_in_lanes {
            return self.instruction(format_args!("sext {from} {bits} to {to}"));
        }
        // A `sext` in two steps, which LLVM combines during instruction selection but not before: otherwise it would
        // propagate the bits behind the words from other blocks.
        let ones = self.instruction(format_args!("zext {from} {bits} to {to}"));
        self.instruction(format_args!("sub {to} zeroinitializer, {ones}"))
    }

    /// Converts lanes of 0 and -1 to bits: a test of signs, which blends and mask tests absorb.
    pub fn bits_of_mask_words(&mut self, words: Operand) -> Operand {
        let ty = self.lanes("i32");
        let zero = if ty.is_vector() { Operand::Zero } else { Operand::Int(0) };
        self.instruction(format_args!("icmp slt {ty} {words}, {zero}"))
    }

    /// Converts lanes of 0 and any other word to bits.
    pub fn bits_of_words(&mut self, words: Operand) -> Operand {
        let ty = self.lanes("i32");
        let zero = if ty.is_vector() { Operand::Zero } else { Operand::Int(0) };
        self.instruction(format_args!("icmp ne {ty} {words}, {zero}"))
    }

    /// Converts a mask to the bits of an i32, lane 0 the lowest.
    pub fn bit_set(&mut self, bits: Operand) -> Operand {
        let width = self.width;
        let small = self.integer_of_bits(bits);
        self.instruction(format_args!("zext i{width} {small} to i32"))
    }

    /// Converts the bits to an integer of W bits.
    fn integer_of_bits(&mut self, bits: Operand) -> Operand {
        let (width, ty) = (self.width, self.lanes("i1"));
        if width == 1 {
            return bits;
        }
        self.instruction(format_args!("bitcast {ty} {bits} to i{width}"))
    }

    /// Converts a bit set in an i32 to a mask. Without mask registers each lane tests its bit in a copy, since LLVM
    /// scalarises other sequences.
    pub fn bits_of_set(&mut self, set: Operand) -> Operand {
        let (width, ty) = (self.width, self.lanes("i1"));
        if self.values.masks_in_lanes {
            let words = self.lanes("i32");
            let copies = self.splat_here("i32", set);
            let own: Vec<String> = (0..width).map(|lane| format!("i32 {}", 1 << lane)).collect();
            let own = own.join(", ");
            let tested = self.instruction(format_args!("and {words} {copies}, <{own}>"));
            return self.instruction(format_args!("icmp ne {words} {tested}, zeroinitializer"));
        }
        let small = self.instruction(format_args!("trunc i32 {set} to i{width}"));
        if width == 1 {
            return small;
        }
        self.instruction(format_args!("bitcast i{width} {small} to {ty}"))
    }

    /// Returns true if any lane of a mask is on. Words of several vectors are combined first, since LLVM would pack
    /// them to bytes.
    pub fn any_lane(&mut self, mask: Value) -> Operand {
        if self.is_one_vector() || !self.values.masks_in_lanes {
            let bits = self.bits(mask);
            return self.any_bit(bits);
        }
        let words = self.words(mask);
        self.any_word(words)
    }

    /// Like [`Emitter::any_lane`], for words.
    pub fn any_word(&mut self, words: Operand) -> Operand {
        let (ty, words) = self.in_one_vector(self.lanes("i32"), words);
        let (bit, count) = (ty.of("i1"), ty.count);
        let bits = self.instruction(format_args!("icmp slt {ty} {words}, zeroinitializer"));
        let set = self.instruction(format_args!("bitcast {bit} {bits} to i{count}"));
        self.instruction(format_args!("icmp ne i{count} {set}, 0"))
    }

    /// Returns the disjunction of the vectors of a mask.
    fn in_one_vector(&mut self, mut ty: LlvmType, mut mask: Operand) -> (LlvmType, Operand) {
        while ty.count > self.module.target.vector_lanes {
            let half = LlvmType { count: ty.count / 2, ..ty };
            let [low, high] = [0, half.count].map(|first| {
                let lanes = (first..first + half.count).map(|lane| format!("i32 {lane}"));
                let lanes = lanes.collect::<Vec<_>>().join(", ");
                self.instruction(format_args!(
                    "shufflevector {ty} {mask}, {ty} poison, {} <{lanes}>",
                    half.of("i32")
                ))
            });
            mask = self.instruction(format_args!("or {half} {low}, {high}"));
            ty = half;
        }
        (ty, mask)
    }

    /// True if the lanes of a chunk fit in one register.
    fn is_one_vector(&self) -> bool {
        self.width <= self.module.target.vector_lanes
    }

    /// Returns true if any bit is on.
    pub fn any_bit(&mut self, bits: Operand) -> Operand {
        if self.width == 1 {
            return bits;
        }
        if self.splits_masks() {
            let (ty, bits) = self.in_one_vector(self.lanes("i1"), bits);
            let set = self.instruction(format_args!("bitcast {ty} {bits} to i{}", ty.count));
            return self.instruction(format_args!("icmp ne i{} {set}, 0", ty.count));
        }
        let (width, small) = (self.width, self.integer_of_bits(bits));
        self.instruction(format_args!("icmp ne i{width} {small}, 0"))
    }

    /// Returns the index of the lowest bit that is on, i32; an arbitrary lane if none is.
    pub fn first_lane(&mut self, bits: Operand) -> Operand {
        let set = self.bit_set(bits);
        self.module.declare("i32 @llvm.cttz.i32(i32, i1 immarg)".to_owned());
        let lane = self.instruction(format_args!("call i32 @llvm.cttz.i32(i32 {set}, i1 false)"));
        self.instruction(format_args!("and i32 {lane}, {}", self.width - 1))
    }

    /// True if a logical operation on these masks is faster on words. LLVM would pack the bits of several vectors to
    /// the bytes of one.
    pub fn prefers_words(&self, masks: &[Value]) -> bool {
        let from_elsewhere = |mask: &Value| self.values.fresh_bits(*mask).is_none();
        self.values.masks_in_lanes && (!self.is_one_vector() || masks.iter().any(from_elsewhere))
    }

    // Splats.

    /// Returns a constant in all lanes.
    pub fn constant_lanes(&mut self, element: &'static str, constant: Operand) -> Operand {
        if self.width == 1 {
            return constant;
        }
        if constant.is_zero() {
            return Operand::Zero;
        }
        if let Some(splat) = self.values.constants.get(&(element, constant)) {
            return *splat;
        }
        let splat = self.splat_once(element, constant);
        self.values.constants.insert((element, constant), splat);
        splat
    }

    /// Splats a value that the open region computed.
    pub fn splat_here(&mut self, element: &'static str, operand: Operand) -> Operand {
        let ty = self.lanes(element);
        if !ty.is_vector() {
            return operand;
        }
        let one =
            self.instruction(format_args!("insertelement {ty} poison, {element} {operand}, i64 0"));
        let order = self.lanes("i32");
        self.instruction(format_args!(
            "shufflevector {ty} {one}, {ty} poison, {order} zeroinitializer"
        ))
    }

    /// Splats a value that is known before the first chunk.
    fn splat_once(&mut self, element: &'static str, operand: Operand) -> Operand {
        let (ty, order) = (self.lanes(element), self.lanes("i32"));
        let one =
            self.splats(format_args!("insertelement {ty} poison, {element} {operand}, i64 0"));
        self.splats(format_args!("shufflevector {ty} {one}, {ty} poison, {order} zeroinitializer"))
    }

    fn splats(&mut self, text: std::fmt::Arguments<'_>) -> Operand {
        let local = self.new_local();
        let _ = writeln!(self.pieces.splats, "  {local} = {text}");
        local
    }
}
