//! The files of piglit: texts that a compiler accepts or refuses, and programs of `shader_runner`.

use std::path::Path;

use crate::case::{Case, Expect, Shader, Stage, Step, Values, Version, shape_of};

/// Reads a file; `None` if it is no case. `path` is its name in the report.
///
/// # Errors
/// If the file can't be read.
pub fn read(file: &Path, path: &str) -> Result<Option<Case>, String> {
    let bytes = std::fs::read(file).map_err(|error| format!("{path}: {error}"))?;
    let text = String::from_utf8_lossy(&bytes).replace("\r\n", "\n");
    let extension = file.extension().and_then(|it| it.to_str()).unwrap_or_default();
    Ok(match extension {
        "shader_test" => Some(program(path, &text)),
        "vert" => text_of_stage(path, &text, Stage::Vertex),
        "frag" => text_of_stage(path, &text, Stage::Fragment),
        "geom" | "tesc" | "tese" | "comp" => text_of_stage(path, &text, Stage::Other),
        _ => None,
    })
}

/// Reads a text whose comment between `[config]` and `[end config]` says what is expected of it.
pub fn text_of_stage(path: &str, text: &str, stage: Stage) -> Option<Case> {
    let start = text.find("[config]")?;
    let config = &text[start..start + text[start..].find("[end config]")?];
    let setting = |name: &str| {
        let mut lines = config.lines();
        lines.find_map(|line| Some(line.split_once(name)?.1.trim_start_matches(':').trim()))
    };
    let extensions = setting("require_extensions").unwrap_or_default();
    Some(Case {
        path: path.to_owned(),
        version: setting("glsl_version").and_then(Version::parse)?,
        shaders: vec![Shader { stage, text: text.to_owned() }],
        expect: match setting("expect_result")?.split_whitespace().next()? {
            "pass" => Expect::Accepted,
            _ => Expect::Refused,
        },
        values: Values::default(),
        steps: Vec::new(),
        extensions: extensions.split_whitespace().map(str::to_owned).collect(),
    })
}

/// Reads a program: sections with requirements, shaders, and the steps of a drawing.
pub fn program(path: &str, text: &str) -> Case {
    let mut case = Case {
        path: path.to_owned(),
        version: Version { number: 110, es: false },
        shaders: Vec::new(),
        expect: Expect::Values,
        values: Values::default(),
        steps: Vec::new(),
        extensions: Vec::new(),
    };
    let mut size = [250.0, 250.0];
    let mut rest = text;
    while let Some(start) = section_start(rest) {
        let (header, body) = rest[start..].split_once('\n').unwrap_or((&rest[start..], ""));
        let end = section_start(body).unwrap_or(body.len());
        let content = &body[..end];
        rest = &body[end..];
        let name = header.trim().trim_matches(['[', ']']);
        match name {
            "require" => requirements(content, &mut case, &mut size),
            "vertex shader passthrough" => {
                let text =
                    "attribute vec4 piglit_vertex;\nvoid main() { gl_Position = piglit_vertex; }\n";
                case.shaders.push(Shader { stage: Stage::Vertex, text: text.to_owned() });
            }
            "test" => steps(content, &mut case, size),
            _ => {
                let stage = match name {
                    "vertex shader" => Stage::Vertex,
                    "fragment shader" => Stage::Fragment,
                    _ => Stage::Other,
                };
                case.shaders.push(Shader { stage, text: content.to_owned() });
            }
        }
    }
    case
}

/// The place of the next line that begins a section.
fn section_start(text: &str) -> Option<usize> {
    const NAMES: [&str; 6] = ["require", "test", "vertex", "fragment", "geometry", "tessellation"];
    let is_section = |line: &str| {
        let inner = line.strip_prefix('[');
        inner.is_some_and(|it| {
            NAMES.iter().any(|name| it.starts_with(name)) || it.starts_with("compute")
        })
    };
    let mut at = 0;
    for line in text.split_inclusive('\n') {
        if is_section(line) {
            return Some(at);
        }
        at += line.len();
    }
    None
}

fn requirements(text: &str, case: &mut Case, size: &mut [f32; 2]) {
    for line in text.lines() {
        let words: Vec<&str> = line.split_whitespace().collect();
        match words[..] {
            ["GLSL", ">=" | "==" | ">", version, ..] => {
                case.version = Version::parse(version).unwrap_or(case.version);
                case.version.es |= words.get(3) == Some(&"ES");
            }
            ["GLSL", "ES", _, version, ..] => {
                case.version = Version::parse(version).unwrap_or(case.version);
                case.version.es = true;
            }
            ["SIZE", width, height] => {
                *size = [width, height].map(|it| it.parse().unwrap_or(250.0));
            }
            [extension, ..] if extension.starts_with("GL_") && !extension.contains("MAX") => {
                case.extensions.push(extension.to_owned());
            }
            _ => {}
        }
    }
}

