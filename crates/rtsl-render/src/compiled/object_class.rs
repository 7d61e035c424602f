//! Traversal classes: objects of one group that share a shader, in the order of the leaves of the group's tree, so that
//! one call can test several.

use std::sync::{Arc, OnceLock};

use rayon::prelude::*;
use rtsl::{
    CallMode, Diagnostic, Instance, Kernel, LeafKernel, Method, Objects, Placement, Program,
    Variant,
};
use rtsl_bvh::{Geometry, Leaf};
use rtsl_math::{Affine, SIMD_LANES};
use rtsl_memory::on_all_processors;
use rtsl_scene::SceneObject;

use super::intersect_variants::{placed, traversal_outputs};
use super::shaders::Shader;

/// Objects of one shader, either all with or all without a transform.
pub struct ObjectClass {
    which: ObjectNumbering,
    /// The objects' members, by index, in the order of the tree's leaves.
    pub objects: Arc<Objects>,
    /// The class's name, for messages.
    pub name: String,
    program: Arc<Program>,
    /// The variant of kernels for these objects.
    variant: Variant,
    packet: Arc<Kernel>,
    common_origin: OnceLock<Option<Arc<Kernel>>>,
    leaf: OnceLock<Option<LeafKernel>>,
    stream: OnceLock<Option<Arc<Kernel>>>,
}

/// The mapping of the scene's objects to indices in the class.
enum ObjectNumbering {
    /// Several objects, each with its index, sorted.
    Separate(Vec<(u32, u32)>),
    /// The elements of one object: the index of each, among those of several objects.
    Elements(Vec<u32>),
}

impl ObjectClass {
    /// Creates a class of several objects of a shader; `objects` are by index, with the transforms into their own
    /// spaces if they have them.
    ///
    /// # Errors
    /// If a kernel cannot be compiled.
    pub fn of_objects(
        shader: &Shader,
        is_placed: bool,
        order: Vec<u32>,
        objects: impl Fn(u32) -> (Arc<Instance>, Affine),
    ) -> Result<ObjectClass, Diagnostic> {
        let members: Vec<(Arc<Instance>, Placement)> = order
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
        let mut indices: Vec<(u32, u32)> = order.into_iter().zip(0..).collect();
        indices.sort_unstable();
        // Of repetitions the first counts.
        indices.dedup_by_key(|(object, _)| *object);
        ObjectClass::new(shader, is_placed, made, ObjectNumbering::Separate(indices))
    }

    /// Creates the classes of objects whose elements are in leaves together; `order` has, for each place in leaves, the
    /// index of the object among these and the number of the element. The classes share a table of all.
    ///
    /// # Errors
    /// If elements or kernels cannot be created.
    pub fn of_elements(
        shader: &Shader,
        objects: &[&SceneObject],
        inverse: &Affine,
        order: &[(u32, u32)],
    ) -> Result<Vec<ObjectClass>, Diagnostic> {
        let mut places: Vec<ElementPlaces> = Vec::new();
        places.resize_with(objects.len(), ElementPlaces::default);
        for (place, (object, element)) in (0..).zip(order) {
            let of_object = &mut places[*object as usize];
            of_object.elements.push(*element);
            of_object.places.push(place);
        }
        let make = |object: &SceneObject, numbers: &[u32]| {
            let placement = (!inverse.is_identity()).then(|| placement(inverse));
            shader.program.elements_in_order(&object.primitive, placement.as_ref(), numbers)
        };
        let tables = match (objects, &places[..]) {
            ([object], [ElementPlaces { elements, .. }]) => vec![make(object, elements)?],
            _ => together(order.len(), objects, &places, make)?,
        };
        let classes = objects.iter().zip(places).zip(tables).map(|((object, of_object), table)| {
            let mut indices = vec![0; object.elements.unwrap_or(0) as usize];
            // Backwards, so that of repetitions the first counts.
            for (element, place) in of_object.elements.iter().zip(&of_object.places).rev() {
                indices[*element as usize] = *place;
            }
            ObjectClass::new(
                shader,
                !inverse.is_identity(),
                table,
                ObjectNumbering::Elements(indices),
            )
        });
        classes.collect()
    }

