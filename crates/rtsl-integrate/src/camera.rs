//! Cameras: `generateRay`, between the functions of `prelude/renderer/camera.rtsl`.

use std::sync::Arc;

use rtsl_ir::{Op, Output, Scalar, StateComponent, Value, Variable, VariableKind};
use rtsl_link::{Linked, LinkedMethod, Linker, Linking, find_override};
use rtsl_math::sampling::{PixelFilter, Sampler};
use rtsl_spec::lookup_state;

use crate::arithmetic::Arithmetic;
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

/// Links a function of this name that computes the ray of a pixel's sample, with its weight and the key of its numbers,
/// and the footprint if it `has_footprints`.
///
/// # Errors
/// If linking passes a limit.
pub fn link_camera(name: String, links: &CameraLinks, has_footprints: bool) -> Linking<Linked> {
    let mut linker = StageLinker::new(name);
    let sampler = Some(links.sampler);
    linker.surface = Some(Arc::new(SurfaceLinks { sampler, ..SurfaceLinks::default() }));
    let mut ops = Vec::new();
    let mut code = CameraCode { linker: &mut linker, links };
    let sample = code.sample(&mut ops)?;
    let ray = code.ray(&sample, sample.places[0], &mut ops)?;
    if has_footprints {
        code.add_footprint(&sample, &ray, &mut ops)?;
    }
    code.store(&sample, &ray, &mut ops)?;
    linker.out.body.ops = ops;
    Ok(linker.finish())
}

struct CameraCode<'a, 'l> {
    linker: &'l mut StageLinker,
    links: &'a CameraLinks,
}

/// The sample of a pixel.
struct CameraSample {
    /// Its places on the screen in the pixel, the one beside and the one above.
    places: [[Value; 2]; 3],
    /// The width and the height of a pixel.
    pixel: [Value; 2],
    lens: [Value; 2],
    time: Value,
    /// The weight of the pixel filter.
    weight: Value,
    /// The key of the path's random sequences.
    key: Value,
}

/// The state with which `generateRay` begins, besides that of the sample.
const INITIAL: [(&str, &[f32]); 5] = [
    ("rt_HitDistance", &[f32::INFINITY]),
    ("rt_RayOrigin", &[0.0; 3]),
    ("rt_RayDirection", &[0.0, 0.0, 1.0]),
    ("rt_InverseRayDirection", &[f32::INFINITY, f32::INFINITY, 1.0]),
    ("rt_SampleColor", &[1.0; 3]),
];

/// The state that `generateRay` sets, with the number of components: the fields of an `rt_CameraRay`, then the limit.
const RESULTS: [(&str, u32); 5] = [
    ("rt_RayOrigin", 3),
    ("rt_RayDirection", 3),
    ("rt_SampleColor", 3),
    ("rt_Epsilon", 1),
    ("rt_HitDistance", 1),
];

/// The number of scalars of an `rt_CameraRay`.
const RAY_SCALARS: usize = 10;

impl CameraCode<'_, '_> {
    fn code<'s>(&'s mut self, to: &'s mut Vec<Op>) -> Arithmetic<'s> {
        Arithmetic { linker: self.linker, to }
    }

    fn sample(&mut self, to: &mut Vec<Op>) -> Linking<CameraSample> {
        let CameraLinks { sampler, filter, .. } = self.links;
        let code = &mut self.code(to);
        let mut operands = code.sampler(sampler)?;
        operands.push(code.seed(sampler)?);
        for name in PIXEL_COLUMNS {
            operands.push(code.column(name, Scalar::U32)?);
        }
        let (kind, name) = (VariableKind::Member, SIZE.to_owned());
        let size = Variable { kind, name, scalar: Scalar::U32, len: 2 };
        operands.extend([code.load(size.clone(), 0)?, code.load(size, 1)?]);
        operands.push(code.column(SAMPLE_COLUMN, Scalar::U32)?);
        for axis in 0..2 {
            operands.push(code.float(filter.tables().map_or(1.0, |it| it[axis].magnitude()))?);
        }
        let name = "rt_cameraSample";
        let sample = self.linker.call_text_with(name, &operands, &filter_arrays(filter), to)?;
        let [x, y, beside, above, width, height, lens_x, lens_y, time, weight, key] = sample[..]
        else {
            unreachable!("an rt_CameraSample has these scalars")
        };
        Ok(CameraSample {
            places: [[x, y], [beside, y], [x, above]],
            pixel: [width, height],
            lens: [lens_x, lens_y],
            time,
            weight,
            key,
        })
    }

