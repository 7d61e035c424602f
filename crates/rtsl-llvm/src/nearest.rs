//! The nearest hit of a call in the leaf mode.
//!
//! Each lane keeps its nearest hit from chunk to chunk; after the last chunk the nearest of all lanes is determined,
//! and its outputs are stored. The lanes keep their hits in allocas, which LLVM promotes to registers.
//!
//! A lane without a hit has the index -1 and the key NaN, which every key precedes: the key of a hit is its distance,
//! with infinity for NaN. Within a lane objects come in ascending order, so a later one must be strictly nearer; among
//! lanes ties are broken by the index.
//!
//! Where all objects are in one chunk, nothing is kept, and the first of the lanes with the least key is the nearest.

use rtsl_abi::offsets;
use rtsl_ir::Value;
use rtsl_packet::kernel::KernelOutput;

use crate::emitter::Emitter;
use crate::operand::{Label, LlvmType, Operand, memory_element};

const INFINITY: Operand = Operand::Float(f32::INFINITY.to_bits());
const NAN: Operand = Operand::Float(f32::NAN.to_bits());

/// The nearest hits of the lanes: addresses of W words each.
#[derive(Clone, Default)]
pub struct Nearest {
    key: Option<Operand>,
    /// The index of the first object of the hit's chunk.
    base: Option<Operand>,
    outputs: Vec<Kept>,
}

/// The stored value of an output.
#[derive(Clone, Copy)]
struct Kept {
    output: KernelOutput,
    value: Value,
    at: Operand,
}

impl Emitter<'_, '_> {
    /// Initialises the lanes before the first chunk: no lane has a hit.
    pub fn begin_nearest(&mut self) {
        let (key, base) = (self.kept_words("float"), self.kept_words("i32"));
        let (nan, none) =
            (self.constant_lanes("float", NAN), self.constant_lanes("i32", Operand::Int(-1)));
        self.store_kept("float", nan, key);
        self.store_kept("i32", none, base);
        let outputs = self.outputs().filter(|(output, _)| !self.is_accepted(*output));
        let outputs: Vec<(KernelOutput, Value)> = outputs.collect();
        let kept = outputs.into_iter().map(|(output, value)| {
            let at = self.kept_words(self.output_element(output));
            Kept { output, value, at }
        });
        let outputs = kept.collect();
        self.nearest = Nearest { key: Some(key), base: Some(base), outputs };
    }

    /// Updates the lanes after a chunk: those with a nearer hit keep its outputs.
    pub fn keep_nearest(&mut self, mask: Value, accepted: Value) {
        let Nearest { key, base, outputs } = self.nearest.clone();
        let (Some(key_at), Some(base_at)) = (key, base) else { return };
        let key = self.hit_key();
        let old = self.load_kept("float", key_at);
        let (floats, bit) = (self.lanes("float"), self.lanes("i1"));
        let precedes = self.instruction(format_args!("fcmp ult {floats} {key}, {old}"));
        let hits = self.hits(mask, accepted).0;
        let nearer = self.instruction(format_args!("and {bit} {hits}, {precedes}"));
        self.keep_where(nearer, "float", key, key_at);
        let base = self.chunk_base();
        let base = self.instruction(format_args!("trunc i64 {base} to i32"));
        let base = self.splat_here("i32", base);
        self.keep_where(nearer, "i32", base, base_at);
        for Kept { output, value, at } in outputs {
            let new = self.memory_operand(value, true);
            self.keep_where(nearer, self.output_element(output), new, at);
        }
    }

    /// After the last chunk, stores the outputs of the nearest hit of all lanes, or the previous values if there is
    /// none, and jumps to `done`.
    pub fn finish_nearest(&mut self, done: Label) {
        let Nearest { key, base, outputs } = self.nearest.clone();
        let (Some(key_at), Some(base_at)) = (key, base) else { return };
        let (words, bit) = (self.lanes("i32"), self.lanes("i1"));
        let bases = self.load_kept("i32", base_at);
        let minus_one = self.constant_lanes("i32", Operand::Int(-1));
        let hits = self.instruction(format_args!("icmp sgt {words} {bases}, {minus_one}"));
        let keys = self.load_kept("float", key_at);
        let nearest = self.nearest_lanes(hits, keys);
        let numbers = self.lane_numbers(1);
        let objects = self.instruction(format_args!("add {words} {bases}, {numbers}"));
        let candidates = self.instruction(format_args!(
            "select {bit} {nearest}, {words} {objects}, {words} {minus_one}"
        ));
        let object = self.least_word(candidates);
        let any = self.instruction(format_args!("icmp ne i32 {object}, -1"));
        self.store_nearest(object, any);
        let lane = self.width - 1;
        let lane = self.instruction(format_args!("and i32 {object}, {lane}"));
        for Kept { output, value: _, at } in outputs {
            let element = self.output_element(output);
            let lanes = self.load_kept(element, at);
            self.store_if(any, output, lanes, lane);
        }
        self.jump(done);
    }

