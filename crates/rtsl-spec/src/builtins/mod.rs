//! The registry of built-in functions, with one entry for each.
//!
//! The checker resolves calls with it, the lowering reads how to lower each call, and the manual's
//! chapter on built-in functions is generated from it. To add a function, add an entry to the table
//! of its chapter and, if its lowering is [`Lowering::Prelude`], its source to the prelude.

mod accuracy;
mod lowering;
mod reference_methods;
mod signature;
mod spec_type;
mod structs;
mod table;

use std::collections::BTreeMap;
use std::sync::LazyLock;

use crate::Method;

pub use accuracy::{ACCURACY, Accuracy, AccuracyDomain, GreatestError, accuracy};
pub use lowering::{Along, Direction, Lowering, Mapped, Operation, Special};
pub use reference_methods::{
    REFERENCE_METHODS, ReferenceMethod, STATE_OF_WIDTHS, state_of_parameter,
};
pub use signature::{Overload, Parameter};
pub use spec_type::{Scalar, SpecType};
pub use structs::{Field, SpecStruct};

/// A built-in function, with all data that the compiler and the manual need.
#[derive(Debug)]
pub struct Builtin {
    /// The name that shaders call.
    pub name: &'static str,
    /// The chapter of the manual that describes it.
    pub chapter: Chapter,
    /// Its forms, in the notation of GLSL's specification with generic types (`genF`, ...).
    pub signatures: &'static [&'static str],
    /// One or two sentences: meaning, units, edges of the domain.
    pub doc: &'static str,
    /// The lowering of a call.
    pub lowering: Lowering,
    /// The places where it may be called.
    pub usable: Usable,
}

/// The places where a built-in function may be called.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Usable {
    /// Every method and function.
    Anywhere,
    /// These interface methods, and functions that only these call.
    Methods(&'static [Method]),
    /// The prelude only: the name starts with `rt_`.
    Prelude,
}

/// The chapters of the registry, in the order of the manual.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Chapter {
    /// Angles and trigonometry.
    Trigonometry,
    /// Powers, exponentials, logarithms and roots.
    Exponential,
    /// Rounding, interpolation, and bit casts of floats.
    Common,
    /// Derivatives.
    Derivatives,
    /// Packing of several small numbers into one uint.
    Packing,
    /// Geometric functions of vectors.
    Geometric,
    /// Matrices.
    Matrix,
    /// Component-wise comparisons of vectors.
    Relational,
    /// Bit operations and wide products of integers.
    Integer,
    /// Colors.
    Color,
    /// Functions of the ray tracer: hits, rays, light, the sampler.
    RayTracing,
    /// Functions of integrators: surfaces, lights, the sampler.
    Integrators,
    /// Noise and patterns.
    Noise,
    /// Maps from uniform random numbers to points and directions.
    Sampling,
    /// Building blocks of materials: microfacets, Fresnel reflectance.
    Scattering,
    /// Functions that only the prelude may call.
    Intrinsic,
}

impl Chapter {
    /// The heading in the manual.
    pub const fn title(self) -> &'static str {
        match self {
            Chapter::Trigonometry => "Angles and trigonometry",
            Chapter::Exponential => "Powers, exponentials and logarithms",
            Chapter::Common => "Common functions",
            Chapter::Derivatives => "Derivatives",
            Chapter::Packing => "Packing",
            Chapter::Geometric => "Geometry",
            Chapter::Matrix => "Matrices",
            Chapter::Relational => "Comparisons of vectors",
            Chapter::Integer => "Integers",
            Chapter::Color => "Colors",
            Chapter::RayTracing => "Ray tracing",
            Chapter::Integrators => "Integrators",
            Chapter::Noise => "Noise and patterns",
            Chapter::Sampling => "Sampling",
            Chapter::Scattering => "Scattering",
            Chapter::Intrinsic => "Intrinsics of the prelude",
        }
    }
}

