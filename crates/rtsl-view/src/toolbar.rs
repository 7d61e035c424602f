//! The bar at the top: panes, the quantity that is displayed, the integrator.

use egui::{ComboBox, Ui};
use rtsl_render::session::{Session, ViewMode};

use crate::layout::{Panes, Side};

/// A choice in the bar that changes the session.
pub enum Choice {
    /// Another quantity.
    Mode(ViewMode),
    /// Another integrator.
    Integrator(String),
    /// The files are read again.
    Reload,
}

/// Shows the bar; panes are opened and closed at once.
pub fn show(ui: &mut Ui, panes: &mut Panes, session: &Session) -> Option<Choice> {
    let mut choice = None;
    ui.horizontal_centered(|ui| {
        ui.toggle_value(&mut panes.editor, "Editor").on_hover_text("The shaders of the scene (x)");
        for side in Side::ALL {
            if ui.selectable_label(panes.side == Some(side), side.name()).clicked() {
                panes.toggle(side);
            }
        }
        ui.separator();
        let mode = session.view_mode();
        ComboBox::from_id_salt("mode").selected_text(mode.name()).show_ui(ui, |ui| {
            for other in ViewMode::ALL {
                if ui.selectable_label(other == mode, other.name()).clicked() {
                    choice = Some(Choice::Mode(other));
                }
            }
        });
        let integrator = session.integrator();
        ComboBox::from_id_salt("integrator").selected_text(integrator).show_ui(ui, |ui| {
            for name in session.integrators() {
                let is_shown = name.eq_ignore_ascii_case(integrator);
                if ui.selectable_label(is_shown, &name).clicked() && !is_shown {
                    choice = Some(Choice::Integrator(name));
                }
            }
        });
        ui.separator();
        if ui.button("Reload").on_hover_text("Reads the files again (r)").clicked() {
            choice = Some(Choice::Reload);
        }
        ui.toggle_value(&mut panes.figures, "Figures").on_hover_text("Statistics (o)");
        ui.toggle_value(&mut panes.help, "Keys").on_hover_text("The keys of the viewer (h)");
    });
    choice
}
