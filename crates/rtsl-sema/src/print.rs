//! Prints the typed tree, for tests and debugging: RTSL's notation with all decisions of the
//! checker made explicit.
//!
//! Locals are `name#index`, members `self.name`, conversions `float<-(x)`. Constants that are not
//! scalars carry their type, and calls of functions of the module carry the function's index:
//! `f@12(x)`.

use std::fmt::Write;

use rtsl_ir::Constant;

use crate::check::plain_type_name;
use crate::hir::{
    Class, Expression, ExpressionKind, Function, FunctionId, Illuminance, Loop, Module, Passing,
    StateArgument, Statement, StatementKind, StepOperator, Storage, SwitchCase, Type,
};

/// Prints a class with its members, methods and constructor.
pub fn class(module: &Module, class: &Class) -> String {
    let mut printer =
        Printer { module, class: Some(class), function: None, text: String::new(), indent: 0 };
    printer.class(class);
    printer.text
}

/// Prints a function with its body.
pub fn function(module: &Module, id: FunctionId) -> String {
    let mut printer =
        Printer { module, class: None, function: None, text: String::new(), indent: 0 };
    printer.function(id);
    printer.text
}

/// Formats a type as the language writes it.
pub fn type_name(module: &Module, ty: &Type) -> String {
    match ty {
        Type::Struct(id) => module.structs[id.0 as usize].name.clone(),
        Type::Array(..) | Type::Buffer(_) => {
            let mut suffix = String::new();
            let mut element = ty;
            loop {
                match element {
                    Type::Array(inner, size) => {
                        let _ = write!(suffix, "[{size}]");
                        element = inner;
                    }
                    Type::Buffer(inner) => {
                        suffix.push_str("[]");
                        element = inner;
                    }
                    _ => return type_name(module, element) + &suffix,
                }
            }
        }
        _ => plain_type_name(ty),
    }
}

struct Printer<'m> {
    module: &'m Module,
    class: Option<&'m Class>,
    function: Option<&'m Function>,
    text: String,
    indent: usize,
}

impl<'m> Printer<'m> {
    fn line(&mut self, text: &str) {
        let indent = "    ".repeat(self.indent);
        let _ = writeln!(self.text, "{indent}{text}");
    }

    fn ty(&self, ty: &Type) -> String {
        type_name(self.module, ty)
    }

    fn class(&mut self, class: &'m Class) {
        let roles: Vec<&str> = class.roles.iter().map(|role| role.name()).collect();
        self.line(&format!("class {} : {}", class.name, roles.join(", ")));
        for member in &class.members {
            let storage = match member.storage {
                Storage::Public if member.textured => "public texture",
                Storage::Public => "public",
                Storage::Private => "private",
                Storage::Scratch => "scratch",
                Storage::Output => "output",
                Storage::Attribute => "attribute",
            };
            let value = member
                .initializer
                .as_ref()
                .map_or(String::new(), |value| format!(" = {}", self.expression(value)));
            self.line(&format!("{storage} {} {}{value};", self.ty(&member.ty), member.name));
        }
        if let Some(constructor) = &class.constructor {
            self.function(constructor.function);
        }
        for (_, id) in &class.methods {
            self.function(*id);
        }
    }

    fn function(&mut self, id: FunctionId) {
        let function = &self.module.functions[id.0 as usize];
        self.function = Some(function);
        if let Some(class) = function.class {
            self.class = self.module.classes.get(class.0 as usize);
        }
        let parameters: Vec<String> = function
            .parameters
            .iter()
            .zip(&function.locals)
            .enumerate()
            .map(|(index, (passing, local))| {
                let passing = match passing {
                    Passing::In => "",
                    Passing::Out => "out ",
                    Passing::InOut => "inout ",
                };
                format!("{passing}{} {}#{index}", self.ty(&local.ty), local.name)
            })
            .collect();
        let result = self.ty(&function.result);
        self.line(&format!("{result} {}@{}({}) {{", function.name, id.0, parameters.join(", ")));
        self.statements(&function.body);
        self.line("}");
    }

    fn statements(&mut self, statements: &[Statement]) {
        self.indent += 1;
        for statement in statements {
            self.statement(statement);
        }
        self.indent -= 1;
    }

