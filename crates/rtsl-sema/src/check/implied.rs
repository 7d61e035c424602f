//! Implied methods: the methods that a material's class receives if it lacks them.
//!
//! A class with only `shade`, or with no method at all, receives none. One with `BSDF` receives
//! `shade` and `emission`, and cosine sampling if it has neither `sampleBSDF` nor `evaluatePDF`. If
//! it has only one of the two, the other is not added, since the density of cosine sampling would
//! not match the class's sampling. One with `emission` and neither `shade` nor `BSDF` receives a
//! black `BSDF` and with it the other methods.

use rtsl_spec::{Method, Role};
use rtsl_syntax::ast;

use super::Checker;

/// The class of the prelude that holds the implied methods.
const IMPLIED_MATERIAL: &str = "rt_ImpliedMaterial";

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
    pub(super) fn implied_functions(&self, present: &[Method]) -> Vec<(&'a ast::Function, Method)> {
        let is_material =
            self.class.as_ref().is_some_and(|class| class.roles.contains(&Role::Material));
        if !is_material {
            return Vec::new();
        }
        let missing = missing_methods(present);
        let classes = self.prelude.map_or(&[][..], |prelude| &prelude.implied);
        let items = classes
            .iter()
            .filter(|class| class.name.name == IMPLIED_MATERIAL)
            .flat_map(|class| &class.items);
        items
            .filter_map(|item| {
                let ast::Item::Function(function) = item else { return None };
                let method = Method::from_name(&function.name.name)?;
                missing.contains(&method).then_some((function, method))
            })
            .collect()
    }
}

fn missing_methods(present: &[Method]) -> Vec<Method> {
    let has = |method| present.contains(&method);
    let glows_only = has(Method::Emission) && !has(Method::Shade) && !has(Method::Bsdf);
    if !has(Method::Bsdf) && !glows_only {
        return Vec::new();
    }
    let mut wanted = vec![Method::Shade, Method::Bsdf, Method::Emission];
    if !has(Method::SampleBsdf) && !has(Method::EvaluatePdf) {
        wanted.extend([Method::SampleBsdf, Method::EvaluatePdf]);
    }
    wanted.retain(|method| !has(*method));
    wanted
}
