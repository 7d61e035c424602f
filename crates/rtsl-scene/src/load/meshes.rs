//! The meshes of a scene. Shapes of one file have one.

use std::collections::BTreeMap;
use std::path::PathBuf;

use rayon::prelude::*;
use rtsl_memory::on_all_processors;

use super::{Arguments, Loader};
use crate::description::{Entity, EntityKind};
use crate::pbrt::{MadeMesh, MeshShape};

impl Loader<'_, '_> {
    /// Reads the files of the meshes that the scene uses, on all processors, unless instances of an earlier load have
    /// them. A file that can't be read now, perhaps for lack of memory, is read again when its shape is made.
    pub(super) fn read_meshes(&mut self) {
        let description = self.description;
        let mut named: BTreeMap<PathBuf, (MeshShape, &Entity)> = BTreeMap::new();
        for id in self.new_entities() {
            let entity = &description.entities[id.0];
            let is_shape = entity.kind == EntityKind::Shape && self.pbrt_name(entity).is_some();
            let mesh = MeshShape::named(&entity.class).filter(|_| is_shape);
            if let Some(mesh) = mesh
                && let Some(name) = mesh.file(entity)
            {
                named.entry(self.files.path(name)).or_insert((mesh, entity));
            }
        }
        let (files, wanted) = (self.files, &*self.wanted);
        let read = |(path, (mesh, entity)): (PathBuf, (MeshShape, &Entity))| {
            Some((path, mesh.arguments(entity, files, wanted).ok()?))
        };
        let read: Vec<(PathBuf, MadeMesh)> =
            on_all_processors(|| named.into_par_iter().filter_map(read).collect());
        self.meshes.extend(read);
    }

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
