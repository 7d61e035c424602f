//! Bases of a class: its roles, and the one class whose items it inherits.

use std::collections::BTreeSet;

use rtsl_source::{Diagnostic, diagnostic_codes as codes};
use rtsl_spec::Role;
use rtsl_syntax::ast;

use super::Checker;
use super::classes::ClassDeclaration;
use super::foreign::{advise, role_counterpart};
use super::references::quoted_list;
use super::scope::Entity;
use super::suggestions::suggest;

/// The limit on bytes of inherited text that one unit may have checked again. Without it, many
/// classes that inherit a long text would make the work quadratic.
pub(super) const INHERITED_TEXT_LIMIT: usize = 2 << 20;

/// The maximum length of a chain of classes that inherit from each other.
const MAX_CHAIN: usize = 16;

/// The resolved bases of a class.
#[derive(Debug, Default)]
pub(super) struct Bases {
    /// The roles in the order of [`Role::ALL`], including the parent's.
    pub(super) roles: Vec<Role>,
    /// The index of the class inherited from.
    pub(super) parent: Option<usize>,
    /// True if some base is in error, so that the class may be meant to have further roles.
    pub(super) unknown: bool,
}

/// An item of a class, and the generation that declares it.
#[derive(Clone, Copy, Debug)]
pub(super) struct ClassItem<'a> {
    pub(super) item: &'a ast::Item,
    /// 0 for the class's own items; else the number of generations up.
    pub(super) generation: usize,
    /// The module that declares it.
    pub(super) home: Option<usize>,
}

impl<'a> Checker<'a> {
    /// Resolves the names after the colon.
    pub(super) fn check_bases(&mut self, class: &ast::Class) -> Bases {
        let mut bases = Bases::default();
        let mut roles = Vec::new();
        let mut named: BTreeSet<&str> = BTreeSet::new();
        for base in &class.bases {
            if !named.insert(&base.name) {
                self.report_bases(format!("`{}` is named twice", base.name), base, "again here");
            } else if let Some(role) = Role::from_class(&base.name) {
                self.note_base(base, None);
                roles.push(role);
            } else {
                self.check_parent(base, &mut bases);
            }
        }
        if let Some(parent) = bases.parent {
            let parent = &self.classes[parent];
            roles.extend(parent.roles.iter().copied());
            bases.unknown |= parent.roles_unknown;
        }
        bases.roles = Role::ALL.into_iter().filter(|role| roles.contains(role)).collect();
        if bases.roles.is_empty() && !bases.unknown {
            self.report_bases(
                format!("the class `{}` has no role", class.name.name),
                &class.name,
                "expected a base such as `rt_Material`",
            );
            bases.unknown = true;
        }
        bases
    }

    fn report_bases(&mut self, message: String, at: &ast::Identifier, label: &str) {
        self.report(
            Diagnostic::new(codes::BAD_BASES, message).at(at.span, label).note(
                "a class has one role or several, and at most one class that it inherits from",
            ),
        );
    }

    fn check_parent(&mut self, base: &ast::Identifier, bases: &mut Bases) {
        let found = self.file.get(&base.name).map(|named| named.entity.clone());
        let found = found.or_else(|| self.class_of_base(&base.name));
        let index = match found {
            Some(Entity::Class(index)) => {
                self.note_base(base, Some(self.classes[index].ast.name.span));
                index
            }
            Some(Entity::Error) => {
                bases.unknown = true;
                return;
            }
            Some(_) | None => {
                self.note_base(base, None);
                bases.unknown = true;
                self.report_unknown_base(base);
                return;
            }
        };
        if bases.parent.is_some() {
            self.report_bases(
                format!("`{}` is a second class to inherit from", base.name),
                base,
                "only one is allowed",
            );
        } else if self.chain(index).len() >= MAX_CHAIN {
            bases.unknown = true;
            self.report(
                Diagnostic::new(codes::TOO_MUCH_INHERITED, "a class inherits from too many others")
                    .at(base.span, format!("the limit is a chain of {MAX_CHAIN}")),
            );
        } else {
            bases.parent = Some(index);
        }
    }

