//! The scratch arrays through which kernels that answer queries meet hosts, and the queries.

use std::ops::Range;

use rtsl_ir::{Scalar, Value};
use rtsl_link::Linking;
use rtsl_spec::{ATTRIBUTES, StateVariable, TO_OBJECT, TO_WORLD, lookup_state};

use crate::arithmetic::{Arithmetic, Map, Vector};
use crate::stage::TIME_COLUMN;

/// The scratch arrays, each of one number: these are the first of several, counted from the first of all. Which of them
/// a kernel reads and which it stores, [`HostQuery`] tells.
pub struct QueryColumns;

impl QueryColumns {
    /// The origin of a ray in the world, or a point that is lit.
    pub const ORIGIN: usize = 0;
    /// The direction of the ray, of any length, or from the lit point.
    pub const DIRECTION: usize = 3;
    /// The least parameter of hits.
    pub const EPSILON: usize = 6;
    /// The parameter of the hit, or the distance of a sampled point.
    pub const DISTANCE: usize = 7;
    /// The greatest parameter of hits.
    pub const LIMIT: usize = 8;
    /// The time within the shutter.
    pub const TIME: usize = 9;
    /// The width of the ray at its origin.
    pub const WIDTH: usize = 10;
    /// The increase of the width per unit of length.
    pub const SPREAD: usize = 11;
    /// The extents of the shape's box in the space of its group.
    pub const EXTENTS: usize = 12;
    /// -1 if the shape's orientation is reversed, else 1.
    pub const SIDE: usize = 15;
    /// The factor by which volumes are scaled from the shape's space to that of its group.
    pub const VOLUME: usize = 16;
    /// The maps from the group to the shape, back, and of magnitudes to the shape and back, each by columns: the images
    /// of the axes, then that of the origin. They are read if shapes have spaces of their own. Of lights without a shape
    /// the maps from the world, and back.
    pub const MAPS: usize = 17;
    /// The map from the world to the shape's group, and that back. They are read if instances place the group.
    pub const GROUP: usize = 53;
    /// The factor by which volumes are scaled from the group's space to the world.
    pub const GROUP_VOLUME: usize = 77;
    /// The point, in the world.
    pub const POINT: usize = 78;
    /// The offset at which rays that leave the point begin.
    pub const OFFSET: usize = 81;
    /// The geometric normal, of unit length.
    pub const GEOMETRIC_NORMAL: usize = 82;
    /// The normal for shading, of unit length.
    pub const SHADING_NORMAL: usize = 85;
    /// A density per solid angle.
    pub const DENSITY: usize = 88;
    /// The length of a shadow ray.
    pub const REACH: usize = 89;
    /// A radiance.
    pub const RADIANCE: usize = 90;
    /// The probability with which the light of a sample has been selected.
    pub const PROBABILITY: usize = 93;
    /// 1 if radiances of samples that rays find, too, are divided by densities; else 0.
    pub const DIVIDES: usize = 94;
    /// The number of all arrays.
    pub const COUNT: usize = 95;

    /// Returns the names of the arrays in order.
    pub fn names() -> impl Iterator<Item = String> {
        (0..QueryColumns::COUNT).map(name_of)
    }
}

/// Returns the name of an array.
pub(crate) fn name_of(column: usize) -> String {
    if column == QueryColumns::TIME { TIME_COLUMN.to_owned() } else { format!("query.{column}") }
}

/// A question that a host has a kernel answer.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum HostQuery {
    /// The surface of a hit: from the ray and the place of the shape, to point, offset and normals. The state of methods
    /// of materials is stored too, with these properties.
    Surface {
        /// The properties.
        needs: SurfaceNeeds,
        /// True if the scratch of the shape's methods is read, too.
        keeps_scratch: bool,
    },
    /// The density with which light samples for a point find a hit: from the point, the ray and the place of the shape.
    Density,
    /// A point of a shape as a light sample, without its radiance: from the lit point with its offset and the place of the
    /// shape, to direction, distance, reach, and density without the probability. The state of methods of materials is
    /// stored too, without properties.
    SampledPoint,
    /// The radiance of such a point by the `emission` of a material, which reads that state: from density and probability
    /// to radiance and density.
    SampledEmission(Weighing),
    /// The radiance that a texture leaves which cuts the shape out: from radiance, density and probability to radiance and
    /// density.
    SampledAlpha(Weighing),
    /// A sample of a light without a shape: from the lit point with its normals and offset, and the probability, to
    /// direction, distance, reach, radiance and density.
    Illumination {
        /// True if the light has a space of its own.
        is_placed: bool,
        /// True if rays that leave the scene can find it.
        is_weighed: bool,
    },
    /// The radiance of a light for a ray that leaves the scene.
    SkyEmission,
    /// The density with which samples of such a light find the ray, seen from its origin with its normals.
    SkyDensity,
}

