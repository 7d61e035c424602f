//! The properties of a surface, and the density with which light samples find it: the methods of its shape, between the
//! functions of `prelude/renderer/surface.rtsl`.

use std::collections::BTreeMap;
use std::sync::Arc;

use rtsl_ir::{Op, Query, SURFACE_SCALARS, Scalar, StateComponent, UnaryOp, Value};
use rtsl_link::{HitPlacement, LinkedMethod, Linker, Linking, default_of, find_override};
use rtsl_opt::placed::PLACEMENT;
use rtsl_spec::{ATTRIBUTES, MAX_ATTRIBUTE_SCALARS, Method, Role, lookup_state};

use crate::arithmetic::{Arithmetic, Vector, vector_at};
use crate::light_selection::LightSelection;
use crate::stage::{TIME_COLUMN, asks_host, first_of};
use crate::stage_linker::StageLinker;

/// The map from the space of a shape to that of its group, or the world.
const FORWARD: &str = "rt_Forward";
/// The map of magnitudes, from the world to the space of the shape and back.
const SIZES: &str = "rt_Sizes";
/// The extents of the shape's box, in the world's directions, then -1 if its orientation is reversed, else 1.
const EXTENTS: &str = "rt_Extents";
/// The factor by which volumes are scaled from the space of the shape to the world.
const VOLUME: &str = "rt_Volume";
/// The map from the world to the space of the shape's group, and that back.
const GROUP: &str = "rt_Group";
/// The factor by which volumes are scaled from the space of the group to the world.
const GROUP_VOLUME: &str = "rt_GroupVolume";
/// The [way](LightSelection::way) to the shape in the light hierarchy.
const LIGHT: &str = "rt_Light";

/// The methods of shapes that describe surfaces.
#[derive(Clone, Debug)]
pub struct ShapeLinks {
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
    /// The data with their places.
    pub places: Places,
}

/// The data with the places of shapes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Places {
    /// Members beside those of the shapes.
    Members {
        /// True if instances that do not move place groups of shapes.
        are_grouped: bool,
    },
    /// [Scratch arrays](crate::query_columns::QueryColumns) that hosts set.
    Columns {
        /// True if instances place groups of shapes.
        are_grouped: bool,
    },
}

