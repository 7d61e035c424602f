//! Objects of one group that share a shader, in the order of the blocks of the group's tree: what one
//! call can test.

use std::collections::BTreeMap;
use std::sync::{Arc, OnceLock};

use rtsl::{
    CallMode, Diagnostic, Instance, Kernel, LeafKernel, Method, Objects, Outputs, Placement,
    Program, Variant, lookup_state,
};
use rtsl_bvh::{Bvh8, Leaf};
use rtsl_math::Affine;
use rtsl_math::SIMD_LANES;
use rtsl_scene::SceneObject;

use super::shaders::Shader;

/// Objects with one shader, placed alike.
pub struct ObjectClass {
    which: ObjectNumbering,
    /// The objects' members, by their numbers: block after block of the tree.
    pub objects: Arc<Objects>,
    /// The class's name, for messages.
    pub name: String,
    program: Arc<Program>,
    /// What kernels for these objects have in common.
    variant: Variant,
    packet: Arc<Kernel>,
    common_origin: OnceLock<Option<Arc<Kernel>>>,
    leaf: OnceLock<Option<LeafKernel>>,
    stream: OnceLock<Option<Arc<Kernel>>>,
    /// `intersect` for nearest hits, where later methods read the scratch that it leaves.
    pub hit: Option<Arc<Kernel>>,
    /// For elements, what is computed of hits, an element for each ray.
    surface: BTreeMap<Method, Arc<Kernel>>,
}

/// ObjectNumbering objects of the scene they are.
enum ObjectNumbering {
    /// Several: each with its number, sorted.
    Separate(Vec<(u32, u32)>),
    /// The elements of one: the number of each element.
    Elements(Vec<u32>),
}

/// What the traversal reads of `intersect`: only where the hit is. What else a hit needs is computed anew
/// for the one that wins.
fn traversal_outputs() -> Outputs {
    Outputs::state(lookup_state("rt_HitDistance"))
}

/// The kernel of `intersect` that every scene with objects of this kind needs.
pub fn packet_variant(program: &Program, is_placed: bool) -> Variant {
    let form = program.separate_objects(is_placed);
    placed(Variant::new(CallMode::Packet), is_placed).reading(traversal_outputs()).of_objects(form)
}

/// The kernel of `intersect` for nearest hits whose scratch is read.
pub fn hit_variant(program: &Program, is_placed: bool) -> Variant {
    packet_variant(program, is_placed).reading(Outputs::NONE.with_scratch())
}

fn placed(variant: Variant, is_placed: bool) -> Variant {
    if is_placed { variant.placed() } else { variant }
}

/// The items of a class in the order of its blocks, with repetitions where blocks are not full.
fn items_in_order(tree: &Bvh8, class: u32) -> Vec<u32> {
    let mut blocks: Vec<&Leaf> = tree.blocks.iter().filter(|block| block.class == class).collect();
    blocks.sort_unstable_by_key(|block| block.of_class);
    blocks.into_iter().flat_map(|block| block.items).collect()
}

impl ObjectClass {
    /// Several objects of a shader; `objects` are by number, with the maps into their own spaces where they
    /// have such.
    ///
    /// # Errors
    /// If a kernel can't be made.
    pub fn of_objects(
        shader: &Shader,
        is_placed: bool,
        numbers: Vec<u32>,
        objects: impl Fn(u32) -> (Arc<Instance>, Affine),
    ) -> Result<ObjectClass, Diagnostic> {
        let members: Vec<(Arc<Instance>, Placement)> = numbers
            .iter()
            .map(|object| objects(*object))
            .map(|(instance, map)| (instance, placement(&map)))
            .collect();
        let made = if is_placed {
            let members = members.iter().map(|(instance, placement)| (&**instance, placement));
            shader.program.placed_objects(members)
        } else {
            shader.program.objects(members.iter().map(|(instance, _)| &**instance))
        };
        let mut numbers: Vec<(u32, u32)> = numbers.into_iter().zip(0..).collect();
        numbers.sort_unstable();
        // Of repetitions the first counts.
        numbers.dedup_by_key(|(object, _)| *object);
        ObjectClass::new(shader, is_placed, made, ObjectNumbering::Separate(numbers))
    }

    /// The elements of one object, which lie in the tree's blocks of this class. `first` is the item that
    /// its first element is.
    ///
    /// # Errors
    /// If they can't be made.
    pub fn of_elements(
        shader: &Shader,
        object: &SceneObject,
        inverse: &Affine,
        (tree, class): (&Bvh8, u32),
        first: u32,
    ) -> Result<ObjectClass, Diagnostic> {
        let order = items_in_order(tree, class).into_iter().map(|item| item - first);
        let order: Vec<u32> = order.collect();
        let mut numbers = vec![0; object.elements.unwrap_or(0) as usize];
        // Backwards, so that of repetitions the first counts.
        for (number, element) in order.iter().enumerate().rev() {
            numbers[*element as usize] = number as u32;
        }
        ObjectClass::of_numbered_elements(shader, object, inverse, &order, numbers)
    }

    /// Compiles what elements need, so that it is there when they are made.
    ///
    /// # Errors
    /// If an element or a kernel can't be made.
    pub fn prepare_elements(
        shader: &Shader,
        object: &SceneObject,
        inverse: &Affine,
    ) -> Result<(), Diagnostic> {
        ObjectClass::of_numbered_elements(shader, object, inverse, &[0], vec![0]).map(drop)
    }

