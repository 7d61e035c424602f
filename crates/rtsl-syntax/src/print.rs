//! Prints the tree, for `--emit=ast` and for tests.
//!
//! One line for each declaration and statement, indented by depth; expressions on one line, every
//! operation in parentheses.

use std::fmt::{self, Write};

use rtsl_source::deep_stack;

use crate::ast::{
    Annotation, AnnotationValue, Assertion, BinaryOperator, Block, Class, ClassForm, Condition,
    Enumeration, Expression, ExpressionKind, Function, Import, Initializer, Item, Parameter,
    Qualifier, Qualifiers, Statement, StatementKind, StepOperator, Struct, SwitchCase,
    TranslationUnit, TypeName, Variable,
};

/// Formats `unit`.
pub fn print(unit: &TranslationUnit) -> String {
    deep_stack::run(|| {
        let mut printer = Printer { text: String::new(), depth: 0 };
        unit.imports.iter().for_each(|import| printer.import(import));
        for item in &unit.items {
            printer.item(item);
        }
        printer.text
    })
}

struct Printer {
    text: String,
    depth: usize,
}

impl Printer {
    fn line(&mut self, line: impl fmt::Display) {
        for _ in 0..self.depth {
            self.text.push_str("  ");
        }
        // Writing to a string cannot fail.
        let _ = writeln!(self.text, "{line}");
    }

    fn inner(&mut self, print: impl FnOnce(&mut Self)) {
        self.depth += 1;
        print(self);
        self.depth -= 1;
    }

    fn import(&mut self, import: &Import) {
        let alias = import.alias.as_ref().map_or(String::new(), |it| format!(" as {}", it.name));
        self.line(format_args!("import {}{alias}", import.dotted()));
    }

    fn item(&mut self, item: &Item) {
        match item {
            Item::Struct(structure) => self.structure(structure),
            Item::Assertion(assertion) => self.assertion(assertion),
            Item::Enumeration(enumeration) => self.enumeration(enumeration),
            Item::Function(function) => self.function(function),
            Item::Variable(variable) => self.variable(variable),
            Item::Class(class) => self.class(class),
        }
    }

    fn class(&mut self, class: &Class) {
        let Class { name, bases, form, items, documentation, span: _, end: _ } = class;
        let form = match form {
            ClassForm::Header => "",
            ClassForm::Block => " (block)",
        };
        let bases: Vec<&str> = bases.iter().map(|base| base.name.as_str()).collect();
        let colon = if bases.is_empty() { "" } else { " : " };
        self.line(format_args!("class {}{colon}{}{form}", name.name, bases.join(", ")));
        self.inner(|this| {
            if let Some(documentation) = documentation {
                this.line(format_args!("documentation {documentation:?}"));
            }
            for item in items {
                this.item(item);
            }
        });
    }

    fn structure(&mut self, structure: &Struct) {
        self.line(format_args!("struct {}", structure.name.name));
        self.inner(|this| {
            for field in &structure.fields {
                this.line(format_args!("field {} {}", Show(&field.ty), field.name.name));
            }
        });
    }

    fn assertion(&mut self, assertion: &Assertion) {
        self.line(format_args!("assert {} {:?}", Show(&assertion.condition), assertion.text));
    }

    fn enumeration(&mut self, enumeration: &Enumeration) {
        self.line(format_args!("enum {}", enumeration.name.name));
        self.inner(|this| {
            for (name, value) in &enumeration.choices {
                match value {
                    Some(value) => {
                        this.line(format_args!("choice {} = {}", name.name, Show(value)));
                    }
                    None => this.line(format_args!("choice {}", name.name)),
                }
            }
        });
    }

    fn variable(&mut self, variable: &Variable) {
        self.line(format_args!("variable {}", Show(variable)));
    }

    fn function(&mut self, function: &Function) {
        // The printed tree leaves documentation out, since it does not affect the program.
        let Function { qualifiers, result, name, parameters, body, documentation: _, span: _ } =
            function;
        let what = if body.is_some() { "function" } else { "prototype" };
        let parameters = List(parameters);
        let qualifiers = Show(qualifiers);
        match result {
            Some(ty) => self.line(format_args!(
                "{what} {qualifiers}{} {}({parameters})",
                Show(ty),
                name.name
            )),
            None => self.line(format_args!("{what} {qualifiers}{}({parameters})", name.name)),
        }
        if let Some(body) = body {
            self.block(body);
        }
    }

