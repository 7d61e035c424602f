//! The rules by which cases are left out. Each is a difference from GLSL that the manual names, or a part of OpenGL
//! that no shading language has by itself; only one of them names cases.

use crate::builtins;
use crate::case::{Case, Expect, Shader, Stage, Step};
use crate::items::{Item, ItemKind, Storage, items};
use crate::run::Problem;
use crate::tokens::{Kind, Token, tokens};

/// A rule: its name in the report, and what it is about.
pub type Rule = &'static str;

pub const STAGES: Rule = "geometry, tessellation and compute stages";
pub const LINKING: Rule = "linking of stages and of several texts for one";
pub const PIPELINE: Rule = "state, textures, buffers and other steps of a drawing";
pub const RASTERISATION: Rule = "pixels that differ within a rectangle";
pub const EXTENSIONS: Rule = "extensions";
pub const SAMPLERS: Rule = "samplers and images";
pub const BLOCKS: Rule = "interface blocks";
pub const LAYOUT: Rule = "layout qualifiers";
pub const DOUBLE: Rule = "double and 64-bit integers";
pub const DISCARD: Rule = "discard";
pub const SHARED: Rule = "subroutines, shared variables, memory qualifiers";
pub const BUILTINS: Rule = "gl_ variables that the runner does not declare";
pub const REDECLARED: Rule = "qualifiers on names declared before, gl_ variables declared again";
pub const MACROS: Rule = "values of GL_ES, __VERSION__ and other predefined macros";
pub const FUNCTIONS: Rule = "noise1 to noise4, ftransform, interpolateAt functions";
pub const UNSIZED: Rule = "arrays that a later declaration or index sizes";
pub const EARLIER: Rule = "what an earlier version or GLSL ES refuses and GLSL 4.60 accepts";
pub const LATER: Rule = "what an earlier version or GLSL ES accepts and GLSL 4.60 refuses";
pub const LIMITS: Rule = "limits of names, code and data";
pub const PROTOTYPES: Rule = "prototypes without a definition, or in a function";
pub const NAMES: Rule = "names with two underscores in a row";
pub const UNDEFINED_NAMES: Rule = "undefined names in conditions of the preprocessor";
pub const UNDEFINED: Rule = "results that GLSL leaves undefined";
pub const INPUTS: Rule = "assignments to inputs: members can be assigned";
pub const INTERFACE: Rule = "types and qualifiers of variables between stages";
pub const ORDER: Rule = "members used before their declaration";
pub const MAIN: Rule = "the type of main: it is an ordinary name";
pub const DIRECTIVES: Rule = "#version, #extension and #pragma without effect";

/// Extensions whose features GLSL 4.60 has, and RTSL with it.
const CORE: &[&str] = &[
    "GL_ARB_shading_language_420pack",
    "GL_ARB_arrays_of_arrays",
    "GL_ARB_shader_bit_encoding",
    "GL_ARB_shading_language_packing",
    "GL_ARB_gpu_shader5",
    "GL_ARB_shader_precision",
    "GL_ARB_ES3_compatibility",
    "GL_ARB_explicit_attrib_location",
    "GL_ARB_uniform_buffer_object",
    "GL_EXT_shader_implicit_conversions",
];

/// Cases of one implementation's answer to what the specification leaves open.
const OPEN: &[&str] = &[
    // `min` and `max` of a number that is none. RTSL computes GLSL's formulas.
    "nan-builtin-max.shader_test",
    "nan-builtin-min.shader_test",
    "range_analysis_fmax_of_nan.shader_test",
    "range_analysis_fmin_of_nan.shader_test",
    // `normalize` of a zero vector. The case says that its expectation is one vendor's.
    "glsl-const-builtin-normalize.shader_test",
    // Subnormal results, which may become 0. RTSL keeps them.
    "ldexp.shader_test",
    "fs-underflow-fma-compare-zero.shader_test",
    "fs-underflow-mul-compare-zero.shader_test",
];

/// A text of a case, read once for all rules.
struct Text<'a> {
    stage: Stage,
    tokens: Vec<Token<'a>>,
    /// Without space and comments.
    significant: Vec<Token<'a>>,
}

