//! Pure operations: LLVM's instructions where they have the same semantics for all operands, else equivalent sequences.

use rtsl_ir::evaluate::CANONICAL_NAN;
use rtsl_ir::{BinaryOp, CompareOp, Scalar, UnaryOp, Value};

use crate::emitter::Emitter;
use crate::fma;
use crate::operand::{LlvmType, Operand, register_element};

/// 2^31 and 2^32 as the bits of f32.
const TWO_TO_31: u32 = 0x4f00_0000;
const TWO_TO_32: u32 = 0x4f80_0000;

impl Emitter<'_, '_> {
    /// Returns a constant of the scalar type, splatted for a vector type.
    pub fn literal(&mut self, ty: LlvmType, constant: Operand) -> Operand {
        if ty.is_vector() { self.constant_lanes(ty.element, constant) } else { constant }
    }

    pub fn compare(&mut self, predicate: &str, ty: LlvmType, a: Operand, b: Operand) -> Operand {
        let class = if ty.element == "float" { "fcmp" } else { "icmp" };
        self.instruction(format_args!("{class} {predicate} {ty} {a}, {b}"))
    }

    pub fn select(&mut self, ty: LlvmType, condition: Operand, a: Operand, b: Operand) -> Operand {
        let bit = ty.of("i1");
        self.instruction(format_args!("select {bit} {condition}, {ty} {a}, {ty} {b}"))
    }

    pub fn binary(&mut self, name: &str, ty: LlvmType, a: Operand, b: Operand) -> Operand {
        self.instruction(format_args!("{name} {ty} {a}, {b}"))
    }

    fn cast(&mut self, name: &str, from: LlvmType, a: Operand, to: LlvmType) -> Operand {
        self.instruction(format_args!("{name} {from} {a} to {to}"))
    }

    // Unary.

    pub fn emit_unary(&mut self, result: Value, op: UnaryOp, a: Value) {
        let lanes = self.is_lanes(result);
        if self.scalar(a) == Scalar::Bool {
            return self.emit_not(result, a, lanes);
        }
        self.record_reciprocal(result, op, a);
        let ty = self.register_type(result);
        let a = self.operand(a, lanes);
        let float = ty.element == "float";
        let operand = match op {
            UnaryOp::Negate if float => self.instruction(format_args!("fneg {ty} {a}")),
            UnaryOp::Negate => {
                let zero = self.literal(ty, Operand::Int(0));
                self.binary("sub", ty, zero, a)
            }
            UnaryOp::Not => {
                let ones = self.literal(ty, Operand::Int(-1));
                self.binary("xor", ty, a, ones)
            }
            UnaryOp::Abs if float => self.float_intrinsic("fabs", ty, a),
            UnaryOp::Abs if self.scalar(result) == Scalar::U32 => a,
            UnaryOp::Abs => {
                let wrap = LlvmType { element: "i1", count: 1 };
                let name = format!("llvm.abs.{}", ty.suffix());
                self.module.declare(format!("{ty} @{name}({ty}, i1 immarg)"));
                self.instruction(format_args!("call {ty} @{name}({ty} {a}, {wrap} false)"))
            }
            UnaryOp::Sqrt => self.float_intrinsic("sqrt", ty, a),
            UnaryOp::Floor => self.float_intrinsic("floor", ty, a),
            UnaryOp::Ceil => self.float_intrinsic("ceil", ty, a),
            UnaryOp::Trunc => self.float_intrinsic("trunc", ty, a),
            UnaryOp::RoundEven => self.float_intrinsic("roundeven", ty, a),
            UnaryOp::ApproximateReciprocal => self.approximate_reciprocal(ty, a),
            UnaryOp::ApproximateInverseSqrt => self.approximate_inverse_sqrt(ty, a),
            UnaryOp::ApproximateSqrt => self.approximate_sqrt(ty, a),
            UnaryOp::Seldom => unreachable!("the lowering makes a branch of it"),
        };
        self.define(result, operand);
    }

