//! Searches: each ray is tested against every object of a scene that has few, by the functions of
//! `prelude/renderer/search.rtsl` and copies of `intersect` between them.
//!
//! Hits are those that searches of hierarchies find, to the bit: boxes are tested with the same operations, and
//! `intersect` gets the ray's own limit.

use std::sync::Arc;

use rtsl_ir::{
    BinaryOp, Constant, Index, Op, OpKind, Output, Region, Scalar, StateComponent, Value, Variable,
    VariableKind,
};
use rtsl_link::{Linked, LinkedMethod, Linker, Linking, Site, find_override};
use rtsl_stages::{Port, ResumedBy};

use crate::arithmetic::Arithmetic;
use crate::lights::set;
use crate::sequences::Purpose;
use crate::stage::TIME_COLUMN;
use crate::stage_linker::StageLinker;
use crate::surface::needs_only;

/// The member with the least distance of hits of rays that do not have their own.
pub const EPSILON: &str = "search.epsilon";
/// The member with the objects of items.
pub const ITEM_OBJECTS: &str = "search.objects";
/// The member with the elements of items.
pub const ITEM_ELEMENTS: &str = "search.elements";
/// The member with the groups of items.
pub const ITEM_GROUPS: &str = "search.groups";
/// The member with the indices of items' surfaces among those of their groups.
pub const ITEM_SURFACES: &str = "search.surfaces";
/// The scratch array with the group of the surface that a search has found; 0 for none.
pub const GROUP_COLUMN: &str = "path.group";
/// The scratch array with the index of that surface among those of its group; 0 for none.
pub const SURFACE_COLUMN: &str = "path.surface";
/// The scratch array with the number of searches of each path.
pub const SEARCHES_COLUMN: &str = "path.searches";
/// The member of a class with the own boxes of its objects, minima first.
pub const BOX: &str = "rt_Box";
/// The member of a class with the items of its objects.
pub const ITEM: &str = "rt_Item";
/// The number of scalars of a box.
pub const BOX_SCALARS: u32 = 6;

/// The state that `intersect` may read.
const INPUTS: [&str; 6] = [
    "rt_RayOrigin",
    "rt_RayDirection",
    "rt_InverseRayDirection",
    "rt_HitDistance",
    "rt_Epsilon",
    "rt_TimeSeed",
];

/// A question about the hits of rays.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Search {
    /// The nearest hit: see [`ResumedBy::NearestHit`].
    Nearest,
    /// The existence of a hit: see [`ResumedBy::Occluded`].
    Any,
}

/// The objects among which rays search.
#[derive(Clone, Debug)]
pub struct SearchLinks {
    /// The objects, by class.
    pub classes: Vec<SearchedClassLink>,
    /// The number of items.
    pub items: u32,
    /// The fraction by which the distances at which rays enter and leave boxes are widened.
    pub slack: f32,
}

/// Objects of one class.
#[derive(Clone, Debug)]
pub struct SearchedClassLink {
    /// The path to their members, each of which is an array with the scalars of object after object.
    pub prefix: String,
    /// The number of objects.
    pub count: u32,
    /// `intersect`, which places the ray.
    pub intersect: Arc<LinkedMethod>,
}

impl SearchedClassLink {
    /// True if `intersect` needs nothing but the ray and scalars of the object.
    pub fn is_complete(&self) -> bool {
        let LinkedMethod { function, .. } = &*self.intersect;
        let mut has_buffers = false;
        function.body.for_each_op(&mut |op| {
            if let OpKind::Load(variable, _) | OpKind::Length(variable) = &op.kind {
                has_buffers |= function.variable(*variable).kind == VariableKind::Buffer;
            }
        });
        !has_buffers && needs_only(&self.intersect, &INPUTS)
    }
}

/// The object of an array of objects for which a method is copied.
#[derive(Clone, Copy)]
pub(crate) struct ArrayElement {
    pub index: Value,
    pub count: u32,
}

