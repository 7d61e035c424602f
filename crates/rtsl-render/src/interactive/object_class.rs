//! Objects of one group that share a shader, in the order of the blocks of the group's tree: what one
//! call can test.

use std::sync::{Arc, OnceLock};

use rtsl::{
    InstanceBlock, Kernel, Method, ObjectForm, Objects, Outputs, Program, Shape, Variant,
    lookup_state,
};

use crate::acceleration::{Block, WIDTH, WideTree};

use super::compiled::Object;
use super::shaders::Shader;

/// Objects with one shader, placed alike.
pub struct ObjectClass {
    /// The objects by their place in the blocks, block after block.
    objects: Vec<u32>,
    /// The objects' members in this order.
    pub members: Objects,
    /// Whether objects have spaces of their own; else that is their group's.
    pub is_placed: bool,
    /// The class's name, for messages.
    pub name: String,
    program: Arc<Program>,
    packet: Option<Arc<Kernel>>,
    common_origin: OnceLock<Option<Arc<Kernel>>>,
    leaf: OnceLock<Option<Arc<Kernel>>>,
}

/// What the traversal reads of `intersect`: only where the hit is. What else a hit needs is computed anew
/// for the one that wins.
pub fn traversal_outputs() -> Outputs {
    Outputs::state(lookup_state("rt_HitDistance"))
}

impl ObjectClass {
    /// The objects of a class in a tree. `object` is the number of an item's object.
    pub fn new(
        tree: &WideTree,
        class: u32,
        is_placed: bool,
        shader: &Shader,
        object: impl Fn(u32) -> u32,
        block_of: impl Fn(u32) -> Arc<InstanceBlock>,
    ) -> ObjectClass {
        let mut blocks: Vec<&Block> =
            tree.blocks.iter().filter(|block| block.class == class).collect();
        blocks.sort_unstable_by_key(|block| block.of_class);
        let objects: Vec<u32> =
            blocks.into_iter().flat_map(|block| block.items).map(object).collect();
        let form = ObjectForm::new(0..shader.program.layout().block_words);
        let members = objects.iter().map(|object| block_of(*object));
        ObjectClass {
            members: Objects::of_instances(form, members),
            objects,
            is_placed,
            name: shader.program.class().name.clone(),
            program: shader.program.clone(),
            packet: shader.shared_kernel(Method::Intersect),
            common_origin: OnceLock::new(),
            leaf: OnceLock::new(),
        }
    }

    /// The number of the object that is the `index`th item of a block.
    #[inline]
    pub fn object(&self, block: &Block, index: usize) -> u32 {
        self.objects[block.of_class as usize * WIDTH + index]
    }

    /// The kernel for packets, from one origin or not; `None` for a class without `intersect`.
    #[inline]
    pub fn packet_kernel(&self, has_common_origin: bool) -> Option<&Kernel> {
        let common_origin = || self.made(&self.common_origin, Shape::CommonOrigin);
        has_common_origin.then(common_origin).flatten().or(self.packet.as_deref())
    }

    /// The kernel for one ray; `None` if it can't be made.
    #[inline]
    pub fn leaf_kernel(&self) -> Option<&Kernel> {
        self.made(&self.leaf, Shape::Leaf)
    }

    /// A kernel that is made when it is first wanted: few scenes want all.
    #[inline]
    fn made<'a>(
        &self,
        cell: &'a OnceLock<Option<Arc<Kernel>>>,
        shape: Shape,
    ) -> Option<&'a Kernel> {
        let make = || {
            let variant = Variant::new(shape).reading(traversal_outputs());
            self.program.kernel(Method::Intersect, variant).ok()
        };
        cell.get_or_init(make).as_deref()
    }
}

/// The class of an object within a group: its shader, and whether it has a space of its own.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct ClassKey {
    /// The number of the group.
    pub group: usize,
    /// The number of the shader.
    pub shader: usize,
    /// Whether its space is not its group's.
    pub is_placed: bool,
}

impl ClassKey {
    /// That of an object.
    pub fn of(group: usize, object: &Object) -> ClassKey {
        let is_placed = !object.inverse.is_identity();
        ClassKey { group, shader: object.primitive.shader, is_placed }
    }
}
