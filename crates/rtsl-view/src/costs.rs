//! The costs of the lines of shaders: their measurement by a thread, and the pane that shows them.

use std::collections::BTreeMap;
use std::sync::mpsc::{self, Receiver, TryRecvError};
use std::thread;

use egui::{Color32, Context, CursorIcon, RichText, ScrollArea, Ui};
use rtsl_render::measure::SceneLines;
use rtsl_render::session::{Probe, ViewMode};

use crate::theme;

/// The stack of the thread: each level of `trace` uses some of it.
const STACK_BYTES: usize = 128 << 20;

/// The pane of costs.
#[derive(Default)]
pub struct Costs {
    measured: Option<LineCosts>,
    /// The reason why they could not be measured.
    problem: Option<String>,
    running: Option<Receiver<Result<LineCosts, String>>>,
    /// True if the scene has changed since they were measured.
    is_old: bool,
}

/// A request of the pane.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Request {
    /// Show this quantity in the picture.
    Show(ViewMode),
    /// Show the most expensive line of the text with this name.
    Open(String),
    /// Measure the costs.
    Measure,
}

impl Costs {
    /// Returns the costs that were measured last.
    pub fn measured(&self) -> Option<&LineCosts> {
        self.measured.as_ref()
    }

    /// True while they are measured.
    pub fn is_busy(&self) -> bool {
        self.running.is_some()
    }

    /// Notes that the scene has changed. The costs stay until they are measured again.
    pub fn grow_old(&mut self) {
        self.is_old = true;
        self.problem = None;
    }

    /// Starts to measure.
    pub fn measure(&mut self, context: &Context, mut probe: Probe) {
        let (sender, receiver) = mpsc::channel();
        let context = context.clone();
        let run = move || {
            let measured = probe.lines().map(|lines| LineCosts::new(&lines));
            // The receiver is gone if the window is closed.
            let _ = sender.send(measured.map_err(|messages| messages.to_text(false)));
            context.request_repaint();
        };
        // Without a thread the receiver has no sender, which is told as the end of one.
        drop(thread::Builder::new().stack_size(STACK_BYTES).spawn(run));
        (self.running, self.is_old) = (Some(receiver), false);
    }

    /// Takes the costs if they are measured.
    pub fn take(&mut self) {
        let Some(running) = &self.running else { return };
        let measured = match running.try_recv() {
            Err(TryRecvError::Empty) => return,
            Err(TryRecvError::Disconnected) => Err("the thread that measures has ended".to_owned()),
            Ok(measured) => measured,
        };
        self.running = None;
        match measured {
            Ok(costs) => (self.measured, self.problem) = (Some(costs), None),
            Err(problem) => self.problem = Some(problem),
        }
    }

    /// Shows the pane.
    pub fn show(&self, ui: &mut Ui, mode: ViewMode) -> Option<Request> {
        let mut request = None;
        ui.label(RichText::new("In the picture").color(theme::FAINT));
        ui.horizontal_wrapped(|ui| {
            for other in [ViewMode::Image, ViewMode::Time, ViewMode::Nodes, ViewMode::Lanes] {
                if ui.selectable_label(mode == other, other.name()).clicked() {
                    request = Some(Request::Show(other));
                }
            }
        });
        ui.separator();
        ui.label(RichText::new("By shader").color(theme::FAINT));
        ui.horizontal(|ui| match self.running {
            Some(_) => {
                ui.spinner();
                ui.label("measuring");
            }
            None if ui.button("Measure again").clicked() => request = Some(Request::Measure),
            None if self.is_old => {
                ui.label(RichText::new("of the scene before the last change").color(theme::FAINT));
            }
            None => {}
        });
        if self.measured.is_none() && self.problem.is_none() && self.running.is_none() {
            request = Some(Request::Measure);
        }
        if let Some(problem) = &self.problem {
            ui.label(problem);
        }
        if let Some(costs) = &self.measured {
            let area = ScrollArea::vertical().auto_shrink(false);
            let opened = area.show(ui, |ui| costs.show(ui)).inner;
            request = opened.map(Request::Open).or(request);
        }
        request
    }
}

/// The costs of all shaders of a scene.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct LineCosts {
    /// The texts, by their names.
    pub texts: BTreeMap<String, TextCosts>,
    /// The names of texts with their shares of the whole cost, the greatest first; the renderer's is last.
    pub shares: Vec<(String, f32)>,
}

