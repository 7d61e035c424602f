//! Loads and stores: lane arrays, the instance's block, buffers and locals.
//!
//! Every dynamic index is in range in all lanes, including inactive ones, so that any lane may be loaded: it is clamped
//! here unless packet code proves that it is in range. A buffer without elements has the address of a zero word.

use rtsl_abi::{CallMode, offsets};
use rtsl_ir::{Index, Scalar, Value, VariableId, VariableKind};
use rtsl_packet::kernel::{KernelOutput, KernelVariable};

use crate::emitter::{Emitter, PointerSource};
use crate::operand::{LlvmType, Operand, memory_element};

/// The tables of lane arrays.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LaneTable {
    State,
    Scratch,
}

impl LaneTable {
    /// Returns the offset in the call.
    fn offset(self) -> u32 {
        match self {
            LaneTable::State => offsets::CALL_STATE,
            LaneTable::Scratch => offsets::CALL_SCRATCH,
        }
    }

    fn source(self) -> PointerSource {
        match self {
            LaneTable::State => PointerSource::State,
            LaneTable::Scratch => PointerSource::Scratch,
        }
    }
}

/// The data of the call located so far.
#[derive(Default)]
pub struct Buffers {
    /// Uniform scratch arrays that outputs overwrite, by location: the copies of their content.
    copies: std::collections::BTreeMap<u32, Operand>,
    /// Buffers, by variable.
    pub buffers: std::collections::BTreeMap<u32, Buffer>,
}

/// A buffer in the form used by loads.
#[derive(Clone, Copy)]
pub struct Buffer {
    /// The address of its first scalar; uniform or lanes, as the other fields.
    pub address: Operand,
    /// The number of its elements, i32.
    pub count: Operand,
    /// The index of its last scalar, i32; -1 if there is none.
    pub last: Operand,
}

impl Emitter<'_, '_> {
    // Access.

    pub fn emit_load(&mut self, result: Value, id: VariableId, index: Index) {
        let variable = &self.kernel.variables[id.0 as usize];
        let loaded = match variable.variable.kind {
            VariableKind::State => self.load_lanes(LaneTable::State, id, index),
            VariableKind::Scratch => self.load_lanes(LaneTable::Scratch, id, index),
            VariableKind::Member | VariableKind::Parameter | VariableKind::Accepted
                if variable.of_objects =>
            {
                self.load_of_objects(id, index)
            }
            VariableKind::Member | VariableKind::Parameter | VariableKind::Accepted => {
                self.load_member(id, index)
            }
            VariableKind::Buffer => self.load_buffer(id, variable, index),
            VariableKind::Local => self.load_local(id, variable, index),
        };
        self.define_loaded(result, loaded);
    }

    /// Defines a value from words of memory, which represent bools.
    fn define_loaded(&mut self, result: Value, loaded: Operand) {
        if self.scalar(result) != Scalar::Bool {
            return self.define(result, loaded);
        }
        let ty = self.vector("i32", self.is_lanes(result));
        let zero = if ty.is_vector() { Operand::Zero } else { Operand::Int(0) };
        let bits = self.instruction(format_args!("icmp ne {ty} {loaded}, {zero}"));
        self.define(result, bits);
    }

    /// Returns a value in its memory form.
    pub fn memory_operand(&mut self, value: Value, lanes: bool) -> Operand {
        if self.scalar(value) != Scalar::Bool {
            return self.operand(value, lanes);
        }
        if lanes {
            return self.words(value);
        }
        let condition = self.uniform(value);
        self.instruction(format_args!("sext i1 {condition} to i32"))
    }

    pub fn load(&mut self, ty: LlvmType, at: Operand) -> Operand {
        self.instruction(format_args!("load {ty}, ptr {at}, align 4"))
    }

    /// Loads a `ty` from each of the `ty.count` addresses.
    pub fn gather(&mut self, ty: LlvmType, addresses: Operand) -> Operand {
        let align = if ty.element == "ptr" { 8 } else { 4 };
        if !ty.is_vector() {
            return self.instruction(format_args!("load {ty}, ptr {addresses}, align {align}"));
        }
        let (pointers, mask) = (ty.of("ptr"), ty.of("i1"));
        let name = format!("llvm.masked.gather.{}.{}", ty.suffix(), pointers.suffix());
        self.module.declare(format!("{ty} @{name}({pointers}, i32 immarg, {mask}, {ty})"));
        let all = all_on(ty);
        self.instruction(format_args!(
            "call {ty} @{name}({pointers} {addresses}, i32 {align}, {mask} {all}, {ty} poison)"
        ))
    }

