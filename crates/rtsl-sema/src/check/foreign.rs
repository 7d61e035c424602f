//! Names that authors bring from other languages (HLSL, OSL, WGSL, C), and their equivalents in
//! RTSL.

use rtsl_source::{Diagnostic, Span};
use rtsl_spec::builtins::{self, Usable};

/// The equivalent of a name of another language.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) enum Counterpart {
    /// Another name, which can replace it.
    Name(String),
    /// Advice for a feature that is written in another way.
    Advice(&'static str),
}

/// Adds the replacement for the name at `span` to the diagnostic.
pub(super) fn advise(diagnostic: Diagnostic, span: Span, counterpart: Counterpart) -> Diagnostic {
    match counterpart {
        Counterpart::Name(name) => diagnostic.suggest("write instead", span, name),
        Counterpart::Advice(advice) => diagnostic.help(advice),
    }
}

/// Functions that have the same parameters and another name.
const RENAMED_FUNCTIONS: [(&str, &str); 30] = [
    ("Dx", "dFdx"),
    ("Dy", "dFdy"),
    ("asint", "floatBitsToInt"),
    ("asuint", "floatBitsToUint"),
    ("atan2", "atan"),
    ("countbits", "bitCount"),
    ("dFdxCoarse", "dFdx"),
    ("dFdxFine", "dFdx"),
    ("dFdyCoarse", "dFdy"),
    ("dFdyFine", "dFdy"),
    ("ddx", "dFdx"),
    ("ddx_coarse", "dFdx"),
    ("ddx_fine", "dFdx"),
    ("ddy", "dFdy"),
    ("ddy_coarse", "dFdy"),
    ("ddy_fine", "dFdy"),
    ("drand48", "rand"),
    ("fabs", "abs"),
    ("filterwidth", "fwidth"),
    ("firstbithigh", "findMSB"),
    ("firstbitlow", "findLSB"),
    ("fmax", "max"),
    ("fmin", "min"),
    ("frac", "fract"),
    ("fwidthCoarse", "fwidth"),
    ("fwidthFine", "fwidth"),
    ("lerp", "mix"),
    ("mad", "fma"),
    ("reversebits", "bitfieldReverse"),
    ("rsqrt", "inversesqrt"),
];

/// Functions that are written in another way.
const REPLACED_FUNCTIONS: [(&str, &str); 18] = [
    ("asfloat", "write `intBitsToFloat(x)` or `uintBitsToFloat(x)`"),
    ("cbrt", "write `sign(x) * pow(abs(x), 1.0 / 3.0)`"),
    (
        "clip",
        "a material makes holes by its method `presence`; `intersect` rejects a hit by not calling `hit`",
    ),
    ("exp10", "write `pow(10.0, x)`"),
    ("fmod", "write `x - y * trunc(x / y)`; `mod(x, y)` differs where x is negative"),
    ("fprintf", PRINTING),
    ("hypot", "write `length(vec2(x, y))`"),
    ("isfinite", "write `!isnan(x) && !isinf(x)`"),
    ("length2", "write `dot(v, v)`"),
    ("log10", "write `log(x) / log(10.0)`"),
    ("mul", "write `a * b`, which multiplies matrices and vectors"),
    ("print", PRINTING),
    ("printf", PRINTING),
    ("rcp", "write `1.0 / x`"),
    ("saturate", "write `clamp(x, 0.0, 1.0)`"),
    ("select", "write `mix(b, a, condition)`; for vectors `condition` is a `bvec`"),
    ("sincos", "write `sin(x)` and `cos(x)`"),
    (
        "transform",
        "each role's page names the space of its state variables; matrices transform by `m * v`",
    ),
];

const PRINTING: &str =
    "write `print(\"x = {}\", x);`, which `rtsl eval` and `rtsl render --pixel` show";

const TEXTURES: &str =
    "textures are other shaders: call `lookup(uv)` of a `public rt_Texture` member";

/// The equivalent of an unknown name of a value or a function.
pub(super) fn counterpart(name: &str) -> Option<Counterpart> {
    let advice = |text: &'static str| Some(Counterpart::Advice(text));
    let is = |names: &[&str]| names.contains(&name);
    if name.starts_with("gl_") {
        return advice(
            "what GLSL passes in `gl_` variables, RTSL passes in the state variables of roles",
        );
    }
    if ["texture", "texel", "image", "tex2D", "tex3D", "texCUBE"]
        .iter()
        .any(|start| name.starts_with(start))
    {
        return advice(TEXTURES);
    }
    if is(&["iTime", "time"]) {
        return advice(
            "`rt_TimeSeed` is the time within the shutter; other times are parameters, `public` members",
        );
    }
    if is(&["main", "mainImage"]) {
        return advice("hosts call the interface methods of a class");
    }
    if is(&["NULL", "null", "nullptr"]) {
        return advice("references are tested by `isSet(reference)`");
    }
    if ["auto", "let", "var"].contains(&name) {
        return type_counterpart(name);
    }
    if is(&["PI", "M_PI", "M_PI_F"]) {
        return advice("declare it: `const float PI = 3.14159265;`");
    }
    function_counterpart(name)
}