    pub fn float_intrinsic(&mut self, name: &str, ty: LlvmType, a: Operand) -> Operand {
        self.intrinsic(&format!("llvm.{name}.{}", ty.suffix()), ty, &[(ty, a)])
    }

    fn emit_not(&mut self, result: Value, a: Value, lanes: bool) {
        if lanes && self.prefers_words(&[a]) {
            let (ty, words) = (self.lanes("i32"), self.words(a));
            let ones = self.literal(ty, Operand::Int(-1));
            let inverse = self.binary("xor", ty, words, ones);
            return self.define_crossing(result, inverse);
        }
        let (ty, a) = (self.register_type(result), self.operand(a, lanes));
        let ones = self.literal(ty, Operand::Bool(true));
        let inverse = self.binary("xor", ty, a, ones);
        self.define(result, inverse);
    }

    // Binary.

    pub fn emit_binary(&mut self, result: Value, op: BinaryOp, a: Value, b: Value) {
        let (lanes, scalar) = (self.is_lanes(result), self.scalar(result));
        if self.emit_class_test(result, op, a, b) {
            return;
        }
        if scalar == Scalar::Bool && lanes && self.prefers_words(&[a, b]) {
            let (ty, a, b) = (self.lanes("i32"), self.words(a), self.words(b));
            let words = self.binary(logical_name(op), ty, a, b);
            return self.define_crossing(result, words);
        }
        let (op, a, b) = match self.quotient(op, a, b) {
            Some((dividend, divisor)) => (BinaryOp::Divide, dividend, divisor),
            None => (op, a, b),
        };
        let ty = self.register_type(result);
        let (a, b) = (self.operand(a, lanes), self.operand(b, lanes));
        let operand = match scalar {
            Scalar::F32 => self.float_binary(op, ty, a, b),
            Scalar::I32 => self.integer_binary(op, ty, a, b, true),
            Scalar::U32 => self.integer_binary(op, ty, a, b, false),
            Scalar::Bool => self.binary(logical_name(op), ty, a, b),
        };
        self.define(result, operand);
    }

    fn float_binary(&mut self, op: BinaryOp, ty: LlvmType, a: Operand, b: Operand) -> Operand {
        let name = match op {
            BinaryOp::Add => "fadd",
            BinaryOp::Subtract => "fsub",
            BinaryOp::Multiply => "fmul",
            BinaryOp::Divide => "fdiv",
            BinaryOp::Min => {
                let less = self.compare("olt", ty, b, a);
                return self.select(ty, less, b, a);
            }
            BinaryOp::Max => {
                let less = self.compare("olt", ty, a, b);
                return self.select(ty, less, b, a);
            }
            BinaryOp::Remainder
            | BinaryOp::And
            | BinaryOp::Or
            | BinaryOp::Xor
            | BinaryOp::ShiftLeft
            | BinaryOp::ShiftRight
            | BinaryOp::MultiplyHigh => unreachable!("{op:?} of f32"),
        };
        self.binary(name, ty, a, b)
    }

    fn integer_binary(
        &mut self,
        op: BinaryOp,
        ty: LlvmType,
        a: Operand,
        b: Operand,
        signed: bool,
    ) -> Operand {
        let (min, max) = if signed { ("smin", "smax") } else { ("umin", "umax") };
        match op {
            BinaryOp::Add => self.binary("add", ty, a, b),
            BinaryOp::Subtract => self.binary("sub", ty, a, b),
            BinaryOp::Multiply => self.binary("mul", ty, a, b),
            BinaryOp::Divide => self.integer_divide(ty, a, b, signed),
            BinaryOp::Remainder => self.integer_remainder(ty, a, b, signed),
            BinaryOp::Min => self.clamp_one_side(min, ty, a, b),
            BinaryOp::Max => self.clamp_one_side(max, ty, a, b),
            BinaryOp::And | BinaryOp::Or | BinaryOp::Xor => self.binary(logical_name(op), ty, a, b),
            BinaryOp::ShiftLeft => {
                let count = self.shift_count(ty, b);
                self.binary("shl", ty, a, count)
            }
            BinaryOp::ShiftRight => {
                let count = self.shift_count(ty, b);
                self.binary(if signed { "ashr" } else { "lshr" }, ty, a, count)
            }
            BinaryOp::MultiplyHigh => self.multiply_high(ty, a, b, signed),
        }
    }