    /// Generates the ray of a sample through a place on the screen: an `rt_CameraRay`, then the limit.
    fn ray(
        &mut self,
        sample: &CameraSample,
        place: [Value; 2],
        to: &mut Vec<Op>,
    ) -> Linking<Vec<Value>> {
        let code = &mut self.code(to);
        let mut state = Vec::new();
        for (name, values) in INITIAL {
            let values = values.iter().map(|value| code.float(*value));
            set(&mut state, name, &values.collect::<Linking<Vec<Value>>>()?);
        }
        let epsilon = code.load_member(EPSILON, Scalar::F32)?;
        for (name, values) in [
            ("rt_ScreenCoord", &place[..]),
            ("rt_LensCoord", &sample.lens),
            ("rt_TimeSeed", &[sample.time]),
            ("rt_du", &sample.pixel[..1]),
            ("rt_dv", &sample.pixel[1..]),
            ("rt_Epsilon", &[epsilon]),
        ] {
            set(&mut state, name, values);
        }
        let generated = self.generate(sample, state.clone(), to)?;
        state.extend(generated);
        let result = |name: &str, component: u32| {
            let wanted = StateComponent::named(name, component);
            let value = wanted.and_then(|wanted| find_override(&state, wanted));
            value.expect("the state has this component")
        };
        let results = RESULTS
            .into_iter()
            .flat_map(|(name, components)| (0..components).map(move |component| (name, component)));
        Ok(results.map(|(name, component)| result(name, component)).collect())
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

    /// Stores the footprint of a ray, by the rays through the pixels beside and above.
    fn add_footprint(
        &mut self,
        sample: &CameraSample,
        ray: &[Value],
        to: &mut Vec<Op>,
    ) -> Linking<()> {
        let [_, beside, above] = sample.places;
        let others = [self.ray(sample, beside, to)?, self.ray(sample, above, to)?];
        let sampler = self.links.sampler;
        let code = &mut self.code(to);
        let mut operands = code.sampler(&sampler)?;
        operands.push(code.column(SAMPLE_COLUMN, Scalar::U32)?);
        for ray in [ray, &others[0], &others[1]] {
            operands.extend(&ray[..RAY_SCALARS]);
        }
        let footprint = code.call("rt_footprint", &operands)?;
        for (name, value) in FOOTPRINTS.into_iter().zip(footprint) {
            self.linker.set_state(name, &[value]);
        }
        Ok(())
    }

    /// Stores a ray in the world.
    fn store(&mut self, sample: &CameraSample, ray: &[Value], to: &mut Vec<Op>) -> Linking<()> {
        let code = &mut self.code(to);
        let (ray, limit) = ray.split_at(RAY_SCALARS);
        let operands = [code.map(MAP)?.as_flattened(), ray, &[sample.weight]].concat();
        let world = code.call("rt_cameraRayInWorld", &operands)?;
        for (name, values) in [
            ("rt_RayOrigin", &world[..3]),
            ("rt_RayDirection", &world[3..6]),
            ("rt_Epsilon", &world[9..]),
            ("rt_HitDistance", limit),
            ("rt_TimeSeed", &[sample.time]),
        ] {
            self.linker.set_state(name, values);
        }
        self.linker.set_column(TIME_COLUMN.to_owned(), sample.time);
        self.linker.set_column(KEY_COLUMN.to_owned(), sample.key);
        for (name, weight) in WEIGHT_COLUMNS.into_iter().zip(&world[6..9]) {
            self.linker.set_column(name.to_owned(), *weight);
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

/// The members with the tables of a filter: the distances along both axes, then the places at which the sign of weights
/// changes. They are empty without tables.
fn filter_arrays(filter: &PixelFilter) -> [Variable; 4] {
    let lens = filter.tables().map(|tables| {
        let lens = tables.each_ref().map(|it| [it.distances().len(), it.sign_changes().len()]);
        [lens[0][0], lens[1][0], lens[0][1], lens[1][1]]
    });
    let lens = lens.unwrap_or_default();
    std::array::from_fn(|index| Variable {
        kind: VariableKind::Member,
        name: FILTER.as_flattened()[index].to_owned(),
        scalar: Scalar::F32,
        len: lens[index] as u32,
    })
}