    fn scatter(&mut self, ty: LlvmType, addresses: Operand, value: Operand) {
        let (pointers, mask) = (ty.of("ptr"), ty.of("i1"));
        let name = format!("llvm.masked.scatter.{}.{}", ty.suffix(), pointers.suffix());
        self.module.declare(format!("void @{name}({ty}, {pointers}, i32 immarg, {mask})"));
        let all = all_on(ty);
        self.effect(format_args!(
            "call void @{name}({ty} {value}, {pointers} {addresses}, i32 4, {mask} {all})"
        ));
    }

    /// Returns an index, uniform or as lanes, and true if it has more than one lane.
    fn index_operand(&mut self, index: Value) -> (Operand, bool) {
        let lanes = self.is_lanes(index) && self.width > 1;
        (self.operand(index, self.is_lanes(index)), lanes)
    }

    /// Clamps an i32 to `0..=last`.
    fn clamp(&mut self, lanes: bool, index: Operand, last: Operand) -> Operand {
        let ty = self.vector("i32", lanes);
        let below = self.clamp_one_side("smin", ty, index, last);
        let zero = if ty.is_vector() { Operand::Zero } else { Operand::Int(0) };
        self.clamp_one_side("smax", ty, below, zero)
    }

    /// Returns a dynamic index into the scalars of a variable other than a buffer, clamped unless it is known to be in
    /// range.
    pub fn clamp_index(&mut self, value: Value, id: VariableId) -> (Operand, bool) {
        let (index, lanes) = self.index_operand(value);
        if self.ranges.is_inside(self.kernel, value, id) {
            return (index, lanes);
        }
        let last = Operand::Int(self.kernel.variable(id).variable.len as i32 - 1);
        let last = if lanes { self.constant_lanes("i32", last) } else { last };
        (self.clamp(lanes, index, last), lanes)
    }

    // Lane arrays.

    /// Returns the address of the chunk in lane array `array`.
    pub fn lane_address(&mut self, table: LaneTable, array: u32) -> Operand {
        let array = self.pointer(table.source(), array * 8);
        let base = self.chunk_base();
        self.instruction(format_args!("getelementptr i32, ptr {array}, i64 {base}"))
    }

    /// Returns the lane array of an output.
    pub fn output_array(&mut self, output: KernelOutput) -> Operand {
        let (table, array) = self.output_location(output);
        self.pointer(table.source(), array * 8)
    }

    /// Returns the address of the chunk in the lane array of an output.
    pub fn output_address(&mut self, output: KernelOutput) -> Operand {
        let (table, array) = self.output_location(output);
        self.lane_address(table, array)
    }

    fn output_location(&self, output: KernelOutput) -> (LaneTable, u32) {
        let variable = self.kernel.variable(output.variable);
        let table = match variable.variable.kind {
            VariableKind::State => LaneTable::State,
            VariableKind::Scratch => LaneTable::Scratch,
            VariableKind::Member
            | VariableKind::Parameter
            | VariableKind::Buffer
            | VariableKind::Local
            | VariableKind::Accepted => {
                unreachable!("{} has no lane array", variable.variable.name)
            }
        };
        (table, variable.location + output.component)
    }

    fn load_lanes(&mut self, table: LaneTable, id: VariableId, index: Index) -> Operand {
        let variable = self.kernel.variable(id);
        if !variable.varies {
            return self.load_first_lane(table, id, index);
        }
        let ty = self.lanes(memory_element(variable.variable.scalar));
        let index = match index {
            Index::Constant(index) => {
                let at = self.lane_address(table, variable.location + index);
                return self.load(ty, at);
            }
            Index::Dynamic(index) => index,
        };
        let (index, by_lane) = self.clamp_index(index, id);
        let base = self.chunk_base();
        let table = self.pointer(PointerSource::Call, table.offset());
        let first = self.offset(table, variable.location * 8);
        let indices = self.vector("i32", by_lane);
        let entries =
            self.instruction(format_args!("getelementptr ptr, ptr {first}, {indices} {index}"));
        if !by_lane {
            let array = self.instruction(format_args!("load ptr, ptr {entries}, align 8"));
            let at = self.instruction(format_args!("getelementptr i32, ptr {array}, i64 {base}"));
            return self.load(ty, at);
        }
        let pointers = self.lanes("ptr");
        let arrays = self.gather(pointers, entries);
        let chunks =
            self.instruction(format_args!("getelementptr i32, {pointers} {arrays}, i64 {base}"));
        let numbers = self.lane_numbers(1);
        let lanes = self.lanes("i32");
        let at = self
            .instruction(format_args!("getelementptr i32, {pointers} {chunks}, {lanes} {numbers}"));
        self.gather(ty, at)
    }