    fn statement(&mut self, statement: &Statement) {
        match &statement.kind {
            StatementKind::Expression(expression) => {
                let text = self.expression(expression);
                self.line(&format!("{text};"));
            }
            StatementKind::Declare(id, value) => {
                let ty = self
                    .function
                    .map_or(String::new(), |function| self.ty(&function.locals[id.0 as usize].ty));
                let value = value
                    .as_ref()
                    .map_or(String::new(), |value| format!(" = {}", self.expression(value)));
                let name = self.local(id.0);
                self.line(&format!("{ty} {name}{value};"));
            }
            StatementKind::Block(body) => {
                self.line("{");
                self.statements(body);
                self.line("}");
            }
            StatementKind::If { condition, then, otherwise } => {
                let condition = self.expression(condition);
                self.line(&format!("if ({condition}) {{"));
                self.statements(then);
                if !otherwise.is_empty() {
                    self.line("} else {");
                    self.statements(otherwise);
                }
                self.line("}");
            }
            StatementKind::Switch { selector, cases } => self.switch(selector, cases),
            StatementKind::Loop(body) => self.print_loop(body),
            StatementKind::Illuminance(illuminance) => self.illuminance(illuminance),
            StatementKind::Return(None) => self.line("return;"),
            StatementKind::Return(Some(value)) => {
                let value = self.expression(value);
                self.line(&format!("return {value};"));
            }
            StatementKind::Break => self.line("break;"),
            StatementKind::Continue => self.line("continue;"),
            StatementKind::Print { pieces, arguments } => {
                let arguments: String =
                    arguments.iter().map(|it| format!(", {}", self.expression(it))).collect();
                self.line(&format!("print({:?}{arguments});", pieces.join("{}")));
            }
        }
    }

    fn switch(&mut self, selector: &Expression, cases: &[SwitchCase]) {
        let selector = self.expression(selector);
        self.line(&format!("switch ({selector}) {{"));
        for case in cases {
            match case.value {
                Some(value) => self.line(&format!("case {}:", constant(value))),
                None => self.line("default:"),
            }
            self.statements(&case.body);
        }
        self.line("}");
    }

    fn print_loop(&mut self, body: &Loop) {
        let condition = body.condition.as_ref().map_or(String::new(), |condition| {
            let declared =
                body.declaration.map_or(String::new(), |id| format!("{} = ", self.local(id.0)));
            declared + &self.expression(condition)
        });
        let step =
            body.step.as_ref().map_or(String::new(), |step| format!("; {}", self.expression(step)));
        let kind = if body.test_last { "do while" } else { "while" };
        self.statements(&body.initializer);
        self.line(&format!("{kind} ({condition}{step}) {{"));
        self.statements(&body.body);
        self.line("}");
    }

    fn illuminance(&mut self, illuminance: &Illuminance) {
        let arguments = illuminance
            .point
            .iter()
            .chain(illuminance.cone.iter().flat_map(|(axis, angle)| [axis, angle]))
            .map(|argument| self.expression(argument))
            .collect::<Vec<_>>();
        self.line(&format!("illuminance({}) {{", arguments.join(", ")));
        self.statements(&illuminance.body);
        self.line("}");
    }

    fn local(&self, index: u32) -> String {
        let name = self.function.map_or("", |function| &function.locals[index as usize].name);
        format!("{name}#{index}")
    }

    fn list(&self, expressions: &[Expression]) -> String {
        let texts: Vec<String> = expressions.iter().map(|each| self.expression(each)).collect();
        texts.join(", ")
    }

