//! The files that a scene names, which are looked for before anything is made of them.

use std::collections::BTreeSet;
use std::io;
use std::path::{Path, PathBuf};

use super::reachable::reachable;
use super::{Earlier, Loader, Slot, is_ambient};
use crate::description::{Entity, EntityId, EntityKind};
use crate::pbrt::{MeshShape, PbrtName};
use crate::reader::{FILE_PARAMETERS, Parameter, unreadable};

impl Loader<'_, '_> {
    /// The entities that the scene uses, without those that have an instance of an earlier load.
    pub(super) fn new_entities(&self) -> Vec<EntityId> {
        let Earlier { made, changed, .. } = self.earlier;
        let is_new = |id: &EntityId| {
            changed.contains(id) || made.get(id.0).is_none_or(|earlier| earlier.is_none())
        };
        reachable(self.description, &self.names).into_iter().filter(is_new).collect()
    }

    /// Reports all files that the entities of the scene name and that cannot be read. Returns true if there are none.
    pub(super) fn find_files(&mut self) -> bool {
        let description = self.description;
        let mut seen: BTreeSet<PathBuf> = BTreeSet::new();
        let mut is_complete = true;
        for id in self.new_entities() {
            for (name, parameter) in named_files(&description.entities[id.0]) {
                let path = self.files.path(name);
                if seen.contains(&path) {
                    continue;
                }
                if let Err(error) = self.find_file(&path) {
                    let diagnostic =
                        unreadable(&path, &error).at(parameter.values_span, "named here");
                    let help = "paths are relative to the folder of the scene";
                    self.diagnostics.push(diagnostic.help(help));
                    is_complete = false;
                }
                seen.insert(path);
            }
        }
        is_complete
    }

    /// Reports the other errors of a scene that lacks files, as far as nothing is read for them: entities that name
    /// files are not made.
    pub(super) fn check_without_files(&mut self) {
        let description = self.description;
        let used = reachable(description, &self.names);
        let entity = |EntityId(index): &EntityId| &description.entities[*index];
        let (of_files, others): (Vec<EntityId>, Vec<EntityId>) =
            used.into_iter().partition(|id| named_files(entity(id)).next().is_some());
        // What refers to them is not to blame.
        of_files.into_iter().for_each(|EntityId(index)| self.instances[index] = Slot::Failed);
        self.find_wanted_attributes();
        if let Some(integrator) = description.integrator {
            let _ = self.integrator(integrator);
        }
        for id in others.iter().filter(|id| !is_ambient(entity(id))) {
            self.instance(*id);
        }
        self.check_unused_entities();
    }

    fn find_file(&self, path: &Path) -> io::Result<()> {
        if self.files.embedded.contains_key(path) {
            return Ok(());
        }
        self.files.files.size(path).map(drop)
    }
}

/// The names of the files that are read for an entity, with the parameters that have them.
fn named_files(entity: &Entity) -> impl Iterator<Item = (&str, &Parameter)> {
    let is_read = |parameter: &&Parameter| match entity.kind {
        EntityKind::Shape => {
            let mesh = MeshShape::named(&entity.class);
            mesh.is_some_and(|it| it.file(entity).is_some()) && parameter.name == "filename"
        }
        EntityKind::Material if parameter.name == "normalmap" => true,
        _ => PbrtName::of(entity).is_some_and(|it| it.is_read_by_maker(&parameter.name)),
    };
    let files = entity.parameters.iter().filter(|it| FILE_PARAMETERS.contains(&it.name.as_str()));
    let names = files.filter(is_read).filter_map(|it| Some((it.first_text()?, it)));
    names.filter(|(name, _)| !name.is_empty())
}
