//! Open Image Denoise, loaded at run time if it is installed: versions 1 and 2 through their C interface.
//!
//! Only the CPU device is used, even if the library supports GPUs: memory is then shared, and a machine reproduces the
//! same picture. The result depends on the library and may differ between machines.

mod ffi;
mod search;

use std::ffi::{CStr, c_char, c_void};
use std::path::{Path, PathBuf};

use libloading::Library;

use ffi::{Api, CPU_DEVICE, DeviceHandle, FLOAT3, FilterHandle};

/// The library with its functions.
pub struct Denoiser {
    api: Api,
    path: PathBuf,
    version: (u32, u32),
}

/// The input of the denoiser: images of one size, row by row.
#[derive(Clone, Copy, Debug)]
pub struct DenoiserInput<'a> {
    /// Columns.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// Linear colours, with unlimited range.
    pub color: &'a [[f32; 3]],
    /// The albedo of the visible surface, from 0 to 1.
    pub albedo: Option<&'a [[f32; 3]]>,
    /// The normal of the visible surface; used only together with the albedo, as the library requires.
    pub normal: Option<&'a [[f32; 3]]>,
}

/// An error of denoising.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum DenoiserError {
    /// No library is installed in the places searched.
    #[error("Open Image Denoise is not installed")]
    Missing,
    /// A library was found but cannot be used.
    #[error("`{}` cannot be used as Open Image Denoise: {reason}", path.display())]
    Unusable {
        /// The library.
        path: PathBuf,
        /// The reason.
        reason: String,
    },
    /// An image has the wrong number of pixels.
    #[error("{what} has {found} pixels, expected {expected}")]
    Size {
        /// The name of the image.
        what: &'static str,
        /// The number of its pixels.
        found: usize,
        /// The expected number.
        expected: usize,
    },
    /// The library reported an error.
    #[error("Open Image Denoise: {0}")]
    Failed(String),
}

impl Denoiser {
    /// Loads the library that `RTSL_OIDN` names, as a file or a folder, or else the system's library.
    ///
    /// # Errors
    /// If none is found or usable; the error is that of the first candidate that exists.
    pub fn load() -> Result<Self, DenoiserError> {
        let mut first_error = None;
        for candidate in search::candidates() {
            match Denoiser::open(&candidate.path) {
                Ok(denoiser) => return Ok(denoiser),
                // A name that the system does not find is not an error yet.
                Err(error) if candidate.was_named || candidate.path.exists() => {
                    first_error.get_or_insert(error);
                }
                Err(_) => {}
            }
        }
        Err(first_error.unwrap_or(DenoiserError::Missing))
    }

    /// Loads one library.
    ///
    /// # Errors
    /// If it cannot be loaded, or is not Open Image Denoise.
    pub fn open(path: &Path) -> Result<Self, DenoiserError> {
        let unusable = |reason: String| DenoiserError::Unusable { path: path.to_owned(), reason };
        // Safety: loading runs the library's initialisers. The user installed the library as Open Image Denoise, or
        // named it; this is the trust that every dynamic library requires.
        let library = unsafe { Library::new(path) }.map_err(|error| unusable(error.to_string()))?;
        let api = Api::resolve(&library)
            .map_err(|name| unusable(format!("it has no function `{name}`")))?;
        // The threads of the library may outlive any use.
        std::mem::forget(library);
        let version = Device::new(&api).map_err(|error| unusable(error.to_string()))?.version();
        Ok(Denoiser { api, path: path.to_owned(), version })
    }

    /// Returns the library's path, or the name by which the system found it.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Returns the library's version, major and minor.
    pub fn version(&self) -> (u32, u32) {
        self.version
    }

    /// Returns the denoised image. Albedo and normals are denoised first, because depth of field and motion blur make
    /// them noisy too.
    ///
    /// # Errors
    /// If sizes differ, or the library has not enough memory.
    pub fn denoise(&self, input: &DenoiserInput<'_>) -> Result<Vec<[f32; 3]>, DenoiserError> {
        input.check()?;
        if input.color.is_empty() {
            return Ok(Vec::new());
        }
        let device = Device::new(&self.api)?;
        let size = (input.width, input.height);
        let run =
            |images: &[(&CStr, &[[f32; 3]])], flags: &[&CStr]| device.filter(size, images, flags);
        let albedo = input.albedo.map(|albedo| run(&[(c"albedo", albedo)], &[])).transpose()?;
        let normal = match &albedo {
            Some(_) => input.normal.map(|normal| run(&[(c"normal", normal)], &[])).transpose()?,
            None => None,
        };
        let mut images = vec![(c"color", input.color)];
        images.extend(albedo.as_deref().map(|albedo| (c"albedo", albedo)));
        images.extend(normal.as_deref().map(|normal| (c"normal", normal)));
        let flags: &[&CStr] = if albedo.is_some() { &[c"hdr", c"cleanAux"] } else { &[c"hdr"] };
        run(&images, flags)
    }
}

