//! The list of diagnostics: one line each here, and one page each in `explain/`.
//!
//! A page explains the code and shows a text that causes it and a corrected text; tests compile
//! both. Codes are never reused. `E` is an error, `W` a warning. The hundreds group them: 00
//! preprocessor and lexer, 01 grammar, 02 names and types, 03 classes, roles and state, 04
//! constants, limits and lowering, 05 linking and parameters, 06 scenes and files, 07 code
//! generation and machines.

use crate::Severity;

/// The stable code of a diagnostic, such as `E0201`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct Code(pub(crate) &'static str);

impl Code {
    /// The code as text.
    pub fn as_str(self) -> &'static str {
        self.0
    }

    /// The severity that the code's letter gives: error for `E`, warning for `W`.
    pub fn severity(self) -> Severity {
        if self.0.starts_with('W') { Severity::Warning } else { Severity::Error }
    }
}

impl std::fmt::Display for Code {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(self.0)
    }
}

/// The entry of one code in the list of diagnostics.
#[derive(Clone, Copy, Debug)]
pub struct CodeInfo {
    /// The code.
    pub code: Code,
    /// A short title.
    pub title: &'static str,
    /// The page in Markdown that `rtsl explain` prints.
    pub explanation: &'static str,
}

/// Every code, in order.
pub fn codes() -> &'static [CodeInfo] {
    CODES
}

/// Returns the entry of a code given as text, in upper or lower case.
pub fn code_info(code: &str) -> Option<&'static CodeInfo> {
    CODES.iter().find(|info| info.code.0.eq_ignore_ascii_case(code))
}

