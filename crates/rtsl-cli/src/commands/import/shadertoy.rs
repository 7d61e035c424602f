//! Programs of Shadertoy.
//!
//! The text of the program stands unchanged at the end of the class. Before it stand parameters for the inputs that
//! it names, functions for the textures that it reads, and the method that calls `mainImage`. Errors of the
//! compiler in the program's part are shown at their places in the program.

use std::collections::BTreeSet;
use std::fmt::Write;

use rtsl::{Diagnostic, FileId, Label, Span, diagnostic_codes as codes};

use super::Form;
use super::words::{Word, words};

/// An input of programs, and the parameter that replaces it.
struct Input {
    name: &'static str,
    declaration: &'static str,
}

/// The inputs of Shadertoy, but for its channels.
const INPUTS: [Input; 11] = [
    input(
        "iResolution",
        "[[doc \"Pixels of the image that the program draws: width, height, and the shape of a pixel.\"]] \
         public vec3 iResolution = vec3(800.0, 450.0, 1.0);",
    ),
    input("iTime", "[[doc \"Seconds since the start.\"]] public float iTime = 0.0;"),
    input("iGlobalTime", "[[doc \"Seconds since the start.\"]] public float iGlobalTime = 0.0;"),
    input("iTimeDelta", "[[doc \"Seconds of a frame.\"]] public float iTimeDelta = 0.0166667;"),
    input("iFrame", "[[doc \"The number of the frame.\"]] public int iFrame = 0;"),
    input("iFrameRate", "[[doc \"Frames in a second.\"]] public float iFrameRate = 60.0;"),
    input("iMouse", "[[doc \"The pointer in pixels.\"]] public vec4 iMouse = vec4(0.0);"),
    input("iDate", "[[doc \"Year, month, day, seconds.\"]] public vec4 iDate = vec4(0.0);"),
    input("iSampleRate", "public float iSampleRate = 44100.0;"),
    input("iChannelTime", "public float iChannelTime[4] = float[](0.0, 0.0, 0.0, 0.0);"),
    input(
        "iChannelResolution",
        "public vec3 iChannelResolution[4] = vec3[](vec3(256.0), vec3(256.0), vec3(256.0), vec3(256.0));",
    ),
];

const fn input(name: &'static str, declaration: &'static str) -> Input {
    Input { name, declaration }
}

const CHANNELS: [&str; 4] = ["iChannel0", "iChannel1", "iChannel2", "iChannel3"];

/// The functions of GLSL that read textures, for references to textures.
const LOOKUPS: [(&str, &str); 5] = [
    (
        "texture",
        "vec4 texture(rt_Texture channel, vec2 uv, float bias = 0.0) { return vec4(rgb(channel.lookup(uv)), 1.0); }\n\
         vec4 texture(rt_Texture channel, vec3 at, float bias = 0.0) { return vec4(rgb(channel.lookup(at)), 1.0); }\n",
    ),
    (
        "textureLod",
        "vec4 textureLod(rt_Texture channel, vec2 uv, float level) { return vec4(rgb(channel.lookup(uv)), 1.0); }\n\
         vec4 textureLod(rt_Texture channel, vec3 at, float level) { return vec4(rgb(channel.lookup(at)), 1.0); }\n",
    ),
    (
        "textureGrad",
        "vec4 textureGrad(rt_Texture channel, vec2 uv, vec2 dx, vec2 dy) {\n    \
         return vec4(rgb(channel.lookup(uv, length(dx), length(dy))), 1.0);\n}\n",
    ),
    (
        "texelFetch",
        "vec4 texelFetch(rt_Texture channel, ivec2 texel, int level) {\n    \
         return vec4(rgb(channel.lookup((vec2(texel) + 0.5) / channelSize)), 1.0);\n}\n",
    ),
    (
        "textureSize",
        "ivec2 textureSize(rt_Texture channel, int level) { return max(ivec2(channelSize) >> level, 1); }\n",
    ),
];

/// The lookups that ask for the number of texels.
const SIZED: [&str; 2] = ["texelFetch", "textureSize"];

const CHANNEL_SIZE: &str = "[[doc \"Texels of a channel, for texelFetch and textureSize.\"]] \
     public vec2 channelSize = vec2(256.0);\n";

/// Words that programs may use as names and the class may not: keywords, and methods of its role.
const KEYWORDS: [&str; 5] = ["private", "scratch", "illuminance", "constructor", "channelSize"];
const METHODS: [&str; 6] = ["lookup", "shade", "BSDF", "sampleBSDF", "evaluatePDF", "emission"];

/// Functions of passes that draw no image, with what could be done.
const OTHER_PASSES: [(&str, &str); 3] = [
    ("mainSound", "import the pass that has `mainImage`; sounds have no counterpart"),
    ("mainCubemap", "write a texture that reads `rt_TextureUVW` as the direction"),
    ("main", "name the function `void mainImage(out vec4 fragColor, in vec2 fragCoord)`"),
];

/// A program as a class.
#[derive(Debug)]
pub struct Imported {
    /// The text of the class.
    pub text: String,
    /// The place of the program's text in it.
    start: usize,
    length: usize,
    /// The span of `mainImage` in the program, for errors of other parts of the class.
    main: Span,
}

