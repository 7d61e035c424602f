//! Objects in blocks: their addresses, loads of their words, and the entries of buffers.
//!
//! In the modes packet, common origin and single the call has the address of its one object. In the leaf mode a chunk's
//! objects are consecutive: a vector of a word is one load for each block. In the stream mode each lane has a separate
//! address.

use rtsl_abi::{CallMode, offsets};
use rtsl_ir::{Index, VariableId, VariableKind};
use rtsl_packet::kernel::KernelVariable;

use crate::emitter::{Emitter, PointerSource};
use crate::memory::Buffer;
use crate::module::ZERO_WORD;
use crate::operand::{LlvmType, Operand, memory_element};

/// The stride between the words of an object, in bytes.
const ROW: u32 = offsets::OBJECTS_IN_BLOCK * 4;

impl Emitter<'_, '_> {
    // The objects of a chunk.

    /// Finds the objects of the chunk if they differ from lane to lane, and their buffers.
    pub fn emit_instances(&mut self) {
        if !self.kernel.variables.iter().any(|variable| variable.varies && variable.of_objects) {
            return;
        }
        self.objects = match self.kernel.mode {
            CallMode::Stream => Some(self.objects_of_lanes()),
            CallMode::Leaf => Some(self.objects_of_chunk()),
            CallMode::Packet | CallMode::CommonOrigin | CallMode::Single => return,
        };
        for (number, variable) in self.kernel.variables.iter().enumerate() {
            if variable.variable.kind == VariableKind::Buffer && variable.varies {
                let buffer = self.buffer_of_lanes(variable);
                self.buffers.buffers.insert(number as u32, buffer);
            }
        }
    }

    /// Returns the size of a block of objects, in bytes.
    pub fn block_bytes(&self) -> u32 {
        self.kernel.object_words.unwrap_or(0) * ROW
    }

    /// Returns the addresses of the rays' objects.
    fn objects_of_lanes(&mut self) -> Operand {
        let indices = self.pointer(PointerSource::Call, offsets::CALL_INDEX);
        let objects = self.pointer(PointerSource::Call, offsets::CALL_OBJECTS);
        let base = self.chunk_base();
        let ty = self.lanes("i32");
        let at = self.instruction(format_args!("getelementptr i32, ptr {indices}, i64 {base}"));
        let numbers = self.load(ty, at);
        self.object_numbers = Some(numbers);
        let numbers = self.numbers_of_active(ty, numbers);
        let wide = self.lanes("i64");
        let numbers = self.instruction(format_args!("zext {ty} {numbers} to {wide}"));
        let offsets = self.object_offsets(wide, numbers);
        self.instruction(format_args!("getelementptr i8, ptr {objects}, {wide} {offsets}"))
    }

    /// Returns the address of the chunk's first object.
    fn objects_of_chunk(&mut self) -> Operand {
        let objects = self.pointer(PointerSource::Call, offsets::CALL_OBJECTS);
        let (index, base) = (LlvmType { element: "i64", count: 1 }, self.chunk_base());
        let offset = if self.width.is_multiple_of(offsets::OBJECTS_IN_BLOCK) {
            let bytes = self.block_bytes() / offsets::OBJECTS_IN_BLOCK;
            self.instruction(format_args!("mul nuw {index} {base}, {bytes}"))
        } else {
            self.object_offsets(index, base)
        };
        self.instruction(format_args!("getelementptr i8, ptr {objects}, i64 {offset}"))
    }

    /// Returns the offsets of the objects with these indices from the first, in bytes.
    fn object_offsets(&mut self, ty: LlvmType, numbers: Operand) -> Operand {
        let shift = offsets::OBJECTS_IN_BLOCK.trailing_zeros();
        let [shift, last, bytes, two] =
            [shift, offsets::OBJECTS_IN_BLOCK - 1, self.block_bytes(), 2]
                .map(|number| self.same(ty, number));
        let blocks = self.instruction(format_args!("lshr {ty} {numbers}, {shift}"));
        let blocks = self.instruction(format_args!("mul nuw {ty} {blocks}, {bytes}"));
        let variables = self.instruction(format_args!("and {ty} {numbers}, {last}"));
        let variables = self.instruction(format_args!("shl {ty} {variables}, {two}"));
        self.instruction(format_args!("add {ty} {blocks}, {variables}"))
    }

