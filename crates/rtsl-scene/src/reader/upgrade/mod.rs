//! Scenes of earlier versions of pbrt, as commands of pbrt-v4's format: what `pbrt --upgrade` makes of them. What that
//! refuses becomes the nearest thing that the format has.
//!
//! One command becomes none, one or several. A translation has a file for each kind of entity: [`settings`],
//! [`textures`], [`materials`], [`lights`] and [`shapes`]. [`known`] lists what pbrt-v4 takes; other parameters are
//! left out.

mod context;
mod known;
mod lights;
mod marks;
mod materials;
mod nurbs;
mod parameters;
mod settings;
mod shapes;
mod surfaces;
mod textures;

use std::collections::{BTreeMap, BTreeSet};

use rtsl::Span;

use super::command_memory::entity_kind;
use super::directive::Keyword;
use super::parameter::{Parameter, ParameterType};
use super::parser::{Command, SpannedText};
use crate::EntityKind;
use context::{Context, MAX_KEPT};
use materials::Opacity;
use parameters::Parameters;

pub use context::{Note, Target};
pub use known::parameters as format_parameters;
pub use marks::is_old_text;

/// Upgrades the commands of a scene, in order.
pub struct Upgrader {
    context: Context,
    /// The first thing that only earlier versions have, if one was found.
    is_old: bool,
    state: State,
    blocks: Vec<Block>,
    /// The named materials, as they were given, with their opacities.
    named: BTreeMap<String, (Command, Option<Opacity>)>,
    has_integrator: bool,
    world: World,
}

/// The parts of the graphics state that upgrades depend on.
#[derive(Clone, Default)]
struct State {
    /// The command of the current material, as it was given.
    material: Option<Command>,
    opacity: Option<Opacity>,
}

struct Block {
    /// True for one that restores the transform only.
    is_transform: bool,
    saved: State,
    /// For such a block, the commands in it that change other parts of the state.
    changes: Vec<Command>,
}

#[derive(Clone, Copy, PartialEq)]
enum World {
    Before,
    Open,
    Ended,
}

/// Parameters of materials that earlier versions look for at shapes first.
const OF_MATERIALS: [&str; 16] = [
    "Kd",
    "Ks",
    "Kr",
    "Kt",
    "sigma",
    "roughness",
    "uroughness",
    "vroughness",
    "index",
    "eta",
    "k",
    "opacity",
    "bumpmap",
    "reflect",
    "transmit",
    "remaproughness",
];

impl Upgrader {
    /// Begins an upgrade. Scenes are not upgraded before something is found that only earlier versions have.
    pub fn new(target: Target) -> Self {
        Upgrader {
            context: Context::new(target),
            is_old: false,
            state: State::default(),
            blocks: Vec::new(),
            named: BTreeMap::new(),
            has_integrator: false,
            world: World::Before,
        }
    }

    /// True if the scene is one of an earlier version.
    pub fn is_old(&self) -> bool {
        self.is_old
    }

    /// Declares the scene one of an earlier version.
    pub fn set_old(&mut self) {
        self.is_old = true;
    }

    /// True if a command has a name that only earlier versions have.
    pub fn is_old_name(command: &Command) -> bool {
        marks::is_old_name(command)
    }

    /// The messages since the last call.
    pub fn take_notes(&mut self) -> Vec<Note> {
        std::mem::take(&mut self.context.notes)
    }

