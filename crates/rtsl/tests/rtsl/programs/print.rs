//! Programs as text.

use std::fmt::{self, Display, Formatter, Write};

use rtsl_ir::{BinaryOp, CompareOp, Constant, Scalar, UnaryOp};

use crate::programs::tree::*;

impl Display for Type {
    fn fmt(&self, out: &mut Formatter<'_>) -> fmt::Result {
        let (name, prefix) = match self.scalar {
            Scalar::F32 => ("float", ""),
            Scalar::I32 => ("int", "i"),
            Scalar::U32 => ("uint", "u"),
            Scalar::Bool => ("bool", "b"),
        };
        match self.size {
            1 => out.write_str(name),
            size => write!(out, "{prefix}vec{size}"),
        }
    }
}

impl Display for Program {
    fn fmt(&self, out: &mut Formatter<'_>) -> fmt::Result {
        writeln!(out, "class Generated : rt_Texture;")?;
        for member in &self.members {
            writeln!(out, "scratch {};", declaration(member))?;
        }
        (0..self.functions.len()).try_for_each(|index| {
            Printer { program: self, function: &self.functions[index], out: &mut *out, indent: 0 }
                .function()
        })
    }
}

fn declaration(variable: &Variable) -> String {
    match variable.count {
        Some(count) => format!("{} {}[{count}]", variable.ty, variable.name),
        None => format!("{} {}", variable.ty, variable.name),
    }
}

struct Printer<'a, 'b> {
    program: &'a Program,
    function: &'a Function,
    out: &'a mut Formatter<'b>,
    indent: usize,
}

impl Printer<'_, '_> {
    fn function(&mut self) -> fmt::Result {
        let Function { name, result, parameters, variables, body } = self.function;
        let result = result.map_or("void".to_owned(), |ty| ty.to_string());
        let parameters = parameters.iter().zip(variables).map(|(passing, variable)| {
            let passing = match passing {
                Passing::In => "",
                Passing::Out => "out ",
                Passing::InOut => "inout ",
            };
            format!("{passing}{}", declaration(variable))
        });
        let parameters: Vec<String> = parameters.collect();
        writeln!(self.out, "{result} {name}({}) {{", parameters.join(", "))?;
        self.list(body)?;
        writeln!(self.out, "}}")
    }

    fn list(&mut self, list: &[Statement]) -> fmt::Result {
        self.indent += 1;
        for statement in list {
            self.statement(statement)?;
        }
        self.indent -= 1;
        Ok(())
    }

    fn line(&mut self, text: &str) -> fmt::Result {
        writeln!(self.out, "{:width$}{text}", "", width = self.indent * 4)
    }

    fn block(&mut self, head: &str, list: &[Statement], tail: &str) -> fmt::Result {
        self.line(&format!("{head} {{"))?;
        self.list(list)?;
        self.line(&format!("}}{tail}"))
    }

    fn statement(&mut self, statement: &Statement) -> fmt::Result {
        let counter = |index: &usize| &self.function.variables[*index].name;
        match statement {
            Statement::Declare(index, value) => {
                let value = value.as_ref().map(|value| format!(" = {}", self.text(value)));
                let declaration = declaration(&self.function.variables[*index]);
                self.line(&format!("{declaration}{};", value.unwrap_or_default()))
            }
            Statement::Expression(value) => self.line(&format!("{};", self.text(value))),
            Statement::If(condition, then, otherwise) => {
                self.block(&format!("if ({})", self.text(condition)), then, "")?;
                if otherwise.is_empty() { Ok(()) } else { self.block("else", otherwise, "") }
            }
            Statement::For(index, count, body) => {
                let (i, count) = (counter(index), self.text(count));
                self.block(&format!("for (int {i} = 0; {i} < {count}; {i}++)"), body, "")
            }
            Statement::While(index, count, condition, body) => {
                let (i, condition) = (counter(index), self.text(condition));
                self.line(&format!("int {i} = 0;"))?;
                self.block(&format!("while ({i}++ < {count} && {condition})"), body, "")
            }
            Statement::DoWhile(index, count, condition, body) => {
                let (i, condition) = (counter(index), self.text(condition));
                self.line(&format!("int {i} = 0;"))?;
                self.block("do", body, &format!(" while ({i}++ < {count} && {condition});"))
            }
            Statement::Switch(selector, cases) => {
                self.line(&format!("switch ({}) {{", self.text(selector)))?;
                for (label, body) in cases {
                    match label {
                        Some(label) => self.line(&format!("case {label}:"))?,
                        None => self.line("default:")?,
                    }
                    self.list(body)?;
                }
                self.line("}")
            }
            Statement::Break => self.line("break;"),
            Statement::Continue => self.line("continue;"),
            Statement::Return(None) => self.line("return;"),
            Statement::Return(Some(value)) => self.line(&format!("return {};", self.text(value))),
        }
    }

