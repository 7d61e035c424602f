; Written by `npm run words` in editors/tree-sitter-rtsl from its queries/highlights.scm. Do not edit.

; Where several patterns match a node, the last one counts.
; The lists between `; words:` and `; end` are written by `npm run words`.

; Names

(identifier) @variable

((identifier) @constant
  (#match? @constant "^[A-Z][A-Z0-9_]+$"))

((identifier) @variable.builtin
  (#match? @variable.builtin "^rt_"))

((identifier) @constant.builtin
  ; words: rayTypes
  (#any-of? @constant.builtin "rt_CAMERA_RAY" "rt_SCATTERED_RAY" "rt_TRACED_RAY")
  ; end
)

((identifier) @variable.builtin
  (#eq? @variable.builtin "super"))

(field_identifier) @variable.other.member

(field_declarator
  name: (identifier) @variable.other.member)

(class_body
  (declaration
    declarator: (declarator
      name: (identifier) @variable.other.member)))

(parameter
  name: (identifier) @variable.parameter)

(enumerator
  name: (identifier) @constant)

(module_path
  (identifier) @namespace)

(import_declaration
  alias: (identifier) @namespace)

(qualified_type
  module: (identifier) @namespace)

; Types

(primitive_type) @type.builtin

(type_identifier) @type

((type_identifier) @type.builtin
  (#match? @type.builtin "^gen[IUB]?Type$"))

((type_identifier) @type.builtin
  ; words: namedTypes roles
  (#any-of? @type.builtin "color" "rt_Surface" "rt_BSDFSample" "rt_LightSample" "rt_Camera" "rt_Primitive" "rt_Texture"
    "rt_Light" "rt_Material" "rt_Integrator")
  ; end
)

; Functions

(function_definition
  name: (identifier) @function)

(function_declaration
  name: (identifier) @function)

((function_definition
  name: (identifier) @function.method)
  ; words: methods
  (#any-of? @function.method "generateRay" "intersect" "computeBounds" "computeNormal" "computeTextureCoordinates"
    "computeDerivatives" "generateSample" "samplePDF" "lookup" "shade" "BSDF" "sampleBSDF" "evaluatePDF" "emission"
    "illumination" "radiance" "presence")
  ; end
)

(constructor_definition
  name: (identifier) @constructor)

(call_expression
  function: (identifier) @function)

((call_expression
  function: (identifier) @type)
  (#match? @type "^[A-Z][a-z]"))

((call_expression
  function: (identifier) @type.builtin)
  ; words: namedTypes
  (#any-of? @type.builtin "color" "rt_Surface" "rt_BSDFSample" "rt_LightSample")
  ; end
)

((call_expression
  function: (identifier) @function.builtin)
  ; words: functions
  (#any-of? @function.builtin "abs" "acos" "acosh" "all" "ambient" "any" "asin" "asinh" "atan" "atanh" "bitCount"
    "bitfieldExtract" "bitfieldInsert" "bitfieldReverse" "ceil" "cellnoise" "clamp" "contribute" "cos" "cosh" "cross"
    "dFdx" "dFdy" "degrees" "determinant" "distance" "dominantAxis" "dot" "equal" "exp" "exp2" "faceforward" "fbm"
    "findLSB" "findMSB" "floatBitsToInt" "floatBitsToUint" "floor" "fma" "fract" "fresnelDielectric" "frexp" "fwidth"
    "ggxAlbedo" "ggxDensity" "gradient" "greaterThan" "greaterThanEqual" "hash" "hit" "imulExtended" "inside"
    "intBitsToFloat" "inverse" "inversesqrt" "isSet" "isTextured" "isinf" "isnan" "ldexp" "length" "lessThan"
    "lessThanEqual" "log" "log2" "luminance" "makeFrame" "matrixCompMult" "max" "min" "mix" "mod" "modf" "nearestHit"
    "noise" "normalToObject" "normalToWorld" "normalize" "not" "notEqual" "occluded" "outerProduct" "packHalf2x16"
    "packSnorm2x16" "packSnorm4x8" "packUnorm2x16" "packUnorm4x8" "perpendicularTo" "pointToObject" "pointToWorld"
    "pow" "powerHeuristic" "radians" "rand" "reflect" "refract" "regularized" "rgb" "round" "roundEven" "sample1D"
    "sample2D" "sampleConcentricDisk" "sampleCosineHemisphere" "sampleLight" "sampleUniformCone"
    "sampleUniformConeByHeight" "sampleUniformHemisphere" "sampleUniformSphere" "sampleUniformTriangle"
    "sampleVisibleNormal" "sign" "sin" "sinh" "skyCount" "skyEmission" "skyPDF" "smithLambda" "smoothstep" "sqrt"
    "step" "tan" "tanh" "toLocal" "toWorld" "trace" "transpose" "trunc" "turbulence" "uaddCarry" "uintBitsToFloat"
    "umulExtended" "uniformConePDF" "unpackHalf2x16" "unpackSnorm2x16" "unpackSnorm4x8" "unpackUnorm2x16"
    "unpackUnorm4x8" "usubBorrow" "vectorToObject" "vectorToWorld" "voronoi")
  ; end
)

(call_expression
  function: (member_expression
    member: (field_identifier) @function.method))

(macro_invocation
  name: (identifier) @function.macro)

(static_assertion
  "static_assert" @function.builtin)

(print_statement
  "print" @function.builtin)

; Annotations

(annotation_key) @attribute

(annotation_key
  (_) @attribute)

; Literals

(number) @constant.numeric.integer

((number) @constant.numeric.float
  (#match? @constant.numeric.float "^([0-9]*\\.|[0-9]+[eEfF])"))

(boolean) @constant.builtin.boolean

(string) @string

(escape_sequence) @constant.character.escape

; Comments

(comment) @comment

((comment) @comment.block.documentation
  (#match? @comment.block.documentation "^(///|/\\*\\*)"))

; Keywords

[
  "if"
  "else"
  "switch"
  "case"
  "default"
] @keyword.control.conditional

[
  "for"
  "while"
  "do"
  "break"
  "continue"
  "illuminance"
] @keyword.control.repeat

"return" @keyword.control.return

[
  "class"
  "struct"
  "enum"
] @keyword.storage.type

[
  "import"
  "as"
] @keyword.control.import

(import_declaration
  "import" @keyword.control.import)

[
  (qualifier)
  (precision_qualifier)
] @keyword.storage.modifier

"precision" @keyword

; Operators and punctuation

[
  "="
  "+="
  "-="
  "*="
  "/="
  "%="
  "<<="
  ">>="
  "&="
  "^="
  "|="
  "||"
  "^^"
  "&&"
  "|"
  "^"
  "&"
  "=="
  "!="
  "<"
  ">"
  "<="
  ">="
  "<<"
  ">>"
  "+"
  "-"
  "*"
  "/"
  "%"
  "!"
  "~"
  "++"
  "--"
] @operator

[
  ","
  ";"
  "."
  ":"
] @punctuation.delimiter

[
  "("
  ")"
  "["
  "]"
  "{"
  "}"
] @punctuation.bracket

(annotation_list
  [
    "["
    "]"
  ] @punctuation.special)

(conditional_expression
  [
    "?"
    ":"
  ] @keyword.control.conditional)

; The preprocessor

[
  "#"
  "include"
  "undef"
  "ifdef"
  "ifndef"
  "elif"
  "endif"
  "defined"
  (directive)
] @keyword.directive

(preproc_if
  "if" @keyword.directive)

(preproc_else
  "else" @keyword.directive)

(preproc_define
  [
    "#"
    "define"
  ] @keyword.directive)

(preproc_define
  name: (identifier) @constant)

(preproc_define
  name: (identifier) @function.macro
  parameters: (_))

(preproc_parameters
  (identifier) @variable.parameter)

(preproc_undef
  name: (identifier) @constant)

(preproc_ifdef
  name: (identifier) @constant)

(preproc_defined
  (identifier) @constant)

(preproc_directive
  argument: (preproc_text) @string.special)

(preproc_skipped) @comment