/// Links a search. Rays are in the [ports](Port::Request) of requests, and answers in those of [answers](Port::Answer).
///
/// # Errors
/// If linking passes a limit.
pub fn link_search(links: &SearchLinks, search: Search) -> Linking<Linked> {
    let name = match search {
        Search::Nearest => "search.nearest",
        Search::Any => "search.any",
    };
    let mut linker = StageLinker::new(name);
    let mut ops = Vec::new();
    let code = SearchCode { links, search };
    let requests = &mut Arithmetic { linker: &mut linker, to: &mut ops };
    let ports = search.event().request().iter();
    let request = ports.map(|port| requests.column(&Port::Request(*port).name(), Scalar::F32));
    let request = request.collect::<Linking<Vec<Value>>>()?;
    let nearest = code.find(&mut linker, &request, &mut ops)?;
    let outputs = match search {
        Search::Any => {
            let is_found = Arithmetic { linker: &mut linker, to: &mut ops }.is_found(nearest)?;
            vec![(Port::Answer(0).name(), is_found)]
        }
        Search::Nearest => {
            let mut outputs = code.answers(&mut linker, nearest, &mut ops)?;
            outputs.extend(Arithmetic { linker: &mut linker, to: &mut ops }.counts()?);
            outputs
        }
    };
    for (name, value) in outputs {
        linker.set_column(name, value);
    }
    linker.out.body.ops = ops;
    Ok(linker.finish())
}

impl Search {
    /// Returns the event for which paths that search wait.
    pub fn event(self) -> ResumedBy {
        match self {
            Search::Nearest => ResumedBy::NearestHit,
            Search::Any => ResumedBy::Occluded,
        }
    }
}

/// A ray.
struct Ray {
    /// An `rt_SearchRay`.
    scalars: Vec<Value>,
    /// The state that `intersect` reads.
    state: Vec<(StateComponent, Value)>,
}

/// The place of the limit among the scalars of an `rt_SearchRay`.
const LIMIT: usize = 9;

/// The nearest hit so far: an `rt_Nearest`.
pub(crate) type Nearest = [Value; 2];

/// The scalars of an `rt_Nearest`.
const NEAREST: [Scalar; 2] = [Scalar::F32, Scalar::I32];

/// An object that is tested, or each of several.
#[derive(Clone, Copy)]
struct Tested<'a> {
    class: &'a SearchedClassLink,
    element: Option<ArrayElement>,
}

/// The operations of a search, which are added to a function.
#[derive(Clone, Copy)]
pub(crate) struct SearchCode<'a> {
    pub links: &'a SearchLinks,
    pub search: Search,
}

