//! Classes of surfaces, for which the stages of integrators are linked.

use std::collections::BTreeMap;
use std::sync::Arc;

use rtsl_abi::{InstanceBlock, InstanceRun, Layout};
use rtsl_integrate::stage::{Answer, SurfaceLinks, SurfaceMethod};
use rtsl_integrate::surface::{Places, ShapeLinks};
use rtsl_ir::Query;
use rtsl_link::LinkedMethod;
use rtsl_source::Diagnostic;
use rtsl_spec::{Method, StateVariable, lookup_state};

use super::program::Program;
use crate::instance::instance::Instance;
use crate::threads::each_on_threads;

/// Surfaces with materials of one class, and emitters of one class.
#[derive(Clone, Debug)]
pub struct SurfaceClass {
    /// The materials.
    pub material: Arc<Program>,
    /// True if the materials are the shapes themselves, whose methods may read the scratch of `intersect`.
    pub is_own_material: bool,
    /// The materials of additional emission, which area lights have.
    pub emitter: Option<Arc<Program>>,
    /// True if light samples may choose the surfaces.
    pub is_sampled: bool,
    /// The shapes, if kernels compute the properties of their surfaces.
    pub shape: Option<ShapeClass>,
}

/// Shapes of one class, whose methods become parts of kernels of stages.
#[derive(Clone, Debug)]
pub struct ShapeClass {
    program: Arc<Program>,
    links: ShapeLinks,
}

impl ShapeClass {
    /// Returns the shapes of a program, which are placed in the world or in it; `None` if their methods need more than
    /// the ray and the hit. `is_sampled` is true if light samples may choose them.
    pub fn new(program: &Arc<Program>, is_placed: bool, is_sampled: bool) -> Option<ShapeClass> {
        let class = ShapeClass::with_prefix(program, SHAPE.to_owned(), is_placed, is_sampled)?;
        class.links.is_complete().then_some(class)
    }

    /// Returns the shapes with a path to their members; `None` if `intersect` is not linked, but read.
    pub(crate) fn with_prefix(
        program: &Arc<Program>,
        prefix: String,
        is_placed: bool,
        is_sampled: bool,
    ) -> Option<ShapeClass> {
        let linked = |method: Method| Some((method, program.method(method).ok()?));
        let mut methods: BTreeMap<Method, Arc<LinkedMethod>> =
            DESCRIBING.into_iter().filter_map(linked).collect();
        if methods.values().any(|method| method.reads_scratch) {
            let intersect = program.placed_method(Method::Intersect, is_placed).ok()?;
            methods.insert(Method::Intersect, intersect);
        }
        let density = program.method(Method::SamplePdf).ok().filter(|_| is_sampled);
        let is_sampled = density.is_some();
        let density = density.and_then(ShapeLinks::linked_density);
        let places = Places::Members { are_grouped: false };
        let links = ShapeLinks { prefix, methods, is_placed, is_sampled, density, places };
        Some(ShapeClass { program: program.clone(), links })
    }

    /// The same shapes in groups that instances place, which do not move.
    pub(crate) fn in_groups(mut self) -> ShapeClass {
        self.links.places = Places::Members { are_grouped: true };
        self
    }

    /// The methods.
    pub(crate) fn links(&self) -> &ShapeLinks {
        &self.links
    }

    /// Adds the members of the shapes to the layout of an integrator.
    pub(crate) fn add_to(&self, layout: &mut Layout) {
        add_part(layout, &self.links.prefix, self.program.layout());
        add_members(layout, self.links.members());
    }

    /// Returns the data of a shape, or of its elements, in the order of the layout.
    pub(crate) fn runs(&self, object: &ShapeObject) -> [InstanceRun; 2] {
        [object.shapes.clone(), object.places(&self.links)]
    }
}

/// A shape in the world, or in a group that an instance places there, or the elements of one.
#[derive(Clone)]
pub struct ShapeObject {
    /// The data of the shape, or of each element.
    pub shapes: InstanceRun,
    /// The map from the group, or the world, to its space, by columns: the images of the axes, then that of the origin.
    pub inverse: [f32; 12],
    /// The map from its space to the group.
    pub forward: [f32; 12],
    /// The map of magnitudes of coordinates, from the group to its space and back, by which rounding errors grow.
    pub sizes: [f32; 12],
    /// The extents of the bounding box of each along the axes of the group.
    pub extents: Vec<[f32; 3]>,
    /// True if its normals are flipped.
    pub reverse_orientation: bool,
    /// The factor by which volumes are scaled from its space to the group.
    pub volume_scale: f32,
    /// The place of the group, unless it is the world.
    pub group: Option<GroupPlace>,
    /// The [way](crate::LightSelection::way) to each in the light hierarchy, if light samples choose it.
    pub ways: Vec<u32>,
}