macro_rules! diagnostics {
    ($($code:ident $name:ident $title:literal;)*) => {
        pub(crate) mod names {
            use super::Code;
            $(#[doc = $title] pub const $name: Code = Code(stringify!($code));)*
        }
        const CODES: &[CodeInfo] = &[$(CodeInfo {
            code: names::$name,
            title: $title,
            explanation: include_str!(concat!("explain/", stringify!($code), ".md")),
        },)*];
    };
}

diagnostics! {
    E0001 UNEXPECTED_CHARACTER "a character that no token begins with";
    E0002 NON_ASCII_CHARACTER "a character outside ASCII";
    E0003 UNTERMINATED_COMMENT "a comment that never ends";
    E0004 UNTERMINATED_TEXT "text without its closing quotation mark";
    E0005 INVALID_NUMBER "a number that is malformed";
    E0006 NUMBER_RANGE "a number too large for its type";
    E0007 NAME_TOO_LONG "a name of more than 1024 characters";
    E0008 UNKNOWN_ESCAPE "an unknown escape in text";
    E0010 UNKNOWN_PREPROCESSING_DIRECTIVE "a line that begins with an unknown directive";
    E0011 MALFORMED_DIRECTIVE "a malformed directive";
    E0012 UNBALANCED_CONDITIONAL "`#if` and `#endif` that do not pair";
    E0013 INVALID_CONDITION "a condition that the preprocessor cannot evaluate";
    E0014 ERROR_DIRECTIVE "an `#error` in the text";
    E0015 MACRO_REDEFINED "a macro defined again with another meaning";
    E0016 RESERVED_MACRO_NAME "a macro's name that belongs to the language";
    E0017 MACRO_ARGUMENTS "a macro's call with the wrong arguments";
    E0018 INVALID_PASTE "a `##` whose result is not a token";
    E0019 EXPANSION_LIMIT "macros or includes beyond a limit";
    E0020 INCLUDE_NOT_FOUND "an included file that cannot be found or read";
    E0021 RECURSIVE_INCLUDE "a file that includes itself";
    E0022 INCLUDE_ESCAPES "an include that leads out of the search path";
    E0026 TEXT_AFTER_DIRECTIVE "text after a directive";
    E0027 MODULE_NOT_FOUND "an imported module that cannot be found or read";
    E0028 CIRCULAR_IMPORT "modules that import one another in a circle";
    E0029 MISPLACED_IMPORT "an import inside a class";
    E0101 UNEXPECTED_TOKEN "a token that the grammar does not allow here";
    E0102 UNCLOSED_DELIMITER "brackets that do not pair";
    E0103 RESERVED_WORD "a word of GLSL that RTSL does not use";
    E0104 NESTED_TOO_DEEPLY "text nested too deeply";
    E0105 DUPLICATE_QUALIFIER "a qualifier given twice";
    E0106 MISPLACED_TEXT "double-quoted text in the wrong place";
    E0107 MISPLACED_LABEL "a `case` or `default` in the wrong place";
    E0108 UNSUPPORTED_DECLARATION "a declaration of GLSL that RTSL does not have";
    E0109 KEYWORD_AS_NAME "a keyword where a name is declared";
    E0110 NESTED_CLASS "a class inside a class";
    E0111 LABEL_WITHOUT_STATEMENT "a `case` or `default` with no statement after it";
    E0201 UNKNOWN_NAME "an undeclared name";
    E0202 UNKNOWN_TYPE "an unknown type";
    E0203 DECLARED_TWICE "a name declared twice in one scope";
    E0204 MISMATCHED_TYPES "a value of the wrong type";
    E0205 BAD_OPERANDS "an operator on types that it does not take";
    E0206 UNKNOWN_FIELD "a part or method that a type does not have";
    E0207 BAD_SWIZZLE "a swizzle that the vector does not have";
    E0208 COLOR_COMPONENTS "a component of a color";
    E0209 NOT_INDEXABLE "an index on something without elements";
    E0210 NOT_ASSIGNABLE "an assignment to something other than a variable";
    E0211 NO_MATCHING_FUNCTION "a call with arguments that no function takes";
    E0212 AMBIGUOUS_CALL "a call that could mean several functions";
    E0213 NOT_A_FUNCTION "a call of something that is not a function";
    E0214 BAD_CONSTRUCTOR_ARGUMENTS "a constructor of a type with arguments that do not make one";
    E0215 BAD_INITIALIZER "an initial value that does not fit what it initializes";
    E0216 RECURSION "a function that calls itself";
    E0217 BAD_RETURN "a `return` that does not fit the function";
    E0218 NO_RETURN "a function that never returns its value";
    E0219 MISPLACED_JUMP "a misplaced `break` or `continue`";
    E0220 DUPLICATE_LABEL "a label that a switch has twice";
    E0221 MISSING_BODY "a function declared and never defined";
    E0222 BAD_QUALIFIER "a qualifier that is not allowed here";
    E0223 VOID_VALUE "`void` where a value is needed";
    E0224 NOT_A_VALUE "a type, class or function where a value is needed";
    E0225 RESERVED_NAME "a name that shaders cannot declare";
    E0226 FILE_VARIABLE "a variable at file scope";
    E0227 MISPLACED_BUFFER "an array without a size where none can be";
    E0228 BUFFER_AS_VALUE "a buffer used as a whole";
    E0229 REFERENCE_AS_VALUE "a reference used as a value";
    E0230 NESTED_FUNCTION "a function inside a function";
    E0231 MISPLACED_ANNOTATION "an annotation on something that no host sets";
    E0232 MISPLACED_DEFAULT "a default value on a parameter that cannot have one";
    E0233 EMPTY_STRUCT "a struct without fields";
    E0234 CIRCULAR_DECLARATION "a constant or struct that depends on itself";
    E0235 BAD_ENUMERATION "an enumeration without choices, or with some that hosts could not tell apart";
    E0236 STATIC_ASSERTION "a static assertion that does not hold";
    E0237 BAD_GENERIC "a generic type that no argument determines";
    E0238 BAD_PRINT "a text to print that does not fit its values";
    E0239 NOT_PRINTABLE "a value that cannot be printed";
    E0240 FOREIGN_SYNTAX "a form of another language";
    E0301 UNKNOWN_BASE "a base that is not a class";
    E0302 BAD_BASES "bases that do not go together";
    E0303 METHOD_OF_OTHER_ROLE "a method of a role that the class does not have";
    E0304 BAD_METHOD_SIGNATURE "an interface method with parameters or a result";
    E0305 STATE_OF_OTHER_ROLE "a state variable of a role that the class does not have";
    E0306 STATE_READ_ONLY "a write to a state variable that the host sets";
    E0307 STATE_OUT_OF_PLACE "a state variable outside of methods";
    E0308 LIGHT_SAMPLE_READ_ONLY "a write to the light sample inside `illuminance`";
    E0309 OUT_OF_PLACE "a feature that only some methods may use";
    E0310 BAD_CONSTRUCTOR "a constructor that hosts cannot call";
    E0311 BUFFER_READ_ONLY "a write to a buffer";
    E0312 REFERENCE_ASSIGNED "an assignment to a reference";
    E0313 SCRATCH_IN_CONSTRUCTOR "a scratch member in the constructor";
    E0314 INITIALIZER_READS "an initial value that depends on other members";
    E0315 ILLUMINANCE_ARGUMENTS "an `illuminance` with the wrong number of arguments";
    E0316 ANNOTATION_VALUE "an annotation with a value of the wrong kind";
    E0317 PRIVATE_REFERENCE "a reference that no host can set";
    E0318 BAD_ELEMENT "an invalid element parameter";
    E0319 TEXTURED_TYPE "a parameter that may be a texture, of a type that textures do not give";
    E0320 STATE_ARGUMENT "an argument that the called method does not receive";
    E0328 ATTRIBUTE_TYPE "an attribute of a type that meshes do not interpolate";
    E0329 ATTRIBUTE_OUT_OF_PLACE "an attribute where there is no object";
    E0330 NO_INHERITED "a call of an inherited function that the class does not have";
    E0331 GRADIENT_VARIABLE "a derivative with respect to something that is no variable";
    E0401 NOT_CONSTANT "a value that must be known when the shader is compiled";
    E0402 INDEX_OUT_OF_RANGE "a constant index outside of its array";
    E0403 BAD_ARRAY_SIZE "an array of no elements";
    E0404 TYPE_TOO_LARGE "a type beyond the limits";
    E0405 CONSTANT_TOO_LONG "a constant that takes too long to compute";
    E0406 TOO_MUCH_INHERITED "classes that inherit too much";
    E0407 TOO_MANY_OVERLOADS "too many functions of one name";
    E0451 TOO_MUCH_CODE "a method that becomes too large";
    E0452 CALLS_TOO_DEEP "statements, expressions or calls nested too deeply";
    E0453 TOO_MUCH_DATA "variables or members that are too large";
    E0501 MISSING_PARAMETER "a required parameter that is not set";
    E0502 NO_SUCH_PARAMETER "a parameter that the class does not have";
    E0503 PARAMETER_TYPE "a value of another type than its parameter";
    E0504 PARAMETER_RANGE "a value without a meaning for its parameter";
    E0505 REFERENCE_CYCLE "instances that refer to one another in a circle";
    E0506 REFERENCE_ROLE "a reference to an instance of another role";
    E0507 NO_SUCH_CLASS "a class that the text does not have";
    E0508 NO_SUCH_METHOD "a method that the class does not have";
    E0509 LINK_LIMIT "instances that refer to too many others";
    E0510 TOO_MUCH_STACK "a method that needs too much stack";
    E0511 TOO_MUCH_MACHINE_CODE "a method that is too large for machine code";
    E0512 TOO_MANY_ATTRIBUTES "objects with too many attributes";
    E0601 UNREADABLE_FILE "a file that cannot be read";
    E0602 SCENE_SYNTAX "a scene text that does not follow the format";
    E0603 BAD_NUMBER "an invalid number in a scene";
    E0604 UNKNOWN_DIRECTIVE "a directive that the scene format does not have";
    E0605 INCLUDE_CYCLE "files that include one another without end";
    E0606 BAD_DECLARATION "a parameter that is not declared by a type and a name";
    E0607 WRONG_VALUE "a value that its parameter cannot take";
    E0608 UNKNOWN_PARAMETER "a parameter that the class or setting does not have";
    E0609 UNKNOWN_CLASS "a type name that is not a class";
    E0610 UNKNOWN_SCENE_NAME "a name that nothing in the scene has";
    E0611 DUPLICATE_NAME "something that is given twice";
    E0612 MISPLACED_DIRECTIVE "a directive in the wrong place";
    E0613 BAD_TRANSFORM "an invalid transform";
    E0614 UNSUPPORTED_DIRECTIVE "a directive that is not supported";
    E0615 SCENE_LIMIT "a scene beyond a limit";
    E0616 WRONG_ROLE "a class without the role that is needed";
    E0618 BAD_DEFINE "a definition of the command line that matches nothing";
    E0619 BUDGET_EXHAUSTED "a shader that ran past its budget of loop iterations";
    E0620 BAD_MESH "a mesh that cannot be used";
    E0621 BAD_CHECKPOINT "a checkpoint that cannot be resumed";
    E0622 FOREIGN_CHECKPOINT "a checkpoint of another render";
    E0623 UNWRITABLE_FILE "a file that cannot be written";
    E0624 NO_SUCH_IMAGE "an image that neither the integrator nor the renderer makes";
    E0625 NOT_CONVERTIBLE "a conversion that would replace a file of its scene";
    E0626 NOT_IMPORTABLE "a program that cannot be imported";
    E0627 NO_SUCH_PIXEL "a pixel or sample that the picture does not have";
    E0628 UNFORMATTABLE "a text that cannot be formatted";
    E0630 MATERIALX_SYNTAX "a MaterialX document that does not follow the format";
    E0631 MATERIALX_UNKNOWN "a name in a MaterialX document that nothing has";
    E0632 MATERIALX_UNSUPPORTED "a part of a MaterialX document that is not supported";
    E0633 MATERIALX_LIMIT "a MaterialX document beyond a limit";
    E0640 OCCUPIED_CHECKPOINT "a checkpoint path that holds another file";
    E0641 OUT_OF_MEMORY "a render that needs more memory than is available";
    E0642 INPUT_MEMORY "files of a scene that take too much memory";
    E0643 MANY_PATHS "more rays than are followed";
    E0650 WRONG_PROJECT_FILE "a project file with a wrong setting";
    E0701 NO_LLVM "machine code is requested, but LLVM cannot be loaded";
    E0702 CODE_GENERATION "LLVM could not make machine code";
    E0703 UNKNOWN_WIDTH "a packet width that is not supported";
    E0704 NO_DENOISER "a picture that cannot be denoised";
    E0705 FORKED "a process that was forked from one that was compiling";
    E0706 PROCESS_ENDING "a kernel that is requested while the process exits";
    E0707 ASKS_SCENE "a method that asks the scene, for a host without answers";
    E0708 SPLIT_LIMIT "an integrator that waits for the renderer at too many places";
    E0709 NO_CLUSTER "a render on a cluster without the packages for it";
    W0023 EXTENSION_IGNORED "an `#extension` without effect";
    W0024 UNKNOWN_PRAGMA "a `#pragma` without effect";
    W0241 UNINITIALIZED "a variable read before it has a value";
    W0242 UNUSED_VARIABLE "a variable that is never used";
    W0243 MISSING_RETURN "a function that returns a value only on some paths";
    W0244 UNREACHABLE "statements that are never reached";
    W0245 NO_EFFECT "a statement without effect";
    W0246 NOT_A_NUMBER "a constant that is not a number";
    W0331 INSTANCE_WRITE "a write to a member of the instance that is lost";
    W0332 UNKNOWN_ANNOTATION "an annotation that hosts do not know";
    W0333 STATE_WITHOUT_VALUE "a state variable read where it has no value";
    W0334 MISSPELLED_METHOD "a function that looks like a misspelled interface method";
    W0335 LOST_STATE "a state variable that is written and lost";
    W0336 NEVER_HITS "a primitive that no ray can hit";
    W0337 NAMED_LIKE_CLASS "a function with the name of its class";
    W0338 ANGLE_IN_DEGREES "an angle that is more than a full turn";
    W0339 TEXTURED_IN_CONSTRUCTOR "a parameter that may be a texture, read by the constructor";
    W0340 IDLE_CLASS "a class without the method that its role is for";
    W0341 DEFAULT_OUT_OF_RANGE "a default outside of the range of its parameter";
    W0342 ENDLESS_LOOP "a loop that never ends";
    W0343 UNREAD_MEMBER "a parameter or member that nothing reads";
    W0344 INTEGER_QUOTIENT "a rounded quotient of integers where a number was meant";
    W0345 NO_EXTENT "bounds whose corners are exchanged";
    W0346 NO_CHANGE "a change over the filter that is always 0";
    W0347 OUTPUT_ELSEWHERE "an output of a class that is no integrator";
    W0348 UNCALLED_FUNCTION "a function that sets something and is never called";
    W0501 UNSET_REFERENCE "a reference that is used and not set";
    W0502 OUTSIDE_RANGE "a value outside the range of its parameter";
    W0503 NO_LIGHT "an image of a light with numbers that are no light";
    W0504 UNREACHABLE_EMISSION "the `emission` of a light at a finite distance";
    W0510 BLACK_PICTURE "a picture that is black for want of light or material";
    W0601 IGNORED_SETTING "a setting that has no effect here";
    W0602 UNFINISHED_PICTURE "a picture with fewer samples than it should have";
    W0603 SHADE_ONLY "a material that the batch renderer can only shade";
    W0604 OLD_SCENE "a scene in the format of an earlier version of pbrt";
    W0605 MATERIALX_IGNORED "a part of a MaterialX document without effect";
    W0606 MENDED_FAULT "a fault of a file that is read nevertheless";
    W0630 DROPPED_SAMPLES "samples that are not finite";
    W0631 NOT_FINITE "a value that is not finite, of a traced method";
    W0632 OUTSIDE_FOLDER "a project file or a shader that leaves its folder";
    W0640 NO_CHECKPOINT "a checkpoint that could not be written";
    W0650 MISSING_FOLDER "a folder of the search path that does not exist";
    W0701 INTERPRETER_INSTEAD "LLVM cannot be loaded, so the interpreter runs everything";
}