    /// Stores the nearest hit of the only chunk and its outputs, or the previous values if there is none.
    pub fn store_nearest_of_chunk(&mut self, mask: Value, accepted: Value) {
        let (keys, hits) = (self.hit_key(), self.hits(mask, accepted).0);
        let nearest = self.nearest_lanes(hits, keys);
        let (any, lane) = (self.any_bit(nearest), self.first_lane(nearest));
        let none = offsets::NO_OBJECT as i32;
        let object = self.instruction(format_args!("select i1 {any}, i32 {lane}, i32 {none}"));
        self.store_nearest(object, any);
        let outputs: Vec<_> = self.outputs().filter(|(it, _)| !self.is_accepted(*it)).collect();
        for (output, value) in outputs {
            let lanes = self.memory_operand(value, true);
            self.store_if(any, output, lanes, lane);
        }
    }

    /// Stores one lane of an output of the ray if a condition holds.
    fn store_if(&mut self, any: Operand, output: KernelOutput, lanes: Operand, lane: Operand) {
        let element = self.output_element(output);
        let word = self.extract(self.lanes(element), lanes, lane);
        let array = self.output_array(output);
        let old = self.load(self.vector(element, false), array);
        let word =
            self.instruction(format_args!("select i1 {any}, {element} {word}, {element} {old}"));
        self.effect(format_args!("store {element} {word}, ptr {array}, align 4"));
    }

    /// Returns the distance of each lane's hit, at most infinity; the same for all if the kernel has no such output.
    fn hit_key(&mut self) -> Operand {
        let Some(output) = self.kernel.distance_output() else {
            return self.constant_lanes("float", Operand::Float(0));
        };
        let distance = self.operand(self.kernel.body.yields[output], true);
        let (floats, bit) = (self.lanes("float"), self.lanes("i1"));
        let infinity = self.constant_lanes("float", INFINITY);
        let is_less = self.instruction(format_args!("fcmp olt {floats} {distance}, {infinity}"));
        self.instruction(format_args!(
            "select {bit} {is_less}, {floats} {distance}, {floats} {infinity}"
        ))
    }

    /// Returns the lanes with a hit that have the least key.
    fn nearest_lanes(&mut self, hits: Operand, keys: Operand) -> Operand {
        let (floats, bit) = (self.lanes("float"), self.lanes("i1"));
        let infinity = self.constant_lanes("float", INFINITY);
        let keys = self
            .instruction(format_args!("select {bit} {hits}, {floats} {keys}, {floats} {infinity}"));
        let mut least = keys;
        let mut distance = self.width / 2;
        while distance > 0 {
            let order = (0..self.width).map(|lane| format!("i32 {}", lane ^ distance));
            let order = order.collect::<Vec<_>>().join(", ");
            let (ty, indices) = (floats, self.lanes("i32"));
            let other = self.instruction(format_args!(
                "shufflevector {ty} {least}, {ty} poison, {indices} <{order}>"
            ));
            let is_less = self.instruction(format_args!("fcmp olt {ty} {least}, {other}"));
            least = self
                .instruction(format_args!("select {bit} {is_less}, {ty} {least}, {ty} {other}"));
            distance /= 2;
        }
        let equal = self.instruction(format_args!("fcmp oeq {floats} {keys}, {least}"));
        self.instruction(format_args!("and {bit} {hits}, {equal}"))
    }

    /// Returns the least word, unsigned.
    fn least_word(&mut self, lanes: Operand) -> Operand {
        let ty = self.lanes("i32");
        if !ty.is_vector() {
            return lanes;
        }
        let name = format!("llvm.vector.reduce.umin.{}", ty.suffix());
        self.intrinsic(&name, ty.one(), &[(ty, lanes)])
    }

    // Memory.

    fn kept_words(&mut self, element: &'static str) -> Operand {
        let ty = self.lanes(element);
        self.alloca(&ty.to_string(), 64)
    }

    fn load_kept(&mut self, element: &'static str, at: Operand) -> Operand {
        let ty = self.lanes(element);
        self.instruction(format_args!("load {ty}, ptr {at}, align {}", ty.count * 4))
    }

    fn store_kept(&mut self, element: &'static str, lanes: Operand, at: Operand) {
        let ty = self.lanes(element);
        self.effect(format_args!("store {ty} {lanes}, ptr {at}, align {}", ty.count * 4));
    }

    fn keep_where(&mut self, bits: Operand, element: &'static str, new: Operand, at: Operand) {
        let (ty, bit) = (self.lanes(element), self.lanes("i1"));
        let old = self.load_kept(element, at);
        let kept = self.instruction(format_args!("select {bit} {bits}, {ty} {new}, {ty} {old}"));
        self.store_kept(element, kept, at);
    }

    /// Extracts one lane.
    fn extract(&mut self, ty: LlvmType, lanes: Operand, lane: Operand) -> Operand {
        if !ty.is_vector() {
            return lanes;
        }
        self.instruction(format_args!("extractelement {ty} {lanes}, i32 {lane}"))
    }

    fn output_element(&self, output: KernelOutput) -> &'static str {
        memory_element(self.kernel.variable(output.variable).variable.scalar)
    }
}
