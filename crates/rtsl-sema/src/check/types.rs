//! Types: their names in text and messages, conversions, sizes.

use std::sync::Arc;

use rtsl_ir::Scalar;
use rtsl_source::{Diagnostic, Span, diagnostic_codes as codes, with_article};
use rtsl_spec::builtins::{self, SpecStruct, SpecType};
use rtsl_spec::{COLOR_COMPONENTS, Role, StateType};
use rtsl_syntax::ast;

use super::Checker;
use super::foreign::{advise, type_counterpart};
use super::generics::is_generic_name;
use super::scope::Entity;
use super::suggestions::suggest;
use super::type_names::plain_type_name;
use crate::hir::{Struct, StructId, Type};

/// The limit on scalars in one value.
pub(super) const MAX_LEAVES: u32 = 1 << 20;

/// The maximum nesting of arrays and structs in a type.
const MAX_TYPE_DEPTH: u32 = 16;

/// The checker's data about a struct, beside its fields.
#[derive(Clone, Copy, Debug)]
pub(super) struct StructInfo {
    leaves: u32,
    depth: u32,
}

/// The float type.
pub(super) const FLOAT: Type = Type::Scalar(Scalar::F32);
/// The int type.
pub(super) const INT: Type = Type::Scalar(Scalar::I32);
/// The uint type.
pub(super) const UINT: Type = Type::Scalar(Scalar::U32);
/// The bool type.
pub(super) const BOOL: Type = Type::Scalar(Scalar::Bool);
/// The vec3 type.
pub(super) const VEC3: Type = Type::Vector(Scalar::F32, 3);

/// The scalar type of the components of a vector, matrix or color, or the scalar itself.
pub(super) fn component_scalar(ty: &Type) -> Option<Scalar> {
    match ty {
        Type::Scalar(scalar) | Type::Vector(scalar, _) => Some(*scalar),
        Type::Matrix(..) | Type::Color => Some(Scalar::F32),
        Type::Void
        | Type::Struct(_)
        | Type::Array(..)
        | Type::Buffer(_)
        | Type::Reference(_)
        | Type::Error => None,
    }
}

/// The number of components of a scalar, vector, matrix or color.
pub(super) fn component_count(ty: &Type) -> Option<u32> {
    match ty {
        Type::Scalar(_) => Some(1),
        Type::Vector(_, size) => Some(u32::from(*size)),
        Type::Matrix(columns, rows) => Some(u32::from(*columns) * u32::from(*rows)),
        Type::Color => Some(COLOR_COMPONENTS),
        Type::Void
        | Type::Struct(_)
        | Type::Array(..)
        | Type::Buffer(_)
        | Type::Reference(_)
        | Type::Error => None,
    }
}

/// The same scalar or vector type with another scalar; `None` for other types.
pub(super) fn with_scalar(ty: &Type, scalar: Scalar) -> Option<Type> {
    match ty {
        Type::Scalar(_) => Some(Type::Scalar(scalar)),
        Type::Vector(_, size) => Some(Type::Vector(scalar, *size)),
        _ => None,
    }
}

/// True if GLSL converts a value of type `from` to `to` implicitly: int to uint to float, in
/// vectors too. A type does not convert to itself.
pub(super) fn converts(from: &Type, to: &Type) -> bool {
    match (from, to) {
        (Type::Scalar(from), Type::Scalar(to)) => scalar_converts(*from, *to),
        (Type::Vector(from, size), Type::Vector(to, other)) => {
            size == other && scalar_converts(*from, *to)
        }
        _ => false,
    }
}

fn scalar_converts(from: Scalar, to: Scalar) -> bool {
    matches!(
        (from, to),
        (Scalar::I32, Scalar::U32) | (Scalar::I32, Scalar::F32) | (Scalar::U32, Scalar::F32)
    )
}

/// Converts a type of the registry. `reference` has no equivalent; calls with such a parameter are
/// resolved separately.
pub(super) fn from_spec(ty: SpecType) -> Type {
    match ty {
        SpecType::Void => Type::Void,
        SpecType::Bool => BOOL,
        SpecType::Int => INT,
        SpecType::Uint => UINT,
        SpecType::Float => FLOAT,
        SpecType::Vec(scalar, size) => Type::Vector(from_spec_scalar(scalar), size),
        SpecType::Mat(columns, rows) => Type::Matrix(columns, rows),
        SpecType::Color => Type::Color,
        SpecType::Struct(each) => Type::Struct(struct_id(each)),
        SpecType::Reference => Type::Error,
    }
}

