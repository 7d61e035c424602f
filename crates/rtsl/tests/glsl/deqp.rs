//! The `.test` files of dEQP: groups of cases, with the values of each.

use std::path::Path;

use crate::case::{Case, Expect, Shader, Stage, Value, Values, Version, shape_of, word_of};

/// Reads a text of a `.test` file. Cases have the names of their groups before their own.
///
/// # Errors
/// What is not understood, with the line.
pub fn parse(prefix: &str, text: &str) -> Result<Vec<Case>, String> {
    let mut reader = Reader { text, at: 0 };
    let mut cases = Vec::new();
    reader.members(prefix, &mut cases).map_err(|problem| {
        let line = text[..reader.at.min(text.len())].lines().count();
        format!("{prefix}, line {line}: {problem}")
    })?;
    Ok(cases)
}

/// Reads a `.test` file; `prefix` is the name of the file in the report.
///
/// # Errors
/// If the file can't be read, or is not understood.
pub fn read(path: &Path, prefix: &str) -> Result<Vec<Case>, String> {
    let bytes = std::fs::read(path).map_err(|error| format!("{prefix}: {error}"))?;
    let text = String::from_utf8_lossy(&bytes);
    // The folder has XML files of this extension, too.
    if text.trim_start().starts_with('<') { Ok(Vec::new()) } else { parse(prefix, &text) }
}

struct Reader<'a> {
    text: &'a str,
    at: usize,
}

/// The parts of a case as they are read.
#[derive(Default)]
struct Parts {
    version: Option<Version>,
    expect: Option<Expect>,
    values: Values,
    shaders: Vec<Shader>,
    extensions: Vec<String>,
}

impl<'a> Reader<'a> {
    /// Skips space and comments, which are from `#` to the end of the line.
    fn skip(&mut self) {
        loop {
            let rest = &self.text[self.at..];
            self.at += rest.len() - rest.trim_start().len();
            if !self.text[self.at..].starts_with('#') {
                return;
            }
            let rest = &self.text[self.at..];
            self.at += rest.find('\n').unwrap_or(rest.len());
        }
    }

