//! The commands of the book run, on the files that its pages define.
//!
//! A block ```` ```rtsl file=NAME ```` or ```` ```pbrt file=NAME ```` is a file; with `append` it goes to the end of
//! that file. Commands are the lines of `sh` blocks, indented lines and, in the tutorial, words of the text, that begin
//! with `rtsl`. A `text` block behind a command has lines of its output in their order, where `...` stands for others.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use crate::command::{DONE, Folder, INPUT_AT_FAULT};

/// Files that pages of the reference name and do not define.
pub const GIVEN: [(&str, &str); 8] = [
    (
        "ball.rtsl",
        "class Ball : rt_Primitive;
        public float radius = 1.0;
        void intersect() {
            float a = dot(rt_RayDirection, rt_RayDirection), b = dot(rt_RayOrigin, rt_RayDirection);
            float root = sqrt(b * b - a * (dot(rt_RayOrigin, rt_RayOrigin) - radius * radius));
            if (!hit((-b - root) / a)) hit((root - b) / a);
        }",
    ),
    (
        "velvet.rtsl",
        "class Velvet : rt_Material;
        public float sharpness = 4.0;
        void BSDF() { rt_BSDFValue = color(0.2 / sharpness); }",
    ),
    ("waves.rtsl", "float height(float x) { return sin(x); }"),
    (
        "noise.rtsl",
        "class Clouds : rt_Texture;
        public int octaves = 2;
        float fbm(vec3 p) { return float(octaves) * noise(p) + rt_TextureUV.x; }
        void lookup() { rt_FloatTextureValue = fbm(rt_HitPoint); }",
    ),
    (
        "stripes.rtsl",
        "class Stripes : rt_Texture;
        float wave(float u) { return step(0.5, fract(4.0 * u)); }
        void lookup() { rt_FloatTextureValue = wave(rt_TextureUV.x); }",
    ),
    (
        "xray.rtsl",
        "class Count : rt_Integrator;
        void radiance() { rt_SampleColor = nearestHit().found ? color(1.0) : color(0.0); }",
    ),
    ("scene.pbrt", SCENE),
    ("xray.pbrt", SCENE),
];

pub const SCENE: &str = r#"LookAt 0 2 -8  0 0 0  0 1 0
Camera "Pinhole" "float fov" 35
WorldBegin
LightSource "SkyLight"
Shape "Sphere"
"#;

/// Pieces of commands that are not run: they wait for a user or a client, need other programs, or take long.
const NOT_RUN: [&str; 6] =
    ["rtsl view", "rtsl lsp", "rtsl dap", "--cluster", ".glb", "rtsl test scenes/"];

/// Folders of the repository that commands name.
const FOLDERS: [&str; 3] = ["shaders/", "scenes/", "bench/"];

/// The sizes of pictures that are made here.
const SMALL: [&str; 4] = ["--size", "16x12", "--spp", "1"];

/// A part of a page that matters here.
enum Part {
    File { name: String, text: String, is_appended: bool },
    Command(String),
    Shown(String),
}

fn repository() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..")
}

fn page(name: &str) -> String {
    let path = repository().join("docs/src").join(name);
    std::fs::read_to_string(&path).unwrap_or_else(|error| panic!("{}: {error}", path.display()))
}

/// The parts of a page, with the commands in its text if these count.
fn parts(page: &str, has_commands_in_text: bool) -> Vec<Part> {
    let is_command = |line: &&str| line.trim_start().starts_with("rtsl ");
    let mut parts = Vec::new();
    let mut lines = page.lines();
    while let Some(line) = lines.next() {
        let Some(fence) = line.strip_prefix("```") else {
            if line.starts_with("    ") && is_command(&line) {
                parts.push(Part::Command(line.trim().to_owned()));
            } else if has_commands_in_text {
                let spans = line.split('`').skip(1).step_by(2);
                let whole = spans.filter(|it| is_command(it) && it.split(' ').count() > 2);
                parts.extend(whole.map(|it| Part::Command(it.to_owned())));
            }
            continue;
        };
        let block: Vec<&str> = lines.by_ref().take_while(|line| *line != "```").collect();
        let words: Vec<&str> = fence.split(' ').collect();
        let text = || block.iter().map(|line| format!("{line}\n")).collect::<String>();
        if let Some(name) = words.iter().find_map(|word| word.strip_prefix("file=")) {
            let is_appended = words.contains(&"append");
            parts.push(Part::File { name: name.to_owned(), text: text(), is_appended });
        } else if words[0] == "sh" {
            let commands = block.iter().copied().filter(is_command);
            parts.extend(commands.map(|line| Part::Command(line.to_owned())));
        } else if words[0] == "text" {
            parts.push(Part::Shown(text()));
        }
    }
    parts
}

