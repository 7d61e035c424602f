//! The words of messages about the values of an instance.

use rtsl_ir::class::Class;

/// The words of messages about the values of an instance: those of its class, or of a file format that has other names.
#[derive(Clone, Debug)]
pub struct Wording {
    /// The subject: the class, or for example "camera `perspective`".
    pub subject: String,
    /// Parameters with other names: the format's name, the class's name.
    pub parameters: Vec<(&'static str, &'static str)>,
}

impl Wording {
    /// Returns the words of a class.
    pub fn of(class: &Class) -> Wording {
        Wording { subject: format!("`{}`", class.name), parameters: Vec::new() }
    }

    /// Returns the name of the class's parameter `name`.
    pub fn parameter<'a>(&self, name: &'a str) -> &'a str {
        let renamed = self.parameters.iter().find(|(_, ours)| *ours == name);
        renamed.map_or(name, |(theirs, _)| theirs)
    }
}
