//! `rtsl help`: the help of commands, and the manual.

use clap::{Args, CommandFactory};

use super::{CommandResult, Failure, Outcome};
use crate::arguments::Arguments;
use crate::files::write_result;
use crate::names::no_such;

/// The command line of `rtsl help`.
#[derive(Debug, Args)]
pub struct HelpArguments {
    /// A command, or a part of the manual: guide, cli, language, roles, builtins, scenes,
    /// viewer, embedding, c, libraries, stability, diagnostics, glsl, architecture.
    topic: Option<String>,
}

/// A part of the manual.
struct Topic {
    name: &'static str,
    title: &'static str,
    text: &'static str,
}

macro_rules! topics {
    ($($name:literal $title:literal $file:literal;)*) => {
        &[$(Topic {
            name: $name,
            title: $title,
            text: include_str!(concat!("../../../../docs/src/", $file)),
        },)*]
    };
}

const TOPICS: &[Topic] = topics! {
    "guide" "from the first picture to your own shaders" "tutorial/first-picture.md";
    "cli" "the commands and their JSON" "reference/command-line.md";
    "language" "the language" "reference/language.md";
    "roles" "roles, methods and state variables" "reference/roles.md";
    "builtins" "built-in functions" "reference/builtins.md";
    "scenes" "the format of scenes" "reference/scenes.md";
    "viewer" "the window of `rtsl view`" "how-to/viewer.md";
    "embedding" "RTSL in your own renderer" "how-to/embed-rust.md";
    "c" "the C interface" "how-to/embed-c.md";
    "libraries" "shaders compiled ahead of time" "how-to/ahead-of-time.md";
    "stability" "what stays as it is from version to version" "reference/stability.md";
    "diagnostics" "all errors and warnings" "reference/diagnostics.md";
    "glsl" "what RTSL has of GLSL" "reference/glsl.md";
    "architecture" "how the compiler is built" "explanation/architecture.md";
};

/// Prints the help of a command or a part of the manual.
pub fn run(arguments: &HelpArguments) -> CommandResult {
    let mut command = Arguments::command();
    let text = match &arguments.topic {
        None => format!("{}\n{}", command.render_long_help(), topic_list()),
        Some(topic) => {
            if let Some(page) = TOPICS.iter().find(|page| page.name == topic) {
                page.text.to_owned()
            } else if let Some(subcommand) = command.find_subcommand_mut(topic) {
                let named = subcommand.clone().bin_name(format!("rtsl {topic}"));
                format!("{}", named.clone().render_long_help())
            } else {
                return Err(Failure::Usage(unknown_topic(topic)));
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

fn unknown_topic(topic: &str) -> String {
    let commands = Arguments::command();
    let commands = commands.get_subcommands().map(clap::Command::get_name);
    let names = TOPICS.iter().map(|topic| topic.name).chain(commands);
    no_such("help on", topic, names)
}