    /// Loads a uniform value from the first lane of an array, where the array's index may vary.
    fn load_first_lane(&mut self, table: LaneTable, id: VariableId, index: Index) -> Operand {
        let variable = self.kernel.variable(id);
        let element = memory_element(variable.variable.scalar);
        let index = match index {
            Index::Constant(index) => {
                let array = self.pointer(table.source(), (variable.location + index) * 8);
                return self.load(self.vector(element, false), array);
            }
            Index::Dynamic(index) => index,
        };
        let (index, by_lane) = self.clamp_index(index, id);
        if self.is_overwritten(variable) {
            let copy = self.copy_of_first_lane(table, variable);
            return self.load_at(element, copy, self.vector("ptr", false), index, by_lane);
        }
        let table = self.pointer(PointerSource::Call, table.offset());
        let first = self.offset(table, variable.location * 8);
        let indices = self.vector("i32", by_lane);
        let entries =
            self.instruction(format_args!("getelementptr ptr, ptr {first}, {indices} {index}"));
        let pointers = self.vector("ptr", by_lane);
        let arrays = self.gather(pointers, entries);
        let at = self.lanes_of_ray(pointers, arrays);
        self.gather(self.vector(element, by_lane), at)
    }

    /// True if a chunk's outputs may overwrite a uniform value that a later chunk reads.
    fn is_overwritten(&self, variable: &KernelVariable) -> bool {
        let mut outputs = self.kernel.outputs.iter();
        match self.kernel.mode {
            CallMode::Leaf => {
                !self.kernel.keeps_nearest()
                    && outputs.any(|output| self.kernel.variable(output.variable) == variable)
            }
            // Uniform variables of the first three modes have no dynamic indices left; the last has one chunk.
            CallMode::Packet | CallMode::CommonOrigin | CallMode::Stream | CallMode::Single => {
                false
            }
        }
    }

    /// Returns a stack copy of the uniform content of arrays.
    fn copy_of_first_lane(&mut self, table: LaneTable, variable: &KernelVariable) -> Operand {
        if let Some(copy) = self.buffers.copies.get(&variable.location) {
            return *copy;
        }
        let (element, len) = (memory_element(variable.variable.scalar), variable.variable.len);
        let copy = self.alloca(&format!("[{len} x {element}]"), 64);
        for index in 0..len {
            let array = self.pointer(table.source(), (variable.location + index) * 8);
            let word = self.setup(format_args!("load {element}, ptr {array}, align 4"));
            let at = self.setup(format_args!("getelementptr {element}, ptr {copy}, i64 {index}"));
            self.setup_effect(format_args!("store {element} {word}, ptr {at}, align 4"));
        }
        self.buffers.copies.insert(variable.location, copy);
        copy
    }

    /// Returns the lane indices, times `factor`, as a literal.
    pub fn lane_numbers(&self, factor: u32) -> String {
        if self.width == 1 {
            return "0".to_owned();
        }
        let numbers = (0..self.width).map(|lane| format!("i32 {}", lane * factor));
        format!("<{}>", numbers.collect::<Vec<_>>().join(", "))
    }

    fn load_member(&mut self, id: VariableId, index: Index) -> Operand {
        let variable = self.kernel.variable(id);
        let element = memory_element(variable.variable.scalar);
        let instance = self.pointer(PointerSource::Call, offsets::CALL_INSTANCE);
        let (base, pointers) =
            (self.offset(instance, variable.location * 4), self.vector("ptr", false));
        match index {
            Index::Constant(0) => self.gather(pointers.of(element), base),
            Index::Constant(index) => {
                let at = self
                    .instruction(format_args!("getelementptr i32, {pointers} {base}, i64 {index}"));
                self.gather(pointers.of(element), at)
            }
            Index::Dynamic(index) => {
                let (index, by_lane) = self.clamp_index(index, id);
                self.load_at(element, base, pointers, index, by_lane)
            }
        }
    }

