//! The pane of the inspector: what is known of a pixel, and a replay of a sample of it.

mod debugging;
mod recorder;
mod report;

use egui::{CollapsingHeader, Context, DragValue, RichText, ScrollArea, Slider, Ui};
use rtsl::{TraceKind, TracedValue};
use rtsl_debug::{Frame, Replay};
use rtsl_math::Transform;
use rtsl_render::session::{Picked, Probe, ProbedPixel};

use crate::theme;
pub use debugging::{Debugging, Move};
pub use recorder::{Job, Outcome, Recorded, Recorder};
pub use report::{Report, ReportPlace};

/// A pixel and what is known of it.
#[derive(Default)]
pub struct Inspector {
    pixel: Option<Inspected>,
    /// The sample that is looked at.
    sample: u32,
    facts: Option<Facts>,
    /// The replay of a sample.
    pub debugging: Option<Debugging>,
    error: Option<String>,
    /// The expression to be evaluated.
    expression: String,
    evaluated: Option<Evaluated>,
}

/// The value of an expression at a position of the replay.
struct Evaluated {
    expression: String,
    /// The statement, and the call.
    at: (usize, usize),
    value: Result<TracedValue, String>,
}

/// A pixel of a picture.
#[derive(Clone, Debug, PartialEq)]
pub struct Inspected {
    /// The column, from the left.
    pub x: usize,
    /// The row, from the top.
    pub y: usize,
    /// The object in it.
    pub picked: Option<Picked>,
    /// The state of the scene.
    pub state: State,
}

/// The state of a picture: another one may have other values.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct State {
    /// The columns and rows.
    pub size: (usize, usize),
    /// The camera.
    pub camera: Transform,
    /// The number of changes of the scene.
    pub changes: u64,
}

/// The facts of a sample.
struct Facts {
    sample: u32,
    radiance: [f32; 3],
    outputs: Vec<(String, Vec<f32>)>,
    prints: Vec<String>,
    not_finite: Option<Report>,
}

/// A request of someone in the pane.
#[derive(Clone, Debug, PartialEq)]
pub enum Request {
    /// A sample is evaluated.
    Evaluate(Job),
    /// A line of a text is shown.
    GoTo(ReportPlace),
    /// The pixel is looked at again, since the picture has changed.
    Again,
}

impl Inspector {
    /// Returns the pixel.
    pub fn pixel(&self) -> Option<&Inspected> {
        self.pixel.as_ref()
    }

    /// Looks at another pixel, and returns what is to be evaluated.
    pub fn look_at(&mut self, pixel: Inspected) -> Job {
        self.pixel = Some(pixel);
        self.facts = None;
        self.error = None;
        Job::Facts(self.probed())
    }

    /// Looks at another sample.
    pub fn set_sample(&mut self, sample: u32) {
        self.sample = sample;
        self.facts = None;
    }

    /// Forgets the pixel. A replay stays.
    pub fn forget(&mut self) {
        self.pixel = None;
        self.facts = None;
    }

    /// Returns the sample that is looked at.
    pub fn probed(&self) -> ProbedPixel {
        let (x, y) = self.pixel.as_ref().map_or((0, 0), |pixel| (pixel.x, pixel.y));
        ProbedPixel { x, y, sample: self.sample }
    }

    /// True if the pixel is to be evaluated before something can be shown of it.
    pub fn needs_facts(&self) -> bool {
        self.pixel.is_some() && self.facts.is_none() && self.error.is_none()
    }