    /// Returns the commands of pbrt-v4's format that have the effect of one of an earlier version.
    pub fn upgrade(&mut self, mut command: Command) -> Vec<Command> {
        self.keep_last_parameters(&mut command);
        if self.world == World::Ended {
            if command.keyword == Keyword::WorldBegin {
                self.context.note("only the first world of a file is rendered", command.span);
            }
            return Vec::new();
        }
        let upgraded = match command.keyword {
            Keyword::WorldBegin => {
                self.world = World::Open;
                vec![command]
            }
            Keyword::WorldEnd => {
                self.world = World::Ended;
                Vec::new()
            }
            Keyword::AttributeBegin | Keyword::ObjectBegin | Keyword::TransformBegin => {
                vec![self.begin(command)]
            }
            Keyword::AttributeEnd | Keyword::ObjectEnd | Keyword::TransformEnd => self.end(command),
            Keyword::ObjectInstance => {
                let mut command = command;
                let name = &mut command.texts[0].text;
                *name = self.context.objects.current(name).to_owned();
                vec![command]
            }
            Keyword::Material => vec![self.material(command)],
            Keyword::MakeNamedMaterial => vec![self.make_named_material(command)],
            Keyword::NamedMaterial => vec![self.named_material(command)],
            Keyword::Shape => self.shape(command),
            _ => self.entity(command).into_iter().collect(),
        };
        self.record_changes(&upgraded);
        let mut all = std::mem::take(&mut self.context.before);
        all.extend(upgraded);
        all
    }

    /// Keeps the last of parameters of the same name: pbrt-v4 takes a second one for an error.
    fn keep_last_parameters(&mut self, command: &mut Command) {
        let mut later = BTreeSet::new();
        let mut counts: Vec<bool> =
            command.parameters.iter().rev().map(|it| later.insert(it.name.as_str())).collect();
        if counts.iter().all(|counts| *counts) {
            return;
        }
        command.parameters.retain(|parameter| {
            let counts = counts.pop().unwrap_or(true);
            if !counts {
                let name = &parameter.name;
                let message = format!("parameter `{name}` is given twice: the last one counts");
                self.context.note(message, parameter.declaration);
            }
            counts
        });
    }

    /// Upgrades a command whose effect does not depend on others.
    fn entity(&mut self, mut command: Command) -> Option<Command> {
        let context = &mut self.context;
        let list = &mut command.parameters;
        let Some(name) = command.texts.first().cloned() else { return Some(command) };
        let mut parameters = Parameters::new(list, name.span);
        let parameters = &mut parameters;
        let class = match command.keyword {
            Keyword::Camera => settings::camera(&name.text, parameters),
            Keyword::Film => settings::film(&name.text, parameters),
            Keyword::PixelFilter => settings::filter(&name.text, parameters),
            Keyword::Sampler => settings::sampler(&name.text, parameters),
            Keyword::Accelerator => settings::accelerator(&name.text, parameters, context.target)?,
            Keyword::Integrator | Keyword::SurfaceIntegrator | Keyword::Renderer => {
                let is_other = command.keyword == Keyword::Renderer && name.text != "metropolis";
                if is_other || std::mem::replace(&mut self.has_integrator, true) {
                    return None;
                }
                command.keyword = Keyword::Integrator;
                settings::integrator(&name.text, parameters, context)
            }
            Keyword::VolumeIntegrator | Keyword::SearchPath => return None,
            Keyword::Volume => {
                let message =
                    "participating media are not supported: the scene is rendered without them";
                context.note(message, command.span);
                return None;
            }
            Keyword::MakeNamedMedium => {
                if parameters.text("type") == Some("heterogeneous") {
                    parameters.set_text("type", "uniformgrid");
                }
                return Some(command);
            }
            Keyword::Texture => {
                textures::texture(&mut command, context);
                self.leave_out_unknown(&mut command, 2);
                return Some(command);
            }
            Keyword::LightSource => lights::light(&name.text, parameters, context),
            Keyword::AreaLightSource => lights::area_light(&name.text, parameters),
            _ => return Some(command),
        };
        command.texts[0].text = class;
        self.leave_out_unknown(&mut command, 0);
        Some(command)
    }

