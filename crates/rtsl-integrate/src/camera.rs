//! Cameras: the sampler's numbers for a pixel's sample, its place on the screen, which `prelude/renderer/camera.rtsl`
//! computes, `generateRay`, and the map to the world.

use std::sync::Arc;

use rtsl_ir::{Op, Output, Scalar, StateComponent, Value, Variable, VariableKind};
use rtsl_link::{Linked, LinkedMethod, Linker, Linking, find_override};
use rtsl_math::sampling::{AxisTable, PixelFilter, Sampler};
use rtsl_spec::lookup_state;

use crate::arithmetic::{Arithmetic, Vector};
use crate::lights::set;
use crate::sampler::{KEY_COLUMN, SAMPLE_COLUMN};
use crate::stage::{SurfaceLinks, TIME_COLUMN};
use crate::stage_linker::StageLinker;

/// The path to the members of the camera.
pub const CAMERA: &str = "camera.";
/// The member with the width and the height of the image in pixels.
pub const SIZE: &str = "view.size";
/// The member with the map from the camera's space to the world.
pub const MAP: &str = "view.map";
/// The member with the least distance of hits, unless the camera sets another.
pub const EPSILON: &str = "view.epsilon";
/// The members with the tables of the pixel filter, by axes: the distances, and the places at which the sign of weights
/// changes.
pub const FILTER: [[&str; 2]; 2] =
    [["filter.x", "filter.y"], ["filter.changes.x", "filter.changes.y"]];
/// The scratch arrays with each sample's pixel, counted from the top left of the image.
pub const PIXEL_COLUMNS: [&str; 2] = ["camera.column", "camera.row"];
/// The scratch arrays with the weight of each path's radiance.
pub const WEIGHT_COLUMNS: [&str; 3] = ["path.weight.0", "path.weight.1", "path.weight.2"];

/// The state with the footprints of rays.
pub const FOOTPRINTS: [&str; 2] = ["rt_RayWidth", "rt_RaySpread"];

/// The parts of a camera.
#[derive(Clone, Debug)]
pub struct CameraLinks {
    /// `generateRay`, if the class has it.
    pub generate: Option<Arc<LinkedMethod>>,
    /// The sampler of paths.
    pub sampler: Sampler,
    /// The pixel filter.
    pub filter: PixelFilter,
}

/// Links a function that computes the ray of a pixel's sample, with its weight and the key of its numbers, and the
/// footprint if it `has_footprints`.
///
/// # Errors
/// If linking passes a limit.
/// The function has this name.
pub fn link_camera(name: String, links: &CameraLinks, has_footprints: bool) -> Linking<Linked> {
    let mut linker = StageLinker::new(name);
    let sampler = Some(links.sampler);
    linker.surface = Some(Arc::new(SurfaceLinks { sampler, ..SurfaceLinks::default() }));
    let mut ops = Vec::new();
    let mut code = CameraCode { linker: &mut linker, links };
    let sample = code.sample(&mut ops)?;
    let ray = code.ray(&sample, sample.screen, &mut ops)?;
    if has_footprints {
        let footprint = code.footprint(&sample, &ray, &mut ops)?;
        FOOTPRINTS.into_iter().zip(footprint).for_each(|(name, value)| {
            code.linker.set_state(name, &[value]);
        });
    }
    code.store(&sample, &ray, &mut ops)?;
    linker.out.body.ops = ops;
    Ok(linker.finish())
}

struct CameraCode<'a, 'l> {
    linker: &'l mut StageLinker,
    links: &'a CameraLinks,
}

/// The inputs of `generateRay`.
struct CameraSample {
    index: Value,
    screen: [Value; 2],
    lens: [Value; 2],
    time: Value,
    /// The width and the height of a pixel.
    pixel: [Value; 2],
    /// The weight of the pixel filter, unless it is 1.
    weight: Option<Value>,
    /// The key of the path's random sequences.
    key: Value,
}

/// The results of `generateRay`, in the camera's space.
struct CameraRay {
    origin: Vector,
    direction: Vector,
    color: Vector,
    epsilon: Value,
    limit: Value,
}

impl CameraCode<'_, '_> {
    fn code<'s>(&'s mut self, to: &'s mut Vec<Op>) -> Arithmetic<'s> {
        Arithmetic { linker: self.linker, to }
    }

