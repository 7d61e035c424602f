//! The commands of the page on debugging print what the page shows.
//!
//! A block ```` ```rtsl file=NAME ```` or ```` ```pbrt file=NAME ```` is a file. A block that begins with `$ rtsl` is a
//! command with its output, standard error first. `| grep WORD` shows the lines that contain a word.

use std::path::{Path, PathBuf};

use crate::command::Folder;

fn page() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../docs/src/how-to/debug-a-shader.md")
}

/// The output of a command of the page.
fn printed(folder: &Folder, command: &str) -> String {
    let (command, word) = match command.split_once(" | grep ") {
        Some((command, word)) => (command, Some(word)),
        None => (command, None),
    };
    let arguments: Vec<&str> = command.split(' ').skip(1).collect();
    let ran = folder.run(&arguments);
    let all = match word {
        Some(word) => ran
            .output()
            .lines()
            .filter(|line| line.contains(word))
            .fold(String::new(), |text, line| text + line + "\n"),
        None => format!("{}{}", ran.errors(), ran.output()),
    };
    all.trim_end().lines().map(|line| format!("{}\n", line.trim_end())).collect()
}

#[test]
fn commands_of_the_page_print_what_it_shows() {
    let written = std::fs::read_to_string(page()).unwrap();
    let folder = Folder::new("guide");
    let mut current = String::new();
    let mut lines = written.lines();
    let mut commands = 0;
    while let Some(line) = lines.next() {
        current += &format!("{line}\n");
        let Some(fence) = line.strip_prefix("```") else { continue };
        let block: Vec<&str> = lines.by_ref().take_while(|line| *line != "```").collect();
        let block = block.iter().map(|line| format!("{line}\n")).collect::<String>();
        if let Some((_, name)) = fence.split_once("file=") {
            folder.write(name, &block);
        }
        match block.lines().next().and_then(|line| line.strip_prefix("$ ")) {
            Some(command) => {
                commands += 1;
                current += &format!("$ {command}\n{}", printed(&folder, command));
            }
            None => current += &block,
        }
        current += "```\n";
    }
    assert!(commands > 5, "{commands} commands");
    if current != written && std::env::var_os("UPDATE_EXPECT").is_some() {
        return std::fs::write(page(), current).unwrap();
    }
    assert_eq!(current, written, "run this test with UPDATE_EXPECT=1");
}
