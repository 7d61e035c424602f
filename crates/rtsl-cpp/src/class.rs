//! Emission of a class as a struct.

use std::collections::BTreeSet;

use rtsl_abi::description::{ClassDescription, Field, FieldKind, ParameterDescription};
use rtsl_abi::offsets::BUFFER_WORDS;
use rtsl_ir::Scalar;
use rtsl_spec::Method;

use crate::ClassCode;
use crate::class_names::ClassNames;
use crate::comment::{sentence, write_documentation};
use crate::export::{Exported, ExportedMethod};
use crate::expression::{Expression, INDENT};
use crate::literal::{stored_literal, stored_type_name, type_name};
use crate::method::{Body, write_body};
use crate::statement::{Statement, write_statements};
use crate::support::Helper;

/// Appends the struct of a class, named `name` in C++.
pub(crate) fn write_class<'a>(
    name: &str,
    description: &'a ClassDescription,
    code: &ClassCode<'_>,
    helpers: &mut BTreeSet<Helper>,
    text: &mut String,
) -> Exported<'a> {
    let names = ClassNames::new(name, description);
    let mut writer = ClassWriter { description, names, helpers, text };
    writer.line(0, "");
    writer.documentation(description.documentation.as_deref(), 0);
    writer.line(0, &format!("struct {name} {{"));
    writer.fields();
    writer.nested("Parameters", FieldKind::Parameter, "What the constructor takes.");
    writer.nested(
        "Scratch",
        FieldKind::Scratch,
        "Values that methods of a class share for a ray and its hit.",
    );
    let constructor_may_fail = writer.constructor(code);
    let mut methods = Vec::new();
    for (method, function) in &code.methods {
        let body = write_body(function, &writer.names, writer.helpers);
        let (method, needs, accepts) = (*method, body.needs, body.accepts);
        methods.push(ExportedMethod { method, needs, accepts });
        writer.method(method, body);
    }
    writer.line(0, "};");
    if description.block_words > 0 {
        let bytes = description.block_words * 4;
        writer.line(
            0,
            &format!("static_assert(sizeof({name}) == {bytes}, \"laid out as a block\");"),
        );
    }
    let names = writer.names;
    Exported { name: name.to_owned(), description, names, methods, constructor_may_fail }
}

struct ClassWriter<'a> {
    description: &'a ClassDescription,
    names: ClassNames,
    helpers: &'a mut BTreeSet<Helper>,
    text: &'a mut String,
}

