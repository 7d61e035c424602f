//! Searches as operations: each ray is tested against every object of a scene that has few.
//!
//! A hit lies on the object, between the limits of the ray, and not before the ray enters the object's own box. Of
//! several hits the nearest counts, and of equally near ones that of the lowest item. These are the hits that searches
//! of hierarchies find, to the bit: boxes are tested with the same operations, and `intersect` gets the ray's own
//! limit.

use std::sync::Arc;

use rtsl_ir::{
    BinaryOp, CompareOp, Constant, Index, Op, OpKind, Output, Region, Scalar, StateComponent,
    UnaryOp, Value, Variable, VariableId, VariableKind,
};
use rtsl_link::{Linked, LinkedMethod, Linker, Linking, Site, find_override};
use rtsl_stages::{Port, ResumedBy};

use crate::arithmetic::{Arithmetic, Vector};
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

/// The item of rays that have not hit anything.
const NO_ITEM: i32 = i32::MAX;
/// The object and the instance in the answer to a search that has not found anything.
const NONE: i32 = -1;

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
    let mut linker = StageLinker::new(name.to_owned());
    let mut ops = Vec::new();
    let mut code = SearchCode { linker: &mut linker, links, search };
    let operands = code.requested(&mut ops)?;
    let nearest = code.find(operands, &mut ops)?;
    let outputs = match search {
        Search::Any => vec![(Port::Answer(0).name(), code.is_found(nearest, &mut ops)?)],
        Search::Nearest => {
            let mut outputs = code.answers(nearest, &mut ops)?;
            outputs.extend(code.counts(&mut ops)?);
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

/// The operands of a search.
#[derive(Clone, Copy)]
pub(crate) struct SearchOperands {
    pub origin: Vector,
    pub direction: Vector,
    /// The least distance of hits, if it is greater than 0; else, or if there is none, that of the scene counts.
    pub epsilon: Option<Value>,
    pub limit: Value,
}

impl SearchOperands {
    /// Returns the operands of a request in their order: the origin, the direction, of searches of the nearest hit the
    /// epsilon, and the limit. `None` for other numbers of operands.
    pub fn of(operands: &[Value]) -> Option<SearchOperands> {
        let (epsilon, limit) = match operands.get(6..)? {
            [limit] => (None, *limit),
            [epsilon, limit] => (Some(*epsilon), *limit),
            _ => return None,
        };
        let [ox, oy, oz, dx, dy, dz] = *operands.first_chunk()?;
        Some(SearchOperands { origin: [ox, oy, oz], direction: [dx, dy, dz], epsilon, limit })
    }
}

/// A ray.
struct Ray {
    origin: Vector,
    epsilon: Value,
    limit: Value,
    /// The reciprocals of the direction, clamped to finite values.
    finite_inverse: Vector,
    is_finite: Value,
    /// The state that `intersect` reads.
    state: Vec<(StateComponent, Value)>,
}

/// The nearest hit so far.
#[derive(Clone, Copy)]
pub(crate) struct Nearest {
    distance: Value,
    item: Value,
}

/// The operations of a search, which are added to a function.
pub(crate) struct SearchCode<'a, 'l> {
    pub linker: &'l mut StageLinker,
    pub links: &'a SearchLinks,
    pub search: Search,
}

impl SearchCode<'_, '_> {
    fn code<'s>(&'s mut self, to: &'s mut Vec<Op>) -> Arithmetic<'s> {
        Arithmetic { linker: self.linker, to }
    }

    /// Searches along a ray.
    pub fn find(&mut self, operands: SearchOperands, to: &mut Vec<Op>) -> Linking<Nearest> {
        let ray = self.ray(operands, to)?;
        let item = self.linker.constant(to, Constant::I32(NO_ITEM))?;
        let mut nearest = Nearest { distance: ray.limit, item };
        for class in &self.links.classes {
            nearest = self.test_class(class, &ray, nearest, to)?;
        }
        Ok(nearest)
    }

    /// Loads the operands that a path requests.
    fn requested(&mut self, to: &mut Vec<Op>) -> Linking<SearchOperands> {
        let ports = self.search.event().request();
        let code = &mut self.code(to);
        let columns =
            ports.iter().map(|port| code.column(&Port::Request(*port).name(), Scalar::F32));
        let operands = columns.collect::<Linking<Vec<Value>>>()?;
        Ok(SearchOperands::of(&operands).expect("a search has these operands"))
    }

    fn ray(&mut self, operands: SearchOperands, to: &mut Vec<Op>) -> Linking<Ray> {
        let SearchOperands { origin, direction, epsilon, limit } = operands;
        let code = &mut self.code(to);
        let usual = code.load_member(EPSILON, Scalar::F32)?;
        let epsilon = match epsilon {
            Some(own) => {
                let zero = code.float(0.0)?;
                let is_own = code.compare(CompareOp::Greater, own, zero)?;
                code.select(is_own, own, usual)?
            }
            None => usual,
        };
        let time = code.column(TIME_COLUMN, Scalar::F32)?;
        let one = code.float(1.0)?;
        let inverse = code.each(|it, axis| it.divide(one, direction[axis]))?;
        let mut state = Vec::new();
        for (name, values) in [
            ("rt_RayOrigin", &origin[..]),
            ("rt_RayDirection", &direction),
            ("rt_InverseRayDirection", &inverse),
            ("rt_HitDistance", &[limit]),
            ("rt_Epsilon", &[epsilon]),
            ("rt_TimeSeed", &[time]),
        ] {
            let components = (0..).zip(values);
            state.extend(components.filter_map(|(component, value)| {
                Some((StateComponent::named(name, component)?, *value))
            }));
        }
        let finite_inverse = code.each(|it, axis| it.finite_reciprocal(direction[axis]))?;
        let is_finite = code.are_finite(&[origin, direction].concat())?;
        Ok(Ray { origin, epsilon, limit, finite_inverse, is_finite, state })
    }

    /// Tests the ray against all objects of a class.
    fn test_class(
        &mut self,
        class: &SearchedClassLink,
        ray: &Ray,
        nearest: Nearest,
        to: &mut Vec<Op>,
    ) -> Linking<Nearest> {
        if class.count == 1 {
            return self.test_object(class, None, ray, nearest, to);
        }
        let first = self.linker.constant(to, Constant::I32(0))?;
        let scalars = [Scalar::I32, Scalar::F32, Scalar::I32];
        let params = self.linker.out.new_values(&scalars);
        let [index, distance, item] = [0, 1, 2].map(|param| params.get(param));
        let mut body = Region { params: vec![index, distance, item], ..Region::default() };
        let known = Nearest { distance, item };
        let search = self.search;
        let links = self.links;
        self.linker.nested(|linker| {
            let mut code = SearchCode { linker, links, search };
            let element = ArrayElement { index, count: class.count };
            let nearest = code.test_object(class, Some(element), ray, known, &mut body.ops)?;
            let code = &mut code.code(&mut body.ops);
            let one = code.integer(1)?;
            let next = code.add(index, one)?;
            let end = code.integer(class.count as i32)?;
            let again = code.less(next, end)?;
            body.yields = vec![again, next, nearest.distance, nearest.item];
            Ok(())
        })?;
        let initial = vec![first, nearest.distance, nearest.item];
        let results = self.linker.emit(to, OpKind::Loop { initial, body }, &scalars, false)?;
        Ok(Nearest { distance: results.get(1), item: results.get(2) })
    }

    /// Tests the ray against an object.
    fn test_object(
        &mut self,
        class: &SearchedClassLink,
        element: Option<ArrayElement>,
        ray: &Ray,
        nearest: Nearest,
        to: &mut Vec<Op>,
    ) -> Linking<Nearest> {
        let (entry, meets) = self.test_box(class, element, ray, nearest, to)?;
        let mut then = Region::default();
        let search = self.search;
        let links = self.links;
        self.linker.nested(|linker| {
            let mut code = SearchCode { linker, links, search };
            let nearest = code.hit(class, element, ray, entry, nearest, &mut then.ops)?;
            then.yields = vec![nearest.distance, nearest.item];
            Ok(())
        })?;
        let yields = vec![nearest.distance, nearest.item];
        let otherwise = Region { yields, ..Region::default() };
        let kind = OpKind::If { condition: meets, then, otherwise };
        let results = self.linker.emit(to, kind, &[Scalar::F32, Scalar::I32], false)?;
        Ok(Nearest { distance: results.get(0), item: results.get(1) })
    }

    /// Returns the distance at which the ray enters the object's own box, no less than its epsilon, and whether a hit
    /// in the box can be the nearest.
    fn test_box(
        &mut self,
        class: &SearchedClassLink,
        element: Option<ArrayElement>,
        ray: &Ray,
        nearest: Nearest,
        to: &mut Vec<Op>,
    ) -> Linking<(Value, Value)> {
        let (slack, search) = (self.links.slack, self.search);
        let (kind, name) = (VariableKind::Member, format!("{}{BOX}", class.prefix));
        let member = Variable { kind, name, scalar: Scalar::F32, len: BOX_SCALARS };
        let mut planes = Vec::new();
        for plane in 0..BOX_SCALARS {
            planes.push(self.load_of(element, &member, plane, to)?);
        }
        let code = &mut self.code(to);
        let mut ends = [[None; 2]; 3];
        for (axis, ends) in ends.iter_mut().enumerate() {
            let mut distances = [None; 2];
            for (to, plane) in distances.iter_mut().zip([planes[axis], planes[3 + axis]]) {
                let way = code.binary(BinaryOp::Subtract, plane, ray.origin[axis])?;
                *to = Some(code.multiply(way, ray.finite_inverse[axis])?);
            }
            let [first, second] = distances.map(|it| it.expect("it is computed"));
            *ends = [
                Some(code.binary(BinaryOp::Min, first, second)?),
                Some(code.binary(BinaryOp::Max, first, second)?),
            ];
        }
        let [x, y, z] = ends.map(|ends| ends.map(|it| it.expect("it is computed")));
        let near = code.binary(BinaryOp::Max, x[0], y[0])?;
        let near = code.binary(BinaryOp::Max, near, z[0])?;
        let far = code.binary(BinaryOp::Min, x[1], y[1])?;
        let far = code.binary(BinaryOp::Min, far, z[1])?;
        let (less, more) = (code.float(1.0 - slack)?, code.float(1.0 + slack)?);
        let (entry, exit) = (code.multiply(near, less)?, code.multiply(far, more)?);
        let entry = code.binary(BinaryOp::Max, entry, ray.epsilon)?;
        let end = code.binary(BinaryOp::Min, exit, nearest.distance)?;
        let meets = code.compare(CompareOp::LessEqual, entry, end)?;
        let mut meets = code.and(meets, ray.is_finite)?;
        if search == Search::Any {
            let none = code.integer(NO_ITEM)?;
            let is_open = code.compare(CompareOp::Equal, nearest.item, none)?;
            meets = code.and(meets, is_open)?;
        }
        Ok((entry, meets))
    }

    /// Returns the nearest hit, that of the object included.
    fn hit(
        &mut self,
        class: &SearchedClassLink,
        element: Option<ArrayElement>,
        ray: &Ray,
        entry: Value,
        nearest: Nearest,
        to: &mut Vec<Op>,
    ) -> Linking<Nearest> {
        let (accepted, distance) = self.intersect(class, element, ray, to)?;
        let (kind, name) = (VariableKind::Member, format!("{}{ITEM}", class.prefix));
        let member = Variable { kind, name, scalar: Scalar::I32, len: 1 };
        let item = self.load_of(element, &member, 0, to)?;
        let search = self.search;
        let code = &mut self.code(to);
        let is_inside = code.compare(CompareOp::LessEqual, entry, distance)?;
        let is_hit = code.and(accepted, is_inside)?;
        if search == Search::Any {
            let item = code.select(is_hit, item, nearest.item)?;
            return Ok(Nearest { item, ..nearest });
        }
        let is_less = code.less(distance, nearest.distance)?;
        let is_equal = code.compare(CompareOp::Equal, distance, nearest.distance)?;
        let is_lower = code.less(item, nearest.item)?;
        let is_first = code.and(is_equal, is_lower)?;
        let is_nearer = code.binary(BinaryOp::Or, is_less, is_first)?;
        let is_nearer = code.and(is_hit, is_nearer)?;
        Ok(Nearest {
            distance: code.select(is_nearer, distance, nearest.distance)?,
            item: code.select(is_nearer, item, nearest.item)?,
        })
    }

    /// Copies `intersect`; returns whether it accepts a hit, and the distance.
    fn intersect(
        &mut self,
        class: &SearchedClassLink,
        element: Option<ArrayElement>,
        ray: &Ray,
        to: &mut Vec<Op>,
    ) -> Linking<(Value, Value)> {
        let function = &*class.intersect.function;
        let linker = &mut *self.linker;
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
        Ok((accepted, distance.unwrap_or(ray.limit)))
    }

    /// Loads a scalar of a member of an object of a class.
    fn load_of(
        &mut self,
        element: Option<ArrayElement>,
        member: &Variable,
        index: u32,
        to: &mut Vec<Op>,
    ) -> Linking<Value> {
        if let Some(element) = element {
            return self.linker.load_of_element(element, member, Index::Constant(index), to);
        }
        let member = self.linker.intern_variable(member.clone());
        self.linker.load(member, Index::Constant(index), to)
    }

    /// Returns whether anything was hit.
    pub fn is_found(&mut self, nearest: Nearest, to: &mut Vec<Op>) -> Linking<Value> {
        let code = &mut self.code(to);
        let no_item = code.integer(NO_ITEM)?;
        code.compare(CompareOp::NotEqual, nearest.item, no_item)
    }

    /// Returns the answers to a search of the nearest hit, and the group and the index of its surface, with the scratch
    /// arrays.
    pub fn answers(&mut self, nearest: Nearest, to: &mut Vec<Op>) -> Linking<Vec<(String, Value)>> {
        let is_found = self.is_found(nearest, to)?;
        let items = self.links.items;
        let code = &mut self.code(to);
        let mut of_item = |name: &str| {
            let (kind, name) = (VariableKind::Member, name.to_owned());
            let member = Variable { kind, name, scalar: Scalar::I32, len: items };
            let member: VariableId = code.linker.intern_variable(member);
            let kind = OpKind::Load(member, Index::Dynamic(nearest.item));
            Ok(code.linker.emit(code.to, kind, &[Scalar::I32], false)?.get(0))
        };
        let [object, element] = [of_item(ITEM_OBJECTS)?, of_item(ITEM_ELEMENTS)?];
        let [group, surface] = [of_item(ITEM_GROUPS)?, of_item(ITEM_SURFACES)?];
        let (none, zero, nowhere) = (code.integer(NONE)?, code.integer(0)?, code.float(0.0)?);
        let answers = [
            is_found,
            code.select(is_found, object, none)?,
            none,
            code.select(is_found, element, zero)?,
            code.select(is_found, nearest.distance, nowhere)?,
        ];
        let mut known: Vec<(String, Value)> =
            (0..).map(|index| Port::Answer(index).name()).zip(answers).collect();
        for (column, number) in [(GROUP_COLUMN, group), (SURFACE_COLUMN, surface)] {
            known.push((column.to_owned(), code.select(is_found, number, zero)?));
        }
        Ok(known)
    }

    /// Returns the number of searches of the path, this one included, and the counts of its sequences after it, with the
    /// scratch arrays.
    pub fn counts(&mut self, to: &mut Vec<Op>) -> Linking<Vec<(String, Value)>> {
        let code = &mut self.code(to);
        let (searches, one) = (code.column(SEARCHES_COLUMN, Scalar::U32)?, code.word(1)?);
        let searches = code.add(searches, one)?;
        let count = code.count_after(searches)?;
        let purposes = Purpose::ALL.map(|purpose| (purpose.column().to_owned(), count));
        Ok([(SEARCHES_COLUMN.to_owned(), searches)].into_iter().chain(purposes).collect())
    }
}

impl Arithmetic<'_> {
    pub fn integer(&mut self, value: i32) -> Linking<Value> {
        self.linker.constant(self.to, Constant::I32(value))
    }

    /// The reciprocal of a direction's component, clamped to finite values.
    fn finite_reciprocal(&mut self, component: Value) -> Linking<Value> {
        let size = self.unary(UnaryOp::Abs, component)?;
        let (one, most) = (self.float(1.0)?, self.float(f32::MAX)?);
        let inverse = self.divide(one, size)?;
        let held = self.binary(BinaryOp::Min, inverse, most)?;
        let held = self.bitcast(Scalar::U32, held)?;
        let (sign, bits) = (self.word(1 << 31)?, self.bitcast(Scalar::U32, component)?);
        let sign = self.and(bits, sign)?;
        let signed = self.binary(BinaryOp::Or, held, sign)?;
        self.bitcast(Scalar::F32, signed)
    }

    /// True if no number is infinite or NaN.
    fn are_finite(&mut self, numbers: &[Value]) -> Linking<Value> {
        let infinity = self.float(f32::INFINITY)?;
        let mut are_finite = self.linker.constant(self.to, Constant::Bool(true))?;
        for number in numbers {
            let size = self.unary(UnaryOp::Abs, *number)?;
            let is_finite = self.less(size, infinity)?;
            are_finite = self.and(are_finite, is_finite)?;
        }
        Ok(are_finite)
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
