//! Warns about classes and members without effect: classes without the method that their role is for, parameters that
//! nothing reads, outputs that nobody keeps, functions that nobody calls, defaults outside of their range.

use std::collections::BTreeSet;
use std::sync::Arc;

use rtsl_ir::class::{Annotation, AnnotationValue};
use rtsl_ir::{Constant, Scalar};
use rtsl_source::{Diagnostic, Span, diagnostic_codes as codes, with_article};
use rtsl_spec::{ELEMENT, Method, Role, UNUSED};

use super::Checker;
use super::references::quoted_list;
use super::types::component_scalar;
use crate::hir::{
    Class, Constructor, ConstructorParameter, Expression, ExpressionKind, Local, Member, Storage,
    Type,
};
use crate::walk::{Node, walk_statements};

/// The methods of a role of which a class needs one, and what it is without them.
const fn needed(role: Role) -> (&'static [Method], &'static str) {
    match role {
        Role::Camera => (&[Method::GenerateRay], "it has no rays"),
        Role::Primitive => (&[Method::Intersect], "no ray meets it"),
        Role::Texture => (&[Method::Lookup], "its value is 0"),
        Role::Light => (&[Method::Illumination, Method::Emission], "it gives no light"),
        Role::Material => (&[Method::Bsdf, Method::Emission, Method::Shade], "it is black"),
        Role::Integrator => (&[Method::Radiance], "its pictures are black"),
    }
}

impl Checker<'_> {
    /// Warns about the classes of the text. Text with errors is left alone.
    pub(super) fn check_idle(&mut self) {
        if self.errors > 0 {
            return;
        }
        for index in 0..self.module.classes.len() {
            let is_base = self.classes.iter().any(|class| class.parent == Some(index));
            let class = self.module.classes[index].clone();
            if class.is_imported || self.classes[index].roles_unknown {
                continue;
            }
            self.check_outputs(&class);
            // Classes below may have what a base lacks, and read what it does not.
            if !is_base {
                class.roles.iter().for_each(|role| self.check_needed(&class, *role));
                self.report_unread(index);
                self.report_unread_of_constructor(&class);
                self.report_uncalled(index);
            }
        }
    }

    fn check_needed(&mut self, class: &Class, role: Role) {
        let (methods, consequence) = needed(role);
        let has = |method: &Method| class.methods.iter().any(|(it, _)| it == method);
        if methods.iter().any(has) {
            return;
        }
        let names: Vec<&str> = methods.iter().map(|method| method.name()).collect();
        let is_sampled = role == Role::Material && has(&Method::SampleBsdf);
        let message = format!(
            "`{}` is {} without {}",
            class.name,
            with_article(role.name()),
            if is_sampled { "`BSDF`".to_owned() } else { choice(&names) }
        );
        let diagnostic = Diagnostic::new(codes::IDLE_CLASS, message).at(class.span, consequence);
        self.report(match is_sampled {
            true => diagnostic
                .note("`sampleBSDF` and `evaluatePDF` choose directions for a `BSDF`")
                .help("write `void BSDF()`; it may leave `rt_BSDFValue` black if all light is scattered by deltas"),
            false => diagnostic.help(format!("write `void {}()`", names[0])),
        });
    }

    fn check_outputs(&mut self, class: &Class) {
        if class.roles.contains(&Role::Integrator) {
            return;
        }
        for member in class.members.iter().filter(|it| it.storage == Storage::Output) {
            let diagnostic = Diagnostic::new(
                codes::OUTPUT_ELSEWHERE,
                format!("the output `{}` is never kept", member.name),
            )
            .at(member.span, "images are made of the outputs of integrators")
            .help("make it `scratch`, or a variable of the method");
            self.report(diagnostic);
        }
    }

    fn report_unread(&mut self, index: usize) {
        for id in std::mem::take(&mut self.classes[index].unread) {
            let class = &self.module.classes[index];
            let member = &class.members[id.0 as usize];
            if may_be_attribute(class, &member.ty) || is_unused_on_purpose(&member.annotations) {
                continue;
            }
            let Member { name, span, storage, .. } = member;
            let what = if *storage == Storage::Public { "parameter" } else { "member" };
            self.report(unread(what, name, *span));
        }
    }

    /// Warns about parameters of the constructor that its body does not name.
    fn report_unread_of_constructor(&mut self, class: &Class) {
        let Some(Constructor { function: id, parameters }) = &class.constructor else { return };
        let function = Arc::clone(self.function(*id));
        // An inherited constructor may be read by one above.
        if self.function_info[id.0 as usize].generation > 0 {
            return;
        }
        let mut read = BTreeSet::new();
        walk_statements(&function.body, |node| {
            if let Node::Expression(Expression { kind: ExpressionKind::Local(id), .. }) = node {
                read.insert(id.0 as usize);
            }
        });
        for (index, ConstructorParameter { annotations, span, .. }) in parameters.iter().enumerate()
        {
            let Local { name, ty, .. } = &function.locals[index];
            let is_read = read.contains(&index) || annotations.iter().any(|it| it.key == ELEMENT);
            if !is_read && !may_be_attribute(class, ty) && !is_unused_on_purpose(annotations) {
                self.report(unread("parameter", name, *span));
            }
        }
    }

    fn report_uncalled(&mut self, index: usize) {
        for id in std::mem::take(&mut self.classes[index].uncalled) {
            let name = self.function(id).name.clone();
            let span = self.function(id).span;
            let roles = &self.module.classes[index].roles;
            let methods: Vec<&str> =
                roles.iter().flat_map(|role| role.methods()).map(Method::name).collect();
            let diagnostic = Diagnostic::new(
                codes::UNCALLED_FUNCTION,
                format!("`{name}` is not an interface method, and is never called"),
            )
            .at(span, "what it sets is lost")
            .note(format!("hosts call {}", quoted_list(&methods)))
            .help("call it in a method, or remove it");
            self.report(diagnostic);
        }
    }

    /// Warns about a default outside of the range of the annotations `min` and `max` of the parameter `name`.
    pub(super) fn check_default(
        &mut self,
        name: &str,
        initializer: &Expression,
        annotations: &[Annotation],
    ) {
        if self.modules.home().is_some() || self.errors > 0 {
            return;
        }
        let bound = |key: &str| {
            let annotation = annotations.iter().find(|it| it.key == key)?;
            match &annotation.value {
                AnnotationValue::Constant(value) => Some(number(*value)),
                AnnotationValue::None | AnnotationValue::Text(_) => None,
            }
        };
        let (least, greatest) = (bound("min"), bound("max"));
        if least.is_none() && greatest.is_none() {
            return;
        }
        let Ok(values) = self.evaluate(initializer, false) else { return };
        let is_outside = |value: f64| {
            least.is_some_and(|least| value < least)
                || greatest.is_some_and(|greatest| value > greatest)
        };
        if let Some(value) = values.iter().map(|it| number(*it)).find(|it| is_outside(*it)) {
            let range = match (least, greatest) {
                (Some(least), Some(greatest)) => format!("{least} to {greatest}"),
                (Some(least), None) => format!("from {least}"),
                (None, Some(greatest)) => format!("up to {greatest}"),
                (None, None) => return,
            };
            let diagnostic = Diagnostic::new(
                codes::DEFAULT_OUT_OF_RANGE,
                format!("the default of `{name}` is outside of its range"),
            )
            .at(initializer.span, format!("{value}, where the range is {range}"))
            .help("scenes that set this value are refused; change the default or the range");
            self.report(diagnostic);
        }
    }
}