    fn peek(&mut self) -> &'a str {
        self.skip();
        let rest = &self.text[self.at..];
        let is_word = |c: char| c.is_ascii_alphanumeric() || "_-.".contains(c);
        let length = match rest.chars().next() {
            None => 0,
            Some(first) if is_word(first) => rest.find(|c| !is_word(c)).unwrap_or(rest.len()),
            Some(first) => first.len_utf8(),
        };
        &rest[..length]
    }

    fn next(&mut self) -> &'a str {
        let token = self.peek();
        self.at += token.len();
        token
    }

    fn takes(&mut self, token: &str) -> bool {
        let found = self.peek() == token;
        if found {
            self.at += token.len();
        }
        found
    }

    fn wants(&mut self, token: &str) -> Result<(), String> {
        let found = self.next();
        if found == token { Ok(()) } else { Err(format!("`{found}` instead of `{token}`")) }
    }

    /// A text between quotation marks.
    fn quoted(&mut self) -> Result<&'a str, String> {
        self.wants("\"")?;
        let rest = &self.text[self.at..];
        let length = rest.find('"').ok_or("a text without its end")?;
        self.at += length + 1;
        Ok(&rest[..length])
    }

    /// A shader between doubled quotation marks; a backslash stands before a character that is meant.
    fn source(&mut self) -> Result<String, String> {
        self.wants("\"")?;
        self.wants("\"")?;
        let rest = &self.text[self.at..];
        let rest = rest.trim_start_matches(' ').trim_start_matches('\r');
        let rest = rest.strip_prefix('\n').unwrap_or(rest);
        let mut source = String::new();
        let mut characters = rest.char_indices();
        while let Some((at, character)) = characters.next() {
            if rest[at..].starts_with("\"\"") {
                self.at = self.text.len() - rest.len() + at + 2;
                return Ok(without_indentation(&source));
            }
            match character {
                '\\' => match characters.next().ok_or("a backslash at the end")?.1 {
                    'n' => source.push('\n'),
                    't' => source.push('\t'),
                    other => source.push(other),
                },
                '\r' => {}
                other => source.push(other),
            }
        }
        Err("a shader without its end".to_owned())
    }

    fn members(&mut self, prefix: &str, cases: &mut Vec<Case>) -> Result<(), String> {
        loop {
            match self.next() {
                "" => return Ok(()),
                "end" => return Ok(()),
                "group" => {
                    let name = self.next();
                    self.quoted()?;
                    self.members(&format!("{prefix}/{name}"), cases)?;
                }
                "case" => {
                    let name = self.next();
                    let case = self.case(&format!("{prefix}/{name}"))?;
                    cases.push(case);
                }
                // The other file is found by itself.
                "import" => drop(self.quoted()?),
                other => return Err(format!("unexpected `{other}`")),
            }
        }
    }

    fn case(&mut self, path: &str) -> Result<Case, String> {
        let mut parts = Parts::default();
        loop {
            match self.next() {
                "end" => break,
                "desc" => drop(self.quoted()?),
                "version" => parts.version = Some(self.version()?),
                "expect" => parts.expect = Some(self.expect()?),
                "values" => self.values(&mut parts.values)?,
                "require" => self.requirement(&mut parts.extensions)?,
                "output_color" => drop(self.next()),
                "pipeline_program" => self.pipeline_program(&mut parts)?,
                stage => {
                    let stage = stage_of(stage).ok_or_else(|| format!("unexpected `{stage}`"))?;
                    let text = self.source()?;
                    parts.shaders.push(Shader { stage, text });
                }
            }
        }
        Ok(parts.into_case(path))
    }

    fn version(&mut self) -> Result<Version, String> {
        let number = self.next();
        let es = self.takes("es");
        let version = Version::parse(number).ok_or_else(|| format!("version `{number}`"))?;
        Ok(Version { es: es || version.es, ..version })
    }

    fn expect(&mut self) -> Result<Expect, String> {
        Ok(match self.next() {
            "pass" => Expect::Values,
            "build_successful" => Expect::Accepted,
            "compile_fail" | "compile_or_link_fail" => Expect::Refused,
            "link_fail" | "validation_fail" => Expect::LinkRefused,
            other => return Err(format!("an expectation `{other}`")),
        })
    }

    fn requirement(&mut self, extensions: &mut Vec<String>) -> Result<(), String> {
        match self.next() {
            "extension" => {
                self.wants("{")?;
                let mut alternatives = vec![self.quoted()?];
                while self.takes("|") {
                    alternatives.push(self.quoted()?);
                }
                self.wants("}")?;
                extensions.push(alternatives.join("|"));
                if self.takes("in") {
                    self.braces()?;
                }
            }
            "limit" => {
                self.quoted()?;
                self.wants(">")?;
                self.next();
            }
            _ => {}
        }
        Ok(())
    }

    /// Passes over what stands in braces.
    fn braces(&mut self) -> Result<(), String> {
        self.wants("{")?;
        while !self.takes("}") {
            if self.next().is_empty() {
                return Err("a list without its end".to_owned());
            }
        }
        Ok(())
    }

    fn pipeline_program(&mut self, parts: &mut Parts) -> Result<(), String> {
        loop {
            match self.next() {
                "end" => return Ok(()),
                "active_stages" => self.braces()?,
                "require" => self.requirement(&mut parts.extensions)?,
                stage => {
                    let stage = stage_of(stage).ok_or_else(|| format!("unexpected `{stage}`"))?;
                    drop((stage, self.source()?));
                    parts.shaders.push(Shader { stage: Stage::Other, text: String::new() });
                }
            }
        }
    }

    fn values(&mut self, values: &mut Values) -> Result<(), String> {
        self.wants("{")?;
        loop {
            let list = match self.next() {
                "}" => return Ok(()),
                "input" => &mut values.inputs,
                "uniform" => &mut values.uniforms,
                "output" => &mut values.outputs,
                other => return Err(format!("a value `{other}`")),
            };
            let ty = self.next();
            let name = if self.peek() == "\"" { self.quoted()? } else { self.next() };
            self.wants("=")?;
            let mut rows = Vec::new();
            if self.takes("[") {
                while !self.takes("]") {
                    rows.push(self.row(ty)?);
                    self.takes("|");
                }
            } else {
                rows.push(self.row(ty)?);
            }
            self.takes(";");
            list.push(Value { ty: ty.to_owned(), name: name.to_owned(), rows });
        }
    }

    fn row(&mut self, ty: &str) -> Result<Vec<u32>, String> {
        let (scalar, count) = shape_of(ty).ok_or_else(|| format!("a type `{ty}`"))?;
        if count > 1 {
            self.next();
            self.wants("(")?;
        }
        let mut row = Vec::new();
        for index in 0..count {
            if index > 0 {
                self.wants(",")?;
            }
            row.push(word_of(scalar, self.number()?));
        }
        if count > 1 {
            self.wants(")")?;
        }
        Ok(row)
    }

    fn number(&mut self) -> Result<f64, String> {
        let mut sign = 1.0;
        while self.takes("-") {
            sign = -sign;
        }
        let mut word = self.next().to_owned();
        // `1.0e+5`: the sign is no part of a word.
        if word.ends_with(['e', 'E']) && self.takes("+") {
            word += self.next();
        }
        match word.as_str() {
            "true" => Ok(1.0),
            "false" => Ok(0.0),
            word => {
                let digits = word.trim_end_matches(['f', 'u']);
                digits.parse::<f64>().map(|it| sign * it).map_err(|_| format!("a number `{word}`"))
            }
        }
    }
}

impl Parts {
    fn into_case(self, path: &str) -> Case {
        let Parts { version, expect, values, shaders, extensions } = self;
        let version = version.unwrap_or(Version { number: 100, es: true });
        let shaders = shaders.into_iter().map(|shader| specialised(shader, &values, version));
        Case {
            path: path.to_owned(),
            version,
            shaders: shaders.collect(),
            expect: expect.unwrap_or(Expect::Values),
            steps: Vec::new(),
            extensions,
            values: values.clone(),
        }
    }
}

