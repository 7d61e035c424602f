//! The properties of a surface as operations: the methods of its shape, and the maps between the shape's space and the
//! world; and the density with which light samples find it.
//!
//! Renderers compute the same for surfaces whose classes they do not link, with the same bits.

use std::collections::BTreeMap;
use std::sync::Arc;

use rtsl_ir::{
    BinaryOp, CompareOp, Op, Query, SURFACE_SCALARS, Scalar, StateComponent, UnaryOp, Value,
};
use rtsl_math::{MIN_FOOTPRINT_COSINE, SURFACE_ERROR, TRANSFORM_ERROR};
use rtsl_opt::placed::PLACEMENT;
use rtsl_spec::{ATTRIBUTES, MAX_ATTRIBUTE_SCALARS, Method, Role, lookup_state};

use super::arithmetic::{Arithmetic, Map, Vector};
use super::light_selection::LightSelection;
use super::linked_method::{HitPlacement, LinkedMethod};
use super::linker::{Linker, Linking, Site, default_of, find_override};
use super::stage::{TIME_COLUMN, asks_host, first_of};

/// The map from the space of a shape to the world.
const FORWARD: &str = "rt_Forward";
/// The map of magnitudes, from the world to the space of the shape and back.
const SIZES: &str = "rt_Sizes";
/// The extents of the shape's box, in the world's directions, then -1 if its orientation is reversed, else 1.
const EXTENTS: &str = "rt_Extents";
/// The factor by which volumes are scaled from the space of the shape to the world.
const VOLUME: &str = "rt_Volume";
/// The [way](LightSelection::way) to the shape in the light hierarchy.
const LIGHT: &str = "rt_Light";

/// The methods of shapes that describe surfaces.
#[derive(Clone, Debug)]
pub(crate) struct ShapeLinks {
    /// The path to their members in linked stages: `shape.`.
    pub prefix: String,
    /// The methods that describe surfaces, and `intersect` if they read its scratch.
    pub methods: BTreeMap<Method, Arc<LinkedMethod>>,
    /// True if shapes have a space of their own.
    pub is_placed: bool,
    /// True if light samples may choose the surfaces, and shapes have densities.
    pub is_sampled: bool,
    /// `samplePDF`, if it needs nothing but the ray and the hit.
    pub density: Option<Arc<LinkedMethod>>,
}

/// The state that methods of shapes may read, of which the last two are texture coordinates.
const INPUTS: [&str; 11] = [
    "rt_RayOrigin",
    "rt_RayDirection",
    "rt_InverseRayDirection",
    "rt_HitDistance",
    "rt_HitPoint",
    "rt_Epsilon",
    "rt_TimeSeed",
    "rt_GeometricNormal",
    "rt_ShadingNormal",
    "rt_TextureUV",
    "rt_TextureUVW",
];

/// True if a method asks nothing of a host, and reads no state but this.
pub(super) fn needs_only(method: &LinkedMethod, inputs: &[&str]) -> bool {
    let mut is_plain = true;
    method.function.body.for_each_op(&mut |op| is_plain &= !asks_host(&op.kind));
    is_plain && method.reads.iter().all(|it| inputs.contains(&it.name))
}

impl ShapeLinks {
    /// True if the methods need nothing but the ray and the hit.
    pub fn is_complete(&self) -> bool {
        self.methods.values().all(|method| needs_only(method, &INPUTS))
    }

    /// Returns `samplePDF` if it can be linked: it is called before texture coordinates are known.
    pub fn linked_density(method: Arc<LinkedMethod>) -> Option<Arc<LinkedMethod>> {
        let inputs = &INPUTS[..INPUTS.len() - 2];
        (needs_only(&method, inputs) && !method.reads_scratch).then_some(method)
    }

    /// Returns the members besides those of the shapes, with their scalars, in the order of
    /// [`ShapeObject`](crate::ShapeObject)'s data.
    pub fn members(&self) -> Vec<(String, u32)> {
        let maps = [PLACEMENT, FORWARD, SIZES].map(|name| (name, 12));
        let maps = maps.into_iter().filter(|_| self.is_placed);
        let of_samples = [(VOLUME, 1), (LIGHT, 1)].into_iter().filter(|_| self.is_sampled);
        let members = maps.chain([(EXTENTS, 4)]).chain(of_samples);
        members.map(|(name, scalars)| (self.member(name), scalars)).collect()
    }

