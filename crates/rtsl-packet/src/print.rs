//! The text form of kernels, for debugging and tests.
//!
//! Types are `f32` for a uniform value, `f32xW` for lanes and `mask` for lanes of bool. An operation is one line,
//! `results = name operands : types`; regions are indented.

use std::fmt::{self, Display, Formatter};

use rtsl_ir::{
    BinaryOp, CompareOp, Constant, Index, Scalar, UnaryOp, Value, VariableId, VariableKind,
};

use crate::Kernel;
use crate::kernel::{KernelVariable, Op, OpKind, Region, Type};

impl Display for Type {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        match (self.scalar, self.lanes) {
            (Scalar::Bool, true) => f.write_str("mask"),
            (scalar, true) => write!(f, "{}xW", scalar.name()),
            (scalar, false) => f.write_str(scalar.name()),
        }
    }
}

impl Display for Kernel {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        write!(f, "kernel {} {} W={}", self.name, self.mode.name(), self.width)?;
        if let Some(interleave) = self.interleave {
            write!(f, " full=W*{interleave}")?;
        }
        writeln!(f, " {{")?;
        for variable in &self.variables {
            writeln!(f, "  {}", KernelVariableText(variable))?;
        }
        let printer = Printer { kernel: self };
        writeln!(f, "  prologue {{")?;
        printer.ops(f, &self.prologue, 2)?;
        writeln!(f, "  }}")?;
        writeln!(f, "  chunk {} {{", printer.params(&self.body))?;
        printer.ops(f, &self.body, 2)?;
        writeln!(f, "  }}")?;
        for (output, value) in self.outputs.iter().zip(&self.body.yields) {
            let name = &self.variable(output.variable).variable.name;
            writeln!(f, "  {name}[{}] = {}", output.component, Name(*value))?;
        }
        writeln!(f, "}}")
    }
}

struct KernelVariableText<'a>(&'a KernelVariable);

impl Display for KernelVariableText<'_> {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        let KernelVariable { variable, varies, location, of_objects } = self.0;
        let ty = Type { scalar: variable.scalar, lanes: *varies };
        write!(f, "{} {}: {ty}[{}]", variable.kind.name(), variable.name, variable.len)?;
        match variable.kind {
            VariableKind::Local | VariableKind::Accepted => Ok(()),
            VariableKind::State
            | VariableKind::Member
            | VariableKind::Parameter
            | VariableKind::Scratch
            | VariableKind::Buffer
                if *of_objects =>
            {
                write!(f, " at {location} of objects")
            }
            VariableKind::State
            | VariableKind::Member
            | VariableKind::Parameter
            | VariableKind::Scratch
            | VariableKind::Buffer => write!(f, " at {location}"),
        }
    }
}

struct Name(Value);

impl Display for Name {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        write!(f, "%{}", self.0.0)
    }
}

struct Names<'a>(&'a [Value]);

impl Display for Names<'_> {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        for (position, value) in self.0.iter().enumerate() {
            let comma = if position == 0 { "" } else { ", " };
            write!(f, "{comma}{}", Name(*value))?;
        }
        Ok(())
    }
}

struct Printer<'a> {
    kernel: &'a Kernel,
}