    /// Emits `llvm.NAME`, one of smin, smax, umin, umax.
    pub fn clamp_one_side(&mut self, name: &str, ty: LlvmType, a: Operand, b: Operand) -> Operand {
        self.intrinsic(&format!("llvm.{name}.{}", ty.suffix()), ty, &[(ty, a), (ty, b)])
    }

    fn shift_count(&mut self, ty: LlvmType, count: Operand) -> Operand {
        let low = self.literal(ty, Operand::Int(31));
        self.binary("and", ty, count, low)
    }

    fn multiply_high(&mut self, ty: LlvmType, a: Operand, b: Operand, signed: bool) -> Operand {
        let (wide, extend) = (ty.of("i64"), if signed { "sext" } else { "zext" });
        let a = self.cast(extend, ty, a, wide);
        let b = self.cast(extend, ty, b, wide);
        let product = self.binary("mul", wide, a, b);
        let shift = self.literal(wide, Operand::Int(32));
        let high = self.binary("lshr", wide, product, shift);
        self.cast("trunc", wide, high, ty)
    }

    /// Returns a divisor that is valid for LLVM: 1 instead of 0, and instead of -1 for the least i32, where the
    /// quotient by 1 is the wrapped one. Also returns the mask of the lanes where it was 0.
    fn safe_divisor(
        &mut self,
        ty: LlvmType,
        a: Operand,
        b: Operand,
        signed: bool,
    ) -> (Operand, Operand) {
        let zero = self.literal(ty, Operand::Int(0));
        let is_zero = self.compare("eq", ty, b, zero);
        let mut unsafe_ = is_zero;
        if signed {
            let least = self.literal(ty, Operand::Int(i32::MIN));
            let minus_one = self.literal(ty, Operand::Int(-1));
            let is_least = self.compare("eq", ty, a, least);
            let is_minus_one = self.compare("eq", ty, b, minus_one);
            let bit = ty.of("i1");
            let overflows = self.binary("and", bit, is_least, is_minus_one);
            unsafe_ = self.binary("or", bit, is_zero, overflows);
        }
        let one = self.literal(ty, Operand::Int(1));
        (self.select(ty, unsafe_, one, b), is_zero)
    }

    fn integer_divide(&mut self, ty: LlvmType, a: Operand, b: Operand, signed: bool) -> Operand {
        let (divisor, is_zero) = self.safe_divisor(ty, a, b, signed);
        let quotient = self.plain_divide(ty, a, divisor, signed);
        let zero = self.literal(ty, Operand::Int(0));
        self.select(ty, is_zero, zero, quotient)
    }

    fn integer_remainder(&mut self, ty: LlvmType, a: Operand, b: Operand, signed: bool) -> Operand {
        // The remainder of division by 1, which replaces 0, is 0 as required.
        let (divisor, _) = self.safe_divisor(ty, a, b, signed);
        if !ty.is_vector() {
            return self.binary(if signed { "srem" } else { "urem" }, ty, a, divisor);
        }
        let quotient = self.plain_divide(ty, a, divisor, signed);
        let product = self.binary("mul", ty, quotient, divisor);
        self.binary("sub", ty, a, product)
    }

    /// Emits an integer division. Machines have no vector instruction for it, but an f64 represents all 32-bit
    /// integers, and the distance of a quotient that is not an integer from the next integer exceeds the rounding error
    /// of f64.
    fn plain_divide(&mut self, ty: LlvmType, a: Operand, b: Operand, signed: bool) -> Operand {
        if !ty.is_vector() {
            return self.binary(if signed { "sdiv" } else { "udiv" }, ty, a, b);
        }
        let double = ty.of("double");
        let (to, from) = if signed { ("sitofp", "fptosi") } else { ("uitofp", "fptoui") };
        let a = self.cast(to, ty, a, double);
        let b = self.cast(to, ty, b, double);
        let quotient = self.binary("fdiv", double, a, b);
        self.cast(from, double, quotient, ty)
    }

