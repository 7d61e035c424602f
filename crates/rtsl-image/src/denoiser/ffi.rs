//! Bindings to the functions of Open Image Denoise in use: those that are the same in versions 1 and 2, and two whose
//! names changed.

use std::ffi::{c_char, c_int, c_void};

use libloading::Library;

/// `OIDNDevice`
#[repr(C)]
pub struct DeviceHandle {
    _opaque: [u8; 0],
}

/// `OIDNFilter`
#[repr(C)]
pub struct FilterHandle {
    _opaque: [u8; 0],
}

/// `OIDN_DEVICE_TYPE_CPU`
pub const CPU_DEVICE: c_int = 1;
/// `OIDN_FORMAT_FLOAT3`
pub const FLOAT3: c_int = 3;

/// Sets an image of a filter: its name, pixels, format, columns, rows, the offset in bytes, and the strides from pixel
/// to pixel and from row to row, where 0 means no gaps.
type SetImage = unsafe extern "C" fn(
    *mut FilterHandle,
    *const c_char,
    *mut c_void,
    c_int,
    usize,
    usize,
    usize,
    usize,
    usize,
);

/// Pointers to the functions.
pub struct Api {
    pub new_device: unsafe extern "C" fn(c_int) -> *mut DeviceHandle,
    pub commit_device: unsafe extern "C" fn(*mut DeviceHandle),
    pub release_device: unsafe extern "C" fn(*mut DeviceHandle),
    pub device_int: unsafe extern "C" fn(*mut DeviceHandle, *const c_char) -> c_int,
    pub device_error: unsafe extern "C" fn(*mut DeviceHandle, *mut *const c_char) -> c_int,
    pub new_filter: unsafe extern "C" fn(*mut DeviceHandle, *const c_char) -> *mut FilterHandle,
    pub set_image: SetImage,
    pub set_bool: unsafe extern "C" fn(*mut FilterHandle, *const c_char, bool),
    pub commit_filter: unsafe extern "C" fn(*mut FilterHandle),
    pub execute_filter: unsafe extern "C" fn(*mut FilterHandle),
    pub release_filter: unsafe extern "C" fn(*mut FilterHandle),
}

impl Api {
    /// Looks up all functions; the error is the name of the first missing one.
    pub fn resolve(library: &Library) -> Result<Api, &'static str> {
        // Safety: the types are those of the library's headers for these names, and the library is never unloaded once
        // all are found.
        unsafe {
            Ok(Api {
                new_device: find(library, &["oidnNewDevice"])?,
                commit_device: find(library, &["oidnCommitDevice"])?,
                release_device: find(library, &["oidnReleaseDevice"])?,
                device_int: find(library, &["oidnGetDeviceInt", "oidnGetDevice1i"])?,
                device_error: find(library, &["oidnGetDeviceError"])?,
                new_filter: find(library, &["oidnNewFilter"])?,
                set_image: find(library, &["oidnSetSharedFilterImage"])?,
                set_bool: find(library, &["oidnSetFilterBool", "oidnSetFilter1b"])?,
                commit_filter: find(library, &["oidnCommitFilter"])?,
                execute_filter: find(library, &["oidnExecuteFilter"])?,
                release_filter: find(library, &["oidnReleaseFilter"])?,
            })
        }
    }
}

/// Returns the first function of these names.
///
/// # Safety
/// Each must have the type `T`, and the library must stay loaded.
unsafe fn find<T: Copy>(library: &Library, names: &[&'static str]) -> Result<T, &'static str> {
    names
        .iter()
        // Safety: guaranteed by the caller.
        .find_map(|name| unsafe { library.get::<T>(name.as_bytes()) }.ok())
        .map(|function| *function)
        .ok_or(names[0])
}
