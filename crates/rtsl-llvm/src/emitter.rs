//! Emission of one function: the parts of its text, and the instructions added to them.

use std::collections::BTreeMap;
use std::fmt::{Arguments, Write};

use rtsl_abi::{CallMode, offsets};
use rtsl_ir::{Scalar, Value};
use rtsl_packet::{Kernel, Ranges};

use crate::approximation::ExactReciprocals;
use crate::callback::Callback;
use crate::chunk::Chunk;
use crate::classification::BoundTests;
use crate::full_chunks::{FullChunks, count_of_full_chunks};
use crate::host::RequestMemory;
use crate::leaf_test::{LeafTest, test_header};
use crate::memory::Buffers;
use crate::module::Module;
use crate::nearest::Nearest;
use crate::operand::{Label, LlvmType, Operand, register_element};
use crate::values::Values;

/// Emits the function of a kernel.
///
/// The text consists of several parts, since values needed once are known only when they are requested: allocas, then
/// the setup (pointers loaded from the call), the prologue, splats of values of the prologue, and the loop over chunks.
pub struct Emitter<'a, 'm> {
    pub module: &'a mut Module<'m>,
    pub kernel: &'a Kernel,
    /// The number of rays in a chunk of this function.
    pub width: u32,
    pub part: Part,
    /// The index of the first ray of its first chunk, i64.
    pub begun: Operand,
    pub ranges: Ranges,
    pub values: Values,
    pub chunk: Chunk,
    pub buffers: Buffers,
    /// The chunk's objects: the address of the first; in the stream mode the address of each lane's.
    pub objects: Option<Operand>,
    /// In the stream mode the number of each lane's object; arbitrary in lanes that are not active.
    pub object_numbers: Option<Operand>,
    pub requests: RequestMemory,
    pub nearest: Nearest,
    pub bound_tests: BoundTests,
    pub exact_reciprocals: ExactReciprocals,
    /// The callback, for a function that is called with a host's struct instead of a call.
    pub callback: Option<Callback<'a>>,
    /// The leaf test, for a function that executes one.
    pub test: Option<LeafTest>,
    /// The address of each local, by variable.
    pub local_memory: Vec<Option<Operand>>,
    pub pieces: Pieces,
    /// The part being written that is not in `pieces`: the prologue or the chunks.
    text: String,
    locals: u32,
    labels: u32,
    /// The current block.
    block: Label,
}

/// The greatest number of vectors of a function's values that stay in 32 registers, beside those of constants.
const MAX_IN_REGISTERS: u32 = 28;

/// Text inserted before the prologue.
#[derive(Default)]
pub struct Pieces {
    pub allocas: String,
    pub setup: String,
    pub splats: String,
    /// Pointers loaded in the setup: from the call or a table, by offset.
    pub pointers: BTreeMap<(PointerSource, u32), Operand>,
}

/// The structure from which the setup loads a pointer.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum PointerSource {
    Call,
    State,
    Scratch,
    Host,
    /// The first row of a host's packet.
    Rays,
}

/// The chunks of a call that a function processes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Part {
    /// All chunks.
    All,
    /// Full chunks, as many at a time as the kernel interleaves; for the nearest of several objects only one.
    Full,
    /// The chunks after the full ones.
    Rest,
}

impl<'a, 'm> Emitter<'a, 'm> {
    /// Returns an emitter of the function for some chunks of a kernel.
    pub fn new(module: &'a mut Module<'m>, kernel: &'a Kernel, part: Part) -> Self {
        let interleave = match part {
            Part::All | Part::Rest => 1,
            Part::Full => kernel.interleave.unwrap_or(1),
        };
        let width = kernel.width * interleave;
        let masks_in_lanes = width > 1 && !module.target.mask_registers;
        Emitter {
            module,
            kernel,
            width,
            part,
            begun: Operand::Int(0),
            ranges: Ranges::new(kernel),
            values: Values::new(kernel, masks_in_lanes),
            chunk: Chunk::default(),
            buffers: Buffers::default(),
            objects: None,
            object_numbers: None,
            requests: RequestMemory::default(),
            nearest: Nearest::default(),
            bound_tests: BoundTests::default(),
            exact_reciprocals: ExactReciprocals::default(),
            callback: None,
            test: None,
            local_memory: vec![None; kernel.variables.len()],
            pieces: Pieces::default(),
            text: String::new(),
            locals: 0,
            labels: 0,
            block: Label(0),
        }
    }

