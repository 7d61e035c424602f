//! The declarations of a text and of the modules that it uses.

use std::collections::HashMap;

use rtsl::{Analysis, FileId, Span};
use rtsl_syntax::Comments;
use rtsl_syntax::ast::{
    self, Annotation, AnnotationValue, Block, Condition, Item, Qualifier, Statement, StatementKind,
};

use crate::replacement::canonical_ids;

/// A declaration.
#[derive(Clone, Debug)]
pub struct Declaration {
    /// The name.
    pub name: String,
    /// The name in the text.
    pub span: Span,
    /// The header of a function or class; of others the name.
    pub header: Span,
    /// The whole declaration.
    pub extent: Span,
    /// The kind of what is declared.
    pub kind: DeclarationKind,
    /// The declaration as text, without bodies and long values.
    pub text: String,
    /// The comment before it and what its annotations say, in Markdown.
    pub documentation: Option<String>,
    /// The class or struct or function around it.
    pub parent: Option<DeclarationId>,
    /// The types of the parameters as written, of functions.
    pub parameters: Vec<String>,
}

/// An index into [`Declarations::list`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct DeclarationId(pub usize);

/// The kinds of what is declared.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum DeclarationKind {
    /// A class.
    Class,
    /// A struct.
    Struct,
    /// An enumeration.
    Enumeration,
    /// A choice of an enumeration.
    Choice,
    /// A field of a struct.
    Field,
    /// A function; of a class if its parent is one.
    Function,
    /// The constructor of a class.
    Constructor,
    /// A public member.
    Parameter,
    /// Another member.
    Member,
    /// A constant at file scope or of a class.
    Constant,
    /// A variable of a function.
    Local,
    /// A parameter of a function.
    Argument,
    /// An imported module.
    Module,
}

/// The declarations, those of the text first, in its order.
#[derive(Debug, Default)]
pub struct Declarations {
    /// The declarations.
    pub list: Vec<Declaration>,
    /// By the spans of names and of headers.
    by_span: HashMap<Span, DeclarationId>,
    /// Those directly inside each; at file scope those of `None`.
    children: HashMap<Option<DeclarationId>, Vec<DeclarationId>>,
    /// The base classes of classes, as written.
    bases: HashMap<DeclarationId, Vec<String>>,
    /// The declaration that stands for each.
    canonical: Vec<DeclarationId>,
}

impl Declarations {
    /// Collects the declarations of a text and of the modules that it uses.
    pub fn of(analysis: &Analysis) -> Declarations {
        rtsl_source::deep_stack::run(|| {
            let declarations = Declarations::default();
            let comments = HashMap::new();
            let mut collector = Collector { analysis, declarations, parent: None, comments };
            for unit in std::iter::once(analysis.tree()).chain(analysis.modules()) {
                collector.unit(unit);
            }
            let mut declarations = collector.declarations;
            declarations.canonical = canonical_ids(&declarations);
            declarations
        })
    }

    /// The declaration with this name or header.
    pub fn at(&self, span: Span) -> Option<DeclarationId> {
        self.by_span.get(&span).copied()
    }

    /// The declaration.
    pub fn get(&self, id: DeclarationId) -> &Declaration {
        &self.list[id.0]
    }

    /// All declarations with their ids.
    pub fn iter(&self) -> impl Iterator<Item = (DeclarationId, &Declaration)> {
        self.list.iter().enumerate().map(|(index, declaration)| (DeclarationId(index), declaration))
    }

    /// The declarations directly inside another; those at file scope if `None`.
    pub fn inside(
        &self,
        parent: Option<DeclarationId>,
    ) -> impl Iterator<Item = (DeclarationId, &Declaration)> {
        let children = self.children.get(&parent).map_or(&[][..], Vec::as_slice);
        children.iter().map(|id| (*id, self.get(*id)))
    }

    /// The names after the colon of a class.
    pub fn bases(&self, class: DeclarationId) -> &[String] {
        self.bases.get(&class).map_or(&[], Vec::as_slice)
    }

