//! Probing: a few samples of each light, from which its strength and position are estimated.

use rayon::prelude::*;
use rtsl::QueryColumns;
use rtsl_bvh::{Bounds, Bvh8, Leaf};
use rtsl_math::sampling::{hash, unit_float};
use rtsl_memory::on_all_processors;
use smallvec::SmallVec;

use super::sample::{LightMemory, Weights};
use super::selection::LightProbe;
use crate::compiled::compiled_scene::CompiledScene;
use crate::compiled::render_scene::RenderScene;
use crate::compiled::runtime_errors::RuntimeErrors;
use crate::integrate::rows::get;
use crate::integrate::shading_batch::ShadingBatch;

/// Samples of each light.
const SAMPLES: usize = 16;

/// The number of lights sampled in one batch. Random numbers depend on the lane, so this does not follow the batch's
/// size.
const LIGHTS_IN_BATCH: usize = 16;

/// The key of the random numbers of probes.
const NUMBERS_OF_PROBES: u32 = 0x7072_6F62;

/// Samples every light from some points distributed over the scene, in parallel.
pub fn probe_lights(scene: &RenderScene, errors: &RuntimeErrors) -> Vec<LightProbe> {
    let place = place_of_probes(&scene.compiled);
    let count = scene.lights.entries.len();
    let chunks = (0..count.div_ceil(LIGHTS_IN_BATCH)).into_par_iter();
    let probes = chunks.map_init(
        || ProbeMemory::new(scene),
        |ProbeMemory { batch, light }, index| {
            let first = index * LIGHTS_IN_BATCH;
            let lights = first..count.min(first + LIGHTS_IN_BATCH);
            let chosen = lights.flat_map(|light| std::iter::repeat_n(light as u32, SAMPLES));
            let chosen: SmallVec<[u32; LIGHTS_IN_BATCH * SAMPLES]> = chosen.collect();
            set_points(batch, &chosen, place);
            light.sample_chosen(scene, errors, batch, &chosen, Weights::Divided);
            let starts = (0..chosen.len()).step_by(SAMPLES);
            starts.map(|start| probe(batch, start)).collect::<SmallVec<[_; LIGHTS_IN_BATCH]>>()
        },
    );
    on_all_processors(|| probes.flatten_iter().collect())
}

/// Memory of a thread that samples lights.
struct ProbeMemory {
    batch: Box<ShadingBatch>,
    light: Box<LightMemory>,
}

impl ProbeMemory {
    fn new(scene: &RenderScene) -> Self {
        let scratch = scene.scratch_arrays();
        ProbeMemory {
            batch: ShadingBatch::new(scratch, &scene.numbers),
            light: LightMemory::new(scratch, &scene.numbers),
        }
    }
}

/// The box from whose points lights are sampled: that of the scene's bounded objects, without a few huge ones.
fn place_of_probes(scene: &CompiledScene) -> Bounds {
    let place = scene.geometry.groups.first().map(|group| most_of(&group.tree));
    let is_usable = |bounds: &Bounds| bounds.diagonal().is_finite() && bounds.diagonal() > 0.0;
    place.filter(is_usable).or_else(|| Bounds::new([-1.0; 3], [1.0; 3])).unwrap_or(Bounds::EMPTY)
}

/// The greatest number of leaves whose items are looked at.
const MOST_LEAVES: usize = 512;

/// The growth of the box at which the items that are left are too huge to count: a lamp over a floor this much larger
/// shines on almost none of it.
const HUGE: f64 = 64.0;

/// The box around the items of a tree. Without the largest of them if these alone make it much larger: seen from afar,
/// all lights are at one place, and those that face down send nothing.
fn most_of(tree: &Bvh8) -> Bounds {
    let leaves = &tree.leaves[..tree.first_unbounded as usize];
    let sampled = leaves.iter().step_by(leaves.len().div_ceil(MOST_LEAVES).max(1));
    let boxes = |leaf: &Leaf| (0..leaf.items().len()).map(|it| leaf.boxes.get(it)).collect();
    let mut boxes: Vec<Bounds> = sampled.flat_map(|leaf| -> Vec<Bounds> { boxes(leaf) }).collect();
    boxes.retain(|bounds| bounds.min != Bounds::NOWHERE.min);
    boxes.sort_by(|one, other| one.diagonal().total_cmp(&other.diagonal()));
    // Most items are at least a quarter of them: of two walls, each may be two triangles.
    let least = boxes.len().div_ceil(4);
    let mut most = Bounds::EMPTY;
    for (index, bounds) in boxes.iter().enumerate() {
        let larger = most.union(bounds);
        let is_huge = most.diagonal() > 0.0 && larger.diagonal() > HUGE * most.diagonal();
        if index >= least && is_huge {
            break;
        }
        most = larger;
    }
    let is_smaller = most.diagonal() > 0.0 && tree.bounds.diagonal() > HUGE * most.diagonal();
    if is_smaller { most } else { tree.bounds }
}

/// Distributes the points from which each light is sampled over a box.
fn set_points(batch: &mut ShadingBatch, lights: &[u32], place: Bounds) {
    batch.count = lights.len();
    for lane in 0..lights.len() {
        let random =
            |axis: u32| unit_float(hash(hash(NUMBERS_OF_PROBES, (lane % SAMPLES) as u32), axis));
        let [x, y, z] = [0, 1, 2].map(random);
        batch.surfaces.set_vector(QueryColumns::POINT, lane, place.at([x, y, z]));
        batch.surfaces.set_vector(QueryColumns::GEOMETRIC_NORMAL, lane, [0.0, 0.0, 1.0]);
        batch.surfaces.set_vector(QueryColumns::SHADING_NORMAL, lane, [0.0, 0.0, 1.0]);
        batch.side[lane] = 1.0;
        batch.surfaces.column_mut(QueryColumns::TIME)[lane] =
            (lane % SAMPLES) as f32 / SAMPLES as f32;
        batch.keys[lane] = hash(NUMBERS_OF_PROBES, lane as u32);
        batch.samples[lane] = (lane % SAMPLES) as u32;
    }
}