    /// Returns an emitter of a function for a host's packets.
    pub fn for_callback(module: &'a mut Module<'m>, callback: Callback<'a>) -> Self {
        let emitter = Emitter::new(module, callback.kernel, Part::All);
        Emitter { callback: Some(callback), ..emitter }
    }

    /// Emits the function and returns its text.
    pub fn emit(mut self, symbol: &str) -> String {
        let (done, start) = (self.new_label(), self.new_label());
        let passed = match self.part {
            Part::Rest => self.new_local(),
            Part::All | Part::Full => Operand::Int(0),
        };
        self.begun = if self.begins_anywhere() { self.new_local() } else { passed };
        let full = match self.part {
            Part::Full => FullChunks::of(self.kernel, symbol),
            Part::All | Part::Rest => None,
        };
        let full_header = full.as_ref().map(|full| full.header(&mut self));
        let checked = self.callback.map(|callback| self.check_mask(callback, start, done));
        self.begin_block(start);
        self.text.clear();
        if self.kernel.keeps_nearest() {
            self.begin_test();
        }
        self.values.begin_prologue();
        self.emit_ops(&self.kernel.prologue.ops);
        self.values.end_prologue();
        let prologue = std::mem::take(&mut self.text);
        self.emit_chunks(done);
        let Pieces { allocas, setup, splats, pointers: _ } = &self.pieces;
        let chunks = &self.text;
        let single = self.kernel.mode == CallMode::Single;
        let is_test = self.kernel.keeps_nearest();
        let (enter, leave) = match (checked, self.part) {
            (Some(checked), _) => (checked, String::new()),
            (None, Part::All) if single => (format!("  br label %{start}\n"), String::new()),
            (None, Part::Full) if full.is_some() || is_test => {
                (format!("  br label %{start}\n"), String::new())
            }
            (None, Part::All | Part::Rest) => {
                (self.enter_unless_empty(passed, start, done), String::new())
            }
            (None, Part::Full) => (enter_full_chunks(self.width, start), leave_full_chunks(symbol)),
        };
        let header = match (self.part, full_header) {
            (_, Some(header)) => header,
            (Part::All | Part::Full, None) if is_test => test_header(symbol, self.is_full()),
            (Part::All | Part::Full, None) => format!("void @\"{symbol}\"(ptr noalias %call)"),
            (Part::Rest, None) => {
                format!("internal void @\"{symbol}.rest\"(ptr noalias %call, i64 {passed})")
            }
        };
        // Aligning the stack for vectors takes 2 percent of a test of one ray with a sphere.
        let has_vectors = self.callback.is_none() || self.width > 1;
        let attributes = match has_vectors {
            true => self.module.vector_attributes(self.spills_vectors(), self.splits_masks()),
            false => self.module.scalar_attributes(),
        };
        let caller = full.map(|full| full.caller(symbol, self.module.scalar_attributes()));
        let caller = caller.unwrap_or_default();
        format!(
            "{caller}define {header} {attributes} {{
entry:
{allocas}{enter}{start}:
{setup}{prologue}{splats}{chunks}{done}:
{leave}  ret void
}}

"
        )
    }

    /// True if masks of several vectors are best in one mask register for each: in straight-line code. A loop keeps
    /// masks from iteration to iteration, too many for eight registers.
    pub fn splits_masks(&self) -> bool {
        let target = &self.module.target;
        let several_vectors = self.width > target.vector_lanes;
        target.mask_registers && several_vectors && !self.kernel.body.has_loop()
    }

    /// True if the function may keep vectors on the stack. Without them its frame is that of the caller: this takes 4 to
    /// 10 percent off a logarithm or a triangle on a Zen 5.
    fn spills_vectors(&self) -> bool {
        let target = &self.module.target;
        let vectors = self.width.div_ceil(target.vector_lanes);
        let has_many_registers = target.mask_registers;
        let fits = || self.kernel.live_lanes() * vectors <= MAX_IN_REGISTERS;
        !(has_many_registers && !self.kernel.body.has_loop() && fits())
    }

    /// Returns the text written since the last call.
    pub fn take_text(&mut self) -> String {
        std::mem::take(&mut self.text)
    }

    // Types.

    /// Returns the type of a value of packet code in registers.
    pub fn register_type(&self, value: Value) -> LlvmType {
        let ty = self.kernel.ty(value);
        self.vector(register_element(ty.scalar), ty.lanes)
    }

    /// Returns the type of one element or W of them.
    pub fn vector(&self, element: &'static str, lanes: bool) -> LlvmType {
        LlvmType { element, count: if lanes { self.width } else { 1 } }
    }

    /// Returns the type of W elements.
    pub fn lanes(&self, element: &'static str) -> LlvmType {
        self.vector(element, true)
    }

    pub fn scalar(&self, value: Value) -> Scalar {
        self.kernel.ty(value).scalar
    }

    pub fn is_lanes(&self, value: Value) -> bool {
        self.kernel.ty(value).lanes
    }

    // Instructions.

    pub fn new_local(&mut self) -> Operand {
        self.locals += 1;
        Operand::Local(self.locals)
    }

    /// Emits an instruction with a result.
    pub fn instruction(&mut self, text: Arguments<'_>) -> Operand {
        let local = self.new_local();
        let _ = writeln!(self.text, "  {local} = {text}");
        local
    }

    /// Emits an instruction without a result.
    pub fn effect(&mut self, text: Arguments<'_>) {
        let _ = writeln!(self.text, "  {text}");
    }

    /// Emits an instruction that runs once per call, before all others.
    pub fn setup(&mut self, text: Arguments<'_>) -> Operand {
        let local = self.new_local();
        let _ = writeln!(self.pieces.setup, "  {local} = {text}");
        local
    }

    /// Like [`Emitter::setup`], without a result.
    pub fn setup_effect(&mut self, text: Arguments<'_>) {
        let _ = writeln!(self.pieces.setup, "  {text}");
    }

    /// Allocates stack memory of the function.
    pub fn alloca(&mut self, ty: &str, align: u32) -> Operand {
        let local = self.new_local();
        let _ = writeln!(self.pieces.allocas, "  {local} = alloca {ty}, align {align}");
        local
    }

    /// Calls an intrinsic `llvm.name.suffixes` with the given types.
    pub fn intrinsic(
        &mut self,
        name: &str,
        result: LlvmType,
        arguments: &[(LlvmType, Operand)],
    ) -> Operand {
        let types: Vec<String> = arguments.iter().map(|(ty, _)| ty.to_string()).collect();
        self.module.declare(format!("{result} @{name}({})", types.join(", ")));
        let arguments: Vec<String> =
            arguments.iter().map(|(ty, operand)| format!("{ty} {operand}")).collect();
        self.instruction(format_args!("call {result} @{name}({})", arguments.join(", ")))
    }

    /// Returns the address `offset` bytes after `base`.
    pub fn offset(&mut self, base: Operand, offset: u32) -> Operand {
        if offset == 0 {
            return base;
        }
        self.instruction(format_args!("getelementptr i8, ptr {base}, i64 {offset}"))
    }

    /// Returns a pointer from the call, or from one of its tables, loaded once per call.
    pub fn pointer(&mut self, source: PointerSource, offset: u32) -> Operand {
        if let Some(pointer) = self.pieces.pointers.get(&(source, offset)) {
            return *pointer;
        }
        if let Some(callback) = self.callback {
            let pointer = self.pointer_of_record(callback, source, offset);
            self.pieces.pointers.insert((source, offset), pointer);
            return pointer;
        }
        let table = match source {
            PointerSource::Call | PointerSource::Rays => None,
            PointerSource::State => Some(offsets::CALL_STATE),
            PointerSource::Scratch => Some(offsets::CALL_SCRATCH),
            PointerSource::Host => Some(offsets::CALL_HOST),
        };
        let base = table.map(|table| self.pointer(PointerSource::Call, table));
        let address = match base {
            None => self.setup(format_args!("getelementptr i8, ptr %call, i64 {offset}")),
            Some(base) => self.setup(format_args!("getelementptr i8, ptr {base}, i64 {offset}")),
        };
        let pointer = self.setup(format_args!("load ptr, ptr {address}, align 8"));
        let pointer = match source {
            PointerSource::State | PointerSource::Scratch => self.lane_of_ray(pointer),
            PointerSource::Call | PointerSource::Host | PointerSource::Rays => pointer,
        };
        self.pieces.pointers.insert((source, offset), pointer);
        pointer
    }

    /// Sets the result of [`Emitter::pointer`].
    pub fn set_pointer(&mut self, source: PointerSource, offset: u32, pointer: Operand) {
        self.pieces.pointers.insert((source, offset), pointer);
    }

    // Blocks.

    pub fn new_label(&mut self) -> Label {
        self.labels += 1;
        Label(self.labels)
    }

    pub fn begin_block(&mut self, label: Label) {
        let _ = writeln!(self.text, "{label}:");
        self.block = label;
        self.values.begin_block();
    }

    pub fn block(&self) -> Label {
        self.block
    }

    pub fn jump(&mut self, to: Label) {
        self.effect(format_args!("br label %{to}"));
    }

    pub fn branch(&mut self, condition: Operand, then: Label, otherwise: Label) {
        self.effect(format_args!("br i1 {condition}, label %{then}, label %{otherwise}"));
    }

    pub fn phi(&mut self, ty: LlvmType, incoming: &[(Operand, Label)]) -> Operand {
        let local = self.new_local();
        let at = self.text.len();
        self.insert_phi(at, local, ty, incoming);
        local
    }

    /// Returns the position in the text where phis of the block just begun are inserted.
    pub fn here(&self) -> usize {
        self.text.len()
    }

    /// Inserts a phi at a position returned by [`Emitter::here`] before the incoming values were known.
    pub fn insert_phi(
        &mut self,
        at: usize,
        local: Operand,
        ty: LlvmType,
        incoming: &[(Operand, Label)],
    ) {
        let incoming = incoming.iter().map(|(operand, label)| format!("[ {operand}, %{label} ]"));
        let incoming = incoming.collect::<Vec<_>>().join(", ");
        self.text.insert_str(at, &format!("  {local} = phi {ty} {incoming}\n"));
    }

    /// True if the first chunk may be any: rays before it are off. A kernel that accepts hits stores for all rays whether
    /// they have one.
    fn begins_anywhere(&self) -> bool {
        let has_mask = match self.kernel.mode {
            CallMode::Packet | CallMode::CommonOrigin | CallMode::Stream => true,
            CallMode::Leaf | CallMode::Single => false,
        };
        let is_of_calls = self.callback.is_none() && self.part != Part::Full;
        has_mask && is_of_calls && self.kernel.accepted_output().is_none()
    }

    /// Returns the function's entry, which skips the body if the call has no lanes from the first chunk on. `passed` is
    /// the number of rays that another function has done, none of them if there is a mask.
    fn enter_unless_empty(&self, passed: Operand, start: Label, done: Label) -> String {
        let count = load_word("count", offsets::CALL_COUNT, "%count");
        let begun = self.begun;
        let mut first = String::new();
        if begun != passed {
            first = load_word("first", offsets::CALL_FIRST, "%first");
            first.push_str(&format!("  {begun} = add i64 %first, {passed}\n"));
        }
        format!(
            "{count}{first}  %none = icmp ule i64 %count, {begun}
  br i1 %none, label %{done}, label %{start}
"
        )
    }
}

/// Loads a word of the call to a local.
pub fn load_word(name: &str, offset: u32, local: &str) -> String {
    format!(
        "  %{name}.at = getelementptr i8, ptr %call, i64 {offset}
  %{name}.word = load i32, ptr %{name}.at, align 4
  {local} = zext i32 %{name}.word to i64
"
    )
}

/// Returns the entry of a function for full chunks of `chunk` rays, which skips the body if the call has none, or has a
/// mask.
fn enter_full_chunks(chunk: u32, start: Label) -> String {
    let count = count_of_full_chunks(chunk);
    format!("{count}  br i1 %none, label %rest, label %{start}\n")
}

/// Returns the exit of that function, which passes the index of the first remaining ray to another function.
fn leave_full_chunks(symbol: &str) -> String {
    format!(
        "  %all = icmp eq i64 %count, %count.all
  br i1 %all, label %end, label %rest
rest:
  tail call void @\"{symbol}.rest\"(ptr %call, i64 %count)
  br label %end
end:
"
    )
}