    fn sample(&mut self, to: &mut Vec<Op>) -> Linking<CameraSample> {
        let CameraLinks { sampler, filter, .. } = self.links;
        let code = &mut self.code(to);
        let [column, row] = PIXEL_COLUMNS.map(|name| code.column(name, Scalar::U32));
        let (column, row) = (column?, row?);
        let index = code.column(SAMPLE_COLUMN, Scalar::U32)?;
        let [width, height] = code.size()?;
        let before = code.multiply(row, width)?;
        let pixel = code.add(before, column)?;
        let [position, lens, time, key] = code.pixel_keys(sampler, pixel)?;
        let position = code.position(sampler, position, index)?;
        let ([x, y], weight) = code.filtered(filter, position)?;
        let pixel = code.call("rt_pixelSize", &[width, height])?;
        let screen = code.call("rt_screenPlace", &[column, row, width, height, x, y])?;
        Ok(CameraSample {
            index,
            screen: [screen[0], screen[1]],
            lens: code.lens_position(sampler, lens, index)?,
            time: code.number(sampler, time, index)?,
            pixel: [pixel[0], pixel[1]],
            weight,
            key,
        })
    }

    /// Generates the ray of a sample through a place on the screen.
    fn ray(
        &mut self,
        sample: &CameraSample,
        screen: [Value; 2],
        to: &mut Vec<Op>,
    ) -> Linking<CameraRay> {
        let code = &mut self.code(to);
        let (zero, one, far) = (code.float(0.0)?, code.float(1.0)?, code.float(f32::INFINITY)?);
        let epsilon = code.load_member(EPSILON, Scalar::F32)?;
        let mut state = Vec::new();
        for (name, values) in [
            ("rt_ScreenCoord", &screen[..]),
            ("rt_LensCoord", &sample.lens),
            ("rt_TimeSeed", &[sample.time]),
            ("rt_du", &[sample.pixel[0]]),
            ("rt_dv", &[sample.pixel[1]]),
            ("rt_Epsilon", &[epsilon]),
            ("rt_HitDistance", &[far]),
            ("rt_RayOrigin", &[zero; 3]),
            ("rt_RayDirection", &[zero, zero, one]),
            ("rt_InverseRayDirection", &[far, far, one]),
            ("rt_SampleColor", &[one; 3]),
        ] {
            set(&mut state, name, values);
        }
        let generated = self.generate(sample, state.clone(), to)?;
        state.extend(generated);
        let result = |name: &str, component| {
            let wanted = StateComponent::named(name, component);
            let value = wanted.and_then(|wanted| find_override(&state, wanted));
            value.expect("the state has this component")
        };
        let vector = |name: &str| [0, 1, 2].map(|component| result(name, component));
        Ok(CameraRay {
            origin: vector("rt_RayOrigin"),
            direction: vector("rt_RayDirection"),
            color: vector("rt_SampleColor"),
            epsilon: result("rt_Epsilon", 0),
            limit: result("rt_HitDistance", 0),
        })
    }

    /// Copies `generateRay`, and returns the state that it sets. Each copy takes the same random numbers.
    fn generate(
        &mut self,
        sample: &CameraSample,
        state: Vec<(StateComponent, Value)>,
        to: &mut Vec<Op>,
    ) -> Linking<Vec<(StateComponent, Value)>> {
        let CameraLinks { generate, sampler, .. } = self.links;
        let Some(method) = generate else { return Ok(Vec::new()) };
        if method.draws_numbers() {
            self.linker.begin_numbers(sample.key, *sampler, to)?;
        }
        let set = self.linker.light_method(CAMERA, method, state, to);
        self.linker.copied_numbers = None;
        set
    }

    /// Returns the width of a ray at its origin, and its increase per unit of length: the sides of squares of the area
    /// between the rays of the pixels beside and above, of the part of a pixel that the sample stands for.
    fn footprint(
        &mut self,
        sample: &CameraSample,
        ray: &CameraRay,
        to: &mut Vec<Op>,
    ) -> Linking<[Value; 2]> {
        let ends = self.ends(ray, to)?;
        let mut others = Vec::new();
        for axis in 0..2 {
            let mut screen = sample.screen;
            screen[axis] = self.code(to).add(screen[axis], sample.pixel[axis])?;
            let other = self.ray(sample, screen, to)?;
            others.push(self.ends(&other, to)?);
        }
        let links = self.links;
        let code = &mut self.code(to);
        let part = code.part_of_pixel(&links.sampler, sample.index)?;
        let mut side = |end: usize| {
            let points = [ends[end], others[0][end], others[1][end]];
            let operands = [points.as_flattened(), &[part]].concat();
            Ok(code.call("rt_footprintSide", &operands)?[0])
        };
        Ok([side(0)?, side(1)?])
    }