/// The first scalar of the `rt_Group` in an `rt_Place`.
const GROUP_OF_PLACE: usize = 42;

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
pub(crate) fn needs_only(method: &LinkedMethod, inputs: &[&str]) -> bool {
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

    /// Returns the members besides those of the shapes, with their scalars, in the order of a shape's data.
    pub fn members(&self) -> Vec<(String, u32)> {
        let maps = [PLACEMENT, FORWARD, SIZES].map(|name| (name, 12));
        let maps = maps.into_iter().filter(|_| self.is_placed);
        let of_samples = [(VOLUME, 1), (LIGHT, 1)].into_iter().filter(|_| self.is_sampled);
        let of_groups = [(GROUP, 24), (GROUP_VOLUME, 1)].into_iter();
        let of_groups = of_groups.filter(|_| self.places == Places::Members { are_grouped: true });
        let members = maps.chain([(EXTENTS, 4)]).chain(of_samples).chain(of_groups);
        members.map(|(name, scalars)| (self.member(name), scalars)).collect()
    }

    fn member(&self, name: &str) -> String {
        format!("{}{name}", self.prefix)
    }

    /// Loads the place of a shape: an `rt_Place`.
    pub(crate) fn place(&self, code: &mut Arithmetic<'_>) -> Linking<Vec<Value>> {
        let are_grouped = match self.places {
            Places::Columns { are_grouped } => {
                return code.place_in_columns(self.is_placed, are_grouped);
            }
            Places::Members { are_grouped } => are_grouped,
        };
        let mut place = vec![code.boolean(self.is_placed)?];
        for name in [PLACEMENT, FORWARD, SIZES] {
            match self.is_placed {
                true => place.extend(code.map(&self.member(name))?.as_flattened()),
                false => place.extend([code.float(0.0)?; 12]),
            }
        }
        let extents = self.member(EXTENTS);
        place.extend(code.member(&extents, 4, 0)?);
        place.push(code.member(&extents, 4, 1)?[2]);
        place.push(match self.is_sampled {
            true => code.load_member(&self.member(VOLUME), Scalar::F32)?,
            false => code.float(1.0)?,
        });
        place.push(code.boolean(are_grouped)?);
        if are_grouped {
            for first in (0..24).step_by(3) {
                place.extend(code.member(&self.member(GROUP), 24, first)?);
            }
            place.push(code.load_member(&self.member(GROUP_VOLUME), Scalar::F32)?);
        } else {
            place.extend([code.float(0.0)?; 25]);
        }
        Ok(place)
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

/// The computation of a surface's properties.
pub(crate) struct SurfaceCode<'a> {
    shape: &'a ShapeLinks,
    /// The place of the shape: an `rt_Place`.
    place: Vec<Value>,
    /// The hit in the space of the shape.
    local: Hit,
    /// The state in the space of the shape; of several values of a component the last counts.
    state: Vec<(StateComponent, Value)>,
}

/// A ray with its hit: an `rt_Hit`.
#[derive(Clone, Copy)]
pub(crate) struct Hit {
    pub origin: Vector,
    pub direction: Vector,
    pub distance: Value,
}

/// A surface in the world: an `rt_Surface`.
pub(crate) struct WorldSurface {
    pub point: Vector,
    pub geometric_normal: Vector,
    pub shading_normal: Vector,
    pub offset: Value,
    /// `dpdu` and `dpdv`, then the widths of the footprint.
    pub tangents: [Value; 8],
}

impl StageLinker {
    /// Computes the results of [`Query::SurfaceProperties`] for a surface with these operands.
    pub(crate) fn surface_properties(
        &mut self,
        shape: &ShapeLinks,
        operands: &[Value],
        to: &mut Vec<Op>,
    ) -> Linking<Vec<Value>> {
        let operand = |name| operands[first_of(Query::SurfaceProperties.operands(), name)];
        let hit = Hit::of(operands);
        let code = &mut Arithmetic { linker: &mut *self, to: &mut *to };
        let mut surface = SurfaceCode::begin(code, shape, hit, operand("epsilon"))?;
        let scratch = self.scratch.replace(Vec::new());
        let called = surface.call_methods(self, hit, operand("limit"), to);
        self.scratch = scratch;
        called?;
        let code = &mut Arithmetic { linker: self, to };
        surface.finish(code, hit, [operand("width"), operand("spread")])
    }

    /// Computes the result of [`Query::LightPdf`] for a surface with these operands; `None` if the host does.
    pub(crate) fn light_density(
        &mut self,
        shape: &ShapeLinks,
        selection: &LightSelection,
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
            .find_normals(self, hit, operand("limit"), to)
            .and_then(|()| surface.call(self, method, to));
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
    pub fn seen_from(self, code: &mut Arithmetic<'_>, point: Vector) -> Linking<Hit> {
        let hit = code.call("rt_hitSeenFrom", &[&self.scalars()[..], &point].concat())?;
        Ok(Hit::of_scalars(&hit))
    }

    fn of_scalars(scalars: &[Value]) -> Hit {
        let (origin, direction) = (vector_at(scalars, 0), vector_at(scalars, 3));
        Hit { origin, direction, distance: scalars[6] }
    }

    fn scalars(&self) -> Vec<Value> {
        [&self.origin[..], &self.direction, &[self.distance]].concat()
    }
}

impl<'a> SurfaceCode<'a> {
    /// Returns the inputs of methods, and the results of those that the class lacks.
    pub fn begin(
        code: &mut Arithmetic<'_>,
        shape: &'a ShapeLinks,
        hit: Hit,
        epsilon: Value,
    ) -> Linking<SurfaceCode<'a>> {
        let place = shape.place(code)?;
        let local = code.call("rt_hitInShape", &[&place[..], &hit.scalars()].concat())?;
        let local = Hit::of_scalars(&local);
        let point = vector_at(&code.call("rt_pointOnRay", &local.scalars())?, 0);
        let facing = code.each(|it, axis| it.unary(UnaryOp::Negate, local.direction[axis]))?;
        let one = code.float(1.0)?;
        let inverse = code.each(|it, axis| it.divide(one, local.direction[axis]))?;
        let zero = code.float(0.0)?;
        let time = code.column(TIME_COLUMN, Scalar::F32)?;
        let mut surface = SurfaceCode { shape, place, local, state: Vec::new() };
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

    pub fn get(&self, name: &str, component: u32) -> Option<Value> {
        let variable = lookup_state(name)?.index;
        find_override(&self.state, StateComponent { variable, component })
    }

    /// Returns a vector that has been set.
    fn vector(&self, name: &str) -> Vector {
        [0, 1, 2].map(|axis| self.get(name, axis).expect("it has a default"))
    }

    pub fn call_methods(
        &mut self,
        linker: &mut StageLinker,
        hit: Hit,
        limit: Value,
        to: &mut Vec<Op>,
    ) -> Linking<()> {
        self.find_normals(linker, hit, limit, to)?;
        self.call_linked(linker, Method::ComputeTextureCoordinates, to)?;
        self.call_linked(linker, Method::ComputeDerivatives, to)
    }

    /// Computes scratch and normals, which are normalised if further methods may read them.
    pub fn find_normals(
        &mut self,
        linker: &mut StageLinker,
        hit: Hit,
        limit: Value,
        to: &mut Vec<Op>,
    ) -> Linking<()> {
        let shape = self.shape;
        if shape.has(Method::Intersect) {
            // The search had the limit; the ray is placed by the method.
            let state = self.state.clone();
            self.set("rt_HitDistance", &[limit]);
            if shape.is_placed {
                let code = &mut Arithmetic { linker: &mut *linker, to: &mut *to };
                let group = &self.place[GROUP_OF_PLACE..];
                let in_group = code.call("rt_hitInGroup", &[group, &hit.scalars()].concat())?;
                self.set("rt_RayOrigin", &in_group[..3]);
                self.set("rt_RayDirection", &in_group[3..6]);
            }
            // Searches draw no random numbers either.
            linker.draws_zeros = true;
            let called = self.call_linked(linker, Method::Intersect, to);
            linker.draws_zeros = false;
            called?;
            self.state = state;
        }
        self.call_linked(linker, Method::ComputeNormal, to)?;
        if shape.placement().moves {
            let point = self.vector("rt_HitPoint");
            self.set("rt_TextureUVW", &point);
        }
        let reads_normals = shape.is_sampled
            || shape.has(Method::ComputeTextureCoordinates)
            || shape.has(Method::ComputeDerivatives);
        if reads_normals {
            let code = &mut Arithmetic { linker: &mut *linker, to: &mut *to };
            let normals = ["rt_GeometricNormal", "rt_ShadingNormal"].map(|it| self.vector(it));
            let normals = code.call("rt_unitNormals", normals.as_flattened())?;
            self.set("rt_GeometricNormal", &normals[..3]);
            self.set("rt_ShadingNormal", &normals[3..]);
        }
        Ok(())
    }

    /// Calls a method if the class has it.
    fn call_linked(
        &mut self,
        linker: &mut StageLinker,
        method: Method,
        to: &mut Vec<Op>,
    ) -> Linking<()> {
        match self.shape.methods.get(&method) {
            Some(method) => self.call(linker, method, to),
            None => Ok(()),
        }
    }

    /// Copies a method's body, and notes the state that it sets.
    pub fn call(
        &mut self,
        linker: &mut StageLinker,
        method: &LinkedMethod,
        to: &mut Vec<Op>,
    ) -> Linking<()> {
        let set = linker.copy_method(&self.shape.prefix, method, self.state.clone(), to)?;
        self.state.extend(set);
        Ok(())
    }

    /// Returns the properties in the world, in the order of the query's results.
    fn finish(
        &mut self,
        code: &mut Arithmetic<'_>,
        hit: Hit,
        footprint: [Value; 2],
    ) -> Linking<Vec<Value>> {
        let surface = self.in_world(code, hit, footprint)?;
        let normals = [surface.point, surface.geometric_normal, surface.shading_normal];
        let mut properties = normals.as_flattened().to_vec();
        properties.extend((0..2).filter_map(|it| self.get("rt_TextureUV", it)));
        properties.extend((0..3).filter_map(|it| self.get("rt_TextureUVW", it)));
        properties.extend(surface.tangents.into_iter().chain([surface.offset]));
        let of_textures = ["rt_dsdu", "rt_dsdv", "rt_dtdu", "rt_dtdv"];
        properties.extend(of_textures.iter().filter_map(|name| self.get(name, 0)));
        let zero = code.float(0.0)?;
        properties
            .extend((0..MAX_ATTRIBUTE_SCALARS).map(|it| self.get(ATTRIBUTES, it).unwrap_or(zero)));
        properties.extend(self.maps(code)?);
        Ok(properties)
    }

    /// Returns the map from the world to the space of the shape, then the map back.
    pub fn maps(&self, code: &mut Arithmetic<'_>) -> Linking<Vec<Value>> {
        code.call("rt_mapsOfPlace", &self.place)
    }

    /// Returns the surface in the world, given the ray's width at its origin and the increase per unit of length.
    pub fn in_world(
        &self,
        code: &mut Arithmetic<'_>,
        hit: Hit,
        footprint: [Value; 2],
    ) -> Linking<WorldSurface> {
        let mut operands = self.place.clone();
        for is_so in self.kind() {
            operands.push(code.boolean(is_so)?);
        }
        operands.extend(hit.scalars().into_iter().chain(self.local.scalars()));
        for (name, components) in [
            ("rt_HitPoint", 3),
            ("rt_GeometricNormal", 3),
            ("rt_ShadingNormal", 3),
            ("rt_SurfaceOffset", 1),
            ("rt_dPdu", 3),
            ("rt_dPdv", 3),
        ] {
            for component in 0..components {
                operands.push(self.result(code, name, component)?);
            }
        }
        let surface = code.call("rt_surfaceInWorld", &[&operands[..], &footprint].concat())?;
        let tangents = surface[10..].try_into().expect("an `rt_Surface` ends with 8 scalars");
        Ok(WorldSurface {
            point: vector_at(&surface, 0),
            geometric_normal: vector_at(&surface, 3),
            shading_normal: vector_at(&surface, 6),
            offset: surface[9],
            tangents,
        })
    }

    /// The parts of hits that the shape's methods set: an `rt_ShapeKind`.
    fn kind(&self) -> [bool; 4] {
        let HitPlacement { moves, is_bounded } = self.shape.placement();
        let sets = self.shape.methods.get(&Method::ComputeNormal);
        let sets = sets.is_some_and(|it| it.writes.iter().any(|it| it.name == "rt_SurfaceOffset"));
        [moves, is_bounded, sets, self.shape.has(Method::ComputeDerivatives)]
    }

    /// Returns a component that a method has set, or the default of primitives.
    fn result(&self, code: &mut Arithmetic<'_>, name: &str, component: u32) -> Linking<Value> {
        let variable = lookup_state(name).map_or(0, |variable| variable.index);
        let wanted = StateComponent { variable, component };
        match self.get(name, component) {
            Some(value) => Ok(value),
            None => code.linker.constant(code.to, default_of(Role::Primitive, wanted)),
        }
    }

    /// The density per solid angle of the world that the shape has set; 0 if it is none.
    pub fn density(&self, code: &mut Arithmetic<'_>, hit: Hit) -> Linking<Value> {
        let own = self.get("rt_PDF", 0).map_or_else(|| code.float(0.0), Ok)?;
        let directions = [hit.direction, self.local.direction];
        let operands = [&self.place[..], &[own], directions.as_flattened()].concat();
        Ok(code.call("rt_densityInWorld", &operands)?[0])
    }
}