/// The warning about a parameter or member that nothing reads.
fn unread(what: &str, name: &str, span: Span) -> Diagnostic {
    Diagnostic::new(codes::UNREAD_MEMBER, format!("nothing reads the {what} `{name}`"))
        .at(span, "without effect")
        .help("read it in a method, or remove it")
}

/// The names with the last one as another choice: "`a`, `b` or `c`".
fn choice(names: &[&str]) -> String {
    let quoted: Vec<String> = names.iter().map(|name| format!("`{name}`")).collect();
    match quoted.split_last() {
        Some((last, rest)) if !rest.is_empty() => format!("{} or {last}", rest.join(", ")),
        Some((last, _)) => last.clone(),
        None => String::new(),
    }
}

/// True if the annotations of a parameter say that nothing reads it: it is there for the sake of an interface.
fn is_unused_on_purpose(annotations: &[Annotation]) -> bool {
    annotations.iter().any(|annotation| annotation.key == UNUSED)
}

/// True if materials may read a parameter of a shape with this type as an attribute.
fn may_be_attribute(class: &Class, ty: &Type) -> bool {
    class.roles.contains(&Role::Primitive) && component_scalar(ty) == Some(Scalar::F32)
}

/// The number by its shortest text: 0.1 means 0.1.
fn number(value: Constant) -> f64 {
    match value {
        Constant::F32(value) => value.to_string().parse().unwrap_or(f64::from(value)),
        Constant::I32(value) => f64::from(value),
        Constant::U32(value) => f64::from(value),
        Constant::Bool(value) => f64::from(u8::from(value)),
    }
}