    // Other operations.

    pub fn emit_compare(&mut self, result: Value, op: CompareOp, a: Value, b: Value) {
        self.record_bound_test(result, op, a, b);
        let (lanes, scalar) = (self.is_lanes(result), self.scalar(a));
        let element = register_element(scalar);
        let ty = self.vector(element, lanes);
        let predicate = match (scalar, op) {
            (Scalar::F32, CompareOp::Equal) => "oeq",
            (Scalar::F32, CompareOp::NotEqual) => "une",
            (Scalar::F32, CompareOp::Less) => "olt",
            (Scalar::F32, CompareOp::LessEqual) => "ole",
            (Scalar::F32, CompareOp::Greater) => "ogt",
            (Scalar::F32, CompareOp::GreaterEqual) => "oge",
            (_, CompareOp::Equal) => "eq",
            (_, CompareOp::NotEqual) => "ne",
            (Scalar::I32, CompareOp::Less) => "slt",
            (Scalar::I32, CompareOp::LessEqual) => "sle",
            (Scalar::I32, CompareOp::Greater) => "sgt",
            (Scalar::I32, CompareOp::GreaterEqual) => "sge",
            (Scalar::U32 | Scalar::Bool, CompareOp::Less) => "ult",
            (Scalar::U32 | Scalar::Bool, CompareOp::LessEqual) => "ule",
            (Scalar::U32 | Scalar::Bool, CompareOp::Greater) => "ugt",
            (Scalar::U32 | Scalar::Bool, CompareOp::GreaterEqual) => "uge",
        };
        let (a, b) = (self.operand(a, lanes), self.operand(b, lanes));
        let operand = self.compare(predicate, ty, a, b);
        self.define(result, operand);
    }

    pub fn emit_select(&mut self, result: Value, condition: Value, a: Value, b: Value) {
        let (ty, lanes) = (self.crossing_type(result), self.is_lanes(result));
        let by_lane = self.is_lanes(condition);
        let condition = self.operand(condition, by_lane);
        let condition_type = self.vector("i1", by_lane);
        let (a, b) = (self.crossing(a, lanes), self.crossing(b, lanes));
        let operand = self
            .instruction(format_args!("select {condition_type} {condition}, {ty} {a}, {ty} {b}"));
        self.define_crossing(result, operand);
    }

    pub fn emit_fma(&mut self, result: Value, operands: [Value; 3]) {
        let (ty, lanes) = (self.register_type(result), self.is_lanes(result));
        let [a, b, c] = operands.map(|operand| self.fma_operand(ty, operand, lanes));
        let operand = if self.module.target.fma {
            let name = format!("llvm.fma.{}", ty.suffix());
            self.intrinsic(&name, ty, &[(ty, a), (ty, b), (ty, c)])
        } else {
            let (name, text) = fma::emulation(ty);
            self.module.define_helper(&name, || text);
            self.instruction(format_args!("call {ty} {name}({ty} {a}, {ty} {b}, {ty} {c})"))
        };
        self.define(result, operand);
    }

    pub fn emit_bitcast(&mut self, result: Value, a: Value) {
        let (lanes, to) = (self.is_lanes(result), self.register_type(result));
        let bits = self.reinterpreted(result, a);
        if self.scalar(a) != Scalar::F32 || to.element == "float" {
            return self.define(result, bits);
        }
        let (from, a) = (to.of("float"), self.operand(a, lanes));
        let is_number = self.compare("ord", from, a, a);
        let nan = self.literal(to, Operand::Int(CANONICAL_NAN as i32));
        let operand = self.select(to, is_number, bits, nan);
        self.define(result, operand);
    }

    pub fn emit_reinterpret(&mut self, result: Value, a: Value) {
        let bits = self.reinterpreted(result, a);
        self.define(result, bits);
    }