    fn block(&mut self, block: &Block) {
        self.inner(|this| {
            for statement in &block.statements {
                this.statement(statement);
            }
        });
    }

    fn body(&mut self, statement: &Statement) {
        match &statement.kind {
            StatementKind::Block(block) => self.block(block),
            _ => self.inner(|this| this.statement(statement)),
        }
    }

    fn statement(&mut self, statement: &Statement) {
        match &statement.kind {
            StatementKind::Empty => self.line("empty"),
            StatementKind::Expression(expression) => self.line(Show(expression)),
            StatementKind::Variables(variables) => {
                variables.iter().for_each(|variable| self.variable(variable));
            }
            StatementKind::Struct(structure, variables) => {
                self.structure(structure);
                variables.iter().for_each(|variable| self.variable(variable));
            }
            StatementKind::Assertion(assertion) => self.assertion(assertion),
            StatementKind::Print(print) => {
                self.line(format_args!("print {:?} {}", print.text, List(&print.arguments)));
            }
            StatementKind::Function(function) => self.function(function),
            StatementKind::Block(block) => {
                self.line("block");
                self.block(block);
            }
            StatementKind::If { condition, then, otherwise } => {
                self.line(format_args!("if {}", Show(condition)));
                self.body(then);
                if let Some(otherwise) = otherwise {
                    self.line("else");
                    self.body(otherwise);
                }
            }
            StatementKind::Switch { selector, cases } => {
                self.line(format_args!("switch {}", Show(selector)));
                self.inner(|this| cases.iter().for_each(|case| this.case(case)));
            }
            StatementKind::For { initializer, condition, step, body } => {
                self.line("for");
                self.inner(|this| {
                    this.statement(initializer);
                    match condition {
                        Some(condition) => this.line(format_args!("while {}", Show(condition))),
                        None => this.line("while true"),
                    }
                    if let Some(step) = step {
                        this.line(format_args!("step {}", Show(step)));
                    }
                    this.line("do");
                    this.body(body);
                });
            }
            StatementKind::While { condition, body } => {
                self.line(format_args!("while {}", Show(condition)));
                self.body(body);
            }
            StatementKind::DoWhile { body, condition } => {
                self.line("do");
                self.body(body);
                self.line(format_args!("while {}", Show(condition)));
            }
            StatementKind::Illuminance { arguments, body } => {
                self.line(format_args!("illuminance({})", List(arguments)));
                self.body(body);
            }
            StatementKind::Return(Some(value)) => self.line(format_args!("return {}", Show(value))),
            StatementKind::Return(None) => self.line("return"),
            StatementKind::Break => self.line("break"),
            StatementKind::Continue => self.line("continue"),
        }
    }

    fn case(&mut self, case: &SwitchCase) {
        match &case.label {
            Some(label) => self.line(format_args!("case {}", Show(label))),
            None => self.line("default"),
        }
        self.inner(|this| {
            for statement in &case.statements {
                this.statement(statement);
            }
        });
    }
}

/// Displays a node on one line.
struct Show<'a, T>(&'a T);

/// Displays nodes separated by commas.
struct List<'a, T>(&'a [T]);

impl<T> fmt::Display for List<'_, T>
where
    for<'b> Show<'b, T>: fmt::Display,
{
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (index, each) in self.0.iter().enumerate() {
            let comma = if index == 0 { "" } else { ", " };
            write!(f, "{comma}{}", Show(each))?;
        }
        Ok(())
    }
}

impl fmt::Display for Show<'_, TypeName> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.0.name.name)?;
        for size in &self.0.sizes {
            match size {
                Some(size) => write!(f, "[{}]", Show(size))?,
                None => f.write_str("[]")?,
            }
        }
        Ok(())
    }
}

impl fmt::Display for Show<'_, Qualifiers> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.0.list.iter().try_for_each(|(qualifier, _)| {
            f.write_str(match qualifier {
                Qualifier::Public => "public ",
                Qualifier::Private => "private ",
                Qualifier::Scratch => "scratch ",
                Qualifier::Texture => "texture ",
                Qualifier::Output => "output ",
                Qualifier::Attribute => "attribute ",
                Qualifier::Const => "const ",
                Qualifier::Uniform => "uniform ",
                Qualifier::Precise => "precise ",
                Qualifier::Invariant => "invariant ",
                Qualifier::In => "in ",
                Qualifier::Out => "out ",
                Qualifier::InOut => "inout ",
            })
        })
    }
}

