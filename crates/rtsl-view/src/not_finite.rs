//! The pane of samples that are not finite: where they are, and the lines that make them.

use std::collections::BTreeMap;

use egui::{RichText, ScrollArea, Ui};
use rtsl_render::session::{Dropped, DroppedPixel, Film, ProbedPixel};

use crate::inspector::{Job, Outcome, Report, ReportPlace, show_report};
use crate::theme;

/// The greatest number of pixels from which those are chosen whose causes are looked for, of the latter, and of those
/// that are listed.
const LISTED: usize = 4096;
const EXAMINED: usize = 16;
const SHOWN: usize = 64;

/// The causes of samples that are not finite.
#[derive(Default)]
pub struct NotFinite {
    /// The reports with the number of examined pixels that have each.
    reports: BTreeMap<Report, usize>,
    /// The number of pixels that were examined; none if they were not.
    examined: Option<usize>,
    error: Option<String>,
}

/// A request of someone in the pane.
pub enum Request {
    /// The causes are looked for.
    Find(Job),
    /// A line is shown.
    GoTo(ReportPlace),
    /// A pixel is inspected: its column, row and sample.
    Inspect(ProbedPixel),
}

impl NotFinite {
    /// Forgets the causes: the scene has changed.
    pub fn clear(&mut self) {
        *self = NotFinite::default();
    }

    /// Takes the causes of samples.
    pub fn take(&mut self, outcome: Outcome) {
        self.clear();
        match outcome {
            Ok(recorded) => {
                self.examined = Some(recorded.len());
                for report in recorded.iter().filter_map(|it| Report::of(&it.sample.recording)) {
                    *self.reports.entry(report).or_default() += 1;
                }
            }
            Err(error) => self.error = Some(error),
        }
    }

    /// Shows the pane for a film. Causes are looked for as soon as the film is done, and on demand.
    pub fn show(
        &mut self,
        ui: &mut Ui,
        film: &Film,
        is_running: bool,
        is_done: bool,
    ) -> Option<Request> {
        let Dropped { samples, pixels: all, listed: pixels } = film.dropped(LISTED);
        let mut request = None;
        if pixels.is_empty() {
            ui.label("All samples so far are finite.");
            return None;
        }
        ui.colored_label(
            theme::ERROR,
            format!("{samples} samples of {all} pixels are not finite and count as black."),
        );
        ui.label(RichText::new("Key 5 marks the pixels in the picture.").color(theme::FAINT));
        ui.horizontal(|ui| {
            if is_running {
                ui.colored_label(theme::ACCENT, "evaluating…");
                return;
            }
            let is_asked = ui.button("Find causes").on_hover_text(FIND).clicked();
            let is_new = is_done && self.examined.is_none() && self.error.is_none();
            if is_asked || is_new {
                request = Some(Request::Find(Job::Causes(examined(&pixels))));
            }
        });
        ScrollArea::vertical().auto_shrink(false).show(ui, |ui| {
            let found = self.show_causes(ui);
            request = found.or(request.take());
            ui.separator();
            for pixel in pixels.iter().take(SHOWN) {
                let DroppedPixel { x, y, first, count } = *pixel;
                let text = match count {
                    1 => format!("pixel {x},{y}: sample {first}"),
                    _ => format!("pixel {x},{y}: {count} samples from {first} on"),
                };
                if ui.link(text).clicked() {
                    request = Some(Request::Inspect(ProbedPixel { x, y, sample: first }));
                }
            }
            if all > SHOWN {
                ui.label(
                    RichText::new(format!("and {} further pixels", all - SHOWN))
                        .color(theme::FAINT),
                );
            }
        });
        request
    }

    fn show_causes(&self, ui: &mut Ui) -> Option<Request> {
        let mut request = None;
        if let Some(error) = &self.error {
            ui.colored_label(theme::ERROR, error);
        }
        for (report, count) in &self.reports {
            ui.label(RichText::new(format!("{count} of the examined pixels:")).color(theme::FAINT));
            if show_report(ui, report) {
                request = report.place.clone().map(Request::GoTo);
            }
        }
        if let Some(examined) = self.examined
            && self.reports.is_empty()
        {
            let text = format!("None of {examined} samples has a value that a shader made so.");
            ui.label(text);
        }
        request
    }
}

const FIND: &str = "Evaluates the first such sample of up to 16 of the pixels in the interpreter, and reports the first \
                    operation of each whose result is not finite.";

/// The samples whose causes are looked for: spread over the picture.
fn examined(pixels: &[DroppedPixel]) -> Vec<ProbedPixel> {
    let step = pixels.len().div_ceil(EXAMINED).max(1);
    let of = |pixel: &DroppedPixel| ProbedPixel { x: pixel.x, y: pixel.y, sample: pixel.first };
    pixels.iter().step_by(step).map(of).collect()
}
