//! Kernels of cameras: the rays of samples have the numbers of the sampler and the places of the pixel filter, with the
//! same bits on the interpreter and in machine code of every width.

use rtsl::host::NoHost;
use rtsl::{
    Backend, CallArguments, CameraProgram, CameraView, Compiler, Engine, EngineOptions, Instance,
    Instances, LaneBlock, lookup_state, new_state,
};
use rtsl_math::sampling::{AxisTable, FilterShape, PixelFilter, Sampler, SamplerKind, hash};

/// Neither a multiple of a width nor less than any.
const COUNT: usize = 37;
const SIZE: [u32; 2] = [40, 30];

/// The rays of a camera.
#[derive(Clone, Copy)]
struct CameraRays<'a> {
    /// The class of cameras.
    text: &'a str,
    sampler: Sampler,
    filter: &'a PixelFilter,
    /// The size of the picture.
    size: [u32; 2],
    /// The number of rays.
    count: usize,
}

/// A camera whose rays tell its inputs.
const PROBE: &str = "class Probe : rt_Camera;
void generateRay() {
    rt_RayOrigin = vec3(rt_ScreenCoord, rt_TimeSeed);
    rt_RayDirection = vec3(rt_LensCoord, rand());
}";

/// The bits of some columns of results.
type Columns = Vec<Vec<u32>>;

fn component(name: &str) -> usize {
    lookup_state(name).expect("the table has it").first_component as usize
}

/// Returns the rays: origin, direction, width, spread, then the weights and the keys.
fn rays(options: EngineOptions, wanted: CameraRays<'_>) -> Columns {
    let CameraRays { text, sampler, filter, size, count } = wanted;
    let (engine, _) = Engine::new(options).expect("there is such an engine");
    let unit = Compiler::default().compile("probe.rtsl", text).unit.expect("it compiles");
    let class = unit.classes().first().expect("it has a class");
    let camera = Instance::new(class, []).expect("it has no parameters");
    let program = CameraProgram::new(&engine.program(&camera), sampler, filter).unwrap();
    let kernel = engine.camera_kernel(&program).unwrap();
    let (mut state, mut scratch) =
        (new_state(count), LaneBlock::new(program.scratch_arrays(), count));
    for lane in 0..count {
        let pixel = [(lane as u32 * 7) % size[0], (lane as u32 * 11) % size[1]];
        for (array, place) in program.arrays().pixels.into_iter().zip(pixel) {
            scratch.words_mut(array)[lane] = place;
        }
        scratch.words_mut(program.arrays().sample)[lane] =
            lane as u32 % sampler.samples_per_pixel();
    }
    let map = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [0.0; 3]];
    let view = CameraView { size, map, epsilon: 0.25 };
    let block = program.block(&engine.program(&camera).block(&camera), &view);
    let status = kernel.get().call(CallArguments {
        state: &mut state,
        scratch: &mut scratch,
        count,
        mask: None,
        accepted: None,
        instances: Instances::One(&block),
        host: &mut NoHost,
    });
    assert!(!status.budget_exhausted);
    let vectors = ["rt_RayOrigin", "rt_RayDirection"].map(component);
    let vectors = vectors.into_iter().flat_map(|first| first..first + 3);
    let footprint = ["rt_RayWidth", "rt_RaySpread"].map(component);
    let of_state = vectors.chain(footprint).map(|it| state.words(it)[..count].to_vec());
    let of_scratch = program.arrays().weights.into_iter().chain([program.arrays().key]);
    of_state.chain(of_scratch.map(|it| scratch.words(it)[..count].to_vec())).collect()
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