    /// Loads scalars at an index from an address, either of which may be lanes.
    pub fn load_at(
        &mut self,
        element: &'static str,
        base: Operand,
        pointers: LlvmType,
        index: Operand,
        by_lane: bool,
    ) -> Operand {
        let indices = self.vector("i32", by_lane);
        if by_lane && !pointers.is_vector() && !self.module.target.gathers {
            return self.load_each(indices.of(element), base, index);
        }
        let at = self
            .instruction(format_args!("getelementptr i32, {pointers} {base}, {indices} {index}"));
        let count = indices.count.max(pointers.count);
        self.gather(LlvmType { element, count }, at)
    }

    /// Emits a gather lane by lane. Indices are extracted from the vector in pairs: on Zen 3 this takes 6 cycles for 8
    /// lanes, the gather instruction 9, and LLVM's expansion of a gather 18.
    fn load_each(&mut self, ty: LlvmType, base: Operand, index: Operand) -> Operand {
        let (words, pairs) = (ty.of("i32"), LlvmType { element: "i64", count: ty.count / 2 });
        let numbers = self.instruction(format_args!("bitcast {words} {index} to {pairs}"));
        let mut loaded = None;
        for pair in 0..pairs.count {
            let pair_of_lanes = self.pair(pairs, numbers, pair);
            let low = self.instruction(format_args!("and i64 {pair_of_lanes}, {}", u32::MAX));
            let high = self.instruction(format_args!("lshr i64 {pair_of_lanes}, 32"));
            for (lane, number) in [(2 * pair, low), (2 * pair + 1, high)] {
                let at = format_args!("getelementptr i32, ptr {base}, i64 {number}");
                let at = self.instruction(at);
                let one = self.load(LlvmType { count: 1, ..ty }, at);
                let (element, others) = (ty.element, loaded.map(|it: Operand| it.to_string()));
                let others = others.as_deref().unwrap_or("poison");
                loaded = Some(self.instruction(format_args!(
                    "insertelement {ty} {others}, {element} {one}, i64 {lane}"
                )));
            }
        }
        loaded.expect("a vector has lanes")
    }

    /// Extracts two indices as one integer. It passes through inline assembly without instructions, since LLVM 22, if
    /// it can prove both to be small, replaces the integer by the lower one.
    fn pair(&mut self, pairs: LlvmType, numbers: Operand, number: u32) -> Operand {
        let pair = if pairs.is_vector() {
            self.instruction(format_args!("extractelement {pairs} {numbers}, i64 {number}"))
        } else {
            numbers
        };
        self.instruction(format_args!("call i64 asm \"\", \"=r,0\"(i64 {pair})"))
    }

    // Buffers.

    fn buffer(&mut self, id: VariableId, variable: &KernelVariable) -> Buffer {
        if let Some(buffer) = self.buffers.buffers.get(&id.0) {
            return *buffer;
        }
        let buffer = self.buffer_of_call(variable);
        self.buffers.buffers.insert(id.0, buffer);
        buffer
    }

    fn load_buffer(&mut self, id: VariableId, variable: &KernelVariable, index: Index) -> Operand {
        let buffer = self.buffer(id, variable);
        let buffer_lanes = variable.varies && self.width > 1;
        let element = memory_element(variable.variable.scalar);
        let pointers = self.vector("ptr", buffer_lanes);
        let (index, index_lanes) = match index {
            Index::Constant(index) => (Operand::Int(index as i32), false),
            Index::Dynamic(index) if self.ranges.is_inside(self.kernel, index, id) => {
                let (index, lanes) = self.index_operand(index);
                // The minimum is -1, for an empty buffer.
                let zero = if lanes { Operand::Zero } else { Operand::Int(0) };
                let index = self.clamp_one_side("smax", self.vector("i32", lanes), index, zero);
                return self.load_at(element, buffer.address, pointers, index, lanes);
            }
            Index::Dynamic(index) => self.index_operand(index),
        };
        let by_lane = buffer_lanes || index_lanes;
        let index = match (by_lane && !index_lanes, index) {
            (false, index) => index,
            (true, Operand::Int(_)) => self.constant_lanes("i32", index),
            (true, index) => self.splat_here("i32", index),
        };
        let last = if by_lane && !buffer_lanes {
            self.splat_here("i32", buffer.last)
        } else {
            buffer.last
        };
        let index = self.clamp(by_lane, index, last);
        self.load_at(element, buffer.address, pointers, index, by_lane)
    }