    /// Takes the outcome of a job. Returns the lines that shaders have printed.
    pub fn take(&mut self, job: &Job, outcome: Outcome) -> Vec<String> {
        let recorded = match outcome {
            Ok(mut recorded) => recorded.pop(),
            Err(error) => {
                self.error = Some(error);
                return Vec::new();
            }
        };
        let Some(recorded) = recorded else { return Vec::new() };
        let is_current = self.pixel.is_some() && recorded.pixel == self.probed();
        self.error = None;
        let facts = Facts::of(&recorded);
        let prints = facts.prints.clone();
        if is_current {
            self.facts = Some(facts);
        }
        if let Job::Steps(pixel) = job {
            match Replay::new(recorded.sample.recording, recorded.lines) {
                Ok(replay) => self.debugging = Some(Debugging::new(replay)),
                Err(error) => {
                    let ProbedPixel { x, y, sample } = pixel;
                    self.error = Some(format!("pixel {x},{y}, sample {sample}: {error}"));
                }
            }
            return Vec::new();
        }
        prints
    }

    /// Shows the pane.
    pub fn show(
        &mut self,
        ui: &mut Ui,
        now: &State,
        samples: u32,
        running: bool,
    ) -> Option<Request> {
        let mut request = None;
        ScrollArea::vertical().auto_shrink(false).show(ui, |ui| {
            match self.pixel.clone() {
                None => {
                    let hint = "Click a pixel of the picture.";
                    ui.label(RichText::new(hint).color(theme::FAINT));
                }
                Some(pixel) => self.show_pixel(ui, &pixel, now, samples, running, &mut request),
            }
            if let Some(error) = &self.error {
                let text = RichText::new(error.trim_end()).monospace().color(theme::ERROR);
                ui.add(egui::Label::new(text).wrap());
            }
            self.show_debugging(ui);
        });
        request
    }

    fn show_pixel(
        &mut self,
        ui: &mut Ui,
        pixel: &Inspected,
        now: &State,
        samples: u32,
        running: bool,
        request: &mut Option<Request>,
    ) {
        ui.heading(format!("Pixel {},{}", pixel.x, pixel.y));
        if pixel.state != *now {
            ui.horizontal_wrapped(|ui| {
                ui.colored_label(theme::WARNING, "The picture has changed since.");
                if ui.button("Look again").clicked() {
                    *request = Some(Request::Again);
                }
            });
        }
        show_object(ui, pixel.picked.as_ref());
        ui.horizontal(|ui| {
            ui.label("sample");
            let last = samples.saturating_sub(1);
            let mut sample = self.sample.min(last);
            if ui.add(DragValue::new(&mut sample).range(0..=last).speed(0.1)).changed() {
                self.set_sample(sample);
                *request = Some(Request::Evaluate(Job::Facts(self.probed())));
            }
            ui.label(RichText::new(format!("of {samples}")).color(theme::FAINT));
            if running {
                ui.label(RichText::new("evaluating…").color(theme::ACCENT));
            } else if ui.button("Replay").on_hover_text(REPLAY).clicked() {
                *request = Some(Request::Evaluate(Job::Steps(self.probed())));
            }
        });
        if let Some(facts) = &self.facts {
            facts.show(ui, request);
        }
    }

    fn show_debugging(&mut self, ui: &mut Ui) {
        let Some(debugging) = &mut self.debugging else { return };
        ui.separator();
        let (position, count) = debugging.position();
        let mut at = position;
        ui.horizontal(|ui| {
            ui.heading("Replay");
            ui.label(RichText::new(format!("statement {position} of {count}")).color(theme::FAINT));
        });
        ui.horizontal(|ui| {
            ui.spacing_mut().slider_width = (ui.available_width() - 70.0).max(60.0);
            let slider = Slider::new(&mut at, 0..=count.saturating_sub(1)).show_value(false);
            if ui.add(slider).changed() {
                debugging.go(Move::To(at));
            }
        });
        for (title, moves) in [("back", Move::BACK), ("forth", Move::FORTH)] {
            ui.horizontal(|ui| {
                for (movement, name, what) in moves {
                    let hover = format!("{title} {what}");
                    let button = egui::Button::new(name).min_size(egui::vec2(64.0, 0.0));
                    if ui.add(button).on_hover_text(hover).clicked() {
                        debugging.go(movement);
                    }
                }
            });
        }
        if debugging.dropped() > 0 {
            let text = format!(
                "The recording is cut: {} later entries are beyond its limit of {}.",
                debugging.dropped(),
                recorder::KEPT
            );
            ui.colored_label(theme::WARNING, text);
        }
        if !debugging.stopped.is_empty() {
            ui.colored_label(theme::ACCENT, &debugging.stopped);
        }
        if let Some(note) = debugging.note() {
            ui.label(RichText::new(note).small().color(theme::FAINT));
        }
        show_frames(ui, debugging);
        for (title, values) in debugging::lists(&debugging.scopes) {
            CollapsingHeader::new(title).default_open(true).show(ui, |ui| {
                values.iter().for_each(|(name, value)| show_value(ui, name, value));
            });
        }
        self.show_expression(ui);
    }

