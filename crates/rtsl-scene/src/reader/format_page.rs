//! The rows of the manual's page of the format, with which tables are compared.

use crate::description::EntityKind;

const PAGE: &str =
    concat!(env!("CARGO_MANIFEST_DIR"), "/../../docs/src/reference/scenes/format.md");

/// The kinds of entities by their directives.
const KINDS: [(&str, EntityKind); 10] = [
    ("Camera", EntityKind::Camera),
    ("Film", EntityKind::Film),
    ("PixelFilter", EntityKind::Filter),
    ("Sampler", EntityKind::Sampler),
    ("Integrator", EntityKind::Integrator),
    ("Texture", EntityKind::Texture),
    ("Material", EntityKind::Material),
    ("AreaLightSource", EntityKind::AreaLight),
    ("LightSource", EntityKind::Light),
    ("Shape", EntityKind::Shape),
];

/// An entity of the page.
pub struct PageEntity {
    pub kind: EntityKind,
    pub class: String,
    /// The parameters: their types, and their names.
    pub parameters: Vec<(Vec<String>, String)>,
}

/// Returns the entities of the page.
pub fn entities() -> Vec<PageEntity> {
    let page = std::fs::read_to_string(PAGE).expect("there is a page");
    let mut entities: Vec<PageEntity> = Vec::new();
    for line in page.lines() {
        if let Some(heading) = line.strip_prefix("### ") {
            let heading = heading.replace('`', "");
            let (directive, class) = heading.split_once(' ').expect("a directive and a name");
            let (_, kind) = KINDS.iter().find(|(name, _)| *name == directive).expect("a kind");
            entities.push(PageEntity {
                kind: *kind,
                class: class.to_owned(),
                parameters: Vec::new(),
            });
        }
        let declaration = line.strip_prefix("| `").and_then(|rest| rest.split_once('`'));
        let words = declaration.and_then(|(declaration, _)| declaration.rsplit_once(' '));
        if let (Some(entity), Some((types, name))) = (entities.last_mut(), words) {
            let types = types.split(", ").map(str::to_owned).collect();
            entity.parameters.push((types, name.to_owned()));
        }
    }
    assert!(entities.len() > 60, "{}", entities.len());
    entities
}