    fn of_numbered_elements(
        shader: &Shader,
        object: &SceneObject,
        inverse: &Affine,
        order: &[u32],
        numbers: Vec<u32>,
    ) -> Result<ObjectClass, Diagnostic> {
        let placement = (!inverse.is_identity()).then(|| placement(inverse));
        let program = &shader.program;
        let made = program.elements_in_order(&object.primitive, placement.as_ref(), order)?;
        let is_placed = placement.is_some();
        ObjectClass::new(shader, is_placed, made, ObjectNumbering::Elements(numbers))
    }

    fn new(
        shader: &Shader,
        is_placed: bool,
        objects: Objects,
        which: ObjectNumbering,
    ) -> Result<ObjectClass, Diagnostic> {
        let program = &shader.program;
        let form = objects.form().clone();
        let variant = placed(Variant::new(CallMode::Packet), is_placed).of_objects(form);
        let intersect = |outputs: Outputs, shape: CallMode| {
            let variant = Variant { shape, ..variant.clone() }.reading(outputs);
            program.kernel(Method::Intersect, variant)
        };
        let packet = intersect(traversal_outputs(), CallMode::Packet)?;
        let has_elements = matches!(which, ObjectNumbering::Elements(_));
        let shape = if has_elements { CallMode::Stream } else { CallMode::Packet };
        let hit = shader.reads_hit_scratch.then(|| intersect(Outputs::NONE.with_scratch(), shape));
        let mut surface = BTreeMap::new();
        if has_elements {
            for (method, outputs) in shader.hit_methods() {
                let variant = Variant { shape, placed: false, ..variant.clone() };
                surface.insert(*method, program.kernel(*method, variant.reading(*outputs))?);
            }
        }
        Ok(ObjectClass {
            which,
            objects: Arc::new(objects),
            name: program.class().name.clone(),
            program: program.clone(),
            packet,
            variant,
            common_origin: OnceLock::new(),
            leaf: OnceLock::new(),
            stream: OnceLock::new(),
            hit: hit.transpose()?,
            surface,
        })
    }

    /// The number of the `index`th item of a block, by which kernels know it.
    #[inline(always)]
    pub fn number(block: &Leaf, index: usize) -> u32 {
        ObjectClass::first_number(block.of_class) + index as u32
    }

    /// The number of the first item of a block of this number among those of its class.
    #[inline(always)]
    pub fn first_number(block_of_class: u32) -> u32 {
        block_of_class * SIMD_LANES as u32
    }

    /// The number by which kernels know an object, or an element of the one that these are elements of.
    pub fn number_of(&self, object: u32, element: u32) -> Option<u32> {
        match &self.which {
            ObjectNumbering::Separate(numbers) => {
                let index = numbers.binary_search_by_key(&object, |(object, _)| *object).ok()?;
                Some(numbers[index].1)
            }
            ObjectNumbering::Elements(numbers) => numbers.get(element as usize).copied(),
        }
    }

    /// The objects' program.
    pub fn program(&self) -> &Arc<Program> {
        &self.program
    }

    /// Whether their space is not their group's.
    pub fn is_placed(&self) -> bool {
        self.variant.placed
    }

    /// Whether the objects are elements of one.
    pub fn has_elements(&self) -> bool {
        match self.which {
            ObjectNumbering::Separate(_) => false,
            ObjectNumbering::Elements(_) => true,
        }
    }

    /// A method that computes something of hits, an element for each ray.
    pub fn surface_kernel(&self, method: Method) -> Option<&Kernel> {
        self.surface.get(&method).map(|kernel| &**kernel)
    }

    /// The kernel for packets, from one origin or not.
    #[inline]
    pub fn packet_kernel(&self, has_common_origin: bool) -> &Kernel {
        if !has_common_origin {
            return &self.packet;
        }
        let common_origin = self.common_origin.get_or_init(|| self.make(CallMode::CommonOrigin));
        common_origin.as_ref().unwrap_or(&self.packet)
    }

    /// The kernel for one ray and some objects in a row; `None` if it can't be made.
    #[inline]
    pub fn leaf_kernel(&self) -> Option<&LeafKernel> {
        let make = || Some(self.make(CallMode::Leaf)?.for_leaves(self.objects.clone()));
        self.leaf.get_or_init(make).as_ref()
    }

    /// The kernel for rays each with an object of its own; `None` if it can't be made.
    #[inline]
    pub fn stream_kernel(&self) -> Option<&Kernel> {
        self.stream.get_or_init(|| self.make(CallMode::Stream)).as_deref()
    }

    /// Makes the kernels that are else made when they are first wanted: for those who will want them, and would wait.
    /// That for streams is made where there are any.
    pub fn make_all(&self, has_streams: bool) {
        self.leaf_kernel();
        self.packet_kernel(true);
        if has_streams {
            self.stream_kernel();
        }
    }

    /// A kernel that is made when it is first wanted: few scenes want all.
    fn make(&self, shape: CallMode) -> Option<Arc<Kernel>> {
        let variant = Variant { shape, ..self.variant.clone() }.reading(traversal_outputs());
        self.program.kernel(Method::Intersect, variant).ok()
    }
}

/// The objects of a class in the order of its blocks.
pub fn objects_in_order(tree: &Bvh8, class: u32, object: impl Fn(u32) -> Option<u32>) -> Vec<u32> {
    items_in_order(tree, class).into_iter().map(|item| object(item).unwrap_or_default()).collect()
}

fn placement(map: &Affine) -> Placement {
    let columns = map.columns.as_flattened();
    std::array::from_fn(|index| columns[index])
}