impl SearchCode<'_> {
    /// Searches along a ray, given the operands of a request.
    pub fn find(
        self,
        linker: &mut StageLinker,
        request: &[Value],
        to: &mut Vec<Op>,
    ) -> Linking<Nearest> {
        let ray = self.ray(linker, request, to)?;
        let nearest = linker.call_text("rt_nothingWithin", &[ray.scalars[LIMIT]], to)?;
        let mut nearest = [nearest[0], nearest[1]];
        for class in &self.links.classes {
            nearest = self.test_class(linker, class, &ray, nearest, to)?;
        }
        Ok(nearest)
    }

    fn ray(self, linker: &mut StageLinker, request: &[Value], to: &mut Vec<Op>) -> Linking<Ray> {
        let code = &mut Arithmetic { linker, to };
        let mut operands = request.to_vec();
        if self.search == Search::Any {
            // Its requests have no epsilon.
            operands.insert(6, code.float(0.0)?);
        }
        operands.push(code.load_member(EPSILON, Scalar::F32)?);
        let scalars = code.call("rt_searchRay", &operands)?;
        let time = code.column(TIME_COLUMN, Scalar::F32)?;
        let mut state = Vec::new();
        for (name, values) in [
            ("rt_RayOrigin", &scalars[..3]),
            ("rt_RayDirection", &scalars[3..6]),
            ("rt_InverseRayDirection", &scalars[6..LIMIT]),
            ("rt_HitDistance", &scalars[LIMIT..10]),
            ("rt_Epsilon", &scalars[10..11]),
            ("rt_TimeSeed", &[time]),
        ] {
            set(&mut state, name, values);
        }
        Ok(Ray { scalars, state })
    }

    /// Tests the ray against all objects of a class.
    fn test_class(
        self,
        linker: &mut StageLinker,
        class: &SearchedClassLink,
        ray: &Ray,
        nearest: Nearest,
        to: &mut Vec<Op>,
    ) -> Linking<Nearest> {
        if class.count == 1 {
            return self.test_object(linker, Tested { class, element: None }, ray, nearest, to);
        }
        let first = linker.constant(to, Constant::I32(0))?;
        let scalars = [Scalar::I32, NEAREST[0], NEAREST[1]];
        let params = linker.out.new_values(&scalars);
        let [index, distance, item] = [0, 1, 2].map(|param| params.get(param));
        let mut body = Region { params: vec![index, distance, item], ..Region::default() };
        let object = Tested { class, element: Some(ArrayElement { index, count: class.count }) };
        linker.nested(|linker| {
            let known = [distance, item];
            let [distance, item] = self.test_object(linker, object, ray, known, &mut body.ops)?;
            let code = &mut Arithmetic { linker, to: &mut body.ops };
            let one = code.integer(1)?;
            let next = code.add(index, one)?;
            let end = code.integer(class.count as i32)?;
            body.yields = vec![code.less(next, end)?, next, distance, item];
            Ok(())
        })?;
        let initial = vec![first, nearest[0], nearest[1]];
        let results = linker.emit(to, OpKind::Loop { initial, body }, &scalars, false)?;
        Ok([results.get(1), results.get(2)])
    }

    /// Tests the ray against an object, if it meets its box.
    fn test_object(
        self,
        linker: &mut StageLinker,
        object: Tested<'_>,
        ray: &Ray,
        nearest: Nearest,
        to: &mut Vec<Op>,
    ) -> Linking<Nearest> {
        let mut operands = ray.scalars.clone();
        for plane in 0..BOX_SCALARS {
            operands.push(object.load(linker, (BOX, Scalar::F32, BOX_SCALARS), plane, to)?);
        }
        let code = &mut Arithmetic { linker: &mut *linker, to: &mut *to };
        operands.push(code.float(self.links.slack)?);
        operands.extend(nearest);
        let any_hit = code.boolean(self.search == Search::Any)?;
        operands.push(any_hit);
        let [meets, entry] = code.call("rt_meetsBox", &operands)?[..] else { unreachable!() };
        let mut then = Region::default();
        linker.nested(|linker| {
            let (accepted, distance) = object.intersect(linker, ray, &mut then.ops)?;
            let item = object.load(linker, (ITEM, Scalar::I32, 1), 0, &mut then.ops)?;
            let hit = [nearest[0], nearest[1], any_hit, entry, accepted, distance, item];
            then.yields = linker.call_text("rt_nearerHit", &hit, &mut then.ops)?;
            Ok(())
        })?;
        let otherwise = Region { yields: nearest.to_vec(), ..Region::default() };
        let kind = OpKind::If { condition: meets, then, otherwise };
        let results = linker.emit(to, kind, &NEAREST, false)?;
        Ok([results.get(0), results.get(1)])
    }

    /// Returns the answers to a search of the nearest hit, and the group and the index of its surface, with the scratch
    /// arrays.
    pub fn answers(
        self,
        linker: &mut StageLinker,
        nearest: Nearest,
        to: &mut Vec<Op>,
    ) -> Linking<Vec<(String, Value)>> {
        let (kind, scalar, len) = (VariableKind::Member, Scalar::I32, self.links.items);
        let table = |name: &str| Variable { kind, name: name.to_owned(), scalar, len };
        let tables = [ITEM_OBJECTS, ITEM_ELEMENTS, ITEM_GROUPS, ITEM_SURFACES].map(table);
        let found = linker.call_text_with("rt_foundHit", &nearest, &tables, to)?;
        let names = (0..5).map(|index| Port::Answer(index).name());
        let names = names.chain([GROUP_COLUMN, SURFACE_COLUMN].map(str::to_owned));
        Ok(names.zip(found).collect())
    }
}