/// The words of a command, without quotation marks.
fn words(command: &str) -> Vec<String> {
    let mut words = vec![String::new()];
    let mut is_quoted = false;
    for letter in command.chars() {
        match letter {
            '\'' => is_quoted = !is_quoted,
            ' ' if !is_quoted => words.push(String::new()),
            _ => words.last_mut().unwrap().push(letter),
        }
    }
    words.retain(|word| !word.is_empty());
    words
}

/// The arguments of a command, for a small picture, and with paths from here.
fn arguments(command: &str) -> Vec<String> {
    let mut arguments = words(command).split_off(1);
    if arguments[0] == "render" {
        for option in ["--size", "--spp"] {
            if let Some(at) = arguments.iter().position(|it| it == option) {
                arguments.drain(at..at + 2);
            }
        }
        arguments.extend(SMALL.map(str::to_owned));
    }
    if let Some(pixel) = arguments.iter().position(|it| it == "--pixel") {
        arguments[pixel + 1] = "8,6".to_owned();
    }
    if arguments[0] == "debug" && arguments.iter().any(|it| it == "--pixel") {
        let samples = ["--size", "16x12", "--spp", "4"];
        arguments.extend(samples.map(str::to_owned));
    }
    for argument in &mut arguments {
        if FOLDERS.iter().any(|folder| argument.starts_with(folder)) {
            *argument = repository().join(&*argument).display().to_string();
        } else if let Some((_, name)) =
            argument.rsplit_once('/').filter(|_| !argument.contains('='))
        {
            *argument = name.to_owned();
        }
    }
    arguments
}

/// Runs the commands of pages that are read one after the other. Returns their number.
fn run_commands_of(pages: &[&str], given: &[(&str, &str)], has_commands_in_text: bool) -> usize {
    let folder = Folder::new("documented");
    given.iter().for_each(|(name, text)| folder.write(name, text));
    let mut files: BTreeMap<String, String> = BTreeMap::new();
    let mut count = 0;
    for name in pages {
        let text = page(name);
        let mut all = parts(&text, has_commands_in_text).into_iter().peekable();
        while let Some(part) = all.next() {
            match part {
                Part::File { name, text, is_appended } => {
                    let file = files.entry(name.clone()).or_default();
                    if !is_appended {
                        file.clear();
                    }
                    file.push_str(&text);
                    folder.write(&name, &*file);
                }
                Part::Command(command) if NOT_RUN.iter().any(|it| command.contains(it)) => {}
                Part::Command(command) => {
                    count += 1;
                    let shown = match all.peek() {
                        Some(Part::Shown(shown)) => shown.as_str(),
                        _ => "",
                    };
                    run(name, &folder, &command, shown);
                }
                Part::Shown(_) => {}
            }
        }
    }
    count
}

fn run(page: &str, folder: &Folder, command: &str, shown: &str) {
    let mut arguments = arguments(command);
    if arguments[0] == "bench" {
        arguments.extend(["--time", "1", "--width", "4"].map(str::to_owned));
    }
    let arguments: Vec<&str> = arguments.iter().map(String::as_str).collect();
    let ran = folder.run(&arguments);
    let printed = format!("{}{}", ran.errors(), ran.output());
    let expected = if shown.contains("BROKEN") { INPUT_AT_FAULT } else { DONE };
    assert_eq!(ran.code(), expected, "{page}: {command}\n{printed}");
    let mut lines = printed.lines().map(str::trim_end);
    for line in shown.lines().filter(|line| line.trim() != "...") {
        assert!(lines.any(|it| it == line), "{page}: {command}\nno line `{line}` in\n{printed}");
    }
}

#[test]
fn commands_of_the_tutorial_run() {
    let pages = ["first-picture", "primitive", "material", "testing"];
    let pages = pages.map(|page| format!("tutorial/{page}.md"));
    let count = run_commands_of(&pages.each_ref().map(String::as_str), &[], true);
    assert!(count >= 8, "{count} commands");
}

#[test]
fn commands_of_the_reference_run() {
    for (page, least) in [("eval", 4), ("debug", 3), ("test", 1), ("render", 3)] {
        let name = format!("reference/command-line/{page}.md");
        let count = run_commands_of(&[&name], &GIVEN, false);
        assert!(count >= least, "{page}: {count} commands");
    }
}
