//! The costs of the lines of shaders, and their colours.

use std::collections::BTreeMap;

use egui::{Color32, RichText, ScrollArea, Ui};
use rtsl_render::session::{Session, ViewMode};

use crate::theme;

/// The costs of all shaders of a scene.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct LineCosts {
    /// The texts, by their names.
    pub texts: BTreeMap<String, TextCosts>,
    /// The classes, by their names, with their share of the whole cost.
    pub classes: Vec<(String, f32)>,
}

/// The costs of the lines of a text.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct TextCosts {
    /// The lines, from 1.
    pub lines: BTreeMap<u32, LineCost>,
    /// The greatest share of a line of any text.
    pub greatest: f32,
}

/// The cost of a line.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct LineCost {
    /// The share of the whole cost of the scene's shaders, from 0 to 1.
    pub share: f32,
    /// The share of SIMD lanes that are active when it runs.
    pub active: f32,
}

impl LineCosts {
    /// Returns the costs of the text with a name for which `is_name` is true.
    pub fn of_text(&self, is_name: impl Fn(&str) -> bool) -> Option<&TextCosts> {
        self.texts.iter().find(|(name, _)| is_name(name)).map(|(_, costs)| costs)
    }
}

/// Measures the costs of the lines of a session's shaders.
// The one place where costs come from: sessions do not offer them yet.
pub fn measure(_session: &Session) -> Option<LineCosts> {
    None
}

/// Returns the colour of a cost on a scale from 0 to 1.
pub fn color_of(part: f32) -> Color32 {
    let part = part.clamp(0.0, 1.0);
    let between = |cold: f32, hot: f32| (cold + (hot - cold) * part) as u8;
    Color32::from_rgb(between(40.0, 200.0), between(60.0, 60.0), between(90.0, 30.0))
}

/// Shows the costs of classes, the greatest first.
pub fn show(ui: &mut Ui, costs: Option<&LineCosts>, mode: ViewMode) -> Option<ViewMode> {
    let mut chosen = None;
    ui.label(RichText::new("In the picture").color(theme::FAINT));
    ui.horizontal_wrapped(|ui| {
        for other in [ViewMode::Image, ViewMode::Time, ViewMode::Nodes, ViewMode::Lanes] {
            if ui.selectable_label(mode == other, other.name()).clicked() {
                chosen = Some(other);
            }
        }
    });
    let Some(costs) = costs else { return chosen };
    ui.separator();
    ScrollArea::vertical().auto_shrink(false).show(ui, |ui| {
        ui.label(RichText::new("By shader").color(theme::FAINT));
        for (class, share) in &costs.classes {
            let size = egui::vec2(ui.available_width(), ui.spacing().interact_size.y);
            let (rect, _) = ui.allocate_exact_size(size, egui::Sense::hover());
            let bar = rect.with_max_x(rect.left() + rect.width() * share.clamp(0.0, 1.0));
            ui.painter().rect_filled(bar, 1.0, color_of(*share));
            let font = egui::TextStyle::Body.resolve(ui.style());
            let (left, right) = (egui::Align2::LEFT_CENTER, egui::Align2::RIGHT_CENTER);
            let inner = rect.shrink2(egui::vec2(4.0, 0.0));
            ui.painter().text(inner.left_center(), left, class, font.clone(), theme::TEXT);
            let share = format!("{:.1} %", share * 100.0);
            ui.painter().text(inner.right_center(), right, share, font, theme::TEXT);
        }
        let lines = "The editor shows the share of each line.";
        ui.label(RichText::new(lines).small().color(theme::FAINT));
    });
    chosen
}
