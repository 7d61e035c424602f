//! Bases: roles, and the one class whose items a class takes over.

use rtsl_source::{Diagnostic, diagnostic_codes as codes};
use rtsl_spec::Role;
use rtsl_syntax::ast;

use super::Checker;
use super::scope::Entity;
use super::suggestions::suggest;

/// How many bytes of inherited text one unit may have checked again: many classes that inherit a
/// long text would make a compiler's work the product of both.
pub(super) const INHERITED_TEXT_LIMIT: usize = 8 << 20;

/// The longest chain of classes that inherit from each other.
const MAX_CHAIN: usize = 16;

/// What a class's list of bases comes to.
#[derive(Debug, Default)]
pub(super) struct Bases {
    /// In the order of [`Role::ALL`], the parent's among them.
    pub(super) roles: Vec<Role>,
    /// The class inherited from.
    pub(super) parent: Option<usize>,
    /// Some base is in error, so that more roles may have been meant.
    pub(super) unknown: bool,
}

/// An item of a class, with where it comes from.
#[derive(Clone, Copy, Debug)]
pub(super) struct ClassItem<'a> {
    pub(super) item: &'a ast::Item,
    /// 0 for the class's own; else how many generations up.
    pub(super) generation: usize,
}

impl<'a> Checker<'a> {
    /// Resolves the names after the colon.
    pub(super) fn check_bases(&mut self, class: &ast::Class) -> Bases {
        let mut bases = Bases::default();
        let mut roles = Vec::new();
        for (index, base) in class.bases.iter().enumerate() {
            if class.bases[..index].iter().any(|other| other.name == base.name) {
                self.report_bases(format!("`{}` is named twice", base.name), base, "again here");
            } else if let Some(role) = Role::from_class(&base.name) {
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
        let index = match found {
            Some(Entity::Class(index)) => index,
            Some(Entity::Error) => {
                bases.unknown = true;
                return;
            }
            Some(_) | None => {
                bases.unknown = true;
                self.report_unknown_base(base);
                return;
            }
        };
        if bases.parent.is_some() {
            self.report_bases(
                format!("`{}` is a second class to inherit from", base.name),
                base,
                "one is enough",
            );
        } else if self.chain(index).len() >= MAX_CHAIN {
            bases.unknown = true;
            self.report(
                Diagnostic::new(codes::TOO_MUCH_INHERITED, "a class inherits from too many others")
                    .at(base.span, format!("the limit is {MAX_CHAIN}, one through the other")),
            );
        } else {
            bases.parent = Some(index);
        }
    }

    fn report_unknown_base(&mut self, base: &ast::Identifier) {
        let diagnostic =
            Diagnostic::new(codes::UNKNOWN_BASE, format!("there is no class `{}`", base.name))
                .at(base.span, "unknown class")
                .note("a class is known from its declaration on");
        let similar = self.similar_class(&base.name);
        self.report(suggest(diagnostic, base.span, similar));
    }

    /// The class and those it inherits from, the nearest first.
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
            let class = self.classes[ancestor].ast;
            if generation > 0 && !self.spend_inherited(class, self.classes[index].ast) {
                continue;
            }
            items.extend(class.items.iter().map(|item| ClassItem { item, generation }));
        }
        items
    }

    fn spend_inherited(&mut self, ancestor: &ast::Class, class: &ast::Class) -> bool {
        let bytes: usize = ancestor.items.iter().map(text_length).sum();
        match self.inheritable.checked_sub(bytes) {
            Some(left) => {
                self.inheritable = left;
                true
            }
            None => {
                self.report(
                    Diagnostic::new(
                        codes::TOO_MUCH_INHERITED,
                        "the classes of this file inherit too much text",
                    )
                    .at(class.span, format!("`{}` cannot be copied again", ancestor.name.name))
                    .note(format!("the limit is {INHERITED_TEXT_LIMIT} bytes in all")),
                );
                false
            }
        }
    }
}

/// About how much text an item is; at least some, so that every item counts. Items that macros
/// made count by what they come to, which the number of their statements bounds.
fn text_length(item: &ast::Item) -> usize {
    const LEAST: usize = 16;
    const PER_STATEMENT: usize = 32;
    let (span, statements) = match item {
        ast::Item::Struct(declaration) => (declaration.span, 0),
        ast::Item::Variable(variable) => (variable.span, 0),
        ast::Item::Class(class) => (class.span, 0),
        ast::Item::Function(function) => match &function.body {
            Some(body) => (body.span, body.statements.len()),
            None => (function.span, 0),
        },
    };
    (span.end.saturating_sub(span.start) as usize).max(statements * PER_STATEMENT).max(LEAST)
}