    /// Replaces the object indices of inactive lanes, which are arbitrary, by that of an active one.
    fn numbers_of_active(&mut self, ty: LlvmType, numbers: Operand) -> Operand {
        if !ty.is_vector() || self.is_full() {
            return numbers;
        }
        let mask = self.kernel.body.params[0];
        let bits = self.bits(mask);
        let lane = self.first_lane(bits);
        let first = self.instruction(format_args!("extractelement {ty} {numbers}, i32 {lane}"));
        let first = self.splat_here("i32", first);
        let bit = ty.of("i1");
        self.instruction(format_args!("select {bit} {bits}, {ty} {numbers}, {ty} {first}"))
    }

    // Words.

    /// Returns the address of a word of the objects: of one, of each lane's, or of the chunk's first.
    fn object_word(&mut self, word: u32) -> (Operand, LlvmType) {
        let (objects, ty) = match self.kernel.mode {
            CallMode::Packet | CallMode::CommonOrigin | CallMode::Single => {
                let object = self.pointer(PointerSource::Call, offsets::CALL_OBJECTS);
                (object, self.vector("ptr", false))
            }
            CallMode::Leaf => (self.found_objects(), self.vector("ptr", false)),
            CallMode::Stream => (self.found_objects(), self.lanes("ptr")),
        };
        let offset = word * ROW;
        if offset == 0 {
            return (objects, ty);
        }
        (self.instruction(format_args!("getelementptr i8, {ty} {objects}, i64 {offset}")), ty)
    }

    fn found_objects(&self) -> Operand {
        self.objects.expect("objects are found at the chunk's start")
    }

    /// Loads a word of the objects in its memory form.
    fn load_object_word(&mut self, element: &'static str, word: u32) -> Operand {
        if let Some((blocks, numbers)) = self.few_blocks().zip(self.object_numbers) {
            return self.choose_word(element, word, blocks, numbers);
        }
        let (at, pointers) = self.object_word(word);
        match self.kernel.mode {
            CallMode::Leaf => self.load_row(element, at),
            CallMode::Packet | CallMode::CommonOrigin | CallMode::Stream | CallMode::Single => {
                self.gather(pointers.of(element), at)
            }
        }
    }

    /// Returns the number of blocks of objects if they are few, and the target has instructions that choose among so
    /// many words by lane: on Zen 5 such a choice is one operation, a gather of 16 lanes takes 40.
    fn few_blocks(&self) -> Option<u32> {
        let chooses = self.width >= 8 && self.width <= self.module.target.permuted_lanes;
        self.kernel.object_blocks.filter(|_| chooses)
    }

    /// Chooses a word of the lanes' objects by their numbers among those of all objects in so many blocks.
    fn choose_word(
        &mut self,
        element: &'static str,
        word: u32,
        blocks: u32,
        numbers: Operand,
    ) -> Operand {
        let objects = self.pointer(PointerSource::Call, offsets::CALL_OBJECTS);
        let at = self.offset(objects, word * ROW);
        let row = LlvmType { element, count: offsets::OBJECTS_IN_BLOCK };
        let first = self.instruction(format_args!("load {row}, ptr {at}, align 32"));
        let second = match blocks {
            1 => first,
            _ => {
                let at = self.offset(at, self.block_bytes());
                self.instruction(format_args!("load {row}, ptr {at}, align 32"))
            }
        };
        if self.width == 16 {
            let rows = self.join_rows(row, first, second);
            return self.permute(LlvmType { count: 16, ..row }, rows, numbers);
        }
        let of_first = self.permute(row, first, numbers);
        if blocks == 1 {
            return of_first;
        }
        let of_second = self.permute(row, second, numbers);
        let (words, bits) = (row.of("i32"), row.of("i1"));
        let end = self.same(words, offsets::OBJECTS_IN_BLOCK);
        let is_first = self.instruction(format_args!("icmp ult {words} {numbers}, {end}"));
        self.instruction(format_args!(
            "select {bits} {is_first}, {row} {of_first}, {row} {of_second}"
        ))
    }

    /// Returns for each lane that lane of a vector whose number is given, modulo the lanes.
    fn permute(&mut self, ty: LlvmType, vector: Operand, numbers: Operand) -> Operand {
        let name = match (ty.count, ty.element) {
            (8, "float") => "llvm.x86.avx2.permps",
            (8, _) => "llvm.x86.avx2.permd",
            (_, "float") => "llvm.x86.avx512.permvar.sf.512",
            (..) => "llvm.x86.avx512.permvar.si.512",
        };
        let words = ty.of("i32");
        self.module.declare(format!("{ty} @{name}({ty}, {words})"));
        self.instruction(format_args!("call {ty} @{name}({ty} {vector}, {words} {numbers})"))
    }

