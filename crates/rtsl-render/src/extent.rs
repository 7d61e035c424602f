//! The extent of a scene and the memory of its hierarchies, without building them.

use std::collections::BTreeMap;
use std::sync::Arc;

use rtsl::{Diagnostic, Engine, Instance};
use rtsl_bvh::{Bounds, Bvh8};
use rtsl_memory::Amount;
use rtsl_scene::{Scene, SceneObject};

use crate::compiled::{element_bounds, instance_bounds};

/// The extent of a scene.
#[derive(Clone, Copy, Debug)]
pub struct SceneExtent {
    /// The box around all bounded objects, over the whole shutter; `None` if there are none.
    pub bounds: Option<Bounds>,
    /// The number of objects without bounds.
    pub unbounded: usize,
    /// The number of items of all hierarchies: elements of objects, and instances.
    pub items: u64,
    /// An estimate of the memory of the hierarchies.
    pub hierarchy: Amount,
}

/// The buffer of meshes with their vertices.
const POSITIONS: &str = "positions";

/// Returns the extent of a scene.
///
/// # Errors
/// If the bounds of a class cannot be computed.
pub fn scene_extent(scene: &Scene, engine: &Engine) -> Result<SceneExtent, Diagnostic> {
    let mut measure = Measure { engine, own: BTreeMap::new(), unbounded: 0 };
    let groups: Vec<Option<Bounds>> =
        scene.groups.iter().map(|group| measure.group(scene, group)).collect::<Result<_, _>>()?;
    let mut bounds = measure.group(scene, &scene.world)?;
    for instance in &scene.instances {
        let Some(group) = groups[instance.group as usize] else { continue };
        let placed = match &instance.motion {
            Some(motion) => group.moved(motion),
            None => group.transformed(instance.transform.into()),
        };
        bounds = union(bounds, placed);
    }
    let items_of = |indices: &[u32]| -> u64 {
        let elements = |index: &u32| scene.objects[*index as usize].elements.unwrap_or(1);
        indices.iter().map(|index| u64::from(elements(index))).sum()
    };
    let world = items_of(&scene.world) + scene.instances.len() as u64;
    let sizes = scene.groups.iter().map(|group| items_of(group)).chain([world]);
    let (mut items, mut hierarchy) = (0, Amount::default());
    for size in sizes {
        items += size;
        hierarchy += Bvh8::estimated_memory(size as usize);
    }
    Ok(SceneExtent { bounds, unbounded: measure.unbounded, items, hierarchy })
}

struct Measure<'a> {
    engine: &'a Engine,
    /// The boxes of instances in their own spaces, by their addresses.
    own: BTreeMap<usize, Option<Bounds>>,
    unbounded: usize,
}

impl Measure<'_> {
    fn group(&mut self, scene: &Scene, objects: &[u32]) -> Result<Option<Bounds>, Diagnostic> {
        let mut bounds = None;
        for index in objects {
            let object = &scene.objects[*index as usize];
            let placed = self.object(object)?.and_then(|own| match &object.motion {
                Some(motion) => own.moved(motion),
                None => own.transformed(object.transform),
            });
            self.unbounded += usize::from(placed.is_none());
            bounds = union(bounds, placed);
        }
        Ok(bounds)
    }

    /// The box of an object in its own space; `None` if it is unbounded.
    fn object(&mut self, object: &SceneObject) -> Result<Option<Bounds>, Diagnostic> {
        let address = Arc::as_ptr(&object.primitive).addr();
        if let Some(known) = self.own.get(&address) {
            return Ok(*known);
        }
        let bounds = match object.primitive.buffer(POSITIONS) {
            Some(positions) if !positions.is_empty() => around(positions),
            _ => self.computed(&object.primitive, object.elements)?,
        };
        self.own.insert(address, bounds);
        Ok(bounds)
    }

    fn computed(
        &self,
        primitive: &Instance,
        elements: Option<u32>,
    ) -> Result<Option<Bounds>, Diagnostic> {
        let program = self.engine.program(primitive);
        let Some(count) = elements else { return instance_bounds(&program, primitive) };
        let boxes = element_bounds(&program, primitive, count)?;
        let union = |all: Bounds, own: Option<Bounds>| own.map(|own| all.union(&own));
        Ok(boxes.into_iter().try_fold(Bounds::EMPTY, union))
    }
}

/// The box around points.
fn around(positions: &[u32]) -> Option<Bounds> {
    let (points, _) = positions.as_chunks::<3>();
    let all = points.iter().fold(Bounds::EMPTY, |all, point| {
        let point = point.map(f32::from_bits);
        all.union(&Bounds { min: point, max: point })
    });
    Bounds::new(all.min, all.max)
}

fn union(one: Option<Bounds>, other: Option<Bounds>) -> Option<Bounds> {
    match (one, other) {
        (Some(one), Some(other)) => Some(one.union(&other)),
        (one, other) => one.or(other),
    }
}

#[cfg(test)]
mod tests {
    use std::path::{Path, PathBuf};

    use rtsl::{Backend, EngineOptions};
    use rtsl_scene::reader::MemoryFiles;
    use rtsl_scene::{LoadOptions, load_scene};

    use super::*;

    fn extent(world: &str) -> SceneExtent {
        let text = format!("Camera \"perspective\"\nWorldBegin\n{world}");
        let files = MemoryFiles([(PathBuf::from("s.pbrt"), text)].into());
        let loaded = load_scene(Path::new("s.pbrt"), &files, &LoadOptions::default());
        let scene = loaded.expect("no errors").scene;
        let options = EngineOptions { backend: Backend::Interpreter, ..EngineOptions::default() };
        let (engine, _) = Engine::new(options).expect("the interpreter exists");
        scene_extent(&scene, &engine).expect("all classes have bounds")
    }

    #[test]
    fn extents_are_those_of_placed_objects() {
        let mesh = "Shape \"trianglemesh\" \"point3 P\" [0 0 0 1 0 0 0 2 0]\n";
        let found = extent(&format!(
            "{mesh}Translate 10 0 0\nShape \"sphere\" \"float radius\" 2\n\
             ObjectBegin \"o\"\n{mesh}{mesh}ObjectEnd\n\
             Translate 0 0 5\nObjectInstance \"o\"\nObjectInstance \"o\"\n"
        ));
        let bounds = found.bounds.unwrap();
        let near = |found: f32, expected: f32| (found - expected).abs() < 1e-3;
        let expected = ([0.0, -2.0, -2.0], [21.0, 2.0, 5.0]);
        for axis in 0..3 {
            assert!(near(bounds.min[axis], expected.0[axis]), "{bounds:?}");
            assert!(near(bounds.max[axis], expected.1[axis]), "{bounds:?}");
        }
        // A triangle, a ball and two instances; two triangles.
        assert_eq!((found.items, found.unbounded), (6, 0));
        assert!(found.hierarchy.0 > 0);
    }

    #[test]
    fn planes_have_no_bounds() {
        let found = extent("Shape \"Plane\"\n");
        assert!(found.bounds.is_none());
        assert_eq!((found.items, found.unbounded), (1, 1));
    }
}
