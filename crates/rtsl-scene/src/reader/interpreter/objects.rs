//! Shapes, and the objects that instances place.

use rtsl::{Diagnostic, Span, diagnostic_codes as codes};
use rtsl_math::Transform;

use super::{Executed, Interpreter, MaterialUse, defined_twice, first_text, unknown_name};
use crate::reader::parser::{Command, SpannedText};
use crate::reader::state::{BlockKind, MaterialChoice};
use crate::{EntityKind, InstanceUse, ObjectDefinition, ShapeUse};

impl Interpreter<'_> {
    pub fn open_object(&self) -> Option<usize> {
        let inside = self.blocks.iter().any(|block| block.kind == BlockKind::Object);
        inside.then(|| self.description.objects.len() - 1)
    }

    pub fn object_begin(&mut self, command: &Command) -> Executed {
        let name = first_text(command);
        if self.open_object().is_some() {
            let message = "an object is defined inside another object";
            return Err(Box::new(
                Diagnostic::new(codes::MISPLACED_DIRECTIVE, message).at(command.span, ""),
            ));
        }
        if let Some(earlier) = self.objects.get(&name.text) {
            let earlier = self.description.objects[*earlier].span;
            return Err(defined_twice("object", name, earlier));
        }
        self.objects.insert(name.text.clone(), self.description.objects.len());
        self.begin_object(name.text.clone(), name.span);
        Ok(())
    }

    /// Begins the definition of an object, and the block that it is.
    pub fn begin_object(&mut self, name: String, span: Span) {
        self.description.objects.push(ObjectDefinition { name, span, shapes: Vec::new() });
        self.begin(BlockKind::Object, span);
    }

    pub fn object_instance(&mut self, command: &Command) -> Executed {
        let name = first_text(command);
        if self.open_object().is_some() {
            let message = "an instance is placed inside the definition of an object";
            return Err(Box::new(
                Diagnostic::new(codes::MISPLACED_DIRECTIVE, message).at(command.span, ""),
            ));
        }
        if self.is_flattened(command) {
            return Ok(());
        }
        self.check_regular(command)?;
        let next = self.instantiated.len() as u32;
        let (number, _) = *self.instantiated.entry(name.text.clone()).or_insert((next, name.span));
        self.description.instances.push(InstanceUse {
            object: number,
            span: command.span,
            transform: self.state.transform.start().into(),
            end_transform: self.state.transform.end().map(|end| Box::new(end.into())),
        });
        Ok(())
    }

    /// Finds the objects of all instances, which have the numbers of their names until all objects are known.
    pub fn resolve_instances(&mut self) {
        let mut found = vec![None; self.instantiated.len()];
        let mut unknown = Vec::new();
        for (text, (number, span)) in std::mem::take(&mut self.instantiated) {
            match self.objects.get(&text) {
                Some(object) => found[number as usize] = Some(*object as u32),
                None => unknown.push((number, SpannedText { text, span })),
            }
        }
        // In the order of the text.
        unknown.sort_by_key(|(number, _)| *number);
        for (_, name) in unknown {
            let names = self.objects.keys().map(String::as_str);
            self.diagnostics.push(*unknown_name("object", &name, names));
        }
        self.description.instances.retain_mut(|instance| {
            let object = found[instance.object as usize];
            instance.object = object.unwrap_or_default();
            object.is_some()
        });
        self.description.instances.shrink_to_fit();
    }

    pub fn shape(&mut self, command: Command) -> Executed {
        if self.is_flattened(&command) {
            return Ok(());
        }
        self.check_regular(&command)?;
        let object = self.open_object();
        let shape = self.add(EntityKind::Shape, command);
        let list = match object {
            Some(object) => &mut self.description.objects[object].shapes,
            None => &mut self.description.shapes,
        };
        let material = match &self.state.material {
            MaterialChoice::Default => None,
            MaterialChoice::Made(material) => Some(*material),
            MaterialChoice::Named(name, span) => {
                let use_ =
                    MaterialUse { object, shape: list.len(), name: name.clone(), span: *span };
                self.material_uses.push(use_);
                None
            }
        };
        list.push(ShapeUse {
            shape,
            material,
            area_light: self.state.area_light,
            reverse_orientation: self.state.reverse_orientation,
        });
        Ok(())
    }

    /// True if the current transform flattens what a command places, which is then left out, with a warning.
    fn is_flattened(&mut self, command: &Command) -> bool {
        let transform = &self.state.transform;
        let mut values = [Some(transform.start()), transform.end()].into_iter().flatten();
        let is_flattened = values.any(|value| value.inverse().is_none());
        if is_flattened {
            let message = "shapes that their transform flattens are left out";
            let warning = Diagnostic::new(codes::MENDED_FAULT, message);
            self.say_once(warning.help("a scale by 0 has no inverse"), command.span);
        }
        is_flattened
    }

    pub fn check_regular(&self, command: &Command) -> Executed {
        if self.state.transform.inverse().is_some() {
            return Ok(());
        }
        let transform = &self.state.transform;
        let flattens = [Some(transform.start()), transform.end()].into_iter().flatten();
        let message = match flattens.map(Transform::inverse).any(|inverse| inverse.is_none()) {
            true => "the current transform has no inverse: it flattens what it places",
            false => "the current transform moves from one side of a mirror to the other",
        };
        Err(Box::new(Diagnostic::new(codes::BAD_TRANSFORM, message).at(command.span, "")))
    }
}