    /// Loads a word of the chunk's objects, from its address in the first one: one load for each block.
    fn load_row(&mut self, element: &'static str, at: Operand) -> Operand {
        let ty = self.lanes(element);
        let block = LlvmType { count: ty.count.min(offsets::OBJECTS_IN_BLOCK), ..ty };
        let align = block.count * 4;
        let bytes = self.block_bytes();
        let mut row = None;
        for number in 0..ty.count / block.count {
            let at = self.offset(at, number * bytes);
            let next = self.instruction(format_args!("load {block}, ptr {at}, align {align}"));
            row = Some(match row {
                None => next,
                Some(row) => self.join_rows(block, row, next),
            });
        }
        row.expect("a chunk has lanes")
    }

    /// Concatenates two vectors of a type; at most two blocks, since no chunk of the leaf mode has more lanes.
    fn join_rows(&mut self, ty: LlvmType, row: Operand, next: Operand) -> Operand {
        let count = 2 * ty.count;
        let order = (0..count).map(|lane| format!("i32 {lane}")).collect::<Vec<_>>().join(", ");
        self.instruction(format_args!(
            "shufflevector {ty} {row}, {ty} {next}, <{count} x i32> <{order}>"
        ))
    }

    pub fn load_of_objects(&mut self, id: VariableId, index: Index) -> Operand {
        let variable = self.kernel.variable(id);
        let element = memory_element(variable.variable.scalar);
        let location = variable.location;
        let index = match index {
            Index::Constant(index) => return self.load_object_word(element, location + index),
            Index::Dynamic(index) => index,
        };
        let (index, by_lane) = self.clamp_index(index, id);
        let (at, pointers) = self.object_word(location);
        let words = self.vector("i32", by_lane);
        let shift = self.same(words, offsets::OBJECTS_IN_BLOCK.trailing_zeros());
        let rows = self.instruction(format_args!("shl {words} {index}, {shift}"));
        match self.kernel.mode {
            CallMode::Leaf if !by_lane => {
                let at = self.instruction(format_args!("getelementptr i32, ptr {at}, i32 {rows}"));
                self.load_row(element, at)
            }
            CallMode::Leaf => {
                let offsets = self.row_offsets();
                let (pointers, wide) = (self.lanes("ptr"), self.lanes("i64"));
                let at =
                    self.instruction(format_args!("getelementptr i8, ptr {at}, {wide} {offsets}"));
                self.load_at(element, at, pointers, rows, by_lane)
            }
            CallMode::Packet | CallMode::CommonOrigin | CallMode::Stream | CallMode::Single => {
                self.load_at(element, at, pointers, rows, by_lane)
            }
        }
    }

    /// Returns the offsets of the chunk's objects from the first, in bytes, as a literal.
    fn row_offsets(&self) -> String {
        let offset = |lane: u32| {
            let (block, variable) =
                (lane / offsets::OBJECTS_IN_BLOCK, lane % offsets::OBJECTS_IN_BLOCK);
            u64::from(block) * u64::from(self.block_bytes()) + u64::from(variable) * 4
        };
        let offsets = (0..self.width).map(|lane| format!("i64 {}", offset(lane)));
        format!("<{}>", offsets.collect::<Vec<_>>().join(", "))
    }

    /// Returns a number as a scalar or splatted literal.
    fn same(&mut self, ty: LlvmType, number: u32) -> Operand {
        match ty.is_vector() {
            true => self.constant_lanes(ty.element, Operand::Int(number as i32)),
            false => Operand::Int(number as i32),
        }
    }

    // Entries of buffers.

    /// Returns a buffer that is the same for all lanes, loaded in the setup.
    pub fn buffer_of_call(&mut self, variable: &KernelVariable) -> Buffer {
        self.module.use_zero();
        let (address, count) = match variable.of_objects {
            true => self.entry_of_object(variable.location * ROW),
            false => self.entry_of_instance(variable.location * 4),
        };
        let len = variable.variable.len;
        let wide = self.setup(format_args!("zext i32 {count} to i64"));
        let total = self.setup(format_args!("mul i64 {wide}, {len}"));
        let last = self.setup(format_args!("sub i64 {total}, 1"));
        let fits = self.setup(format_args!("icmp slt i64 {last}, {}", i32::MAX));
        let reached = self.setup(format_args!("select i1 {fits}, i64 {last}, i64 {}", i32::MAX));
        let last = self.setup(format_args!("trunc i64 {reached} to i32"));
        let empty = self.setup(format_args!("icmp eq i32 {count}, 0"));
        let address = self.setup(format_args!("select i1 {empty}, ptr {ZERO_WORD}, ptr {address}"));
        Buffer { address, count, last }
    }

