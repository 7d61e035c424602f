//! The text of samplers, `prelude/renderer/sampler.rtsl`, as hosts call it.

mod convergence;
mod sobol;
mod strata;

use rtsl::{Backend, Constant, Engine, EngineOptions, LaneBlock, RendererFunction};
use rtsl_integrate::sampler::{NUMBER, PAIR, sampler_constants};
use rtsl_math::sampling::{Sampler, SamplerKind, hash, unit_float};

const STRATIFIED: SamplerKind = SamplerKind::Stratified { jitter: true };

fn engine(backend: Backend) -> Engine {
    Engine::new(EngineOptions { backend, ..EngineOptions::default() }).expect("an engine").0
}

/// Makes a kernel of a function of the text, for known values of its first parameters.
fn function(name: &str, known: &[Constant]) -> RendererFunction {
    engine(Backend::Auto).renderer_function(name, known).expect("there is a kernel")
}

/// Calls a function for lanes with these arguments, one array each, and returns the arrays of its results.
fn call(function: &RendererFunction, arguments: &[Vec<u32>]) -> Vec<Vec<u32>> {
    let count = arguments[0].len();
    let mut arrays = LaneBlock::new(function.arrays(), count);
    for (array, words) in arguments.iter().enumerate() {
        arrays.words_mut(array)[..count].copy_from_slice(words);
    }
    function.call(&mut arrays, count, None);
    (arguments.len()..function.arrays()).map(|it| arrays.words(it)[..count].to_vec()).collect()
}

/// Returns as many equal words.
fn equal(word: u32, count: u32) -> Vec<u32> {
    vec![word; count as usize]
}

fn hashes(key: u32, count: u32) -> Vec<u32> {
    (0..count).map(|index| hash(key, index)).collect()
}

fn floats(words: &[u32]) -> Vec<f32> {
    words.iter().copied().map(f32::from_bits).collect()
}

/// Returns the keys of the streams of so many pixels, with 1 as the seed.
fn stream_keys(pixels: u32) -> Vec<u32> {
    let pixels: Vec<u32> = (0..pixels).collect();
    call(&function("rt_pixelKeys", &[Constant::U32(hash(0, 1))]), &[pixels]).swap_remove(3)
}

/// Hosts derive keys, and take numbers for which no distribution matters, by functions of their own.
#[test]
fn hosts_hash_as_the_text_does() {
    let (a, b) = (hashes(1, 100), hashes(2, 100));
    let expected: Vec<u32> = a.iter().zip(&b).map(|(a, b)| hash(*a, *b)).collect();
    assert_eq!(call(&function("rt_hash", &[]), &[a.clone(), b]), [expected]);
    let expected: Vec<u32> = a.iter().map(|bits| unit_float(*bits).to_bits()).collect();
    assert_eq!(call(&function("rt_unitNumber", &[]), &[a]), [expected]);
}

/// Pictures that were made in parts, or on other machines, fit together.
#[test]
fn numbers_have_the_bits_that_they_always_had() {
    const COUNT: u32 = 200;
    let sampler = |kind, columns| Sampler { kind, columns, rows: 4, seed: 7 };
    let samplers = [
        sampler(SamplerKind::Independent, 4),
        sampler(SamplerKind::Sobol, 4),
        sampler(STRATIFIED, 4),
        sampler(SamplerKind::Stratified { jitter: false }, 8),
        sampler(STRATIFIED, 5),
        Sampler { columns: 1, rows: 1, ..sampler(STRATIFIED, 1) },
    ];
    for backend in [Backend::Auto, Backend::Interpreter] {
        let engine = engine(backend);
        let mut found = String::new();
        for sampler in samplers {
            let known = sampler_constants(&sampler);
            let keys = hashes(1, COUNT);
            let dimensions: Vec<u32> = (0..COUNT).map(|index| index % 9).collect();
            let count = sampler.samples_per_pixel();
            let samples: Vec<u32> = hashes(2, COUNT).iter().map(|it| it % count).collect();
            let of_stream = [keys.clone(), dimensions, samples.clone()];
            found += &format!("{sampler:?}\n");
            for (name, arguments) in [
                (NUMBER, &of_stream[..]),
                (PAIR, &of_stream[..]),
                ("rt_pixelPosition", &[keys.clone(), samples.clone()]),
                ("rt_lensPosition", &[keys.clone(), samples.clone()]),
                ("rt_number", &[keys, samples.clone()]),
                ("rt_partOfPixel", &[samples]),
            ] {
                let function = engine.renderer_function(name, &known).expect("there is a kernel");
                let words = call(&function, arguments).into_iter().flatten();
                let digest = words.clone().fold(0, hash);
                let first: Vec<u32> = words.take(3).collect();
                found += &format!("{name} {first:08x?} {digest:08x}\n");
            }
        }
        expect_test::expect_file!["golden.txt"].assert_eq(&found);
    }
}
