//! Calls of methods that shade surfaces: the surface that their rays leave, the factor of the light that they defer,
//! and their random sequences.
//!
//! A method of a material that is linked by itself finds these in the arrays that its caller has set. One that is part
//! of an integrator's stage has them as values.

use rtsl_ir::{
    BinaryOp, CompareOp, Op, Query, SURFACE_SCALARS, Scalar, Value, Variable, VariableId,
};
use rtsl_link::Linking;
use rtsl_math::sampling::{NUMBERS_OF_RAND, NUMBERS_OF_SHADE};

use crate::arithmetic::{Arithmetic, Vector};
use crate::sampler::KEY_COLUMN;
use crate::search::SEARCHES_COLUMN;
use crate::sequences::Purpose;
use crate::spawning::CHILDREN_COLUMN;
use crate::stage::first_of;
use crate::stage_linker::StageLinker;

/// The number of scalars of the surface that a material shades.
pub const SHADED_SCALARS: usize = 10;

/// The indices of the offset and of the two normals among them; the point comes first.
const OFFSET: usize = 3;
const NORMALS: [usize; 2] = [4, 7];

/// Returns the name of the scratch array with a scalar of the surface that a material shades: the point, the offset at
/// which rays that leave it begin, the geometric and the shading normal on the side from which the ray came.
pub fn shaded_column(index: usize) -> String {
    format!("shaded.{index}")
}

/// True for the scratch with the surface that a material shades, and with the factor of the light that it defers.
pub fn is_shaded_column(variable: &Variable) -> bool {
    (0..SHADED_SCALARS).any(|index| variable.name == shaded_column(index))
        || SHADE_WEIGHT_COLUMNS.contains(&variable.name.as_str())
}

/// The scratch arrays with the factor of the light that a material's method defers.
pub const SHADE_WEIGHT_COLUMNS: [&str; 3] = ["shade.weight.0", "shade.weight.1", "shade.weight.2"];

/// A surface that is shaded, in world space.
#[derive(Clone, Copy)]
pub(crate) struct ShadedSurface {
    pub point: Vector,
    /// The offset at which rays that leave the point begin.
    pub offset: Value,
    /// The geometric normal, of unit length, and the shading normal, on the side from which the ray came.
    pub normals: [Vector; 2],
}

/// A call of a method that shades a surface.
#[derive(Clone, Copy)]
pub(crate) struct ShadeCall {
    pub surface: ShadedSurface,
    /// The factor of the light that it defers.
    pub weight: Vector,
    /// The key of its random sequences.
    pub key: Value,
    /// The number of surfaces that the path has met before this one.
    pub before: Value,
    /// The locals that count its samples of lights and the rays that it traces.
    lights: VariableId,
    pub children: VariableId,
}

impl StageLinker {
    /// Begins a call, for a query with these operands about a surface with these properties, of which there is one for
    /// each search of the path.
    pub(crate) fn begin_shade_call(
        &mut self,
        operands: &[Value],
        properties: &[Value],
        to: &mut Vec<Op>,
    ) -> Linking<ShadeCall> {
        let weight = first_of(Query::OwnShade.operands(), "weight");
        let [lights, children] = ["lights", "children"].map(|count| {
            let name = format!("shade.{count}.{}", self.out.variables.len());
            self.new_local(name, Scalar::U32)
        });
        let code = &mut Arithmetic { linker: self, to };
        let zero = code.word(0)?;
        code.store_local(lights, zero)?;
        code.store_local(children, zero)?;
        Ok(ShadeCall {
            surface: code.shaded_surface(operands, properties)?,
            weight: [0, 1, 2].map(|channel| operands[weight + channel]),
            key: code.key_of_shade()?,
            before: code.surfaces_before()?,
            lights,
            children,
        })
    }

    /// Returns the call whose method is being copied; `None` in methods that shade no surface.
    pub(crate) fn shade_call(&mut self, to: &mut Vec<Op>) -> Linking<Option<ShadeCall>> {
        if self.shade_call.is_some() || !self.is_of_material() {
            return Ok(self.shade_call);
        }
        let lights = self.passed_value(Purpose::LightSample.column(), Scalar::U32);
        let children = self.passed_value(CHILDREN_COLUMN, Scalar::U32);
        let code = &mut Arithmetic { linker: self, to };
        let weight =
            code.each(|it, channel| it.column(SHADE_WEIGHT_COLUMNS[channel], Scalar::F32))?;
        let (surface, key) = (code.shaded_columns()?, code.column(KEY_COLUMN, Scalar::U32)?);
        // The depth of the call counts these.
        let before = code.word(0)?;
        Ok(Some(ShadeCall { surface, weight, key, before, lights, children }))
    }