    pub fn emit_length(&mut self, result: Value, id: VariableId) {
        let variable = &self.kernel.variables[id.0 as usize];
        let buffer = self.buffer(id, variable);
        self.define(result, buffer.count);
    }

    // Locals.

    /// Allocates and zeroes each local.
    pub fn emit_locals(&mut self) {
        for (number, variable) in self.kernel.variables.iter().enumerate() {
            if variable.variable.kind != VariableKind::Local {
                continue;
            }
            let (ty, len) = (self.local_type(variable), variable.variable.len);
            let local = self.alloca(&format!("[{len} x {ty}]"), 64);
            self.local_memory[number] = Some(local);
            self.module.declare(
                "void @llvm.memset.p0.i64(ptr nocapture writeonly, i8, i64, i1 immarg)".to_owned(),
            );
            let bytes = u64::from(len) * u64::from(ty.count) * 4;
            self.effect(format_args!(
                "call void @llvm.memset.p0.i64(ptr align 64 {local}, i8 0, i64 {bytes}, i1 false)"
            ));
        }
    }

    fn local_type(&self, variable: &KernelVariable) -> LlvmType {
        self.vector(memory_element(variable.variable.scalar), variable.varies)
    }

    /// Returns the address of an element of a local, or those of its lanes, and true for the latter.
    fn local_address(
        &mut self,
        id: VariableId,
        variable: &KernelVariable,
        index: Index,
    ) -> (Operand, bool) {
        let local =
            self.local_memory[id.0 as usize].expect("locals have memory from the chunk's start");
        let ty = self.local_type(variable);
        let (index, by_lane) = match index {
            Index::Constant(0) => return (local, false),
            Index::Constant(index) => {
                let text = format_args!("getelementptr {ty}, ptr {local}, i64 {index}");
                return (self.instruction(text), false);
            }
            Index::Dynamic(index) => self.clamp_index(index, id),
        };
        if !by_lane {
            let text = format_args!("getelementptr {ty}, ptr {local}, i32 {index}");
            return (self.instruction(text), false);
        }
        let (words, element) = (self.lanes("i32"), ty.element);
        let index = if variable.varies {
            let width = self.constant_lanes("i32", Operand::Int(self.width as i32));
            let row = self.instruction(format_args!("mul {words} {index}, {width}"));
            let numbers = self.lane_numbers(1);
            self.instruction(format_args!("add {words} {row}, {numbers}"))
        } else {
            index
        };
        let text = format_args!("getelementptr {element}, ptr {local}, {words} {index}");
        (self.instruction(text), true)
    }

    fn load_local(&mut self, id: VariableId, variable: &KernelVariable, index: Index) -> Operand {
        let ty = self.local_type(variable);
        let (at, by_lane) = self.local_address(id, variable, index);
        if by_lane {
            return self.gather(self.lanes(ty.element), at);
        }
        self.instruction(format_args!("load {ty}, ptr {at}, align {}", ty.count * 4))
    }

    pub fn emit_store(&mut self, id: VariableId, index: Index, value: Value, mask: Option<Value>) {
        let variable = &self.kernel.variables[id.0 as usize];
        let ty = self.local_type(variable);
        let new = self.memory_operand(value, variable.varies);
        let (at, by_lane) = self.local_address(id, variable, index);
        let align = ty.count * 4;
        let merged = match mask {
            None => new,
            Some(mask) => {
                let old = if by_lane {
                    self.gather(ty, at)
                } else {
                    self.instruction(format_args!("load {ty}, ptr {at}, align {align}"))
                };
                let (bits, bit) = (self.bits(mask), self.lanes("i1"));
                self.instruction(format_args!("select {bit} {bits}, {ty} {new}, {ty} {old}"))
            }
        };
        if by_lane {
            // Each lane has separate words, so inactive lanes may store the previous value.
            return self.scatter(ty, at, merged);
        }
        self.effect(format_args!("store {ty} {merged}, ptr {at}, align {align}"));
    }
}

/// Returns a mask with all lanes on, as a literal.
fn all_on(ty: LlvmType) -> String {
    format!("<{}>", vec!["i1 true"; ty.count as usize].join(", "))
}
