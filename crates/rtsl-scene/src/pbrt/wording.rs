//! The names that messages about an entity have: those of the scene, where a name of the format stands for a class.

use rtsl::{Class, Diagnostic, Wording, diagnostic_codes as codes, most_similar};

use super::name::PbrtName;
use crate::description::Entity;
use crate::reader::{Parameter, Values, format_parameters};

/// An entity with its class, for messages.
#[derive(Clone, Copy)]
pub struct NamedEntity<'a> {
    pub entity: &'a Entity,
    pub class: &'a Class,
    /// The meaning of the entity's class, if that is a name of the format.
    pub standard: Option<&'static PbrtName>,
}

impl<'a> NamedEntity<'a> {
    /// The subject of messages: "material `diffuse`", or "`Lambertian`" where the scene names the class itself.
    fn subject(&self) -> String {
        match self.renamed() {
            Some(_) => format!("{} `{}`", self.entity.kind.word(), self.entity.class),
            None => format!("`{}`", self.class.name),
        }
    }

    /// The meaning of the entity's class, unless the scene names the class itself.
    fn renamed(&self) -> Option<&'static PbrtName> {
        self.standard.filter(|standard| standard.class != self.entity.class)
    }

    /// Returns the name that the scene has for a parameter, which has that of the class after translation.
    pub fn written<'p>(&'p self, parameter: &'p Parameter) -> &'p str {
        let Some(standard) = self.renamed() else { return &parameter.name };
        let given = &self.entity.parameters;
        let is_same = |it: &&Parameter| standard.parameter(&it.name) == parameter.name;
        let is_there = |it: &&Parameter| it.declaration == parameter.declaration;
        let found = given.iter().find(is_same).or_else(|| given.iter().find(is_there));
        found.map_or(&parameter.name, |it| &it.name)
    }

    /// The error of a parameter that neither the format nor the class has.
    pub fn unknown_parameter(&self, parameter: &Parameter) -> Box<Diagnostic> {
        let Entity { kind, class, .. } = self.entity;
        let of_format = self.renamed().and_then(|_| format_parameters(*kind, class));
        let known = match of_format {
            Some([common, own]) => [own, common].concat(),
            None => self.class.parameters.iter().map(|it| it.name.as_str()).collect(),
        };
        let name = parameter.name.as_str();
        if known.contains(&name) {
            // A parameter of the format that was not translated, because its values have no meaning.
            let found = match &parameter.values {
                Values::Texts(texts) => format!("`{}`", texts.join("`, `")),
                other => other.description().to_owned(),
            };
            let message = format!("`{name}` of {} cannot be {found}", self.subject());
            let diagnostic = Diagnostic::new(codes::WRONG_VALUE, message);
            return Box::new(diagnostic.at(parameter.values_span, ""));
        }
        unknown_parameter(&self.subject(), parameter, &known)
    }

    /// Returns the words for messages about the values of the class.
    pub fn wording(&self) -> Option<Wording> {
        let standard = self.renamed()?;
        Some(Wording { subject: self.subject(), parameters: standard.renamed_parameters() })
    }
}

/// The error of a parameter that its subject does not have, which has `known`.
pub fn unknown_parameter(subject: &str, parameter: &Parameter, known: &[&str]) -> Box<Diagnostic> {
    let name = &parameter.name;
    let message = format!("{subject} has no parameter `{name}`");
    let diagnostic =
        Diagnostic::new(codes::UNKNOWN_PARAMETER, message).at(parameter.declaration, "");
    Box::new(match most_similar(name, known.iter().copied()) {
        Some(near) => diagnostic.help(format!("did you mean `{near}`?")),
        None if known.is_empty() => diagnostic.note("it has no parameters"),
        None => diagnostic.note(format!("it has {}", known.join(", "))),
    })
}
