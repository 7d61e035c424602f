//! Words: keywords, names of built-in types, and words that GLSL reserves and RTSL does not use.

/// The grammatical kind of a word.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Word {
    /// A name that programs may declare.
    Plain,
    Keyword(Keyword),
    /// The name of a type that is a keyword in GLSL.
    Type,
    /// A keyword of GLSL that has no meaning in RTSL.
    Reserved(Reserved),
}

/// A keyword of GLSL that RTSL reserves only to suggest an alternative.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Reserved {
    /// The help text of the diagnostic.
    pub help: &'static str,
    /// The way in which the parser continues, so that one word gives one error.
    pub reading: Reading,
}

/// The way in which the parser treats a reserved word after it has reported it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Reading {
    /// As this type.
    Type(&'static str),
    /// As a qualifier that is dropped.
    Qualifier,
    /// As `layout`: a qualifier with a parenthesised list.
    Layout,
    /// As a statement, which is skipped.
    Statement,
    /// As a name.
    Name,
}

/// Returns the reason why programs cannot declare a name, as a sentence; `None` if they can.
pub fn reserved_name(name: &str) -> Option<&'static str> {
    if name.starts_with("rt_") {
        Some("names that start with `rt_` belong to the language")
    } else if name.starts_with("gl_") {
        Some("names that start with `gl_` belong to GLSL")
    } else if name.contains("__") {
        Some("names with two underscores in a row are reserved")
    } else {
        None
    }
}

macro_rules! keywords {
    ($($name:ident $text:literal)*) => {
        /// The keywords of the grammar.
        #[derive(Clone, Copy, Debug, PartialEq, Eq)]
        pub(crate) enum Keyword { $($name),* }

        impl Keyword {
            /// All keywords with their texts.
            pub(crate) const ALL: &'static [(Keyword, &'static str)] = &[$((Keyword::$name, $text)),*];
        }

        fn keyword(text: &str) -> Option<Keyword> {
            match text { $($text => Some(Keyword::$name),)* _ => None }
        }
    };
}

keywords! {
    Attribute "attribute" Break "break" Case "case" Class "class" Const "const" Continue "continue" Default "default"
    Do "do" Else "else" Enum "enum" False "false" For "for" Highp "highp" If "if" Illuminance "illuminance"
    In "in" InOut "inout" Invariant "invariant" Lowp "lowp" Mediump "mediump" Out "out"
    Output "output"
    Precise "precise" Precision "precision" Private "private" Public "public" Return "return"
    Scratch "scratch" Struct "struct" Switch "switch" True "true" Uniform "uniform" While "while"
}

/// The keywords of the grammar in alphabetical order, for tools such as editors. The names of types, which GLSL has as
/// keywords, are [`type_names`].
pub fn keywords() -> impl Iterator<Item = &'static str> {
    Keyword::ALL.iter().map(|(_, text)| *text)
}

/// The names of types that GLSL has as keywords. Other types, such as `color`, have ordinary names.
pub fn type_names() -> impl Iterator<Item = String> {
    let scalars = ["void", "bool", "int", "uint", "float"].into_iter().map(str::to_owned);
    let vectors = VECTOR_STEMS
        .into_iter()
        .flat_map(|stem| VECTOR_SIZES.into_iter().map(move |size| format!("{stem}{size}")));
    let matrices = VECTOR_SIZES.into_iter().flat_map(|columns| {
        let other = VECTOR_SIZES.into_iter().map(move |rows| format!("mat{columns}x{rows}"));
        std::iter::once(format!("mat{columns}")).chain(other)
    });
    scalars.chain(vectors).chain(matrices)
}

/// Classifies `text`.
pub(crate) fn classify(text: &str) -> Word {
    if let Some(keyword) = keyword(text) {
        Word::Keyword(keyword)
    } else if is_type(text) {
        Word::Type
    } else if let Some(reserved) = reserved(text) {
        Word::Reserved(reserved)
    } else {
        Word::Plain
    }
}

const VECTOR_STEMS: [&str; 4] = ["vec", "ivec", "uvec", "bvec"];
const VECTOR_SIZES: [&str; 3] = ["2", "3", "4"];

fn is_type(text: &str) -> bool {
    let vector = VECTOR_STEMS.into_iter().find_map(|stem| rest(text, stem));
    matches!(text, "void" | "bool" | "int" | "uint" | "float")
        || vector.is_some_and(is_vector_size)
        || rest(text, "mat").is_some_and(is_matrix_size)
}

fn rest<'a>(text: &'a str, stem: &str) -> Option<&'a str> {
    text.strip_prefix(stem)
}

fn is_vector_size(size: &str) -> bool {
    VECTOR_SIZES.contains(&size)
}

fn is_matrix_size(size: &str) -> bool {
    is_vector_size(size)
        || size
            .split_once('x')
            .is_some_and(|(columns, rows)| is_vector_size(columns) && is_vector_size(rows))
}

const NO_DOUBLES: &str =
    "`float` is the only floating-point type; every result is exact to binary32";
const USE_PUBLIC: &str = "declare a value that the host sets as a `public` member";
const STATE: &str = "values pass between methods in `scratch` members and `rt_` state variables; leave the word out";
const TEXTURES: &str = "declare a `public rt_Texture` member and call its `lookup()`, \
     or read a `public vec3 texels[];` buffer by index";
const MEMORY: &str = "shaders have no writable shared memory; an unsized array member, \
     `public float data[];`, is read-only data that the host binds";
const NO_TYPE: &str = "the integer types are `int` and `uint`, 32 bits each";
const FUTURE: &str = "GLSL reserves this word for the future; choose another name";