/// Each digest is that of a column, with the bits that it always had.
#[test]
fn rays_have_the_numbers_of_the_sampler_and_the_places_of_the_filter() {
    let [first, ..] = samplers();
    let with_filters = filters().map(|filter| (first, filter));
    let mut all = String::new();
    for (sampler, filter) in
        samplers().map(|it| (it, PixelFilter::default())).into_iter().chain(with_filters)
    {
        let found = agreed_rays(PROBE, sampler, &filter);
        let columns = found.iter().enumerate().filter(|(column, _)| !(6..8).contains(column));
        let digests = columns.map(|(_, column)| column.iter().copied().fold(0, hash));
        all += &format!("{:08x?}\n", digests.collect::<Vec<u32>>());
    }
    expect_test::expect![[r#"
        [7783aef3, c82509ef, 964d452d, 4c6b4323, 539b2cdf, 65ae1b85, 1d10dc47, 1d10dc47, 1d10dc47, 707d9527]
        [162e21fc, c9929ad0, f94eb116, a8e8aaf2, ae51a7c7, c63acda4, 1d10dc47, 1d10dc47, 1d10dc47, 707d9527]
        [c1cb2a2a, a4abde18, cf4d78b3, dab49c44, a2b4dd18, b2e75296, 1d10dc47, 1d10dc47, 1d10dc47, 707d9527]
        [096d038b, 5ad2b624, a5e3362c, c09a0c55, 73f96321, f53f9be3, 1d10dc47, 1d10dc47, 1d10dc47, 707d9527]
        [223e725d, 0787909f, 8a087c6f, 93bff742, bd5bc887, c928e4db, 1d10dc47, 1d10dc47, 1d10dc47, 707d9527]
        [7783aef3, c82509ef, 964d452d, 4c6b4323, 539b2cdf, 65ae1b85, 1d10dc47, 1d10dc47, 1d10dc47, 707d9527]
        [a4a975a4, 6a81eda1, 964d452d, 4c6b4323, 539b2cdf, 65ae1b85, 1d10dc47, 1d10dc47, 1d10dc47, 707d9527]
        [cedc19f0, 9b8ac1f4, 964d452d, 4c6b4323, 539b2cdf, 65ae1b85, bdd712bd, bdd712bd, bdd712bd, 707d9527]
        [b6fef80c, b24aa26a, 964d452d, 4c6b4323, 539b2cdf, 65ae1b85, 9a72c69a, 9a72c69a, 9a72c69a, 707d9527]
    "#]]
    .assert_eq(&all);
}

/// Samples lie in cells of the tables of a filter, uniformly within each.
#[test]
fn filters_have_places_in_the_cells_of_their_tables() {
    let sampler = Sampler { kind: SamplerKind::Independent, columns: 64, rows: 64, seed: 3 };
    let samples = |filter: &PixelFilter| {
        let wanted = CameraRays { text: PROBE, sampler, filter, size: [1; 2], count: 4096 };
        let columns = rays(EngineOptions::default(), wanted);
        [0, 1, 8].map(|it| columns[it].iter().copied().map(f32::from_bits).collect::<Vec<f32>>())
    };
    let [x, y, _] = samples(&PixelFilter::default());
    for filter in &filters()[1..] {
        let tables = filter.tables().expect("they change places");
        let found = samples(filter);
        for lane in 0..4096 {
            // Rows count from the top.
            let place = |number: f32, table: &AxisTable| {
                let side = 2.0 * number - 1.0;
                let scaled = side.abs() * (table.distances().len() - 1) as f32;
                let cell = scaled as usize;
                let [near, far] = [cell, cell + 1].map(|it| table.distances()[it]);
                let distance = near + (scaled - cell as f32) * (far - near);
                let changes = table.sign_changes().iter().filter(|it| scaled > **it).count();
                let sign = if changes % 2 == 0 { 1.0 } else { -1.0 };
                (0.5 + distance.copysign(side), sign * table.magnitude())
            };
            let (x, along_x) = place(x[lane], &tables[0]);
            let (y, along_y) = place(1.0 - y[lane], &tables[1]);
            let expected = [x, 1.0 - y, along_x * along_y];
            assert_eq!(found.each_ref().map(|it| it[lane]), expected, "{filter:?}, {lane}");
        }
    }
}

/// Origins are a pixel apart, all rays have one direction.
#[test]
fn footprints_are_the_distances_to_the_rays_beside() {
    for sampler in samplers() {
        let found = agreed_rays(PROBE, sampler, &PixelFilter::default());
        let area = SIZE.map(|side| 1.0 / f64::from(side)).iter().product::<f64>();
        for (lane, footprint) in found[6].iter().zip(&found[7]).enumerate() {
            let count = match sampler.kind {
                SamplerKind::Stratified { .. } => sampler.samples_per_pixel(),
                _ => lane as u32 % sampler.samples_per_pixel() + 1,
            };
            let part = f64::from(count).sqrt().recip().max(0.125);
            let (width, spread) = (f32::from_bits(*footprint.0), f32::from_bits(*footprint.1));
            let expected = area.sqrt() * part;
            let error = (f64::from(width) / expected - 1.0).abs();
            assert!(error < 1e-4, "{sampler:?}: {width}, {expected}");
            assert_eq!(spread, 0.0, "the copies of a ray draw the same numbers");
        }
    }
}

/// Returns the rays of a camera, on which every engine agrees.
fn agreed_rays(text: &str, sampler: Sampler, filter: &PixelFilter) -> Columns {
    let wanted = CameraRays { text, sampler, filter, size: SIZE, count: COUNT };
    let mut all = engines().map(|options| rays(options, wanted));
    let first = all.next().expect("there is an interpreter");
    all.for_each(|other| assert_eq!(other, first, "{sampler:?}, {filter:?}"));
    first
}

#[test]
fn a_class_without_rays_has_those_of_its_state() {
    let [sampler, ..] = samplers();
    let found = agreed_rays("class Nothing : rt_Camera;", sampler, &PixelFilter::default());
    let directions: Vec<Vec<u32>> =
        [0.0, 0.0, 1.0_f32].map(|it| vec![it.to_bits(); COUNT]).to_vec();
    assert_eq!(found[3..6], directions);
}
