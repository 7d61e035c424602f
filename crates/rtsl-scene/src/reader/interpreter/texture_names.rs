//! The two name spaces of textures: those for numbers, and those for colours. Where one name has both, the one that was
//! defined later is renamed, and so are the parameters that refer to it.

use std::collections::{BTreeMap, BTreeSet};

use super::Interpreter;
use crate::description::{Entity, EntityId, EntityKind};
use crate::reader::parameter::{ParameterType, ReferenceKind, Values};

/// Parameters of the format that refer to textures for numbers.
const FLOAT_PARAMETERS: &[&str] = &[
    "alpha",
    "amount",
    "beta_m",
    "beta_n",
    "conductor.roughness",
    "conductor.uroughness",
    "conductor.vroughness",
    "displacement",
    "eta",
    "eumelanin",
    "g",
    "interface.roughness",
    "interface.uroughness",
    "interface.vroughness",
    "pheomelanin",
    "roughness",
    "scale",
    "thickness",
    "uroughness",
    "vroughness",
];

/// Parameters of the format that refer to textures for colours.
const COLOR_PARAMETERS: &[&str] = &[
    "albedo",
    "color",
    "conductor.eta",
    "conductor.k",
    "k",
    "mfp",
    "reflectance",
    "sigma_a",
    "sigma_s",
    "transmittance",
];

/// Parameters of textures that refer to textures of their own type.
const OWN_PARAMETERS: &[&str] = &["inside", "outside", "tex", "tex1", "tex2"];

/// The textures of one name.
#[derive(Clone, Copy, Debug, Default)]
pub struct NamedTextures {
    /// The one for numbers.
    pub float: Option<EntityId>,
    /// The one for colours.
    pub color: Option<EntityId>,
}

impl NamedTextures {
    /// Returns the texture for numbers, or that for colours.
    pub fn of(&mut self, is_float: bool) -> &mut Option<EntityId> {
        if is_float { &mut self.float } else { &mut self.color }
    }
}

impl Interpreter<'_> {
    /// Gives textures that share a name different ones.
    pub fn separate_textures(&mut self) {
        let mut renamed = BTreeMap::new();
        for (name, textures) in &self.named_textures {
            let NamedTextures { float: Some(float), color: Some(color) } = *textures else {
                continue;
            };
            let is_float = float > color;
            let mut other = format!("{name} ({})", if is_float { "float" } else { "spectrum" });
            while self.named_textures.contains_key(&other) {
                other.push('\'');
            }
            let later = float.max(color);
            self.description.entities[later.0].name = Some(other.clone());
            renamed.insert(name.clone(), (is_float, other));
        }
        if renamed.is_empty() {
            return;
        }
        let float_textures: BTreeSet<EntityId> =
            self.named_textures.values().filter_map(|textures| textures.float).collect();
        for (index, entity) in self.description.entities.iter_mut().enumerate() {
            let is_float = float_textures.contains(&EntityId(index));
            rename_references(entity, is_float, &renamed);
        }
    }
}

/// Renames the references of an entity, which may be a texture for numbers, to textures that were renamed: for each old
/// name the type of the texture and its new name.
fn rename_references(
    entity: &mut Entity,
    is_float: bool,
    renamed: &BTreeMap<String, (bool, String)>,
) {
    for parameter in &mut entity.parameters {
        if parameter.kind != ParameterType::Reference(ReferenceKind::Texture) {
            continue;
        }
        let wanted = wants_float(entity.kind, &entity.class, &parameter.name, is_float);
        let Values::Texts(names) = &mut parameter.values else { continue };
        for name in names {
            if let Some((is_float, other)) = renamed.get(name)
                && wanted == Some(*is_float)
            {
                name.clone_from(other);
            }
        }
    }
}

/// True if a parameter refers to textures for numbers, and false if to those for colours; `None` for parameters that
/// the format does not have.
fn wants_float(kind: EntityKind, class: &str, parameter: &str, is_float: bool) -> Option<bool> {
    let is = |list: &[&str]| list.contains(&parameter);
    if kind == EntityKind::Texture && is(OWN_PARAMETERS) {
        return Some(is_float);
    }
    let is_metal = kind == EntityKind::Material && class == "conductor" && parameter == "eta";
    if is_metal || is(COLOR_PARAMETERS) {
        return Some(false);
    }
    is(FLOAT_PARAMETERS).then_some(true)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::reader::format_page::{PageEntity, entities};

    #[test]
    fn parameters_refer_to_the_textures_of_the_formats_page() {
        let mut differences = Vec::new();
        let mut count = 0;
        for PageEntity { kind, class, parameters } in entities() {
            for (types, name) in parameters {
                let has = |wanted: &str| types.iter().any(|it| it == wanted);
                if !has("texture") {
                    continue;
                }
                // Those of both types are of textures, and refer to textures of their own type.
                let expected = match has("rgb") {
                    true if has("float") => [false, true].map(Some),
                    is_color => [Some(!is_color); 2],
                };
                let found = [false, true].map(|it| wants_float(kind, &class, &name, it));
                let is_left_out = kind == EntityKind::Texture && name == "tex";
                if found != expected && !is_left_out {
                    differences.push(format!("{kind:?} {class} {name}: {found:?}"));
                }
                count += 1;
            }
        }
        assert!(differences.is_empty(), "{differences:#?}");
        assert!(count > 70, "{count}");
    }
}
