//! Requests to the host: writes the lanes to memory, calls the host through its table, and reads its answers.

use rtsl_abi::offsets;
use rtsl_ir::host::MAX_LANES;
use rtsl_ir::{Query, Scalar, Value};
use rtsl_packet::kernel::{Op, OpKind};

use crate::emitter::{Emitter, PointerSource};
use crate::operand::Operand;

/// The size of the lanes of one float, in bytes.
const LANES_BYTES: u32 = 4 * MAX_LANES as u32;

/// The number of lane arrays of the largest request, that of a query. Those of `RayLanes` are 8.
const REQUEST_ARRAYS: u32 = Query::MAX_OPERANDS as u32;

/// The number of lane arrays of the largest answer, that of a query. Those of `LightLanes` are 8.
const ANSWER_ARRAYS: u32 = Query::MAX_RESULTS as u32;

/// Memory for requests and answers, allocated at the first request of a kernel and then reused.
#[derive(Default)]
pub struct RequestMemory {
    request: Option<Operand>,
    answer: Option<Operand>,
}

impl Emitter<'_, '_> {
    pub fn emit_request(&mut self, op: &Op) {
        match &op.kind {
            OpKind::Trace { mask, ray, weight } => {
                let lanes = self.lane_set(*mask);
                let rays = self.store_lanes(ray.operands().chain([*weight]));
                let answer = self.answer_memory();
                self.call_host(
                    None,
                    offsets::HOST_TRACE,
                    &format!("{lanes}, ptr {rays}, ptr {answer}"),
                );
                self.define_answers(op, 0, None);
            }
            OpKind::Occluded { mask, ray } => {
                let (lanes, rays) = (self.lane_set(*mask), self.store_lanes(ray.operands()));
                let arguments = format!("{lanes}, ptr {rays}");
                let bits = self.call_for_lanes(*mask, offsets::HOST_OCCLUDED, &arguments);
                self.define(op.results.get(0), bits);
            }
            OpKind::LightCount => {
                let count = self.call_host(Some("i32"), offsets::HOST_LIGHT_COUNT, "");
                self.define(op.results.get(0), count.expect("it returns one"));
            }
            OpKind::LightSample { mask, index, point, normal, cosine } => {
                let lanes = self.lane_set(*mask);
                let query = point.iter().chain(normal).chain([cosine]);
                let query = self.store_lanes(query.copied());
                let (index, answer) = (self.uniform(*index), self.answer_memory());
                let arguments = format!("{lanes}, i32 {index}, ptr {query}, ptr {answer}");
                let bits = self.call_for_lanes(*mask, offsets::HOST_LIGHT_SAMPLE, &arguments);
                self.define_answers(op, 1, Some(bits));
                self.define(op.results.get(0), bits);
            }
            OpKind::Ambient => self.emit_ambient(op),
            OpKind::Rand(mask) => {
                let (lanes, answer) = (self.lane_set(*mask), self.answer_memory());
                self.call_host(None, offsets::HOST_RAND, &format!("{lanes}, ptr {answer}"));
                self.define_answers(op, 0, None);
            }
            OpKind::Query { mask, query, operands } => {
                self.emit_query(op, *mask, *query, operands);
            }
            OpKind::ReportBudget => self.emit_report(),
            other => unreachable!("{other:?} is no request"),
        }
    }

    fn emit_query(&mut self, op: &Op, mask: Option<Value>, query: Query, operands: &[Value]) {
        // A query without a mask has the same answer for all lanes.
        let lanes = mask.map_or_else(|| "i32 0, i32 1".to_owned(), |mask| self.lane_set(mask));
        let (request, answer) = (self.store_query(operands), self.answer_memory());
        let number = query.number();
        let arguments = format!("{lanes}, i32 {number}, ptr {request}, ptr {answer}");
        self.call_host(None, offsets::HOST_QUERY, &arguments);
        for (position, result) in op.results.iter().enumerate() {
            let at = self.offset(answer, position as u32 * LANES_BYTES);
            self.define_answered(result, at);
        }
    }

    /// Defines a result of a query by its words in memory: a uniform one by the first.
    fn define_answered(&mut self, result: Value, at: Operand) {
        let scalar = self.scalar(result);
        let element = if scalar == Scalar::F32 { "float" } else { "i32" };
        let is_lanes = self.is_lanes(result);
        let lanes = self.lanes(element);
        let ty = if is_lanes { lanes } else { lanes.one() };
        let answer = self.instruction(format_args!("load {ty}, ptr {at}, align 4"));
        if scalar != Scalar::Bool {
            return self.define(result, answer);
        }
        let zero = if ty.is_vector() { Operand::Zero } else { Operand::Int(0) };
        let bits = self.instruction(format_args!("icmp ne {ty} {answer}, {zero}"));
        self.define(result, bits);
    }

