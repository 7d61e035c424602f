//! The surfaces of hits as kernels of their own, for hosts: what stages with the shapes of surfaces have in them, for
//! methods that a host calls by itself.
//!
//! The ray, its hit and the place of the shape are in scratch arrays. The kernel stores the state that methods of
//! materials read, and what a host needs of the surface in further arrays: [`SurfaceColumns`] tells which.

use rtsl_ir::{CompareOp, Constant, Op, Output, Scalar, Value, Variable};
use rtsl_link::{Linked, Linker, Linking};
use rtsl_spec::{ATTRIBUTES, StateVariable, TO_OBJECT, TO_WORLD, lookup_state};

use crate::arithmetic::{Arithmetic, Map, Vector};
use crate::stage::TIME_COLUMN;
use crate::stage_linker::StageLinker;
use crate::surface::{Hit, ShapeLinks, SurfaceCode};

/// The scratch arrays through which kernels of surfaces meet hosts, each of one number: these are the first of several,
/// counted from the first of all.
pub struct SurfaceColumns;

impl SurfaceColumns {
    /// The origin of the ray in the world.
    pub const ORIGIN: usize = 0;
    /// Its direction, of any length.
    pub const DIRECTION: usize = 3;
    /// The least parameter of hits.
    pub const EPSILON: usize = 6;
    /// The parameter of the hit.
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
    /// of the axes, then that of the origin. They are read if shapes have spaces of their own.
    pub const MAPS: usize = 17;
    /// 1 if an instance places the group, else 0; then the map from the world to the group, that back, and the factor by
    /// which volumes are scaled on the way back. They are read if instances place groups.
    pub const GROUP: usize = 53;
    /// The point, in the world.
    pub const POINT: usize = 79;
    /// The offset at which rays that leave the point begin.
    pub const OFFSET: usize = 82;
    /// The geometric normal, of unit length.
    pub const GEOMETRIC_NORMAL: usize = 83;
    /// The normal for shading, of unit length.
    pub const SHADING_NORMAL: usize = 86;
    /// The density with which light samples find the point.
    pub const DENSITY: usize = 89;
    /// The number of all arrays.
    pub const COUNT: usize = 90;

    /// Returns the names of the arrays in order.
    pub fn names() -> impl Iterator<Item = String> {
        (0..SurfaceColumns::COUNT).map(name_of)
    }
}

fn name_of(column: usize) -> String {
    if column == SurfaceColumns::TIME {
        TIME_COLUMN.to_owned()
    } else {
        format!("surface.{column}")
    }
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

/// The results of a kernel of surfaces.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum SurfaceResults {
    /// The surface, with these properties.
    Surface {
        /// The properties.
        needs: SurfaceNeeds,
        /// True if the scratch of the shape's methods is read, too.
        keeps_scratch: bool,
    },
    /// The density with which light samples find the point.
    Density,
}

/// The state with texture coordinates.
const COORDINATES: [&str; 3] = ["rt_TextureUV", "rt_TextureUVW", ATTRIBUTES];
/// The state with derivatives of texture coordinates.
const DERIVATIVES: [&str; 4] = ["rt_dsdu", "rt_dsdv", "rt_dtdu", "rt_dtdv"];
/// The state with derivatives of points, then that with footprints.
const TANGENTS: [&str; 2] = ["rt_dPdu", "rt_dPdv"];
const FOOTPRINT: [&str; 2] = ["rt_du", "rt_dv"];

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

/// Links a function of this name for shapes whose places are in columns, and whose class has this scratch. It may report
/// the calls of their methods, for traces.
///
/// # Errors
/// If linking passes a limit.
pub fn link_hit_surface(
    name: String,
    shape: &ShapeLinks,
    scratch: &[Variable],
    results: SurfaceResults,
    reports_calls: bool,
) -> Linking<Linked> {
    let mut linker = StageLinker::new(name);
    linker.scratch = Some(Vec::new());
    linker.reports_calls = reports_calls;
    let mut ops = Vec::new();
    let code = &mut Arithmetic { linker: &mut linker, to: &mut ops };
    let hit = Hit {
        origin: code.surface_columns(SurfaceColumns::ORIGIN)?,
        direction: code.surface_columns(SurfaceColumns::DIRECTION)?,
        distance: code.surface_column(SurfaceColumns::DISTANCE)?,
    };
    let epsilon = code.surface_column(SurfaceColumns::EPSILON)?;
    let limit = code.surface_column(SurfaceColumns::LIMIT)?;
    let mut surface = SurfaceCode::begin(code, shape, hit, epsilon)?;
    match results {
        SurfaceResults::Density => {
            surface.find_normals(&mut linker, (hit, limit), &mut ops)?;
            if let Some(method) = &shape.density {
                surface.call(&mut linker, method, &mut ops)?;
            }
            let code = &mut Arithmetic { linker: &mut linker, to: &mut ops };
            let density = surface.density(code, hit)?;
            linker.set_column(name_of(SurfaceColumns::DENSITY), density);
        }
        SurfaceResults::Surface { needs, keeps_scratch } => {
            surface.call_methods(&mut linker, (hit, limit), &mut ops)?;
            let code = &mut Arithmetic { linker: &mut linker, to: &mut ops };
            let stored = code.stored_state(&surface, hit, needs)?;
            for (name, values) in stored {
                linker.set_state(name, &values);
            }
            linker.store_scratch(if keeps_scratch { scratch } else { &[] }, &mut ops)?;
        }
    }
    linker.out.body.ops = ops;
    Ok(linker.finish())
}