    fn member(&self, name: &str) -> String {
        format!("{}{name}", self.prefix)
    }

    /// Loads the maps between the shape's space and the world, if they differ.
    pub(super) fn maps(&self, code: &mut Arithmetic<'_>) -> Linking<Option<Maps>> {
        if !self.is_placed {
            return Ok(None);
        }
        let mut map = |name: &str| code.map(&self.member(name));
        Ok(Some(Maps { inverse: map(PLACEMENT)?, forward: map(FORWARD)?, sizes: map(SIZES)? }))
    }

    /// The Jacobian of directions under the map to the world, given the squared lengths of a vector in the world and in
    /// the shape's space: the stretch along them, cubed, over the map's determinant.
    pub(super) fn direction_scale(
        &self,
        code: &mut Arithmetic<'_>,
        square: Value,
        local_square: Value,
    ) -> Linking<Value> {
        let stretch = code.divide(square, local_square)?;
        let root = code.root(stretch)?;
        let scale = code.multiply(stretch, root)?;
        if !self.is_placed {
            return Ok(scale);
        }
        let volume = code.load_member(&self.member(VOLUME), Scalar::F32)?;
        code.divide(scale, volume)
    }

    /// Transforms a normal of the shape's space to the world's, with the orientation of the object. Its length is any.
    pub(super) fn normal(
        &self,
        code: &mut Arithmetic<'_>,
        maps: Option<&Maps>,
        normal: Vector,
    ) -> Linking<Vector> {
        let side = code.member(&self.member(EXTENTS), 4, 1)?[2];
        let normal = match maps {
            Some(maps) => code.transposed_vector(&maps.inverse, normal)?,
            None => normal,
        };
        code.scaled(normal, side)
    }

    /// The bound of the rounding error of a point of the shape along a unit normal, given the magnitudes of the terms
    /// from which the point is computed; 0 if they overflow.
    pub(super) fn rounding_error(
        &self,
        code: &mut Arithmetic<'_>,
        maps: Option<&Maps>,
        (normal, sizes): (Vector, Vector),
    ) -> Linking<Value> {
        let extents = code.member(&self.member(EXTENTS), 4, 0)?;
        let sizes = code.sum(sizes, extents)?;
        code.error_of_sizes(maps, (normal, sizes), SURFACE_ERROR)
    }

    /// The parts of hits that `computeNormal` sets.
    fn placement(&self) -> HitPlacement {
        let method = self.methods.get(&Method::ComputeNormal);
        method.map(|method| method.hit_placement).unwrap_or_default()
    }

    fn has(&self, method: Method) -> bool {
        self.methods.contains_key(&method)
    }
}

impl Arithmetic<'_> {
    /// The magnitudes of the terms from which a point on a ray is computed.
    fn sizes_on_ray(
        &mut self,
        origin: Vector,
        direction: Vector,
        distance: Value,
    ) -> Linking<Vector> {
        let (start, way) = (self.sizes(origin)?, self.scaled(direction, distance)?);
        let way = self.sizes(way)?;
        self.sum(start, way)
    }

    /// The sum of the components.
    fn total(&mut self, [x, y, z]: Vector) -> Linking<Value> {
        let sum = self.add(x, y)?;
        self.add(sum, z)
    }

    /// The bound of an error along a unit normal: a part of the magnitudes of the terms from which a point is computed,
    /// in the world and through the space of its shape; 0 if they overflow.
    fn error_of_sizes(
        &mut self,
        maps: Option<&Maps>,
        (normal, mut sizes): (Vector, Vector),
        error: f32,
    ) -> Linking<Value> {
        let code = self;
        if let Some(maps) = maps {
            let through = code.transformed_point(&maps.sizes, sizes)?;
            sizes = code.sum(sizes, through)?;
        }
        let normal = code.sizes(normal)?;
        let size = code.products(normal, sizes)?;
        let error = code.float(error)?;
        let error = code.multiply(size, error)?;
        code.finite_or_zero(error)
    }
}