impl Builtin {
    /// An entry for a function written in RTSL that is usable anywhere.
    const fn prelude(
        chapter: Chapter,
        name: &'static str,
        signatures: &'static [&'static str],
        doc: &'static str,
    ) -> Builtin {
        Builtin {
            name,
            chapter,
            signatures,
            doc,
            lowering: Lowering::Prelude,
            usable: Usable::Anywhere,
        }
    }

    /// An entry for one operation of the IR per component that is usable anywhere.
    const fn operation(
        chapter: Chapter,
        name: &'static str,
        operation: Operation,
        signatures: &'static [&'static str],
        doc: &'static str,
    ) -> Builtin {
        let lowering = Lowering::Operation(operation);
        Builtin { name, chapter, signatures, doc, lowering, usable: Usable::Anywhere }
    }

    /// An entry for a function with a lowering specific to it.
    const fn special(
        chapter: Chapter,
        name: &'static str,
        special: Special,
        usable: Usable,
        signatures: &'static [&'static str],
        doc: &'static str,
    ) -> Builtin {
        let lowering = Lowering::Special(special);
        Builtin { name, chapter, signatures, doc, lowering, usable }
    }
}

/// Every built-in function, chapter by chapter.
pub fn all() -> impl Iterator<Item = &'static Builtin> {
    table::CHAPTERS.iter().copied().flatten()
}

/// The built-in function called `name`.
pub fn find(name: &str) -> Option<&'static Builtin> {
    REGISTRY.get(name).map(|entry| entry.builtin)
}

/// The overloads of the built-in function called `name`; empty if there is none.
pub fn overloads(name: &str) -> &'static [Overload] {
    REGISTRY.get(name).map_or(&[], |entry| &entry.overloads)
}

/// The methods of a struct of the language.
pub fn methods_of(receiver: SpecStruct) -> impl Iterator<Item = &'static Builtin> {
    let methods = table::STRUCT_METHODS.iter();
    methods.filter(move |(of, _)| *of == receiver).map(|(_, method)| method)
}

/// The overloads of a method of a struct, with the struct as first parameter; empty if there is none of this name.
pub fn method_overloads(receiver: SpecStruct, name: &str) -> &'static [Overload] {
    let mut methods = METHODS.iter();
    let found = methods.find(|(of, entry)| *of == receiver && entry.builtin.name == name);
    found.map_or(&[], |(_, entry)| &entry.overloads)
}

struct Entry {
    builtin: &'static Builtin,
    overloads: Vec<Overload>,
}

static REGISTRY: LazyLock<BTreeMap<&'static str, Entry>> =
    LazyLock::new(|| all().map(|builtin| (builtin.name, Entry::new(builtin))).collect());

static METHODS: LazyLock<Vec<(SpecStruct, Entry)>> = LazyLock::new(|| {
    table::STRUCT_METHODS.iter().map(|(of, method)| (*of, Entry::new(method))).collect()
});

