//! `rtsl bench SCENE --lines`: the cost of the shaders of a scene by lines of their texts.

use std::fmt::Write;

use rtsl_render::measure::{SceneLines, measure_lines};
use serde::Serialize;

use super::arguments::BenchArguments;
use super::line_table::{json_lines, table};
use super::scene::{check, request};
use crate::commands::render::report;
use crate::files::write_result;
use crate::outcome::{CommandResult, Outcome};
use crate::report::Reporter;

/// Measures and prints the lines, for the first requested width.
pub fn run(arguments: &BenchArguments, reporter: &Reporter) -> CommandResult {
    check(arguments)?;
    let measured = measure_lines(&request(arguments, arguments.widths.first().copied()));
    let lines = match measured {
        Ok(lines) => lines,
        Err(messages) => {
            report(&messages, reporter);
            return Ok(Outcome::InputAtFault);
        }
    };
    report(&lines.warnings, reporter);
    let scene = arguments.file.display().to_string();
    let text = if arguments.json { json(&scene, &lines) } else { plain(&scene, &lines) };
    write_result(None, text.as_bytes())?;
    Ok(Outcome::Done)
}

fn plain(scene: &str, lines: &SceneLines) -> String {
    let SceneLines { texts, paths, width, .. } = lines;
    let total = lines.millicycles();
    let cycles = total as f64 / 1000.0 / (*paths).max(1) as f64;
    let mut text = format!(
        "{scene}: {paths} paths, {width} rays at a time; about {cycles:.0} cycles a path\n   cost  \
         text\n"
    );
    for of in texts {
        let share = 100.0 * of.millicycles() as f64 / total.max(1) as f64;
        // Writing to a string cannot fail.
        let _ = writeln!(text, "{share:>6.1}%  {}", SceneLines::title(of));
    }
    for of in texts.iter().filter(|of| of.source.is_some()) {
        text.push('\n');
        text += &table(&of.lines, of.source.as_deref(), total);
    }
    text
}

fn json(scene: &str, lines: &SceneLines) -> String {
    let (total, head) = (lines.millicycles(), Head { scene, width: lines.width });
    let of_text = |of: &rtsl::TextCosts| json_lines(&head, &of.lines, total, lines.paths);
    lines.texts.iter().map(of_text).collect()
}

/// The members of all objects.
#[derive(Serialize)]
struct Head<'a> {
    scene: &'a str,
    width: u32,
}
