//! Implied methods: the methods that a class receives if it lacks them.
//!
//! A primitive without `computeNormal` receives one: the gradient of its function `float field(vec3 p)`, or that of the
//! distance that its `intersect` finds; the latter not if it has `generateSample`. One with
//! `computeTextureCoordinates` and without `computeDerivatives` receives the derivatives of the surface by its
//! coordinates. How the hit moves for them depends on what the coordinates are computed from: the point alone, what
//! `intersect` finds, or normals.
//!
//! The rest is about materials.
//! A class with only `shade`, or with no method at all, receives none. One with `BSDF` receives
//! `shade` and `emission`, and cosine sampling if it has neither `sampleBSDF` nor `evaluatePDF`. If
//! it has only one of the two, the other is not added, since the density of cosine sampling would
//! not match the class's sampling. One with `emission` and neither `shade` nor `BSDF` receives a
//! black `BSDF` and with it the other methods; its `shade` asks for no light.

use rtsl_ir::Scalar;
use rtsl_spec::{Method, Role, state_variables};
use rtsl_syntax::ast;

use super::Checker;
use super::facts::UseKind;
use super::scope::Entity;
use crate::hir::{FunctionId, Type};

/// The class with the normals of primitives that have a field.
const IMPLIED_FIELD: &str = "rt_ImpliedField";
/// The class with the normals of primitives without a field.
const IMPLIED_SURFACE: &str = "rt_ImpliedSurface";
/// The class with the derivatives of primitives.
const IMPLIED_DERIVATIVES: &str = "rt_ImpliedDerivatives";
/// The classes that move a hit: by its point alone, with its ray, and with its normals.
const IMPLIED_BY_POINT: &str = "rt_ImpliedByPoint";
const IMPLIED_BY_HIT: &str = "rt_ImpliedByHit";
const IMPLIED_BY_NORMAL: &str = "rt_ImpliedByNormal";
/// The function of primitives that are fields: 0 on the surface, and greater outside.
const FIELD: &str = "field";
/// The class of the prelude that holds the implied methods of materials.
const IMPLIED_MATERIAL: &str = "rt_ImpliedMaterial";
/// The same for classes that cannot choose a direction, because they have `evaluatePDF` without `sampleBSDF`.
const IMPLIED_UNSAMPLED_MATERIAL: &str = "rt_ImpliedUnsampledMaterial";
/// The class with the `shade` of materials that only glow.
const IMPLIED_EMITTER: &str = "rt_ImpliedEmitter";

/// A function of an implied class: a method, or a helper.
pub(super) type Implied<'a> = (&'a ast::Function, Option<Method>);

/// Takes the implied classes out of the prelude's items.
pub(super) fn take_implied_classes(items: &[&ast::Item]) -> Vec<ast::Class> {
    items
        .iter()
        .filter_map(|item| match item {
            ast::Item::Class(class) => Some(class.clone()),
            ast::Item::Struct(_)
            | ast::Item::Enumeration(_)
            | ast::Item::Assertion(_)
            | ast::Item::Function(_)
            | ast::Item::Variable(_) => None,
        })
        .collect()
}