    fn expression(&self, expression: &Expression) -> String {
        let ty = || self.ty(&expression.ty);
        match &expression.kind {
            ExpressionKind::Constant(values) => match (&expression.ty, values.as_ref()) {
                (Type::Scalar(_), [value]) => constant(*value),
                (_, values) => {
                    let values: Vec<String> = values.iter().copied().map(constant).collect();
                    format!("{}{{{}}}", ty(), values.join(", "))
                }
            },
            ExpressionKind::Local(id) => self.local(id.0),
            ExpressionKind::Member(id) => {
                let name = self.class.map(|class| class.members[id.0 as usize].name.as_str());
                format!("self.{}", name.unwrap_or("?"))
            }
            ExpressionKind::Textured(id) => {
                let name = self.class.map(|class| class.members[id.0 as usize].name.as_str());
                format!("self.{}?", name.unwrap_or("?"))
            }
            ExpressionKind::Computed(id, _) => {
                let name = self.class.map(|class| class.members[id.0 as usize].name.as_str());
                format!("self.{}()", name.unwrap_or("?"))
            }
            ExpressionKind::State(id) => {
                rtsl_spec::state_variables()[id.0 as usize].name.to_owned()
            }
            ExpressionKind::Swizzle(base, components) => {
                let letters: String =
                    components.iter().map(|each| b"xyzw"[usize::from(*each)] as char).collect();
                format!("{}.{letters}", self.expression(base))
            }
            ExpressionKind::Field(base, index) => self.field(base, *index),
            ExpressionKind::Index(base, index) => {
                format!("{}[{}]", self.expression(base), self.expression(index))
            }
            ExpressionKind::Convert(operand) => format!("{}<-({})", ty(), self.expression(operand)),
            ExpressionKind::Construct(arguments) => format!("{}({})", ty(), self.list(arguments)),
            ExpressionKind::Unary(operator, operand) => {
                format!("{}{}", operator.text(), self.expression(operand))
            }
            ExpressionKind::Binary(..)
            | ExpressionKind::And(..)
            | ExpressionKind::Or(..)
            | ExpressionKind::Sequence(..) => self.chain(expression),
            ExpressionKind::Assign { target, operator, value } => {
                let operator = operator.map_or("", |operator| operator.text());
                self.infix(&format!("{operator}="), target, value)
            }
            ExpressionKind::Step { target, by, prefix } => self.step(target, *by, *prefix),
            ExpressionKind::Conditional(condition, then, otherwise) => format!(
                "({} ? {} : {})",
                self.expression(condition),
                self.expression(then),
                self.expression(otherwise)
            ),
            ExpressionKind::Call(id, arguments) => {
                let name = &self.module.functions[id.0 as usize].name;
                format!("{name}@{}({})", id.0, self.list(arguments))
            }
            ExpressionKind::Builtin(call) => {
                let each = if call.componentwise { "*" } else { "" };
                format!("{}{each}({})", call.builtin.name, self.list(&call.arguments))
            }
            ExpressionKind::ReferenceCall(call) => format!(
                "{}.{}({})",
                self.expression(&call.reference),
                call.method.name,
                self.state_arguments(&call.arguments)
            ),
            ExpressionKind::IsSet(reference) => format!("isSet({})", self.expression(reference)),
            ExpressionKind::Length(array) => format!("{}.length()", self.expression(array)),
            ExpressionKind::Error => "<error>".to_owned(),
        }
    }

    fn state_arguments(&self, arguments: &[StateArgument]) -> String {
        let written = arguments.iter().map(|argument| {
            let name = rtsl_spec::state_variables()[argument.state.0 as usize].name;
            format!("{name} = {}", self.expression(&argument.value))
        });
        written.collect::<Vec<_>>().join(", ")
    }

    fn chain(&self, expression: &Expression) -> String {
        let (first, links) = expression.chain();
        let mut text = "(".repeat(links.len()) + &self.expression(first);
        for link in links {
            let (symbol, right) = match &link.kind {
                ExpressionKind::Binary(operator, _, right) => (operator.text(), right),
                ExpressionKind::And(_, right) => ("&&", right),
                ExpressionKind::Or(_, right) => ("||", right),
                ExpressionKind::Sequence(_, right) => (",", right),
                _ => continue,
            };
            text += &format!(" {symbol} {})", self.expression(right));
        }
        text
    }

    fn infix(&self, symbol: &str, left: &Expression, right: &Expression) -> String {
        format!("({} {symbol} {})", self.expression(left), self.expression(right))
    }

    fn field(&self, base: &Expression, index: u32) -> String {
        let name = match base.ty {
            Type::Struct(id) => {
                self.module.structs[id.0 as usize].fields[index as usize].0.as_str()
            }
            _ => "?",
        };
        format!("{}.{name}", self.expression(base))
    }

    fn step(&self, target: &Expression, by: StepOperator, prefix: bool) -> String {
        let symbol = match by {
            StepOperator::Increment => "++",
            StepOperator::Decrement => "--",
        };
        let target = self.expression(target);
        if prefix { format!("{symbol}{target}") } else { format!("{target}{symbol}") }
    }
}

fn constant(value: Constant) -> String {
    match value {
        Constant::F32(value) => format!("{value:?}"),
        Constant::I32(value) => value.to_string(),
        Constant::U32(value) => format!("{value}u"),
        Constant::Bool(value) => value.to_string(),
    }
}
