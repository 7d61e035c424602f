//! Enumerations: named choices for integers.
//!
//! The name of an enumeration is a name of `int`, and its choices are constants. Parameters that are declared with it
//! carry the choices to hosts, as an annotation.

use std::collections::BTreeMap;
use std::sync::Arc;

use rtsl_ir::Constant;
use rtsl_ir::class::{Annotation, AnnotationValue, CHOICES};
use rtsl_source::{Diagnostic, diagnostic_codes as codes};
use rtsl_syntax::ast;

use super::Checker;
use super::functions::Kind;
use super::scope::Entity;
use super::types::INT;
use crate::hir::Type;

/// The limit on the bytes of names of choices that the parameters of a unit carry to hosts.
pub(super) const CHOICES_LIMIT: usize = 1 << 20;

impl Checker<'_> {
    /// Declares an enumeration and its choices in the innermost scope.
    pub(super) fn declare_enumeration(&mut self, declaration: &ast::Enumeration) {
        if declaration.choices.is_empty() {
            self.report(
                Diagnostic::new(codes::BAD_ENUMERATION, "an enumeration needs at least one choice")
                    .at(declaration.span, "no choices"),
            );
            self.declare(&declaration.name, Entity::Error);
            return;
        }
        let mut choices: Vec<(String, i32)> = Vec::new();
        let mut names: BTreeMap<i32, &str> = BTreeMap::new();
        for (name, written) in &declaration.choices {
            let value = match (written, choices.last()) {
                (Some(written), _) => self.value_of_choice(written),
                (None, Some((_, before))) => Some(before.wrapping_add(1)),
                (None, None) => Some(0),
            };
            let Some(value) = value else {
                self.declare(name, Entity::Error);
                continue;
            };
            if let Some(other) = names.insert(value, &name.name) {
                let message = format!("`{}` has the value of `{other}`, {value}", name.name);
                self.report(
                    Diagnostic::new(codes::BAD_ENUMERATION, message)
                        .at(name.span, "hosts could not tell the two")
                        .help("give each choice a value of its own"),
                );
            }
            choices.push((name.name.clone(), value));
            self.declare(name, Entity::Constant(INT, Arc::new([Constant::I32(value)])));
        }
        self.declare(&declaration.name, Entity::Enumeration(choices.into()));
    }

    fn value_of_choice(&mut self, written: &ast::Expression) -> Option<i32> {
        self.check_outside(Kind::Constant, |checker| {
            let value = checker.check_expression(written);
            let value = checker.expect_type(value, &INT, "the value of a choice");
            match checker.evaluate_constant(&value, "the value of a choice")?[..] {
                [Constant::I32(value)] => Some(value),
                _ => None,
            }
        })
    }

    /// Adds the choices of a parameter whose type is written as an enumeration to its annotations.
    pub(super) fn add_choices(
        &mut self,
        written: &ast::TypeName,
        ty: &Type,
        annotations: &mut Vec<Annotation>,
    ) {
        let found = self.find(&written.name.name).map(|named| &named.entity);
        let Some(Entity::Enumeration(choices)) = found else { return };
        if *ty == Type::Error {
            return;
        }
        let bytes = choices.iter().map(|(name, _)| name.len()).sum();
        let Some(left) = self.choices_left.checked_sub(bytes) else {
            self.report(
                Diagnostic::new(
                    codes::BAD_ENUMERATION,
                    "the parameters of this file have too many choices",
                )
                .at(written.span, "those of this one exceed the limit")
                .note(format!("their names may have {CHOICES_LIMIT} letters in all"))
                .help("declare it as `int`"),
            );
            return;
        };
        let choices: Vec<String> =
            choices.iter().map(|(name, value)| format!("{name} = {value}")).collect();
        self.choices_left = left;
        let value = AnnotationValue::Text(choices.join(", "));
        annotations.push(Annotation { key: CHOICES.to_owned(), value });
    }
}