    fn report_unknown_base(&mut self, base: &ast::Identifier) {
        let diagnostic =
            Diagnostic::new(codes::UNKNOWN_BASE, format!("there is no class `{}`", base.name))
                .at(base.span, "unknown class");
        if !base.name.starts_with("rt_") {
            let diagnostic = diagnostic.note("a class can be used only after its declaration");
            let similar = self.similar_class(&base.name);
            return self.report(suggest(diagnostic, base.span, similar));
        }
        let roles = Role::ALL.map(Role::class);
        let diagnostic = diagnostic.note(format!("the roles are {}", quoted_list(&roles)));
        let similar = self.similar_of(&base.name, roles);
        self.report(match (similar, role_counterpart(&base.name)) {
            (None, Some(counterpart)) => advise(diagnostic, base.span, counterpart),
            (similar, _) => suggest(diagnostic, base.span, similar),
        });
    }

    /// The class and its ancestors, the nearest first.
    fn chain(&self, start: usize) -> Vec<usize> {
        let mut chain = vec![start];
        let mut last = start;
        while let Some(parent) = self.classes[last].parent {
            chain.push(parent);
            last = parent;
        }
        chain
    }

    /// The items of a class, those of the farthest ancestor first.
    pub(super) fn items_with_inherited(&mut self, index: usize) -> Vec<ClassItem<'a>> {
        let chain = self.chain(index);
        let mut items = Vec::new();
        for (generation, ancestor) in chain.into_iter().enumerate().rev() {
            let ClassDeclaration { ast: class, home, .. } = self.classes[ancestor];
            if generation > 0 && !self.spend_inherited(class, self.classes[index].ast) {
                continue;
            }
            items.extend(class.items.iter().map(|item| ClassItem { item, generation, home }));
        }
        items
    }

    fn spend_inherited(&mut self, ancestor: &ast::Class, class: &ast::Class) -> bool {
        let bytes = ancestor.items.iter().map(item_length).sum();
        self.spend_copied(bytes, &ancestor.name.name, class)
    }

    /// Charges the implied methods of a class to the limit on inherited text. Returns false if it
    /// is exceeded.
    pub(super) fn spend_implied(
        &mut self,
        functions: &[&ast::Function],
        class: &ast::Class,
    ) -> bool {
        let bytes = functions.iter().map(|function| function_length(function)).sum();
        self.spend_copied(bytes, "rt_Material", class)
    }

    fn spend_copied(&mut self, bytes: usize, copied: &str, class: &ast::Class) -> bool {
        let left = self.inheritable.checked_sub(bytes);
        if left.is_none() {
            self.report(
                Diagnostic::new(
                    codes::TOO_MUCH_INHERITED,
                    "the classes of this file inherit too much text",
                )
                .at(class.span, format!("`{copied}` cannot be copied again"))
                .note(format!("the limit is {INHERITED_TEXT_LIMIT} bytes in all")),
            );
        }
        self.inheritable = left.unwrap_or(self.inheritable);
        left.is_some()
    }
}

/// The minimum size that an item is charged with.
const MIN_LENGTH: usize = 16;

/// The approximate length of an item's text.
fn item_length(item: &ast::Item) -> usize {
    let span = match item {
        ast::Item::Struct(declaration) => declaration.span,
        ast::Item::Enumeration(declaration) => declaration.span,
        ast::Item::Assertion(assertion) => assertion.span,
        ast::Item::Variable(variable) => variable.span,
        ast::Item::Class(class) => class.span,
        ast::Item::Function(function) => return function_length(function),
    };
    (span.end.saturating_sub(span.start) as usize).max(MIN_LENGTH)
}

/// The approximate length of a function's text. Text from macros is measured by the number of
/// statements.
fn function_length(function: &ast::Function) -> usize {
    const PER_STATEMENT: usize = 32;
    let (span, statements) = match &function.body {
        Some(body) => (body.span, body.statements.len()),
        None => (function.span, 0),
    };
    let bytes = span.end.saturating_sub(span.start) as usize;
    bytes.max(statements * PER_STATEMENT).max(MIN_LENGTH)
}
