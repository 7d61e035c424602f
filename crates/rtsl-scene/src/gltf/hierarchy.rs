//! The nodes of the scene that a file shows, with their transforms to the world's space.

use gltf::json::Index;
use gltf::json::scene::Node;
use rtsl_math::Transform;

use super::extension::extension;
use crate::mesh::gltf::{GltfFile, transform};

/// The extension that hides nodes.
const VISIBILITY: &str = "KHR_node_visibility";

/// The nodes of a scene.
pub struct Hierarchy {
    /// The indices of visible nodes, parents before their children.
    pub visible: Vec<usize>,
    /// The transforms of all nodes of the scene, by index.
    world: Vec<Option<Transform>>,
    /// Nodes that have several parents or contain themselves: only the first place counts.
    pub repeated: Vec<usize>,
}

impl Hierarchy {
    /// Walks through the nodes of the scene that `file` shows.
    pub fn new(file: &GltfFile<'_>) -> Self {
        let nodes = &file.root.nodes;
        let mut hierarchy =
            Hierarchy { visible: Vec::new(), world: vec![None; nodes.len()], repeated: Vec::new() };
        let mut open: Vec<(Index<Node>, Transform, bool)> = Vec::new();
        open.extend(file.root_nodes().into_iter().rev().map(|it| (it, Transform::IDENTITY, true)));
        while let Some((index, parent, is_shown)) = open.pop() {
            let index = index.value();
            let Some(node) = nodes.get(index) else { continue };
            if hierarchy.world[index].is_some() {
                hierarchy.repeated.push(index);
                continue;
            }
            let own = transform(node);
            let own = if own.is_affine() { own } else { Transform::IDENTITY };
            let placement = parent.after(own);
            hierarchy.world[index] = Some(placement);
            let hidden = extension!(node, VISIBILITY).and_then(|it| it.boolean("visible"));
            let is_shown = is_shown && hidden != Some(false);
            if is_shown {
                hierarchy.visible.push(index);
            }
            let children = node.children.iter().flatten().rev();
            open.extend(children.map(|child| (*child, placement, is_shown)));
        }
        hierarchy
    }

    /// Returns the transform of a node to the world's space; that of a node outside the scene is the identity.
    pub fn world(&self, node: usize) -> Transform {
        self.world.get(node).copied().flatten().unwrap_or(Transform::IDENTITY)
    }
}