    /// Loads a buffer's address and count from the instance's block.
    fn entry_of_instance(&mut self, offset: u32) -> (Operand, Operand) {
        let instance = self.pointer(PointerSource::Call, offsets::CALL_INSTANCE);
        let at = self.setup(format_args!("getelementptr i8, ptr {instance}, i64 {offset}"));
        let address = self.setup(format_args!("load ptr, ptr {at}, align 8"));
        let count_at = self.setup(format_args!("getelementptr i8, ptr {at}, i64 8"));
        (address, self.setup(format_args!("load i32, ptr {count_at}, align 8")))
    }

    /// Loads a buffer's address and count from the call's one object.
    fn entry_of_object(&mut self, offset: u32) -> (Operand, Operand) {
        let object = self.pointer(PointerSource::Call, offsets::CALL_OBJECTS);
        let [low, high, count] = [0, 1, 2].map(|word| {
            let offset = offset + word * ROW;
            let at = self.setup(format_args!("getelementptr i8, ptr {object}, i64 {offset}"));
            self.setup(format_args!("load i32, ptr {at}, align 4"))
        });
        let low = self.setup(format_args!("zext i32 {low} to i64"));
        let high = self.setup(format_args!("zext i32 {high} to i64"));
        let high = self.setup(format_args!("shl i64 {high}, 32"));
        let address = self.setup(format_args!("or i64 {low}, {high}"));
        (self.setup(format_args!("inttoptr i64 {address} to ptr")), count)
    }

    /// Loads a buffer's addresses and counts from the lanes' objects.
    fn entry_of_lanes(&mut self, variable: &KernelVariable) -> (Operand, Operand) {
        let (pointers, words, wide) = (self.lanes("ptr"), self.lanes("i32"), self.lanes("i64"));
        let [low, high, count] =
            [0, 1, 2].map(|word| self.load_object_word("i32", variable.location + word));
        let [low, high] =
            [low, high].map(|half| self.instruction(format_args!("zext {words} {half} to {wide}")));
        let shift = self.constant_lanes("i64", Operand::Int(32));
        let high = self.instruction(format_args!("shl {wide} {high}, {shift}"));
        let address = self.instruction(format_args!("or {wide} {low}, {high}"));
        (self.instruction(format_args!("inttoptr {wide} {address} to {pointers}")), count)
    }

    /// Returns the buffers of the lanes' objects, loaded for each chunk.
    fn buffer_of_lanes(&mut self, variable: &KernelVariable) -> Buffer {
        self.module.use_zero();
        let (pointers, words, wide) = (self.lanes("ptr"), self.lanes("i32"), self.lanes("i64"));
        let (address, count) = self.entry_of_lanes(variable);
        let len = variable.variable.len;
        let extended = self.instruction(format_args!("zext {words} {count} to {wide}"));
        let len = self.constant_lanes("i64", Operand::Int(len as i32));
        let total = self.instruction(format_args!("mul {wide} {extended}, {len}"));
        let minus_one = self.constant_lanes("i64", Operand::Int(-1));
        let last = self.instruction(format_args!("add {wide} {total}, {minus_one}"));
        let greatest = self.constant_lanes("i64", Operand::Int(i32::MAX));
        let last = self.clamp_one_side("smin", wide, last, greatest);
        let last = self.instruction(format_args!("trunc {wide} {last} to {words}"));
        let zero = if words.is_vector() { Operand::Zero } else { Operand::Int(0) };
        let bit = self.lanes("i1");
        let empty = self.instruction(format_args!("icmp eq {words} {count}, {zero}"));
        let nothing = self.splat_address(ZERO_WORD);
        let address = self.instruction(format_args!(
            "select {bit} {empty}, {pointers} {nothing}, {pointers} {address}"
        ));
        Buffer { address, count, last }
    }

    /// Returns a global's address in all lanes.
    fn splat_address(&mut self, global: &str) -> Operand {
        let one = self.instruction(format_args!("getelementptr i8, ptr {global}, i64 0"));
        self.splat_here("ptr", one)
    }
}
