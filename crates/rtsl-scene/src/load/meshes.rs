//! The meshes of a scene. Shapes of one file have one.

use super::{Arguments, Loader};
use crate::description::Entity;
use crate::pbrt::{MadeMesh, MeshShape};

impl Loader<'_, '_> {
    /// The arguments of a mesh shape; `None` if an error was reported.
    pub(super) fn mesh_arguments(&mut self, mesh: MeshShape, entity: &Entity) -> Option<Arguments> {
        let path = mesh.file(entity).map(|name| self.files.path(name));
        let known = path.as_ref().and_then(|path| self.meshes.get(path));
        let made = match known {
            Some(known) => mesh.check_names(entity, &self.wanted).map(|()| known.clone()),
            None => mesh.arguments(entity, self.files, &self.wanted),
        };
        match made {
            Ok(mesh) => {
                if let Some(path) = path {
                    self.meshes.entry(path).or_insert_with(|| mesh.clone());
                }
                let MadeMesh { values, attributes, warnings } = mesh;
                for warning in warnings {
                    if self.said.insert(warning.message.clone()) {
                        self.diagnostics.push(warning.at(entity.class_span, ""));
                    }
                }
                Some(Arguments { values, attributes, ..Arguments::default() })
            }
            Err(diagnostic) => {
                self.diagnostics.push(*diagnostic);
                None
            }
        }
    }
}
