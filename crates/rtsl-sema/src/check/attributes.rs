//! Attributes: values that the objects of a scene have, and that shaders ask for by name.
//!
//! Methods of materials and textures read the attribute of the object that the ray hit. A primitive gives its own
//! attributes in `computeTextureCoordinates`, where they start with their default values.

use rtsl_ir::Scalar;
use rtsl_source::{Diagnostic, diagnostic_codes as codes, with_article};
use rtsl_spec::{Method, Role};
use rtsl_syntax::ast::{self, Qualifier};

use super::Checker;
use super::reached::{Reached, Root};
use super::roles::role_list;
use crate::hir::{Expression, ExpressionKind, MemberId, Type};

impl Checker<'_> {
    /// Checks the type of an attribute and the roles of its class. False if it cannot be an attribute.
    pub(super) fn check_attribute(&mut self, ty: &Type, variable: &ast::Variable) -> bool {
        if *ty == Type::Error {
            return false;
        }
        let Some(class) = &self.class else { return false };
        let hosts = [Role::Primitive, Role::Texture, Role::Material];
        if !class.roles_unknown && !hosts.iter().any(|role| class.roles.contains(role)) {
            let roles = with_article(&role_list(&class.roles, "and"));
            let span = variable.qualifiers.find(Qualifier::Attribute).unwrap_or(variable.span);
            let diagnostic = Diagnostic::new(
                codes::ATTRIBUTE_OUT_OF_PLACE,
                format!("{roles} has no attributes"),
            )
            .at(span, "needs an object that a ray hit")
            .note("primitives give attributes, and materials and textures read them");
            self.report(diagnostic);
            return false;
        }
        if matches!(ty, Type::Scalar(Scalar::F32) | Type::Vector(Scalar::F32, _) | Type::Color) {
            return true;
        }
        let shown = self.show(ty);
        let diagnostic = Diagnostic::new(
            codes::ATTRIBUTE_TYPE,
            format!("an attribute cannot be of type `{shown}`"),
        )
        .at(variable.ty.span, "not interpolated between vertices")
        .help("attributes are `float`, `vec2`, `vec3`, `vec4` or `color`");
        self.report(diagnostic);
        false
    }

    /// Evaluates the default value of an attribute.
    pub(super) fn attribute_default(&mut self, value: Expression) -> Option<Expression> {
        let values = self.evaluate_constant(&value, "the default value of an attribute")?;
        let (kind, ty) = (ExpressionKind::Constant(values), value.ty.clone());
        Some(Expression { kind, ty, span: value.span })
    }

    pub(super) fn check_attribute_read(&mut self, root: &Root, reached: &Reached, id: MemberId) {
        let reads = root.roles.iter().any(|role| matches!(role, Role::Material | Role::Texture));
        if reads || gives_attributes(root) {
            return;
        }
        let place = root.method.map_or("the constructor", Method::name);
        self.report_attribute(root, reached, id, &format!("has no value in {}", quoted(place)));
    }

    pub(super) fn check_attribute_write(&mut self, root: &Root, reached: &Reached, id: MemberId) {
        if !gives_attributes(root) {
            let place = root.method.map_or("the constructor", Method::name);
            let problem = format!("cannot be written in {}", quoted(place));
            self.report_attribute(root, reached, id, &problem);
        }
    }

    fn report_attribute(&mut self, root: &Root, reached: &Reached, id: MemberId, problem: &str) {
        let member = &self.module.classes[root.class.0 as usize].members[id.0 as usize];
        let diagnostic = Diagnostic::new(
            codes::ATTRIBUTE_OUT_OF_PLACE,
            format!("the attribute `{}` {problem}", member.name),
        )
        .at(reached.done.span, "an attribute of the object that the ray hit")
        .note(
            "methods of materials and textures read attributes, and `computeTextureCoordinates` of a primitive gives them",
        );
        self.report_with_path(root, reached, diagnostic);
    }
}

/// True for the method in which a primitive gives attributes.
fn gives_attributes(root: &Root) -> bool {
    root.method == Some(Method::ComputeTextureCoordinates)
}

fn quoted(place: &str) -> String {
    if place.contains(' ') { place.to_owned() } else { format!("`{place}`") }
}