impl<'a> Text<'a> {
    fn new(shader: &'a Shader) -> Text<'a> {
        let tokens = tokens(&shader.text);
        let significant = tokens.iter().filter(|it| it.kind != Kind::Space).copied().collect();
        Text { stage: shader.stage, tokens, significant }
    }

    fn items(&self) -> Vec<Item> {
        items(&self.tokens, self.stage == Stage::Vertex)
    }

    /// The text of a token after the one at `at`; empty past the end.
    fn after(&self, at: usize, distance: usize) -> &'a str {
        self.significant.get(at + distance).map_or("", |it| it.text)
    }

    /// True if a word is used, and not only declared as a name, as cases about reserved words do.
    fn uses(&self, is_meant: impl Fn(&str) -> bool) -> bool {
        self.uses_at(|_, word| is_meant(word))
    }

    fn uses_at(&self, is_meant: impl Fn(usize, &str) -> bool) -> bool {
        let words = self.significant.iter().enumerate().filter(|(_, it)| it.kind == Kind::Word);
        let mut meant = words.filter(|(at, token)| is_meant(*at, token.text));
        meant.any(|(at, _)| at == 0 || !is_type(self.significant[at - 1].text))
    }

    fn directives(&self) -> impl Iterator<Item = &'a str> {
        self.significant.iter().filter(|it| it.kind == Kind::Directive).map(|it| it.text)
    }
}

fn is_type(word: &str) -> bool {
    const TYPES: [&str; 6] = ["float", "int", "uint", "bool", "void", "struct"];
    TYPES.contains(&word) || crate::case::shape_of(word).is_some()
}

/// The rule of a case that its text tells.
pub fn before(case: &Case) -> Option<Rule> {
    if case.shaders.iter().any(|it| it.stage == Stage::Other) || case.shaders.is_empty() {
        return Some(STAGES);
    }
    let count = |stage| case.shaders.iter().filter(|it| it.stage == stage).count();
    if case.expect == Expect::LinkRefused || count(Stage::Vertex) > 1 || count(Stage::Fragment) > 1
    {
        return Some(LINKING);
    }
    if case.steps.iter().any(|it| matches!(it, Step::Unknown(_))) {
        return Some(PIPELINE);
    }
    let is_core = |it: &str| CORE.contains(&it.trim_start_matches('!'));
    if case.extensions.iter().any(|it| !it.split('|').any(is_core)) {
        return Some(EXTENSIONS);
    }
    if OPEN.iter().any(|it| case.path.ends_with(it)) {
        return Some(UNDEFINED);
    }
    let texts: Vec<Text<'_>> = case.shaders.iter().map(Text::new).collect();
    if shares_initial_value(&texts) {
        return Some(LINKING);
    }
    texts.iter().find_map(|text| of_text(text, case))
}