impl ClassWriter<'_> {
    fn line(&mut self, indentation: usize, line: &str) {
        if !line.is_empty() {
            self.text.push_str(&" ".repeat(indentation));
            self.text.push_str(line);
        }
        self.text.push('\n');
    }

    fn documentation(&mut self, documentation: Option<&str>, indentation: usize) {
        write_documentation(documentation.unwrap_or_default(), indentation, self.text);
    }

    /// Appends the block's words, in order.
    fn fields(&mut self) {
        let description = self.description;
        let mut next = 0;
        for field in &description.fields {
            if field.offset >= description.block_words || field.kind == FieldKind::Parameter {
                continue;
            }
            self.padding(next, field.offset);
            self.field(field);
            next = field.offset
                + if field.kind == FieldKind::Buffer { BUFFER_WORDS } else { field.len };
        }
        self.padding(next, description.block_words);
    }

    fn padding(&mut self, from: u32, to: u32) {
        if to > from {
            let name = self.names_of_padding(from);
            self.line(INDENT, &format!("uint32_t {name}[{}] = {{}};", to - from));
        }
    }

    fn names_of_padding(&self, from: u32) -> String {
        let mut scope = self.names.scope().clone();
        scope.name(&format!("unused{from}"))
    }

    fn field(&mut self, field: &Field) {
        if field.len == 0 {
            return;
        }
        let documentation = self.parameter(field).map(describe_parameter);
        self.documentation(documentation.as_deref(), INDENT);
        let name = self.names.of(field).to_owned();
        if field.kind == FieldKind::Buffer {
            self.helpers.insert(Helper::Buffer);
            let scalar = stored_type_name(field.scalar);
            return self.line(INDENT, &format!("Buffer<{scalar}, {}> {name} = {{}};", field.len));
        }
        let type_name = stored_type_name(field.scalar);
        self.initialised(type_name, &name, field, true, INDENT);
    }

    /// Appends a field with its initial value.
    fn initialised(
        &mut self,
        type_name: &str,
        name: &str,
        field: &Field,
        is_stored: bool,
        indentation: usize,
    ) {
        let first = field.offset as usize;
        let words = self.description.initial.get(first..first + field.len as usize).unwrap_or(&[]);
        let value = |bits: &u32| match is_stored || field.scalar != Scalar::Bool {
            true => Expression::atom(stored_literal(field.scalar, *bits)),
            false => Expression::atom((*bits != 0).to_string()),
        };
        let (declared, value) = match words {
            [word] => (name.to_owned(), value(word)),
            words if words.iter().all(|word| *word == 0) => {
                (dimensioned(name, field.len), Expression::List(Vec::new()))
            }
            words => {
                (dimensioned(name, field.len), Expression::List(words.iter().map(value).collect()))
            }
        };
        let statement = Statement::Define {
            is_constant: false,
            type_name: type_name.to_owned(),
            name: declared,
            value: Some(value),
        };
        write_statements(&[statement], indentation, self.text);
    }

    /// Returns the parameter that sets the field, if any.
    fn parameter(&self, field: &Field) -> Option<&ParameterDescription> {
        self.description
            .parameters
            .iter()
            .find(|parameter| parameter.offset == field.offset && parameter.name == field.name)
    }

    /// Appends a nested struct of variables that are not in the block.
    fn nested(&mut self, name: &str, kind: FieldKind, documentation: &str) {
        let fields = self.description.fields.iter().chain(&self.description.scratch);
        let fields: Vec<&Field> = fields.filter(|it| it.kind == kind && it.len > 0).collect();
        if fields.is_empty() {
            return;
        }
        self.line(0, "");
        self.documentation(Some(documentation), INDENT);
        self.line(INDENT, &format!("struct {name} {{"));
        for field in fields {
            let documentation = self.parameter(field).map(describe_parameter);
            self.documentation(documentation.as_deref(), 2 * INDENT);
            let (type_name, name) = (type_name(field.scalar), self.names.of(field).to_owned());
            if kind == FieldKind::Scratch {
                let value = if field.len == 1 { zero(field.scalar) } else { "{}" };
                let name = dimensioned(&name, field.len);
                self.line(2 * INDENT, &format!("{type_name} {name} = {value};"));
            } else {
                self.initialised(type_name, &name, field, false, 2 * INDENT);
            }
        }
        self.line(INDENT, "};");
    }

    /// Appends the constructor; returns true if it reports an exhausted budget of loop iterations.
    fn constructor(&mut self, code: &ClassCode<'_>) -> bool {
        let bodies: Vec<Body> = code
            .constructors
            .iter()
            .map(|function| write_body(function, &self.names, self.helpers))
            .collect();
        if bodies.is_empty() {
            return false;
        }
        let takes =
            self.description.fields.iter().any(|it| it.kind == FieldKind::Parameter && it.len > 0);
        let may_run_out = bodies.iter().any(|body| body.needs.state);
        let parameters = match (takes, bodies.iter().any(|body| body.needs.parameters)) {
            (true, true) => "const Parameters &parameters",
            (true, false) => "const Parameters &",
            (false, _) => "",
        };
        let documentation = match may_run_out {
            true => {
                "Sets the members that are computed of others; false where the budget of loops ran out."
            }
            false => {
                "Sets the members that are computed of others. Call it whenever one of those has changed."
            }
        };
        self.line(0, "");
        self.documentation(Some(documentation), INDENT);
        let result = if may_run_out { "bool" } else { "void" };
        self.line(INDENT, &format!("{result} construct({parameters}) {{"));
        if may_run_out {
            self.line(2 * INDENT, "struct { bool budget_exceeded = false; } state;");
        }
        let mut statements: Vec<Statement> = Vec::new();
        let is_only = bodies.len() == 1;
        for body in bodies {
            match is_only {
                true => statements = body.statements,
                false => statements.push(Statement::Block(body.statements)),
            }
        }
        write_statements(&statements, 2 * INDENT, self.text);
        if may_run_out {
            self.line(2 * INDENT, "return !state.budget_exceeded;");
        }
        self.line(INDENT, "}");
        may_run_out
    }

    fn method(&mut self, method: Method, body: Body) {
        let Body { statements, needs, accepts } = body;
        self.line(0, "");
        let written = self.description.method_documentation.get(&method).cloned();
        let documentation = written.unwrap_or_else(|| sentence(method.doc()));
        self.documentation(Some(&documentation), INDENT);
        let result = if accepts { "bool" } else { "void" };
        let parameters = [
            (true, if needs.state { "State &state" } else { "State &" }),
            (
                !self.description.scratch.is_empty(),
                if needs.scratch { "Scratch &scratch" } else { "Scratch &" },
            ),
            (needs.host, "Host &host"),
        ];
        let parameters = parameters.into_iter().filter(|(is_there, _)| *is_there);
        let parameters: Vec<&str> = parameters.map(|(_, parameter)| parameter).collect();
        self.line(
            INDENT,
            &format!("{result} {}({}) const {{", method.name(), parameters.join(", ")),
        );
        write_statements(&statements, 2 * INDENT, self.text);
        self.line(INDENT, "}");
    }
}

fn dimensioned(name: &str, len: u32) -> String {
    if len == 1 { name.to_owned() } else { format!("{name}[{len}]") }
}

fn zero(scalar: Scalar) -> &'static str {
    match scalar {
        Scalar::F32 => "0.0f",
        Scalar::I32 => "0",
        Scalar::U32 => "0u",
        Scalar::Bool => "false",
    }
}

/// Returns the comment of a parameter.
fn describe_parameter(parameter: &ParameterDescription) -> String {
    let text = parameter.documentation.as_ref().or(parameter.label.as_ref());
    let mut text = text.cloned().unwrap_or_default();
    let range = match (parameter.minimum, parameter.maximum) {
        (Some(minimum), Some(maximum)) => Some(format!("From {minimum} to {maximum}.")),
        (Some(minimum), None) => Some(format!("At least {minimum}.")),
        (None, Some(maximum)) => Some(format!("At most {maximum}.")),
        (None, None) => None,
    };
    let required = parameter.is_required.then(|| "Must be set.".to_owned());
    for more in range.into_iter().chain(required) {
        if !text.is_empty() {
            text.push(' ');
        }
        text.push_str(&more);
    }
    text
}
