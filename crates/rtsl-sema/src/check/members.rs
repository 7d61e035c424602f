//! Members: storage, initial values, annotations.

use std::collections::BTreeSet;

use rtsl_ir::class::{Annotation, AnnotationValue, CHOICES};
use rtsl_ir::{Constant, Scalar};
use rtsl_source::{Code, Diagnostic, diagnostic_codes as codes};
use rtsl_spec::{ANNOTATION_KEYS, AnnotationKind};
use rtsl_syntax::ast::{self, Qualifier};

use super::Checker;
use super::constructors::is_open;
use super::functions::{Kind, qualifier_name};
use super::references::quoted_list;
use super::scope::{Entity, Named};
use super::types::{TypePlace, holds_reference};
use crate::hir::{Expression, FunctionId, Member, MemberId, Storage, Type};

/// A value of this kind, in messages.
fn expected(kind: AnnotationKind) -> &'static str {
    match kind {
        AnnotationKind::Text => "text in double quotes",
        AnnotationKind::Number => "a number",
        AnnotationKind::Flag => "no value",
    }
}

impl Checker<'_> {
    /// Declares a member of the class.
    pub(super) fn declare_member(&mut self, variable: &ast::Variable, generation: usize) {
        let storage = self.check_storage(&variable.qualifiers);
        let written = self.resolve_type(&variable.ty, TypePlace::Member);
        let initializer = self.check_member_initializer(&written, storage, variable);
        let mut annotations = self.check_annotations(&variable.annotations);
        self.add_choices(&variable.ty, &written, &mut annotations);
        let ty = match &initializer {
            // An open size that the initial value determines makes a table, not a buffer.
            Some(value) if is_open(&written) => value.ty.clone(),
            _ => written,
        };
        self.check_storage_fits(&ty, storage, variable);
        let textured = variable.qualifiers.find(Qualifier::Texture);
        let fits = textured.is_none_or(|_| self.check_textured(&ty, storage, variable));
        let fits = fits && (storage != Storage::Attribute || self.check_attribute(&ty, variable));
        if ty == Type::Error || !fits {
            self.declare(&variable.name, Entity::Error);
            return;
        }
        let member = Member {
            name: variable.name.name.clone(),
            ty,
            storage,
            initializer: initializer.filter(|value| value.ty != Type::Error),
            annotations,
            textured: textured.is_some(),
            tested: false,
            computed: None,
            span: variable.span,
        };
        if let Some(initializer) = &member.initializer {
            self.check_default(&member.name, initializer, &member.annotations);
        }
        if self.replaces_initial_value(&member, generation) {
            return;
        }
        self.add_member(member, variable, generation);
    }

    fn add_member(&mut self, mut member: Member, variable: &ast::Variable, generation: usize) {
        member.computed = match member.textured {
            true => self.computing_function(&member.name, &member.ty, generation),
            false => None,
        };
        let is_computed = member.computed.is_some();
        if member.textured && !is_computed && self.report_unfit_function(variable, &member.ty) {
            return;
        }
        let Some(class) = &mut self.class else { return };
        let id = MemberId(class.members.len() as u32);
        class.members.push(member);
        class.member_generations.push(generation);
        if is_computed {
            class.names.remove(&variable.name.name);
        }
        self.declare(&variable.name, Entity::Member(id));
    }

    /// Gives an inherited parameter the initial value and the annotations of another declaration of it in a class below.
    /// Returns false if the member is no such declaration.
    fn replaces_initial_value(&mut self, member: &Member, generation: usize) -> bool {
        let Some(class) = &mut self.class else { return false };
        let Some(Entity::Member(id)) = class.names.get(&member.name).map(|it| &it.entity) else {
            return false;
        };
        let index = id.0 as usize;
        let inherited = &mut class.members[index];
        let is_same = inherited.ty == member.ty
            && inherited.textured == member.textured
            && (inherited.storage, member.storage) == (Storage::Public, Storage::Public);
        let is_below = class.member_generations[index] > generation;
        if !is_same || !is_below || inherited.computed.is_some() || member.initializer.is_none() {
            return false;
        }
        inherited.initializer = member.initializer.clone();
        let is_kept = |old: &Annotation| member.annotations.iter().all(|new| new.key != old.key);
        inherited.annotations.retain(is_kept);
        inherited.annotations.extend(member.annotations.iter().cloned());
        class.member_generations[index] = generation;
        true
    }

    /// Returns the function that computes an inherited parameter: that of its name, without parameters and with its type,
    /// in a class below the one that declares it.
    fn computing_function(&self, name: &str, ty: &Type, generation: usize) -> Option<FunctionId> {
        let named = self.class.as_ref()?.names.get(name)?;
        let Entity::Functions(functions) = &named.entity else { return None };
        let [id] = functions[..] else { return None };
        let function = self.function(id);
        let is_below = self.function_info[id.0 as usize].generation < generation;
        (is_below && function.parameters.is_empty() && function.result == *ty).then_some(id)
    }

    /// Reports a function with the name of a parameter that it cannot compute. Returns false if there is none.
    fn report_unfit_function(&mut self, variable: &ast::Variable, ty: &Type) -> bool {
        let named = self.class.as_ref().and_then(|class| class.names.get(&variable.name.name));
        let Some(named) = named.filter(|named| matches!(named.entity, Entity::Functions(_))) else {
            return false;
        };
        let named = named.clone();
        let help = format!(
            "in a class below, the function `{} {}()` computes the parameter",
            self.show(ty),
            variable.name.name
        );
        self.report_duplicate_with(&variable.name, &named, |diagnostic| diagnostic.help(help));
        // Reads of the parameter give no errors either.
        let poisoned = Named { entity: Entity::Error, span: named.span };
        if let Some(class) = &mut self.class {
            class.names.insert(variable.name.name.clone(), poisoned);
        }
        true
    }

    fn check_storage(&mut self, qualifiers: &ast::Qualifiers) -> Storage {
        let mut storage: Option<(Storage, Qualifier)> = None;
        for &(qualifier, span) in &qualifiers.list {
            let named = match qualifier {
                Qualifier::Public | Qualifier::Uniform => Storage::Public,
                Qualifier::Private => Storage::Private,
                Qualifier::Scratch => Storage::Scratch,
                Qualifier::Output => Storage::Output,
                Qualifier::Attribute => Storage::Attribute,
                Qualifier::Texture
                | Qualifier::Precise
                | Qualifier::Invariant
                | Qualifier::Const => continue,
                Qualifier::In | Qualifier::Out | Qualifier::InOut => {
                    self.report_bad_qualifier(qualifier_name(qualifier), span, "a member");
                    continue;
                }
            };
            if let Some((other, first)) = storage
                && other != named
            {
                self.report_bad_qualifier(
                    qualifier_name(qualifier),
                    span,
                    &format!("a member that is {}", qualifier_name(first)),
                );
                continue;
            }
            storage = Some((named, qualifier));
        }
        storage.map_or(Storage::Private, |(storage, _)| storage)
    }

    fn check_member_initializer(
        &mut self,
        ty: &Type,
        storage: Storage,
        variable: &ast::Variable,
    ) -> Option<Expression> {
        let initializer = variable.initializer.as_ref()?;
        if storage.is_of_ray() {
            let kind = if storage == Storage::Output { "output" } else { "scratch" };
            let message = format!("{kind} members have no initial value");
            self.report(
                Diagnostic::new(codes::BAD_INITIALIZER, message)
                    .at(variable.span, "belongs to a ray, and is zero at first")
                    .help(
                        "assign it in the method that runs first, or make it `private` or `const`",
                    ),
            );
            return None;
        }
        if holds_reference(ty) {
            self.report(
                Diagnostic::new(codes::BAD_INITIALIZER, "references have no initial value")
                    .at(variable.span, "the host sets it")
                    .help("test it with `isSet()` where it may stay unset"),
            );
            return None;
        }
        let value =
            self.check_outside(Kind::Initializer, |it| it.check_initializer(ty, initializer));
        if storage == Storage::Attribute { self.attribute_default(value) } else { Some(value) }
    }

    fn check_storage_fits(&mut self, ty: &Type, storage: Storage, variable: &ast::Variable) {
        let (code, what) = match ty {
            Type::Reference(_) => (codes::PRIVATE_REFERENCE, "a reference"),
            ty if holds_reference(ty) => (codes::PRIVATE_REFERENCE, "an array of references"),
            Type::Buffer(_) => (codes::MISPLACED_BUFFER, "a buffer"),
            _ => return,
        };
        if storage != Storage::Public {
            self.report_not_public(code, what, variable);
        }
    }

    /// Checks a member that may be a texture. False if it cannot be one.
    fn check_textured(&mut self, ty: &Type, storage: Storage, variable: &ast::Variable) -> bool {
        if *ty == Type::Error {
            return false;
        }
        if !matches!(ty, Type::Scalar(Scalar::F32) | Type::Vector(Scalar::F32, 3) | Type::Color) {
            let shown = self.show(ty);
            let mut diagnostic = Diagnostic::new(
                codes::TEXTURED_TYPE,
                format!("a parameter that may be a texture cannot be of type `{shown}`"),
            )
            .at(variable.ty.span, "no texture gives this")
            .note("textures give a `float`, a `color`, or its red, green and blue as a `vec3`");
            if let (Type::Reference(_), Some(span)) =
                (ty, variable.qualifiers.find(Qualifier::Texture))
            {
                diagnostic = diagnostic.suggest("a reference needs no qualifier", span, "");
            }
            self.report(diagnostic);
            return false;
        }
        if storage != Storage::Public {
            let what = "a parameter that may be a texture";
            self.report_not_public(codes::PRIVATE_REFERENCE, what, variable);
            return false;
        }
        true
    }

    fn report_not_public(&mut self, code: Code, what: &str, variable: &ast::Variable) {
        let mut diagnostic = Diagnostic::new(
            code,
            format!("{what} must be `public`, since only the host can set it"),
        )
        .at(variable.span, "not `public`");
        let storages =
            [Qualifier::Private, Qualifier::Scratch, Qualifier::Output, Qualifier::Attribute];
        diagnostic = match storages.iter().find_map(|each| variable.qualifiers.find(*each)) {
            Some(span) => diagnostic.suggest("make it public", span, "public"),
            None => {
                let first = variable.qualifiers.list.first().map_or(variable.ty.span, |it| it.1);
                let before = first.before();
                diagnostic.suggest("make it public", before, "public ")
            }
        };
        self.report(diagnostic);
    }

    /// Checks the annotations of a member or parameter and folds their values.
    pub(super) fn check_annotations(&mut self, written: &[ast::Annotation]) -> Vec<Annotation> {
        let mut annotations: Vec<Annotation> = Vec::new();
        let mut keys: BTreeSet<&str> = BTreeSet::new();
        for annotation in written {
            let key = &annotation.key;
            if !keys.insert(&key.name) {
                self.report(
                    Diagnostic::new(
                        codes::DECLARED_TWICE,
                        format!("`{}` is given twice", key.name),
                    )
                    .at(key.span, "given again here"),
                );
                continue;
            }
            let Some(value) = self.check_annotation_value(annotation) else { continue };
            // An enumeration gives a parameter its choices, not the text.
            if key.name == CHOICES {
                continue;
            }
            annotations.push(Annotation { key: key.name.clone(), value });
        }
        annotations
    }

    fn check_annotation_value(&mut self, annotation: &ast::Annotation) -> Option<AnnotationValue> {
        let (value, found) = match &annotation.value {
            ast::AnnotationValue::None => (AnnotationValue::None, AnnotationKind::Flag),
            ast::AnnotationValue::Text(text, _) => {
                (AnnotationValue::Text(text.clone()), AnnotationKind::Text)
            }
            ast::AnnotationValue::Expression(expression) => {
                let value = self.check_annotation_number(expression)?;
                (AnnotationValue::Constant(value), AnnotationKind::Number)
            }
        };
        let key = &annotation.key;
        match ANNOTATION_KEYS.iter().find(|known| known.name == key.name) {
            None => self.report_unknown_annotation(key),
            Some(known) if known.kind != found => {
                self.report(
                    Diagnostic::new(
                        codes::ANNOTATION_VALUE,
                        format!("`{}` takes {}", key.name, expected(known.kind)),
                    )
                    .at(key.span, format!("found {}", expected(found))),
                );
                return None;
            }
            Some(_) => {}
        }
        Some(value)
    }

    fn check_annotation_number(&mut self, expression: &ast::Expression) -> Option<Constant> {
        let checked =
            self.check_outside(Kind::Constant, |checker| checker.check_expression(expression));
        if !matches!(checked.ty, Type::Scalar(_) | Type::Error) {
            self.report_mismatch("an annotation", "a number", &checked);
            return None;
        }
        self.evaluate_constant(&checked, "an annotation").map(|values| values[0])
    }

    fn report_unknown_annotation(&mut self, key: &ast::Identifier) {
        let known = ANNOTATION_KEYS.map(|key| key.name);
        let diagnostic = Diagnostic::new(
            codes::UNKNOWN_ANNOTATION,
            format!("hosts do not know the annotation `{}`", key.name),
        )
        .at(key.span, "has no effect")
        .note(format!("they know {}", quoted_list(&known)));
        let similar = self.similar_of(&key.name, known);
        self.report(super::suggestions::suggest(diagnostic, key.span, similar));
    }
}