    /// Stores the operands of a query, one array of lanes each.
    fn store_query(&mut self, operands: &[Value]) -> Operand {
        let memory = self.request_memory();
        for (position, operand) in operands.iter().enumerate() {
            let scalar = self.scalar(*operand);
            let (element, value) = match scalar {
                Scalar::F32 => ("float", self.operand(*operand, true)),
                Scalar::I32 | Scalar::U32 => ("i32", self.operand(*operand, true)),
                Scalar::Bool => ("i32", self.words(*operand)),
            };
            let ty = self.lanes(element);
            let at = self.offset(memory, position as u32 * LANES_BYTES);
            self.effect(format_args!("store {ty} {value}, ptr {at}, align 64"));
        }
        memory
    }

    /// Returns the lane set arguments of a request.
    fn lane_set(&mut self, mask: Value) -> String {
        let bits = self.bits(mask);
        let active = self.bit_set(bits);
        let base = self.chunk_base();
        let base = self.instruction(format_args!("trunc i64 {base} to i32"));
        format!("i32 {base}, i32 {active}")
    }

    /// Stores floats, one array of lanes each.
    fn store_lanes(&mut self, values: impl Iterator<Item = Value>) -> Operand {
        let memory = self.request_memory();
        let ty = self.lanes("float");
        for (position, value) in values.enumerate() {
            let operand = self.operand(value, true);
            let at = self.offset(memory, position as u32 * LANES_BYTES);
            self.effect(format_args!("store {ty} {operand}, ptr {at}, align 64"));
        }
        memory
    }

    fn request_memory(&mut self) -> Operand {
        if let Some(memory) = self.requests.request {
            return memory;
        }
        let memory = self.alloca(&format!("[{} x i8]", REQUEST_ARRAYS * LANES_BYTES), 64);
        self.requests.request = Some(memory);
        memory
    }

    fn answer_memory(&mut self) -> Operand {
        if let Some(memory) = self.requests.answer {
            return memory;
        }
        let memory = self.alloca(&format!("[{} x i8]", ANSWER_ARRAYS * LANES_BYTES), 64);
        self.requests.answer = Some(memory);
        memory
    }

    fn call_host(
        &mut self,
        result: Option<&str>,
        function: u32,
        arguments: &str,
    ) -> Option<Operand> {
        let address = self.pointer(PointerSource::Host, function * 8);
        let user = self.pointer(PointerSource::Call, offsets::CALL_USER);
        let comma = if arguments.is_empty() { "" } else { ", " };
        let call = format!("{address}(ptr {user}{comma}{arguments}) #1");
        match result {
            None => {
                self.effect(format_args!("call void {call}"));
                None
            }
            Some(result) => Some(self.instruction(format_args!("call {result} {call}"))),
        }
    }

    /// Emits a call that returns lanes as a mask, off where `mask` is.
    fn call_for_lanes(&mut self, mask: Value, function: u32, arguments: &str) -> Operand {
        let set = self.call_host(Some("i32"), function, arguments).expect("it returns lanes");
        let answered = self.bits_of_set(set);
        let (asked, ty) = (self.bits(mask), self.lanes("i1"));
        self.instruction(format_args!("and {ty} {answered}, {asked}"))
    }

    /// Loads the results of `op` from the `skip`th on from the answer: lanes where `bits` are set, zeros elsewhere.
    fn define_answers(&mut self, op: &Op, skip: usize, bits: Option<Operand>) {
        let memory = self.answer_memory();
        let (ty, mask) = (self.lanes("float"), self.lanes("i1"));
        let zero = self.constant_lanes("float", Operand::Float(0));
        for (position, result) in op.results.iter().skip(skip).enumerate() {
            let at = self.offset(memory, position as u32 * LANES_BYTES);
            let mut lanes = self.instruction(format_args!("load {ty}, ptr {at}, align 64"));
            if let Some(bits) = bits {
                lanes = self
                    .instruction(format_args!("select {mask} {bits}, {ty} {lanes}, {ty} {zero}"));
            }
            self.define(result, lanes);
        }
    }

    fn emit_ambient(&mut self, op: &Op) {
        let memory = self.answer_memory();
        self.call_host(None, offsets::HOST_AMBIENT, &format!("ptr {memory}"));
        for (position, result) in op.results.iter().enumerate() {
            let at = self.offset(memory, position as u32 * 4);
            let component = self.instruction(format_args!("load float, ptr {at}, align 4"));
            self.define(result, component);
        }
    }

    fn emit_report(&mut self) {
        // A host's struct has no field for it.
        if self.callback.is_some() {
            return;
        }
        let (offset, bit) = (offsets::CALL_STATUS, offsets::STATUS_BUDGET);
        let at = self.instruction(format_args!("getelementptr i8, ptr %call, i64 {offset}"));
        let old = self.instruction(format_args!("load i32, ptr {at}, align 4"));
        let new = self.instruction(format_args!("or i32 {old}, {bit}"));
        self.effect(format_args!("store i32 {new}, ptr {at}, align 4"));
    }
}
