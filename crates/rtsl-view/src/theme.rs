//! The colours and sizes of the controls.

use egui::{Color32, Context, FontFamily, FontId, Frame, Margin, TextStyle, Theme, Visuals};

/// Errors.
pub const ERROR: Color32 = Color32::from_rgb(0xF0, 0x70, 0x60);
/// Warnings.
pub const WARNING: Color32 = Color32::from_rgb(0xE8, 0xB8, 0x50);
/// Marks of places.
pub const ACCENT: Color32 = Color32::from_rgb(0x60, 0xA8, 0xE0);
/// Text of less importance.
pub const FAINT: Color32 = Color32::from_rgb(0x98, 0xA0, 0xA8);
/// Text over the picture.
pub const TEXT: Color32 = Color32::from_rgb(0xE8, 0xE8, 0xE8);

/// Sets the style of all controls: dark, so that the picture is the brightest part of the window.
pub fn apply(context: &Context) {
    context.set_theme(Theme::Dark);
    context.all_styles_mut(|style| {
        let size = |size: f32, family| FontId::new(size, family);
        style.text_styles = [
            (TextStyle::Small, size(11.0, FontFamily::Proportional)),
            (TextStyle::Body, size(13.0, FontFamily::Proportional)),
            (TextStyle::Button, size(13.0, FontFamily::Proportional)),
            (TextStyle::Heading, size(15.0, FontFamily::Proportional)),
            (TextStyle::Monospace, size(12.0, FontFamily::Monospace)),
        ]
        .into();
        style.spacing.item_spacing = egui::vec2(6.0, 4.0);
        style.spacing.slider_width = 110.0;
        style.visuals =
            Visuals { panel_fill: Color32::from_rgb(0x1B, 0x1E, 0x22), ..Visuals::dark() };
        style.visuals.override_text_color = Some(Color32::from_rgb(0xD8, 0xDC, 0xE0));
        style.visuals.warn_fg_color = WARNING;
        style.visuals.error_fg_color = ERROR;
        // Nothing moves by itself, so that the window rests when nothing happens.
        style.animation_time = 0.0;
    });
}

/// Returns the frame of text over the picture.
pub fn overlay(color: Color32) -> Frame {
    let [red, green, blue, _] = color.to_array();
    let fill = Color32::from_rgba_unmultiplied(red, green, blue, 200);
    Frame::new().fill(fill).inner_margin(Margin::same(6)).corner_radius(3)
}

/// The background of figures.
pub const FIGURES: Color32 = Color32::from_rgb(0x10, 0x14, 0x18);
/// The background of error messages.
pub const MESSAGE: Color32 = Color32::from_rgb(0x50, 0x10, 0x10);