/// The place of a group of shapes that does not move.
#[derive(Clone, Copy, Debug)]
pub struct GroupPlace {
    /// The map from the world to its space, by columns.
    pub inverse: [f32; 12],
    /// The map from its space to the world.
    pub forward: [f32; 12],
    /// The factor by which volumes are scaled from its space to the world.
    pub volume_scale: f32,
}

/// The instances of the parts of one surface.
#[derive(Clone)]
pub struct SurfaceObject<'a> {
    /// The material.
    pub material: &'a Instance,
    /// The emitter, if the class has them.
    pub emitter: Option<&'a Instance>,
    /// The shape, if the class has them.
    pub shape: Option<ShapeObject>,
}

/// The methods of shapes that describe surfaces.
pub(super) const DESCRIBING: [Method; 3] =
    [Method::ComputeNormal, Method::ComputeTextureCoordinates, Method::ComputeDerivatives];

/// The path to the members of shapes in linked stages.
const SHAPE: &str = "shape.";
/// The path to the members of materials.
const MATERIAL: &str = "material.";
/// The path to the members of emitters.
const EMITTER: &str = "emitter.";

/// The methods of materials that stages call.
const CALLED: [Method; 4] =
    [Method::Emission, Method::Bsdf, Method::SampleBsdf, Method::EvaluatePdf];

impl SurfaceClass {
    /// Links the methods of materials and emitters that stages call, on all processors.
    ///
    /// # Errors
    /// If linking passes a limit.
    pub fn link_methods(classes: &[Arc<SurfaceClass>]) -> Result<(), Diagnostic> {
        let mut methods: BTreeMap<(usize, Method), &Program> = BTreeMap::new();
        for program in classes.iter().flat_map(|it| it.emitter.iter().chain([&it.material])) {
            let called = CALLED.into_iter().filter(|method| program.has(*method));
            methods.extend(called.map(|it| ((Arc::as_ptr(program).addr(), it), &**program)));
        }
        let methods: Vec<(Method, &Program)> =
            methods.into_iter().map(|((_, method), program)| (method, program)).collect();
        let linked = each_on_threads(methods.len(), |index| {
            let (method, program) = methods[index];
            program.method(method).map(drop)
        });
        linked.into_iter().collect()
    }

    /// True if the parts have the same classes.
    pub(crate) fn is_like(&self, other: &SurfaceClass) -> bool {
        let programs = |class: &SurfaceClass| {
            let shape = class.shape.as_ref().map(|shape| Arc::as_ptr(&shape.program));
            (Arc::as_ptr(&class.material), class.emitter.as_ref().map(Arc::as_ptr), shape)
        };
        let kinds = |class: &SurfaceClass| {
            let shape = class.shape.as_ref().map(ShapeClass::links);
            let shape = shape.map(|links| (links.is_placed, links.is_sampled));
            (class.is_own_material, class.is_sampled, shape)
        };
        programs(self) == programs(other) && kinds(self) == kinds(other)
    }

    /// Adds the members of the parts to the layout of an integrator.
    pub(crate) fn add_to(&self, layout: &mut Layout) {
        add_part(layout, MATERIAL, self.material.layout());
        if let Some(emitter) = &self.emitter {
            add_part(layout, EMITTER, emitter.layout());
        }
        self.shape.iter().for_each(|shape| shape.add_to(layout));
    }

    /// Returns the data of a surface's parts, of several elements for each, in the order of the layout.
    ///
    /// # Panics
    /// If an instance belongs to another program.
    pub(crate) fn run(&self, surface: &SurfaceObject<'_>) -> InstanceRun {
        let mut parts = vec![InstanceRun::new(self.material.block(surface.material), 1)];
        let emitter = self.emitter.as_ref().zip(surface.emitter);
        parts.extend(
            emitter.map(|(program, instance)| InstanceRun::new(program.block(instance), 1)),
        );
        let shape = self.shape.as_ref().zip(surface.shape.as_ref());
        parts.extend(shape.into_iter().flat_map(|(class, object)| class.runs(object)));
        InstanceRun::joined(&parts)
    }