/// The computation of a surface's properties.
struct SurfaceCode<'a> {
    shape: &'a ShapeLinks,
    /// The world's maps to and from the space of the shape, if it has one.
    maps: Option<Maps>,
    /// The state in the space of the shape; of several values of a component the last counts.
    state: Vec<(StateComponent, Value)>,
    /// The point on the ray, in the space of the shape.
    hit_point: Vector,
}

/// Maps of a placed shape.
pub(super) struct Maps {
    /// From the world to its space.
    pub inverse: Map,
    /// From its space to the world.
    pub forward: Map,
    /// Of magnitudes, from the world to its space and back.
    pub sizes: Map,
}

/// A ray with its hit.
#[derive(Clone, Copy)]
struct Hit {
    origin: Vector,
    direction: Vector,
    distance: Value,
}

impl Linker {
    /// Computes the results of [`Query::SurfaceProperties`] for a surface with these operands.
    pub(super) fn surface_properties(
        &mut self,
        caller: &Site<'_>,
        shape: &ShapeLinks,
        operands: &[Value],
        to: &mut Vec<Op>,
    ) -> Linking<Vec<Value>> {
        let operand = |name| operands[first_of(Query::SurfaceProperties.operands(), name)];
        let hit = Hit::of(operands);
        let code = &mut Arithmetic { linker: &mut *self, to: &mut *to };
        let mut surface = SurfaceCode::begin(code, shape, hit, operand("epsilon"))?;
        let scratch = self.scratch.replace(Vec::new());
        let called = surface.call_methods(self, caller, (hit, operand("limit")), to);
        self.scratch = scratch;
        called?;
        let code = &mut Arithmetic { linker: self, to };
        surface.finish(code, hit, (operand("width"), operand("spread")))
    }

    /// Computes the result of [`Query::LightPdf`] for a surface with these operands; `None` if the host does.
    pub(super) fn light_density(
        &mut self,
        caller: &Site<'_>,
        (shape, selection): (&ShapeLinks, &LightSelection),
        operands: &[Value],
        to: &mut Vec<Op>,
    ) -> Linking<Option<Vec<Value>>> {
        let Some(method) = &shape.density else { return Ok(None) };
        let operand = |name| operands[first_of(Query::LightPdf.operands(), name)];
        let point = [0, 1, 2].map(|axis| operands[SURFACE_SCALARS + axis]);
        let code = &mut Arithmetic { linker: &mut *self, to: &mut *to };
        let hit = Hit::of(operands).seen_from(code, point)?;
        let mut surface = SurfaceCode::begin(code, shape, hit, operand("epsilon"))?;
        let scratch = self.scratch.replace(Vec::new());
        let called = surface
            .find_normals(self, caller, (hit, operand("limit")), to)
            .and_then(|()| surface.call(self, caller, method, to));
        self.scratch = scratch;
        called?;
        let code = &mut Arithmetic { linker: &mut *self, to: &mut *to };
        let density = surface.density(code, hit)?;
        let way = code.load_member(&shape.member(LIGHT), Scalar::U32)?;
        let probability = self.probability_at(selection, way, point, to)?;
        let code = &mut Arithmetic { linker: self, to };
        Ok(Some(vec![code.multiply(density, probability)?]))
    }
}

impl Hit {
    /// Returns the hit that operands of queries about surfaces identify.
    fn of(operands: &[Value]) -> Hit {
        let first = |name| first_of(Query::SurfaceProperties.operands(), name);
        let vector = |name| [0, 1, 2].map(|axis| operands[first(name) + axis]);
        Hit {
            origin: vector("origin"),
            direction: vector("direction"),
            distance: operands[first("distance")],
        }
    }