/// The costs of the lines of a text.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct TextCosts {
    /// The lines, from 1.
    pub lines: BTreeMap<u32, LineCost>,
    /// The greatest share of a line of any text.
    pub greatest: f32,
    /// The text.
    pub content: String,
}

/// The cost of a line.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct LineCost {
    /// The share of the whole cost of the scene's shaders, from 0 to 1.
    pub share: f32,
    /// The share of SIMD lanes that are active when it runs; `None` if all rays share its work.
    pub active: Option<f32>,
}

impl LineCosts {
    /// Converts measured costs to shares.
    pub fn new(lines: &SceneLines) -> LineCosts {
        let total = lines.millicycles().max(1) as f32;
        let mut costs = LineCosts::default();
        for text in &lines.texts {
            let share = text.millicycles() as f32 / total;
            costs.shares.push((SceneLines::title(text).to_owned(), share));
            let of_lines = text.lines.iter().filter(|line| line.line > 0).map(|line| {
                let active = line.active_share().map(|share| share as f32);
                (line.line, LineCost { share: line.millicycles as f32 / total, active })
            });
            let lines: BTreeMap<u32, LineCost> = of_lines.collect();
            if let Some(source) = &text.source {
                let content = source.text.to_string();
                let of_text = TextCosts { lines, greatest: 0.0, content };
                costs.texts.insert(text.name.to_string(), of_text);
            }
        }
        let all = costs.texts.values().flat_map(|text| text.lines.values());
        let greatest = all.map(|line| line.share).fold(0.0, f32::max);
        costs.texts.values_mut().for_each(|text| text.greatest = greatest);
        costs
    }

    /// Shows the shares of texts. Returns the name of the one that was clicked.
    fn show(&self, ui: &mut Ui) -> Option<String> {
        let mut clicked = None;
        for (name, share) in &self.shares {
            let has_text = self.texts.contains_key(name);
            if show_bar(ui, name, *share, has_text) {
                clicked = Some(name.clone());
            }
        }
        let lines = "Estimated for packets of rays, by counting operations. The editor shows the share of each line.";
        ui.label(RichText::new(lines).small().color(theme::FAINT));
        clicked
    }

    /// Returns a text's content and its most expensive line.
    pub fn dearest(&self, name: &str) -> Option<(&str, u32)> {
        let text = self.texts.get(name)?;
        let dearest = text.lines.iter().max_by(|a, b| a.1.share.total_cmp(&b.1.share));
        Some((&text.content, dearest.map_or(1, |(line, _)| *line)))
    }

    /// Returns the costs of the text with a name for which `is_name` is true.
    pub fn of_text(&self, is_name: impl Fn(&str) -> bool) -> Option<&TextCosts> {
        self.texts.iter().find(|(name, _)| is_name(name)).map(|(_, costs)| costs)
    }
}

/// Returns the colour of a cost on a scale from 0 to 1.
pub fn color_of(part: f32) -> Color32 {
    let part = part.clamp(0.0, 1.0);
    let between = |cold: f32, hot: f32| (cold + (hot - cold) * part) as u8;
    Color32::from_rgb(between(40.0, 200.0), between(60.0, 60.0), between(90.0, 30.0))
}

/// Shows a name with a bar of its share. Returns true if it was clicked.
fn show_bar(ui: &mut Ui, name: &str, share: f32, has_text: bool) -> bool {
    let size = egui::vec2(ui.available_width(), ui.spacing().interact_size.y);
    let sense = if has_text { egui::Sense::click() } else { egui::Sense::hover() };
    let (rect, response) = ui.allocate_exact_size(size, sense);
    response.widget_info(|| egui::WidgetInfo::labeled(egui::Role::Button, has_text, name));
    let bar = rect.with_max_x(rect.left() + rect.width() * share.clamp(0.0, 1.0));
    ui.painter().rect_filled(bar, 1.0, color_of(share));
    let font = egui::TextStyle::Body.resolve(ui.style());
    let (left, right) = (egui::Align2::LEFT_CENTER, egui::Align2::RIGHT_CENTER);
    let inner = rect.shrink2(egui::vec2(4.0, 0.0));
    // Names of files begin with folders, which most of them share.
    let short = name.strip_prefix("shaders/").unwrap_or(name);
    ui.painter().text(inner.left_center(), left, short, font.clone(), theme::TEXT);
    let share = format!("{:.1} %", share * 100.0);
    ui.painter().text(inner.right_center(), right, share, font, theme::TEXT);
    response
        .on_hover_cursor(if has_text { CursorIcon::PointingHand } else { CursorIcon::Default })
        .clicked()
}