/// Evaluates the samples of one light.
fn probe(batch: &ShadingBatch, start: usize) -> LightProbe {
    let (mut bounds, mut strength) = (Bounds::EMPTY, 0.0);
    let is_lit = |lane: &usize| get(&batch.light.color, *lane) != [0.0; 3];
    let mut lit = (start..start + SAMPLES).filter(is_lit).peekable();
    let is_near = lit.peek().is_some() && lit.all(|lane| batch.light.reach[lane] < f32::INFINITY);
    for lane in start..start + SAMPLES {
        let distance = batch.light.distance[lane];
        if distance.is_nan() || distance == f32::INFINITY {
            return LightProbe { bounds: None, strength: 1.0, is_near };
        }
        let (point, direction) =
            (batch.surfaces.vector(QueryColumns::POINT, lane), get(&batch.light.direction, lane));
        let place: [f32; 3] = std::array::from_fn(|axis| point[axis] + direction[axis] * distance);
        if let Some(place) = Bounds::new(place, place) {
            bounds = bounds.union(&place);
        }
        let [red, green, blue] = get(&batch.light.color, lane);
        let luminance = 0.2126 * red + 0.7152 * green + 0.0722 * blue;
        let intensity = luminance * distance * distance;
        strength += if intensity.is_finite() { intensity.max(0.0) / SAMPLES as f32 } else { 0.0 };
    }
    let is_somewhere = bounds != Bounds::EMPTY;
    LightProbe { bounds: is_somewhere.then_some(bounds), strength, is_near }
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use rtsl::{Backend, Engine, EngineOptions, Messages};
    use rtsl_bvh::Item;
    use rtsl_scene::reader::MemoryFiles;
    use rtsl_scene::{LoadOptions, load_scene};

    use super::*;

    fn cube(at: [f32; 3], size: f32) -> Option<Bounds> {
        Bounds::new(at, at.map(|it| it + size))
    }

    fn most(boxes: &[Option<Bounds>]) -> Bounds {
        let items: Vec<Item> =
            boxes.iter().map(|bounds| Item { bounds: *bounds, class: 0 }).collect();
        most_of(&Bvh8::build(&items))
    }

    #[test]
    fn a_floor_does_not_count_and_a_landscape_does() {
        let floor = Bounds::new([-1e7, 0.0, -1e7], [1e7, 0.0, 1e7]);
        let (near, far) = (cube([1.0; 3], 1.0), cube([3.0; 3], 2.0));
        let without = most(&[near, far]);
        assert_eq!(most(&[floor, near, floor, far]), without);
        assert_eq!(most(&[near, far, Some(Bounds::NOWHERE)]), without);
        assert_eq!(most(&[floor]), floor.unwrap());
        // A room whose walls are large, with small things in it.
        let room = cube([-10.0; 3], 30.0);
        assert_eq!(most(&[room, near, far]), room.unwrap());
        // Most of a landscape is far away from the few houses in it.
        let hills = (0..100).map(|index| cube([index as f32 * 1e4, 0.0, 0.0], 2e4));
        let all: Vec<_> = [near, far].into_iter().chain(hills).collect();
        assert_eq!(most(&all).min, [0.0; 3]);
        assert!(most(&all).diagonal() > 1e5);
    }

    /// The strengths of a lamp that shines down on a ball, and of a weaker one that shines aside.
    fn strengths(floor: &str) -> [f32; 2] {
        let text = format!(
            "Camera \"Pinhole\"\nWorldBegin\nShape \"sphere\"\n{floor}\n\
             AttributeBegin\nTranslate 0 3 0 Rotate 90 1 0 0\n\
             AreaLightSource \"diffuse\" \"rgb L\" [9 9 9]\nShape \"disk\"\nAttributeEnd\n\
             AttributeBegin\nTranslate -3 1 0 Rotate 90 0 1 0\n\
             AreaLightSource \"diffuse\" \"rgb L\" [1 1 1]\nShape \"disk\"\nAttributeEnd\n"
        );
        let files = MemoryFiles::<String>::default().with("scene.pbrt", text);
        let loaded = load_scene(Path::new("scene.pbrt"), &files, &LoadOptions::default());
        let loaded = loaded.unwrap_or_else(|messages| panic!("{}", messages.to_text(false)));
        let options = EngineOptions { backend: Backend::Interpreter, ..EngineOptions::default() };
        let (engine, _) = Engine::new(options).expect("the interpreter is always there");
        let scene =
            RenderScene::new(&loaded.scene, &engine, &[], &mut Messages::default(), &|_| {});
        let scene = scene.unwrap_or_else(|messages| panic!("{}", messages.to_text(false)));
        let probes = probe_lights(&scene, &RuntimeErrors::default());
        [probes[0].strength, probes[1].strength]
    }

    #[test]
    fn a_huge_floor_does_not_change_which_light_is_strong() {
        const FLOOR: &str = "Shape \"trianglemesh\" \"integer indices\" [0 1 2 0 2 3] \"point3 P\" \
                             [-1e7 -1 -1e7  -1e7 -1 1e7  1e7 -1 1e7  1e7 -1 -1e7]";
        for [down, aside] in [strengths(""), strengths(FLOOR)] {
            assert!(down > 2.0 * aside && aside > 0.0, "{down} {aside}");
        }
    }
}