    fn show_expression(&mut self, ui: &mut Ui) {
        let Some(debugging) = &mut self.debugging else { return };
        ui.horizontal(|ui| {
            ui.label("evaluate");
            let field = egui::TextEdit::singleline(&mut self.expression);
            let hint = "length(normal) * 2.0";
            ui.add(
                field.hint_text(hint).desired_width(f32::INFINITY).font(egui::TextStyle::Monospace),
            );
        });
        let expression = self.expression.trim();
        if expression.is_empty() {
            return;
        }
        let at = (debugging.position().0, debugging.selected);
        let is_known = |it: &Evaluated| it.expression == expression && it.at == at;
        if !self.evaluated.as_ref().is_some_and(is_known) {
            let value = debugging.evaluate(expression);
            self.evaluated = Some(Evaluated { expression: expression.to_owned(), at, value });
        }
        if let Some(Evaluated { value, .. }) = &self.evaluated {
            match value {
                Ok(value) => show_value(ui, "=", value),
                Err(error) => {
                    let text = RichText::new(error.trim_end()).small().color(theme::ERROR);
                    ui.add(egui::Label::new(text).wrap());
                }
            }
        }
    }
}

/// The explanation of the button that records.
const REPLAY: &str = "Records the sample step by step in the interpreter, which has the bits of the picture, and shows \
                      it in the editor. At most 1048576 entries are kept, about 150 MB.";

impl Facts {
    fn of(recorded: &Recorded) -> Facts {
        let sample = &recorded.sample;
        let is_print = |kind: &TraceKind| matches!(kind, TraceKind::Print(..));
        let entries = sample.recording.entries.iter().filter(|entry| is_print(&entry.kind));
        Facts {
            sample: recorded.pixel.sample,
            radiance: sample.radiance,
            outputs: sample.outputs.clone(),
            prints: entries.map(ToString::to_string).collect(),
            not_finite: Report::of(&sample.recording),
        }
    }

    fn show(&self, ui: &mut Ui, request: &mut Option<Request>) {
        let radiance = numbers(&self.radiance);
        egui::Grid::new("facts").num_columns(2).show(ui, |ui| {
            ui.label(format!("sample {}", self.sample));
            let is_finite = self.radiance.iter().all(|channel| channel.is_finite());
            let color = if is_finite { theme::TEXT } else { theme::ERROR };
            show_numbers(ui, radiance, color);
            ui.end_row();
            for (name, values) in &self.outputs {
                ui.label(RichText::new(name).color(theme::FAINT));
                show_numbers(ui, numbers(values), theme::TEXT);
                ui.end_row();
            }
        });
        if let Some(report) = &self.not_finite
            && show_report(ui, report)
        {
            *request = report.place.clone().map(Request::GoTo).or(request.take());
        }
        for print in &self.prints {
            ui.add(egui::Label::new(RichText::new(print).monospace()).wrap());
        }
    }
}

/// Shows numbers in one line; all of them under the pointer if they do not fit.
fn show_numbers(ui: &mut Ui, numbers: String, color: egui::Color32) {
    ui.add(egui::Label::new(RichText::new(numbers).monospace().color(color)).truncate());
}