    /// Compiles the kernels of elements, so that they are ready when the elements are created.
    ///
    /// # Errors
    /// If an element or a kernel cannot be created.
    pub fn prepare_elements(
        shader: &Shader,
        object: &SceneObject,
        inverse: &Affine,
    ) -> Result<(), Diagnostic> {
        ObjectClass::of_elements(shader, &[object], inverse, &[(0, 0)]).map(drop)
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
        let of_packets = variant.clone().reading(traversal_outputs());
        let packet = program.kernel(Method::Intersect, of_packets)?;
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
        })
    }

    /// Returns the index by which kernels know an item of a leaf.
    #[inline(always)]
    pub fn item_index(leaf: &Leaf, index: usize) -> u32 {
        ObjectClass::first_index(leaf.index_in_class) + index as u32
    }

    /// Returns the index of the first item of a leaf, given the leaf's index among those of its class.
    #[inline(always)]
    pub fn first_index(leaf_index: u32) -> u32 {
        leaf_index * SIMD_LANES as u32
    }

    /// Returns the index by which kernels know an object, or an element of the object whose elements form this class.
    pub fn index_of(&self, object: u32, element: u32) -> Option<u32> {
        match &self.which {
            ObjectNumbering::Separate(indices) => {
                let position = indices.binary_search_by_key(&object, |(object, _)| *object).ok()?;
                Some(indices[position].1)
            }
            ObjectNumbering::Elements(indices) => indices.get(element as usize).copied(),
        }
    }

    /// Returns the objects' program.
    pub fn program(&self) -> &Arc<Program> {
        &self.program
    }

    /// True if the objects have transforms to their group's space.
    pub fn is_placed(&self) -> bool {
        self.variant.placed
    }

    /// True if the objects are elements of one object.
    pub fn has_elements(&self) -> bool {
        match self.which {
            ObjectNumbering::Separate(_) => false,
            ObjectNumbering::Elements(_) => true,
        }
    }

    /// Returns the kernel for packets with or without a common origin.
    #[inline]
    pub fn packet_kernel(&self, has_common_origin: bool) -> &Kernel {
        if !has_common_origin {
            return &self.packet;
        }
        let common_origin = self.common_origin.get_or_init(|| self.make(CallMode::CommonOrigin));
        common_origin.as_ref().unwrap_or(&self.packet)
    }

    /// Returns the kernel for one ray and several consecutive objects; `None` if it cannot be compiled.
    #[inline]
    pub fn leaf_kernel(&self) -> Option<&LeafKernel> {
        let make = || Some(self.make(CallMode::Leaf)?.for_leaves(self.objects.clone()));
        self.leaf.get_or_init(make).as_ref()
    }

    /// Returns the kernel for rays with one object each; `None` if it cannot be compiled.
    #[inline]
    pub fn stream_kernel(&self) -> Option<&Kernel> {
        self.stream.get_or_init(|| self.make(CallMode::Stream)).as_deref()
    }

    /// Compiles the kernels that are otherwise compiled at their first use, so that rendering does not wait for them.
    /// The stream kernel is compiled if there are streams.
    pub fn make_all(&self, has_streams: bool) {
        self.leaf_kernel();
        self.packet_kernel(true);
        if has_streams {
            self.stream_kernel();
        }
    }

    /// Compiles a kernel at its first use: few scenes need all.
    fn make(&self, mode: CallMode) -> Option<Arc<Kernel>> {
        let variant = Variant { mode, ..self.variant.clone() }.reading(traversal_outputs());
        let variant = match mode {
            // Wider vectors would be half empty: public scenes trace 1.02 to 1.05 times as many rays a second by this
            // width as by 16 (Zen 5).
            CallMode::Leaf => variant.with_width(self.program.width().min(SIMD_LANES as u32)),
            _ => variant,
        };
        self.program.kernel(Method::Intersect, variant).ok()
    }
}

/// The places of an object's elements in leaves.
#[derive(Default)]
struct ElementPlaces {
    elements: Vec<u32>,
    places: Vec<u32>,
}

/// Returns a table of the elements of several objects for each of them, with the object's own data as shared ones. All
/// are in the same memory.
fn together(
    count: usize,
    objects: &[&SceneObject],
    places: &[ElementPlaces],
    make: impl Fn(&SceneObject, &[u32]) -> Result<Objects, Diagnostic> + Sync,
) -> Result<Vec<Objects>, Diagnostic> {
    let made = |(object, places): (&&SceneObject, &ElementPlaces)| make(object, &places.elements);
    let parts: Vec<Objects> = on_all_processors(|| {
        objects.par_iter().zip(places).map(made).collect::<Result<_, Diagnostic>>()
    })?;
    let mut all = Objects::new(parts[0].form().clone(), parts[0].shared().clone(), count);
    for (part, ElementPlaces { places, .. }) in parts.iter().zip(places) {
        all.store(part, places);
    }
    Ok(parts.iter().map(|part| all.sharing(part.shared().clone())).collect())
}

/// Returns the items of each of so many classes in the order of its leaves, of which those that are not full contain
/// repetitions.
pub fn items_in_order(geometry: &Geometry, classes: usize) -> Vec<Vec<u32>> {
    let mut of_classes = vec![Vec::new(); classes];
    for leaf in geometry.groups.iter().flat_map(|group| &group.tree.leaves) {
        let Some(items) = of_classes.get_mut(leaf.class as usize) else { continue };
        let first = ObjectClass::first_index(leaf.index_in_class) as usize;
        let end = first + leaf.items.len();
        items.resize(end.max(items.len()), 0);
        items[first..end].copy_from_slice(&leaf.items);
    }
    of_classes
}

fn placement(map: &Affine) -> Placement {
    let columns = map.columns.as_flattened();
    std::array::from_fn(|index| columns[index])
}