    /// The origin of a ray, and its direction at unit length.
    fn ends(&mut self, ray: &CameraRay, to: &mut Vec<Op>) -> Linking<[Vector; 2]> {
        let code = &mut self.code(to);
        let up = code.vector([0.0, 0.0, 1.0])?;
        Ok([ray.origin, code.normalized_or(ray.direction, up)?])
    }

    /// Stores a ray in the world.
    fn store(&mut self, sample: &CameraSample, ray: &CameraRay, to: &mut Vec<Op>) -> Linking<()> {
        let code = &mut self.code(to);
        let map = code.map(MAP)?;
        let origin = code.transformed_point(&map, ray.origin)?;
        let direction = code.transformed_vector(&map, ray.direction)?;
        // Hits behind the origin never count.
        let zero = code.float(0.0)?;
        let epsilon = code.larger(ray.epsilon, zero)?;
        let weights = match sample.weight {
            Some(weight) => code.scaled(ray.color, weight)?,
            None => ray.color,
        };
        for (name, values) in [
            ("rt_RayOrigin", &origin[..]),
            ("rt_RayDirection", &direction),
            ("rt_Epsilon", &[epsilon]),
            ("rt_HitDistance", &[ray.limit]),
            ("rt_TimeSeed", &[sample.time]),
        ] {
            self.linker.set_state(name, values);
        }
        self.linker.set_column(TIME_COLUMN.to_owned(), sample.time);
        self.linker.set_column(KEY_COLUMN.to_owned(), sample.key);
        for (name, weight) in WEIGHT_COLUMNS.into_iter().zip(weights) {
            self.linker.set_column(name.to_owned(), weight);
        }
        Ok(())
    }
}

impl StageLinker {
    /// Stores the components of a state variable at the end of the function.
    pub(crate) fn set_state(&mut self, name: &str, values: &[Value]) {
        let Some(state) = lookup_state(name) else { return };
        let variable = self.intern_variable(Variable {
            kind: VariableKind::State,
            name: name.to_owned(),
            scalar: Scalar::F32,
            len: state.ty.components(),
        });
        let outputs = (0..values.len() as u32).map(|component| Output { variable, component });
        self.out.outputs.extend(outputs);
        self.out.body.yields.extend_from_slice(values);
    }
}

impl Arithmetic<'_> {
    /// The width and the height of the image.
    fn size(&mut self) -> Linking<[Value; 2]> {
        let (kind, name) = (VariableKind::Member, SIZE.to_owned());
        let size = Variable { kind, name, scalar: Scalar::U32, len: 2 };
        Ok([self.load(size.clone(), 0)?, self.load(size, 1)?])
    }

    /// The place of a sample relative to its pixel's corner, and its weight, as [`PixelFilter::sample`].
    fn filtered(
        &mut self,
        filter: &PixelFilter,
        point: [Value; 2],
    ) -> Linking<([Value; 2], Option<Value>)> {
        let Some(tables) = filter.tables() else { return Ok((point, None)) };
        let mut places = point;
        let mut weight = None;
        for (axis, table) in tables.iter().enumerate() {
            let [distances, changes] = axis_tables(axis, table);
            let own = match changes.len {
                0 => self.float(table.magnitude())?,
                _ => {
                    let cells = self.integer(distances.len as i32 - 1)?;
                    let operands = [cells, self.float(table.magnitude())?, point[axis]];
                    let name = "rt_filterWeight";
                    self.linker.call_text_with(name, &operands, &[changes], self.to)?[0]
                }
            };
            weight = Some(match weight {
                Some(other) => self.multiply(other, own)?,
                None => own,
            });
            let (name, arrays) = ("rt_filteredPlace", [distances]);
            places[axis] = self.linker.call_text_with(name, &[point[axis]], &arrays, self.to)?[0];
        }
        Ok((places, weight))
    }
}

/// The members with the table of an axis: the distances, and the places at which the sign of weights changes.
fn axis_tables(axis: usize, table: &AxisTable) -> [Variable; 2] {
    let member = |(name, len): (&str, usize)| {
        let (kind, scalar) = (VariableKind::Member, Scalar::F32);
        Variable { kind, name: name.to_owned(), scalar, len: len as u32 }
    };
    let lens = [table.distances().len(), table.sign_changes().len()];
    let [distances, changes] = [0, 1].map(|part: usize| (FILTER[part][axis], lens[part]));
    [member(distances), member(changes)]
}
