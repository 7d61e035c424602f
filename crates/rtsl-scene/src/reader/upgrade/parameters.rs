//! Changes to the parameters of a command.

use rtsl::Span;

use crate::reader::parameter::{COLOR, Component, Parameter, ParameterType, ReferenceKind, Values};

const FLOAT: ParameterType =
    ParameterType::Numeric { component: Component::Float, count: 1, color: false };
const INTEGER: ParameterType =
    ParameterType::Numeric { component: Component::Int, count: 1, color: false };

/// The parameters of a command, and the place to which new ones refer.
pub struct Parameters<'c> {
    list: &'c mut Vec<Parameter>,
    at: Span,
}

impl<'c> Parameters<'c> {
    pub fn new(list: &'c mut Vec<Parameter>, at: Span) -> Self {
        Parameters { list, at }
    }

    /// The place of the command's entity.
    pub fn span(&self) -> Span {
        self.at
    }

    pub fn find(&self, name: &str) -> Option<&Parameter> {
        self.list.iter().rfind(|it| it.name == name)
    }

    pub fn has(&self, name: &str) -> bool {
        self.find(name).is_some()
    }

    /// Removes a parameter; the last one of several with the name counts.
    pub fn take(&mut self, name: &str) -> Option<Parameter> {
        let mut taken = None;
        while let Some(place) = self.list.iter().rposition(|it| it.name == name) {
            let parameter = self.list.remove(place);
            taken.get_or_insert(parameter);
        }
        taken
    }

    /// Removes parameters that earlier versions have and that change no picture.
    pub fn remove(&mut self, names: &[&str]) {
        self.list.retain(|it| !names.contains(&it.name.as_str()));
    }

    /// Gives a parameter another name, unless there is one of that name, which then counts.
    pub fn rename(&mut self, old: &str, new: &str) {
        if self.has(new) {
            self.take(old);
        }
        self.list.iter_mut().filter(|it| it.name == old).for_each(|it| it.name = new.to_owned());
    }

    /// The first number of a parameter.
    pub fn number(&self, name: &str) -> Option<f64> {
        self.find(name)?.first_number()
    }

    /// The first text of a parameter.
    pub fn text(&self, name: &str) -> Option<&str> {
        self.find(name)?.first_text()
    }

    /// The value of a boolean parameter.
    pub fn boolean(&self, name: &str) -> Option<bool> {
        self.find(name)?.first_boolean()
    }

    /// The numbers of a parameter that is no texture, nor a spectrum by wavelengths or name.
    pub fn numbers(&self, name: &str) -> Option<&[f64]> {
        let parameter = self.find(name)?;
        match (&parameter.kind, &parameter.values) {
            (ParameterType::Numeric { .. } | ParameterType::Given, Values::Numbers(numbers)) => {
                Some(numbers)
            }
            _ => None,
        }
    }

    /// A colour given by numbers.
    pub fn color(&self, name: &str) -> Option<[f64; 3]> {
        color_of(self.find(name)?)
    }

    /// The value of a colour whose components are equal.
    pub fn grey(&self, name: &str) -> Option<f64> {
        self.color(name).filter(|[red, green, blue]| red == green && green == blue).map(|it| it[0])
    }

    /// The texture that a parameter names.
    pub fn texture(&self, name: &str) -> Option<&str> {
        texture_of(self.find(name)?)
    }

    pub fn set_number(&mut self, name: &str, value: f64) {
        self.set(name, FLOAT, Values::Numbers(vec![value]));
    }

    pub fn set_integers(&mut self, name: &str, values: Vec<f64>) {
        self.set(name, INTEGER, Values::Numbers(values));
    }

    /// Sets points or vectors of so many components.
    pub fn set_points(&mut self, name: &str, count: usize, values: Vec<f64>) {
        let kind = ParameterType::Numeric { component: Component::Float, count, color: false };
        self.set(name, kind, Values::Numbers(values));
    }

    pub fn set_color(&mut self, name: &str, value: [f64; 3]) {
        self.set(name, COLOR, Values::Numbers(value.to_vec()));
    }

    pub fn set_spectrum(&mut self, name: &str, value: &str) {
        self.set(name, ParameterType::Spectrum, Values::Texts(vec![value.to_owned()]));
    }

    pub fn set_text(&mut self, name: &str, value: &str) {
        self.set_texts(name, vec![value.to_owned()]);
    }

    pub fn set_texts(&mut self, name: &str, values: Vec<String>) {
        self.set(name, ParameterType::Text, Values::Texts(values));
    }

    pub fn set_texture(&mut self, name: &str, texture: &str) {
        let kind = ParameterType::Reference(ReferenceKind::Texture);
        self.set(name, kind, Values::Texts(vec![texture.to_owned()]));
    }

    /// Sets a parameter in place of those of the same name, or after all others.
    fn set(&mut self, name: &str, kind: ParameterType, values: Values) {
        let span =
            self.find(name).map_or((self.at, self.at), |it| (it.declaration, it.values_span));
        let place = self.list.iter().position(|it| it.name == name).unwrap_or(self.list.len());
        self.take(name);
        let (declaration, values_span) = span;
        let parameter = Parameter { kind, name: name.to_owned(), declaration, values, values_span };
        self.list.insert(place.min(self.list.len()), parameter);
    }

    /// Puts a parameter that was taken, under another name.
    pub fn put(&mut self, name: &str, parameter: Parameter) {
        self.take(name);
        self.list.push(Parameter { name: name.to_owned(), ..parameter });
    }

    /// Removes the parameters that a predicate does not accept, and returns them.
    pub fn remove_unless(&mut self, accept: impl Fn(&Parameter) -> bool) -> Vec<Parameter> {
        self.list.extract_if(.., |it| !accept(it)).collect()
    }

    pub fn iter_mut(&mut self) -> impl Iterator<Item = &mut Parameter> {
        self.list.iter_mut()
    }
}

/// A colour given by numbers.
pub fn color_of(parameter: &Parameter) -> Option<[f64; 3]> {
    match (&parameter.kind, &parameter.values) {
        (
            ParameterType::Numeric { component: Component::Float, .. }
            | ParameterType::Spectrum
            | ParameterType::Given,
            Values::Numbers(numbers),
        ) => match numbers[..] {
            [grey] => Some([grey; 3]),
            [red, green, blue] => Some([red, green, blue]),
            _ => None,
        },
        _ => None,
    }
}

/// The texture that a parameter names.
pub fn texture_of(parameter: &Parameter) -> Option<&str> {
    let is_texture = parameter.kind == ParameterType::Reference(ReferenceKind::Texture);
    parameter.first_text().filter(|_| is_texture)
}
