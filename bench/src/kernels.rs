//! The kernels of races and their arrays.
//!
//! State arrays are numbered in the order in which a race lays them out, a vector taking three; scratch arrays as the
//! RTSL class declares them; parameters as the race lists them.

/// A kernel with the sizes of its hand-written code's memory.
pub trait Kernel {
    /// The number of state arrays.
    const STATE: usize;
    /// The number of scratch arrays.
    const SCRATCH: usize;
    /// The number of words of parameters.
    const PARAMETERS: usize;
}

macro_rules! kernels {
    ($($(#[$doc:meta])* $name:ident: $state:literal, $scratch:literal, $parameters:literal;)*) => {
        $($(#[$doc])*
        #[derive(Clone, Copy, Debug)]
        pub struct $name;

        impl Kernel for $name {
            const STATE: usize = $state;
            const SCRATCH: usize = $scratch;
            const PARAMETERS: usize = $parameters;
        })*
    };
}

kernels! {
    /// A sphere, directions of any length. State: 0 origin, 3 direction, 6 distance. Scratch: 0 number
    /// of the object. Parameters: 0 centre, 3 radius, 4 least distance, 5 number.
    Sphere: 7, 1, 6;
    /// A sphere, directions of unit length; arrays as for [`Sphere`].
    UnitSphere: 7, 1, 6;
    /// A sphere, directions of unit length from one origin; arrays as for [`Sphere`], parameter 6 is
    /// the origin.
    CommonOriginSphere: 7, 1, 9;
    /// A triangle. State as for [`Sphere`]. Scratch: 0 number of the object, 1 and 2 weights of corners.
    /// Parameters: 0 corner, 3 and 6 edges, 9 tolerance and least distance, 10 number.
    Triangle: 7, 3, 11;
    /// A torus found by steps of the distance to it. State and scratch as for [`Sphere`]. Parameters: 0 and
    /// 1 radii, 2 tolerance, 3 number.
    Torus: 7, 1, 4;
    /// A torus as the zeros of a quartic. State: 0 origin, 3 direction, 6 distance. Parameters: 0 and 1
    /// radii, 2 least distance.
    QuarticTorus: 7, 0, 3;
    /// Ward's highlight. State: 0 ray direction, 3 light direction, 6 normal, 9 and 12 tangents, 15 value.
    /// Parameters: 0 and 1 widths, 2 diffuse and 5 specular colour.
    Ward: 18, 0, 8;
    /// A sample of GGX's visible normals. State: 0 ray direction, 3 normal, 6 and 9 tangents, 12 seed,
    /// 15 light direction, 18 value, 21 density. Parameters: 0 widths, 2 reflectance.
    Ggx: 22, 0, 5;
    /// Glass. State: 0 ray direction, 3 normal, 6 distance, 7 reflected direction, 10 transmittance, 13
    /// reflectance. Scratch: 0 refracted direction. Parameters: 0 index of refraction, 1 absorption.
    Dielectric: 14, 3, 4;
    /// Six octaves of noise, the lattice hashed. State: 0 point, 3 value.
    HashedFbm: 4, 0, 0;
    /// Six octaves of noise, the lattice a table's. State: 0 point, 3 value. Parameters: the
    /// table, 0 to 255 in some order, twice.
    TableFbm: 4, 0, 512;
    /// A camera with a thin lens. State: 0 screen and 2 lens coordinates, 4 origin, 7 direction. Parameters: 0
    /// eye, 3, 6 and 9 axes, 12 extent, 14 size of a pixel, 16 radius of the lens, 17 distance of focus.
    Lens: 10, 0, 18;
    /// The exponential. State: 0 argument, 1 result.
    Exp: 2, 0, 0;
    /// The natural logarithm. State: 0 argument, 1 result.
    Log: 2, 0, 0;
    /// Powers. State: 0 base, 1 exponent, 2 result.
    Pow: 3, 0, 0;
    /// Sine and cosine. State: 0 argument, 1 sine. Scratch: 0 cosine.
    SinCos: 2, 1, 0;
    /// The inverse of the square root. State: 0 argument, 1 result.
    InverseSqrt: 2, 0, 0;
}
