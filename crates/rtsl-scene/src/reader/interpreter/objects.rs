//! Shapes, and the objects that instances place.

use rtsl::{Diagnostic, diagnostic_codes as codes};
use rtsl_math::Transform;

use super::{Executed, Interpreter, MaterialUse, defined_twice, first_text, unknown_name};
use crate::reader::parser::Command;
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
        self.description.objects.push(ObjectDefinition {
            name: name.text.clone(),
            span: name.span,
            shapes: Vec::new(),
        });
        self.begin(BlockKind::Object, command);
        Ok(())
    }

    pub fn object_instance(&mut self, command: &Command) -> Executed {
        let name = first_text(command);
        if self.open_object().is_some() {
            let message = "an instance is placed inside the definition of an object";
            return Err(Box::new(
                Diagnostic::new(codes::MISPLACED_DIRECTIVE, message).at(command.span, ""),
            ));
        }
        let Some(object) = self.objects.get(&name.text) else {
            let names = self.objects.keys().map(String::as_str);
            return Err(unknown_name("object", name, names));
        };
        self.check_regular(command)?;
        self.description.instances.push(InstanceUse {
            object: *object,
            span: command.span,
            transform: self.state.transform.start(),
            end_transform: self.state.transform.end(),
        });
        Ok(())
    }

    pub fn shape(&mut self, command: Command) -> Executed {
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
