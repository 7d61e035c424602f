//! Options of the whole scene.

use rtsl::{Diagnostic, diagnostic_codes as codes, most_similar};

use super::{Executed, Interpreter};
use crate::reader::parameter::{Parameter, Values};
use crate::reader::parser::Command;

/// Options of pbrt that change no picture that this renderer makes.
const WITHOUT_EFFECT: [&str; 7] = [
    "disablewavelengthjitter",
    "displacementedgescale",
    "msereferenceimage",
    "msereferenceout",
    "pixelstats",
    "rendercoordsys",
    "wavefront",
];

/// Options of pbrt that change the picture, with their effect there.
const UNSUPPORTED: [(&str, &str); 2] = [
    ("disabletexturefiltering", "textures are filtered"),
    ("forcediffuse", "surfaces keep their materials"),
];

impl Interpreter<'_> {
    /// Sets the options that a command gives.
    pub fn options(&mut self, command: Command) -> Executed {
        for parameter in command.parameters {
            self.option(&parameter)?;
        }
        Ok(())
    }

    fn option(&mut self, parameter: &Parameter) -> Executed {
        let letters = parameter.name.chars().filter(|letter| !matches!(letter, '_' | '-'));
        let name: String = letters.map(|letter| letter.to_ascii_lowercase()).collect();
        if name == "disablepixeljitter" {
            self.description.options.disable_pixel_jitter = boolean(parameter)?;
        } else if name == "seed" {
            self.description.options.seed = Some(seed(parameter)?);
        } else if let Some((_, instead)) = UNSUPPORTED.iter().find(|(known, _)| *known == name) {
            if boolean(parameter)? {
                let message = format!("option `{name}` is not supported: {instead}");
                self.warn_once(message, parameter.declaration);
            }
        } else if !WITHOUT_EFFECT.contains(&name.as_str()) {
            let known = WITHOUT_EFFECT.into_iter().chain(UNSUPPORTED.map(|(name, _)| name));
            let known = known.chain(["disablepixeljitter", "seed"]);
            let message = format!("unknown option `{}`: it has no effect", parameter.name);
            let diagnostic = Diagnostic::new(codes::IGNORED_SETTING, message);
            let diagnostic = diagnostic.at(parameter.declaration, "");
            self.diagnostics.push(match most_similar(&name, known) {
                Some(near) => diagnostic.help(format!("did you mean `{near}`?")),
                None => diagnostic,
            });
        }
        Ok(())
    }
}

fn boolean(parameter: &Parameter) -> Result<bool, Box<Diagnostic>> {
    match &parameter.values {
        Values::Booleans(values) if values.len() == 1 => Ok(values[0]),
        Values::Texts(values) if values.len() == 1 && values[0] == "true" => Ok(true),
        Values::Texts(values) if values.len() == 1 && values[0] == "false" => Ok(false),
        _ => Err(wrong(parameter, "`true` or `false`")),
    }
}

fn seed(parameter: &Parameter) -> Result<u64, Box<Diagnostic>> {
    match &parameter.values {
        Values::Numbers(values) if values.len() == 1 && values[0].trunc() == values[0] => {
            Ok((values[0] as i64).cast_unsigned())
        }
        _ => Err(wrong(parameter, "one whole number")),
    }
}

fn wrong(parameter: &Parameter, expected: &str) -> Box<Diagnostic> {
    let message = format!("option `{}` takes {expected}", parameter.name);
    Box::new(Diagnostic::new(codes::WRONG_VALUE, message).at(parameter.values_span, ""))
}
