//! `rtsl help`: the help of commands, and the book.

use clap::{Args, Command};

use crate::files::write_result;
use crate::names::no_such;
use crate::outcome::{CommandResult, Failure, Outcome};

/// The command line of `rtsl help`.
#[derive(Debug, Args)]
pub struct HelpArguments {
    /// A command, or a part of the book: guide, cli, language, roles, builtins, scenes, viewer,
    /// embedding, c, libraries, stability, diagnostics, glsl, determinism, untrusted, architecture.
    topic: Option<String>,
}

/// A part of the book.
struct Topic {
    name: &'static str,
    title: &'static str,
    /// Its pages, in the order of the book's table of contents.
    pages: &'static [&'static str],
}

macro_rules! topics {
    ($($name:literal $title:literal [$($file:literal)*];)*) => {
        &[$(Topic {
            name: $name,
            title: $title,
             pages: &[$(include_str!(concat!(env!("RTSL_DOCS"), "/src/", $file)),)*],
        },)*]
    };
}

const TOPICS: &[Topic] = topics! {
    "guide" "tutorial: a first picture, a primitive, a material" [
        "tutorial/first-picture.md"
        "tutorial/primitive.md"
        "tutorial/material.md"
        "tutorial/testing.md"
    ];
    "cli" "the commands and their JSON" [
        "reference/command-line.md"
        "reference/command-line/eval.md"
        "reference/command-line/debug.md"
        "reference/command-line/dap.md"
        "reference/command-line/test.md"
        "reference/command-line/bench.md"
        "reference/command-line/render.md"
        "reference/command-line/scene.md"
        "reference/command-line/import.md"
        "reference/command-line/project-file.md"
        "how-to/long-renders.md"
        "how-to/timings.md"
    ];
    "language" "the language" [
        "reference/language.md"
        "reference/language/source-text.md"
        "reference/language/classes.md"
        "reference/language/types.md"
        "reference/language/renderer.md"
        "reference/language/semantics.md"
        "reference/language/limits.md"
    ];
    "roles" "roles, methods and state variables" ["reference/roles.md"];
    "builtins" "built-in functions" ["reference/builtins.md"];
    "scenes" "the format of scenes" [
        "reference/scenes.md"
        "reference/scenes/standard-classes.md"
        "reference/scenes/meshes.md"
        "reference/scenes/settings.md"
        "reference/scenes/format.md"
        "reference/scenes/old-versions.md"
        "how-to/old-scenes.md"
    ];
    "viewer" "the window of `rtsl view`" ["how-to/viewer.md"];
    "embedding" "RTSL in your own renderer" [
        "how-to/embed.md"
        "how-to/embed-rust.md"
        "reference/kernels.md"
    ];
    "c" "the C interface" ["how-to/embed-c.md" "reference/c-interface.md"];
    "libraries" "shaders compiled ahead of time" [
        "how-to/ahead-of-time.md"
        "how-to/embed-cpp.md"
        "reference/kernel-interface.md"
    ];
    "stability" "compatibility between versions" ["reference/stability.md"];
    "diagnostics" "all errors and warnings" ["reference/diagnostics.md"];
    "glsl" "differences from GLSL" ["reference/glsl.md"];
    "determinism" "why results are the same everywhere" ["explanation/determinism.md"];
    "untrusted" "shaders from unknown sources" ["explanation/untrusted-shaders.md"];
    "architecture" "how the compiler is built" ["explanation/architecture.md"];
};

/// Prints the help of the program's `command`, of one of its subcommands, or a part of the book.
pub fn run(arguments: &HelpArguments, mut command: Command) -> CommandResult {
    let text = match &arguments.topic {
        None => format!("{}\n{}", command.render_long_help(), topic_list()),
        Some(topic) => {
            if let Some(page) = TOPICS.iter().find(|page| page.name == topic) {
                page.pages.join("\n")
            } else if let Some(subcommand) = command.find_subcommand_mut(topic) {
                let named = subcommand.clone().bin_name(format!("rtsl {topic}"));
                format!("{}", named.clone().render_long_help())
            } else {
                return Err(Failure::Usage(unknown_topic(topic, &command)));
            }
        }
    };
    write_result(None, text.as_bytes())?;
    Ok(Outcome::Done)
}

fn topic_list() -> String {
    let lines = TOPICS.iter().map(|topic| format!("  {:<13} {}\n", topic.name, topic.title));
    format!("Topics of `rtsl help`:\n{}", lines.collect::<String>())
}

fn unknown_topic(topic: &str, command: &Command) -> String {
    let commands = command.get_subcommands().map(Command::get_name);
    let names = TOPICS.iter().map(|topic| topic.name).chain(commands);
    no_such("help on", topic, names)
}
