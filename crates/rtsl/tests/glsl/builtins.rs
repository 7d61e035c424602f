//! The variables of GLSL's stages, which RTSL replaces by the state variables of roles. The runner declares those that
//! a shader names, by other names, since names that begin with `gl_` cannot be declared.

use crate::case::Version;
use crate::items::{Storage, Variable};

/// A variable of a stage.
struct Builtin {
    name: &'static str,
    ty: &'static str,
    sizes: &'static str,
    stages: &'static str,
    storage: Storage,
    /// True for those of the fixed-function pipeline, which later versions lack.
    is_old: bool,
}

const fn new(
    name: &'static str,
    ty: &'static str,
    stages: &'static str,
    storage: Storage,
) -> Builtin {
    Builtin { name, ty, sizes: "", stages, storage, is_old: false }
}

const fn old(
    name: &'static str,
    ty: &'static str,
    stages: &'static str,
    storage: Storage,
) -> Builtin {
    Builtin { name, ty, sizes: "", stages, storage, is_old: true }
}

const fn sized(builtin: Builtin, sizes: &'static str) -> Builtin {
    Builtin { sizes, ..builtin }
}

/// `v` and `f` are the stages.
const BUILTINS: &[Builtin] = &[
    new("gl_Position", "vec4", "v", Storage::Out),
    new("gl_PointSize", "float", "v", Storage::Out),
    sized(new("gl_ClipDistance", "float", "v", Storage::Out), "[8]"),
    old("gl_ClipVertex", "vec4", "v", Storage::Out),
    old("gl_FrontColor", "vec4", "v", Storage::Out),
    old("gl_BackColor", "vec4", "v", Storage::Out),
    old("gl_FrontSecondaryColor", "vec4", "v", Storage::Out),
    old("gl_BackSecondaryColor", "vec4", "v", Storage::Out),
    sized(old("gl_TexCoord", "vec4", "v", Storage::Out), "[8]"),
    old("gl_FogFragCoord", "float", "v", Storage::Out),
    new("gl_VertexID", "int", "v", Storage::In),
    new("gl_InstanceID", "int", "v", Storage::In),
    old("gl_Vertex", "vec4", "v", Storage::In),
    old("gl_Normal", "vec3", "v", Storage::In),
    old("gl_Color", "vec4", "vf", Storage::In),
    old("gl_SecondaryColor", "vec4", "vf", Storage::In),
    old("gl_MultiTexCoord0", "vec4", "v", Storage::In),
    old("gl_MultiTexCoord1", "vec4", "v", Storage::In),
    old("gl_FogCoord", "float", "v", Storage::In),
    old("gl_ModelViewMatrix", "mat4", "vf", Storage::In),
    old("gl_ProjectionMatrix", "mat4", "vf", Storage::In),
    old("gl_ModelViewProjectionMatrix", "mat4", "vf", Storage::In),
    old("gl_NormalMatrix", "mat3", "vf", Storage::In),
    new("gl_FragColor", "vec4", "f", Storage::Out),
    sized(new("gl_FragData", "vec4", "f", Storage::Out), "[8]"),
    new("gl_FragDepth", "float", "f", Storage::Out),
    new("gl_FragCoord", "vec4", "f", Storage::In),
    new("gl_FrontFacing", "bool", "f", Storage::In),
    new("gl_PointCoord", "vec2", "f", Storage::In),
    new("gl_PrimitiveID", "int", "f", Storage::In),
    sized(old("gl_TexCoord", "vec4", "f", Storage::In), "[8]"),
    old("gl_FogFragCoord", "float", "f", Storage::In),
];

/// The variables that fragment shaders receive from vertex shaders.
const PASSED: &[&str] =
    &["gl_Color", "gl_SecondaryColor", "gl_TexCoord", "gl_FogFragCoord", "gl_FragCoord"];

/// The least values of the limits that GLSL 4.60 gives by name.
const LIMITS: &[(&str, i32)] = &[
    ("gl_MaxVertexAttribs", 16),
    ("gl_MaxVertexUniformComponents", 1024),
    ("gl_MaxVertexUniformVectors", 256),
    ("gl_MaxVaryingVectors", 15),
    ("gl_MaxVaryingComponents", 60),
    ("gl_MaxVaryingFloats", 60),
    ("gl_MaxVertexOutputVectors", 16),
    ("gl_MaxFragmentInputVectors", 15),
    ("gl_MaxVertexTextureImageUnits", 16),
    ("gl_MaxCombinedTextureImageUnits", 80),
    ("gl_MaxTextureImageUnits", 16),
    ("gl_MaxFragmentUniformComponents", 1024),
    ("gl_MaxFragmentUniformVectors", 256),
    ("gl_MaxDrawBuffers", 8),
    ("gl_MaxClipDistances", 8),
    ("gl_MaxClipPlanes", 8),
    ("gl_MaxTextureUnits", 2),
    ("gl_MaxTextureCoords", 8),
    ("gl_MinProgramTexelOffset", -8),
    ("gl_MaxProgramTexelOffset", 7),
];

/// The name under which the runner declares a variable.
pub fn renamed(name: &str) -> String {
    name.replacen("gl_", "builtin_", 1)
}

/// The variable of this name in a stage: `v`, `f`, or `vf` for a text that is for both.
pub fn variable(name: &str, stages: &str, version: Version, has_old: bool) -> Option<Variable> {
    let has_old = has_old || (!version.es && version.number < 140);
    let is_found = |it: &&Builtin| {
        it.name == name
            && it.stages.contains(|stage| stages.contains(stage))
            && (has_old || !it.is_old)
    };
    let builtin = BUILTINS.iter().find(is_found)?;
    Some(Variable {
        name: renamed(name),
        ty: builtin.ty.to_owned(),
        sizes: builtin.sizes.to_owned(),
        initial: None,
        storage: builtin.storage,
        // What a vertex shader passes on has another value at each place.
        is_uniform: builtin.storage == Storage::In && !(stages == "f" && PASSED.contains(&name)),
    })
}

/// The value of a limit.
pub fn limit(name: &str) -> Option<i32> {
    LIMITS.iter().find(|(limit, _)| *limit == name).map(|(_, value)| *value)
}
