//! Shapes: the primitives of meshes, placed by nodes.

use std::collections::BTreeMap;

use gltf::json::Index;
use gltf::json::accessor::Accessor;
use gltf::json::mesh::{Primitive, Semantic};
use gltf::json::scene::Node;
use rtsl::{Numbers as Buffer, Scalar};
use rtsl_math::Transform;
use rtsl_memory::Amount;

use super::builder::Builder;
use super::extension::extension;
use super::hierarchy::Hierarchy;
use super::materials::{Alpha, Finish, FinishKey};
use super::outline::Kind;
use super::surface::{Joints, Surface};
use super::tangents::add_tangents;
use crate::bounds::Bounds;
use crate::description::{EntityId, EntityKind, InstanceUse, ObjectDefinition, ShapeUse};
use crate::mesh::MeshError;
use crate::mesh::gltf::{DRACO, MESHOPT, Numbers, attribute, size, turned};
use crate::reader::ReferenceKind;

const INSTANCING: &str = "EXT_mesh_gpu_instancing";

/// The greatest number of instances of a scene.
const MAX_INSTANCES: usize = 1 << 24;

/// The greatest number of places of a mesh that glows that are shapes of their own: the interactive renderer does not
/// take samples of those in objects.
const MAX_LAMPS: usize = 64;

/// A mesh with the places that one node gives it.
struct Use {
    node: usize,
    mesh: usize,
    transforms: Vec<Transform>,
    /// The weights of morph targets.
    weights: Vec<f32>,
    skin: Option<usize>,
}

/// A mesh, and the bits of the weights of its morph targets.
type SharedKey = (usize, Vec<u32>);

/// The shapes of a mesh, and its object if it has one.
type Shared = (Vec<Shape>, Option<usize>);

/// A primitive's entity, as often as it can be shared.
#[derive(Clone)]
struct Shape {
    entity: EntityId,
    finish: Finish,
    bounds: Bounds,
    /// True if the vertices are in the world's space already.
    is_placed: bool,
}

