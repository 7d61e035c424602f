//! The reference compiler of GLSL, `glslangValidator`, which tells whether GLSL 4.60 accepts a text.

use std::io::ErrorKind;
use std::process::{Command, Stdio};

use crate::case::{Case, Shader, Stage};
use crate::tokens::{Kind, tokens};

/// True if GLSL 4.60 accepts every text of a case, without its own `#version`. Nothing is accepted where the compiler
/// is not installed.
pub fn accepts(case: &Case) -> bool {
    case.shaders.iter().all(|shader| match shader.stage {
        Stage::Both => accepts_text(shader, "vert") && accepts_text(shader, "frag"),
        Stage::Vertex => accepts_text(shader, "vert"),
        Stage::Fragment | Stage::Other => accepts_text(shader, "frag"),
    })
}

/// True if the compiler is installed.
pub fn is_installed() -> bool {
    let mut command = Command::new("glslangValidator");
    let status = command.arg("--version").stdout(Stdio::null()).status();
    !matches!(status, Err(error) if error.kind() == ErrorKind::NotFound)
}

fn accepts_text(shader: &Shader, stage: &str) -> bool {
    // The profile with the variables and functions of earlier versions, since their absence is not what cases mean.
    let mut text = "#version 460 compatibility\n".to_owned();
    for token in tokens(&shader.text) {
        let is_version =
            token.kind == Kind::Directive && token.text[1..].trim_start().starts_with("version");
        // A text for both stages assigns what one of them has.
        let is_color = stage == "vert" && token.is("gl_FragColor");
        text += match (is_version, is_color) {
            (true, _) => "",
            (_, true) => "gl_Position",
            _ => token.text,
        };
    }
    let file = tempfile::Builder::new().suffix(&format!(".{stage}")).tempfile();
    let Ok(file) = file else { return false };
    let mut command = Command::new("glslangValidator");
    let command = command.arg(file.path()).stdout(Stdio::null()).stderr(Stdio::null());
    std::fs::write(file.path(), text).is_ok() && command.status().is_ok_and(|it| it.success())
}
