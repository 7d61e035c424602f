//! The session of a viewer, and its window.

use std::path::PathBuf;

use rtsl_image::ImageFormat;
use rtsl_render::session::{Session, SessionOptions, ViewMode};
use rtsl_view::{Side, Start, ViewError, ViewOptions, view};

use super::{PaneName, ShownName, ViewArguments};
use crate::commands::render::report;
use crate::outcome::{CommandResult, Failure, Outcome};
use crate::report::Reporter;

/// Opens the window and waits until it is closed.
pub fn show(arguments: &ViewArguments, reporter: &Reporter) -> CommandResult {
    let is_png = |path: &PathBuf| matches!(ImageFormat::from_path(path), Ok(ImageFormat::Png));
    if let Some(path) = arguments.screenshot.as_ref().filter(|path| !is_png(path)) {
        return Err(Failure::Usage(format!("`{}` does not end in .png", path.display())));
    }
    let search_path = arguments.load.search_path.beside(&arguments.scene, reporter)?;
    let options = SessionOptions {
        load: arguments.load.options(&search_path),
        size: arguments.size,
        samples: arguments.spp,
        threads: arguments.threads,
        engine: arguments.engine.options(),
        exposure: arguments.exposure,
    };
    let (session, warnings) = match Session::open(&arguments.scene, options) {
        Ok(opened) => opened,
        Err(messages) => {
            report(&messages, reporter);
            return Ok(Outcome::InputAtFault);
        }
    };
    report(&warnings, reporter);
    let options = ViewOptions {
        title: format!("{} - RTSL", arguments.scene.display()),
        frames: arguments.frames,
        screenshot: arguments.screenshot.clone(),
        start: start(arguments),
    };
    match view(session, options) {
        Ok(()) => Ok(Outcome::Done),
        Err(error @ ViewError::NoDisplay(_)) => {
            reporter.message("error", &error.to_string());
            reporter
                .message("help", "`rtsl render` needs no display; `xvfb-run rtsl view` brings one");
            Ok(Outcome::InputAtFault)
        }
        Err(error @ ViewError::Screenshot(_)) => Err(Failure::Output(std::io::Error::other(error))),
    }
}

/// Returns the state of the window when it opens.
fn start(arguments: &ViewArguments) -> Start {
    let mode = match arguments.show {
        None | Some(ShownName::Image) => ViewMode::Image,
        Some(ShownName::Time) => ViewMode::Time,
        Some(ShownName::Nodes) => ViewMode::Nodes,
        Some(ShownName::Lanes) => ViewMode::Lanes,
        Some(ShownName::NotFinite) => ViewMode::NotFinite,
    };
    let side = arguments.pane.map(|pane| match pane {
        PaneName::Parameters => Side::Parameters,
        PaneName::Inspector => Side::Inspector,
        PaneName::Costs => Side::Costs,
        PaneName::NotFinite => Side::NotFinite,
    });
    let inspect = arguments.inspect.map(|pixel| (pixel, arguments.sample));
    let (select, edit) = (arguments.select.clone(), arguments.edit.clone());
    Start { side, select, edit, inspect, mode }
}