impl Entry {
    fn new(builtin: &'static Builtin) -> Entry {
        let overloads = builtin
            .signatures
            .iter()
            .flat_map(|&text| {
                signature::expand(builtin, text)
                    .unwrap_or_else(|| unreachable!("the table's signatures are tested: {text}"))
            })
            .collect();
        Entry { builtin, overloads }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use expect_test::{Expect, expect};

    #[test]
    fn every_signature_declares_its_entry() {
        let methods = SpecStruct::ALL.into_iter().flat_map(methods_of);
        for builtin in all().chain(methods) {
            for &text in builtin.signatures {
                assert!(signature::expand(builtin, text).is_some(), "{text}");
            }
        }
    }

    #[test]
    fn names_are_unique() {
        assert_eq!(all().count(), REGISTRY.len());
    }

    #[test]
    fn no_function_has_two_forms_with_the_same_parameters() {
        for builtin in all() {
            let mut seen = Vec::new();
            for overload in overloads(builtin.name) {
                let types: Vec<SpecType> =
                    overload.parameters.iter().map(|parameter| parameter.ty).collect();
                assert!(!seen.contains(&types), "{overload}");
                seen.push(types);
            }
        }
    }

    #[test]
    fn only_intrinsics_have_names_of_the_language() {
        for builtin in all() {
            let private = builtin.usable == Usable::Prelude;
            assert_eq!(private, builtin.name.starts_with("rt_"), "{}", builtin.name);
            assert_eq!(private, builtin.chapter == Chapter::Intrinsic, "{}", builtin.name);
        }
    }

    #[test]
    fn documentation_is_sentences() {
        let methods = SpecStruct::ALL.into_iter().flat_map(methods_of);
        for builtin in all().chain(methods) {
            assert!(builtin.doc.ends_with('.'), "{}", builtin.name);
        }
    }

    #[test]
    fn methods_take_their_struct_first() {
        for receiver in SpecStruct::ALL {
            for method in methods_of(receiver) {
                let overloads = method_overloads(receiver, method.name);
                let first = overloads.iter().map(|overload| overload.parameters[0].ty);
                assert!(first.into_iter().all(|ty| ty == SpecType::Struct(receiver)));
                assert!(!overloads.is_empty(), "{}", method.name);
            }
        }
    }

    #[test]
    fn generic_signatures_expand() {
        check(
            "clamp",
            expect![[r#"
                float clamp(float x, float low, float high)
                vec2 clamp(vec2 x, vec2 low, vec2 high)
                vec3 clamp(vec3 x, vec3 low, vec3 high)
                vec4 clamp(vec4 x, vec4 low, vec4 high)
                vec2 clamp(vec2 x, float low, float high)
                vec3 clamp(vec3 x, float low, float high)
                vec4 clamp(vec4 x, float low, float high)
                int clamp(int x, int low, int high)
                ivec2 clamp(ivec2 x, ivec2 low, ivec2 high)
                ivec3 clamp(ivec3 x, ivec3 low, ivec3 high)
                ivec4 clamp(ivec4 x, ivec4 low, ivec4 high)
                ivec2 clamp(ivec2 x, int low, int high)
                ivec3 clamp(ivec3 x, int low, int high)
                ivec4 clamp(ivec4 x, int low, int high)
                uint clamp(uint x, uint low, uint high)
                uvec2 clamp(uvec2 x, uvec2 low, uvec2 high)
                uvec3 clamp(uvec3 x, uvec3 low, uvec3 high)
                uvec4 clamp(uvec4 x, uvec4 low, uvec4 high)
                uvec2 clamp(uvec2 x, uint low, uint high)
                uvec3 clamp(uvec3 x, uint low, uint high)
                uvec4 clamp(uvec4 x, uint low, uint high)
                color clamp(color x, color low, color high)
                color clamp(color x, float low, color high)
                color clamp(color x, color low, float high)
                color clamp(color x, float low, float high)
            "#]],
        );
        check(
            "modf",
            expect![[r#"
            float modf(float x, out float whole)
            vec2 modf(vec2 x, out vec2 whole)
            vec3 modf(vec3 x, out vec3 whole)
            vec4 modf(vec4 x, out vec4 whole)
        "#]],
        );
        check(
            "lessThan",
            expect![[r#"
            bvec2 lessThan(vec2 x, vec2 y)
            bvec3 lessThan(vec3 x, vec3 y)
            bvec4 lessThan(vec4 x, vec4 y)
            bvec2 lessThan(ivec2 x, ivec2 y)
            bvec3 lessThan(ivec3 x, ivec3 y)
            bvec4 lessThan(ivec4 x, ivec4 y)
            bvec2 lessThan(uvec2 x, uvec2 y)
            bvec3 lessThan(uvec3 x, uvec3 y)
            bvec4 lessThan(uvec4 x, uvec4 y)
        "#]],
        );
        check(
            "matrixCompMult",
            expect![[r#"
            mat2 matrixCompMult(mat2 x, mat2 y)
            mat2x3 matrixCompMult(mat2x3 x, mat2x3 y)
            mat2x4 matrixCompMult(mat2x4 x, mat2x4 y)
            mat3x2 matrixCompMult(mat3x2 x, mat3x2 y)
            mat3 matrixCompMult(mat3 x, mat3 y)
            mat3x4 matrixCompMult(mat3x4 x, mat3x4 y)
            mat4x2 matrixCompMult(mat4x2 x, mat4x2 y)
            mat4x3 matrixCompMult(mat4x3 x, mat4x3 y)
            mat4 matrixCompMult(mat4 x, mat4 y)
        "#]],
        );
    }

    fn check(name: &str, expected: Expect) {
        let text: String = overloads(name).iter().map(|overload| format!("{overload}\n")).collect();
        expected.assert_eq(&text);
    }
}
