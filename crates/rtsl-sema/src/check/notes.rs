//! Notes for editors: what names mean, which functions calls could mean, and what could stand at the cursor.

use rtsl_source::Span;
use rtsl_spec::builtins;
use rtsl_spec::{RayType, Role, lookup_state};
use rtsl_syntax::ast;

use super::Checker;
use super::scope::{Entity, Named};
use super::types::builtin_type;
use crate::hir::{FunctionId, StructId, Type};
use crate::index::{
    CURSOR, Callee, Completion, CompletionPlace, Signature, Symbol, Use, VisibleName,
};

impl Checker<'_> {
    /// Notes the use of a name.
    pub(super) fn note_symbol(&mut self, span: Span, symbol: Symbol, ty: Option<String>) {
        if let Some(index) = &mut self.index {
            index.uses.push(Use { span, symbol, ty });
        }
    }

    /// Notes the use of a value's name, or of the name of what is no value.
    pub(super) fn note_name(&mut self, name: &str, span: Span, ty: Option<&Type>) {
        if self.index.is_none() {
            return;
        }
        let shown = ty.filter(|ty| **ty != Type::Error).map(|ty| self.show(ty));
        if let Some(named) = self.find(name) {
            let declared = Symbol::Declared(named.span);
            let last = name.rsplit('.').next().unwrap_or(name).len() as u32;
            let part = Span { start: span.end.saturating_sub(last).max(span.start), ..span };
            self.note_symbol(part, declared, shown);
            self.note_module(name, span);
        } else if let Some(variable) = lookup_state(name) {
            self.note_symbol(span, Symbol::State(variable), shown);
        } else if let Some(ray_type) = RayType::from_name(name) {
            self.note_symbol(span, Symbol::RayType(ray_type), shown);
        }
    }

    /// Notes the module before the dot of a qualified name.
    pub(super) fn note_module(&mut self, name: &str, span: Span) {
        let Some((module, _)) = name.split_once('.') else { return };
        if let Some(declared) = self.find(module).map(|named| named.span) {
            let end = span.start + module.len() as u32;
            self.note_symbol(Span { end, ..span }, Symbol::Declared(declared), None);
        }
    }

    /// Notes the use of a type's name.
    pub(super) fn note_type(&mut self, name: &ast::Identifier) {
        if self.index.is_none() {
            return;
        }
        if name.name == CURSOR {
            return self.note_completion(CompletionPlace::Type);
        }
        if let Some(place) = self.cursor_in_module(&name.name) {
            return self.note_completion(place);
        }
        if self.find(&name.name).is_some() {
            self.note_name(&name.name, name.span, None);
        } else if let Some(role) = Role::from_class(&name.name) {
            self.note_symbol(name.span, Symbol::Role(role), None);
        } else if builtin_type(&name.name).is_some() {
            self.note_symbol(name.span, Symbol::Type(name.name.clone()), None);
        }
    }

    /// Notes the use of the name of a role or of a class to inherit from.
    pub(super) fn note_base(&mut self, base: &ast::Identifier, class: Option<Span>) {
        if self.index.is_none() {
            return;
        }
        if base.name == CURSOR {
            self.note_completion(CompletionPlace::Base);
        } else if let Some(role) = Role::from_class(&base.name) {
            self.note_symbol(base.span, Symbol::Role(role), None);
        } else if let Some(span) = class {
            let last = base.name.rsplit('.').next().unwrap_or_default().len() as u32;
            let part = Span { start: base.span.end.saturating_sub(last), ..base.span };
            self.note_symbol(part, Symbol::Declared(span), None);
            self.note_module(&base.name, base.span);
        }
    }

    /// Notes the fields of a struct.
    pub(super) fn note_fields(&mut self, id: StructId, declaration: &ast::Struct) {
        let Some(index) = &mut self.index else { return };
        for (field, declared) in declaration.fields.iter().enumerate() {
            index.fields.insert((id, field as u32), declared.name.span);
        }
    }

    /// Notes the use of a field.
    pub(super) fn note_field(&mut self, id: StructId, field: usize, span: Span, ty: &Type) {
        let Some(index) = &self.index else { return };
        if let Some(declared) = index.fields.get(&(id, field as u32)).copied() {
            let shown = self.show(ty);
            self.note_symbol(span, Symbol::Declared(declared), Some(shown));
        }
    }

    /// Notes that a name stands for a function.
    pub(super) fn note_function(&mut self, id: FunctionId, span: Span) {
        if self.index.is_some() {
            let declared = self.function(id).span;
            let shown = self.show_function(id).trim_matches('`').to_owned();
            self.note_symbol(span, Symbol::Declared(declared), Some(shown));
        }
    }

    /// Notes a name at the cursor, if it is one, with what could stand there.
    pub(super) fn note_cursor(&mut self, name: &str) {
        if self.index.is_none() {
            return;
        }
        if name == CURSOR {
            self.note_completion(CompletionPlace::Value);
        } else if let Some(place) = self.cursor_in_module(name) {
            self.note_completion(place);
        }
    }

    fn cursor_in_module(&self, name: &str) -> Option<CompletionPlace> {
        let module = name.strip_suffix(CURSOR)?.strip_suffix('.')?;
        Some(CompletionPlace::Module(module.to_owned()))
    }

    /// Notes the cursor after the dot behind a value.
    pub(super) fn note_part(&mut self, ty: &Type, name: &str) {
        if self.index.is_none() || name != CURSOR || *ty == Type::Error {
            return;
        }
        let fields = match ty {
            Type::Struct(id) => {
                let fields = self.module.structs[id.0 as usize].fields.iter();
                fields.map(|(name, ty)| (name.clone(), self.show(ty))).collect()
            }
            _ => Vec::new(),
        };
        let shown = self.show(ty);
        self.note_completion(CompletionPlace::Part { ty: ty.clone(), shown, fields });
    }

    /// Notes the cursor after `super.`.
    pub(super) fn note_inherited(&mut self, name: &str) {
        if self.index.is_none() || name != CURSOR {
            return;
        }
        let functions = self.class.as_ref().map(|class| class.functions.clone());
        let generation = self.function.generation;
        let above = functions
            .unwrap_or_default()
            .into_iter()
            .filter(|id| self.function_info[id.0 as usize].generation > generation);
        let mut signatures: Vec<Signature> =
            above.map(|id| Signature::of(&self.module, Callee::Function(id))).collect();
        signatures.dedup();
        self.note_completion(CompletionPlace::Inherited(signatures));
    }

    fn note_completion(&mut self, place: CompletionPlace) {
        let names = self.visible_names();
        let roles = self.class.as_ref().map(|class| class.roles.clone()).unwrap_or_default();
        if let Some(index) = &mut self.index {
            // An inherited body is checked again; the first check is that of its own class.
            index.completion.get_or_insert(Completion { place, names, roles });
        }
    }

    fn visible_names(&self) -> Vec<VisibleName> {
        let class = self.class.iter().map(|class| &class.names);
        let levels = self.scopes.levels().rev().chain(class).chain([&self.file]);
        let mut names: Vec<VisibleName> = Vec::new();
        let mut seen = std::collections::BTreeSet::new();
        for (name, named) in levels.flatten() {
            if seen.insert(name) {
                names.push(self.visible_name(name, named));
            }
        }
        names
    }

    fn visible_name(&self, name: &str, named: &Named) -> VisibleName {
        let ty = match &named.entity {
            Entity::Local(id) => {
                self.function.locals.get(id.0 as usize).map(|local| self.show(&local.ty))
            }
            Entity::Member(id) => {
                let member = self.class.as_ref().and_then(|it| it.members.get(id.0 as usize));
                member.map(|member| self.show(&member.ty))
            }
            Entity::Constant(ty, _) => Some(self.show(ty)),
            Entity::Functions(ids) => {
                let first = ids.first().map(|id| self.show_function(*id));
                first.map(|shown| shown.trim_matches('`').to_owned())
            }
            Entity::Struct(_)
            | Entity::Enumeration(_)
            | Entity::Class(_)
            | Entity::Module
            | Entity::Error => None,
        };
        VisibleName { name: name.to_owned(), kind: named.entity.kind(), ty, span: named.span }
    }

    /// Notes the call of a built-in function.
    pub(super) fn note_builtin(&mut self, name: &'static str, span: Span) {
        if self.index.is_none() {
            return;
        }
        let names = self.prelude.map(|prelude| &prelude.names);
        let declared = match names.and_then(|names| names.get(name)).map(|it| &it.entity) {
            Some(Entity::Functions(ids)) => ids.first().map(|id| self.function(*id).span),
            _ => None,
        };
        let overloads = builtins::overloads(name);
        let shown = overloads.first().map(ToString::to_string);
        self.note_symbol(span, Symbol::Builtin(name, declared), shown);
    }
}
