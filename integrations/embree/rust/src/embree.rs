//! The part of Embree's C interface that this program needs, for Embree 3 and 4, loaded when the program runs.

use std::ffi::{CStr, c_char, c_int, c_void};
use std::mem::ManuallyDrop;

use anyhow::{Context, Result, bail};
use libloading::{Library, Symbol};

/// Opaque objects of Embree.
pub type Handle = *mut c_void;

/// A box; the fourth numbers are not used.
#[repr(C, align(16))]
#[derive(Default)]
pub struct Bounds {
    /// The least corner.
    pub lower: [f32; 4],
    /// The greatest corner.
    pub upper: [f32; 4],
}

/// The arguments of a callback for bounds.
#[repr(C)]
pub struct BoundsArguments {
    /// The geometry's user data.
    pub user: *const c_void,
    /// The index of the primitive.
    pub primitive: u32,
    time_step: u32,
    /// The box to write.
    pub bounds: *mut Bounds,
}

/// The arguments of a callback for closest or any hits.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct HitArguments {
    /// 0 or -1 for each ray.
    pub valid: *const i32,
    /// The geometry's user data.
    pub user: *const c_void,
    /// The index of the primitive.
    pub primitive: u32,
    /// Its type differs between the versions: see [`Embree::instance_offset`].
    pub context: *const c_void,
    /// The rays, row after row.
    pub rays: *mut f32,
    /// The number of rays.
    pub count: u32,
    /// The geometry's number.
    pub geometry: u32,
}

/// A callback for bounds.
pub type BoundsFunction = unsafe extern "C" fn(*const BoundsArguments);
/// A callback for hits.
pub type HitFunction = unsafe extern "C" fn(*const HitArguments);

/// The context of `rtcIntersect` and `rtcOccluded` in Embree 3.
#[repr(C)]
pub struct Context3 {
    flags: u32,
    filter: *const c_void,
    instance: u32,
    unused: [u32; 8],
}

impl Context3 {
    /// For rays that go about the same way.
    pub fn coherent() -> Context3 {
        let instance = u32::MAX;
        Context3 { flags: 1, filter: std::ptr::null(), instance, unused: [0; 8] }
    }
}

/// The same of Embree 4, which makes a context itself where there is none.
#[repr(C)]
pub struct Arguments4 {
    flags: u32,
    features: u32,
    pointers: [*const c_void; 3],
    unused: [u32; 8],
}

impl Arguments4 {
    /// For rays that go about the same way.
    pub fn coherent() -> Arguments4 {
        let pointers = [std::ptr::null(); 3];
        Arguments4 { flags: 1 << 16, features: u32::MAX, pointers, unused: [0; 8] }
    }
}

/// `rtcIntersect` or `rtcOccluded` for 4, 8 and 16 rays, and for one.
#[derive(Clone, Copy)]
pub enum Queries {
    /// Of Embree 3.
    Three {
        /// For one ray.
        one: unsafe extern "C" fn(Handle, *mut Context3, *mut f32),
        /// For 4, 8, 16.
        packets: [unsafe extern "C" fn(*const i32, Handle, *mut Context3, *mut f32); 3],
    },
    /// Of Embree 4.
    Four {
        /// For one ray.
        one: unsafe extern "C" fn(Handle, *mut f32, *mut Arguments4),
        /// For 4, 8, 16.
        packets: [unsafe extern "C" fn(*const i32, Handle, *mut f32, *mut Arguments4); 3],
    },
}