    /// The innermost declaration of one of these kinds around an offset of a file.
    pub fn around(
        &self,
        place: Span,
        kinds: &[DeclarationKind],
    ) -> Option<(DeclarationId, &Declaration)> {
        self.iter()
            .filter(|(_, it)| kinds.contains(&it.kind) && contains(it.extent, place))
            .min_by_key(|(_, it)| it.extent.end - it.extent.start)
    }

    /// The declaration that stands for this one and those that replace it or that it replaces: in the class farthest up
    /// that has it; of functions the first of the same parameters.
    pub fn canonical(&self, id: DeclarationId) -> DeclarationId {
        self.canonical[id.0]
    }

    /// The class of this name.
    pub fn class(&self, name: &str) -> Option<DeclarationId> {
        let mut classes = self.iter().filter(|(_, it)| it.kind == DeclarationKind::Class);
        classes.find(|(_, it)| it.name == name).map(|(id, _)| id)
    }
}

/// True if `outer` contains `inner`.
pub(crate) fn contains(outer: Span, inner: Span) -> bool {
    outer.file == inner.file && outer.start <= inner.start && inner.end <= outer.end
}

struct Collector<'a> {
    analysis: &'a Analysis,
    declarations: Declarations,
    parent: Option<DeclarationId>,
    /// The comments of the files so far.
    comments: HashMap<FileId, Comments>,
}

