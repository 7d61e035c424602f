//! Entities: uses of classes and of settings.

use std::collections::BTreeSet;
use std::rc::Rc;

use rtsl::{Diagnostic, Span, diagnostic_codes as codes};

use super::{
    Executed, Interpreter, MAX_ATTRIBUTE_VALUES, MAX_ATTRIBUTES, defined_twice, first_text,
    unknown_name,
};
use crate::reader::conversion::FILE_PARAMETERS;
use crate::reader::files::SceneFiles;
use crate::reader::parameter::{COLOR, Parameter, ParameterType, ReferenceKind, Values};
use crate::reader::parser::{Command, SpannedText};
use crate::reader::spectra;
use crate::{Entity, EntityId, EntityKind};

impl Interpreter<'_> {
    pub fn attribute(&mut self, mut command: Command) -> Executed {
        let target = first_text(&command);
        let kind = match target.text.as_str() {
            "shape" => EntityKind::Shape,
            "light" => EntityKind::Light,
            "material" => EntityKind::Material,
            "texture" => EntityKind::Texture,
            // There are no media to which they would apply.
            "medium" => return Ok(()),
            _ => {
                let known = ["shape", "light", "material", "medium", "texture"];
                return Err(unknown_name("target of `Attribute`", target, known));
            }
        };
        self.convert_spectra(kind, &mut command.parameters);
        let list = Rc::make_mut(self.state.defaults.entry(kind).or_default());
        list.retain(|earlier| command.parameters.iter().all(|later| later.name != earlier.name));
        list.extend(command.parameters);
        let values: usize = list.iter().map(|parameter| parameter.values.len()).sum();
        if list.len() <= MAX_ATTRIBUTES && values <= MAX_ATTRIBUTE_VALUES {
            return Ok(());
        }
        list.clear();
        let message = format!(
            "`Attribute` gives more than {MAX_ATTRIBUTES} parameters or {MAX_ATTRIBUTE_VALUES} values"
        );
        Err(Box::new(Diagnostic::new(codes::SCENE_LIMIT, message).at(command.span, "")))
    }

    pub fn camera(&mut self, command: Command) -> Executed {
        self.warn_of_second(self.description.camera, &command);
        self.check_regular(&command)?;
        if let Some(inverse) = self.state.transform.inverse() {
            self.coordinate_systems.insert("camera".to_owned(), inverse);
        }
        self.description.camera = Some(self.add(EntityKind::Camera, command));
        Ok(())
    }

    /// Warns that a directive replaces an earlier one.
    pub fn warn_of_second(&mut self, earlier: Option<EntityId>, command: &Command) {
        let Some(earlier) = earlier else { return };
        let word = command.keyword.word();
        let message = format!("the scene has a second `{word}`, which replaces the first");
        self.diagnostics.push(
            Diagnostic::new(codes::IGNORED_SETTING, message)
                .at(command.span, "again here")
                .label(self.description.entities[earlier.0].class_span, "ignored"),
        );
    }

    pub fn make_named_material(&mut self, mut command: Command) -> Executed {
        let name = first_text(&command).clone();
        if let Some(earlier) = self.named_materials.get(&name.text) {
            let earlier = self.description.entities[earlier.0].class_span;
            return Err(defined_twice("material", &name, earlier));
        }
        // The class is the value of a parameter here: "string type" "Lambertian".
        let position = command.parameters.iter().position(|parameter| parameter.name == "type");
        let class = position.map(|position| command.parameters.remove(position));
        let class = match class.map(|class| (class.kind, class.values, class.values_span)) {
            Some((ParameterType::Text, Values::Texts(texts), span)) if texts.len() == 1 => {
                SpannedText { text: texts.into_iter().next().unwrap_or_default(), span }
            }
            _ => {
                let message = format!("material `{}` has no class", name.text);
                return Err(Box::new(
                    Diagnostic::new(codes::UNKNOWN_CLASS, message)
                        .at(name.span, "")
                        .help("give it as \"string type\" \"Lambertian\""),
                ));
            }
        };
        command.texts[0] = class;
        let material = self.add(EntityKind::Material, command);
        self.description.entities[material.0].name = Some(name.text.clone());
        self.named_materials.insert(name.text, material);
        Ok(())
    }

    pub fn texture(&mut self, mut command: Command) -> Executed {
        let name = command.texts[0].clone();
        let kind = &command.texts[1];
        if !["float", "spectrum", "color", "rgb"].contains(&kind.text.as_str()) {
            return Err(unknown_name(
                "type of texture",
                kind,
                ["float", "spectrum", "color", "rgb"],
            ));
        }
        let is_float = kind.text == "float";
        let mut textures = self.named_textures.get(&name.text).copied().unwrap_or_default();
        if let Some(earlier) = textures.of(is_float) {
            let earlier = self.description.entities[earlier.0].class_span;
            return Err(defined_twice("texture", &name, earlier));
        }
        command.texts.swap(0, 2);
        if command.texts[0].text == "Attribute" {
            give_default(&mut command.parameters, is_float, command.texts[0].span);
        }
        let texture = self.add(EntityKind::Texture, command);
        self.description.entities[texture.0].name = Some(name.text.clone());
        *textures.of(is_float) = Some(texture);
        self.named_textures.insert(name.text, textures);
        Ok(())
    }

    /// Adds an entity whose class is the command's first quoted string.
    pub fn add(&mut self, kind: EntityKind, command: Command) -> EntityId {
        let mut parameters = command.parameters;
        let is_file = |it: &Parameter| FILE_PARAMETERS.contains(&it.name.as_str());
        for parameter in parameters.iter().filter(|it| is_file(it)) {
            if let Some(name) = parameter.first_text() {
                self.note_backslashes(name, parameter.values_span);
            }
        }
        self.convert_spectra(kind, &mut parameters);
        if let Some(defaults) = self.state.defaults.get(&kind) {
            let given: BTreeSet<String> =
                parameters.iter().map(|parameter| parameter.name.clone()).collect();
            let missing = defaults.iter().filter(|default| !given.contains(&default.name));
            parameters.extend(missing.cloned());
        }
        let is_name = |parameter: &Parameter| {
            parameter.name == "name" && parameter.kind == ParameterType::Text
        };
        // The name of such a material is that of a medium.
        let is_medium = kind == EntityKind::Material
            && command.texts.first().is_some_and(|class| class.text == "subsurface");
        let name = parameters
            .iter()
            .position(|parameter| is_name(parameter) && !is_medium)
            .map(|position| parameters.remove(position));
        let name = name.and_then(|name| match name.values {
            Values::Texts(texts) => texts.into_iter().next(),
            Values::Numbers(_) | Values::Booleans(_) | Values::Buffer(_) => None,
        });
        let mut texts = command.texts;
        let class = texts.swap_remove(0);
        self.description.entities.push(Entity {
            kind,
            class: class.text,
            class_span: class.span,
            name,
            parameters,
            transform: self.state.transform.start(),
            end_transform: self.state.transform.end(),
        });
        EntityId(self.description.entities.len() - 1)
    }

    /// Converts spectra and colours of other spaces to linear sRGB; an invalid one is reported and becomes grey.
    pub fn convert_spectra(&mut self, kind: EntityKind, parameters: &mut [Parameter]) {
        let emits = matches!(kind, EntityKind::Light | EntityKind::AreaLight);
        // Paths are relative to the folder of the main scene file, also in included files.
        let scene = self.main_file;
        for parameter in parameters {
            spectra::convert_space(parameter, emits, self.state.color_space);
            let files = SceneFiles {
                scene,
                files: self.files,
                embedded: &self.description.embedded,
                budget: self.budget,
                texture_memory: None,
            };
            if let Err(diagnostic) = spectra::convert(parameter, emits, files) {
                parameter.kind = COLOR;
                parameter.values = Values::Numbers(vec![0.5]);
                self.diagnostics.push(*diagnostic);
            }
        }
    }

    pub fn resolve_materials(&mut self) {
        for use_ in std::mem::take(&mut self.material_uses) {
            let Some(material) = self.named_materials.get(&*use_.name) else {
                let name = (ReferenceKind::Material, use_.name.to_string());
                if !self.description.failed.insert(name) {
                    continue;
                }
                let name = SpannedText { text: use_.name.to_string(), span: use_.span };
                let names = self.named_materials.keys().map(String::as_str);
                self.diagnostics.push(*unknown_name("material", &name, names));
                continue;
            };
            let list = match use_.object {
                Some(object) => &mut self.description.objects[object].shapes,
                None => &mut self.description.shapes,
            };
            list[use_.shape].material = Some(*material);
        }
    }
}

/// Adds the default value of a texture that shows an attribute, which tells numbers and colours apart.
fn give_default(parameters: &mut Vec<Parameter>, is_float: bool, span: Span) {
    if parameters.iter().any(|parameter| parameter.name == "default") {
        return;
    }
    let count = if is_float { 1 } else { 3 };
    parameters.push(Parameter {
        kind: ParameterType::Given,
        name: "default".to_owned(),
        declaration: span,
        values: Values::Numbers(vec![0.0; count]),
        values_span: span,
    });
}
