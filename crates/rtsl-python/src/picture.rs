//! Pictures and their files.

use std::path::PathBuf;
use std::time::Duration;

use numpy::{IntoPyArray, PyArray3, PyArrayDyn, PyArrayMethods};
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyDict};
use rtsl::{Diagnostic, Messages};
use rtsl_image::{
    ExrOptions, ExrPrecision, ImageMetadata, ImageOptions, ViewTransform, encode_png,
    write_image_with,
};
use rtsl_render::Statistics;
use rtsl_render::schedule::RenderedImage;
use rtsl_scene::Settings;

use crate::detached::detached;
use crate::error::Exception;

/// A rendered picture with its AOVs.
#[pyclass(name = "Picture", module = "rtsl._rtsl", frozen)]
pub struct PyPicture {
    rendered: RenderedImage,
    settings: Settings,
}

#[pymethods]
impl PyPicture {
    /// The linear colours: rows from the top, columns, channels.
    fn pixels<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray3<f32>>> {
        let image = &self.rendered.rendered.image;
        let numbers: Vec<f32> = image.pixels.as_flattened().to_vec();
        numbers.into_pyarray(py).reshape([image.height, image.width, 3])
    }

    /// The AOVs by name.
    fn aovs<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let aovs = PyDict::new(py);
        for aov in &self.rendered.rendered.aovs {
            let mut shape = vec![aov.height, aov.width];
            shape.extend((aov.ty.channels() > 1).then_some(aov.ty.channels()));
            let array: Bound<'py, PyArrayDyn<f32>> =
                aov.values.clone().into_pyarray(py).reshape(shape)?;
            aovs.set_item(aov.aov.name(), array)?;
        }
        Ok(aovs)
    }

    /// Figures of the render.
    fn statistics<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let RenderedImage { rendered, mean_samples, .. } = &self.rendered;
        let figures = PyDict::new(py);
        figures.set_item("seconds", rendered.time.as_secs_f64())?;
        figures.set_item("samples", mean_samples)?;
        figures.set_item("rays", rendered.rays.total())?;
        figures.set_item("threads", rendered.threads)?;
        figures.set_item("dropped_samples", rendered.dropped_samples)?;
        figures.set_item("object_classes", &rendered.object_classes)?;
        Ok(figures)
    }

    /// The statistics that the command writes, of a render that took so long on so many threads.
    fn statistics_json(&self, seconds: f64, threads: usize, cancelled: bool) -> String {
        let RenderedImage { rendered, mean_samples, .. } = &self.rendered;
        let mut statistics = rendered.added_to(Statistics {
            size: [self.settings.width, self.settings.height],
            samples_per_pixel: self.settings.sampler.samples_per_pixel(),
            mean_samples: Some(*mean_samples),
            ..Statistics::default()
        });
        (statistics.threads, statistics.cancelled) = (threads, cancelled);
        statistics.set_render_time(Duration::try_from_secs_f64(seconds).unwrap_or_default());
        statistics.to_json()
    }

    /// A warning about samples that were not finite; empty if there were none.
    #[getter]
    fn warnings(&self) -> String {
        self.rendered
            .rendered
            .dropped_warning()
            .map_or_else(String::new, |warning| Messages::one(warning).to_text(false))
    }

    /// The picture as a PNG file.
    #[pyo3(signature = (exposure=0.0, view="standard"))]
    fn png<'py>(
        &self,
        py: Python<'py>,
        exposure: f32,
        view: &str,
    ) -> PyResult<Bound<'py, PyBytes>> {
        let view = view_of_name(view)?;
        let image = &self.rendered.rendered.image;
        let exposure = exposure + self.settings.exposure;
        let encoded = detached(py, || {
            let bytes = image.to_view(view, exposure).map_err(|error| error.diagnostic())?;
            let encoded = encode_png((image.width, image.height), 3, &bytes);
            encoded.map_err(|error| unwritten(&error.to_string()))
        })?;
        let encoded = encoded.map_err(|problem| Exception::Error.of_diagnostic(&problem))?;
        Ok(PyBytes::new(py, &encoded))
    }

    /// Writes a PNG as displayed, with a file for each AOV, or an EXR of linear numbers with all: with colours of 16
    /// bits if `half`, and as parts of their own if `parts`.
    #[pyo3(signature = (path, exposure=0.0, view="standard", half=false, parts=false))]
    fn save(
        &self,
        py: Python<'_>,
        path: PathBuf,
        exposure: f32,
        view: &str,
        half: bool,
        parts: bool,
    ) -> PyResult<()> {
        let sampler = &self.settings.sampler;
        let metadata =
            ImageMetadata { samples: Some(sampler.samples_per_pixel()), seed: Some(sampler.seed) };
        let options = ImageOptions {
            exposure: exposure + self.settings.exposure,
            view: view_of_name(view)?,
            exr: ExrOptions {
                precision: if half { ExrPrecision::Half } else { ExrPrecision::Float },
                multi_part: parts,
            },
            metadata,
        };
        let rendered = &self.rendered.rendered;
        let write = || write_image_with(&rendered.image, &rendered.aovs, &path, &options);
        let written = detached(py, write)?;
        written.map_err(|error| Exception::Error.of_diagnostic(&error.diagnostic()))
    }
}

impl PyPicture {
    /// A picture of a render with these settings.
    pub fn new(rendered: RenderedImage, settings: Settings) -> PyPicture {
        PyPicture { rendered, settings }
    }
}

fn view_of_name(name: &str) -> PyResult<ViewTransform> {
    let message = || format!("there is no view `{name}`: standard, filmic, raw");
    ViewTransform::from_name(name).ok_or_else(|| Exception::Error.with_text(&message()))
}

fn unwritten(reason: &str) -> Diagnostic {
    let message = format!("the picture cannot be encoded: {reason}");
    Diagnostic::new(rtsl::diagnostic_codes::UNWRITABLE_FILE, message)
}
