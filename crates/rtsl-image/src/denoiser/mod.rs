//! Open Image Denoise, loaded at run time where it is installed: versions 1 and 2 by their C interface.
//!
//! Only the processor is used, also where the library knows graphics cards: memory is then shared, and a machine gives the
//! same picture again. What it computes is the library's own, and not the same on all machines.

mod ffi;
mod search;

use std::ffi::{CStr, c_char, c_void};
use std::path::{Path, PathBuf};

use libloading::Library;

use ffi::{Api, CPU_DEVICE, DeviceHandle, FLOAT3, FilterHandle};

/// The library, ready to be called.
pub struct Denoiser {
    api: Api,
    path: PathBuf,
    version: (u32, u32),
}

/// What is denoised: images of one size, rows one after another.
#[derive(Clone, Copy, Debug)]
pub struct DenoiserInput<'a> {
    /// Columns.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// Linear colours of any brightness.
    pub color: &'a [[f32; 3]],
    /// The albedo of what is seen, from 0 to 1.
    pub albedo: Option<&'a [[f32; 3]]>,
    /// The normal of what is seen; used only with an albedo, as the library has it.
    pub normal: Option<&'a [[f32; 3]]>,
}

/// Why there is no denoised image.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum DenoiserError {
    /// No library is installed where it is looked for.
    #[error("Open Image Denoise is not installed")]
    Missing,
    /// What was found cannot be used.
    #[error("`{}` cannot be used as Open Image Denoise: {reason}", path.display())]
    Unusable {
        /// The library.
        path: PathBuf,
        /// What is wrong with it.
        reason: String,
    },
    /// An image has more or fewer pixels than it should.
    #[error("{what} has {found} pixels, expected {expected}")]
    Size {
        /// Which image.
        what: &'static str,
        /// How many it has.
        found: usize,
        /// How many it should have.
        expected: usize,
    },
    /// The library refused.
    #[error("Open Image Denoise: {0}")]
    Failed(String),
}

impl Denoiser {
    /// Loads what `RTSL_OIDN` names, a file or a folder, or else the system's library.
    ///
    /// # Errors
    /// There is none, or none that can be used; the error is that of the first that exists.
    pub fn load() -> Result<Self, DenoiserError> {
        let mut first_error = None;
        for candidate in search::candidates() {
            match Denoiser::open(&candidate.path) {
                Ok(denoiser) => return Ok(denoiser),
                // A name that the system does not find says nothing.
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
    /// It is none, or not Open Image Denoise.
    pub fn open(path: &Path) -> Result<Self, DenoiserError> {
        let unusable = |reason: String| DenoiserError::Unusable { path: path.to_owned(), reason };
        // Safety: loading runs the library's initialisers. The user installed the library as Open Image Denoise, or named
        // it; no more can be known of any library.
        let library = unsafe { Library::new(path) }.map_err(|error| unusable(error.to_string()))?;
        let api = Api::resolve(&library)
            .map_err(|name| unusable(format!("it has no function `{name}`")))?;
        // Its threads may outlive any use.
        std::mem::forget(library);
        let version = Device::new(&api).map_err(|error| unusable(error.to_string()))?.version();
        Ok(Denoiser { api, path: path.to_owned(), version })
    }

    /// Where the library lies, or the name by which the system found it.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// The library's version, major and minor.
    pub fn version(&self) -> (u32, u32) {
        self.version
    }

    /// The image without noise. Albedo and normals are denoised by themselves first, since depth of field and motion
    /// make them noisy too.
    ///
    /// # Errors
    /// Sizes differ, or the library has no memory.
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
        // Safety: the function takes any type of device, and gives null for those it does not have.
        let handle = unsafe { (api.new_device)(CPU_DEVICE) };
        let device = Device { api, handle };
        if handle.is_null() {
            device.check()?;
            return Err(DenoiserError::Failed("it does not know this processor".to_owned()));
        }
        // Safety: the handle is that of a device.
        unsafe { (api.commit_device)(handle) };
        device.check()?;
        Ok(device)
    }

    fn version(&self) -> (u32, u32) {
        // Safety: the handle is that of a device, and all have this number.
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
        // Safety: the handle is that of a filter with all its images.
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

    /// The first error since it was asked for.
    fn check(&self) -> Result<(), DenoiserError> {
        let mut message: *const c_char = std::ptr::null();
        // Safety: null stands for errors of this thread that no device has.
        let code = unsafe { (self.api.device_error)(self.handle, &mut message) };
        if code == 0 {
            return Ok(());
        }
        if message.is_null() {
            return Err(DenoiserError::Failed(format!("error {code}")));
        }
        // Safety: the library sets it to a text that ends in a zero and lives until the next call.
        let text = unsafe { CStr::from_ptr(message) };
        Err(DenoiserError::Failed(text.to_string_lossy().into_owned()))
    }
}

impl Drop for Device<'_> {
    fn drop(&mut self) {
        if !self.handle.is_null() {
            // Safety: nobody else holds the handle.
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
        // Safety: the handle is that of a device.
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
        // Safety: nobody else holds the handle.
        unsafe { (self.api.release_filter)(self.handle) };
    }
}