impl Builder<'_> {
    /// Adds the shapes of all nodes and returns the box around them.
    pub fn add_shapes(&mut self, hierarchy: &Hierarchy) -> Bounds {
        let mut bounds = Bounds::default();
        let uses = self.uses(hierarchy);
        let mut places = BTreeMap::new();
        for use_ in uses.iter().filter(|use_| use_.is_shared()) {
            *places.entry((use_.mesh, use_.weight_bits())).or_insert(0) += use_.transforms.len();
        }
        let mut shared: BTreeMap<SharedKey, Shared> = BTreeMap::new();
        for use_ in &uses {
            if !use_.is_shared() {
                for shape in self.shapes(use_, hierarchy, Transform::IDENTITY) {
                    self.place(&shape, Transform::IDENTITY, &mut bounds);
                }
                continue;
            }
            let key = (use_.mesh, use_.weight_bits());
            let (shapes, object) = match shared.get(&key) {
                Some(known) => known.clone(),
                None => {
                    let only = use_.transforms.first().filter(|_| places.get(&key) == Some(&1));
                    let singular = only.filter(|it| it.inverse().is_none()).copied();
                    let shapes =
                        self.shapes(use_, hierarchy, singular.unwrap_or(Transform::IDENTITY));
                    let glows = shapes.iter().any(|shape| shape.finish.glow.is_some());
                    let most = if glows { MAX_LAMPS } else { 1 };
                    let is_repeated = places.get(&key).is_some_and(|count| *count > most);
                    let object = is_repeated.then(|| self.object(use_, &shapes));
                    let made = (shapes, object);
                    shared.insert(key, made.clone());
                    made
                }
            };
            for transform in &use_.transforms {
                match object {
                    Some(object) => self.instance(object, use_, *transform, &shapes, &mut bounds),
                    None => {
                        shapes.iter().for_each(|shape| self.place(shape, *transform, &mut bounds));
                    }
                }
            }
        }
        bounds
    }

    /// The meshes of visible nodes with their places.
    fn uses(&mut self, hierarchy: &Hierarchy) -> Vec<Use> {
        let mut uses = Vec::new();
        let mut count = 0;
        for node_index in &hierarchy.visible {
            let node = self.file.root.nodes[*node_index].clone();
            let Some(mesh) = node.mesh.map(|mesh| mesh.value()) else { continue };
            let span = self.outline.span(Kind::Node, *node_index);
            let Some(definition) = self.file.root.meshes.get(mesh) else {
                let message = format!("mesh {mesh} does not exist: its node is empty");
                self.warn(message, span);
                continue;
            };
            let weights = node.weights.clone().or_else(|| definition.weights.clone());
            let world = hierarchy.world(*node_index);
            let transforms = match self.instances(&node, world) {
                Ok(transforms) => transforms,
                Err(error) => {
                    self.warn(format!("instances of a node are left out: {error}"), span);
                    vec![world]
                }
            };
            count += transforms.len();
            let amount = Amount::of::<InstanceUse>(transforms.len());
            let held = self.budget.hold(amount);
            if count > MAX_INSTANCES || held.is_err() {
                let message =
                    format!("there are more than {MAX_INSTANCES} instances: some are left out");
                self.warn(message, span);
                break;
            }
            held.into_iter().for_each(|held| held.keep(amount));
            let skin = node.skin.map(|skin| skin.value());
            let weights = weights.unwrap_or_default();
            uses.push(Use { node: *node_index, mesh, transforms, weights, skin });
        }
        uses
    }

    /// The transforms of a node's instances, or its own.
    fn instances(&self, node: &Node, world: Transform) -> Result<Vec<Transform>, MeshError> {
        let Some(attributes) = extension!(node, INSTANCING).and_then(|it| it.object("attributes"))
        else {
            return Ok(vec![world]);
        };
        let accessor = |name: &str| {
            let index = attributes.index(name).and_then(|index| u32::try_from(index).ok());
            index.map(Index::<Accessor>::new)
        };
        let given = ["TRANSLATION", "ROTATION", "SCALE"].map(accessor);
        let Some(first) = given.iter().flatten().next() else { return Ok(vec![world]) };
        let count = size(self.file.accessor(*first)?.count);
        if count > MAX_INSTANCES {
            return Err(MeshError::TooLarge(MAX_INSTANCES, "instances"));
        }
        let [moves, turns, scales] = given;
        let moves = self.tuples::<3>(moves, count, [0.0; 3])?;
        let turns = self.tuples::<4>(turns, count, [0.0, 0.0, 0.0, 1.0])?;
        let scales = self.tuples::<3>(scales, count, [1.0; 3])?;
        let instances = moves.into_iter().zip(turns).zip(scales).map(|((by, rotation), scale)| {
            let own =
                Transform::translate(by).after(turned(rotation)).after(Transform::scale(scale));
            world.after(own)
        });
        Ok(instances.filter(|it| it.is_affine()).collect())
    }

    fn tuples<const COUNT: usize>(
        &self,
        accessor: Option<Index<Accessor>>,
        count: usize,
        default: [f64; COUNT],
    ) -> Result<Vec<[f64; COUNT]>, MeshError> {
        let Some(accessor) = accessor else { return Ok(vec![default; count]) };
        let found = size(self.file.accessor(accessor)?.count);
        if found != count {
            let what = "of another attribute of instances";
            return Err(MeshError::CountMismatch { what, found, vertices: count });
        }
        Ok(Numbers::<COUNT>::new(accessor, &self.file)?.iter().collect())
    }

    /// The shapes of a mesh, whose vertices are transformed by `baked`. Those that are invalid are left out.
    fn shapes(&mut self, use_: &Use, hierarchy: &Hierarchy, baked: Transform) -> Vec<Shape> {
        let primitives = self.file.root.meshes[use_.mesh].primitives.clone();
        let joints = use_.skin.and_then(|skin| self.joints(skin, hierarchy));
        let mut shapes = Vec::new();
        for (index, primitive) in primitives.iter().enumerate() {
            match self.shape(use_, primitive, joints.as_ref(), baked) {
                Ok(shape) => shapes.extend(shape),
                Err(error) => {
                    let message = format!("primitive {index} of a mesh is left out: {error}");
                    self.warn(message, self.outline.span(Kind::Mesh, use_.mesh));
                }
            }
        }
        shapes
    }

    /// The joints of a skin; `None` if it has none, which was reported.
    fn joints(&mut self, skin: usize, hierarchy: &Hierarchy) -> Option<Joints> {
        let Some(definition) = self.file.root.skins.get(skin) else {
            self.warn(format!("skin {skin} does not exist"), self.outline.whole());
            return None;
        };
        let count = definition.joints.len();
        let bindings = match definition.inverse_bind_matrices {
            Some(accessor) => Numbers::<16>::new(accessor, &self.file).map(|numbers| {
                numbers.iter().take(count).map(|it| Transform::from_columns(&it)).collect()
            }),
            None => Ok(Vec::new()),
        };
        let bindings: Vec<Transform> = match bindings {
            Ok(bindings) => bindings,
            Err(error) => {
                self.warn(format!("skin {skin} is left out: {error}"), self.outline.whole());
                return None;
            }
        };
        let joints = definition.joints.iter().enumerate().map(|(joint, node)| {
            let binding = bindings.get(joint).copied().unwrap_or(Transform::IDENTITY);
            hierarchy.world(node.value()).after(binding)
        });
        Some(joints.collect())
    }

    /// The shape of a primitive; `None` for what is no surface.
    fn shape(
        &mut self,
        use_: &Use,
        primitive: &Primitive,
        joints: Option<&Joints>,
        baked: Transform,
    ) -> Result<Option<Shape>, MeshError> {
        self.file.check_compression(primitive)?;
        let key = FinishKey {
            material: primitive.material.map(|it| it.value()),
            has_colors: attribute(primitive, Semantic::Colors(0)).is_some(),
        };
        let finish = self.finish(key);
        let mut held = self.budget.hold(Amount::default())?;
        let Some(mut surface) = Surface::read(&self.file, primitive, finish.wanted, &mut held)?
        else {
            return Ok(None);
        };
        let of_attributes = self.add_attributes(primitive, &mut surface);
        if !use_.weights.is_empty() {
            surface.morph(&self.file, primitive, &use_.weights)?;
        }
        if let Some(joints) = joints {
            surface.skin(&self.file, primitive, joints)?;
        }
        if baked != Transform::IDENTITY {
            surface.bake(baked);
        }
        if surface.strokes.is_some() {
            self.note_of_strokes();
            surface.thicken();
        }
        if let Some(vertex) = surface.check()? {
            let message = format!(
                "vertex {vertex} of a mesh has a coordinate that is not finite, and no triangle uses it: it is left out"
            );
            self.warn(message, self.outline.span(Kind::Mesh, use_.mesh));
        }
        if finish.wanted.tangents && surface.tangents.is_empty() {
            add_tangents(&mut surface);
        }
        let bounds = surface.positions.iter().map(|it| it.map(f64::from)).collect();
        let is_placed = joints.is_some() || baked != Transform::IDENTITY;
        let attributes = std::mem::take(&mut surface.attributes);
        let entity = self.shape_entity(use_.mesh, surface, &finish);
        self.keep_attributes(entity, attributes, of_attributes);
        let kept = self.memory_of(entity);
        held.keep(kept);
        Ok(Some(Shape { entity, finish, bounds, is_placed }))
    }

    /// Notes once that points and lines are bodies.
    fn note_of_strokes(&mut self) {
        const NOTE: &str =
            "points and lines are shown as small bodies, whose size the file does not tell";
        if self.said.insert(NOTE.to_owned()) {
            self.description.notes.push(NOTE.to_owned());
        }
    }

    fn shape_entity(&mut self, mesh: usize, surface: Surface, finish: &Finish) -> EntityId {
        let mut parameters = self.parameters(Kind::Mesh, mesh);
        let lacks_coordinates = finish.is_textured && surface.uvs[0].is_empty();
        let is_rich = !surface.tangents.is_empty()
            || !surface.uvs[1].is_empty()
            || !surface.colors.is_empty()
            || lacks_coordinates;
        // Textures count from the bottom, and the file from the top.
        let [uvs, second] =
            surface.uvs.map(|uvs| uvs.into_iter().map(|[u, v]| [u, 1.0 - v]).collect::<Vec<_>>());
        parameters = parameters
            .buffer("positions", floats(surface.positions))
            .buffer("normals", floats(surface.normals))
            .buffer("uvs", floats(uvs))
            .buffer("indices", Buffer::from_words(Scalar::I32, surface.corners));
        if is_rich {
            parameters = parameters
                .buffer("tangents", floats(surface.tangents))
                .buffer("uvs1", floats(second))
                .buffer("colors", floats(surface.colors));
        }
        match &finish.alpha {
            Alpha::Opaque => {}
            Alpha::Number(alpha) => parameters = parameters.numbers("alpha", &[*alpha]),
            Alpha::Texture(name) => {
                parameters = parameters.reference(ReferenceKind::Texture, "alpha", name);
            }
        }
        let class = if is_rich { "GltfMesh" } else { "TriangleMesh" };
        self.add(EntityKind::Shape, class, None, parameters, Transform::IDENTITY)
    }

    fn memory_of(&self, EntityId(index): EntityId) -> Amount {
        self.description.entities[index].parameters.iter().map(|it| it.values.memory()).sum()
    }

    /// Adds a shape outside all objects. Its arrays are shared with those of others.
    fn place(&mut self, shape: &Shape, transform: Transform, bounds: &mut Bounds) {
        let transform = if shape.is_placed { Transform::IDENTITY } else { transform };
        if transform.inverse().is_none() {
            return;
        }
        bounds.add(&shape.bounds, transform);
        let entities = &mut self.description.entities;
        let id = if self.placed.insert(shape.entity) {
            shape.entity
        } else {
            entities.push(entities[shape.entity.0].clone());
            EntityId(entities.len() - 1)
        };
        entities[id.0].transform = transform;
        self.share_attributes(shape.entity, id);
        self.description.shapes.push(shape.use_(id));
    }

    /// Defines an object of the shapes of a mesh.
    fn object(&mut self, use_: &Use, shapes: &[Shape]) -> usize {
        let name = self.file.root.meshes[use_.mesh].name.clone().unwrap_or_default();
        self.description.objects.push(ObjectDefinition {
            name,
            span: self.outline.span(Kind::Mesh, use_.mesh),
            shapes: shapes.iter().map(|shape| shape.use_(shape.entity)).collect(),
        });
        self.description.objects.len() - 1
    }

    fn instance(
        &mut self,
        object: usize,
        use_: &Use,
        transform: Transform,
        shapes: &[Shape],
        bounds: &mut Bounds,
    ) {
        if transform.inverse().is_none() {
            return;
        }
        shapes.iter().for_each(|shape| bounds.add(&shape.bounds, transform));
        self.description.instances.push(InstanceUse {
            object: object as u32,
            span: self.outline.span(Kind::Node, use_.node),
            transform: transform.into(),
            end_transform: None,
        });
    }
}

impl Use {
    /// True if the shapes of its mesh can be those of other nodes. Those of skins lie in the world's space.
    fn is_shared(&self) -> bool {
        self.skin.is_none()
    }

    fn weight_bits(&self) -> Vec<u32> {
        self.weights.iter().map(|weight| weight.to_bits()).collect()
    }
}

impl Shape {
    fn use_(&self, shape: EntityId) -> ShapeUse {
        ShapeUse {
            shape,
            material: Some(self.finish.material),
            area_light: self.finish.glow,
            reverse_orientation: false,
        }
    }
}

fn floats<const COUNT: usize>(tuples: Vec<[f32; COUNT]>) -> Buffer {
    Buffer::floats(tuples.into_iter().flatten())
}

/// The extensions that change geometry, and are read.
pub const SUPPORTED: [&str; 6] =
    [INSTANCING, DRACO, MESHOPT[0], MESHOPT[1], "KHR_mesh_quantization", "KHR_node_visibility"];