    /// Removes the parameters that pbrt-v4 does not have. `class` is the index of the class among the command's texts.
    /// Returns them.
    fn leave_out_unknown(&mut self, command: &mut Command, class: usize) -> Vec<Parameter> {
        let Some(kind) = entity_kind(command.keyword) else { return Vec::new() };
        let SpannedText { text, span } = command.texts[class].clone();
        let Some(known) = known::parameters(kind, &text) else { return Vec::new() };
        // This program's name for an entity.
        let is_name = |it: &Parameter| it.name == "name" && it.kind == ParameterType::Text;
        let is_known = |it: &Parameter| known.iter().any(|list| list.contains(&it.name.as_str()));
        let is_place = |it: &Parameter| kind == EntityKind::Material && it.name == "type";
        let mut parameters = Parameters::new(&mut command.parameters, span);
        let unknown = parameters.remove_unless(|it| is_known(it) || is_name(it) || is_place(it));
        let of_material =
            |it: &Parameter| kind == EntityKind::Shape && OF_MATERIALS.contains(&it.name.as_str());
        let is_replaced = std::mem::take(&mut self.context.is_replaced);
        for parameter in unknown.iter().filter(|it| !is_replaced && !of_material(it)) {
            let (name, kind) = (&parameter.name, kind.word());
            let message =
                format!("`{name}` has no effect: pbrt-v4's {kind} `{text}` has no such parameter");
            self.context.note(message, parameter.declaration);
        }
        unknown
    }

    fn begin(&mut self, mut command: Command) -> Command {
        let is_transform = command.keyword == Keyword::TransformBegin;
        if is_transform {
            command.keyword = Keyword::AttributeBegin;
        }
        if command.keyword == Keyword::ObjectBegin {
            let name = &mut command.texts[0].text;
            *name = self.context.objects.define(name);
        }
        let saved = self.state.clone();
        self.blocks.push(Block { is_transform, saved, changes: Vec::new() });
        command
    }

    /// Ends a block. The state that one of a transform does not restore is set again after it.
    fn end(&mut self, mut command: Command) -> Vec<Command> {
        let is_transform = command.keyword == Keyword::TransformEnd;
        if is_transform {
            command.keyword = Keyword::AttributeEnd;
        }
        let mut commands = vec![command];
        if let Some(block) = self.blocks.pop_if(|it| it.is_transform == is_transform) {
            if is_transform {
                commands.extend(block.changes);
            } else {
                self.state = block.saved;
            }
        }
        commands
    }

    /// Records changes of the state in a block that restores the transform only.
    fn record_changes(&mut self, commands: &[Command]) {
        let Some(block) = self.blocks.last_mut().filter(|block| block.is_transform) else { return };
        for command in commands {
            let kind = |it: &Command| match it.keyword {
                Keyword::Material | Keyword::NamedMaterial => Some(Keyword::Material),
                Keyword::AreaLightSource => Some(Keyword::AreaLightSource),
                Keyword::MediumInterface => Some(Keyword::MediumInterface),
                Keyword::ReverseOrientation => Some(Keyword::ReverseOrientation),
                _ => None,
            };
            let Some(own) = kind(command) else { continue };
            let earlier = block.changes.iter().position(|it| kind(it) == Some(own));
            earlier.map(|place| block.changes.remove(place));
            // Flipped twice is not flipped.
            if own != Keyword::ReverseOrientation || earlier.is_none() {
                block.changes.push(command.clone());
            }
        }
    }

    fn material(&mut self, command: Command) -> Command {
        let (upgraded, opacity) = self.upgraded_material(command.clone());
        self.state = State { material: kept(command), opacity };
        upgraded
    }

    fn upgraded_material(&mut self, mut command: Command) -> (Command, Option<Opacity>) {
        self.context.use_textures(&mut command.parameters, false);
        let name = command.texts[0].clone();
        let mut parameters = Parameters::new(&mut command.parameters, name.span);
        let (class, opacity) = materials::material(&name.text, &mut parameters, &mut self.context);
        command.texts[0].text = class;
        self.leave_out_unknown(&mut command, 0);
        (command, opacity)
    }

