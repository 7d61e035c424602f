//! Names: what they stand for, at file scope, in a class and in blocks.

use std::collections::BTreeMap;
use std::sync::Arc;

use rtsl_ir::Constant;
use rtsl_source::{Diagnostic, Span, diagnostic_codes as codes};
use rtsl_syntax::ast;

use super::Checker;
use crate::hir::{FunctionId, LocalId, MemberId, StructId, Type};

/// What a name stands for.
#[derive(Clone, Debug)]
pub(super) enum Entity {
    /// A parameter or variable of the function being checked.
    Local(LocalId),
    /// A member of the class being checked.
    Member(MemberId),
    /// A constant of known value.
    Constant(Type, Arc<[Constant]>),
    /// A struct.
    Struct(StructId),
    /// Functions of one name at one level.
    Functions(Vec<FunctionId>),
    /// An index into the checker's classes.
    Class(usize),
    /// Something whose declaration has been reported.
    Error,
}

impl Entity {
    /// What it is, with its article.
    pub(super) fn kind(&self) -> &'static str {
        match self {
            Entity::Local(_) => "a variable",
            Entity::Member(_) => "a member",
            Entity::Constant(..) => "a constant",
            Entity::Struct(_) => "a struct",
            Entity::Functions(_) => "a function",
            Entity::Class(_) => "a class",
            Entity::Error => "a name",
        }
    }
}

/// A name's meaning, and where it was declared.
#[derive(Clone, Debug)]
pub(super) struct Named {
    /// What it stands for.
    pub(super) entity: Entity,
    /// The name in its declaration.
    pub(super) span: Span,
}

/// The names of one scope.
pub(super) type Level = BTreeMap<String, Named>;

/// The scopes of a function, the innermost last.
#[derive(Debug, Default)]
pub(super) struct Scopes {
    levels: Vec<Level>,
    /// How many of them there are where the body of a loop has begun, the innermost last.
    bodies: Vec<usize>,
}

impl Scopes {
    /// Opens a scope.
    pub(super) fn push(&mut self) {
        self.levels.push(Level::new());
    }

    /// Opens the scope of a loop's body: its names differ from those that the innermost scope, that of the loop,
    /// has already.
    pub(super) fn push_body(&mut self) {
        self.push();
        self.bodies.push(self.levels.len());
    }

    /// Closes the innermost scope and gives its names.
    pub(super) fn pop(&mut self) -> Level {
        if self.bodies.last() == Some(&self.levels.len()) {
            self.bodies.pop();
        }
        self.levels.pop().unwrap_or_default()
    }

    /// What the header of the loop whose body is the innermost scope declares as `name`.
    fn in_header(&self, name: &str) -> Option<&Named> {
        let depth = self.levels.len();
        let is_body = depth >= 2 && self.bodies.last() == Some(&depth);
        if is_body { self.levels[depth - 2].get(name) } else { None }
    }

    /// All names in reach, the innermost first.
    pub(super) fn names(&self) -> impl Iterator<Item = &str> {
        self.levels.iter().rev().flat_map(|level| level.keys().map(String::as_str))
    }

    fn find(&self, name: &str) -> Option<&Named> {
        self.levels.iter().rev().find_map(|level| level.get(name))
    }
}

impl Checker<'_> {
    /// What `name` stands for here: in the blocks of the function, the class, the file.
    pub(super) fn find(&self, name: &str) -> Option<&Named> {
        self.scopes
            .find(name)
            .or_else(|| self.class.as_ref().and_then(|class| class.names.get(name)))
            .or_else(|| self.file.get(name))
    }

    /// The scope that declarations go to now.
    pub(super) fn innermost(&mut self) -> &mut Level {
        if let Some(level) = self.scopes.levels.last_mut() {
            return level;
        }
        match &mut self.class {
            Some(class) => &mut class.names,
            None => &mut self.file,
        }
    }

    /// Declares `name`; where the scope has it already, that is an error and the first stays.
    pub(super) fn declare(&mut self, name: &ast::Identifier, entity: Entity) {
        self.check_name_free_to_use(name);
        let named = Named { entity, span: name.span };
        let in_header = self.scopes.in_header(&name.name).cloned();
        if let Some(previous) = in_header.or_else(|| self.innermost().get(&name.name).cloned()) {
            self.report_duplicate(name, &previous);
        } else {
            self.innermost().insert(name.name.clone(), named);
        }
    }

    /// Says that `name` was declared before.
    pub(super) fn report_duplicate(&mut self, name: &ast::Identifier, previous: &Named) {
        self.report(
            Diagnostic::new(codes::DECLARED_TWICE, format!("`{}` is declared twice", name.name))
                .at(name.span, "declared again here")
                .label(
                    previous.span,
                    format!("{} of that name is declared here", previous.entity.kind()),
                ),
        );
    }

    /// Names of the language cannot be declared by shaders.
    pub(super) fn check_name_free_to_use(&mut self, name: &ast::Identifier) {
        if self.in_prelude {
            return;
        }
        let reason = if name.name.starts_with("rt_") {
            "names that start with `rt_` belong to the language"
        } else if name.name.contains("__") {
            "names with two underscores in a row are reserved"
        } else {
            return;
        };
        self.report(
            Diagnostic::new(codes::RESERVED_NAME, format!("`{}` cannot be declared", name.name))
                .at(name.span, "reserved name")
                .note(reason),
        );
    }
}