impl Printer<'_> {
    fn params(&self, region: &Region) -> String {
        let params = region.params.iter();
        let params = params.map(|param| format!("{}: {}", Name(*param), self.kernel.ty(*param)));
        format!("({})", params.collect::<Vec<_>>().join(", "))
    }

    fn ops(&self, f: &mut Formatter<'_>, region: &Region, depth: usize) -> fmt::Result {
        region.ops.iter().try_for_each(|op| self.op(f, op, depth))
    }

    fn op(&self, f: &mut Formatter<'_>, op: &Op, depth: usize) -> fmt::Result {
        write!(f, "{:1$}", "", 2 * depth)?;
        let results: Vec<Value> = op.results.iter().collect();
        if !results.is_empty() {
            write!(f, "{} = ", Names(&results))?;
        }
        match &op.kind {
            OpKind::If { condition, then, otherwise } => {
                writeln!(f, "if {} {{", Name(*condition))?;
                self.region(f, then, depth + 1)?;
                if !otherwise.ops.is_empty() || !otherwise.yields.is_empty() {
                    writeln!(f, "{:1$}}} else {{", "", 2 * depth)?;
                    self.region(f, otherwise, depth + 1)?;
                }
                write!(f, "{:1$}}}", "", 2 * depth)?;
            }
            OpKind::Loop { initial, body } => {
                writeln!(f, "loop ({}) {} {{", Names(initial), self.params(body))?;
                self.region(f, body, depth + 1)?;
                write!(f, "{:1$}}}", "", 2 * depth)?;
            }
            kind => self.plain(f, kind)?,
        }
        let types: Vec<String> =
            results.iter().map(|result| self.kernel.ty(*result).to_string()).collect();
        let colon = if types.is_empty() { "" } else { " : " };
        writeln!(f, "{colon}{}", types.join(", "))
    }

    fn region(&self, f: &mut Formatter<'_>, region: &Region, depth: usize) -> fmt::Result {
        self.ops(f, region, depth)?;
        if region.yields.is_empty() {
            return Ok(());
        }
        writeln!(f, "{:2$}yield {}", "", Names(&region.yields), 2 * depth)
    }

    fn plain(&self, f: &mut Formatter<'_>, kind: &OpKind) -> fmt::Result {
        match kind {
            OpKind::Constant(constant) => write!(f, "{}", ConstantText(*constant))?,
            OpKind::Unary(op, _) => f.write_str(unary_name(*op))?,
            OpKind::Binary(op, ..) => f.write_str(binary_name(*op))?,
            OpKind::Compare(op, ..) => f.write_str(compare_name(*op))?,
            OpKind::Select(..) => f.write_str("select")?,
            OpKind::Fma(..) => f.write_str("fma")?,
            OpKind::Convert(..) => f.write_str("convert")?,
            OpKind::Bitcast(..) => f.write_str("bitcast")?,
            OpKind::Reinterpret(..) => f.write_str("reinterpret")?,
            OpKind::Unspecified => f.write_str("unspecified")?,
            OpKind::Any(_) => f.write_str("any")?,
            OpKind::First(..) => f.write_str("first")?,
            OpKind::Load(variable, index) => return self.load(f, *variable, *index),
            OpKind::Store { variable, index, value, mask } => {
                self.element(f, "store ", *variable, *index)?;
                write!(f, " {}", Name(*value))?;
                return mask.map_or(Ok(()), |mask| write!(f, " where {}", Name(mask)));
            }
            OpKind::Length(variable) => {
                return write!(f, "length {}", self.kernel.variable(*variable).variable.name);
            }
            OpKind::If { .. } => f.write_str("if")?,
            OpKind::Loop { .. } => f.write_str("loop")?,
            OpKind::Trace { .. } => f.write_str("trace")?,
            OpKind::Occluded { .. } => f.write_str("occluded")?,
            OpKind::LightCount => f.write_str("light_count")?,
            OpKind::LightSample { .. } => f.write_str("light_sample")?,
            OpKind::Ambient => f.write_str("ambient")?,
            OpKind::Rand(_) => f.write_str("rand")?,
            OpKind::Query { query, .. } => write!(f, "query {}", query.name())?,
            OpKind::ReportBudget => f.write_str("report_budget")?,
        }
        let mut operands = Vec::new();
        kind.for_each_operand(|operand| operands.push(operand));
        let space = if operands.is_empty() { "" } else { " " };
        write!(f, "{space}{}", Names(&operands))
    }

    fn load(&self, f: &mut Formatter<'_>, variable: VariableId, index: Index) -> fmt::Result {
        self.element(f, "load ", variable, index)
    }

    fn element(
        &self,
        f: &mut Formatter<'_>,
        verb: &str,
        variable: VariableId,
        index: Index,
    ) -> fmt::Result {
        let name = &self.kernel.variable(variable).variable.name;
        match index {
            Index::Constant(index) => write!(f, "{verb}{name}[{index}]"),
            Index::Dynamic(index) => write!(f, "{verb}{name}[{}]", Name(index)),
        }
    }
}

struct ConstantText(Constant);

impl Display for ConstantText {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        match self.0 {
            Constant::F32(value) if value.is_nan() => write!(f, "nan({:#x})", value.to_bits()),
            Constant::F32(value) => write!(f, "{value:?}"),
            Constant::I32(value) => write!(f, "{value}"),
            Constant::U32(value) => write!(f, "{value}u"),
            Constant::Bool(value) => write!(f, "{value}"),
        }
    }
}

fn unary_name(op: UnaryOp) -> &'static str {
    match op {
        UnaryOp::Negate => "negate",
        UnaryOp::Not => "not",
        UnaryOp::Abs => "abs",
        UnaryOp::Sqrt => "sqrt",
        UnaryOp::Floor => "floor",
        UnaryOp::Ceil => "ceil",
        UnaryOp::Trunc => "trunc",
        UnaryOp::RoundEven => "round_even",
        UnaryOp::ApproximateReciprocal => "approximate_reciprocal",
        UnaryOp::ApproximateInverseSqrt => "approximate_inverse_sqrt",
        UnaryOp::ApproximateSqrt => "approximate_sqrt",
        UnaryOp::Seldom => "seldom",
    }
}

fn binary_name(op: BinaryOp) -> &'static str {
    match op {
        BinaryOp::Add => "add",
        BinaryOp::Subtract => "subtract",
        BinaryOp::Multiply => "multiply",
        BinaryOp::Divide => "divide",
        BinaryOp::Remainder => "remainder",
        BinaryOp::Min => "min",
        BinaryOp::Max => "max",
        BinaryOp::And => "and",
        BinaryOp::Or => "or",
        BinaryOp::Xor => "xor",
        BinaryOp::ShiftLeft => "shift_left",
        BinaryOp::ShiftRight => "shift_right",
        BinaryOp::MultiplyHigh => "multiply_high",
    }
}

fn compare_name(op: CompareOp) -> &'static str {
    match op {
        CompareOp::Equal => "equal",
        CompareOp::NotEqual => "not_equal",
        CompareOp::Less => "less",
        CompareOp::LessEqual => "less_equal",
        CompareOp::Greater => "greater",
        CompareOp::GreaterEqual => "greater_equal",
    }
}