/// The id of a struct of the language: they are the first in every module, in the order of [`SpecStruct::ALL`].
fn struct_id(each: SpecStruct) -> StructId {
    let index = SpecStruct::ALL.iter().position(|other| *other == each);
    StructId(index.expect("all structs are listed") as u32)
}

/// The struct of the language with this id, if it is one of those.
pub(super) fn spec_struct(id: StructId) -> Option<SpecStruct> {
    SpecStruct::ALL.get(id.0 as usize).copied()
}

fn from_spec_scalar(scalar: builtins::Scalar) -> Scalar {
    match scalar {
        builtins::Scalar::Bool => Scalar::Bool,
        builtins::Scalar::Int => Scalar::I32,
        builtins::Scalar::Uint => Scalar::U32,
        builtins::Scalar::Float => Scalar::F32,
    }
}

/// The type of a state variable.
pub(super) fn from_state(ty: StateType) -> Type {
    match ty {
        StateType::Float => FLOAT,
        StateType::Vec2 => Type::Vector(Scalar::F32, 2),
        StateType::Vec3 => VEC3,
        StateType::Color => Type::Color,
        StateType::Floats(count) => Type::Array(Box::new(FLOAT), count),
    }
}

/// The built-in type called `name`.
pub(super) fn builtin_type(name: &str) -> Option<Type> {
    if let Some(role) = Role::from_class(name) {
        return Some(Type::Reference(role));
    }
    match SpecType::from_name(name)? {
        SpecType::Reference => None,
        ty => Some(from_spec(ty)),
    }
}

/// True if values of the type are or contain references.
pub(super) fn holds_reference(ty: &Type) -> bool {
    match ty {
        Type::Reference(_) => true,
        Type::Array(element, _) | Type::Buffer(element) => holds_reference(element),
        _ => false,
    }
}

/// The context of a type, which determines the types allowed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum TypePlace {
    /// A member: buffers, references and arrays of references are allowed.
    Member,
    /// A variable or constant: `[]` takes its size from the initializer.
    Variable,
    /// A parameter: references are allowed.
    Parameter,
    /// A field of a struct.
    Field,
    /// A result: `void` is allowed.
    Result,
    /// The type of an array constructor: `float[](...)`.
    Constructor,
}