    fn is_of_material(&self) -> bool {
        self.surface.as_ref().is_some_and(|links| links.material.is_some())
    }
}

impl ShadeCall {
    /// Begins the random numbers of a sample of a light, and returns their key.
    pub fn begin_light_sample(&self, code: &mut Arithmetic<'_>) -> Linking<Value> {
        code.begin_counted_sequence(Purpose::LightSample, self.key, self.lights)
    }

    /// Returns the key of the numbers that `rand()` draws.
    pub fn key_of_rand(&self, code: &mut Arithmetic<'_>) -> Linking<Value> {
        code.hash_with(self.key, NUMBERS_OF_RAND)
    }
}

impl Arithmetic<'_> {
    /// Returns the surface of a query, on the side from which its ray came.
    fn shaded_surface(
        &mut self,
        operands: &[Value],
        properties: &[Value],
    ) -> Linking<ShadedSurface> {
        let operand = |name| {
            let first = first_of(Query::OwnShade.operands(), name);
            [0, 1, 2].map(|axis| operands[first + axis])
        };
        let first = |name| first_of(Query::SurfaceProperties.results(), name);
        let property = |name| [0, 1, 2].map(|axis| properties[first(name) + axis]);
        debug_assert_eq!(operands.len(), SURFACE_SCALARS + 3);
        let (geometric, shading) = (property("geometric_normal"), property("shading_normal"));
        let cosine = self.products(operand("direction"), geometric)?;
        let zero = self.float(0.0)?;
        let is_behind = self.compare(CompareOp::Greater, cosine, zero)?;
        let (back, front) = (self.float(-1.0)?, self.float(1.0)?);
        let side = self.select(is_behind, back, front)?;
        Ok(ShadedSurface {
            point: property("point"),
            offset: properties[first("offset")],
            normals: [self.scaled(geometric, side)?, self.scaled(shading, side)?],
        })
    }

    /// Loads the surface that a caller has set.
    pub(crate) fn shaded_columns(&mut self) -> Linking<ShadedSurface> {
        let mut shaded = |index: usize| self.column(&shaded_column(index), Scalar::F32);
        let mut vector = |first: usize| -> Linking<Vector> {
            Ok([shaded(first)?, shaded(first + 1)?, shaded(first + 2)?])
        };
        let (point, normals) = (vector(0)?, [vector(NORMALS[0])?, vector(NORMALS[1])?]);
        Ok(ShadedSurface { point, offset: shaded(OFFSET)?, normals })
    }

    /// Returns the key of the sequences of a call of `shade`, the only one since the last search of the path.
    fn key_of_shade(&mut self) -> Linking<Value> {
        let searches = self.column(SEARCHES_COLUMN, Scalar::U32)?;
        let (before, one) = (self.count_after(searches)?, self.word(1)?);
        let count = self.add(before, one)?;
        let key = self.column(KEY_COLUMN, Scalar::U32)?;
        let key = self.hash_with(key, NUMBERS_OF_SHADE)?;
        self.hash(key, count)
    }

    fn surfaces_before(&mut self) -> Linking<Value> {
        let searches = self.column(SEARCHES_COLUMN, Scalar::U32)?;
        let one = self.word(1)?;
        self.binary(BinaryOp::Subtract, searches, one)
    }

    /// Returns the origin of a ray, off the surface if it begins there.
    pub(crate) fn leave(
        &mut self,
        surface: &ShadedSurface,
        origin: Vector,
        direction: Vector,
    ) -> Linking<Vector> {
        let ShadedSurface { point, offset, normals: [normal, _] } = *surface;
        let operands = [&point[..], &normal, &[offset], &origin, &direction].concat();
        let left = self.call("rt_leave", &operands)?;
        Ok([left[0], left[1], left[2]])
    }
}
