//! Text over the picture: figures of the last frames, messages, keys.

use std::time::Duration;

use egui::{Align2, Area, Color32, Id, Rect, RichText, ScrollArea, Ui};
use rtsl_render::session::{Picked, Status, ViewMode};

use crate::theme;

const MARGIN: f32 = 6.0;

/// The keys and their functions.
pub const HELP: &[(&str, &str)] = &[
    ("left drag", "orbit"),
    ("middle drag, shift + left", "pan"),
    ("right drag", "look around"),
    ("wheel, + and -", "dolly"),
    ("w a s d q e", "fly, with shift faster"),
    ("arrows", "orbit in steps"),
    ("click", "pick: names the object, selects its material, prints"),
    ("f", "orbit about what is under the pointer"),
    ("home", "the scene's camera"),
    ("c", "print the camera for the scene file"),
    ("1 2", "image, time per pixel"),
    ("3 4", "nodes per ray, lanes used"),
    ("5", "samples that are not finite"),
    ("i", "next integrator"),
    ("tab", "pane at the right"),
    ("x", "editor"),
    ("p", "inspector"),
    ("ctrl + s", "save the text in the editor"),
    ("f5 f10 f11", "replay: run, step over, step in; with shift back"),
    ("o", "figures"),
    ("h", "this help"),
    ("r", "read the files again"),
    ("f12", "picture of the window"),
    ("escape", "close messages"),
];

/// Shows figures of the last frames at the top left of the picture.
pub fn show_figures(
    ui: &Ui,
    image: Rect,
    status: &Status,
    mode: ViewMode,
    frame_time: Duration,
    picked: Option<&Picked>,
) {
    let mut lines = figures(status, mode, frame_time);
    lines.extend(picked.map(describe));
    let place = image.min + egui::vec2(MARGIN, MARGIN);
    let area = Area::new(Id::unique("figures")).fixed_pos(place).interactable(false);
    area.order(egui::Order::Middle).constrain(false).show(ui.ctx(), |ui| {
        theme::overlay(theme::FIGURES).show(ui, |ui| {
            let width = (image.width() - 4.0 * MARGIN).max(40.0);
            ui.set_max_width(width);
            for line in lines {
                let text = RichText::new(line).monospace().color(theme::TEXT);
                ui.add(egui::Label::new(text).wrap().selectable(false));
            }
        });
    });
}

/// Returns the figures as text.
pub fn figures(status: &Status, mode: ViewMode, frame_time: Duration) -> Vec<String> {
    let (width, height) = status.size;
    let reduced = match status.reduction {
        1 => String::new(),
        reduction => format!(" at 1/{reduction}"),
    };
    let lanes_used = status
        .lane_utilisation
        .map_or("-".to_owned(), |part| format!("{:.0} %", f64::from(part) * 100.0));
    let milliseconds = frame_time.as_secs_f64() * 1e3;
    vec![
        format!(
            "{milliseconds:.1} ms a frame{reduced}   {} rays/s   {}/{} samples   {width}x{height}",
            in_thousands(status.rays_per_second),
            status.samples,
            status.samples_wanted,
        ),
        format!(
            "{} lanes on {}, {} threads   lanes used {lanes_used}   {} by {}",
            status.width,
            status.target,
            status.threads,
            mode.name(),
            status.integrator
        ),
    ]
}

/// Returns a description of a pick.
pub fn describe(picked: &Picked) -> String {
    let [x, y, z] = picked.position;
    format!(
        "{}: {}, {}   at {:.3}   ({x:.3}, {y:.3}, {z:.3})",
        picked.title, picked.class, picked.material_class, picked.distance
    )
}

/// Shows a message at the bottom of the picture, for example the error of a shader. Returns true if it is closed.
pub fn show_message(ui: &Ui, image: Rect, message: &str) -> bool {
    let mut is_closed = false;
    let area = Area::new(Id::unique("message")).pivot(Align2::LEFT_BOTTOM);
    let place = image.left_bottom() + egui::vec2(MARGIN, -MARGIN);
    area.fixed_pos(place).order(egui::Order::Middle).show(ui.ctx(), |ui| {
        theme::overlay(theme::MESSAGE).show(ui, |ui| {
            ui.set_max_width((image.width() - 4.0 * MARGIN).max(60.0));
            ui.set_max_height((image.height() - 4.0 * MARGIN).max(30.0));
            ui.horizontal_top(|ui| {
                is_closed = ui.small_button("×").on_hover_text("Close (escape)").clicked();
                let limit = (image.height() * 0.6).max(30.0);
                ScrollArea::both().max_height(limit).auto_shrink(true).show(ui, |ui| {
                    let text = RichText::new(message.trim_end()).monospace().color(Color32::WHITE);
                    ui.add(egui::Label::new(text).extend());
                });
            });
        });
    });
    is_closed
}

/// Shows the keys in the middle of the picture.
pub fn show_help(ui: &Ui, image: Rect) {
    let area = Area::new(Id::unique("help")).pivot(Align2::CENTER_CENTER).fixed_pos(image.center());
    area.order(egui::Order::Foreground).show(ui.ctx(), |ui| {
        theme::overlay(theme::FIGURES).show(ui, |ui| {
            egui::Grid::new("keys").num_columns(2).spacing([24.0, 3.0]).show(ui, |ui| {
                for (keys, what) in HELP {
                    ui.label(RichText::new(*keys).monospace().color(theme::ACCENT));
                    ui.label(RichText::new(*what).color(theme::TEXT));
                    ui.end_row();
                }
            });
        });
    });
}

/// A number with three digits and a suffix for thousands.
fn in_thousands(number: f64) -> String {
    match number {
        n if n >= 1e9 => format!("{:.2} G", n / 1e9),
        n if n >= 1e6 => format!("{:.1} M", n / 1e6),
        n => format!("{:.0} k", n / 1e3),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn figures_say_what_is_known() {
        let status = Status {
            size: (640, 360),
            samples: 3,
            samples_wanted: 16,
            reduction: 2,
            rays_per_second: 12_345_678.0,
            width: 8,
            target: "znver3".to_owned(),
            threads: 2,
            integrator: "Path".to_owned(),
            ..Status::default()
        };
        let lines = figures(&status, ViewMode::Image, Duration::from_micros(12_340));
        assert_eq!(
            lines,
            [
                "12.3 ms a frame at 1/2   12.3 M rays/s   3/16 samples   640x360",
                "8 lanes on znver3, 2 threads   lanes used -   image by Path"
            ]
        );
    }
}
