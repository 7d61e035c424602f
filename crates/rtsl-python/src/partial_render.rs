//! Renders that Python advances part by part.

use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::mpsc::{self, RecvTimeoutError};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use pyo3::prelude::*;
use pyo3::types::PyBytes;
use rtsl::{Messages, Method};
use rtsl_render::compiled::RenderScene;
use rtsl_render::schedule::{Part, PartialRender, RenderIdentity, RenderOptions, WorkCounts};
use rtsl_render::statistics::{NotFinite, RayCounts};
use rtsl_render::{Execution, TilesDone};

use crate::detached::{check_fork, detached};
use crate::error::Exception;
use crate::picture::PyPicture;

/// The interval of telling the progress and of looking for interrupts.
const TOLD_EVERY: Duration = Duration::from_millis(50);

/// Rays by kind, values of methods that were not finite, and seconds.
type Counts = ((u64, u64, u64), Vec<(String, String, u64)>, f64);

/// A render in progress, with its scene.
#[pyclass(name = "PartialRender", module = "rtsl._rtsl", frozen)]
pub struct PyPartialRender {
    scene: Arc<RenderScene>,
    render: Mutex<PartialRender>,
    tiles: usize,
    samples: u32,
}

#[pymethods]
impl PyPartialRender {
    /// The number of tiles of the picture, of 8 by 8 pixels in rows.
    #[getter]
    fn tiles(&self) -> usize {
        self.tiles
    }

    /// The samples of each pixel of the whole picture.
    #[getter]
    fn samples(&self) -> u32 {
        self.samples
    }

    /// Renders samples of tiles. `listener` is called on this thread with the number of pieces of work done and that
    /// of all. Returns false if the time was over before.
    ///
    /// An interrupt ends the render after the samples in progress, which are kept.
    #[pyo3(signature = (tiles, samples, *, threads=None, seconds=None, listener=None))]
    fn render(
        &self,
        py: Python<'_>,
        tiles: (usize, usize),
        samples: (u32, u32),
        threads: Option<usize>,
        seconds: Option<f64>,
        listener: Option<Bound<'_, PyAny>>,
    ) -> PyResult<bool> {
        let part = Part { tiles: tiles.0..tiles.1.min(self.tiles), samples: samples.0..samples.1 };
        if part.tiles.start > part.tiles.end {
            return Err(Exception::Scene.with_text("the picture does not have these tiles"));
        }
        let time_limit = seconds.map(Duration::try_from_secs_f64).transpose();
        let time_limit = time_limit
            .map_err(|error| Exception::Scene.with_text(&format!("a time limit: {error}")))?;
        let cancel = AtomicBool::new(false);
        let (done, of) = (AtomicUsize::new(0), AtomicUsize::new(0));
        let progress = |tiles: TilesDone| {
            of.store(tiles.of, Ordering::Relaxed);
            done.store(tiles.done, Ordering::Relaxed);
        };
        let execution =
            Execution { threads, cancel: Some(&cancel), time_limit, ..Execution::default() };
        let options =
            RenderOptions { execution, progress: Some(&progress), ..RenderOptions::default() };
        let listener = listener.map(Bound::unbind);
        let tell = || -> PyResult<()> {
            Python::attach(|py| {
                py.check_signals()?;
                let of = of.load(Ordering::Relaxed);
                match listener.as_ref().filter(|_| of > 0) {
                    Some(listener) => {
                        listener.call1(py, (done.load(Ordering::Relaxed), of)).map(drop)
                    }
                    None => Ok(()),
                }
            })
        };
        let ended = detached(py, || {
            std::thread::scope(|scope| {
                let (end, ended) = mpsc::sync_channel(1);
                let part = &part;
                scope.spawn(move || {
                    let mut render = self.render.lock().unwrap_or_else(PoisonError::into_inner);
                    let result = render.render(&self.scene, part, options);
                    // The receiver waits for it.
                    let _ = end.send(result);
                });
                let mut told = Ok(());
                loop {
                    match ended.recv_timeout(TOLD_EVERY) {
                        Ok(result) => return told.map(|()| Some(result)),
                        // The thread panics when the scope ends.
                        Err(RecvTimeoutError::Disconnected) => return told.map(|()| None),
                        Err(RecvTimeoutError::Timeout) if told.is_ok() => {
                            told = tell();
                            cancel.fetch_or(told.is_err(), Ordering::Relaxed);
                        }
                        Err(RecvTimeoutError::Timeout) => {}
                    }
                }
            })
        })??;
        tell()?;
        let Some(ended) = ended else { return Ok(false) };
        let cancelled = ended.map_err(exception)?;
        Ok(!cancelled)
    }

    /// The time that its parts took, in seconds.
    #[getter]
    fn seconds(&self) -> PyResult<f64> {
        Ok(self.lock()?.time().as_secs_f64())
    }