    /// Returns the hit of the ray from a point that ends at the same place: the same, if its ray begins there.
    fn seen_from(self, code: &mut Arithmetic<'_>, point: Vector) -> Linking<Hit> {
        let mut is_same = None;
        for (one, other) in point.into_iter().zip(self.origin) {
            let [one, other] = [code.bitcast(Scalar::U32, one)?, code.bitcast(Scalar::U32, other)?];
            let is_equal = code.compare(CompareOp::Equal, one, other)?;
            is_same = Some(match is_same {
                Some(is_same) => code.and(is_same, is_equal)?,
                None => is_equal,
            });
        }
        let is_same = is_same.expect("vectors have components");
        let end = code.point_on_ray(self.origin, self.direction, self.distance)?;
        let way = code.difference(end, point)?;
        let one = code.float(1.0)?;
        Ok(Hit {
            origin: code.select_vector(is_same, self.origin, point)?,
            direction: code.select_vector(is_same, self.direction, way)?,
            distance: code.select(is_same, self.distance, one)?,
        })
    }
}

impl<'a> SurfaceCode<'a> {
    /// Returns the inputs of methods, and the results of those that the class lacks.
    fn begin(
        code: &mut Arithmetic<'_>,
        shape: &'a ShapeLinks,
        hit: Hit,
        epsilon: Value,
    ) -> Linking<SurfaceCode<'a>> {
        let mut local = hit;
        let maps = shape.maps(code)?;
        if let Some(Maps { inverse, .. }) = &maps {
            local.origin = code.transformed_point(inverse, hit.origin)?;
            local.direction = code.transformed_vector(inverse, hit.direction)?;
        }
        let point = code.point_on_ray(local.origin, local.direction, local.distance)?;
        let facing = code.each(|it, axis| it.unary(UnaryOp::Negate, local.direction[axis]))?;
        let one = code.float(1.0)?;
        let inverse = code.each(|it, axis| it.divide(one, local.direction[axis]))?;
        let zero = code.float(0.0)?;
        let time = code.column(TIME_COLUMN, Scalar::F32)?;
        let mut surface = SurfaceCode { shape, maps, state: Vec::new(), hit_point: point };
        for (name, values) in [
            ("rt_RayOrigin", &local.origin[..]),
            ("rt_RayDirection", &local.direction),
            ("rt_InverseRayDirection", &inverse),
            ("rt_HitDistance", &[local.distance]),
            ("rt_Epsilon", &[epsilon]),
            ("rt_TimeSeed", &[time]),
            ("rt_HitPoint", &point),
            ("rt_GeometricNormal", &facing),
            ("rt_ShadingNormal", &facing),
            ("rt_SurfaceOffset", &[zero]),
            ("rt_TextureUV", &[zero, zero]),
            ("rt_TextureUVW", &point),
            ("rt_dsdu", &[one]),
            ("rt_dsdv", &[zero]),
            ("rt_dtdu", &[zero]),
            ("rt_dtdv", &[one]),
        ] {
            surface.set(name, values);
        }
        Ok(surface)
    }

    fn set(&mut self, name: &str, values: &[Value]) {
        let Some(variable) = lookup_state(name) else { return };
        let components = (0..).zip(values);
        self.state.extend(components.map(|(component, value)| {
            (StateComponent { variable: variable.index, component }, *value)
        }));
    }

    fn get(&self, name: &str, component: u32) -> Option<Value> {
        let variable = lookup_state(name)?.index;
        find_override(&self.state, StateComponent { variable, component })
    }

    /// Returns a vector that has been set.
    fn vector(&self, name: &str) -> Vector {
        [0, 1, 2].map(|axis| self.get(name, axis).expect("it has a default"))
    }

    fn call_methods(
        &mut self,
        linker: &mut Linker,
        caller: &Site<'_>,
        (hit, limit): (Hit, Value),
        to: &mut Vec<Op>,
    ) -> Linking<()> {
        self.find_normals(linker, caller, (hit, limit), to)?;
        self.call_linked(linker, caller, Method::ComputeTextureCoordinates, to)?;
        self.call_linked(linker, caller, Method::ComputeDerivatives, to)
    }

    /// Computes scratch and normals, which are normalised if further methods may read them.
    fn find_normals(
        &mut self,
        linker: &mut Linker,
        caller: &Site<'_>,
        (hit, limit): (Hit, Value),
        to: &mut Vec<Op>,
    ) -> Linking<()> {
        let shape = self.shape;
        if shape.has(Method::Intersect) {
            // The search had the limit; the ray is placed by the method.
            let state = self.state.clone();
            self.set("rt_HitDistance", &[limit]);
            if shape.is_placed {
                self.set("rt_RayOrigin", &hit.origin);
                self.set("rt_RayDirection", &hit.direction);
            }
            self.call_linked(linker, caller, Method::Intersect, to)?;
            self.state = state;
        }
        self.call_linked(linker, caller, Method::ComputeNormal, to)?;
        if shape.placement().moves {
            let point = self.vector("rt_HitPoint");
            self.set("rt_TextureUVW", &point);
        }
        let reads_normals = shape.is_sampled
            || shape.has(Method::ComputeTextureCoordinates)
            || shape.has(Method::ComputeDerivatives);
        if reads_normals {
            let code = &mut Arithmetic { linker: &mut *linker, to: &mut *to };
            let up = code.vector([0.0, 0.0, 1.0])?;
            let geometric = code.normalized_or(self.vector("rt_GeometricNormal"), up)?;
            let shading = code.normalized_or(self.vector("rt_ShadingNormal"), geometric)?;
            self.set("rt_GeometricNormal", &geometric);
            self.set("rt_ShadingNormal", &shading);
        }
        Ok(())
    }

    /// Calls a method if the class has it.
    fn call_linked(
        &mut self,
        linker: &mut Linker,
        caller: &Site<'_>,
        method: Method,
        to: &mut Vec<Op>,
    ) -> Linking<()> {
        match self.shape.methods.get(&method) {
            Some(method) => self.call(linker, caller, method, to),
            None => Ok(()),
        }
    }

    /// Copies a method's body, and notes the state that it sets.
    fn call(
        &mut self,
        linker: &mut Linker,
        caller: &Site<'_>,
        method: &LinkedMethod,
        to: &mut Vec<Op>,
    ) -> Linking<()> {
        let set = linker.copy_method(caller, &self.shape.prefix, method, self.state.clone(), to)?;
        self.state.extend(set);
        Ok(())
    }

    /// Returns the properties in the world, in the order of the query's results.
    fn finish(
        &mut self,
        code: &mut Arithmetic<'_>,
        hit: Hit,
        (width, spread): (Value, Value),
    ) -> Linking<Vec<Value>> {
        let normals = ["rt_GeometricNormal", "rt_ShadingNormal"].map(|name| self.vector(name));
        let [geometric, shading] = self.normals(code, normals)?;
        let (point, sizes) = self.point(code, hit)?;
        let offset = self.offset(code, sizes, geometric, normals[0])?;
        let [dpdu, dpdv] = self.tangents(code, geometric)?;
        let widths = footprints(code, hit, geometric, [dpdu, dpdv], (width, spread))?;
        let scalar = |name: &str, component: u32| self.get(name, component);
        let mut properties: Vec<Value> = [point, geometric, shading].concat();
        properties.extend((0..2).filter_map(|it| scalar("rt_TextureUV", it)));
        properties.extend((0..3).filter_map(|it| scalar("rt_TextureUVW", it)));
        properties.extend(dpdu.into_iter().chain(dpdv).chain(widths).chain([offset]));
        let of_textures = ["rt_dsdu", "rt_dsdv", "rt_dtdu", "rt_dtdv"];
        properties.extend(of_textures.iter().filter_map(|name| scalar(name, 0)));
        let zero = code.float(0.0)?;
        properties
            .extend((0..MAX_ATTRIBUTE_SCALARS).map(|it| scalar(ATTRIBUTES, it).unwrap_or(zero)));
        for map in self.to_object_and_world(code)? {
            properties.extend(map.into_iter().flatten());
        }
        Ok(properties)
    }

    /// The maps of points from the world to the object's space, and back.
    fn to_object_and_world(&self, code: &mut Arithmetic<'_>) -> Linking<[Map; 2]> {
        match &self.maps {
            Some(Maps { inverse, forward, .. }) => Ok([*inverse, *forward]),
            None => {
                let identity = code.identity()?;
                Ok([identity; 2])
            }
        }
    }

    /// Transforms normals of the shape's space to the world's, with the orientation of the object.
    fn normals(&self, code: &mut Arithmetic<'_>, normals: [Vector; 2]) -> Linking<[Vector; 2]> {
        let mut in_world = [normals[0]; 2];
        for (to, normal) in in_world.iter_mut().zip(normals) {
            *to = self.shape.normal(code, self.maps.as_ref(), normal)?;
        }
        let up = code.vector([0.0, 0.0, 1.0])?;
        let geometric = code.normalized_or(in_world[0], up)?;
        let shading = code.normalized_or(in_world[1], geometric)?;
        Ok([geometric, shading])
    }

    /// The point, and the sizes of the terms that it is computed from. The hit of a shape that puts hits back is where
    /// the shape says, but on the ray if that is as precise in the shape's space and the shape has left it there.
    fn point(&self, code: &mut Arithmetic<'_>, hit: Hit) -> Linking<(Vector, Vector)> {
        let on_ray = code.point_on_ray(hit.origin, hit.direction, hit.distance)?;
        let of_ray = code.sizes_on_ray(hit.origin, hit.direction, hit.distance)?;
        if !self.shape.placement().moves {
            return Ok((on_ray, of_ray));
        }
        let found = self.vector("rt_HitPoint");
        let [x, y, z] =
            code.each(|it, axis| it.compare(CompareOp::Equal, self.hit_point[axis], found[axis]))?;
        let stays = code.and(x, y)?;
        let stays = code.and(stays, z)?;
        let [origin, direction] = ["rt_RayOrigin", "rt_RayDirection"].map(|it| self.vector(it));
        let of_local_ray = code.sizes_on_ray(origin, direction, hit.distance)?;
        let of_local_ray = code.total(of_local_ray)?;
        let size = code.sizes(found)?;
        let size = code.total(size)?;
        let twice = code.add(size, size)?;
        let is_near = code.compare(CompareOp::LessEqual, of_local_ray, twice)?;
        let stays = code.and(stays, is_near)?;
        let moved = match &self.maps {
            Some(maps) => code.transformed_point(&maps.forward, found)?,
            None => found,
        };
        let of_moved = code.sizes(moved)?;
        let point = code.select_vector(stays, on_ray, moved)?;
        Ok((point, code.select_vector(stays, of_ray, of_moved)?))
    }

    /// The offset at which rays that leave the surface begin, which bounds the error of the point.
    fn offset(
        &self,
        code: &mut Arithmetic<'_>,
        sizes: Vector,
        normal: Vector,
        local_normal: Vector,
    ) -> Linking<Value> {
        let HitPlacement { is_bounded, .. } = self.shape.placement();
        let error = match is_bounded {
            true => code.error_of_sizes(self.maps.as_ref(), (normal, sizes), TRANSFORM_ERROR)?,
            false => self.shape.rounding_error(code, self.maps.as_ref(), (normal, sizes))?,
        };
        let sets = self.shape.methods.get(&Method::ComputeNormal);
        let sets = sets.is_some_and(|it| it.writes.iter().any(|it| it.name == "rt_SurfaceOffset"));
        let Some(own) = self.get("rt_SurfaceOffset", 0).filter(|_| sets) else { return Ok(error) };
        let own = self.offset_of_shape(code, own, local_normal)?;
        if is_bounded { code.add(own, error) } else { code.larger(own, error) }
    }

    /// The density per solid angle of the world that the shape has set; 0 if it is none.
    fn density(&self, code: &mut Arithmetic<'_>, hit: Hit) -> Linking<Value> {
        let own = self.get("rt_PDF", 0).map_or_else(|| code.float(0.0), Ok)?;
        let square = code.products(hit.direction, hit.direction)?;
        let local = self.vector("rt_RayDirection");
        let local_square = code.products(local, local)?;
        let scale = self.shape.direction_scale(code, square, local_square)?;
        let density = code.multiply(own, scale)?;
        let (is_usable, zero) = (code.is_usable(density)?, code.float(0.0)?);
        code.select(is_usable, density, zero)
    }

    /// The offset that the shape has set, in the world.
    fn offset_of_shape(
        &self,
        code: &mut Arithmetic<'_>,
        local: Value,
        normal: Vector,
    ) -> Linking<Value> {
        let (zero, infinity) = (code.float(0.0)?, code.float(f32::INFINITY)?);
        let is_positive = code.compare(CompareOp::Greater, local, zero)?;
        let is_finite = code.less(local, infinity)?;
        let is_usable = code.and(is_positive, is_finite)?;
        let local = code.select(is_usable, local, zero)?;
        let none = [zero; 3];
        let normal = code.normalized_or(normal, none)?;
        let mut step = code.scaled(normal, local)?;
        if let Some(maps) = &self.maps {
            step = code.transformed_vector(&maps.forward, step)?;
        }
        let square = code.products(step, step)?;
        let length = code.root(square)?;
        code.finite_or_zero(length)
    }

    /// The derivatives of the point: those of the shape, or an arbitrary frame of the normal.
    fn tangents(&self, code: &mut Arithmetic<'_>, normal: Vector) -> Linking<[Vector; 2]> {
        if !self.shape.has(Method::ComputeDerivatives) {
            return frame(code, normal);
        }
        let mut tangents = [normal; 2];
        for (tangent, name) in tangents.iter_mut().zip(["rt_dPdu", "rt_dPdv"]) {
            let local = code.each(|it, axis| {
                let variable = lookup_state(name).map_or(0, |variable| variable.index);
                let wanted = StateComponent { variable, component: axis as u32 };
                match self.get(name, axis as u32) {
                    Some(value) => Ok(value),
                    None => it.linker.constant(it.to, default_of(Role::Primitive, wanted)),
                }
            })?;
            *tangent = match &self.maps {
                Some(maps) => code.transformed_vector(&maps.forward, local)?,
                None => local,
            };
        }
        Ok(tangents)
    }
}