impl<'a> Checker<'a> {
    /// The implied functions of the class being checked, given the methods that it has.
    pub(super) fn implied_functions(&self, present: &[(Method, FunctionId)]) -> Vec<Implied<'a>> {
        let has_role = |role: Role| self.class.as_ref().is_some_and(|it| it.roles.contains(&role));
        let methods: Vec<Method> = present.iter().map(|(method, _)| *method).collect();
        let mut implied = Vec::new();
        if has_role(Role::Material) {
            implied.extend(self.implied_of_material(&methods));
        }
        if has_role(Role::Primitive) {
            let normals = self.implied_normals(&methods);
            let has_normals = !normals.is_empty() || methods.contains(&Method::ComputeNormal);
            implied.extend(normals);
            implied.extend(self.implied_derivatives(present, has_normals));
        }
        implied
    }

    fn implied_normals(&self, present: &[Method]) -> Vec<Implied<'a>> {
        let has = |method: Method| present.contains(&method);
        // Normals of samples point outward, and normals that face the ray would contradict them.
        let may_face_rays = has(Method::Intersect) && !has(Method::GenerateSample);
        let surface = match (self.has_field(), may_face_rays) {
            (true, _) => Some(IMPLIED_FIELD),
            (false, true) => Some(IMPLIED_SURFACE),
            (false, false) => None,
        };
        let surface = surface.filter(|_| !has(Method::ComputeNormal));
        surface.map_or(Vec::new(), |it| self.functions_of_implied(it, &[Method::ComputeNormal]))
    }

    fn implied_derivatives(
        &self,
        present: &[(Method, FunctionId)],
        has_normals: bool,
    ) -> Vec<Implied<'a>> {
        let find = |method| present.iter().find(|(it, _)| *it == method).map(|(_, id)| *id);
        let (Some(coordinates), None) =
            (find(Method::ComputeTextureCoordinates), find(Method::ComputeDerivatives))
        else {
            return Vec::new();
        };
        let place = match find(Method::Intersect) {
            Some(_) => self.place_of_coordinates(coordinates, has_normals),
            None => IMPLIED_BY_POINT,
        };
        let mut implied = self.functions_of_implied(place, &[]);
        implied
            .extend(self.functions_of_implied(IMPLIED_DERIVATIVES, &[Method::ComputeDerivatives]));
        implied
    }

    /// The class that moves a hit of a class with `intersect`, given its `computeTextureCoordinates`.
    fn place_of_coordinates(&self, coordinates: FunctionId, has_normals: bool) -> &'static str {
        const OF_RAY: [&str; 2] = ["rt_RayOrigin", "rt_HitDistance"];
        const NORMALS: [&str; 2] = ["rt_GeometricNormal", "rt_ShadingNormal"];
        let mut place = IMPLIED_BY_POINT;
        for reached in self.reach(coordinates, false) {
            match reached.done.kind {
                UseKind::ReadState(id) => {
                    let name = state_variables()[id.0 as usize].name;
                    if NORMALS.contains(&name) && has_normals {
                        return IMPLIED_BY_NORMAL;
                    }
                    if OF_RAY.contains(&name) {
                        place = IMPLIED_BY_HIT;
                    }
                }
                UseKind::ReadScratch(_) | UseKind::Reference(_) => place = IMPLIED_BY_HIT,
                UseKind::WriteState(_)
                | UseKind::WriteMember(_)
                | UseKind::ReadTextured(_)
                | UseKind::ReadAttribute(_)
                | UseKind::Builtin(_)
                | UseKind::Illuminance => {}
            }
        }
        place
    }

    /// True if the class has a function `float field(vec3)`, whose zeros are its surface.
    fn has_field(&self) -> bool {
        let named = self.class.as_ref().and_then(|class| class.names.get(FIELD));
        let Some(Entity::Functions(ids)) = named.map(|named| &named.entity) else { return false };
        ids.iter().any(|id| {
            let function = self.function(*id);
            let parameters = &function.locals[..function.parameters.len()];
            function.result == Type::Scalar(Scalar::F32)
                && matches!(parameters, [point] if point.ty == Type::Vector(Scalar::F32, 3))
        })
    }

    fn implied_of_material(&self, present: &[Method]) -> Vec<Implied<'a>> {
        let mut missing = missing_methods(present);
        let has = |method: &Method| present.contains(method);
        let of = match has(&Method::EvaluatePdf) && !has(&Method::SampleBsdf) {
            true => IMPLIED_UNSAMPLED_MATERIAL,
            false => IMPLIED_MATERIAL,
        };
        let mut implied = Vec::new();
        if glows_only(present) && !has(&Method::SampleBsdf) {
            implied.extend(self.functions_of_implied(IMPLIED_EMITTER, &[Method::Shade]));
            missing.retain(|method| *method != Method::Shade);
        }
        implied.extend(self.functions_of_implied(of, &missing));
        implied
    }

    /// The helpers of an implied class, and those of its methods that are missing.
    fn functions_of_implied(&self, name: &str, missing: &[Method]) -> Vec<Implied<'a>> {
        let classes = self.prelude.map_or(&[][..], |prelude| &prelude.implied);
        let items =
            classes.iter().filter(|class| class.name.name == name).flat_map(|class| &class.items);
        items
            .filter_map(|item| {
                let ast::Item::Function(function) = item else { return None };
                let method = Method::from_name(&function.name.name);
                method.is_none_or(|it| missing.contains(&it)).then_some((function, method))
            })
            .collect()
    }
}

fn missing_methods(present: &[Method]) -> Vec<Method> {
    let has = |method| present.contains(&method);
    if !has(Method::Bsdf) && !glows_only(present) {
        return Vec::new();
    }
    let mut wanted = vec![Method::Shade, Method::Bsdf, Method::Emission];
    if !has(Method::SampleBsdf) && !has(Method::EvaluatePdf) {
        wanted.extend([Method::SampleBsdf, Method::EvaluatePdf]);
    }
    wanted.retain(|method| !has(*method));
    wanted
}

fn glows_only(present: &[Method]) -> bool {
    let has = |method| present.contains(&method);
    has(Method::Emission) && !has(Method::Shade) && !has(Method::Bsdf)
}
