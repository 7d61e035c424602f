//! The pane of parameters: the parts of the scene, and a control for each parameter of the selected one.

use egui::{Checkbox, ComboBox, DragValue, RichText, ScrollArea, Slider, Ui};
use rtsl_render::session::{Control, ControlKind, Thing};
use rtsl_scene::EntityId;

use crate::theme;

/// The parts of the scene, and the parameters of the selected one.
#[derive(Debug, Default)]
pub struct Parameters {
    /// The parts of the scene.
    pub things: Vec<Thing>,
    /// The parameters of the selected part.
    pub controls: Vec<Control>,
    selected: Option<EntityId>,
    /// The parameter whose value was refused, and the reason.
    refused: Option<(String, String)>,
    /// True if the selected part is to be scrolled into view.
    is_sought: bool,
}

/// A request of the pane.
#[derive(Clone, Debug, PartialEq)]
pub enum Request {
    /// Show the parameters of a part.
    Select(EntityId),
    /// Set a parameter of the selected part.
    Set {
        /// Its name.
        name: String,
        /// All its components.
        values: Vec<f64>,
    },
}

impl Parameters {
    /// Creates a pane of these parts, none of them selected.
    pub fn new(things: Vec<Thing>) -> Self {
        Parameters { things, ..Parameters::default() }
    }

    /// Returns the selected part.
    pub fn selected(&self) -> Option<EntityId> {
        self.selected
    }

    /// Selects a part with these parameters, and scrolls to it.
    pub fn select(&mut self, entity: Option<EntityId>, controls: Vec<Control>) {
        self.is_sought |= self.selected != entity;
        self.selected = entity;
        self.controls = controls;
        self.refused = None;
    }

    /// Takes the answer to a value that was set: the reason why it was refused, with the values that are kept.
    pub fn answer(&mut self, name: &str, refusal: Option<(String, Vec<Control>)>) {
        self.refused = None;
        if let Some((reason, controls)) = refusal {
            self.controls = controls;
            self.refused = Some((name.to_owned(), reason));
        }
    }

    /// Shows the pane.
    pub fn show(&mut self, ui: &mut Ui) -> Option<Request> {
        let mut request = None;
        ScrollArea::vertical().auto_shrink(false).show(ui, |ui| {
            for index in 0..self.things.len() {
                let is_selected = Some(self.things[index].entity) == self.selected;
                if show_thing(ui, &self.things[index], is_selected, self.is_sought) {
                    request = Some(Request::Select(self.things[index].entity));
                }
                if is_selected {
                    ui.indent("controls", |ui| {
                        let set = self.show_controls(ui);
                        request = set.or(request.take());
                    });
                }
            }
        });
        self.is_sought = false;
        request
    }

    fn show_controls(&mut self, ui: &mut Ui) -> Option<Request> {
        let mut request = None;
        if self.controls.is_empty() {
            ui.label(RichText::new("no parameters").color(theme::FAINT));
        }
        for control in &mut self.controls {
            if show_control(ui, control) {
                let (name, values) = (control.name.clone(), control.values.clone());
                request = Some(Request::Set { name, values });
            }
            if let Some((_, reason)) = self.refused.as_ref().filter(|(of, _)| *of == control.name) {
                let text = RichText::new(reason.trim_end()).small().color(theme::ERROR);
                ui.add(egui::Label::new(text).wrap());
            }
        }
        request
    }
}

/// Shows a part; returns true if it is clicked.
fn show_thing(ui: &mut Ui, thing: &Thing, is_selected: bool, is_sought: bool) -> bool {
    let size = egui::vec2(ui.available_width(), ui.spacing().interact_size.y);
    let (rect, response) = ui.allocate_exact_size(size, egui::Sense::click());
    if is_selected && is_sought {
        response.scroll_to_me(Some(egui::Align::Center));
    }
    response.widget_info(|| {
        egui::WidgetInfo::selected(egui::Role::Button, true, is_selected, &thing.title)
    });
    let style = ui.style().interact_selectable(&response, is_selected);
    if is_selected || response.hovered() {
        ui.painter().rect_filled(rect, 2.0, style.weak_bg_fill);
    }
    let inner = rect.shrink2(egui::vec2(4.0, 0.0));
    let font = egui::TextStyle::Body.resolve(ui.style());
    let painter = ui.painter_at(inner);
    let (right, center) = (egui::Align2::RIGHT_CENTER, egui::Align2::LEFT_CENTER);
    let class = painter.text(inner.right_center(), right, &thing.class, font.clone(), theme::FAINT);
    let room = egui::Rect::from_min_max(inner.min, egui::pos2(class.left() - 6.0, inner.max.y));
    let color = ui.visuals().text_color();
    ui.painter_at(room).text(inner.left_center(), center, &thing.title, font, color);
    response.clicked()
}