impl Tested<'_> {
    /// Copies `intersect`; returns whether it accepts a hit, and the distance.
    fn intersect(
        self,
        linker: &mut StageLinker,
        ray: &Ray,
        to: &mut Vec<Op>,
    ) -> Linking<(Value, Value)> {
        let Tested { class, element } = self;
        let function = &*class.intersect.function;
        // The scratch of a call is zero when it begins, and no one reads it afterwards.
        let scratch = linker.scratch.replace(Vec::new());
        let mut site = Site::new(None, function, class.prefix.clone(), &mut linker.out);
        site.overrides.clone_from(&ray.state);
        // Several objects are tested in a loop.
        let was_in_loop = linker.in_loop;
        linker.in_loop |= element.is_some();
        linker.begin_copy(&mut site, to)?;
        linker.element = element;
        let copied = linker.copy_ops(&mut site, &function.body.ops, to);
        (linker.element, linker.in_loop) = (None, was_in_loop);
        copied?;
        let is_accepted =
            |output: &Output| function.variable(output.variable).kind == VariableKind::Accepted;
        let accepted = function.outputs.iter().position(is_accepted);
        let accepted = match accepted {
            Some(index) => site.value(function.body.yields[index]),
            None => linker.constant(to, Constant::Bool(false))?,
        };
        let set = linker.note_outputs(&site);
        linker.scratch = scratch;
        let distance = StateComponent::named("rt_HitDistance", 0);
        let distance = distance.and_then(|distance| find_override(&set, distance));
        Ok((accepted, distance.unwrap_or(ray.scalars[LIMIT])))
    }

    /// Loads a scalar of one of the members of the class that have this name, type and length.
    fn load(
        self,
        linker: &mut StageLinker,
        (name, scalar, len): (&str, Scalar, u32),
        index: u32,
        to: &mut Vec<Op>,
    ) -> Linking<Value> {
        let (kind, name) = (VariableKind::Member, format!("{}{name}", self.class.prefix));
        let member = Variable { kind, name, scalar, len };
        if let Some(element) = self.element {
            return linker.load_of_element(element, &member, Index::Constant(index), to);
        }
        let member = linker.intern_variable(member);
        linker.load(member, Index::Constant(index), to)
    }
}

impl Arithmetic<'_> {
    /// Returns whether anything was hit.
    pub fn is_found(&mut self, nearest: Nearest) -> Linking<Value> {
        Ok(self.call("rt_isFound", &nearest)?[0])
    }

    /// Returns the number of searches of the path, the one that ends included, and the counts of its sequences after it,
    /// with the scratch arrays.
    pub fn counts(&mut self) -> Linking<Vec<(String, Value)>> {
        let (searches, one) = (self.column(SEARCHES_COLUMN, Scalar::U32)?, self.word(1)?);
        let searches = self.add(searches, one)?;
        let count = self.count_after(searches)?;
        let purposes = Purpose::ALL.map(|purpose| (purpose.column().to_owned(), count));
        Ok([(SEARCHES_COLUMN.to_owned(), searches)].into_iter().chain(purposes).collect())
    }
}

impl StageLinker {
    /// Stores a value to a scratch array when the function ends.
    pub(crate) fn set_column(&mut self, name: String, value: Value) {
        let (kind, scalar) = (VariableKind::Scratch, self.out.scalar(value));
        let variable = self.intern_variable(Variable { kind, name, scalar, len: 1 });
        self.out.outputs.push(Output { variable, component: 0 });
        self.out.body.yields.push(value);
    }

    /// Loads a scalar of an object's member; of several objects the members are in an array.
    pub(crate) fn load_of_element(
        &mut self,
        ArrayElement { index: element, count }: ArrayElement,
        member: &Variable,
        index: Index,
        to: &mut Vec<Op>,
    ) -> Linking<Value> {
        let len = member.len;
        let member = self.intern_variable(Variable { len: len * count, ..member.clone() });
        let code = &mut Arithmetic { linker: self, to };
        let index = match index {
            Index::Constant(index) => code.integer(index as i32)?,
            Index::Dynamic(index) => {
                let (first, last) = (code.integer(0)?, code.integer(len as i32 - 1)?);
                let index = code.binary(BinaryOp::Max, index, first)?;
                code.binary(BinaryOp::Min, index, last)?
            }
        };
        let len = code.integer(len as i32)?;
        let start = code.multiply(element, len)?;
        let index = Index::Dynamic(code.add(start, index)?);
        self.load(member, index, to)
    }
}
