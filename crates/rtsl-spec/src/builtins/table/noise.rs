//! Noise and patterns.

use crate::builtins::{Builtin, Chapter};

pub(super) static NOISE: &[Builtin] = &[
    function(
        "hash",
        &[
            "uint hash(uint x)",
            "uint hash(uint x, uint y)",
            "uint hash(uint x, uint y, uint z)",
            "uint hash(uint x, uint y, uint z, uint w)",
        ],
        "32 bits that look random and depend on every bit of the arguments and on their order.",
    ),
    function(
        "noise",
        &["float noise(genF p)", "float noise(genF p, genF period)"],
        "Gradient noise in [-1, 1], zero at integer points, with continuous second derivatives; \
         repeats along each axis after that many units where a period is given (rounded down, at \
         least 1).",
    ),
    function(
        "cellnoise",
        &["float cellnoise(genF p)", "float cellnoise(genF p, genF period)"],
        "A number in [0, 1) for each unit cell; repeats along each axis where a period is given.",
    ),
    function(
        "voronoi",
        &[
            "vec2 voronoi(vec p)",
            "vec2 voronoi(vec p, vec period)",
            "vec2 voronoi(vec p, out uint cell)",
            "vec2 voronoi(vec p, vec period, out uint cell)",
        ],
        "The distances from p to the nearest and the second nearest of random points, of which each \
         unit cell has one, among those of the cell of p and of the cells that touch it; cell is set to \
         a hash of the nearest one's. Repeats along each axis where a period is given.",
    ),
    function(
        "fbm",
        &[
            "float fbm(genF p)",
            "float fbm(genF p, int octaves)",
            "float fbm(genF p, int octaves, float lacunarity, float gain)",
        ],
        "A sum of octaves of noise, the first of amplitude 1: each has lacunarity (2) times the \
         frequency and gain (0.5) times the amplitude of the one before. 6 octaves unless told, \
         32 at most.",
    ),
    function(
        "turbulence",
        &[
            "float turbulence(genF p)",
            "float turbulence(genF p, int octaves)",
            "float turbulence(genF p, int octaves, float lacunarity, float gain)",
        ],
        "A sum of octaves of the magnitude of noise; the octaves are those of fbm.",
    ),
];

const fn function(
    name: &'static str,
    signatures: &'static [&'static str],
    doc: &'static str,
) -> Builtin {
    Builtin::prelude(Chapter::Noise, name, signatures, doc)
}