impl Arithmetic<'_> {
    fn surface_column(&mut self, column: usize) -> Linking<Value> {
        self.column(&name_of(column), Scalar::F32)
    }

    fn surface_columns(&mut self, first: usize) -> Linking<Vector> {
        self.each(|code, axis| code.surface_column(first + axis))
    }

    fn surface_map(&mut self, first: usize) -> Linking<Map> {
        let mut image = |index: usize| self.surface_columns(first + 3 * index);
        Ok([image(0)?, image(1)?, image(2)?, image(3)?])
    }

    /// Loads the place of a shape: an `rt_Place`.
    pub fn place_in_columns(&mut self, is_placed: bool, is_grouped: bool) -> Linking<Vec<Value>> {
        let mut place = vec![self.boolean(is_placed)?];
        self.add_maps(is_placed, SurfaceColumns::MAPS, 3, &mut place)?;
        place.extend(self.surface_columns(SurfaceColumns::EXTENTS)?);
        place.push(self.surface_column(SurfaceColumns::SIDE)?);
        place.push(self.surface_column(SurfaceColumns::VOLUME)?);
        if is_grouped {
            let (is_placed, zero) = (self.surface_column(SurfaceColumns::GROUP)?, self.float(0.0)?);
            place.push(self.compare(CompareOp::Greater, is_placed, zero)?);
        } else {
            place.push(self.boolean(false)?);
        }
        self.add_maps(is_grouped, SurfaceColumns::GROUP + 1, 2, &mut place)?;
        place.push(match is_grouped {
            true => self.surface_column(SurfaceColumns::GROUP + 25)?,
            false => self.float(1.0)?,
        });
        Ok(place)
    }

    /// Adds maps that are in columns, or zeros if nobody reads them.
    fn add_maps(
        &mut self,
        are_read: bool,
        first: usize,
        count: usize,
        place: &mut Vec<Value>,
    ) -> Linking<()> {
        for map in 0..count {
            match are_read {
                true => place.extend(self.surface_map(first + 12 * map)?.as_flattened()),
                false => place.extend([self.float(0.0)?; 12]),
            }
        }
        Ok(())
    }

    /// Returns the state to store, by names, after it has stored the columns.
    fn stored_state(
        &mut self,
        surface: &SurfaceCode<'_>,
        hit: Hit,
        needs: SurfaceNeeds,
    ) -> Linking<Vec<(&'static str, Vec<Value>)>> {
        let footprint = [SurfaceColumns::WIDTH, SurfaceColumns::SPREAD];
        let footprint = [self.surface_column(footprint[0])?, self.surface_column(footprint[1])?];
        let world = surface.in_world(self, hit, footprint)?;
        for (first, values) in [
            (SurfaceColumns::POINT, &world.point[..]),
            (SurfaceColumns::OFFSET, &[world.offset]),
            (SurfaceColumns::GEOMETRIC_NORMAL, &world.geometric_normal),
            (SurfaceColumns::SHADING_NORMAL, &world.shading_normal),
        ] {
            let columns = (first..).zip(values);
            columns.for_each(|(column, value)| self.linker.set_column(name_of(column), *value));
        }
        let mut stored = vec![
            ("rt_RayOrigin", hit.origin.to_vec()),
            ("rt_RayDirection", hit.direction.to_vec()),
            ("rt_HitDistance", vec![hit.distance]),
            ("rt_HitPoint", world.point.to_vec()),
            ("rt_GeometricNormal", world.geometric_normal.to_vec()),
            ("rt_ShadingNormal", world.shading_normal.to_vec()),
            ("rt_Epsilon", vec![self.surface_column(SurfaceColumns::EPSILON)?]),
            ("rt_TimeSeed", vec![self.surface_column(SurfaceColumns::TIME)?]),
        ];
        let of_shape = |name: &'static str| {
            let components = (0..).map_while(|component| surface.get(name, component));
            (name, components.collect::<Vec<Value>>())
        };
        if needs.coordinates {
            stored.extend(COORDINATES.map(of_shape));
        }
        let [du, dv] = [world.tangents[6], world.tangents[7]];
        if needs.derivatives {
            stored.extend(DERIVATIVES.map(of_shape));
            let tangents = world.tangents.chunks(3).map(<[Value]>::to_vec);
            stored.extend(TANGENTS.into_iter().zip(tangents));
        }
        if needs.footprints {
            stored.extend([(FOOTPRINT[0], vec![du]), (FOOTPRINT[1], vec![dv])]);
        }
        if needs.inverse_directions {
            let one = self.float(1.0)?;
            let inverse = self.each(|code, axis| code.divide(one, hit.direction[axis]))?;
            stored.push(("rt_InverseRayDirection", inverse.to_vec()));
        }
        if needs.maps {
            let maps = surface.maps(self)?;
            let (to_object, to_world) = maps.split_at(12);
            stored.extend([(TO_OBJECT, to_object.to_vec()), (TO_WORLD, to_world.to_vec())]);
        }
        Ok(stored)
    }
}

impl StageLinker {
    /// Stores scratch as methods have left it: zero where none has set it.
    fn store_scratch(&mut self, variables: &[Variable], to: &mut Vec<Op>) -> Linking<()> {
        let set = self.scratch.take().unwrap_or_default();
        for variable in variables {
            for component in 0..variable.len {
                let is_it = |((name, at), _): &&((String, u32), Value)| {
                    *name == variable.name && *at == component
                };
                let value = match set.iter().rev().find(is_it) {
                    Some((_, value)) => *value,
                    None => self.constant(to, Constant::zero(variable.scalar))?,
                };
                let variable = self.intern_variable(variable.clone());
                self.out.outputs.push(Output { variable, component });
                self.out.body.yields.push(value);
            }
        }
        Ok(())
    }
}