/// Shows a parameter; returns true if its value is changed.
fn show_control(ui: &mut Ui, control: &mut Control) -> bool {
    let label = match &control.unit {
        Some(unit) => format!("{} ({unit})", control.label),
        None => control.label.clone(),
    };
    let doc = control.doc.clone().unwrap_or_else(|| format!("Parameter `{}`.", control.name));
    let mut is_changed = false;
    ui.horizontal(|ui| {
        // Labels stand in a column of their own.
        let size = egui::vec2(LABELS, ui.spacing().interact_size.y);
        let layout = egui::Layout::left_to_right(egui::Align::Center);
        ui.allocate_ui_with_layout(size, layout, |ui| {
            ui.set_min_width(LABELS);
            ui.add(egui::Label::new(&label).truncate()).on_hover_text(&doc);
        });
        is_changed = match (control.kind, control.choices.is_empty()) {
            (_, false) => show_choice(ui, control),
            (ControlKind::Truth, _) => show_truth(ui, control),
            (ControlKind::Color, _) if control.values.len() == 3 => show_color(ui, control),
            _ => show_numbers(ui, control),
        };
    });
    is_changed
}

/// The width of the labels.
const LABELS: f32 = 120.0;

fn show_choice(ui: &mut Ui, control: &mut Control) -> bool {
    let now = control.values[0];
    let named = control.choices.iter().find(|(_, number)| *number == now);
    let text = named.map_or_else(|| format!("{now:.0}"), |(name, _)| name.clone());
    let mut chosen = None;
    ComboBox::from_id_salt(&control.name).selected_text(text).show_ui(ui, |ui| {
        for (name, number) in &control.choices {
            if ui.selectable_label(*number == now, name).clicked() && *number != now {
                chosen = Some(*number);
            }
        }
    });
    control.values[0] = chosen.unwrap_or(now);
    chosen.is_some()
}

fn show_truth(ui: &mut Ui, control: &mut Control) -> bool {
    let mut is_changed = false;
    for value in &mut control.values {
        let mut is_true = *value != 0.0;
        if ui.add(Checkbox::without_text(&mut is_true)).changed() {
            *value = f64::from(is_true);
            is_changed = true;
        }
    }
    is_changed
}

/// A colour has a field for each channel, since it may be brighter than white, and a picker while it is not.
fn show_color(ui: &mut Ui, control: &mut Control) -> bool {
    let mut is_changed = false;
    if control.values.iter().all(|value| (0.0..=1.0).contains(value)) {
        let mut color = [0, 1, 2].map(|channel: usize| control.values[channel] as f32);
        if ui.color_edit_button_rgb(&mut color).changed() {
            control.values = color.map(rounded).to_vec();
            is_changed = true;
        }
    }
    let names = ["red", "green", "blue"];
    let (least, greatest) = (control.min, control.max);
    for (value, name) in control.values.iter_mut().zip(names) {
        let field = field(value, ControlKind::Color, least.or(Some(0.0)), greatest);
        is_changed |= ui.add(field).on_hover_text(name).changed();
    }
    is_changed
}

fn show_numbers(ui: &mut Ui, control: &mut Control) -> bool {
    let mut is_changed = false;
    let count = control.values.len();
    let (kind, least, greatest) = (control.kind, control.min, control.max);
    for value in &mut control.values {
        let changed = match (least, greatest) {
            (Some(least), Some(greatest)) if least < greatest && count == 1 => {
                // The scene may give a value outside, which stays until it is changed.
                let range = least.min(*value)..=greatest.max(*value);
                let slider = Slider::new(value, range).max_decimals(4);
                let slider = if kind == ControlKind::Whole { slider.integer() } else { slider };
                ui.add(slider).changed()
            }
            _ => ui.add(field(value, kind, least, greatest)).changed(),
        };
        if changed {
            // Parameters are floats; what lies between them may round to outside of the range.
            let number =
                if kind == ControlKind::Whole { value.round() } else { rounded(*value as f32) };
            *value = number.max(least.unwrap_or(number)).min(greatest.unwrap_or(number));
            is_changed = true;
        }
    }
    is_changed
}

/// A field that is dragged by a hundredth of its value for each pixel, or typed into.
fn field(
    value: &mut f64,
    kind: ControlKind,
    least: Option<f64>,
    greatest: Option<f64>,
) -> DragValue<'_> {
    let speed = match kind {
        ControlKind::Whole => 0.1,
        _ => value.abs().max(0.1) * 0.01,
    };
    let range = least.unwrap_or(f64::NEG_INFINITY)..=greatest.unwrap_or(f64::INFINITY);
    let field = DragValue::new(value).speed(speed).range(range).clamp_existing_to_range(false);
    if kind == ControlKind::Whole { field.fixed_decimals(0) } else { field.max_decimals(4) }
}

/// The shortest decimal number that rounds to a float.
fn rounded(x: f32) -> f64 {
    x.to_string().parse().unwrap_or(f64::from(x))
}