impl DenoiserInput<'_> {
    fn check(&self) -> Result<(), DenoiserError> {
        let expected = self.width.saturating_mul(self.height);
        let images = [
            ("the picture", Some(self.color)),
            ("the albedo", self.albedo),
            ("the normal", self.normal),
        ];
        for (what, image) in images {
            match image {
                Some(image) if image.len() != expected => {
                    return Err(DenoiserError::Size { what, found: image.len(), expected });
                }
                Some(_) | None => {}
            }
        }
        Ok(())
    }
}

/// A device, released at its end.
struct Device<'a> {
    api: &'a Api,
    handle: *mut DeviceHandle,
}

impl<'a> Device<'a> {
    fn new(api: &'a Api) -> Result<Self, DenoiserError> {
        // Safety: the function accepts any type of device, and returns null if it is not supported.
        let handle = unsafe { (api.new_device)(CPU_DEVICE) };
        let device = Device { api, handle };
        if handle.is_null() {
            device.check()?;
            return Err(DenoiserError::Failed("it does not support this processor".to_owned()));
        }
        // Safety: the handle refers to a device.
        unsafe { (api.commit_device)(handle) };
        device.check()?;
        Ok(device)
    }

    fn version(&self) -> (u32, u32) {
        // Safety: the handle refers to a device, and every device has this property.
        let number = unsafe { (self.api.device_int)(self.handle, c"version".as_ptr()) };
        let number = u32::try_from(number).unwrap_or(0);
        (number / 10_000, number / 100 % 100)
    }

    /// Runs a filter over images of one size.
    fn filter(
        &self,
        (width, height): (usize, usize),
        images: &[(&CStr, &[[f32; 3]])],
        flags: &[&CStr],
    ) -> Result<Vec<[f32; 3]>, DenoiserError> {
        let pixels = width.saturating_mul(height);
        let mut output = Vec::new();
        output.try_reserve_exact(pixels).map_err(|_| {
            DenoiserError::Failed(format!("there is no memory for {pixels} pixels"))
        })?;
        output.resize(pixels, [0.0; 3]);
        let filter = Filter::new(self)?;
        let set = |name: &CStr, pixels: *mut c_void| {
            // Safety: the pixels are `width` times `height` triples of floats without gaps, as the caller checked, and
            // live until the filter is released. The library writes to the image `output` alone, which is exclusive.
            unsafe {
                (self.api.set_image)(
                    filter.handle,
                    name.as_ptr(),
                    pixels,
                    FLOAT3,
                    width,
                    height,
                    0,
                    0,
                    0,
                );
            }
        };
        for (name, pixels) in images {
            set(name, pixels.as_ptr().cast_mut().cast());
        }
        set(c"output", output.as_mut_ptr().cast());
        // Safety: the handle refers to a filter with all its images.
        unsafe {
            for flag in flags {
                (self.api.set_bool)(filter.handle, flag.as_ptr(), true);
            }
            (self.api.commit_filter)(filter.handle);
            (self.api.execute_filter)(filter.handle);
        }
        drop(filter);
        self.check()?;
        Ok(output)
    }

    /// Returns the first error since the last call.
    fn check(&self) -> Result<(), DenoiserError> {
        let mut message: *const c_char = std::ptr::null();
        // Safety: a null handle selects the errors of this thread that belong to no device.
        let code = unsafe { (self.api.device_error)(self.handle, &mut message) };
        if code == 0 {
            return Ok(());
        }
        if message.is_null() {
            return Err(DenoiserError::Failed(format!("error {code}")));
        }
        // Safety: the library sets it to a null-terminated text that lives until the next call.
        let text = unsafe { CStr::from_ptr(message) };
        Err(DenoiserError::Failed(text.to_string_lossy().into_owned()))
    }
}

impl Drop for Device<'_> {
    fn drop(&mut self) {
        if !self.handle.is_null() {
            // Safety: the handle is not shared.
            unsafe { (self.api.release_device)(self.handle) };
        }
    }
}

/// A filter, released at its end.
struct Filter<'a> {
    api: &'a Api,
    handle: *mut FilterHandle,
}

impl<'a> Filter<'a> {
    fn new(device: &Device<'a>) -> Result<Self, DenoiserError> {
        // Safety: the handle refers to a device.
        let handle = unsafe { (device.api.new_filter)(device.handle, c"RT".as_ptr()) };
        if handle.is_null() {
            device.check()?;
            return Err(DenoiserError::Failed("it has no filter for ray tracing".to_owned()));
        }
        Ok(Filter { api: device.api, handle })
    }
}

impl Drop for Filter<'_> {
    fn drop(&mut self) {
        // Safety: the handle is not shared.
        unsafe { (self.api.release_filter)(self.handle) };
    }
}
