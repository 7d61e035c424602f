//! A text with one line for each object of a glTF file, to which messages point: the file itself may be binary.

use std::collections::BTreeMap;

use gltf::json::Root;
use rtsl::{SourceMap, Span};

/// The kinds of objects that messages name.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Kind {
    /// The file as a whole.
    File,
    /// A node.
    Node,
    /// A mesh.
    Mesh,
    /// A material.
    Material,
    /// A texture.
    Texture,
    /// A camera.
    Camera,
    /// A light.
    Light,
}

/// The places of objects in the text.
pub struct Outline {
    whole: Span,
    spans: BTreeMap<(Kind, usize), Span>,
}

impl Outline {
    /// Adds the outline of the file `path` to the sources.
    pub fn new(path: &str, root: &Root, lights: &[Option<&str>], map: &mut SourceMap) -> Self {
        let mut text = format!("glTF {}\n", root.asset.version);
        let mut places = Vec::new();
        let mut line = |kind: Kind, word: &str, index: usize, name: Option<&str>| {
            let start = text.len() as u32;
            text.push_str(&format!("{word}[{index}]"));
            if let Some(name) = name.filter(|name| !name.is_empty()) {
                let printable = name.chars().filter(|letter| !letter.is_control()).take(60);
                text.push_str(&format!(" \"{}\"", printable.collect::<String>()));
            }
            places.push(((kind, index), start, text.len() as u32));
            text.push('\n');
        };
        let names = root.nodes.iter().map(|it| it.name.as_deref()).enumerate();
        names.for_each(|(index, name)| line(Kind::Node, "nodes", index, name));
        let names = root.meshes.iter().map(|it| it.name.as_deref()).enumerate();
        names.for_each(|(index, name)| line(Kind::Mesh, "meshes", index, name));
        let names = root.materials.iter().map(|it| it.name.as_deref()).enumerate();
        names.for_each(|(index, name)| line(Kind::Material, "materials", index, name));
        let names = root.textures.iter().map(|it| it.name.as_deref()).enumerate();
        names.for_each(|(index, name)| line(Kind::Texture, "textures", index, name));
        let names = root.cameras.iter().map(|it| it.name.as_deref()).enumerate();
        names.for_each(|(index, name)| line(Kind::Camera, "cameras", index, name));
        let names = lights.iter().copied().enumerate();
        names.for_each(|(index, name)| line(Kind::Light, "lights", index, name));
        let end = text.find('\n').unwrap_or(0) as u32;
        // The name is none of a file, which would be compared with this text.
        let file = map.add(format!("{path}#contents"), text);
        let spans = places
            .into_iter()
            .map(|(object, start, end)| (object, Span::new(file, start, end)))
            .collect();
        Outline { whole: Span::new(file, 0, end), spans }
    }

    /// Returns the place of an object.
    pub fn span(&self, kind: Kind, index: usize) -> Span {
        self.spans.get(&(kind, index)).copied().unwrap_or(self.whole)
    }

    /// Returns the place of the file as a whole.
    pub fn whole(&self) -> Span {
        self.whole
    }
}
