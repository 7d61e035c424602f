//! Sequences of operations, branches and loops.

use rtsl_ir::{Scalar, Value};
use rtsl_packet::kernel::{Op, OpKind, Region};

use crate::emitter::Emitter;
use crate::operand::Operand;

impl Emitter<'_, '_> {
    pub fn emit_ops(&mut self, ops: &[Op]) {
        ops.iter().for_each(|op| self.emit_op(op));
    }

    fn emit_op(&mut self, op: &Op) {
        let result = || op.results.get(0);
        match &op.kind {
            OpKind::Constant(constant) => self.define(result(), Operand::constant(*constant)),
            OpKind::Unary(unary, a) => self.emit_unary(result(), *unary, *a),
            OpKind::Binary(binary, a, b) => self.emit_binary(result(), *binary, *a, *b),
            OpKind::Compare(compare, a, b) => self.emit_compare(result(), *compare, *a, *b),
            OpKind::Select(condition, a, b) => self.emit_select(result(), *condition, *a, *b),
            OpKind::Fma(a, b, c) => self.emit_fma(result(), [*a, *b, *c]),
            OpKind::Convert(to, a) => self.emit_convert(result(), *to, *a),
            OpKind::Bitcast(_, a) => self.emit_bitcast(result(), *a),
            OpKind::Reinterpret(_, a) => self.emit_reinterpret(result(), *a),
            OpKind::Unspecified => self.emit_unspecified(result()),
            OpKind::Any(mask) => {
                let any = self.any_lane(*mask);
                self.define(result(), any);
            }
            OpKind::First(mask, value) => self.emit_first(result(), *mask, *value),
            OpKind::Load(variable, index) => self.emit_load(result(), *variable, *index),
            OpKind::Store { variable, index, value, mask } => {
                self.emit_store(*variable, *index, *value, *mask);
            }
            OpKind::Length(variable) => self.emit_length(result(), *variable),
            OpKind::If { condition, then, otherwise } => {
                self.emit_if(op, *condition, then, otherwise);
            }
            OpKind::Loop { initial, body } => self.emit_loop(op, initial, body),
            OpKind::Trace { .. }
            | OpKind::Occluded { .. }
            | OpKind::LightCount
            | OpKind::LightSample { .. }
            | OpKind::Ambient
            | OpKind::Rand(_)
            | OpKind::Query { .. }
            | OpKind::ReportBudget => self.emit_request(op),
        }
    }

    /// Any value is valid, but it must be a single one: frozen, since poison would spread from inactive lanes to
    /// branches.
    fn emit_unspecified(&mut self, result: Value) {
        let ty = self.crossing_type(result);
        let any = self.instruction(format_args!("freeze {ty} poison"));
        self.define_crossing(result, any);
    }

    /// Emits the value of the lowest lane that is on.
    fn emit_first(&mut self, result: Value, mask: Value, value: Value) {
        let operand = self.crossing(value, true);
        if self.width == 1 {
            return self.define(result, operand);
        }
        let bits = self.bits(mask);
        let lane = self.first_lane(bits);
        let ty = self.crossing_type(value);
        let element = self.instruction(format_args!("extractelement {ty} {operand}, i32 {lane}"));
        let is_word_of_mask = self.scalar(value) == Scalar::Bool && ty.element == "i32";
        let element = if is_word_of_mask {
            self.instruction(format_args!("icmp ne i32 {element}, 0"))
        } else {
            element
        };
        self.define(result, element);
    }

    /// Returns the yields of a region, in the forms in which values of these types cross blocks.
    fn emit_yields(&mut self, yields: &[Value], to: &[Value]) -> Vec<Operand> {
        let pairs = yields.iter().zip(to);
        pairs.map(|(value, to)| self.crossing(*value, self.is_lanes(*to))).collect()
    }

    fn emit_if(&mut self, op: &Op, condition: Value, then: &Region, otherwise: &Region) {
        let results: Vec<Value> = op.results.iter().collect();
        let condition = self.uniform(condition);
        let (join, then_label) = (self.new_label(), self.new_label());
        let empty = otherwise.ops.is_empty();
        // A side without operations is the edge from here to the join.
        let before = if empty { self.emit_yields(&otherwise.yields, &results) } else { Vec::new() };
        let otherwise_label = if empty { join } else { self.new_label() };
        let mut otherwise_end = self.block();
        self.branch(condition, then_label, otherwise_label);

        self.begin_block(then_label);
        let then_operands = self.emit_region(then, &results);
        let then_end = self.block();
        self.jump(join);
        let mut otherwise_operands = before;
        if !empty {
            self.begin_block(otherwise_label);
            otherwise_operands = self.emit_region(otherwise, &results);
            otherwise_end = self.block();
            self.jump(join);
        }

        self.begin_block(join);
        let pairs = then_operands.into_iter().zip(otherwise_operands);
        let joined: Vec<(Operand, Operand)> = pairs.collect();
        let mut phis = Vec::new();
        for (result, (then, otherwise)) in results.iter().zip(joined) {
            let ty = self.crossing_type(*result);
            let (then, otherwise) = ((then, then_end), (otherwise, otherwise_end));
            phis.push(self.phi(ty, &[then, otherwise]));
        }
        for (result, phi) in results.iter().zip(phis) {
            self.define_crossing(*result, phi);
        }
    }

    fn emit_region(&mut self, region: &Region, results: &[Value]) -> Vec<Operand> {
        let begin = self.values.begin_region();
        self.emit_ops(&region.ops);
        let operands = self.emit_yields(&region.yields, results);
        self.values.end_region(begin);
        operands
    }

    fn emit_loop(&mut self, op: &Op, initial: &[Value], body: &Region) {
        let results: Vec<Value> = op.results.iter().collect();
        let first = self.emit_yields(initial, &body.params);
        let before = self.block();
        let (start, after) = (self.new_label(), self.new_label());
        self.jump(start);
        self.begin_block(start);
        let mut phi_at = self.here();
        let phis: Vec<Operand> = body.params.iter().map(|_| self.new_local()).collect();
        let begin = self.values.begin_region();
        // The phis are named in advance; their text is inserted once the incoming values are known.
        let mut types = Vec::new();
        for (param, phi) in body.params.iter().zip(&phis) {
            types.push(self.crossing_type(*param));
            self.define_crossing(*param, *phi);
        }
        self.emit_ops(&body.ops);
        let next = self.emit_yields(&body.yields[1..], &body.params);
        let last = self.emit_yields(&body.yields[1..], &results);
        let again = self.uniform(body.yields[0]);
        self.values.end_region(begin);
        let end = self.block();
        self.branch(again, start, after);
        for (((phi, ty), first), next) in phis.iter().zip(&types).zip(first).zip(next) {
            let before_text = self.here();
            self.insert_phi(phi_at, *phi, *ty, &[(first, before), (next, end)]);
            phi_at += self.here() - before_text;
        }

        self.begin_block(after);
        for (result, last) in results.iter().zip(last) {
            self.define_crossing(*result, last);
        }
    }
}