fn function_counterpart(name: &str) -> Option<Counterpart> {
    if let Some((_, ours)) = RENAMED_FUNCTIONS.iter().find(|(theirs, _)| *theirs == name) {
        return Some(Counterpart::Name((*ours).to_owned()));
    }
    if let Some((_, advice)) = REPLACED_FUNCTIONS.iter().find(|(theirs, _)| *theirs == name) {
        return Some(Counterpart::Advice(advice));
    }
    // CUDA's constructors: `make_float3`.
    if let Some(ours) = name.strip_prefix("make_").and_then(sized_type) {
        return Some(Counterpart::Name(ours));
    }
    // C's functions of binary32: `sqrtf`, `fminf`.
    let stem = name.strip_suffix('f')?;
    if builtins::find(stem).is_some_and(|builtin| builtin.usable != Usable::Prelude) {
        return Some(Counterpart::Name(stem.to_owned()));
    }
    const FLOATS: [&str; 12] = [
        "atan2", "cbrt", "exp10", "fabs", "fmax", "fmin", "fmod", "hypot", "lerp", "log10",
        "rsqrt", "saturate",
    ];
    FLOATS.contains(&stem).then(|| function_counterpart(stem))?
}

/// Types with other names that do not contain sizes.
const RENAMED_TYPES: [(&str, &str); 13] = [
    ("Color", "color"),
    ("Normal", "vec3"),
    ("Point", "vec3"),
    ("Spectrum", "color"),
    ("Vector", "vec3"),
    ("f32", "float"),
    ("i32", "int"),
    ("matrix", "mat4"),
    ("normal", "vec3"),
    ("point", "vec3"),
    ("size_t", "uint"),
    ("u32", "uint"),
    ("vector", "vec3"),
];

/// The name of the language that a name with its prefix `rt_` probably stands for.
const MEANT: [(&str, &str); 20] = [
    ("rt_BRDF", "rt_Material"),
    ("rt_BSDF", "rt_Material"),
    ("rt_Background", "rt_Light"),
    ("rt_Bsdf", "rt_Material"),
    ("rt_Color", "color"),
    ("rt_Curve", "rt_Primitive"),
    ("rt_Emitter", "rt_Light"),
    ("rt_Environment", "rt_Light"),
    ("rt_Geometry", "rt_Primitive"),
    ("rt_Image", "rt_Texture"),
    ("rt_Lamp", "rt_Light"),
    ("rt_Lens", "rt_Camera"),
    ("rt_Mesh", "rt_Primitive"),
    ("rt_Object", "rt_Primitive"),
    ("rt_Pattern", "rt_Texture"),
    ("rt_Renderer", "rt_Integrator"),
    ("rt_Shader", "rt_Material"),
    ("rt_Shape", "rt_Primitive"),
    ("rt_Sky", "rt_Light"),
    ("rt_Tracer", "rt_Integrator"),
];

/// The equivalent of an unknown name of a class or a type with the prefix of the language.
pub(super) fn role_counterpart(name: &str) -> Option<Counterpart> {
    let meant = MEANT.iter().find(|(theirs, _)| theirs.eq_ignore_ascii_case(name));
    meant.map(|(_, ours)| Counterpart::Name((*ours).to_owned()))
}

/// The equivalent of an unknown type.
pub(super) fn type_counterpart(name: &str) -> Option<Counterpart> {
    if ["auto", "decltype", "let", "val", "var"].contains(&name) {
        return Some(Counterpart::Advice(
            "a declaration names the type of its value: `float x = 1.0;`, `vec3 p = rt_HitPoint;`",
        ));
    }
    if let Some(ours) = role_counterpart(name) {
        return Some(ours);
    }
    if ["string", "String", "char"].contains(&name) {
        return Some(Counterpart::Advice(
            "there is no type for text; an `int` or a `bool` can choose between variants",
        ));
    }
    if let Some((_, ours)) = RENAMED_TYPES.iter().find(|(theirs, _)| *theirs == name) {
        return Some(Counterpart::Name((*ours).to_owned()));
    }
    sized_type(name).filter(|ours| ours != name).map(Counterpart::Name)
}