    fn text(&self, expression: &Expression) -> String {
        let text = |value: &Expression| self.text(value);
        let list = |values: &[Expression]| -> String {
            values.iter().map(text).collect::<Vec<_>>().join(", ")
        };
        match &expression.kind {
            Kind::Constant(bits) => constant(expression.ty, bits),
            Kind::Input(components) => format!("rt_TextureUVW.{}", swizzle(components)),
            Kind::Read(target) => self.target(target),
            Kind::Swizzle(value, components) => format!("{}.{}", text(value), swizzle(components)),
            Kind::Unary(op, value) => {
                let symbol = match (op, value.ty.scalar) {
                    (UnaryOp::Not, Scalar::Bool) => "!",
                    (UnaryOp::Not, _) => "~",
                    _ => "-",
                };
                format!("({symbol}{})", text(value))
            }
            Kind::Binary(op, a, b) => {
                format!("({} {} {})", text(a), binary_symbol(*op, a.ty), text(b))
            }
            Kind::Compare(op, a, b) => format!("({} {} {})", text(a), compare_symbol(*op), text(b)),
            Kind::Logical(or, a, b) => {
                format!("({} {} {})", text(a), if *or { "||" } else { "&&" }, text(b))
            }
            Kind::Conditional(condition, a, b) => {
                format!("({} ? {} : {})", text(condition), text(a), text(b))
            }
            Kind::Construct(parts) => format!("{}({})", expression.ty, list(parts)),
            Kind::Builtin(builtin, arguments) => format!("{}({})", builtin.name(), list(arguments)),
            Kind::Call(index, arguments) => {
                let arguments = arguments.iter().map(|argument| match argument {
                    Argument::Value(value) => self.text(value),
                    Argument::Place(target) => self.target(target),
                });
                let arguments: Vec<String> = arguments.collect();
                format!("{}({})", self.program.functions[*index].name, arguments.join(", "))
            }
            Kind::Assign(target, op, value) => {
                let op = op.map_or("", |op| binary_symbol(op, value.ty));
                format!("({} {op}= {})", self.target(target), text(value))
            }
            Kind::Step { target, up, prefix } => {
                let symbol = if *up { "++" } else { "--" };
                let target = self.target(target);
                if *prefix { format!("({symbol}{target})") } else { format!("({target}{symbol})") }
            }
        }
    }

    fn target(&self, target: &Target) -> String {
        let mut text = match target.name {
            Name::Local(index) => self.function.variables[index].name.clone(),
            Name::Member(index) => self.program.members[index].name.clone(),
        };
        if let Some(index) = &target.element {
            write!(text, "[{}]", self.text(index)).unwrap();
        }
        match &target.components {
            Components::All => {}
            Components::Swizzle(components) => write!(text, ".{}", swizzle(components)).unwrap(),
            Components::Dynamic(index) => write!(text, "[{}]", self.text(index)).unwrap(),
        }
        text
    }
}

fn swizzle(components: &[u8]) -> String {
    components.iter().map(|index| ['x', 'y', 'z', 'w'][usize::from(*index)]).collect()
}

fn constant(ty: Type, bits: &[u32]) -> String {
    let parts: Vec<String> = bits.iter().map(|bits| scalar_constant(ty.scalar, *bits)).collect();
    match &*parts {
        [single] => single.clone(),
        parts => format!("{ty}({})", parts.join(", ")),
    }
}

fn scalar_constant(scalar: Scalar, bits: u32) -> String {
    match Constant::from_bits(scalar, bits) {
        Constant::Bool(value) => value.to_string(),
        Constant::U32(value) => format!("{value}u"),
        Constant::I32(value) if value < 0 => format!("int({}u)", value as u32),
        Constant::I32(value) => value.to_string(),
        Constant::F32(value) if value.is_finite() => format!("({value:?})"),
        Constant::F32(_) => format!("uintBitsToFloat({bits}u)"),
    }
}

fn binary_symbol(op: BinaryOp, ty: Type) -> &'static str {
    match (op, ty.scalar) {
        (BinaryOp::Add, _) => "+",
        (BinaryOp::Subtract, _) => "-",
        (BinaryOp::Multiply, _) => "*",
        (BinaryOp::Divide, _) => "/",
        (BinaryOp::Remainder, _) => "%",
        (BinaryOp::Xor, Scalar::Bool) => "^^",
        (BinaryOp::And, _) => "&",
        (BinaryOp::Or, _) => "|",
        (BinaryOp::Xor, _) => "^",
        (BinaryOp::ShiftLeft, _) => "<<",
        (BinaryOp::ShiftRight, _) => ">>",
        (BinaryOp::Min | BinaryOp::Max | BinaryOp::MultiplyHigh, _) => {
            unreachable!("no operators of the language")
        }
    }
}

fn compare_symbol(op: CompareOp) -> &'static str {
    match op {
        CompareOp::Equal => "==",
        CompareOp::NotEqual => "!=",
        CompareOp::Less => "<",
        CompareOp::LessEqual => "<=",
        CompareOp::Greater => ">",
        CompareOp::GreaterEqual => ">=",
    }
}