fn steps(text: &str, case: &mut Case, size: [f32; 2]) {
    for line in text.lines() {
        let line = line.split(['#']).next().unwrap_or_default().trim();
        let words: Vec<&str> = line.split_whitespace().collect();
        if words.is_empty() {
            continue;
        }
        match words[..] {
            ["link", "error"] => case.expect = Expect::LinkRefused,
            ["link", "success"] if case.expect == Expect::Values => case.expect = Expect::Accepted,
            _ => {
                case.expect =
                    if case.expect == Expect::LinkRefused { case.expect } else { Expect::Values };
                case.steps.push(step(line, &words, size));
            }
        }
    }
    if case.steps.iter().all(|it| !matches!(it, Step::Probe { .. } | Step::Unknown(_)))
        && case.expect == Expect::Values
    {
        case.expect = Expect::Accepted;
    }
}

fn step(line: &str, words: &[&str], size: [f32; 2]) -> Step {
    let numbers = |from: usize| -> Option<Vec<f32>> {
        let words = words.iter().skip(from);
        words.map(|it| it.trim_matches(['(', ')', ',']).parse().ok()).collect()
    };
    read_step(words, size, &numbers).unwrap_or_else(|| Step::Unknown(line.to_owned()))
}

fn read_step(
    words: &[&str],
    size: [f32; 2],
    numbers: &dyn Fn(usize) -> Option<Vec<f32>>,
) -> Option<Step> {
    Some(match words {
        ["uniform", ty, name, values @ ..] => {
            let is_float = shape_of(ty).is_some_and(|(scalar, _)| scalar == 'f');
            let number = |it: &&str| match it.strip_prefix("0x") {
                // The bits of a float.
                Some(bits) if is_float => {
                    Some(f64::from(f32::from_bits(u32::from_str_radix(bits, 16).ok()?)))
                }
                Some(digits) => i64::from_str_radix(digits, 16).ok().map(|it| it as f64),
                None => it.parse::<f64>().ok(),
            };
            let numbers: Option<Vec<f64>> = values.iter().map(number).collect();
            Step::Uniform { ty: (*ty).to_owned(), name: (*name).to_owned(), numbers: numbers? }
        }
        ["clear", "color", ..] => Step::ClearColor(numbers(2)?.try_into().ok()?),
        ["clear"] => Step::Clear,
        ["draw", "rect", values @ ..] if values.len() == 4 => {
            Step::Draw(numbers(2)?.try_into().ok()?)
        }
        ["probe", "all", kind @ ("rgba" | "rgb"), ..] => {
            let mut color = numbers(3)?;
            color.truncate(if *kind == "rgb" { 3 } else { 4 });
            Step::Probe { place: None, color }
        }
        ["relative", "probe", kind @ ("rgba" | "rgb"), ..] => {
            let all = numbers(3)?;
            let count = if *kind == "rgb" { 3 } else { 4 };
            let (place, color) = all.split_at_checked(2)?;
            (color.len() == count).then_some(())?;
            Step::Probe { place: Some([place[0], place[1]]), color: color.to_vec() }
        }
        ["probe", kind @ ("rgba" | "rgb"), ..] => {
            let all = numbers(2)?;
            let count = if *kind == "rgb" { 3 } else { 4 };
            let (place, color) = all.split_at_checked(2)?;
            (color.len() == count).then_some(())?;
            let place = [(place[0] + 0.5) / size[0], (place[1] + 0.5) / size[1]];
            Step::Probe { place: Some(place), color: color.to_vec() }
        }
        _ => return None,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_configuration_stands_in_a_comment() {
        let text = "// [config]\n// expect_result: fail\n// glsl_version: 3.00 es\n\
            // require_extensions: GL_A !GL_B\n// [end config]\nvoid main() {}\n";
        let case =
            text_of_stage("own.frag", text, Stage::Fragment).expect("it has a configuration");
        assert_eq!(case.expect, Expect::Refused);
        assert_eq!(case.version, Version { number: 300, es: true });
        assert_eq!(case.extensions, ["GL_A", "!GL_B"]);
        assert!(text_of_stage("own.frag", "void main() {}", Stage::Fragment).is_none());
    }

    #[test]
    fn unknown_steps_are_kept() {
        let case = program("own.shader_test", "[test]\nlink success\northo\nprobe all rgb 0 1 0\n");
        let probe = Step::Probe { place: None, color: vec![0.0, 1.0, 0.0] };
        assert_eq!(case.steps, [Step::Unknown("ortho".to_owned()), probe]);
        assert_eq!(case.expect, Expect::Values);
    }
}