/// An arbitrary frame of a normal.
fn frame(code: &mut Arithmetic<'_>, normal: Vector) -> Linking<[Vector; 2]> {
    let [x, y, z] = code.sizes(normal)?;
    let x_to_y = code.compare(CompareOp::LessEqual, x, y)?;
    let x_to_z = code.compare(CompareOp::LessEqual, x, z)?;
    let is_x = code.and(x_to_y, x_to_z)?;
    let is_y = code.compare(CompareOp::LessEqual, y, z)?;
    let axes = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    let [first, second, third] =
        [code.vector(axes[0])?, code.vector(axes[1])?, code.vector(axes[2])?];
    let least = code.select_vector(is_y, second, third)?;
    let least = code.select_vector(is_x, first, least)?;
    let cosine = code.products(normal, least)?;
    let along = code.scaled(normal, cosine)?;
    let across = code.each(|it, axis| it.binary(BinaryOp::Subtract, least[axis], along[axis]))?;
    let first = code.normalized_or(across, first)?;
    let second = code.each(|it, axis| {
        let (next, last) = ((axis + 1) % 3, (axis + 2) % 3);
        let one = it.multiply(normal[next], first[last])?;
        let other = it.multiply(normal[last], first[next])?;
        it.binary(BinaryOp::Subtract, one, other)
    })?;
    Ok([first, second])
}

/// The widths of the ray's footprint in surface parameters.
fn footprints(
    code: &mut Arithmetic<'_>,
    hit: Hit,
    normal: Vector,
    tangents: [Vector; 2],
    (width, spread): (Value, Value),
) -> Linking<[Value; 2]> {
    let growth = code.multiply(spread, hit.distance)?;
    let width = code.add(width, growth)?;
    let cosine = code.products(hit.direction, normal)?;
    let cosine = code.unary(UnaryOp::Abs, cosine)?;
    let square = code.products(hit.direction, hit.direction)?;
    let length = code.root(square)?;
    let (slant, least) = (code.divide(cosine, length)?, code.float(MIN_FOOTPRINT_COSINE)?);
    let slant = code.larger(slant, least)?;
    let slant = code.root(slant)?;
    let width = code.divide(width, slant)?;
    let mut widths = [width; 2];
    for (to, tangent) in widths.iter_mut().zip(tangents) {
        let square = code.products(tangent, tangent)?;
        let length = code.root(square)?;
        let parameter = code.divide(width, length)?;
        *to = code.finite_or_zero(parameter)?;
    }
    Ok(widths)
}