/// True if a uniform has its initial value in the text of another stage.
fn shares_initial_value(texts: &[Text<'_>]) -> bool {
    let items: Vec<Item> = texts.iter().flat_map(Text::items).collect();
    let variables = || {
        let lists = items.iter().filter_map(|it| match &it.kind {
            ItemKind::Variables(variables) => Some(variables),
            _ => None,
        });
        lists.flatten().filter(|it| it.is_uniform)
    };
    variables().any(|a| {
        variables().any(|b| a.name == b.name && a.initial.is_some() != b.initial.is_some())
    })
}

/// Tells whether a rule applies to a text of a case.
type Applies = fn(&Text<'_>, &Case) -> bool;

/// The rule of a text. Those of the second half concern texts that GLSL accepts: a text may be refused for the same
/// reason in both languages.
fn of_text(text: &Text<'_>, case: &Case) -> Option<Rule> {
    let is_refused = case.expect == Expect::Refused;
    let rules: [(Rule, bool, Applies); 12] = [
        (EXTENSIONS, false, names_extension),
        (SAMPLERS, false, |text, _| text.uses(is_sampler)),
        (BLOCKS, false, |text, _| has_block(text)),
        (LAYOUT, false, |text, _| has_layout(text)),
        (DOUBLE, false, |text, _| has_double(text)),
        (SHARED, false, |text, _| text.uses(|it| MEMORY.contains(&it))),
        (DISCARD, true, |text, _| text.uses(|it| it == "discard")),
        (REDECLARED, true, |text, _| is_redeclared(text)),
        (BUILTINS, true, names_builtin),
        (MACROS, true, |text, _| names_macro(text)),
        (FUNCTIONS, true, |text, _| text.uses(|it| OTHER_FUNCTIONS.contains(&it))),
        (UNSIZED, true, |text, _| has_unsized_array(text)),
    ];
    let mut rules =
        rules.into_iter().filter(|(_, is_of_accepted, _)| !(*is_of_accepted && is_refused));
    rules.find(|(_, _, applies)| applies(text, case)).map(|(rule, ..)| rule)
}

const MEMORY: &[&str] = &[
    "subroutine",
    "shared",
    "buffer",
    "coherent",
    "volatile",
    "restrict",
    "readonly",
    "writeonly",
];

const OTHER_FUNCTIONS: &[&str] = &[
    "noise1",
    "noise2",
    "noise3",
    "noise4",
    "ftransform",
    "interpolateAtCentroid",
    "interpolateAtOffset",
    "interpolateAtSample",
];

/// True if the text asks for an extension whose features RTSL lacks.
fn names_extension(text: &Text<'_>, _: &Case) -> bool {
    let lacks = |directive: &str| {
        let mut words = directive[1..].split(|c: char| c.is_whitespace() || c == ':');
        words.next().map(str::trim) == Some("extension")
            && ["require", "enable"].iter().any(|it| directive.trim_end().ends_with(it))
            && directive.contains("GL_")
            && !CORE.iter().any(|it| directive.contains(it))
    };
    text.directives().any(lacks)
}

fn is_sampler(word: &str) -> bool {
    let base = word.trim_start_matches(['i', 'u']);
    // Of `image` the first letter is gone, too.
    let kind = base.strip_prefix("sampler").or_else(|| base.strip_prefix("mage"));
    word == "atomic_uint"
        || kind.is_some_and(|it| {
            it.starts_with(['1', '2', '3'])
                || ["Cube", "Buffer"].iter().any(|kind| it.starts_with(kind))
        })
}

/// True for `uniform Name {`.
fn has_block(text: &Text<'_>) -> bool {
    let storage = ["uniform", "in", "out", "buffer"];
    text.uses_at(|at, word| {
        storage.contains(&word)
            && text.significant.get(at + 1).is_some_and(|it| it.kind == Kind::Word)
            && text.after(at, 2) == "{"
    })
}

/// True for layouts other than the location of an input or output, which says nothing about values.
fn has_layout(text: &Text<'_>) -> bool {
    text.uses_at(|at, word| {
        let is_location = text.after(at, 2) == "location" && text.after(at, 5) == ")";
        let is_passed = ["in", "out", "flat", "smooth", "centroid"].contains(&text.after(at, 6));
        word == "layout" && !(is_location && is_passed)
    })
}

fn has_double(text: &Text<'_>) -> bool {
    let is_double = |word: &str| {
        word == "double"
            || ["dvec", "dmat", "int64_t", "uint64_t", "i64vec", "u64vec"]
                .iter()
                .any(|it| word.starts_with(it))
    };
    let mut numbers = text.significant.iter().filter(|it| it.kind == Kind::Number);
    text.uses(is_double) || numbers.any(|it| it.text.to_ascii_lowercase().ends_with("lf"))
}

/// True for `invariant name;`, and for declarations of `gl_` names.
fn is_redeclared(text: &Text<'_>) -> bool {
    let is_after_word = |at: usize| {
        let previous = at.checked_sub(1).map(|it| text.significant[it]);
        previous.is_some_and(|it| it.kind == Kind::Word && it.text != "return" && it.text != "else")
    };
    let mut words = text.significant.iter().enumerate();
    words.any(|(at, token)| {
        let is_qualified = ["invariant", "precise"].contains(&token.text)
            && [";", ","].contains(&text.after(at, 2));
        is_qualified
            || (token.kind == Kind::Word && token.text.starts_with("gl_") && is_after_word(at))
    })
}

fn names_builtin(text: &Text<'_>, case: &Case) -> bool {
    let stages = match text.stage {
        Stage::Vertex => "v",
        Stage::Both => "vf",
        Stage::Fragment | Stage::Other => "f",
    };
    let has_old = case.shaders.iter().any(|it| it.text.contains("compatibility"));
    let is_known = |word: &str| {
        builtins::variable(word, stages, case.version, has_old).is_some()
            || builtins::limit(word).is_some()
    };
    let mut words =
        text.significant.iter().filter(|it| it.kind == Kind::Word && it.text.starts_with("gl_"));
    words.any(|it| !is_known(it.text))
}

/// True if a macro that the language predefines with another value, or does not, is named.
fn names_macro(text: &Text<'_>) -> bool {
    let is_macro = |word: &str| word == "__VERSION__" || word.starts_with("GL_");
    let is_word = |c: char| c.is_ascii_alphanumeric() || c == '_';
    let names = |text: &str| text.split(|c| !is_word(c)).any(is_macro);
    let mut directives =
        text.directives().filter(|it| !it[1..].trim_start().starts_with("extension"));
    directives.any(names) || text.uses(is_macro)
}

/// True for `float a[];` and `float[] a;`.
fn has_unsized_array(text: &Text<'_>) -> bool {
    text.significant
        .windows(3)
        .any(|it| it[0].is("[") && it[1].is("]") && (it[2].is(";") || it[2].is(",")))
}

/// The rule of an error that the manual names and GLSL does not have.
pub fn refused(problem: &Problem) -> Option<Rule> {
    match problem.code {
        "E0007" | "E0404" | "E0405" | "E0451" | "E0452" | "E0453" => Some(LIMITS),
        "E0221" | "E0230" => Some(PROTOTYPES),
        "E0225" if problem.message.contains("__") => Some(NAMES),
        "E0227" => Some(UNSIZED),
        "E0013" if problem.message.contains("is not defined") => Some(UNDEFINED_NAMES),
        _ => None,
    }
}

/// The rule of a case that expects to be refused, and was for what RTSL lacks: that is no agreement.
pub fn lacking(errors: &[Problem]) -> Option<Rule> {
    let is_distance = |it: &Problem| it.code == "E0225" && it.message.contains("gl_ClipDistance");
    if errors.is_empty() {
        return None;
    }
    if errors.iter().all(|it| it.code == "E0227") {
        return Some(UNSIZED);
    }
    errors.iter().all(is_distance).then_some(REDECLARED)
}

/// The rule of a case that expects to be refused and was accepted, and which GLSL 4.60 refuses.
pub fn accepted(case: &Case) -> Option<Rule> {
    let texts: Vec<Text<'_>> = case.shaders.iter().map(Text::new).collect();
    if texts.iter().any(|text| assigns_input(text, case)) {
        return Some(INPUTS);
    }
    let rules: [(Rule, Applies); 7] = [
        (MACROS, |text, _| names_macro(text)),
        (UNSIZED, |text, _| text.uses(|it| ["gl_TexCoord", "gl_ClipDistance"].contains(&it))),
        (INTERFACE, |text, _| is_about_interface(text)),
        (ORDER, |text, _| has_early_use(text)),
        (MAIN, |text, _| has_other_main(text)),
        (LAYOUT, |text, _| text.uses(|it| it == "layout")),
        (DIRECTIVES, |text, _| has_ignored_directive(text)),
    ];
    let mut rules = rules.into_iter();
    let found = rules.find(|(_, applies)| texts.iter().any(|text| applies(text, case)));
    found.map(|(rule, _)| rule)
}

/// True for an `#extension` after other text, or one that requires what nobody has, and for `#line` with the name of a
/// file.
fn has_ignored_directive(text: &Text<'_>) -> bool {
    let mut is_late = false;
    text.significant.iter().any(|token| {
        let is_directive = token.kind == Kind::Directive;
        let word = if is_directive { token.text[1..].trim_start() } else { "" };
        let is_extension = word.starts_with("extension");
        let is_unknown =
            is_extension && word.contains("require") && !CORE.iter().any(|it| word.contains(it));
        let has_file = word.starts_with("line") && word.contains('"');
        is_late |= !is_directive;
        (is_extension && is_late) || is_unknown || has_file
    })
}

/// True if the text assigns a variable that another stage or the host sets, or a part of one.
fn assigns_input(text: &Text<'_>, case: &Case) -> bool {
    let items = text.items();
    let variables = items.iter().filter_map(|it| match &it.kind {
        ItemKind::Variables(variables) => Some(variables),
        _ => None,
    });
    let mut inputs: Vec<String> = variables
        .flatten()
        .filter(|it| it.storage == Storage::In)
        .map(|it| it.name.clone())
        .collect();
    let structs = items.iter().filter(|it| matches!(it.kind, ItemKind::StructVariables));
    inputs.extend(structs.filter_map(|it| {
        let tokens = &text.tokens[it.range.clone()];
        let is_input = tokens.iter().any(|it| ["uniform", "in", "varying"].contains(&it.text));
        let name = tokens.iter().rev().find(|it| it.kind == Kind::Word)?;
        is_input.then(|| name.text.to_owned())
    }));
    let stages = if text.stage == Stage::Vertex { "v" } else { "f" };
    let words = text.significant.iter().filter(|it| it.text.starts_with("gl_"));
    inputs.extend(words.filter_map(|it| {
        let variable = builtins::variable(it.text, stages, case.version, true)?;
        (variable.storage == Storage::In).then(|| it.text.to_owned())
    }));
    let passes_out = text.uses_at(|at, word| {
        (word == "out" || word == "inout")
            && at > 0
            && ["(", ","].contains(&text.significant[at - 1].text)
    });
    text.uses_at(|at, word| {
        let mut end = 1;
        while text.after(at, end) == "." {
            end += 2;
        }
        let is_argument =
            passes_out && at > 0 && ["(", ","].contains(&text.significant[at - 1].text);
        inputs.iter().any(|it| it == word) && (is_argument || text.after(at, end) == "=")
    })
}

/// True if variables between stages have types or qualifiers that stages restrict.
fn is_about_interface(text: &Text<'_>) -> bool {
    const QUALIFIERS: &[&str] =
        &["invariant", "flat", "smooth", "noperspective", "centroid", "sample"];
    let is_restricted = |ty: &str| {
        is_type(ty) && !(ty.starts_with("vec") || ty.starts_with("mat") || ty == "float")
    };
    let items = text.items();
    let mut variables = items.iter().filter_map(|it| match &it.kind {
        ItemKind::Variables(variables) => Some(variables),
        _ => None,
    });
    let is_passed = variables.any(|it| it.iter().any(|it| !it.is_uniform && is_restricted(&it.ty)));
    let is_struct = |it: &Item| {
        let tokens = &text.tokens[it.range.clone()];
        matches!(it.kind, ItemKind::StructVariables)
            && tokens.iter().any(|it| ["varying", "in", "out", "attribute"].contains(&it.text))
    };
    let has_two = |it: &Item| {
        let words = text.tokens[it.range.clone()].iter().filter(|it| it.kind == Kind::Word);
        let storage = |word: &&Token<'_>| ["in", "out", "uniform"].contains(&word.text);
        matches!(it.kind, ItemKind::Variables(_))
            && words.take_while(|it| !is_type(it.text)).filter(storage).count() > 1
    };
    let is_passed = is_passed || items.iter().any(is_struct) || items.iter().any(has_two);
    let is_attribute = text.stage != Stage::Vertex && text.uses(|it| it == "attribute");
    is_passed || is_attribute || text.uses(|it| QUALIFIERS.contains(&it))
}

/// True if a function or variable at file scope is named before its declaration.
fn has_early_use(text: &Text<'_>) -> bool {
    text.items().iter().any(|item| {
        let names: Vec<&str> = match &item.kind {
            ItemKind::Variables(variables) => variables.iter().map(|it| it.name.as_str()).collect(),
            ItemKind::Function { name, .. } => vec![name.as_str()],
            _ => Vec::new(),
        };
        text.tokens[..item.range.start]
            .iter()
            .any(|it| it.kind == Kind::Word && names.contains(&it.text))
    })
}

fn has_other_main(text: &Text<'_>) -> bool {
    text.significant
        .windows(2)
        .any(|it| it[1].is("main") && it[0].kind == Kind::Word && !it[0].is("void"))
}

/// The rule of a drawing without a result.
pub fn failed(problem: &str) -> Option<Rule> {
    (problem == RASTERISATION).then_some(RASTERISATION)
}