/// Removes from each line as much space as the first begins with; a tabulator counts four.
fn without_indentation(source: &str) -> String {
    let width = |c: char| if c == '\t' { 4 } else { 1 };
    let is_space = |c: &char| matches!(c, ' ' | '\t');
    let indentation: usize = source.chars().take_while(is_space).map(width).sum();
    let line = |line: &str| -> String {
        let mut left = indentation;
        let skipped = |c: &char| {
            let skips = left > 0 && is_space(c);
            left = if skips { left.saturating_sub(width(*c)) } else { 0 };
            skips
        };
        line.chars().skip_while(skipped).collect()
    };
    source.split_inclusive('\n').map(line).collect()
}

fn stage_of(word: &str) -> Option<Stage> {
    Some(match word {
        "both" => Stage::Both,
        "vertex" => Stage::Vertex,
        "fragment" => Stage::Fragment,
        "geometry" | "tessellation_control" | "tessellation_evaluation" => Stage::Other,
        _ => return None,
    })
}

/// Replaces the names that dEQP replaces. The results are variables that the shader assigns; reading and comparing them
/// is the runner's.
fn specialised(shader: Shader, values: &Values, version: Version) -> Shader {
    let Shader { stage, mut text } = shader;
    let is_new = version.number >= 130;
    let input = match (is_new, stage) {
        (true, _) => "in",
        (false, Stage::Vertex) => "attribute",
        (false, _) => "varying",
    };
    let declared = |storage: &str, values: &[Value]| -> String {
        let plain = values.iter().filter(|it| !it.name.contains(['.', '[']));
        plain.map(|it| format!("{storage} {} {};", it.ty, it.name)).collect()
    };
    let inputs = declared(input, &values.inputs);
    let outputs = declared("", &values.outputs);
    let uniforms = declared("uniform", &values.uniforms);
    let old_color = if stage == Stage::Fragment { "gl_FragColor" } else { "dEQP_FragColor" };
    let (color, declared_color) = match is_new {
        true => ("dEQP_FragColor", "vec4 dEQP_FragColor;"),
        false => (old_color, if stage == Stage::Both { "vec4 dEQP_FragColor;" } else { "" }),
    };
    let both = format!("{inputs}{outputs}{declared_color}vec4 dEQP_Position;");
    for (name, replacement) in [
        ("${DECLARATIONS}", both.clone()),
        ("${DECLARATIONS:single-line}", both),
        ("${SETUP}", String::new()),
        ("${OUTPUT}", String::new()),
        ("${POSITION_FRAG_COLOR}", color.to_owned()),
        ("${VERTEX_DECLARATIONS}", format!("{inputs}{uniforms}vec4 dEQP_Position;")),
        ("${VERTEX_SETUP}", String::new()),
        ("${VERTEX_OUTPUT}", String::new()),
        ("${FRAGMENT_DECLARATIONS}", format!("{outputs}{uniforms}{declared_color}")),
        ("${FRAGMENT_OUTPUT}", String::new()),
        ("${FRAG_COLOR}", color.to_owned()),
    ] {
        text = text.replace(name, &replacement);
    }
    // Cases without declarations assign the position or the colour.
    if stage == Stage::Both
        && text.contains("dEQP_FragColor")
        && !text.contains("vec4 dEQP_FragColor")
    {
        text = text.replace("dEQP_FragColor", "gl_FragColor");
    }
    Shader { stage, text }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn groups_values_and_texts_are_read() {
        let text = r#"
            # A comment.
            group outer "Outer"
                case first
                    version 310 es
                    desc "described"
                    require extension { "GL_A" | "GL_B" } in { vertex, fragment }
                    values {
                        input vec2 in0 = [ vec2(-1.0, 2.5e+1) | vec2(0.0, 1.0) ];
                        uniform bool "flags.on" = true;
                        output uint out0 = [ 1 | 2 ];
                    }
                    both ""
                        ${DECLARATIONS}
                        a\\
                      b \"c\"
                    ""
                end
            end
            import "other.test"
            case last expect link_fail vertex "" "" end
        "#;
        let cases = parse("file", text).expect("it is well-formed");
        let [first, last] = &cases[..] else { panic!("two cases") };
        assert_eq!((first.path.as_str(), last.path.as_str()), ("file/outer/first", "file/last"));
        assert_eq!(first.version, Version { number: 310, es: true });
        assert_eq!(first.extensions, ["GL_A|GL_B"]);
        assert_eq!(first.values.inputs[0].rows[0], [-1.0_f32, 25.0].map(f32::to_bits));
        assert_eq!(first.values.uniforms[0].name, "flags.on");
        assert_eq!(first.values.outputs[0].rows, [[1], [2]]);
        let source = &first.shaders[0].text;
        assert!(source.starts_with("in vec2 in0; uint out0;"), "{source}");
        assert!(source.contains("\na\\\nb \"c\"\n"), "{source}");
        assert_eq!(last.expect, Expect::LinkRefused);
        assert_eq!(parse("file", "case a").unwrap_err(), "file, line 1: unexpected ``");
    }
}