    /// Returns the bits of `a` as the type of `result`.
    fn reinterpreted(&mut self, result: Value, a: Value) -> Operand {
        let lanes = self.is_lanes(result);
        let from = self.vector(register_element(self.scalar(a)), lanes);
        let to = self.register_type(result);
        let a = self.operand(a, lanes);
        if from == to { a } else { self.cast("bitcast", from, a, to) }
    }

    pub fn emit_convert(&mut self, result: Value, to: Scalar, a: Value) {
        let (lanes, from) = (self.is_lanes(result), self.scalar(a));
        let source = self.vector(register_element(from), lanes);
        let target = self.register_type(result);
        let a = self.operand(a, lanes);
        let operand = match (from, to) {
            (Scalar::F32, Scalar::F32) | (Scalar::Bool, Scalar::Bool) => a,
            (Scalar::I32 | Scalar::U32, Scalar::I32 | Scalar::U32) => a,
            (Scalar::F32, Scalar::I32) => self.float_to_signed(source, a, target),
            (Scalar::F32, Scalar::U32) => self.float_to_unsigned(source, a, target),
            (Scalar::I32, Scalar::F32) => self.cast("sitofp", source, a, target),
            (Scalar::U32, Scalar::F32) => self.cast("uitofp", source, a, target),
            (Scalar::Bool, Scalar::F32) => {
                let one = self.literal(target, Operand::Float(1.0_f32.to_bits()));
                let zero = self.literal(target, Operand::Float(0));
                self.select(target, a, one, zero)
            }
            (Scalar::Bool, Scalar::I32 | Scalar::U32) => self.cast("zext", source, a, target),
            (Scalar::F32, Scalar::Bool) => {
                let zero = self.literal(source, Operand::Float(0));
                self.compare("une", source, a, zero)
            }
            (Scalar::I32 | Scalar::U32, Scalar::Bool) => {
                let zero = self.literal(source, Operand::Int(0));
                self.compare("ne", source, a, zero)
            }
        };
        self.define(result, operand);
    }

    /// Converts towards zero, saturating, NaN to 0. LLVM's intrinsic for this is scalarised. A conversion that is out
    /// of range is poison until it is frozen and replaced.
    fn float_to_signed(&mut self, from: LlvmType, a: Operand, to: LlvmType) -> Operand {
        let least = self.literal(from, Operand::Float((-2_147_483_648.0_f32).to_bits()));
        let bound = self.literal(from, Operand::Float(TWO_TO_31));
        let greater = self.compare("ogt", from, a, least);
        let clamped = self.select(from, greater, a, least);
        let converted = self.cast("fptosi", from, clamped, to);
        let any = self.instruction(format_args!("freeze {to} {converted}"));
        let too_large = self.compare("oge", from, a, bound);
        let greatest = self.literal(to, Operand::Int(i32::MAX));
        let saturated = self.select(to, too_large, greatest, any);
        let is_number = self.compare("ord", from, a, a);
        let zero = self.literal(to, Operand::Int(0));
        self.select(to, is_number, saturated, zero)
    }

    fn float_to_unsigned(&mut self, from: LlvmType, a: Operand, to: LlvmType) -> Operand {
        let least = self.literal(from, Operand::Float(0));
        let bound = self.literal(from, Operand::Float(TWO_TO_32));
        // False for a NaN, which thus becomes 0.
        let greater = self.compare("ogt", from, a, least);
        let clamped = self.select(from, greater, a, least);
        let converted = self.cast("fptoui", from, clamped, to);
        let any = self.instruction(format_args!("freeze {to} {converted}"));
        let too_large = self.compare("oge", from, a, bound);
        let greatest = self.literal(to, Operand::Int(-1));
        self.select(to, too_large, greatest, any)
    }
}

fn logical_name(op: BinaryOp) -> &'static str {
    match op {
        BinaryOp::And => "and",
        BinaryOp::Or => "or",
        BinaryOp::Xor => "xor",
        other => unreachable!("{other:?} of bools"),
    }
}