impl Checker<'_> {
    /// Formats a value of the type: "an `int`".
    pub(super) fn show_one(&self, ty: &Type) -> String {
        with_article(&format!("`{}`", self.show(ty)))
    }

    /// Formats the type as the language writes it.
    pub(super) fn show(&self, ty: &Type) -> String {
        let mut suffix = String::new();
        let mut ty = ty;
        loop {
            match ty {
                Type::Array(element, size) => {
                    suffix.push_str(&format!("[{size}]"));
                    ty = element;
                }
                Type::Buffer(element) => {
                    suffix.push_str("[]");
                    ty = element;
                }
                _ => return self.show_element(ty) + &suffix,
            }
        }
    }

    fn show_element(&self, ty: &Type) -> String {
        match ty {
            Type::Struct(id) => self.module.structs[id.0 as usize].name.clone(),
            _ => plain_type_name(ty),
        }
    }

    /// The number of scalars in a value of the type; references and buffers count as one.
    pub(super) fn leaf_count(&self, ty: &Type) -> u32 {
        leaf_count(&self.struct_info, ty)
    }

    fn type_depth(&self, ty: &Type) -> u32 {
        match ty {
            Type::Struct(id) => self.struct_info[id.0 as usize].depth,
            Type::Array(element, _) | Type::Buffer(element) => 1 + self.type_depth(element),
            _ => 0,
        }
    }

    /// Adds the structs of the language to an empty module.
    pub(super) fn add_spec_structs(&mut self) {
        for each in SpecStruct::ALL {
            let fields =
                each.fields().iter().map(|field| (field.name.to_owned(), from_spec(field.ty)));
            let declared = Struct { name: each.name().to_owned(), fields: fields.collect() };
            let leaves = declared.fields.iter().map(|(_, ty)| self.leaf_count(ty)).sum();
            self.module.structs.push(Arc::new(declared));
            self.struct_info.push(StructInfo { leaves, depth: 1 });
        }
    }

    /// Records the size of a struct that was just added to the module.
    pub(super) fn measure_struct(&mut self, id: StructId, span: Span) {
        let fields = self.module.structs[id.0 as usize].fields.clone();
        let mut info = StructInfo { leaves: 0, depth: 0 };
        for (_, ty) in &fields {
            info.leaves = info.leaves.saturating_add(self.leaf_count(ty));
            info.depth = info.depth.max(self.type_depth(ty));
        }
        info.depth += 1;
        if info.leaves > MAX_LEAVES || info.depth > MAX_TYPE_DEPTH {
            self.report_type_limit(info.leaves, span);
            info = StructInfo { leaves: 1, depth: 1 };
        }
        debug_assert_eq!(self.struct_info.len(), id.0 as usize);
        self.struct_info.push(info);
    }

    fn report_type_limit(&mut self, leaves: u32, span: Span) {
        let (what, note) = if leaves > MAX_LEAVES {
            ("this type is too large", format!("a value may have at most {MAX_LEAVES} numbers"))
        } else {
            (
                "this type is nested too deeply",
                format!("arrays and structs may be nested {MAX_TYPE_DEPTH} deep"),
            )
        };
        self.report(
            Diagnostic::new(codes::TYPE_TOO_LARGE, what)
                .at(span, "")
                .note(note)
                .help("large tables are buffers: members declared with `[]`, set by the host"),
        );
    }

    /// Resolves `written` in this context; returns [`Type::Error`] after reporting an error.
    /// Unsized dimensions give [`Type::Buffer`].
    pub(super) fn resolve_type(&mut self, written: &ast::TypeName, place: TypePlace) -> Type {
        let element = self.resolve_type_name(&written.name, place);
        let Some(sizes) = self.check_sizes(&written.sizes) else { return Type::Error };
        let ty = self.array_of(element, &sizes, written.span);
        self.check_type_place(ty, written.span, place)
    }

    /// Arrays of `element`, the outermost size first.
    pub(super) fn array_of(&mut self, element: Type, sizes: &[Option<u32>], span: Span) -> Type {
        if element == Type::Error || sizes.is_empty() {
            return element;
        }
        if element == Type::Void {
            self.report(
                Diagnostic::new(codes::VOID_VALUE, "there are no arrays of `void`").at(span, ""),
            );
            return Type::Error;
        }
        if sizes.len() as u32 + self.type_depth(&element) > MAX_TYPE_DEPTH {
            self.report_type_limit(0, span);
            return Type::Error;
        }
        let ty = sizes.iter().rev().fold(element, |element, size| match size {
            Some(size) => Type::Array(Box::new(element), *size),
            None => Type::Buffer(Box::new(element)),
        });
        let leaves = self.leaf_count(&ty);
        if leaves > MAX_LEAVES {
            self.report_type_limit(leaves, span);
            return Type::Error;
        }
        ty
    }

    fn resolve_type_name(&mut self, name: &ast::Identifier, place: TypePlace) -> Type {
        self.note_type(name);
        match self.find(&name.name).map(|named| named.entity.clone()) {
            Some(Entity::Struct(id)) => return Type::Struct(id),
            Some(Entity::Enumeration(_)) => return INT,
            Some(Entity::Error) => return Type::Error,
            Some(Entity::Class(_)) => {
                self.report_class_as_type(name);
                return Type::Error;
            }
            Some(_) | None => {}
        }
        match builtin_type(&name.name) {
            Some(Type::Void) if place != TypePlace::Result => {
                self.report(
                    Diagnostic::new(codes::VOID_VALUE, "`void` is not the type of a value")
                        .at(name.span, "expected a type with values"),
                );
                Type::Error
            }
            Some(ty) => ty,
            None => match self.generic_type(&name.name) {
                Some(ty) => ty,
                None => {
                    self.report_unknown_type(name);
                    Type::Error
                }
            },
        }
    }

    fn report_class_as_type(&mut self, name: &ast::Identifier) {
        self.report(
            Diagnostic::new(
                codes::UNKNOWN_TYPE,
                format!("`{}` is a class, and classes are not types", name.name),
            )
            .at(name.span, "not a type")
            .help("a member that refers to another shader has the type of its role, such as `rt_Texture`"),
        );
    }

    fn report_unknown_type(&mut self, name: &ast::Identifier) {
        if is_generic_name(&name.name) {
            let message = format!("`{}` is a type in generic functions only", name.name);
            self.report(
                Diagnostic::new(codes::BAD_GENERIC, message)
                    .at(name.span, "no argument determines it here")
                    .note("in a function with such a parameter, it has the type of the argument"),
            );
            return;
        }
        let diagnostic =
            Diagnostic::new(codes::UNKNOWN_TYPE, format!("there is no type `{}`", name.name))
                .at(name.span, "unknown type");
        let diagnostic = match type_counterpart(&name.name) {
            Some(counterpart) => advise(diagnostic, name.span, counterpart),
            None => {
                let similar = self.similar_type(&name.name);
                suggest(diagnostic, name.span, similar)
            }
        };
        self.report(diagnostic);
    }

    fn check_type_place(&mut self, ty: Type, span: Span, place: TypePlace) -> Type {
        if ty == Type::Error {
            return ty;
        }
        if holds_reference(&ty) {
            return self.check_reference_place(ty, span, place);
        }
        let buffer_inside = match &ty {
            Type::Array(element, _) => holds_buffer(element),
            Type::Buffer(element) => {
                holds_buffer(element)
                    && !matches!(place, TypePlace::Variable | TypePlace::Constructor)
            }
            _ => false,
        };
        let outermost = matches!(ty, Type::Buffer(_));
        let allowed = match place {
            TypePlace::Member => !buffer_inside,
            TypePlace::Variable | TypePlace::Constructor => true,
            TypePlace::Parameter if self.in_prelude => !buffer_inside,
            TypePlace::Parameter | TypePlace::Field | TypePlace::Result => {
                !outermost && !buffer_inside
            }
        };
        if allowed {
            return ty;
        }
        self.report(
            Diagnostic::new(codes::MISPLACED_BUFFER, "an array without a size is not allowed here")
                .at(span, "the size is missing")
                .note("only members may be buffers, and only their first dimension may be open"),
        );
        Type::Error
    }

    fn check_reference_place(&mut self, ty: Type, span: Span, place: TypePlace) -> Type {
        let allowed = match (&ty, place) {
            (Type::Reference(_), TypePlace::Member | TypePlace::Parameter) => true,
            (Type::Array(element, _) | Type::Buffer(element), TypePlace::Member) => {
                matches!(**element, Type::Reference(_))
            }
            _ => false,
        };
        if allowed {
            return ty;
        }
        let shown = self.show(&ty);
        self.report(
            Diagnostic::new(
                codes::REFERENCE_AS_VALUE,
                format!("`{shown}` is not allowed here"),
            )
            .at(span, "refers to shaders, and is not a value")
            .note("members may be references or arrays of references, parameters of functions references"),
        );
        Type::Error
    }
}

/// True for buffers; arrays of references without a size are none.
pub(super) fn is_buffer(ty: &Type) -> bool {
    matches!(ty, Type::Buffer(element) if !holds_reference(element))
}

/// True if the type contains an array without a size.
fn holds_buffer(ty: &Type) -> bool {
    match ty {
        Type::Buffer(_) => true,
        Type::Array(element, _) => holds_buffer(element),
        _ => false,
    }
}

/// The number of scalars in a value of the type; references and buffers count as one.
pub(super) fn leaf_count(structs: &[StructInfo], ty: &Type) -> u32 {
    match ty {
        Type::Void | Type::Error => 0,
        Type::Reference(_) => 1,
        Type::Buffer(element) => leaf_count(structs, element),
        Type::Struct(id) => structs[id.0 as usize].leaves,
        Type::Array(element, size) => leaf_count(structs, element).saturating_mul(*size),
        Type::Scalar(_) | Type::Vector(..) | Type::Matrix(..) | Type::Color => {
            component_count(ty).unwrap_or(0)
        }
    }
}