/// Shows a report of a value that is not finite; returns true if its line is asked for.
pub fn show_report(ui: &mut Ui, report: &Report) -> bool {
    ui.add(egui::Label::new(RichText::new(&report.message).color(theme::ERROR)).wrap());
    let mut is_clicked = false;
    if let Some(place) = &report.place {
        let text = std::path::Path::new(&place.text);
        let name =
            text.file_name().map_or(place.text.as_str().into(), |name| name.to_string_lossy());
        let link = format!("{name}:{}: {}", place.line, place.code);
        is_clicked = ui.link(RichText::new(link).monospace()).clicked();
    }
    for note in &report.notes {
        ui.label(RichText::new(note).small().color(theme::FAINT));
    }
    is_clicked
}

fn show_object(ui: &mut Ui, picked: Option<&Picked>) {
    let Some(picked) = picked else {
        ui.label("no object");
        return;
    };
    let [x, y, z] = picked.position;
    let rows = [
        ("object", format!("{}: {}", picked.title, picked.class)),
        ("material", picked.material_class.clone()),
        ("distance", format!("{:.4}", picked.distance)),
        ("position", format!("{x:.4}, {y:.4}, {z:.4}")),
    ];
    egui::Grid::new("object").num_columns(2).show(ui, |ui| {
        for (name, value) in rows {
            ui.label(RichText::new(name).color(theme::FAINT));
            ui.add(egui::Label::new(value).truncate());
            ui.end_row();
        }
    });
}

/// Shows the calls around the position; a click shows the variables of one.
fn show_frames(ui: &mut Ui, debugging: &mut Debugging) {
    let mut chosen = None;
    for (index, frame) in debugging.frames.iter().enumerate() {
        let is_selected = index == debugging.selected;
        if ui.selectable_label(is_selected, RichText::new(named(frame)).monospace()).clicked() {
            chosen = Some(index);
        }
    }
    if let Some(index) = chosen {
        debugging.select(index);
    }
}

fn named(frame: &Frame) -> String {
    let mut text = frame.name.to_string();
    if let Some(reference) = &frame.reference {
        text += &format!(" of `{reference}`");
    }
    if let Some(line) = frame.line() {
        text += &format!(":{line}");
    }
    text
}

/// Shows a value, with its parts if it has any that need more than a line.
fn show_value(ui: &mut Ui, name: &str, value: &TracedValue) {
    let text = value.to_string();
    let line = RichText::new(format!("{name} = {text}")).monospace();
    let parts = value.parts();
    let hover = debugging::type_of(value);
    if parts.is_empty() || text.len() < 48 {
        ui.add(egui::Label::new(line).wrap()).on_hover_text(hover);
        return;
    }
    let header = CollapsingHeader::new(RichText::new(name).monospace()).id_salt((name, "value"));
    header.show(ui, |ui| {
        parts.iter().for_each(|part| show_value(ui, part.name(), part));
    });
}

fn numbers(values: &[f32]) -> String {
    values.iter().map(|value| format!("{value:?}")).collect::<Vec<_>>().join(", ")
}

/// A recorder with the jobs that wait for it.
#[derive(Default)]
pub struct Jobs {
    recorder: Recorder,
    waiting: Option<(Probe, Job)>,
}

impl Jobs {
    /// Starts a job, or lets it wait for the one that is running, instead of another one that waits.
    pub fn start(&mut self, context: &Context, probe: Probe, job: Job) {
        match self.recorder.running() {
            None => self.recorder.start(context, probe, job),
            Some(_) => self.waiting = Some((probe, job)),
        }
    }

    /// Returns the outcome of a job that is done, and starts the next.
    pub fn take(&mut self, context: &Context) -> Option<(Job, Outcome)> {
        let done = self.recorder.take()?;
        if let Some((probe, job)) = self.waiting.take() {
            self.recorder.start(context, probe, job);
        }
        Some(done)
    }

    /// True while a job runs.
    pub fn is_busy(&self) -> bool {
        self.recorder.running().is_some()
    }
}