/// Translates a program to a class with this name.
///
/// # Errors
/// If the program draws no image.
pub fn import(
    program: &str,
    file: FileId,
    name: &str,
    form: Form,
) -> Result<Imported, Box<Diagnostic>> {
    let words = words(program);
    let main = find_main(program, file, &words)?;
    let named: BTreeSet<&str> = words.iter().map(|word| word.text).collect();
    let declared = declared_uniforms(&words);
    let is_used = |input: &str| named.contains(input) && !declared.contains(input);

    let role = if form == Form::Texture { "rt_Texture" } else { "rt_Material" };
    let mut text = format!("/// A program of Shadertoy.\nclass {name} : {role};\n\n");
    for Input { name, declaration } in &INPUTS {
        if is_used(name) || (*name == "iResolution" && !declared.contains(name)) {
            text += declaration;
            text.push('\n');
        }
    }
    text += "[[doc \"True if the program's colours are meant for a screen, and not linear.\"]] \
             public bool isEncoded = true;\n";
    for channel in CHANNELS.iter().filter(|channel| is_used(channel)) {
        writeln!(text, "public rt_Texture {channel};").expect("strings take all text");
    }
    text += &lookups(&named);
    // Before the program, whose macros may have any name.
    text += &methods(form);
    let renamed: Vec<&str> = KEYWORDS.iter().chain(&METHODS).copied().collect();
    let renamed: Vec<&str> = renamed.into_iter().filter(|word| named.contains(word)).collect();
    text += "\n#define HW_PERFORMANCE 1\n#define sampler2D rt_Texture\n#define samplerCube rt_Texture\n";
    for word in renamed {
        writeln!(text, "#define {word} {word}Of{name}").expect("strings take all text");
    }
    text += "\n// The program.\n";
    let start = text.len();
    text += program;
    if !text.ends_with('\n') {
        text.push('\n');
    }
    Ok(Imported { text, start, length: program.len(), main })
}

/// The span of the name `mainImage` in its declaration.
fn find_main(program: &str, file: FileId, words: &[Word<'_>]) -> Result<Span, Box<Diagnostic>> {
    let span =
        |word: &Word<'_>| Span::new(file, word.start as u32, (word.start + word.text.len()) as u32);
    let is_called =
        |word: &&Word<'_>| program[word.start + word.text.len()..].trim_start().starts_with('(');
    let find = |name: &str| words.iter().filter(is_called).find(|word| word.text == name);
    if let Some(main) = find("mainImage") {
        return Ok(span(main));
    }
    let diagnostic = Diagnostic::new(codes::NOT_IMPORTABLE, "the program has no `mainImage`");
    for (name, remedy) in OTHER_PASSES {
        if let Some(other) = find(name) {
            let label = format!("`{name}` draws no image");
            return Err(Box::new(diagnostic.at(span(other), label).help(remedy)));
        }
    }
    let start = Span::new(file, 0, 0);
    let remedy = "add `void mainImage(out vec4 fragColor, in vec2 fragCoord) { ... }`";
    Err(Box::new(diagnostic.at(start, "nothing here draws an image").help(remedy)))
}

/// The names that the program itself declares as `uniform`.
fn declared_uniforms<'t>(words: &[Word<'t>]) -> BTreeSet<&'t str> {
    const PRECISIONS: [&str; 3] = ["lowp", "mediump", "highp"];
    let mut declared = BTreeSet::new();
    let uniforms = words.iter().enumerate().filter(|(_, word)| word.text == "uniform");
    for (index, _) in uniforms {
        let mut rest = words[index + 1..].iter().filter(|word| !PRECISIONS.contains(&word.text));
        declared.extend(rest.nth(1).map(|name| name.text));
    }
    declared
}

/// The functions that the program calls to read textures.
fn lookups(named: &BTreeSet<&str>) -> String {
    let used = LOOKUPS.iter().filter(|(name, _)| named.contains(name));
    let functions: String = used.map(|(_, text)| *text).collect();
    let sized = SIZED.iter().any(|name| named.contains(name));
    let size = if sized { CHANNEL_SIZE } else { "" };
    let space = if functions.is_empty() { "" } else { "\n" };
    format!("{size}{space}{functions}")
}

/// The methods of the class.
fn methods(form: Form) -> String {
    let drawn = "\ncolor importedColor() {\n    vec4 fragColor;\n    \
         mainImage(fragColor, rt_TextureUV * iResolution.xy);\n    \
         vec3 rgb = clamp(fragColor.rgb, 0.0, 1.0);\n    \
         return color(isEncoded ? pow(rgb, vec3(2.2)) : rgb);\n}\n\n";
    let methods = match form {
        Form::Texture => "void lookup() { rt_TextureColor = importedColor(); }\n",
        Form::Material => {
            "void BSDF() {\n    \
             bool same = dot(rt_RayDirection, rt_GeometricNormal) * dot(rt_LightDirection, rt_GeometricNormal) < 0.0;\n    \
             if (same) rt_BSDFValue = importedColor() / 3.14159265;\n}\n"
        }
        Form::Emission => "void emission() { rt_EmissionColor = importedColor(); }\n",
    };
    format!("{drawn}{methods}")
}

impl Imported {
    /// Places a diagnostic of the class in the program.
    pub fn place(&self, diagnostic: &Diagnostic) -> Diagnostic {
        let mut placed = diagnostic.clone();
        placed.primary = placed.primary.map(|label| self.place_label(label));
        placed.labels.retain(|label| self.place_span(label.span).is_some());
        placed.labels = placed.labels.into_iter().map(|label| self.place_label(label)).collect();
        placed.suggestions.retain_mut(|suggestion| match self.place_span(suggestion.span) {
            Some(span) => {
                suggestion.span = span;
                true
            }
            None => false,
        });
        placed
    }

    fn place_label(&self, label: Label) -> Label {
        let span = self.place_span(label.span).unwrap_or(self.main);
        Label { span, ..label }
    }

    /// The span in the program's text; `None` for other parts of the class.
    fn place_span(&self, span: Span) -> Option<Span> {
        let place = |at: u32| {
            let at = (at as usize).checked_sub(self.start)?;
            (at <= self.length).then_some(at as u32)
        };
        Some(Span::new(self.main.file, place(span.start)?, place(span.end)?))
    }
}
