//! Scopes: the meaning of names at file scope, in a class and in blocks.

use std::collections::BTreeMap;
use std::sync::Arc;

use rtsl_ir::Constant;
use rtsl_source::{Diagnostic, Span, diagnostic_codes as codes};
use rtsl_syntax::ast;

use super::Checker;
use crate::hir::{FunctionId, LocalId, MemberId, StructId, Type};

/// The entity that a name denotes.
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
    /// An enumeration: the names and values of its choices.
    Enumeration(Arc<[(String, i32)]>),
    /// Functions of one name at one level.
    Functions(Vec<FunctionId>),
    /// An index into the checker's classes.
    Class(usize),
    /// A module.
    Module,
    /// An entity whose declaration had an error that was reported.
    Error,
}

impl Entity {
    /// The kind of entity, with its article.
    pub(super) fn kind(&self) -> &'static str {
        match self {
            Entity::Local(_) => "a variable",
            Entity::Member(_) => "a member",
            Entity::Constant(..) => "a constant",
            Entity::Struct(_) => "a struct",
            Entity::Enumeration(_) => "an enumeration",
            Entity::Functions(_) => "a function",
            Entity::Class(_) => "a class",
            Entity::Module => "a module",
            Entity::Error => "a name",
        }
    }
}

/// The entity that a name denotes, and the span of its declaration.
#[derive(Clone, Debug)]
pub(super) struct Named {
    /// The entity.
    pub(super) entity: Entity,
    /// The span of the name in its declaration.
    pub(super) span: Span,
}

/// The names of one scope.
pub(super) type Level = BTreeMap<String, Named>;

/// The scopes of a function, the innermost last.
#[derive(Debug, Default)]
pub(super) struct Scopes {
    levels: Vec<Level>,
    /// The number of levels at the start of each loop body, the innermost last.
    bodies: Vec<usize>,
}

impl Scopes {
    /// Opens a scope.
    pub(super) fn push(&mut self) {
        self.levels.push(Level::new());
    }

    /// Opens the scope of a loop's body. It may not declare names again that the scope of the
    /// loop's header, the innermost until then, declares.
    pub(super) fn push_body(&mut self) {
        self.push();
        self.bodies.push(self.levels.len());
    }

    /// Closes the innermost scope and returns its names.
    pub(super) fn pop(&mut self) -> Level {
        if self.bodies.last() == Some(&self.levels.len()) {
            self.bodies.pop();
        }
        self.levels.pop().unwrap_or_default()
    }

    /// The entity called `name` in the header of the loop whose body is the innermost scope.
    fn in_header(&self, name: &str) -> Option<&Named> {
        let depth = self.levels.len();
        let is_body = depth >= 2 && self.bodies.last() == Some(&depth);
        if is_body { self.levels[depth - 2].get(name) } else { None }
    }

    /// The scopes, the innermost last.
    pub(super) fn levels(&self) -> impl DoubleEndedIterator<Item = &Level> {
        self.levels.iter()
    }

    /// All visible names, the innermost first.
    pub(super) fn names(&self) -> impl Iterator<Item = &str> {
        self.levels.iter().rev().flat_map(|level| level.keys().map(String::as_str))
    }

    fn find(&self, name: &str) -> Option<&Named> {
        self.levels.iter().rev().find_map(|level| level.get(name))
    }
}

impl Checker<'_> {
    /// Looks `name` up in the blocks of the function, the class and the file.
    pub(super) fn find(&self, name: &str) -> Option<&Named> {
        self.scopes
            .find(name)
            .or_else(|| self.class.as_ref().and_then(|class| class.names.get(name)))
            .or_else(|| self.file.get(name))
    }

    /// The scope that receives declarations.
    pub(super) fn innermost(&mut self) -> &mut Level {
        if let Some(level) = self.scopes.levels.last_mut() {
            return level;
        }
        match &mut self.class {
            Some(class) => &mut class.names,
            None => &mut self.file,
        }
    }

    /// Declares `name`. If the scope has it already, that is an error and the first declaration
    /// remains.
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

    /// Reports that `name` was declared before.
    pub(super) fn report_duplicate(&mut self, name: &ast::Identifier, previous: &Named) {
        self.report_duplicate_with(name, previous, |diagnostic| diagnostic);
    }

    /// Reports that `name` was declared before, with a remedy.
    pub(super) fn report_duplicate_with(
        &mut self,
        name: &ast::Identifier,
        previous: &Named,
        advise: impl FnOnce(Diagnostic) -> Diagnostic,
    ) {
        self.report(advise(
            Diagnostic::new(codes::DECLARED_TWICE, format!("`{}` is declared twice", name.name))
                .at(name.span, "declared again here")
                .label(
                    previous.span,
                    format!("{} of that name is declared here", previous.entity.kind()),
                ),
        ));
    }

    /// Reports names of the language, which shaders cannot declare.
    pub(super) fn check_name_free_to_use(&mut self, name: &ast::Identifier) {
        if self.in_prelude {
            return;
        }
        let Some(reason) = rtsl_syntax::reserved_name(&name.name) else { return };
        self.report(
            Diagnostic::new(codes::RESERVED_NAME, format!("`{}` cannot be declared", name.name))
                .at(name.span, "reserved name")
                .note(reason),
        );
    }
}
