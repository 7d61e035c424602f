//! Elementary functions of vector libraries, where the machine has them: glibc's libmvec and SLEEF.
//!
//! They are loaded at run time, so that they are required neither to build nor to race.
#![allow(
    improper_ctypes_definitions,
    reason = "code that has AVX passes vectors in registers, as these libraries expect"
)]

use std::arch::x86_64::{__m256, _mm256_load_ps, _mm256_store_ps};
use std::sync::OnceLock;

use libloading::Library;

use crate::packet::{Packet, RAYS};

/// The number of floats of a call.
const LANES: usize = 8;

/// A function of the libraries.
#[derive(Clone, Copy, Debug)]
pub enum Function {
    /// Reads state array 0, writes 1.
    Exp,
    /// As [`Function::Exp`].
    Log,
    /// Reads state arrays 0 and 1, writes 2.
    Pow,
    /// Reads state array 0, writes 1 and scratch array 0.
    SinCos,
}

/// A library's function for eight floats.
#[derive(Clone, Copy, Debug)]
pub enum LibraryFunction {
    /// Of one argument.
    Unary(Unary),
    /// Of two.
    Binary(Binary),
    /// Sine and cosine by one call each.
    Apart(Unary, Unary),
    /// Sine and cosine by one call.
    Together(UnaryPair),
}

type Unary = unsafe extern "C" fn(__m256) -> __m256;
type Binary = unsafe extern "C" fn(__m256, __m256) -> __m256;
type UnaryPair = unsafe extern "C" fn(__m256) -> Pair;

/// Two vectors, as SLEEF returns them.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct Pair(__m256, __m256);

/// A library at one accuracy: its file and the names of its functions.
struct Names {
    contender: &'static str,
    file: &'static str,
    exp: Option<&'static str>,
    log: &'static str,
    pow: Option<&'static str>,
    sin_cos: SinCosNames,
}

enum SinCosNames {
    Apart(&'static str, &'static str),
    Together(&'static str),
}

/// SLEEF states its errors in tenths of a unit in the last place; libmvec's are below 4 units.
static LIBRARIES: [Names; 3] = [
    Names {
        contender: "mvec",
        file: "libmvec.so.1",
        exp: Some("_ZGVdN8v_expf"),
        log: "_ZGVdN8v_logf",
        pow: Some("_ZGVdN8vv_powf"),
        sin_cos: SinCosNames::Apart("_ZGVdN8v_sinf", "_ZGVdN8v_cosf"),
    },
    Names {
        contender: "sleef10",
        file: "libsleef.so.3",
        exp: Some("Sleef_expf8_u10avx2"),
        log: "Sleef_logf8_u10avx2",
        pow: Some("Sleef_powf8_u10avx2"),
        sin_cos: SinCosNames::Together("Sleef_sincosf8_u10avx2"),
    },
    Names {
        contender: "sleef35",
        file: "libsleef.so.3",
        exp: None,
        log: "Sleef_logf8_u35avx2",
        pow: None,
        sin_cos: SinCosNames::Together("Sleef_sincosf8_u35avx2"),
    },
];

/// Returns the forms of a function that this machine has, by the names of the contenders.
pub fn available(function: Function) -> impl Iterator<Item = (&'static str, LibraryFunction)> {
    static OPEN: OnceLock<Vec<(&'static Names, Library)>> = OnceLock::new();
    let open = OPEN.get_or_init(|| {
        // Safety: these libraries' initialisers do nothing that others could notice.
        let open = |names: &'static Names| Some((names, unsafe { Library::new(names.file) }.ok()?));
        LIBRARIES.iter().filter_map(open).collect()
    });
    open.iter().filter_map(move |(names, library)| {
        // Safety: the types are those of the functions of these names; the libraries are never closed.
        let found = unsafe { names.find(function, library) };
        Some((names.contender, found?))
    })
}

impl Names {
    /// # Safety
    /// The library is that of the names, and stays open as long as the function is called.
    unsafe fn find(&self, function: Function, library: &Library) -> Option<LibraryFunction> {
        // Safety: as promised by the caller.
        unsafe {
            Some(match function {
                Function::Exp => LibraryFunction::Unary(symbol(library, self.exp?)?),
                Function::Log => LibraryFunction::Unary(symbol(library, self.log)?),
                Function::Pow => LibraryFunction::Binary(symbol(library, self.pow?)?),
                Function::SinCos => match self.sin_cos {
                    SinCosNames::Apart(sin, cos) => {
                        LibraryFunction::Apart(symbol(library, sin)?, symbol(library, cos)?)
                    }
                    SinCosNames::Together(name) => {
                        LibraryFunction::Together(symbol(library, name)?)
                    }
                },
            })
        }
    }
}

/// # Safety
/// `T` is the type of the function of that name.
unsafe fn symbol<T: Copy>(library: &Library, name: &str) -> Option<T> {
    // Safety: as promised by the caller.
    unsafe { library.get::<T>(name).ok().map(|symbol| *symbol) }
}

impl LibraryFunction {
    /// Processes a packet.
    ///
    /// # Safety
    /// The packet has the function's arrays, aligned for vectors, and the processor has AVX2.
    #[target_feature(enable = "avx2,fma")]
    pub unsafe fn packet(self, packet: Packet) {
        for lane in (0..RAYS).step_by(LANES) {
            // Safety: as promised by the caller; the lanes are those of the packet.
            unsafe { self.chunk(packet.at(lane)) };
        }
    }

    /// Processes the first rays of the packet, as many as there are lanes.
    ///
    /// # Safety
    /// As for [`LibraryFunction::packet`].
    #[inline]
    #[target_feature(enable = "avx2,fma")]
    unsafe fn chunk(self, packet: Packet) {
        // Safety: as promised by the caller.
        unsafe {
            let x = _mm256_load_ps(packet.state(0));
            match self {
                LibraryFunction::Unary(function) => {
                    _mm256_store_ps(packet.state(1), function(x));
                }
                LibraryFunction::Binary(function) => {
                    let y = _mm256_load_ps(packet.state(1));
                    _mm256_store_ps(packet.state(2), function(x, y));
                }
                LibraryFunction::Apart(sin, cos) => {
                    _mm256_store_ps(packet.state(1), sin(x));
                    _mm256_store_ps(packet.scratch(0), cos(x));
                }
                LibraryFunction::Together(function) => {
                    let Pair(sine, cosine) = function(x);
                    _mm256_store_ps(packet.state(1), sine);
                    _mm256_store_ps(packet.scratch(0), cosine);
                }
            }
        }
    }
}
