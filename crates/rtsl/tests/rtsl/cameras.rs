//! Kernels of cameras: the rays of samples have the numbers of the sampler and the places of the pixel filter, with the
//! same bits on the interpreter and in machine code of every width.

use rtsl::host::NoHost;
use rtsl::{
    Backend, CallArguments, CameraProgram, CameraView, Compiler, Engine, EngineOptions, Instance,
    Instances, LaneBlock, lookup_state, new_state,
};
use rtsl_math::sampling::{FilterShape, PixelFilter, Sampler, SamplerKind};

/// Neither a multiple of a width nor less than any.
const COUNT: usize = 37;
const SIZE: [u32; 2] = [40, 30];

/// A camera whose rays tell its inputs.
const PROBE: &str = "class Probe : rt_Camera;
void generateRay() {
    rt_RayOrigin = vec3(rt_ScreenCoord, rt_TimeSeed);
    rt_RayDirection = vec3(rt_LensCoord, rand());
}";

/// The bits of some columns of results.
type Columns = Vec<Vec<u32>>;

fn pixel(lane: usize) -> [u32; 2] {
    [(lane as u32 * 7) % SIZE[0], (lane as u32 * 11) % SIZE[1]]
}

fn component(name: &str) -> usize {
    lookup_state(name).expect("the table has it").first_component as usize
}

/// Returns the rays of a camera: origin, direction, width, spread, then the weights and the keys.
fn rays(text: &str, options: EngineOptions, sampler: Sampler, filter: &PixelFilter) -> Columns {
    let (engine, _) = Engine::new(options).expect("there is such an engine");
    let unit = Compiler::default().compile("probe.rtsl", text).unit.expect("it compiles");
    let class = unit.classes().first().expect("it has a class");
    let camera = Instance::new(class, []).expect("it has no parameters");
    let program = CameraProgram::new(&engine.program(&camera), sampler, filter).unwrap();
    let kernel = engine.camera_kernel(&program).unwrap();
    let (mut state, mut scratch) =
        (new_state(COUNT), LaneBlock::new(program.scratch_arrays(), COUNT));
    for lane in 0..COUNT {
        for (array, place) in program.arrays().pixels.into_iter().zip(pixel(lane)) {
            scratch.words_mut(array)[lane] = place;
        }
        scratch.words_mut(program.arrays().sample)[lane] =
            lane as u32 % sampler.samples_per_pixel();
    }
    let map = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [0.0; 3]];
    let view = CameraView { size: SIZE, map, epsilon: 0.25 };
    let block = program.block(&engine.program(&camera).block(&camera), &view);
    let status = kernel.get().call(CallArguments {
        state: &mut state,
        scratch: &mut scratch,
        count: COUNT,
        mask: None,
        accepted: None,
        instances: Instances::One(&block),
        host: &mut NoHost,
    });
    assert!(!status.budget_exhausted);
    let vectors = ["rt_RayOrigin", "rt_RayDirection"].map(component);
    let vectors = vectors.into_iter().flat_map(|first| first..first + 3);
    let footprint = ["rt_RayWidth", "rt_RaySpread"].map(component);
    let of_state = vectors.chain(footprint).map(|it| state.words(it)[..COUNT].to_vec());
    let of_scratch = program.arrays().weights.into_iter().chain([program.arrays().key]);
    of_state.chain(of_scratch.map(|it| scratch.words(it)[..COUNT].to_vec())).collect()
}

fn engines() -> impl Iterator<Item = EngineOptions> {
    let interpreter =
        EngineOptions { backend: Backend::Interpreter, width: Some(1), ..EngineOptions::default() };
    let compiled = [1, 4, 8, 16].map(|width| EngineOptions {
        backend: Backend::Jit,
        width: Some(width),
        ..EngineOptions::default()
    });
    std::iter::once(interpreter).chain(compiled)
}

fn samplers() -> [Sampler; 5] {
    let sampler = |kind, columns| Sampler { kind, columns, rows: 4, seed: 7 };
    [
        sampler(SamplerKind::Independent, 4),
        sampler(SamplerKind::Sobol, 4),
        sampler(SamplerKind::Stratified { jitter: true }, 4),
        sampler(SamplerKind::Stratified { jitter: false }, 5),
        sampler(SamplerKind::Stratified { jitter: true }, 3),
    ]
}