/// Declares the functions whose names and types are the same in both versions.
macro_rules! functions {
    ($($(#[$doc:meta])* $field:ident = $name:literal: fn($($argument:ty),*) $(-> $result:ty)?;)*) => {
        /// Embree, loaded.
        #[allow(clippy::type_complexity, reason = "they are as C has them")]
        pub struct Embree {
            $($(#[$doc])* pub $field: unsafe extern "C" fn($($argument),*) $(-> $result)?,)*
            /// 3 or 4.
            pub version: u32,
            /// Finds nearest hits.
            pub intersect: Queries,
            /// Finds whether there are hits.
            pub occluded: Queries,
            /// Never unloaded, since its threads may be at work until the process ends.
            _library: ManuallyDrop<Library>,
        }

        impl Embree {
            /// The functions of a library.
            fn of_library(library: Library) -> Result<Embree> {
                // Safety: both versions have functions of these names and types.
                unsafe {
                    $(let $field = *library.get::<unsafe extern "C" fn($($argument),*) $(-> $result)?>($name)
                        .context("this is no Embree")?;)*
                    let version = find_version(&library)?;
                    let intersect = queries(&library, "rtcIntersect", version)?;
                    let occluded = queries(&library, "rtcOccluded", version)?;
                    Ok(Embree { $($field,)* version, intersect, occluded, _library: ManuallyDrop::new(library) })
                }
            }
        }
    };
}

functions! {
    /// Makes a device.
    new_device = "rtcNewDevice": fn(*const c_char) -> Handle;
    /// Releases it.
    release_device = "rtcReleaseDevice": fn(Handle);
    /// Makes a scene.
    new_scene = "rtcNewScene": fn(Handle) -> Handle;
    /// Builds it.
    commit_scene = "rtcCommitScene": fn(Handle);
    /// Releases it.
    release_scene = "rtcReleaseScene": fn(Handle);
    /// The box around it.
    scene_bounds = "rtcGetSceneBounds": fn(Handle, *mut Bounds);
    /// Makes a geometry.
    new_geometry = "rtcNewGeometry": fn(Handle, c_int) -> Handle;
    /// Sets the number of primitives.
    set_primitive_count = "rtcSetGeometryUserPrimitiveCount": fn(Handle, u32);
    /// Sets the pointer that callbacks receive.
    set_user_data = "rtcSetGeometryUserData": fn(Handle, *const c_void);
    /// Sets the callback for bounds of primitives.
    set_bounds = "rtcSetGeometryBoundsFunction": fn(Handle, BoundsFunction, *const c_void);
    /// Sets the callback for closest hits.
    set_intersect = "rtcSetGeometryIntersectFunction": fn(Handle, HitFunction);
    /// Sets the callback for any hits.
    set_occluded = "rtcSetGeometryOccludedFunction": fn(Handle, HitFunction);
    /// Says that it is complete.
    commit_geometry = "rtcCommitGeometry": fn(Handle);
    /// Gives it to a scene.
    attach_geometry = "rtcAttachGeometry": fn(Handle, Handle) -> u32;
    /// Releases it.
    release_geometry = "rtcReleaseGeometry": fn(Handle);
}

const NAMES: [&str; 6] = [
    "libembree4.so.4",
    "libembree4.so",
    "libembree3.so.3",
    "libembree3.so",
    "libembree4.dylib",
    "libembree3.dylib",
];

impl Embree {
    /// The type of user geometries.
    pub const USER_GEOMETRY: c_int = 120;

    /// Loads the library that the environment variable `EMBREE` names, else the newest that there is.
    ///
    /// # Errors
    /// If there is none, or it is no Embree 3 or 4.
    pub fn load() -> Result<Embree> {
        if let Some(named) = std::env::var_os("EMBREE") {
            // Safety: Embree's library runs nothing when it is loaded that could do harm.
            let library = unsafe { Library::new(&named) };
            return Embree::of_library(
                library.context("EMBREE names a library that can't be loaded")?,
            );
        }
        // Safety: as above.
        let mut libraries = NAMES.iter().filter_map(|name| unsafe { Library::new(*name) }.ok());
        let Some(library) = libraries.next() else {
            bail!(
                "Embree was not found. Tried {}.\n  help: install it (Debian, Ubuntu: apt install libembree3-3 or \
                 libembree4-4), or name the library with the environment variable EMBREE",
                NAMES.join(", ")
            );
        };
        Embree::of_library(library)
    }

    /// The offset of the instance's id in a callback's context, in bytes.
    pub fn instance_offset(version: u32) -> u32 {
        // In Embree 3 flags and a filter function stand before it.
        if version == 3 { 16 } else { 0 }
    }
}

/// 3 or 4.
///
/// # Safety
/// The library is Embree.
unsafe fn find_version(library: &Library) -> Result<u32> {
    const MAJOR_VERSION: c_int = 1;
    const CONFIGURATION: &CStr = c"threads=1";
    // Safety: the caller's promise.
    let version = unsafe {
        let new_device: Symbol<unsafe extern "C" fn(*const c_char) -> Handle> =
            library.get("rtcNewDevice")?;
        let release_device: Symbol<unsafe extern "C" fn(Handle)> =
            library.get("rtcReleaseDevice")?;
        let property: Symbol<unsafe extern "C" fn(Handle, c_int) -> isize> =
            library.get("rtcGetDeviceProperty")?;
        let device = new_device(CONFIGURATION.as_ptr());
        if device.is_null() {
            bail!("Embree does not work on this machine");
        }
        let version = property(device, MAJOR_VERSION);
        release_device(device);
        version
    };
    match version {
        3 | 4 => Ok(version as u32),
        other => bail!("this Embree is version {other}; versions 3 and 4 are known here"),
    }
}

/// The functions for queries of a kind.
///
/// # Safety
/// The library is Embree of this version.
unsafe fn queries(library: &Library, name: &str, version: u32) -> Result<Queries> {
    let [one, four, eight, sixteen] = ["1", "4", "8", "16"].map(|count| format!("{name}{count}"));
    // Safety: the caller's promise.
    unsafe {
        Ok(match version {
            3 => Queries::Three {
                one: *library.get(one.as_str())?,
                packets: [
                    *library.get(four.as_str())?,
                    *library.get(eight.as_str())?,
                    *library.get(sixteen.as_str())?,
                ],
            },
            _ => Queries::Four {
                one: *library.get(one.as_str())?,
                packets: [
                    *library.get(four.as_str())?,
                    *library.get(eight.as_str())?,
                    *library.get(sixteen.as_str())?,
                ],
            },
        })
    }
}
