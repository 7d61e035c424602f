//! Writes the text form.

use std::fmt::{self, Display, Formatter, Write};

use crate::{Constant, Function, Index, Op, OpKind, ReferencePath, Region, Value, VariableId};

impl Display for Function {
    fn fmt(&self, out: &mut Formatter<'_>) -> fmt::Result {
        writeln!(out, "function {}", self.name)?;
        for variable in &self.variables {
            let (kind, scalar) = (variable.kind.name(), variable.scalar.name());
            writeln!(out, "{kind} {}: {scalar}[{}]", variable.name, variable.len)?;
        }
        writeln!(out, "{{")?;
        Printer { function: self, out, depth: 1, regions: true }.body()?;
        writeln!(out, "}}")
    }
}

impl Display for Value {
    fn fmt(&self, out: &mut Formatter<'_>) -> fmt::Result {
        write!(out, "%{}", self.0)
    }
}

impl Display for Constant {
    fn fmt(&self, out: &mut Formatter<'_>) -> fmt::Result {
        match self {
            // Equality of constants includes the payload of a NaN, so the bits are printed.
            Constant::F32(value) if value.is_nan() => write!(out, "{:#x}", value.to_bits()),
            Constant::F32(value) => write!(out, "{value:?}"),
            Constant::I32(value) => write!(out, "{value}"),
            Constant::U32(value) => write!(out, "{value}"),
            Constant::Bool(value) => write!(out, "{value}"),
        }
    }
}

/// Returns the first line of the text form of an operation.
pub(crate) fn op_line(function: &Function, op: &Op) -> String {
    struct Line<'a>(&'a Function, &'a Op);
    impl Display for Line<'_> {
        fn fmt(&self, out: &mut Formatter<'_>) -> fmt::Result {
            Printer { function: self.0, out, depth: 0, regions: false }.op(self.1)
        }
    }
    Line(function, op).to_string().lines().next().unwrap_or_default().to_owned()
}

struct Printer<'a, 'b> {
    function: &'a Function,
    out: &'a mut Formatter<'b>,
    depth: usize,
    /// Print the regions in braces. Nesting is unbounded if the function is not verified.
    regions: bool,
}

impl Printer<'_, '_> {
    fn body(&mut self) -> fmt::Result {
        let function = self.function;
        self.ops(&function.body)?;
        self.indent()?;
        self.out.write_str("return")?;
        let mut separator = " ";
        for (output, value) in function.outputs.iter().zip(&function.body.yields) {
            self.out.write_str(separator)?;
            self.variable(output.variable)?;
            write!(self.out, "@{} = {value}", output.component)?;
            separator = ", ";
        }
        self.out.write_char('\n')
    }

    fn indent(&mut self) -> fmt::Result {
        (0..self.depth).try_for_each(|_| self.out.write_str("  "))
    }

    fn ops(&mut self, region: &Region) -> fmt::Result {
        region.ops.iter().try_for_each(|op| self.op(op))
    }

    fn op(&mut self, op: &Op) -> fmt::Result {
        self.indent()?;
        for (position, value) in op.results.iter().enumerate() {
            let separator = if position == 0 { "" } else { ", " };
            self.out.write_str(separator)?;
            self.definition(value)?;
        }
        if op.results.count > 0 {
            self.out.write_str(" = ")?;
        }
        if op.precise {
            self.out.write_str("precise ")?;
        }
        self.kind(&op.kind)?;
        self.out.write_char('\n')
    }

