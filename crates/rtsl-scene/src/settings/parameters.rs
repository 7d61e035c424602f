//! Parameters of settings.

use rtsl::{Code, Diagnostic, Diagnostics, diagnostic_codes as codes, most_similar};

use crate::description::Entity;
use crate::reader::{Parameter, ParameterType, Values};

/// The error of a setting that does not exist.
pub fn unknown_setting(entity: &Entity, known: &[&str]) -> Diagnostic {
    let message = format!("unknown {} `{}`", entity.kind.word(), entity.class);
    let diagnostic = Diagnostic::new(codes::UNKNOWN_CLASS, message).at(entity.class_span, "");
    let diagnostic = diagnostic.note(format!("known are {}", known.join(", ")));
    match similar(known, &entity.class) {
        Some(near) => diagnostic.help(format!("did you mean `{near}`?")),
        None => diagnostic,
    }
}

/// Takes parameters one by one; the remaining ones are unknown.
pub struct ParameterReader<'a> {
    entity: &'a Entity,
    taken: Vec<&'static str>,
    diagnostics: &'a mut Diagnostics,
}

impl<'a> ParameterReader<'a> {
    pub fn new(entity: &'a Entity, diagnostics: &'a mut Diagnostics) -> Self {
        ParameterReader { entity, taken: Vec::new(), diagnostics }
    }

    pub fn take(&mut self, name: &'static str) -> Option<&'a Parameter> {
        self.taken.push(name);
        self.entity.parameter(name)
    }

    pub fn number(&mut self, name: &'static str) -> Option<f64> {
        let parameter = self.take(name)?;
        match (&parameter.kind, &parameter.values) {
            (
                ParameterType::Numeric { count: 1, .. } | ParameterType::Given,
                Values::Numbers(values),
            ) if values.len() == 1 && (values[0] as f32).is_finite() => Some(values[0]),
            _ => self.wrong(parameter, "one number"),
        }
    }

    pub fn whole(&mut self, name: &'static str, least: f64, greatest: f64) -> Option<f64> {
        let parameter = self.take(name)?;
        match &parameter.values {
            Values::Numbers(values) if values.len() == 1 && values[0] == values[0].trunc() => {
                self.between(parameter, values[0], least, greatest)
            }
            _ => self.wrong(parameter, "one whole number"),
        }
    }

    pub fn number_between(&mut self, name: &'static str, least: f64, greatest: f64) -> Option<f64> {
        let value = self.number(name)?;
        let parameter = self.take(name)?;
        self.between(parameter, value, least, greatest)
    }

    pub fn between(
        &mut self,
        parameter: &Parameter,
        value: f64,
        least: f64,
        greatest: f64,
    ) -> Option<f64> {
        if (least..=greatest).contains(&value) {
            return Some(value);
        }
        let name = &parameter.name;
        let message = format!("`{name}` must lie between {least} and {greatest}, found {value}");
        self.diagnostics
            .push(Diagnostic::new(codes::SCENE_LIMIT, message).at(parameter.values_span, ""));
        None
    }

    /// Takes a list of `count` numbers.
    pub fn numbers(&mut self, name: &'static str, count: usize) -> Option<&'a [f64]> {
        let parameter = self.take(name)?;
        match &parameter.values {
            Values::Numbers(values) if values.len() == count => Some(values),
            _ => self.wrong(parameter, &format!("{count} numbers")),
        }
    }

    pub fn boolean(&mut self, name: &'static str) -> Option<bool> {
        let parameter = self.take(name)?;
        match &parameter.values {
            Values::Booleans(values) if values.len() == 1 => Some(values[0]),
            Values::Texts(values) if values.len() == 1 => Some(values[0] == "true"),
            _ => self.wrong(parameter, "`true` or `false`"),
        }
    }

    pub fn text(&mut self, name: &'static str) -> Option<String> {
        let parameter = self.take(name)?;
        match &parameter.values {
            Values::Texts(values) if values.len() == 1 => Some(values[0].clone()),
            _ => self.wrong(parameter, "one quoted string"),
        }
    }

    /// Takes parameters of the format that change no picture.
    pub fn accept(&mut self, names: &[&'static str]) {
        self.taken.extend(names);
    }

    /// Warns about the entity.
    pub fn warn(&mut self, message: impl Into<String>) {
        let diagnostic = Diagnostic::new(codes::IGNORED_SETTING, message.into());
        self.diagnostics.push(diagnostic.at(self.entity.class_span, ""));
    }

    /// Warns about a parameter's value, which may be a misspelling of `near`.
    pub fn warn_of(&mut self, name: &'static str, message: String, near: Option<&str>) {
        let Some(parameter) = self.take(name) else { return };
        let diagnostic = Diagnostic::new(codes::IGNORED_SETTING, message);
        let diagnostic = diagnostic.at(parameter.values_span, "");
        self.diagnostics.push(match near {
            Some(near) => diagnostic.help(format!("did you mean `{near}`?")),
            None => diagnostic,
        });
    }

    /// Reports an error of the entity.
    pub fn error(&mut self, code: Code, message: &str) {
        self.diagnostics.push(Diagnostic::new(code, message).at(self.entity.class_span, ""));
    }

    pub fn finish(self) {
        let unknown =
            self.entity.parameters.iter().filter(|it| !self.taken.contains(&it.name.as_str()));
        for parameter in unknown {
            let (kind, name) = (self.entity.kind.word(), &parameter.name);
            let message = format!("{kind} `{}` has no parameter `{name}`", self.entity.class);
            let diagnostic = |code: Code, message: String| {
                Diagnostic::new(code, message).at(parameter.declaration, "")
            };
            // A misspelt parameter is an error. One that nothing here resembles is of another version or program, and
            // the picture is not meaningless without it.
            self.diagnostics.push(match similar(&self.taken, name) {
                Some(near) => diagnostic(codes::UNKNOWN_PARAMETER, message)
                    .help(format!("did you mean `{near}`?")),
                None => diagnostic(codes::IGNORED_SETTING, format!("{message}: it has no effect")),
            });
        }
    }

    pub fn wrong<T>(&mut self, parameter: &Parameter, expected: &str) -> Option<T> {
        let found = match parameter.values.len() {
            1 => format!("one of {}", parameter.values.description()),
            count => format!("{count} {}", parameter.values.description()),
        };
        let message = format!("`{}` takes {expected}, found {found}", parameter.name);
        self.diagnostics
            .push(Diagnostic::new(codes::WRONG_VALUE, message).at(parameter.values_span, ""));
        None
    }
}

/// The parameter that was probably meant by a name: a similar one, or one that the name abbreviates.
fn similar<'k>(known: &[&'k str], name: &str) -> Option<&'k str> {
    const SHORTEST: usize = 3;
    let begins =
        |known: &str| known.get(..name.len()).is_some_and(|it| it.eq_ignore_ascii_case(name));
    let abbreviated = |known: &&'k str| name.len() >= SHORTEST && begins(known);
    most_similar(name, known.iter().copied()).or_else(|| known.iter().copied().find(abbreviated))
}