    /// Adds the sums of another render, whose samples follow, of these tiles.
    fn add(&self, other: &PyPartialRender, tiles: (usize, usize)) -> PyResult<()> {
        if std::ptr::eq(self, other) {
            return Err(Exception::Scene.with_text("a render is not added to itself"));
        }
        let (mut own, other) = (self.lock()?, other.lock()?);
        own.add(&other, tiles.0..tiles.1).map_err(exception)
    }

    /// The sums of all samples of tiles so far.
    fn sums<'py>(&self, py: Python<'py>, tiles: (usize, usize)) -> PyResult<Bound<'py, PyBytes>> {
        let sums = || self.lock()?.sums(&self.scene, tiles.0..tiles.1).map_err(exception);
        let sums = detached(py, sums)??;
        Ok(PyBytes::new(py, &sums))
    }

    /// Sets tiles to sums of a render of the same scene.
    fn restore(&self, py: Python<'_>, sums: &[u8], tiles: (usize, usize)) -> PyResult<()> {
        let restore =
            || self.lock()?.restore(&self.scene, tiles.0..tiles.1, sums).map_err(exception);
        detached(py, restore)?
    }

    /// Forgets the samples of tiles.
    fn clear(&self, tiles: (usize, usize)) -> PyResult<()> {
        self.lock()?.clear(tiles.0..tiles.1).map_err(exception)
    }

    /// The least number of samples of those tiles that need more; `None` if none does.
    fn taken(&self, tiles: (usize, usize)) -> PyResult<Option<u32>> {
        self.lock()?.taken(&self.scene, tiles.0..tiles.1).map_err(exception)
    }

    /// Takes what was counted since this was called last: rays by kind, values of methods that were not finite, and
    /// seconds.
    fn take_counts(&self) -> PyResult<Counts> {
        let WorkCounts { rays, not_finite, time } = self.lock()?.take_counts();
        let RayCounts { camera, traced, shadow } = rays;
        let not_finite = not_finite.into_iter();
        let not_finite = not_finite.map(|it| (it.class, it.method.to_owned(), it.count)).collect();
        Ok(((camera, traced, shadow), not_finite, time.as_secs_f64()))
    }

    /// Adds what another render counted.
    fn add_counts(&self, counts: Counts) -> PyResult<()> {
        let ((camera, traced, shadow), not_finite, seconds) = counts;
        let not_finite = not_finite.into_iter().filter_map(|(class, method, count)| {
            let method = Method::from_name(&method)?.name();
            Some(NotFinite { class, method, count })
        });
        let counts = WorkCounts {
            rays: RayCounts { camera, traced, shadow },
            not_finite: not_finite.collect(),
            time: Duration::try_from_secs_f64(seconds).unwrap_or_default(),
        };
        self.lock()?.add_counts(&counts);
        Ok(())
    }

    /// Writes a checkpoint, which the command can resume, too.
    fn write_checkpoint(&self, py: Python<'_>, path: PathBuf) -> PyResult<()> {
        let write = || self.lock()?.write_checkpoint(&self.scene, path).map_err(exception);
        detached(py, write)?
    }

    /// Raises an exception if a checkpoint cannot be written.
    fn check_checkpoint(&self, path: PathBuf) -> PyResult<()> {
        self.lock()?.check_checkpoint(&self.scene, &path).map_err(exception)
    }

    /// Continues from a checkpoint; false if there is none.
    fn resume(&self, py: Python<'_>, path: PathBuf) -> PyResult<bool> {
        let resume = || self.lock()?.resume(&self.scene, path).map_err(exception);
        detached(py, resume)?
    }

    /// The picture of the samples so far.
    fn picture(&self, py: Python<'_>) -> PyResult<PyPicture> {
        let rendered = || self.lock()?.rendered(&self.scene).map_err(exception);
        let rendered = detached(py, rendered)??;
        Ok(PyPicture::new(rendered, self.scene.compiled.settings.clone()))
    }
}

impl PyPartialRender {
    /// Begins a render with the sample `first` of each pixel.
    pub fn new(
        scene: Arc<RenderScene>,
        first: u32,
        noise_target: Option<f32>,
        identity: Option<RenderIdentity>,
    ) -> Result<PyPartialRender, Messages> {
        let render = PartialRender::new(&scene, first, noise_target)?;
        let render = match identity {
            Some(identity) => render.identified(identity),
            None => render,
        };
        let Part { tiles, samples } = render.whole(&scene);
        let (tiles, samples) = (tiles.end, samples.end);
        Ok(PyPartialRender { scene, render: Mutex::new(render), tiles, samples })
    }

    fn lock(&self) -> PyResult<MutexGuard<'_, PartialRender>> {
        check_fork()?;
        Ok(self.render.lock().unwrap_or_else(PoisonError::into_inner))
    }
}

fn exception(messages: Messages) -> PyErr {
    Exception::Scene.of_messages(&messages)
}