impl Collector<'_> {
    fn unit(&mut self, unit: &ast::TranslationUnit) {
        for import in &unit.imports {
            if let Some(name) = import.name() {
                let text = format!("import {}", import.dotted());
                self.add(name, name.span, import.span, DeclarationKind::Module, text, None);
            }
        }
        self.items(&unit.items);
    }

    fn items(&mut self, items: &[Item]) {
        for item in items {
            match item {
                Item::Struct(structure) => self.structure(structure),
                Item::Enumeration(enumeration) => self.enumeration(enumeration),
                Item::Assertion(_) => {}
                Item::Function(function) => self.function(function),
                Item::Variable(variable) => {
                    let kind = kind_of_member(&variable.qualifiers, self.parent.is_some());
                    self.variable(variable, kind);
                }
                Item::Class(class) => self.class(class),
            }
        }
    }

    fn class(&mut self, class: &ast::Class) {
        let text = self.text(class.span).trim_end_matches(['{', ';']).trim_end().to_owned();
        let documentation = class.documentation.clone();
        let extent = class.span.to(class.end);
        let id =
            self.add(&class.name, class.span, extent, DeclarationKind::Class, text, documentation);
        let bases = class.bases.iter().map(|base| base.name.clone()).collect();
        self.declarations.bases.insert(id, bases);
        self.inside(id, |this| this.items(&class.items));
    }

    fn structure(&mut self, structure: &ast::Struct) {
        let text = format!("struct {}", structure.name.name);
        let documentation = self.comment(structure.span);
        let extent = structure.span;
        let kind = DeclarationKind::Struct;
        let id = self.add(&structure.name, structure.name.span, extent, kind, text, documentation);
        self.inside(id, |this| {
            for field in &structure.fields {
                let ty = this.type_text(&field.ty);
                let text = format!("{ty} {}", field.name.name);
                let (span, kind) = (field.name.span, DeclarationKind::Field);
                let documentation = this.comment(field.ty.span);
                this.add(&field.name, span, field.ty.span.to(span), kind, text, documentation);
            }
        });
    }

    fn enumeration(&mut self, enumeration: &ast::Enumeration) {
        let text = format!("enum {}", enumeration.name.name);
        let documentation = self.comment(enumeration.span);
        let (span, extent) = (enumeration.name.span, enumeration.span);
        let kind = DeclarationKind::Enumeration;
        let id = self.add(&enumeration.name, span, extent, kind, text, documentation);
        self.inside(id, |this| {
            for (name, value) in &enumeration.choices {
                let extent = value.as_ref().map_or(name.span, |value| name.span.to(value.span));
                let text = format!("{}.{}", enumeration.name.name, this.text(extent));
                this.add(name, name.span, extent, DeclarationKind::Choice, text, None);
            }
        });
    }

    fn function(&mut self, function: &ast::Function) {
        let body = function.body.as_ref();
        let extent = body.map_or(function.span, |body| function.span.to(body.span));
        let kind = match &function.result {
            None => DeclarationKind::Constructor,
            Some(_) => DeclarationKind::Function,
        };
        let text = on_one_line(self.text(function.span));
        let documentation = function.documentation.clone();
        let id = self.add(&function.name, function.span, extent, kind, text, documentation);
        let types = function.parameters.iter().map(|parameter| self.type_text(&parameter.ty));
        self.declarations.list[id.0].parameters = types.collect();
        self.inside(id, |this| {
            for parameter in &function.parameters {
                let Some(name) = &parameter.name else { continue };
                let text = on_one_line(this.text(parameter.span));
                let documentation = documentation_of(&parameter.annotations);
                let kind = DeclarationKind::Argument;
                this.add(name, name.span, parameter.span, kind, text, documentation);
            }
            if let Some(body) = body {
                this.block(body);
            }
        });
    }

    fn variable(&mut self, variable: &ast::Variable, kind: DeclarationKind) {
        let ty = self.type_text(&variable.ty);
        let qualifiers = variable.qualifiers.list.iter().map(|(_, span)| self.text(*span));
        let mut words: Vec<String> = qualifiers.map(str::to_owned).collect();
        words.push(ty);
        words.push(shortened(&on_one_line(self.text(variable.span))));
        let first = variable.qualifiers.list.first().map_or(variable.ty.span, |(_, span)| *span);
        let comment = match kind {
            DeclarationKind::Local => None,
            _ => self.comment(self.line_of(first, &variable.annotations)),
        };
        let parts = [documentation_of(&variable.annotations), comment];
        let parts: Vec<String> = parts.into_iter().flatten().collect();
        let documentation = (!parts.is_empty()).then(|| parts.join("\n\n"));
        let extent = first.to(variable.span);
        self.add(&variable.name, variable.name.span, extent, kind, words.join(" "), documentation);
    }

    /// The beginning of a declaration with its annotations.
    fn line_of(&self, first: Span, annotations: &[Annotation]) -> Span {
        let Some(annotation) = annotations.first() else { return first };
        let text = &self.analysis.sources.file(annotation.key.span.file).text;
        let before = &text[..annotation.key.span.start as usize];
        let start = before.trim_end().trim_end_matches('[').len() as u32;
        Span { start, ..annotation.key.span }
    }

    fn block(&mut self, block: &Block) {
        block.statements.iter().for_each(|statement| self.statement(statement));
    }

    fn variables(&mut self, variables: &[ast::Variable]) {
        for variable in variables {
            self.variable(variable, DeclarationKind::Local);
        }
    }

    fn statement(&mut self, statement: &Statement) {
        match &statement.kind {
            StatementKind::Variables(variables) => self.variables(variables),
            StatementKind::Struct(structure, variables) => {
                self.structure(structure);
                self.variables(variables);
            }
            StatementKind::Block(block) => self.block(block),
            StatementKind::If { then, otherwise, .. } => {
                self.statement(then);
                otherwise.iter().for_each(|statement| self.statement(statement));
            }
            StatementKind::Switch { cases, .. } => {
                let statements = cases.iter().flat_map(|case| &case.statements);
                statements.for_each(|statement| self.statement(statement));
            }
            StatementKind::For { initializer, condition, body, .. } => {
                self.statement(initializer);
                condition.iter().for_each(|condition| self.condition(condition));
                self.statement(body);
            }
            StatementKind::While { condition, body } => {
                self.condition(condition);
                self.statement(body);
            }
            StatementKind::DoWhile { body, .. } | StatementKind::Illuminance { body, .. } => {
                self.statement(body);
            }
            StatementKind::Empty
            | StatementKind::Expression(_)
            | StatementKind::Assertion(_)
            | StatementKind::Print(_)
            | StatementKind::Function(_)
            | StatementKind::Return(_)
            | StatementKind::Break
            | StatementKind::Continue => {}
        }
    }

    fn condition(&mut self, condition: &Condition) {
        if let Condition::Declaration(variable) = condition {
            self.variable(variable, DeclarationKind::Local);
        }
    }

    fn add(
        &mut self,
        name: &ast::Identifier,
        header: Span,
        extent: Span,
        kind: DeclarationKind,
        text: String,
        documentation: Option<String>,
    ) -> DeclarationId {
        let id = DeclarationId(self.declarations.list.len());
        self.declarations.children.entry(self.parent).or_default().push(id);
        self.declarations.by_span.entry(name.span).or_insert(id);
        self.declarations.by_span.entry(header).or_insert(id);
        self.declarations.list.push(Declaration {
            name: name.name.clone(),
            span: name.span,
            header,
            extent,
            kind,
            text,
            documentation,
            parent: self.parent,
            parameters: Vec::new(),
        });
        id
    }

    fn inside(&mut self, id: DeclarationId, collect: impl FnOnce(&mut Self)) {
        let outer = self.parent.replace(id);
        collect(self);
        self.parent = outer;
    }

    fn text(&self, span: Span) -> &str {
        self.analysis.sources.text(span)
    }

    fn type_text(&self, ty: &ast::TypeName) -> String {
        // The sizes after a declarator's name are part of the type's span.
        let text = self.text(ty.name.span).to_owned();
        let inner = &self.analysis.sources.file(ty.span.file).text;
        let after = &inner[ty.name.span.end as usize..];
        match after.starts_with('[').then(|| after.find(']')).flatten() {
            Some(end) => text + &after[..=end],
            None => text,
        }
    }

    fn comment(&mut self, at: Span) -> Option<String> {
        let text = &self.analysis.sources.file(at.file).text;
        let comments = self.comments.entry(at.file).or_insert_with(|| Comments::of(text));
        comments.before(text, at.start as usize)
    }
}

