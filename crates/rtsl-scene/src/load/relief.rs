//! Relief of materials: every material takes `displacement`, a texture of heights, and `normalmap`, the file of an
//! image of normals, unless its class has parameters of these names. As in pbrt, heights count where both are given.

use std::sync::Arc;

use rtsl::{Diagnostic, Instance, Value, diagnostic_codes as codes};

use super::{Arguments, IMAGE_TEXTURE, Loader};
use crate::arguments::texture;
use crate::description::{Entity, EntityKind};
use crate::reader::{Parameter, Values};

/// The parameters of every material for its relief.
pub const PARAMETERS: [&str; 2] = [HEIGHTS, NORMALS];

const HEIGHTS: &str = "displacement";
const NORMALS: &str = "normalmap";

/// The classes of materials with relief, and their parameters.
const BUMP: &str = "Bump";
const NORMAL_MAP: &str = "NormalMap";

impl Loader<'_, '_> {
    /// A material with the relief that its entity asks for, over its own instance; `Some(None)` if there is none, `None`
    /// if an error was reported. Its other instances are recorded in `arguments`.
    pub(super) fn relief(
        &mut self,
        entity: &Entity,
        base: &Arc<Instance>,
        arguments: &mut Arguments,
    ) -> Option<Option<Arc<Instance>>> {
        let parameter = |name: &str| {
            let is_own = base.class().parameters.iter().any(|parameter| parameter.name == name);
            let mut given = entity.parameters.iter();
            given.find(|it| entity.kind == EntityKind::Material && it.name == name && !is_own)
        };
        let (class, relief) = if let Some(heights) = parameter(HEIGHTS) {
            // A surface that is raised by the same everywhere has no slopes.
            if matches!(heights.values, Values::Numbers(_)) {
                return Some(None);
            }
            let heights = self.resolve(arguments, |resolver| texture(heights, resolver))?;
            (BUMP, ("displacement", heights))
        } else if let Some(normals) = parameter(NORMALS) {
            (NORMAL_MAP, ("normals", self.normals(normals, arguments)?))
        } else {
            return Some(None);
        };
        let (name, texture) = relief;
        let values =
            vec![("base", Value::Instance(base.clone())), (name, Value::Instance(texture))];
        let material = self.standard_instance(class, values)?;
        arguments.standard.push(material.class().clone());
        Some(Some(material))
    }

    /// The texture of a map of normals.
    fn normals(
        &mut self,
        parameter: &Parameter,
        arguments: &mut Arguments,
    ) -> Option<Arc<Instance>> {
        let file = match &parameter.values {
            Values::Texts(texts) if texts.len() == 1 => &texts[0],
            _ => {
                let message = format!("`{NORMALS}` takes the name of an image file");
                let diagnostic = Diagnostic::new(codes::WRONG_VALUE, message);
                self.diagnostics.push(diagnostic.at(parameter.values_span, ""));
                return None;
            }
        };
        let values = match self.images.linear(file, self.files) {
            Ok(values) => values,
            Err(diagnostic) => {
                self.diagnostics.push(diagnostic.at(parameter.values_span, "named here"));
                return None;
            }
        };
        let values = values.iter().map(|(name, value)| (name.as_str(), value.clone())).collect();
        let texture = self.standard_instance(IMAGE_TEXTURE, values)?;
        arguments.standard.push(texture.class().clone());
        Some(texture)
    }
}
