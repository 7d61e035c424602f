//! Attributes of the shapes of a file that shaders read.
//!
//! Nothing is known of shaders while a file is read as a scene, and the materials of the library read no attributes. So
//! attributes cost nothing then; if a shader beside the file reads some, the shapes are read once more.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;
use std::sync::Arc;

use gltf::json::mesh::Primitive;
use rtsl::{Diagnostics, SourceMap};
use rtsl_memory::{Amount, Held, InputBudget};

use super::builder::Builder;
use super::hierarchy::Hierarchy;
use super::surface::Surface;
use super::with_builder;
use crate::attributes::{GivenAttribute, WantedAttributes};
use crate::description::{Description, EntityId};
use crate::mesh::gltf::{VertexAttribute, VertexValues};
use crate::reader::FileSource;

/// The attributes of the shapes of a file.
#[derive(Debug, Default)]
pub struct FileAttributes {
    /// Those that shaders read.
    pub wanted: Arc<WantedAttributes>,
    /// Those that shapes have.
    pub of: BTreeMap<EntityId, Vec<GivenAttribute>>,
    /// The reasons for which some are left out.
    pub problems: BTreeSet<String>,
}

impl FileAttributes {
    /// Reads the wanted attributes of the shapes of a description, which was read from the file.
    pub fn read(
        path: &Path,
        files: &dyn FileSource,
        budget: &InputBudget,
        wanted: &Arc<WantedAttributes>,
        description: &Description,
    ) -> FileAttributes {
        let (mut map, mut diagnostics) = (SourceMap::new(), Diagnostics::new());
        let read = |builder: &mut Builder<'_>| {
            builder.attributes.wanted = wanted.clone();
            let hierarchy = Hierarchy::new(&builder.file);
            builder.add_shapes(&hierarchy);
        };
        // What is read again is in memory beside the description for a while.
        let budget = budget.branch();
        let read = with_builder(path, files, &budget, &mut map, &mut diagnostics, read);
        let (again, mut attributes) = read.unwrap_or_default();
        attributes.wanted = wanted.clone();
        let mut pairs = again.entities.iter().zip(&description.entities);
        let is_same = again.entities.len() <= description.entities.len()
            && again.shapes.len() == description.shapes.len()
            && pairs.all(|(again, first)| (again.kind, &again.class) == (first.kind, &first.class));
        if is_same {
            return attributes;
        }
        let problem =
            "attributes of shapes are left out: the file changed, or takes too much memory";
        let problems = [problem.to_owned()].into();
        FileAttributes { wanted: wanted.clone(), of: BTreeMap::new(), problems }
    }

    /// Returns the memory of the arrays, of which instances of a mesh share one.
    pub fn memory(&self) -> Amount {
        let mut seen = BTreeSet::new();
        let arrays = self.of.values().flatten().map(|it| it.numbers.words());
        let arrays = arrays.filter(|words| seen.insert(words.as_ptr()));
        arrays.map(|words| Amount::of::<u32>(words.len())).sum()
    }
}

impl Builder<'_> {
    /// Adds the attributes of a primitive that shaders read to its surface. Those that are invalid are left out.
    pub fn add_attributes(&mut self, primitive: &Primitive, surface: &mut Surface) -> Vec<Held> {
        let mut memory = Vec::new();
        for attribute in VertexAttribute::all(&self.file, primitive, &self.attributes.wanted) {
            let added = attribute
                .and_then(|attribute| surface.add_attribute(&self.file, &attribute, self.budget));
            match added {
                Ok(held) => memory.push(held),
                Err(error) => {
                    let problem = format!("an attribute of a mesh is left out: {error}");
                    self.attributes.problems.insert(problem);
                }
            }
        }
        memory
    }

    /// Gives a shape the attributes of its surface.
    pub fn keep_attributes(
        &mut self,
        entity: EntityId,
        attributes: Vec<VertexValues>,
        memory: Vec<Held>,
    ) {
        let attributes: Vec<GivenAttribute> =
            attributes.into_iter().map(VertexValues::finish).collect();
        if attributes.is_empty() {
            return;
        }
        for (held, attribute) in memory.into_iter().zip(&attributes) {
            held.keep(Amount::of::<u32>(attribute.numbers.words().len()));
        }
        self.attributes.of.insert(entity, attributes);
    }

    /// Gives a shape the attributes of another one, whose arrays it shares.
    pub fn share_attributes(&mut self, from: EntityId, to: EntityId) {
        if from == to {
            return;
        }
        if let Some(attributes) = self.attributes.of.get(&from).cloned() {
            self.attributes.of.insert(to, attributes);
        }
    }
}
