//! State of an upgrade: names, textures, and notes for the user.

use std::collections::{BTreeMap, BTreeSet};

use rtsl::Span;

use super::parameters::{Parameters, color_of, texture_of};
use crate::reader::parameter::{Parameter, ParameterType, ReferenceKind, Values};
use crate::reader::parser::Command;

/// The reader of an upgraded scene.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Target {
    /// This program, which has classes for some materials and textures that pbrt-v4 has not.
    Rtsl,
    /// pbrt-v4.
    Pbrt,
}

/// A message for the user.
#[derive(Clone, Debug)]
pub struct Note {
    pub message: String,
    pub span: Span,
}

/// The state that translations of commands share.
pub struct Context {
    pub target: Target,
    pub notes: Vec<Note>,
    /// The messages so far, each of which is given once.
    said: BTreeSet<String>,
    pub materials: Names,
    pub objects: Names,
    /// Textures for numbers, and for colours.
    float_textures: Names,
    color_textures: Names,
    /// The definitions of textures for colours, by their new names.
    definitions: BTreeMap<String, Command>,
    /// Textures for numbers that were made of those for colours.
    twins: BTreeSet<String>,
    /// Commands to be executed before the one that is translated.
    pub before: Vec<Command>,
    /// True if a substitute takes the place of the entity that is translated.
    pub is_replaced: bool,
}

/// Names that earlier versions allow to be defined again. Each later definition gets a name of its own.
#[derive(Default)]
pub struct Names {
    current: BTreeMap<String, (String, usize)>,
}

impl Names {
    /// Defines a name, and returns the one to use for it.
    pub fn define(&mut self, name: &str) -> String {
        let (current, count) =
            self.current.entry(name.to_owned()).or_insert_with(|| (name.to_owned(), 0));
        if *count > 0 {
            *current = format!("{name}-renamed-{}", *count - 1);
        }
        *count += 1;
        current.clone()
    }

    /// The name that was last defined for this one.
    pub fn current<'n>(&'n self, name: &'n str) -> &'n str {
        self.current.get(name).map_or(name, |(current, _)| current)
    }

    fn has(&self, name: &str) -> bool {
        self.current.contains_key(name)
    }
}

/// Parameters that take textures for numbers.
const NUMBERS: [&str; 12] = [
    "bumpmap",
    "displacement",
    "roughness",
    "uroughness",
    "vroughness",
    "sigma",
    "alpha",
    "shadowalpha",
    "amount",
    "index",
    "eta",
    "scale",
];

/// The greatest number of values of a definition that is kept for others that depend on it.
pub const MAX_KEPT: usize = 1024;

/// The greatest depth of textures that name others.
const MAX_DEPTH: usize = 32;

impl Context {
    pub fn new(target: Target) -> Self {
        Context {
            target,
            notes: Vec::new(),
            said: BTreeSet::new(),
            materials: Names::default(),
            objects: Names::default(),
            float_textures: Names::default(),
            color_textures: Names::default(),
            definitions: BTreeMap::new(),
            twins: BTreeSet::new(),
            before: Vec::new(),
            is_replaced: false,
        }
    }

    /// Gives a message, once.
    pub fn note(&mut self, message: impl Into<String>, span: Span) {
        let message = message.into();
        if self.said.insert(message.clone()) {
            self.notes.push(Note { message, span });
        }
    }

    /// Says that a substitute takes the place of an entity. Its parameters then have no effect, which is not said.
    pub fn note_substitute(&mut self, what: &str, name: &str, class: &str, span: Span) {
        let message = format!("{what} `{name}` is not supported: `{class}` takes its place");
        self.note(message, span);
        self.is_replaced = true;
    }

    /// Defines a texture, and returns the name to use for it.
    pub fn define_texture(&mut self, name: &str, is_float: bool) -> String {
        match is_float {
            true => self.float_textures.define(name),
            false => self.color_textures.define(name),
        }
    }

    /// Records the definition of a texture for colours, of which one for numbers may be made.
    pub fn record_texture(&mut self, command: &Command) {
        let values: usize = command.parameters.iter().map(|it| it.values.len()).sum();
        if values <= MAX_KEPT {
            self.definitions.insert(command.texts[0].text.clone(), command.clone());
        }
    }

    /// Replaces the names of textures by those of their last definitions. `is_float` is true for the parameters of a
    /// texture for numbers.
    pub fn use_textures(&self, parameters: &mut [Parameter], is_float: bool) {
        for parameter in parameters {
            let is_texture = parameter.kind == ParameterType::Reference(ReferenceKind::Texture);
            let wants_float = is_float || NUMBERS.contains(&parameter.name.as_str());
            if let (true, Values::Texts(names)) = (is_texture, &mut parameter.values) {
                for name in names {
                    let current = self.current_texture(name, wants_float);
                    if current != *name {
                        *name = current.to_owned();
                    }
                }
            }
        }
    }

    fn current_texture<'n>(&'n self, name: &'n str, wants_float: bool) -> &'n str {
        let (first, second) = match wants_float {
            true => (&self.float_textures, &self.color_textures),
            false => (&self.color_textures, &self.float_textures),
        };
        if first.has(name) { first.current(name) } else { second.current(name) }
    }

    /// The name of a texture for numbers with the values of the texture `name`, which is defined before the command if
    /// there is none.
    pub fn float_twin(&mut self, name: &str) -> String {
        self.twin(name, MAX_DEPTH)
    }

    fn twin(&mut self, name: &str, depth: usize) -> String {
        let Some(definition) = self.definitions.get(name).cloned() else { return name.to_owned() };
        let twin = format!("{name}-float");
        if depth == 0 || !self.twins.insert(twin.clone()) {
            return twin;
        }
        let mut command = definition;
        command.texts[0].text.clone_from(&twin);
        "float".clone_into(&mut command.texts[1].text);
        let span = command.span;
        let list = std::mem::take(&mut command.parameters);
        for parameter in list {
            let mut own = vec![parameter];
            let name = own[0].name.clone();
            if let Some(texture) = texture_of(&own[0]).map(str::to_owned) {
                let texture = self.twin(&texture, depth - 1);
                Parameters::new(&mut own, span).set_texture(&name, &texture);
            } else if let Some([red, green, blue]) = color_of(&own[0]).filter(|_| own[0].is_color())
            {
                Parameters::new(&mut own, span).set_number(&name, (red + green + blue) / 3.0);
            }
            command.parameters.append(&mut own);
        }
        self.before.push(command);
        twin
    }
}