fn filters() -> [PixelFilter; 4] {
    [
        PixelFilter::default(),
        PixelFilter::new(FilterShape::Gaussian { sigma: 0.5 }, [1.5, 1.25]),
        PixelFilter::new(FilterShape::Mitchell { b: 1.0 / 3.0, c: 1.0 / 3.0 }, [2.0, 1.5]),
        PixelFilter::new(FilterShape::Sinc { tau: 3.0 }, [4.0, 3.0]),
    ]
}

#[test]
fn rays_have_the_numbers_of_the_sampler_and_the_places_of_the_filter() {
    let [first, ..] = samplers();
    let with_filters = filters().map(|filter| (first, filter));
    for (sampler, filter) in
        samplers().map(|it| (it, PixelFilter::default())).into_iter().chain(with_filters)
    {
        let mut lanes: Vec<[u32; 12]> = Vec::new();
        let [du, dv] = SIZE.map(|side| 1.0 / side as f32);
        for lane in 0..COUNT {
            let ([column, row], sample) = (pixel(lane), lane as u32 % sampler.samples_per_pixel());
            let pixel = row * SIZE[0] + column;
            let keys = sampler.pixel_keys(pixel);
            let lens = sampler.lens_position(keys.lens, sample);
            let time = sampler.time(keys.time, sample);
            let ([x, y], weight) = filter.sample(sampler.pixel_position(keys.position, sample));
            let key = keys.stream;
            let drawn = sampler.number(key, 0, sample);
            let x = (column as f32 + x) * du;
            let y = ((SIZE[1] - 1 - row) as f32 + (1.0 - y)) * dv;
            let floats = [x, y, time, lens[0], lens[1], drawn];
            let mut words = [0; 12];
            words[..6].copy_from_slice(&floats.map(f32::to_bits));
            words[8..11].fill(weight.to_bits());
            words[11] = key;
            lanes.push(words);
        }
        for options in engines() {
            let found = rays(PROBE, options, sampler, &filter);
            for (column, found) in found.iter().enumerate().filter(|(it, _)| !(6..8).contains(it)) {
                let expected: Vec<u32> = lanes.iter().map(|words| words[column]).collect();
                assert_eq!(*found, expected, "{sampler:?}, {filter:?}, column {column}");
            }
        }
    }
}

/// Origins are a pixel apart, all rays have one direction.
#[test]
fn footprints_are_the_distances_to_the_rays_beside() {
    for sampler in samplers() {
        let found = agreed_rays(PROBE, sampler);
        let area = SIZE.map(|side| 1.0 / f64::from(side)).iter().product::<f64>();
        for (lane, footprint) in found[6].iter().zip(&found[7]).enumerate() {
            let part = sampler.part_of_pixel(lane as u32 % sampler.samples_per_pixel());
            let (width, spread) = (f32::from_bits(*footprint.0), f32::from_bits(*footprint.1));
            let expected = area.sqrt() * f64::from(part);
            let error = (f64::from(width) / expected - 1.0).abs();
            assert!(error < 1e-4, "{sampler:?}: {width}, {expected}");
            assert_eq!(spread, 0.0, "the copies of a ray draw the same numbers");
        }
    }
}

/// Returns the rays of a camera, on which every engine agrees.
fn agreed_rays(text: &str, sampler: Sampler) -> Columns {
    let filter = PixelFilter::default();
    let mut all = engines().map(|options| rays(text, options, sampler, &filter));
    let first = all.next().expect("there is an interpreter");
    all.for_each(|other| assert_eq!(other, first, "{sampler:?}"));
    first
}

#[test]
fn a_class_without_rays_has_those_of_its_state() {
    let [sampler, ..] = samplers();
    let found = agreed_rays("class Nothing : rt_Camera;", sampler);
    let directions: Vec<Vec<u32>> =
        [0.0, 0.0, 1.0_f32].map(|it| vec![it.to_bits(); COUNT]).to_vec();
    assert_eq!(found[3..6], directions);
}