    /// True if all methods that draw random numbers need nothing else of a host.
    ///
    /// If only some did, the counts of sequences of the host and of the stages would differ.
    pub(crate) fn may_draw(&self) -> bool {
        let methods = [Method::Emission, Method::SampleBsdf, Method::Bsdf, Method::EvaluatePdf];
        let of_material = methods.into_iter().map(|method| self.material.method(method));
        let of_emitter = self.emitter.iter().map(|emitter| emitter.method(Method::Emission));
        let mut drawing = of_material.chain(of_emitter).flatten().filter(|it| it.draws_numbers());
        let answers = self.links(None, true, None).answers;
        drawing.all(|method| {
            let mut linked = answers.values().filter_map(Answer::method);
            linked.any(|linked| Arc::ptr_eq(linked, &method))
        })
    }

    /// Returns the answers to queries about such surfaces that need no host. Methods that draw random numbers are among
    /// them if they `may_draw`; `shade` computes the own colours of shaded surfaces, if it is linked.
    pub(crate) fn links(
        &self,
        found: Option<bool>,
        may_draw: bool,
        shade: Option<SurfaceMethod>,
    ) -> SurfaceLinks {
        let mut answers = BTreeMap::new();
        self.link_emission(&mut answers);
        self.link_scattering(&mut answers);
        match &self.emitter {
            None => {
                answers.insert(Query::LightEmission, Answer::Zeros);
            }
            Some(emitter) => {
                if let Ok(method) = emitter.method(Method::Emission) {
                    insert(&mut answers, Query::LightEmission, &method, EMITTER);
                }
            }
        }
        if !self.is_sampled {
            answers.insert(Query::LightPdf, Answer::Zeros);
        }
        if !may_draw {
            let draws = |answer: &Answer| answer.method().is_some_and(|it| it.draws_numbers());
            answers.retain(|_, answer| !draws(answer));
        }
        answers.extend(shade.map(|method| (Query::OwnShade, Answer::Method(method))));
        let shape = self.shape.as_ref().map(|shape| shape.links.clone());
        SurfaceLinks { answers, found, shape, ..SurfaceLinks::default() }
    }

    /// Materials that only have `shade` emit what it returns.
    fn link_emission(&self, answers: &mut BTreeMap<Query, Answer>) {
        let has_only_shade =
            self.material.has(Method::Shade) && !self.material.has(Method::SampleBsdf);
        if has_only_shade {
            return;
        }
        match self.method(Method::Emission, "rt_EmissionColor") {
            None => {
                answers.insert(Query::Emission, Answer::Zeros);
            }
            Some(method) => self.insert(answers, Query::Emission, &method),
        }
    }

    fn link_scattering(&self, answers: &mut BTreeMap<Query, Answer>) {
        let scatters = self.material.has(Method::SampleBsdf);
        let sample = self.material.method(Method::SampleBsdf).ok().filter(|_| scatters);
        // Light samples contribute nothing to materials with deltas only.
        let value = self.method(Method::Bsdf, "rt_BSDFValue").filter(|_| scatters);
        let density = self.material.method(Method::EvaluatePdf).ok();
        let density = density.filter(|_| value.is_some());
        for (query, method) in
            [(Query::SampleBsdf, sample), (Query::Bsdf, value), (Query::BsdfPdf, density)]
        {
            match method {
                None => {
                    answers.insert(query, Answer::Zeros);
                }
                Some(method) => self.insert(answers, query, &method),
            }
        }
    }

    /// Returns a method of the materials, unless it always leaves its result zero.
    fn method(&self, method: Method, result: &str) -> Option<Arc<LinkedMethod>> {
        let is_zero =
            |method: &LinkedMethod, variable: &StateVariable| method.leaves_zero(variable);
        let linked = self.material.method(method).ok()?;
        let variable = lookup_state(result)?;
        (!is_zero(&linked, variable)).then_some(linked)
    }

    fn insert(
        &self,
        answers: &mut BTreeMap<Query, Answer>,
        query: Query,
        method: &Arc<LinkedMethod>,
    ) {
        if !(self.is_own_material && method.reads_scratch) {
            insert(answers, query, method, MATERIAL);
        }
    }
}