fn kind_of_member(qualifiers: &ast::Qualifiers, in_class: bool) -> DeclarationKind {
    if qualifiers.find(Qualifier::Const).is_some() || !in_class {
        return DeclarationKind::Constant;
    }
    let is_parameter = [Qualifier::Public, Qualifier::Uniform, Qualifier::Texture];
    if is_parameter.iter().any(|it| qualifiers.find(*it).is_some()) {
        DeclarationKind::Parameter
    } else {
        DeclarationKind::Member
    }
}

/// The description of a value by its annotations, in Markdown.
fn documentation_of(annotations: &[Annotation]) -> Option<String> {
    let text = |key: &str| {
        annotations.iter().find(|it| it.key.name == key).and_then(|it| match &it.value {
            AnnotationValue::Text(text, _) => Some(text.clone()),
            AnnotationValue::None | AnnotationValue::Expression(_) => None,
        })
    };
    let has = |key: &str| annotations.iter().any(|it| it.key.name == key);
    let mut parts = Vec::new();
    parts.extend(text("label").map(|label| format!("**{label}**")));
    parts.extend(text("doc"));
    parts.extend(text("unit").map(|unit| format!("Unit: {unit}.")));
    if has("min") || has("max") {
        let number = |key: &str| {
            let value = &annotations.iter().find(|it| it.key.name == key)?.value;
            match value {
                AnnotationValue::Expression(value) => number_of(value),
                AnnotationValue::None | AnnotationValue::Text(..) => None,
            }
        };
        let range = match (number("min"), number("max")) {
            (Some(min), Some(max)) => Some(format!("From {min} to {max}.")),
            (Some(min), None) => Some(format!("At least {min}.")),
            (None, Some(max)) => Some(format!("At most {max}.")),
            (None, None) => None,
        };
        parts.extend(range);
    }
    (!parts.is_empty()).then(|| parts.join(" "))
}

fn number_of(value: &ast::Expression) -> Option<String> {
    match &value.kind {
        ast::ExpressionKind::Int(value) => Some(value.to_string()),
        ast::ExpressionKind::Uint(value) => Some(value.to_string()),
        ast::ExpressionKind::Float(value) => Some(value.to_string()),
        ast::ExpressionKind::Unary(ast::UnaryOperator::Negate, inner) => {
            number_of(inner).map(|number| format!("-{number}"))
        }
        _ => None,
    }
}

fn on_one_line(text: &str) -> String {
    text.split_whitespace().collect::<Vec<_>>().join(" ")
}

/// Cuts long values.
fn shortened(text: &str) -> String {
    const LONGEST: usize = 80;
    match text.char_indices().nth(LONGEST) {
        Some((end, _)) => format!("{} …", text[..end].trim_end()),
        None => text.to_owned(),
    }
}
