//! Place expressions: names, and parts of values (elements, fields, swizzles). The caller calls
//! `note_access` to note whether a place is read or written.

use std::sync::Arc;

use rtsl_ir::{Constant, Scalar};
use rtsl_source::{Diagnostic, Span, diagnostic_codes as codes};
use rtsl_spec::{RayType, builtins, lookup_state};
use rtsl_syntax::ast::{self, ExpressionKind as Ast};

use super::Checker;
use super::expressions::error_expression;
use super::foreign::{advise, counterpart};
use super::references::quoted_list;
use super::scope::Entity;
use super::suggestions::suggest;
use super::types::{FLOAT, builtin_type, leaf_count};
use crate::hir::{Expression, ExpressionKind, LocalId, MemberId, StructId, Type};

/// The size up to which a part of a constant is folded. Larger parts refer to the whole constant,
/// which is shared, so that frequent uses do not copy it.
const FOLDED_LEAVES: usize = 16;

/// GLSL's three sets of component names.
const COMPONENT_SETS: [&str; 3] = ["xyzw", "rgba", "stpq"];

impl Checker<'_> {
    /// Checks a name, element, field or swizzle as a place that may be read or written.
    pub(super) fn check_place(&mut self, expression: &ast::Expression) -> Expression {
        match &expression.kind {
            Ast::Name(name) => self.check_name(name, expression.span),
            Ast::Index(base, Some(index)) => self.check_index(base, index, expression.span),
            Ast::Index(_, None) => self.check_missing_index(expression.span),
            Ast::Member(base, name) => match self.name_in_module(base, name) {
                Some(name) => self.check_name(&name, expression.span),
                None => self.check_member(base, name, expression.span),
            },
            _ => self.check_expression(expression),
        }
    }

    fn check_missing_index(&mut self, span: Span) -> Expression {
        self.report(
            Diagnostic::new(codes::NOT_INDEXABLE, "the index is missing")
                .at(span, "expected an index between the brackets"),
        );
        error_expression(span)
    }

    fn check_name(&mut self, name: &str, span: Span) -> Expression {
        self.note_cursor(name);
        let value = self.value_of_name(name, span);
        self.note_name(name, span, Some(&value.ty));
        value
    }

    fn value_of_name(&mut self, name: &str, span: Span) -> Expression {
        match self.find(name).map(|named| named.entity.clone()) {
            Some(Entity::Local(id)) => self.local_expression(id, span),
            Some(Entity::Member(id)) => self.check_member_name(id, span),
            Some(Entity::Constant(ty, values)) => {
                Expression { kind: ExpressionKind::Constant(values), ty, span }
            }
            Some(Entity::Error) => error_expression(span),
            Some(
                entity @ (Entity::Struct(_)
                | Entity::Enumeration(_)
                | Entity::Functions(_)
                | Entity::Class(_)
                | Entity::Module),
            ) => self.report_no_value(name, entity.kind(), span),
            None => self.check_undeclared_name(name, span),
        }
    }

    fn local_expression(&mut self, id: LocalId, span: Span) -> Expression {
        self.function.local_info[id.0 as usize].used = true;
        let ty = self.function.locals[id.0 as usize].ty.clone();
        Expression { kind: ExpressionKind::Local(id), ty, span }
    }

    fn check_undeclared_name(&mut self, name: &str, span: Span) -> Expression {
        if let Some(variable) = lookup_state(name) {
            return self.check_state(variable, span);
        }
        if let Some(ray_type) = RayType::from_name(name) {
            let values = Arc::new([Constant::F32(ray_type.value())]);
            return Expression { kind: ExpressionKind::Constant(values), ty: FLOAT, span };
        }
        if builtin_type(name).is_some() {
            return self.report_no_value(name, "a type", span);
        }
        if builtins::find(name).is_some_and(|builtin| self.is_callable(builtin)) {
            return self.report_no_value(name, "a function", span);
        }
        let diagnostic = Diagnostic::new(codes::UNKNOWN_NAME, format!("there is no `{name}` here"))
            .at(span, "unknown name");
        let diagnostic = match counterpart(name) {
            Some(counterpart) => advise(diagnostic, span, counterpart),
            None => match (self.similar_name(name), &*self.related_states(name)) {
                (None, [only]) => suggest(diagnostic, span, Some((*only).to_owned())),
                (None, related @ [_, ..]) => {
                    diagnostic.help(format!("there are {}", quoted_list(related)))
                }
                (similar, _) => suggest(diagnostic, span, similar),
            },
        };
        self.report(diagnostic);
        error_expression(span)
    }

    fn report_no_value(&mut self, name: &str, kind: &str, span: Span) -> Expression {
        self.report(
            Diagnostic::new(codes::NOT_A_VALUE, format!("`{name}` is {kind}, not a value"))
                .at(span, "expected a value"),
        );
        error_expression(span)
    }

    fn check_member_name(&mut self, id: MemberId, span: Span) -> Expression {
        if self.function.kind == super::functions::Kind::Initializer {
            self.report(
                Diagnostic::new(
                    codes::INITIALIZER_READS,
                    "initial values and defaults cannot read other members",
                )
                .at(span, "a member")
                .help("compute it in the constructor, or make the other member `const`"),
            );
            return error_expression(span);
        }
        let Some(class) = &mut self.class else { return error_expression(span) };
        class.named.insert(id);
        let member = &class.members[id.0 as usize];
        let kind = match (member.textured, member.computed) {
            (_, Some(function)) => ExpressionKind::Computed(id, function),
            (true, None) => ExpressionKind::Textured(id),
            (false, None) => ExpressionKind::Member(id),
        };
        Expression { kind, ty: member.ty.clone(), span }
    }

    fn check_index(
        &mut self,
        base: &ast::Expression,
        index: &ast::Expression,
        span: Span,
    ) -> Expression {
        let base = self.check_place(base);
        let index = self.check_expression(index);
        let (element, count) = match &base.ty {
            Type::Array(element, size) => (Type::clone(element), Some(*size)),
            Type::Buffer(element) => (Type::clone(element), None),
            Type::Vector(scalar, size) => (Type::Scalar(*scalar), Some(u32::from(*size))),
            Type::Matrix(columns, rows) => {
                (Type::Vector(Scalar::F32, *rows), Some(u32::from(*columns)))
            }
            Type::Error => return error_expression(span),
            Type::Color => return self.report_color_components(&base, span),
            Type::Void | Type::Scalar(_) | Type::Struct(_) | Type::Reference(_) => {
                return self.report_not_indexable(&base, span);
            }
        };
        match index.ty {
            Type::Scalar(Scalar::I32 | Scalar::U32) => {}
            Type::Error => return error_expression(span),
            _ => {
                self.report_mismatch("an index", "`int` or `uint`", &index);
                return error_expression(span);
            }
        }
        let constant = self.constant_scalar(&index);
        if let Some(value) = constant
            && !self.check_constant_index(value, count, index.span, &base.ty)
        {
            return Expression { kind: ExpressionKind::Error, ty: element, span };
        }
        self.element(base, index, constant, element, span)
    }

    /// Checks `base[index]`, folded if both are constant.
    fn element(
        &mut self,
        base: Expression,
        index: Expression,
        constant: Option<Constant>,
        element: Type,
        span: Span,
    ) -> Expression {
        let count = leaf_count(&self.struct_info, &element) as usize;
        if let (Some(index), ExpressionKind::Constant(values)) = (constant, &base.kind)
            && count <= FOLDED_LEAVES
        {
            let start = index.bits() as usize * count;
            let values: Arc<[Constant]> = values[start..start + count].into();
            return Expression { kind: ExpressionKind::Constant(values), ty: element, span };
        }
        let kind = match (constant, &base.ty) {
            (Some(index), Type::Vector(..)) => {
                ExpressionKind::Swizzle(Box::new(base), vec![index.bits() as u8])
            }
            _ => ExpressionKind::Index(Box::new(base), Box::new(index)),
        };
        Expression { kind, ty: element, span }
    }

    fn check_constant_index(
        &mut self,
        value: Constant,
        count: Option<u32>,
        span: Span,
        indexed: &Type,
    ) -> bool {
        let (index, in_range) = match value {
            Constant::I32(value) => {
                (i64::from(value), value >= 0 && count.is_none_or(|count| (value as u32) < count))
            }
            other => (i64::from(other.bits()), count.is_none_or(|count| other.bits() < count)),
        };
        if !in_range {
            let shown = self.show_one(indexed);
            let range = match count {
                Some(0) | None => "the first element has index 0".to_owned(),
                Some(count) => format!("{shown} has indices 0 to {}", count - 1),
            };
            self.report(
                Diagnostic::new(
                    codes::INDEX_OUT_OF_RANGE,
                    format!("index {index} is out of range"),
                )
                .at(span, range),
            );
        }
        in_range
    }

    fn report_not_indexable(&mut self, base: &Expression, span: Span) -> Expression {
        let shown = self.show_one(&base.ty);
        self.report(
            Diagnostic::new(codes::NOT_INDEXABLE, format!("{shown} has no elements"))
                .at(base.span, format!("this is {shown}"))
                .note("arrays, buffers, vectors and matrices have elements"),
        );
        error_expression(span)
    }

    fn report_color_components(&mut self, base: &Expression, span: Span) -> Expression {
        self.report(
            Diagnostic::new(
                codes::COLOR_COMPONENTS,
                "a color has no components that shaders can see",
            )
            .at(span, "a part of a `color`")
            .label(base.span, "this is a `color`")
            .note("the renderer determines the number of components of a color")
            .help(
                "`rgb(c)` gives red, green and blue as a `vec3`; `color(v)` makes a color of one",
            ),
        );
        error_expression(span)
    }

    fn check_member(
        &mut self,
        base: &ast::Expression,
        name: &ast::Identifier,
        span: Span,
    ) -> Expression {
        let base = self.check_place(base);
        self.note_part(&base.ty, &name.name);
        match base.ty {
            Type::Error => error_expression(span),
            Type::Struct(id) => self.check_field(base, id, name, span),
            Type::Vector(scalar, size) => self.check_swizzle(base, scalar, size, name, span),
            Type::Scalar(scalar) => self.check_scalar_swizzle(base, scalar, name, span),
            Type::Color => self.report_color_components(&base, span),
            Type::Void
            | Type::Matrix(..)
            | Type::Array(..)
            | Type::Buffer(_)
            | Type::Reference(_) => self.report_no_parts(&base, name, span),
        }
    }

    fn report_no_parts(
        &mut self,
        base: &Expression,
        name: &ast::Identifier,
        span: Span,
    ) -> Expression {
        let shown = self.show_one(&base.ty);
        let mut diagnostic =
            Diagnostic::new(codes::UNKNOWN_FIELD, format!("{shown} has no `{}`", name.name))
                .at(name.span, "unknown");
        if matches!(base.ty, Type::Array(..) | Type::Buffer(_)) && name.name == "length" {
            diagnostic = diagnostic.suggest("call it", name.span, "length()");
        }
        self.report(diagnostic);
        error_expression(span)
    }

    fn check_field(
        &mut self,
        base: Expression,
        id: StructId,
        name: &ast::Identifier,
        span: Span,
    ) -> Expression {
        let declared = Arc::clone(&self.module.structs[id.0 as usize]);
        let places = self.field_places.entry(id).or_insert_with(|| {
            let fields = declared.fields.iter().enumerate();
            fields.map(|(index, (field, _))| (field.clone(), index)).collect()
        });
        let Some(index) = places.get(&name.name).copied() else {
            let diagnostic = Diagnostic::new(
                codes::UNKNOWN_FIELD,
                format!("`{}` has no field `{}`", declared.name, name.name),
            )
            .at(name.span, "unknown field");
            let fields: Vec<&str> = declared.fields.iter().map(|(field, _)| &**field).collect();
            let diagnostic = diagnostic.note(format!("it has {}", quoted_list(&fields)));
            let similar = self.similar_of(&name.name, fields);
            self.report(suggest(diagnostic, name.span, similar));
            return error_expression(span);
        };
        let ty = declared.fields[index].1.clone();
        self.note_field(id, index, name.span, &ty);
        if let ExpressionKind::Constant(values) = &base.kind
            && self.leaf_count(&ty) as usize <= FOLDED_LEAVES
        {
            let before = declared.fields[..index].iter();
            let start: u32 = before.map(|(_, ty)| self.leaf_count(ty)).sum();
            let end = start + self.leaf_count(&ty);
            let values = values[start as usize..end as usize].into();
            return Expression { kind: ExpressionKind::Constant(values), ty, span };
        }
        Expression { kind: ExpressionKind::Field(Box::new(base), index as u32), ty, span }
    }

    fn check_swizzle(
        &mut self,
        base: Expression,
        scalar: Scalar,
        size: u8,
        name: &ast::Identifier,
        span: Span,
    ) -> Expression {
        let Some(components) = self.swizzle_components(name, size, &base.ty) else {
            return error_expression(span);
        };
        let ty = match components.len() {
            1 => Type::Scalar(scalar),
            count => Type::Vector(scalar, count as u8),
        };
        if let ExpressionKind::Constant(values) = &base.kind {
            let values = components.iter().map(|index| values[usize::from(*index)]).collect();
            return Expression { kind: ExpressionKind::Constant(values), ty, span };
        }
        Expression { kind: ExpressionKind::Swizzle(Box::new(base), components), ty, span }
    }

    /// Checks GLSL's `f.x` and `f.xxx` on scalars.
    fn check_scalar_swizzle(
        &mut self,
        base: Expression,
        scalar: Scalar,
        name: &ast::Identifier,
        span: Span,
    ) -> Expression {
        let Some(components) = self.swizzle_components(name, 1, &base.ty) else {
            return error_expression(span);
        };
        match components.len() {
            1 => base,
            count => Expression {
                kind: ExpressionKind::Construct(vec![base]),
                ty: Type::Vector(scalar, count as u8),
                span,
            },
        }
    }

    /// Returns the component indices of a swizzle, and reports errors in it.
    fn swizzle_components(
        &mut self,
        name: &ast::Identifier,
        size: u8,
        ty: &Type,
    ) -> Option<Vec<u8>> {
        let shown = self.show_one(ty);
        let set = COMPONENT_SETS
            .iter()
            .find(|set| name.name.chars().next().is_some_and(|first| set.contains(first)));
        let problem = if name
            .name
            .chars()
            .any(|letter| !COMPONENT_SETS.iter().any(|set| set.contains(letter)))
        {
            Some(format!("{shown} has no `{}`", name.name))
        } else if name.name.len() > 4 {
            Some("a swizzle has at most 4 components".to_owned())
        } else {
            None
        };
        let (Some(set), None) = (set, &problem) else {
            let problem = problem.unwrap_or_else(|| format!("{shown} has no `{}`", name.name));
            return self.report_swizzle(problem, name, "components are `xyzw`, `rgba` or `stpq`");
        };
        let mut components = Vec::new();
        for letter in name.name.chars() {
            match set.find(letter) {
                Some(index) if index < usize::from(size) => components.push(index as u8),
                Some(_) => {
                    let known = &set[..usize::from(size)];
                    return self.report_swizzle(
                        format!("{shown} has no component `{letter}`"),
                        name,
                        &format!("its components are `{known}`"),
                    );
                }
                None => {
                    return self.report_swizzle(
                        "a swizzle mixes the sets `xyzw`, `rgba` and `stpq`".to_owned(),
                        name,
                        "all letters must come from one set",
                    );
                }
            }
        }
        Some(components)
    }

    fn report_swizzle(
        &mut self,
        problem: String,
        name: &ast::Identifier,
        label: &str,
    ) -> Option<Vec<u8>> {
        self.report(Diagnostic::new(codes::BAD_SWIZZLE, problem).at(name.span, label));
        None
    }

    /// Splits the type of an array constructor, `float[2][3]`, into the name and the sizes.
    pub(super) fn array_head<'e>(
        &self,
        expression: &'e ast::Expression,
    ) -> Option<(ast::Identifier, Vec<Option<&'e ast::Expression>>)> {
        let mut sizes = Vec::new();
        let mut part = expression;
        while let Ast::Index(base, size) = &part.kind {
            sizes.push(size.as_deref());
            part = base;
        }
        let name = match &part.kind {
            Ast::Name(name) => name.clone(),
            Ast::Member(module, part) => self.qualified_name(module, part)?,
            _ => return None,
        };
        sizes.reverse();
        Some((ast::Identifier { name, span: part.span }, sizes))
    }
}