fn reserved(text: &str) -> Option<Reserved> {
    let (help, reading) = reserved_type(text).or_else(|| reserved_word(text))?;
    Some(Reserved { help, reading })
}

fn reserved_word(text: &str) -> Option<(&'static str, Reading)> {
    Some(match text {
        "layout" => ("members need no layout; leave it out", Reading::Layout),
        "varying" => (USE_PUBLIC, Reading::Qualifier),
        "buffer" | "shared" | "coherent" | "volatile" | "restrict" | "readonly" | "writeonly" => {
            (MEMORY, Reading::Qualifier)
        }
        "centroid" | "flat" | "smooth" | "noperspective" | "patch" | "sample" => {
            (STATE, Reading::Qualifier)
        }
        "subroutine" => (
            "to choose code at run time, call a member of type `rt_Texture` or `rt_Material`",
            Reading::Qualifier,
        ),
        "discard" => (
            "to reject a hit, return from `intersect()` without calling `hit()`; \
             elsewhere `return` leaves the method",
            Reading::Statement,
        ),
        "goto" => ("use `break`, `continue` or `return`", Reading::Statement),
        "static" | "extern" | "external" | "inline" | "noinline" | "superp" => (
            "leave the word out: functions and constants need no such qualifier",
            Reading::Qualifier,
        ),
        "typedef" | "using" => ("write the type itself, or `#define` a name for it", Reading::Name),
        "union" => {
            ("use a `struct`; `floatBitsToInt` and its kind reinterpret bits", Reading::Name)
        }
        "template" => ("give the function parameters of type `genType`", Reading::Name),
        "this" => ("members are named directly", Reading::Name),
        "sizeof" => ("arrays have `.length()`", Reading::Name),
        "interface" => ("derive a class from a role such as `rt_Material`", Reading::Name),
        "cast" => ("constructors convert: `int(x)`", Reading::Name),
        "common" | "partition" | "active" | "asm" | "resource" | "input" | "filter"
        | "namespace" => (FUTURE, Reading::Name),
        _ => return None,
    })
}

fn reserved_type(text: &str) -> Option<(&'static str, Reading)> {
    const DOUBLE_VECTORS: [&str; 3] = ["vec2", "vec3", "vec4"];
    const MATRICES: [&str; 12] = [
        "mat2", "mat3", "mat4", "mat2x2", "mat2x3", "mat2x4", "mat3x2", "mat3x3", "mat3x4",
        "mat4x2", "mat4x3", "mat4x4",
    ];
    let find = |list: &[&'static str], name: &str| list.iter().copied().find(|each| *each == name);
    let other_float = match text {
        "double" | "half" | "fixed" => Some("float"),
        _ => rest(text, "d")
            .and_then(|name| find(&DOUBLE_VECTORS, name).or_else(|| find(&MATRICES, name)))
            .or_else(|| {
                let name = rest(text, "h").or_else(|| rest(text, "f"))?;
                find(&DOUBLE_VECTORS, name)
            }),
    };
    if let Some(name) = other_float {
        return Some((NO_DOUBLES, Reading::Type(name)));
    }
    match text {
        "long" | "short" => Some((NO_TYPE, Reading::Type("int"))),
        "unsigned" => Some((NO_TYPE, Reading::Type("uint"))),
        "atomic_uint" => Some((MEMORY, Reading::Type("uint"))),
        _ if is_opaque(text) => Some((TEXTURES, Reading::Type("rt_Texture"))),
        _ => None,
    }
}

/// True for GLSL's sampler and image types.
fn is_opaque(text: &str) -> bool {
    const SHAPES: [&str; 11] = [
        "1D",
        "2D",
        "3D",
        "Cube",
        "2DRect",
        "1DArray",
        "2DArray",
        "CubeArray",
        "Buffer",
        "2DMS",
        "2DMSArray",
    ];
    const SHADOWS: [&str; 7] = [
        "1DShadow",
        "2DShadow",
        "CubeShadow",
        "2DRectShadow",
        "1DArrayShadow",
        "2DArrayShadow",
        "CubeArrayShadow",
    ];
    if matches!(text, "sampler" | "samplerShadow" | "sampler3DRect") {
        return true;
    }
    if rest(text, "sampler").is_some_and(|shape| SHADOWS.contains(&shape)) {
        return true;
    }
    let plain = rest(text, "i").filter(|plain| !plain.starts_with("mage")).or(rest(text, "u"));
    let plain = plain.unwrap_or(text);
    let shape = rest(plain, "sampler").or_else(|| rest(plain, "image"));
    shape.is_some_and(|shape| SHAPES.contains(&shape))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn listed_words_are_classified_as_such() {
        for name in type_names() {
            assert_eq!(classify(&name), Word::Type, "{name}");
        }
        assert_eq!(type_names().count(), 5 + 4 * 3 + 3 * 4);
        for text in keywords() {
            assert!(matches!(classify(text), Word::Keyword(_)), "{text}");
        }
    }

    #[test]
    fn words_are_classified_as_in_glsl() {
        for text in ["float", "vec2", "uvec4", "mat3", "mat4x2"] {
            assert_eq!(classify(text), Word::Type, "{text}");
        }
        for text in ["color", "vec5", "mat5", "rt_Texture", "image", "matter", "isampler"] {
            assert_eq!(classify(text), Word::Plain, "{text}");
        }
        for text in ["dvec3", "dmat2x4", "hvec2", "fvec4", "sampler2D", "isampler3D", "image2D"] {
            assert!(matches!(classify(text), Word::Reserved(_)), "{text}");
        }
        for text in ["uimageBuffer", "iimage1D", "samplerCubeShadow", "discard", "goto"] {
            assert!(matches!(classify(text), Word::Reserved(_)), "{text}");
        }
    }
}