impl fmt::Display for Show<'_, Annotation> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.0.key.name)?;
        match &self.0.value {
            AnnotationValue::None => Ok(()),
            AnnotationValue::Text(text, _) => write!(f, " {text:?}"),
            AnnotationValue::Expression(expression) => write!(f, " {}", Show(expression)),
        }
    }
}

fn show_annotations(annotations: &[Annotation], f: &mut fmt::Formatter<'_>) -> fmt::Result {
    if annotations.is_empty() { Ok(()) } else { write!(f, "[[{}]] ", List(annotations)) }
}

impl fmt::Display for Show<'_, Variable> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Variable { annotations, qualifiers, ty, name, initializer, span: _ } = self.0;
        show_annotations(annotations, f)?;
        write!(f, "{}{} {}", Show(qualifiers), Show(ty), name.name)?;
        match initializer {
            Some(initializer) => write!(f, " = {}", Show(initializer)),
            None => Ok(()),
        }
    }
}

impl fmt::Display for Show<'_, Parameter> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Parameter { annotations, qualifiers, ty, name, default, span: _ } = self.0;
        show_annotations(annotations, f)?;
        write!(f, "{}{}", Show(qualifiers), Show(ty))?;
        if let Some(name) = name {
            write!(f, " {}", name.name)?;
        }
        match default {
            Some(default) => write!(f, " = {}", Show(default)),
            None => Ok(()),
        }
    }
}

impl fmt::Display for Show<'_, Initializer> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.0 {
            Initializer::Expression(expression) => Show(expression).fmt(f),
            Initializer::List(values, _) => write!(f, "{{{}}}", List(values)),
        }
    }
}

impl fmt::Display for Show<'_, Condition> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.0 {
            Condition::Expression(expression) => Show(expression).fmt(f),
            Condition::Declaration(variable) => write!(f, "variable {}", Show(&**variable)),
        }
    }
}

impl fmt::Display for Show<'_, Expression> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (first, links) = self.0.chain();
        (0..links.len()).try_for_each(|_| f.write_str("("))?;
        show_operand(first, f)?;
        links.into_iter().try_for_each(|link| match &link.kind {
            ExpressionKind::Binary(operator, _, right) => {
                write!(f, " {} {})", operator.text(), Show(&**right))
            }
            ExpressionKind::Sequence(_, right) => write!(f, ", {})", Show(&**right)),
            _ => Ok(()),
        })
    }
}

/// Formats an expression that is not a link of a chain.
fn show_operand(expression: &Expression, f: &mut fmt::Formatter<'_>) -> fmt::Result {
    match &expression.kind {
        ExpressionKind::Error => f.write_str("<error>"),
        ExpressionKind::Int(value) => write!(f, "{value}"),
        ExpressionKind::Uint(value) => write!(f, "{value}u"),
        ExpressionKind::Float(value) => write!(f, "{value:?}"),
        ExpressionKind::Bool(value) => write!(f, "{value}"),
        ExpressionKind::Name(name) => f.write_str(name),
        ExpressionKind::Sequence(..) | ExpressionKind::Binary(..) => Ok(()),
        ExpressionKind::Unary(operator, operand) => {
            write!(f, "({}{})", operator.text(), Show(&**operand))
        }
        ExpressionKind::Step { target, by, prefix } => {
            let text = match by {
                StepOperator::Increment => "++",
                StepOperator::Decrement => "--",
            };
            let target = Show(&**target);
            if *prefix { write!(f, "({text}{target})") } else { write!(f, "({target}{text})") }
        }
        ExpressionKind::Assign { target, operator, value } => {
            let operator = operator.map_or("", BinaryOperator::text);
            write!(f, "({} {operator}= {})", Show(&**target), Show(&**value))
        }
        ExpressionKind::Conditional(condition, then, otherwise) => {
            let (then, otherwise) = (Show(&**then), Show(&**otherwise));
            write!(f, "({} ? {then} : {otherwise})", Show(&**condition))
        }
        ExpressionKind::Index(base, Some(index)) => {
            write!(f, "{}[{}]", Show(&**base), Show(&**index))
        }
        ExpressionKind::Index(base, None) => write!(f, "{}[]", Show(&**base)),
        ExpressionKind::Member(base, name) => write!(f, "{}.{}", Show(&**base), name.name),
        ExpressionKind::Call { callee, arguments } => {
            write!(f, "{}({})", Show(&**callee), List(arguments))
        }
        ExpressionKind::MethodCall { receiver, method, arguments } => {
            write!(f, "{}.{}({})", Show(&**receiver), method.name, List(arguments))
        }
    }
}
