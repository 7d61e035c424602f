//! Overlays of the image: figures, picks, messages, help.

use std::time::Duration;

use rtsl_render::session::{Picked, Status, ViewMode};

use crate::canvas::{Canvas, Color, LETTER, LINE, Rect};

const TEXT: Color = 0x00E8_E8E8;
const FAINT: Color = 0x00A8_A8A8;
const BACKGROUND: Color = 0x0010_1418;
const ERROR_BACKGROUND: Color = 0x0050_1010;
const MARGIN: i32 = 6;

/// The greatest number of lines of a message.
const MAX_LINES: usize = 16;

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
    ("i", "next integrator"),
    ("tab", "panel"),
    ("o", "figures"),
    ("h", "this help"),
    ("r", "read the files again"),
    ("f12", "picture of the window"),
    ("escape", "close messages"),
];

/// Paints figures of the last frames.
pub fn paint_figures(
    canvas: &mut Canvas<'_>,
    status: &Status,
    mode: ViewMode,
    frame_time: Duration,
    picked: Option<&Picked>,
) {
    let mut lines = figures(status, mode, frame_time);
    lines.extend(picked.map(describe));
    paint_block(canvas, MARGIN, MARGIN, &lines, TEXT, BACKGROUND);
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

/// Paints a message at the bottom, for example the error of a shader.
pub fn paint_message(canvas: &mut Canvas<'_>, message: &str) {
    let (width, height) = canvas.size();
    let letters = ((width - 4 * MARGIN) / LETTER).max(8) as usize;
    let mut lines: Vec<String> =
        message.trim_end().lines().flat_map(|line| wrapped(&plain(line), letters)).collect();
    if lines.len() > MAX_LINES {
        lines.truncate(MAX_LINES - 1);
        lines.push("...".to_owned());
    }
    let block = lines.len() as i32 * LINE + 2 * MARGIN;
    paint_block(canvas, MARGIN, height - block - MARGIN, &lines, TEXT, ERROR_BACKGROUND);
}

/// Paints the keys in the middle.
pub fn paint_help(canvas: &mut Canvas<'_>) {
    let line = |(keys, what): &(&str, &str)| format!("{keys:28}{what}");
    let lines: Vec<String> = HELP.iter().map(line).collect();
    let (width, height) = canvas.size();
    let (block_width, block_height) = block_size(&lines);
    let place = ((width - block_width) / 2, (height - block_height) / 2);
    paint_block(canvas, place.0.max(0), place.1.max(0), &lines, TEXT, BACKGROUND);
}

/// Paints one faint line at the bottom right.
pub fn paint_hint(canvas: &mut Canvas<'_>, hint: &str) {
    let (width, height) = canvas.size();
    let x = width - hint.chars().count() as i32 * LETTER - MARGIN;
    canvas.text(x, height - LINE, hint, FAINT);
}

fn block_size(lines: &[String]) -> (i32, i32) {
    let longest = lines.iter().map(|line| line.chars().count()).max().unwrap_or(0);
    (longest as i32 * LETTER + 2 * MARGIN, lines.len() as i32 * LINE + 2 * MARGIN)
}

fn paint_block(
    canvas: &mut Canvas<'_>,
    x: i32,
    y: i32,
    lines: &[String],
    color: Color,
    background: Color,
) {
    let (width, height) = block_size(lines);
    canvas.cover(Rect { x, y, width, height }, background);
    for (row, line) in (0..).zip(lines) {
        canvas.text(x + MARGIN, y + MARGIN + row * LINE, line, color);
    }
}

/// A number with three digits and a suffix for thousands.
fn in_thousands(number: f64) -> String {
    match number {
        n if n >= 1e9 => format!("{:.2} G", n / 1e9),
        n if n >= 1e6 => format!("{:.1} M", n / 1e6),
        n => format!("{:.0} k", n / 1e3),
    }
}

/// Replaces the line-drawing characters of diagnostics, which the font lacks.
fn plain(line: &str) -> String {
    line.chars()
        .map(|letter| match letter {
            '┌' | '└' | '╭' | '╰' => '+',
            '─' => '-',
            '│' | '·' => '|',
            other => other,
        })
        .collect()
}

fn wrapped(line: &str, letters: usize) -> Vec<String> {
    let letters_of: Vec<char> = line.chars().collect();
    if letters_of.is_empty() {
        return vec![String::new()];
    }
    letters_of.chunks(letters).map(|chunk| chunk.iter().collect()).collect()
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

    #[test]
    fn long_messages_are_wrapped_and_cut() {
        let mut pixels = vec![0; 200 * 300];
        let mut canvas = Canvas::new(&mut pixels, 200);
        paint_message(
            &mut canvas,
            &"┌─ a line that is too long for so small a window\n".repeat(30),
        );
        assert!(pixels[..200 * 20].iter().all(|pixel| *pixel == 0), "the top is free");
        assert!(pixels[200 * 290..].iter().any(|pixel| *pixel != 0));
    }
}