    fn kind(&mut self, kind: &OpKind) -> fmt::Result {
        match kind {
            OpKind::Constant(constant) => write!(self.out, "constant {constant}"),
            OpKind::Unary(op, _) => self.plain(op.name(), kind),
            OpKind::Binary(op, ..) => self.plain(op.name(), kind),
            OpKind::Compare(op, ..) => self.plain(op.name(), kind),
            OpKind::Select(..) => self.plain("select", kind),
            OpKind::Fma(..) => self.plain("fma", kind),
            OpKind::Convert(..) => self.plain("convert", kind),
            OpKind::Bitcast(..) => self.plain("bitcast", kind),
            OpKind::Load(variable, index) => {
                self.out.write_str("load ")?;
                self.element(*variable, *index)
            }
            OpKind::Store(variable, index, value) => {
                self.out.write_str("store ")?;
                self.element(*variable, *index)?;
                write!(self.out, ", {value}")
            }
            OpKind::Length(variable) => {
                self.out.write_str("length ")?;
                self.variable(*variable)
            }
            OpKind::If { condition, then, otherwise } => {
                writeln!(self.out, "if {condition} {{")?;
                self.region(then, "yield")?;
                self.out.write_str(" else {\n")?;
                self.region(otherwise, "yield")
            }
            OpKind::Loop { initial, body } => {
                self.out.write_str("loop (")?;
                for (position, (param, value)) in body.params.iter().zip(initial).enumerate() {
                    let separator = if position == 0 { "" } else { ", " };
                    self.out.write_str(separator)?;
                    self.definition(*param)?;
                    write!(self.out, " = {value}")?;
                }
                self.out.write_str(") {\n")?;
                self.region(body, "repeat")
            }
            OpKind::Trace { .. } => self.plain("trace", kind),
            OpKind::Occluded { .. } => self.plain("occluded", kind),
            OpKind::LightCount => self.plain("light_count", kind),
            OpKind::LightSample { .. } => self.plain("light_sample", kind),
            OpKind::Ambient => self.plain("ambient", kind),
            OpKind::Rand => self.plain("rand", kind),
            OpKind::Query(query, _) => {
                self.out.write_str("query ")?;
                self.plain(query.name(), kind)
            }
            OpKind::ReferenceCall(call) => {
                let (role, method) = (call.role.name(), call.method.name());
                write!(self.out, "call {role}.{method} of {}", call.member)?;
                self.path(call.path)?;
                self.out.write_str(" (")?;
                for (position, (component, value)) in call.overrides.iter().enumerate() {
                    let separator = if position == 0 { "" } else { ", " };
                    write!(self.out, "{separator}{component} = {value}")?;
                }
                self.out.write_str(") gives (")?;
                for (position, component) in call.results.iter().enumerate() {
                    let separator = if position == 0 { "" } else { ", " };
                    write!(self.out, "{separator}{component}")?;
                }
                self.out.write_char(')')
            }
            OpKind::IsSet(member, path) => {
                write!(self.out, "is_set {member}")?;
                self.path(*path)
            }
            OpKind::Seed(_) => self.plain("seed", kind),
            OpKind::Derivative(..) => self.plain("derivative", kind),
            OpKind::ChainRule(..) => self.plain("chain_rule", kind),
            OpKind::ReferenceCount(member) => write!(self.out, "reference_count {member}"),
            OpKind::ReportBudget => self.plain("report_budget", kind),
            OpKind::Report(event, _) => self.plain(&format!("report {}", event.label()), kind),
        }
    }

    /// Prints a keyword and the operands.
    fn plain(&mut self, keyword: &str, kind: &OpKind) -> fmt::Result {
        self.out.write_str(keyword)?;
        let mut separator = " ";
        let mut result = Ok(());
        kind.for_each_operand(|value| {
            result = result.and_then(|()| write!(self.out, "{separator}{value}"));
            separator = ", ";
        });
        result
    }

    fn definition(&mut self, value: Value) -> fmt::Result {
        // The verifier's messages print functions that are not valid.
        let scalar = self.function.values.get(value.0 as usize).map_or("?", |scalar| scalar.name());
        write!(self.out, "{value}: {scalar}")
    }

    fn variable(&mut self, id: VariableId) -> fmt::Result {
        match self.function.variables.get(id.0 as usize) {
            Some(variable) => write!(self.out, "{}:{}", variable.kind.name(), variable.name),
            None => write!(self.out, "?:{}", id.0),
        }
    }

    fn element(&mut self, variable: VariableId, index: Index) -> fmt::Result {
        self.variable(variable)?;
        match index {
            Index::Constant(index) => write!(self.out, "@{index}"),
            Index::Dynamic(value) => write!(self.out, "@{value}"),
        }
    }

    fn path(&mut self, path: ReferencePath) -> fmt::Result {
        match path {
            ReferencePath::Single => Ok(()),
            ReferencePath::Element(value) => write!(self.out, "@{value}"),
        }
    }

    /// Prints the operations of a region, its terminator and the closing brace.
    fn region(&mut self, region: &Region, terminator: &str) -> fmt::Result {
        if !self.regions {
            return Ok(());
        }
        self.depth += 1;
        self.ops(region)?;
        self.indent()?;
        self.out.write_str(terminator)?;
        for (position, value) in region.yields.iter().enumerate() {
            let separator = if position == 0 { " " } else { ", " };
            write!(self.out, "{separator}{value}")?;
        }
        self.out.write_char('\n')?;
        self.depth -= 1;
        self.indent()?;
        self.out.write_char('}')
    }
}