/// The weighing of samples of shapes, by the probability with which their light was selected.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Weighing {
    /// A texture is asked before.
    Later,
    /// Rays find the shape, too.
    OfFound,
    /// Samples alone find it.
    OfInvisible,
}

/// The properties of surfaces that methods read besides rays, points and normals.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct SurfaceNeeds {
    /// Texture coordinates and attributes.
    pub coordinates: bool,
    /// Derivatives.
    pub derivatives: bool,
    /// The reciprocal directions of rays.
    pub inverse_directions: bool,
    /// The widths of rays.
    pub footprints: bool,
    /// The maps between the objects' spaces and the world.
    pub maps: bool,
}

/// The state with texture coordinates.
pub(crate) const COORDINATES: [&str; 3] = ["rt_TextureUV", "rt_TextureUVW", ATTRIBUTES];
/// The state with derivatives of texture coordinates.
pub(crate) const DERIVATIVES: [&str; 4] = ["rt_dsdu", "rt_dsdv", "rt_dtdu", "rt_dtdv"];
/// The state with derivatives of points.
pub(crate) const TANGENTS: [&str; 2] = ["rt_dPdu", "rt_dPdv"];
/// The state with footprints.
pub(crate) const FOOTPRINT: [&str; 2] = ["rt_du", "rt_dv"];

impl SurfaceNeeds {
    /// Returns the properties needed by readers of this state.
    pub fn of(reads: impl Fn(&StateVariable) -> bool) -> SurfaceNeeds {
        let any = |names: &[&str]| names.iter().filter_map(|it| lookup_state(it)).any(&reads);
        SurfaceNeeds {
            coordinates: any(&COORDINATES),
            derivatives: any(&DERIVATIVES) || any(&TANGENTS),
            inverse_directions: any(&["rt_InverseRayDirection"]),
            footprints: any(&FOOTPRINT),
            maps: any(&[TO_OBJECT, TO_WORLD]),
        }
    }
}

impl Arithmetic<'_> {
    /// Loads a column.
    pub fn query_column(&mut self, column: usize) -> Linking<Value> {
        self.column(&name_of(column), Scalar::F32)
    }

    /// Loads three columns.
    pub fn query_columns(&mut self, first: usize) -> Linking<Vector> {
        self.each(|code, axis| code.query_column(first + axis))
    }

    /// Loads a map.
    pub fn query_map(&mut self, first: usize) -> Linking<Map> {
        let mut image = |index: usize| self.query_columns(first + 3 * index);
        Ok([image(0)?, image(1)?, image(2)?, image(3)?])
    }

    /// Stores values to columns from `first` on, when the function ends.
    pub fn store_columns(&mut self, first: usize, values: &[Value]) {
        let columns = (first..).zip(values);
        columns.for_each(|(column, value)| self.linker.set_column(name_of(column), *value));
    }

    /// Loads the place of a shape: an `rt_Place`.
    pub fn place_in_columns(&mut self, is_placed: bool, is_grouped: bool) -> Linking<Vec<Value>> {
        let mut place = vec![self.boolean(is_placed)?];
        self.add_columns(is_placed, QueryColumns::MAPS..QueryColumns::GROUP, &mut place)?;
        place.extend(self.query_columns(QueryColumns::EXTENTS)?);
        place.push(self.query_column(QueryColumns::SIDE)?);
        place.push(self.query_column(QueryColumns::VOLUME)?);
        place.push(self.boolean(is_grouped)?);
        let of_group = QueryColumns::GROUP..QueryColumns::GROUP_VOLUME + 1;
        self.add_columns(is_grouped, of_group, &mut place)?;
        Ok(place)
    }

    /// Adds columns, or zeros if nobody reads them.
    fn add_columns(
        &mut self,
        are_read: bool,
        columns: Range<usize>,
        place: &mut Vec<Value>,
    ) -> Linking<()> {
        for column in columns {
            place.push(if are_read { self.query_column(column)? } else { self.float(0.0)? });
        }
        Ok(())
    }
}