    fn make_named_material(&mut self, command: Command) -> Command {
        let name = command.texts[0].clone();
        let new_name = self.context.materials.define(&name.text);
        // As a `Material` of the class that is the value of a parameter.
        let mut material = command.clone();
        let kind = Parameters::new(&mut material.parameters, name.span).take("type");
        let Some(kind) = kind else { return command };
        let class = kind.first_text().unwrap_or_default().to_owned();
        material.keyword = Keyword::Material;
        material.texts = vec![SpannedText { text: class, span: kind.values_span }];
        let kept_material = kept(material.clone());
        let (mut upgraded, opacity) = self.upgraded_material(material);
        if let Some(material) = kept_material {
            self.named.insert(new_name.clone(), (material, opacity));
        }
        let class = std::mem::replace(&mut upgraded.texts[0].text, new_name);
        upgraded.texts[0].span = name.span;
        upgraded.keyword = Keyword::MakeNamedMaterial;
        let mut parameters = std::mem::take(&mut upgraded.parameters);
        upgraded.parameters.push(kind);
        Parameters::new(&mut upgraded.parameters, name.span).set_text("type", &class);
        upgraded.parameters.append(&mut parameters);
        upgraded
    }

    fn named_material(&mut self, mut command: Command) -> Command {
        let name = &mut command.texts[0].text;
        *name = self.context.materials.current(name).to_owned();
        let named = self.named.get(name.as_str());
        self.state = State {
            material: named.map(|(material, _)| material.clone()),
            opacity: named.and_then(|(_, opacity)| opacity.clone()),
        };
        command
    }

    /// Upgrades a shape. Parameters of a material at it make a material for it alone.
    fn shape(&mut self, mut command: Command) -> Vec<Command> {
        self.context.use_textures(&mut command.parameters, false);
        let name = command.texts[0].clone();
        let mut parameters = Parameters::new(&mut command.parameters, name.span);
        command.texts[0].text = shapes::shape(&name.text, &mut parameters, &mut self.context);
        let unknown = self.leave_out_unknown(&mut command, 0);
        let (material, opacity) = self.own_material(&unknown, name.span);
        let mut parameters = Parameters::new(&mut command.parameters, name.span);
        if !parameters.has("alpha") {
            match &opacity {
                Some(Opacity::Number(number)) => parameters.set_number("alpha", *number),
                Some(Opacity::Texture(texture)) => parameters.set_texture("alpha", texture),
                None => {}
            }
        }
        let Some(material) = material else { return vec![command] };
        let block = |keyword: Keyword| Command::new(keyword, command.span);
        let (begin, end) = (block(Keyword::AttributeBegin), block(Keyword::AttributeEnd));
        vec![begin, material, command, end]
    }

    /// The current material with parameters of a shape, if it has any, and the opacity.
    fn own_material(
        &mut self,
        given: &[Parameter],
        span: Span,
    ) -> (Option<Command>, Option<Opacity>) {
        let of_material: Vec<&Parameter> =
            given.iter().filter(|it| OF_MATERIALS.contains(&it.name.as_str())).collect();
        if of_material.is_empty() {
            return (None, self.state.opacity.clone());
        }
        let matte = || {
            let mut matte = Command::new(Keyword::Material, span);
            matte.texts.push(SpannedText { text: "matte".to_owned(), span });
            matte
        };
        let mut material = self.state.material.clone().unwrap_or_else(matte);
        let mut parameters = Parameters::new(&mut material.parameters, span);
        for parameter in of_material {
            parameters.put(&parameter.name, parameter.clone());
        }
        let (material, opacity) = self.upgraded_material(material);
        (Some(material), opacity)
    }
}

/// A definition, if it is small enough to be kept.
fn kept(command: Command) -> Option<Command> {
    let values: usize = command.parameters.iter().map(|it| it.values.len()).sum();
    (values <= MAX_KEPT).then_some(command)
}
