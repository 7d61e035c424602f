//! Parameters of settings.

use rtsl::{Diagnostic, Diagnostics, diagnostic_codes as codes, most_similar};

use crate::description::Entity;
use crate::reader::{Parameter, ParameterType, Values};

/// The error of a setting that does not exist.
pub fn unknown_setting(entity: &Entity, known: &[&str]) -> Diagnostic {
    let message = format!("unknown {} `{}`", entity.kind.word(), entity.class);
    let diagnostic = Diagnostic::new(codes::UNKNOWN_CLASS, message).at(entity.class_span, "");
    match most_similar(&entity.class, known.iter().copied()) {
        Some(near) => diagnostic.help(format!("did you mean `{near}`?")),
        None => diagnostic.help(format!("known are {}", known.join(", "))),
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
        self.entity.parameters.iter().find(|parameter| parameter.name == name)
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

    /// Ignores parameters of the format that have no effect.
    pub fn ignore(&mut self, names: &[&'static str]) {
        for name in names {
            if let Some(parameter) = self.take(name) {
                let message = format!("`{name}` has no effect on this renderer");
                self.diagnostics.push(
                    Diagnostic::new(codes::IGNORED_SETTING, message).at(parameter.declaration, ""),
                );
            }
        }
    }

    pub fn finish(self) {
        let unknown =
            self.entity.parameters.iter().filter(|it| !self.taken.contains(&it.name.as_str()));
        for parameter in unknown {
            let (kind, name) = (self.entity.kind.word(), &parameter.name);
            let message = format!("{kind} `{}` has no parameter `{name}`", self.entity.class);
            let diagnostic =
                Diagnostic::new(codes::UNKNOWN_PARAMETER, message).at(parameter.declaration, "");
            self.diagnostics.push(match most_similar(name, self.taken.iter().copied()) {
                Some(near) => diagnostic.help(format!("did you mean `{near}`?")),
                None => diagnostic.help(format!("it has {}", self.taken.join(", "))),
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