/// Returns the method that computes the own colours of shaded surfaces, if it may be part of stages: `shade` that waits
/// for nothing, or `emission` of materials without. It adds the light of lights to the radiance of paths, and spawns
/// their rays.
pub(crate) fn own_shade(material: &Program, is_own_material: bool) -> Option<SurfaceMethod> {
    let (method, color): (_, &[&str]) = match material.has(Method::Shade) {
        true => (material.deferring_method(Method::Shade).ok()?, &["rt_SampleColor"]),
        false => (material.method(Method::Emission).ok()?, &["rt_EmissionColor"]),
    };
    let reads_shape = is_own_material && method.reads_scratch;
    if reads_shape { None } else { SurfaceMethod::shading(&method, MATERIAL, color) }
}

impl ShapeObject {
    /// The number of elements; 1 for a shape without.
    pub fn count(&self) -> usize {
        self.shapes.count()
    }

    /// Returns each element as an object of its own.
    pub fn elements(&self) -> impl Iterator<Item = ShapeObject> {
        (0..self.count()).map(|index| ShapeObject {
            shapes: InstanceRun::new(self.shapes.instance(index), 1),
            extents: vec![self.extents[index]],
            ways: vec![self.ways[index]],
            ..self.clone()
        })
    }

    /// Returns the data of the places, in the order of [`ShapeLinks::members`].
    fn places(&self, links: &ShapeLinks) -> InstanceRun {
        let ShapeObject { extents, ways, .. } = self;
        let maps = [self.inverse, self.forward, self.sizes].concat();
        let maps = if links.is_placed { &maps[..] } else { &[] };
        let side = if self.reverse_orientation { -1.0_f32 } else { 1.0 };
        let mut words: Vec<u32> = maps.iter().map(|it| it.to_bits()).collect();
        let first_extent = words.len() as u32;
        words.extend([0; 3]);
        words.push(side.to_bits());
        let way = links.is_sampled.then_some(words.len() as u32 + 1);
        if links.is_sampled {
            words.extend([self.volume_scale.to_bits(), 0]);
        }
        words.extend(self.group.iter().flat_map(GroupPlace::floats).map(f32::to_bits));
        let mut run = InstanceRun::new(InstanceBlock::new(&words, Vec::new()), self.count());
        for (axis, word) in (first_extent..).take(3).enumerate() {
            let values = extents.iter().map(|extents| extents[axis].to_bits());
            run = run.with_column(word, values.collect());
        }
        match way {
            Some(word) => run.with_column(word, ways.clone()),
            None => run,
        }
    }
}

impl GroupPlace {
    /// The numbers in the order of [`ShapeLinks::members`].
    fn floats(&self) -> impl Iterator<Item = f32> {
        let GroupPlace { inverse, forward, volume_scale } = *self;
        inverse.into_iter().chain(forward).chain([volume_scale])
    }
}

/// Adds the members of a part to a layout.
pub(crate) fn add_part(layout: &mut Layout, prefix: &str, part: &Layout) {
    let first = layout.block_words;
    let moved = |(name, word): (&String, &u32)| (format!("{prefix}{name}"), first + word);
    layout.members.extend(part.members.iter().map(moved));
    layout.buffers.extend(part.buffers.iter().map(moved));
    layout.block_words += part.block_words;
}

/// Adds members to a layout, whose data is a block of its own.
pub(crate) fn add_members(layout: &mut Layout, members: impl IntoIterator<Item = (String, u32)>) {
    for (name, scalars) in members {
        layout.members.insert(name, layout.block_words);
        layout.block_words += scalars;
    }
    // As blocks do.
    layout.block_words = layout.block_words.next_multiple_of(2);
}

/// Returns the answers to queries about a surface that the scene does not have.
pub(crate) fn no_surface(found: Option<bool>) -> SurfaceLinks {
    let answers = Query::of_surfaces().map(|query| (query, Answer::Zeros)).collect();
    SurfaceLinks { answers, found, ..SurfaceLinks::default() }
}

fn insert(
    answers: &mut BTreeMap<Query, Answer>,
    query: Query,
    method: &Arc<LinkedMethod>,
    prefix: &'static str,
) {
    if let Some(method) = SurfaceMethod::answering(query, method, prefix) {
        answers.insert(query, Answer::Method(method));
    }
}
