//! Settings of the image: film, sampler and integrator.

mod crop;
mod film;
mod filter;
mod imaging;
mod integrator;
mod parameters;
mod sampler;
#[cfg(test)]
mod tests;

use rtsl::Diagnostics;
use rtsl_math::sampling::{PixelFilter, Sampler};

use crate::description::{Description, EntityId, SceneOptions};
use crate::pbrt::PbrtName;
use sampler::{grid, stratified};

pub use crop::Crop;
pub use imaging::Imaging;
pub use integrator::{BATCH, INTERACTIVE, MAX_TRACE_DEPTH, RENDERERS, class_of_renderer};
pub(crate) use integrator::{
    SETTINGS_OF_INTEGRATORS, class_of_integrator, is_named_integrator, taken_over,
    unknown_integrator,
};

/// All settings of an image that are not shaders.
#[derive(Clone, Debug, PartialEq)]
pub struct Settings {
    /// Columns of the image.
    pub width: usize,
    /// Rows of the image.
    pub height: usize,
    /// The name of the image file, if the scene gives one.
    pub filename: Option<String>,
    /// The part of the film that the picture shows, unless that is all of it.
    pub crop: Option<Crop>,
    /// The film's response to radiance.
    pub imaging: Imaging,
    /// The brightness of 8-bit images, in stops.
    pub exposure: f32,
    /// The pixel filter.
    pub filter: PixelFilter,
    /// The sampler.
    pub sampler: Sampler,
    /// The class of the library that makes the picture unless the scene names another one, if the scene's integrator or a
    /// host selects it.
    pub integrator: Option<&'static str>,
    /// The greatest depth of rays spawned by rays; 0 traces camera rays only.
    pub max_depth: u32,
    /// The least contribution to the pixel for which spawned rays are traced; 0 traces all.
    pub cutoff: f32,
    /// The contribution to the pixel below which paths are terminated at random (Russian roulette); 0 terminates none.
    pub roulette_threshold: f32,
    /// True if highlights are widened on surfaces that light reaches by way of one that scatters it.
    pub regularize: bool,
    /// The least distance of a hit from its ray's origin, if the scene sets it.
    pub epsilon: Option<f32>,
    /// The greatest number of loop iterations of one ray in one call of a method.
    pub loop_budget: u32,
}

/// The greatest number of pixels: 2^28 pixels take 3 GiB.
const MAX_PIXELS: u64 = 1 << 28;
const MAX_SIDE: f64 = 65_536.0;

impl Default for Settings {
    fn default() -> Self {
        Settings {
            width: 1280,
            height: 720,
            filename: None,
            crop: None,
            imaging: Imaging::default(),
            exposure: 0.0,
            filter: PixelFilter::default(),
            sampler: stratified(16, 0),
            integrator: None,
            max_depth: 5,
            cutoff: 0.0,
            roulette_threshold: 1.0,
            regularize: false,
            epsilon: None,
            loop_budget: 1 << 20,
        }
    }
}

impl Settings {
    /// Reads the settings of a scene; errors go to `diagnostics`.
    pub fn read(description: &Description, diagnostics: &mut Diagnostics) -> Self {
        let mut settings = Settings::default();
        let entity = |id: Option<EntityId>| id.map(|EntityId(index)| &description.entities[index]);
        if let Some(camera) = entity(description.camera).filter(|it| PbrtName::of(it).is_some()) {
            settings.read_exposure_time(camera);
            settings.filter = filter::of_pbrt();
        }
        if let Some(film) = entity(description.film) {
            settings.read_film(film, diagnostics);
        }
        if let Some(filter) = entity(description.filter) {
            settings.read_filter(filter, diagnostics);
        }
        if let Some(sampler) = entity(description.sampler) {
            settings.read_sampler(sampler, description.options.seed, diagnostics);
        } else if let Some(seed) = description.options.seed {
            settings.sampler.seed = seed;
        }
        let integrator = entity(description.integrator);
        if let Some(own) = entity(description.own_integrator)
            && integrator.is_some_and(|integrator| !std::ptr::eq(integrator, own))
        {
            // Its mistakes matter to nobody while another one takes its place.
            settings.read_integrator(own, &mut Diagnostics::new());
        }
        if let Some(integrator) = integrator {
            settings.read_integrator(integrator, diagnostics);
        }
        settings.apply_options(&description.options);
        settings
    }

    fn apply_options(&mut self, options: &SceneOptions) {
        if options.disable_pixel_jitter {
            self.filter = filter::point();
        }
    }

    /// Sets the number of samples per pixel and keeps the kind of sampler.
    pub fn set_samples_per_pixel(&mut self, count: u32) {
        let (columns, rows) = grid(count);
        self.sampler = Sampler { columns, rows, ..self.sampler };
    }

    /// Returns an error message if the image is too large.
    pub fn size_problem(&self) -> Option<String> {
        let pixels = (self.width as u64).saturating_mul(self.height as u64);
        (pixels > MAX_PIXELS).then(|| format!("the image has more than {MAX_PIXELS} pixels"))
    }
}