/// The equivalent of a type name that ends in sizes: HLSL's `float3` and `half3x4`, C++'s `Vec3f`
/// and `Matrix4x4`.
fn sized_type(name: &str) -> Option<String> {
    let (stem, sizes) = name.split_at(name.find(|letter: char| letter.is_ascii_digit())?);
    let letter = sizes.trim_start_matches(|letter: char| letter.is_ascii_digit() || letter == 'x');
    let sizes = &sizes[..sizes.len() - letter.len()];
    let (first, second) = match sizes.split_once('x') {
        Some((first, second)) => (size(first)?, Some(size(second)?)),
        None => (size(sizes)?, None),
    };
    let stem = stem.to_ascii_lowercase();
    match (stem.as_str(), second, letter) {
        ("float" | "half" | "double" | "fixed" | "real", None, "") => {
            Some(vector("float", "vec", first))
        }
        ("int" | "short" | "long", None, "") => Some(vector("int", "ivec", first)),
        ("uint" | "ushort" | "ulong", None, "") => Some(vector("uint", "uvec", first)),
        ("bool", None, "") => Some(vector("bool", "bvec", first)),
        // HLSL gives the number of rows first.
        ("float" | "half" | "double" | "fixed" | "real", Some(columns), "") => {
            matrix(columns, first)
        }
        ("color", None, "" | "f") if first == 3 => Some("color".to_owned()),
        ("vec" | "vector" | "point" | "normal", None, "" | "f" | "d" | "h") => {
            (first > 1).then(|| format!("vec{first}"))
        }
        ("vec" | "vector" | "point", None, "i") => (first > 1).then(|| format!("ivec{first}")),
        ("vec" | "vector" | "point", None, "u") => (first > 1).then(|| format!("uvec{first}")),
        ("mat" | "matrix", None, "" | "f" | "d") => matrix(first, first),
        ("mat" | "matrix", Some(second), "" | "f" | "d") => matrix(first, second),
        _ => None,
    }
}

fn size(digits: &str) -> Option<u32> {
    digits.parse().ok().filter(|size| (1..=4).contains(size))
}

fn vector(scalar: &str, stem: &str, size: u32) -> String {
    if size == 1 { scalar.to_owned() } else { format!("{stem}{size}") }
}

fn matrix(columns: u32, rows: u32) -> Option<String> {
    (columns > 1 && rows > 1).then(|| {
        if columns == rows { format!("mat{columns}") } else { format!("mat{columns}x{rows}") }
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::check::types::builtin_type;

    #[test]
    fn names_in_the_tables_are_those_of_the_language() {
        for (theirs, ours) in RENAMED_FUNCTIONS {
            assert!(builtins::find(theirs).is_none(), "{theirs}");
            assert!(builtins::find(ours).is_some(), "{ours}");
        }
        for (theirs, _) in REPLACED_FUNCTIONS {
            assert!(builtins::find(theirs).is_none(), "{theirs}");
        }
        for (theirs, ours) in MEANT {
            assert!(builtin_type(theirs).is_none() && builtin_type(ours).is_some(), "{theirs}");
        }
        for (theirs, ours) in RENAMED_TYPES {
            assert!(builtin_type(theirs).is_none() && builtin_type(ours).is_some(), "{theirs}");
        }
    }

    #[test]
    fn sizes_follow_the_name() {
        for (theirs, ours) in [
            ("float3", "vec3"),
            ("half4", "vec4"),
            ("half1", "float"),
            ("int2", "ivec2"),
            ("uint4", "uvec4"),
            ("bool3", "bvec3"),
            ("float4x4", "mat4"),
            ("float3x4", "mat4x3"),
            ("half2x2", "mat2"),
            ("Vec3f", "vec3"),
            ("Vector3", "vec3"),
            ("Point2i", "ivec2"),
            ("vec3u", "uvec3"),
            ("Color3f", "color"),
            ("Matrix4x4", "mat4"),
            ("mat4x3f", "mat4x3"),
        ] {
            assert_eq!(
                type_counterpart(theirs),
                Some(Counterpart::Name(ours.to_owned())),
                "{theirs}"
            );
            assert!(builtin_type(ours).is_some(), "{ours}");
        }
        for other in
            ["float5", "float0", "floatx", "int3x3", "Cell2", "vec1", "mat5", "float3x", "é3"]
        {
            assert_eq!(type_counterpart(other), None, "{other}");
        }
    }

    #[test]
    fn functions_of_c_lose_their_letter() {
        for (theirs, ours) in [
            ("sqrtf", "sqrt"),
            ("fminf", "min"),
            ("atan2f", "atan"),
            ("powf", "pow"),
            ("rsqrtf", "inversesqrt"),
            ("make_float3", "vec3"),
        ] {
            assert_eq!(counterpart(theirs), Some(Counterpart::Name(ours.to_owned())), "{theirs}");
        }
        for other in ["f", "off", "fminff", "elif"] {
            assert_eq!(counterpart(other), None, "{other}");
        }
    }
}
