//! The commands of pages: those of `rtsl` run, and all others name what there is.
//!
//! A page is read as its user reads it. Its blocks of files, ```` ```rtsl file=NAME ````, and its commands, in blocks
//! ```` ```sh ```` and ```` ```console ```` and on indented lines, come in order, in a folder that looks like the
//! repository. Renders are made small.

use std::path::{Path, PathBuf};

use crate::command::{Folder, Ran};
use crate::documented_commands::{GIVEN, SCENE};

/// Commands that tests do not run, by their first words, each with the reason.
const NOT_RUN: [(&str, &str); 28] = [
    ("bench/", "measures for minutes, with programs that may be missing"),
    ("cargo bench", "measures for minutes"),
    ("cargo +nightly", "needs another toolchain, and runs for hours"),
    ("cargo build", "has made the program that runs here"),
    ("cargo install", "needs a network"),
    ("cargo publish", "publishes"),
    ("cargo run -p", "runs an example, which `cargo test` builds"),
    ("cargo run --release -p", "runs an example, which `cargo test` builds"),
    ("cargo test", "runs tests within a test"),
    ("cargo xtask", "runs tests within a test"),
    ("cat rtsl/", "writes into the home folder"),
    ("cc ", "compiles with what was installed before"),
    ("code ", "installs into an editor"),
    ("cp -r rtsl/", "writes into the home folder"),
    ("crates/rtsl-capi/install.sh", "builds and installs"),
    ("git clone", "needs a network"),
    ("git push", "publishes"),
    ("git tag", "publishes"),
    ("hx ", "needs an editor"),
    ("ln -s", "writes into the home folder"),
    ("mdbook", "needs a program from the network"),
    ("mkdir", "writes into the home folder"),
    ("npm", "needs a network"),
    ("nvim", "needs an editor"),
    ("pip install", "needs a network"),
    ("python -c", "needs the package, whose own tests run it"),
    ("tree-sitter", "needs a network"),
    ("./", "a program that commands before it have built"),
];

/// Commands of `rtsl` that tests only parse, by their first words, each with the reason.
const PARSED: [(&str, &str); 8] = [
    ("rtsl bench terrain.pbrt", "measures a scene of a million triangles"),
    ("rtsl dap", "waits for a client"),
    ("rtsl materialx --check resources/", "needs a repository from the network"),
    ("rtsl render scenes/three-spheres.pbrt --spp 4096", "needs Ray"),
    ("rtsl check integrations/openpbr/adobe_open_pbr.rtsl", "needs a repository from the network"),
    ("rtsl render integrations/openpbr/surfaces.pbrt", "needs a repository from the network"),
    ("rtsl test integrations/openpbr/adobe_open_pbr.rtsl", "needs a repository from the network"),
    ("rtsl view", "opens a window"),
];

/// Pages whose commands `documented_commands` runs, with what they print, by the start of their paths.
const ELSEWHERE: [&str; 5] = [
    "docs/src/reference/command-line/debug.md",
    "docs/src/reference/command-line/eval.md",
    "docs/src/reference/command-line/render.md",
    "docs/src/reference/command-line/test.md",
    "docs/src/tutorial/",
];

/// Files that pages name and do not define, besides those of the reference.
const NAMED: [(&str, &str); 3] = [
    ("shader.rtsl", "class Grey : rt_Texture; void lookup() { rt_TextureColor = color(0.5); }"),
    ("sphere.rtsl", "class Ball : rt_Primitive; void intersect() { hit(1.0); }"),
    ("spheres.pbrt", SCENE),
];

/// The repository.
fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..").canonicalize().unwrap()
}

/// A folder that looks like the repository, for commands that name its files and add others.
fn checkout() -> Folder {
    let folder = Folder::new("page");
    for name in ["scenes", "shaders", "integrations"] {
        copy(&root().join(name), &folder.path(name));
    }
    std::fs::create_dir_all(folder.path("docs/src/images")).unwrap();
    for (name, text) in GIVEN.iter().chain(&NAMED) {
        folder.write(name, text);
    }
    folder
}

fn copy(from: &Path, to: &Path) {
    std::fs::create_dir(to).unwrap();
    for entry in std::fs::read_dir(from).unwrap() {
        let entry = entry.unwrap();
        let (source, target) = (entry.path(), to.join(entry.file_name()));
        if entry.file_type().unwrap().is_dir() {
            copy(&source, &target);
        } else {
            std::fs::copy(&source, &target).unwrap();
        }
    }
}

/// A block of a page in fences: what follows the opening fence, and its text. An indented command is a block of `sh`.
struct Block {
    language: String,
    text: String,
}

fn blocks(page: &str) -> Vec<Block> {
    let mut blocks = Vec::new();
    let mut lines = page.lines();
    while let Some(line) = lines.next() {
        if let Some(language) = line.strip_prefix("```") {
            let text: Vec<&str> = lines.by_ref().take_while(|line| *line != "```").collect();
            let language = if language == "console" { "sh" } else { language };
            blocks.push(Block { language: language.to_owned(), text: text.join("\n") + "\n" });
        } else if let Some(command) = line.strip_prefix("    ")
            && ["rtsl ", "cargo "].iter().any(|start| command.starts_with(start))
        {
            blocks.push(Block { language: "sh".to_owned(), text: format!("{command}\n") });
        }
    }
    blocks
}

/// The commands of a block, without comments; lines that end in `\` go on.
fn commands(text: &str) -> Vec<String> {
    let joined = text.replace("\\\n", " ");
    let is_comment = |line: &&str| line.starts_with('#');
    let lines = joined.lines().filter(|line| !is_comment(line));
    let lines = lines.map(|line| line.split(" #").next().unwrap_or(line));
    let lines = lines.map(|line| line.split_whitespace().collect::<Vec<_>>().join(" "));
    lines.filter(|line| !line.is_empty()).collect()
}

/// A page whose commands run one after the other.
struct Page {
    name: String,
    folder: Folder,
    /// The folder in which the next command runs, from that of the page.
    place: PathBuf,
    /// The number of commands that ran or were parsed.
    ran: usize,
}

impl Page {
    fn run(&mut self, command: &str) {
        let command = command.strip_prefix("taskset -c 0 ").unwrap_or(command);
        let command = match command.split_once(" rtsl ") {
            Some((starter, rest)) if starter.starts_with("xvfb-run") => format!("rtsl {rest}"),
            _ => command.to_owned(),
        };
        if let Some(place) = command.strip_prefix("cd ") {
            self.place.push(place);
            let place = self.folder.0.path().join(&self.place);
            assert!(
                place.is_dir() || root().join(&self.place).is_dir(),
                "{}: {command}",
                self.name
            );
            return;
        }
        let of_cargo = ["cargo run -- ", "cargo run --release -- "];
        let arguments = of_cargo.iter().find_map(|start| command.strip_prefix(start));
        if let Some(arguments) = arguments.or_else(|| command.strip_prefix("rtsl ")) {
            self.ran += 1;
            self.run_rtsl(&command, &words(arguments));
            return;
        }
        if let Some((file, folder)) = self.copied(&command) {
            let (from, to) = (self.folder.0.path().join(file), self.folder.0.path().join(folder));
            std::fs::copy(&from, to.join(from.file_name().unwrap())).unwrap();
            return;
        }
        if let Some(variables) = command.strip_prefix("export ") {
            assert!(variables.contains('='), "{}: {command}", self.name);
            return;
        }
        let is_known = NOT_RUN.iter().any(|(start, _)| command.starts_with(start));
        let of_shell = ["sed ", "RTSL_OPENPBR_HEADERS=", "taskset "];
        let is_known = is_known || of_shell.iter().any(|start| command.starts_with(start));
        assert!(is_known, "{}: nothing runs `{command}`: give a reason in the table", self.name);
        self.check_names(&command);
    }

    /// The file and the folder of `cp FILE FOLDER`, in the folder of the page.
    fn copied<'c>(&self, command: &'c str) -> Option<(&'c str, &'c str)> {
        let (file, folder) = command.strip_prefix("cp ")?.split_once(' ')?;
        self.folder.0.path().join(file).is_file().then_some((file, folder))
    }

    fn run_rtsl(&self, command: &str, words: &[String]) {
        let parsed = PARSED.iter().any(|(start, _)| command.starts_with(start));
        let words = if parsed { with_help(words) } else { small(words) };
        let words: Vec<&str> = words.iter().map(String::as_str).collect();
        let ran: Ran = self.folder.run_in(&self.place, &words);
        assert_eq!(ran.code(), 0, "{}: `{command}`\n{}{}", self.name, ran.output(), ran.errors());
    }

    /// Checks the names in a command that does not run: of packages and their programs, of scripts and files.
    fn check_names(&self, command: &str) {
        let mut words = words(command);
        if words[0] == "cargo" {
            // What follows is for the program, such as the names of tests.
            words.truncate(words.iter().position(|word| word == "--").unwrap_or(words.len()));
            self.check_targets(command, &words);
        }
        let is_path = |word: &&String| {
            const ELSEWHERE: [&str; 9] =
                ["-", "/", "~", "http", "./", "opt/", "rtsl/", "openpbr-bsdf", "target/"];
            let is_elsewhere = ELSEWHERE.iter().any(|start| word.starts_with(start));
            word.contains('/') && !word.contains([' ', '$', '"']) && !is_elsewhere
        };
        for word in words.iter().filter(is_path) {
            let path = root().join(word);
            let is_new_file = *word != words[0] && path.parent().is_some_and(Path::is_dir);
            assert!(path.exists() || is_new_file, "{}: `{command}`: no `{word}`", self.name);
        }
    }

    /// Checks the package and the program of a command of Cargo.
    fn check_targets(&self, command: &str, words: &[String]) {
        let after = |option: &str| {
            let place = words.iter().position(|word| word == option)?;
            words.get(place + 1).cloned()
        };
        let package = after("-p").unwrap_or_else(|| "rtsl-bench".to_owned());
        let folder = match package.as_str() {
            "rtsl-bench" => root().join("bench"),
            "rtsl-embree" => root().join("integrations/embree/rust"),
            "tree-sitter-rtsl" => root().join("editors/tree-sitter-rtsl"),
            name => root().join("crates").join(name),
        };
        assert!(folder.is_dir(), "{}: `{command}`: no package `{package}`", self.name);
        for (option, folder) in [
            ("--example", folder.join("examples")),
            ("--test", folder.join("tests")),
            ("--bench", folder.join("benches")),
        ] {
            let Some(name) = after(option) else { continue };
            let exists = folder.join(format!("{name}.rs")).is_file() || folder.join(&name).is_dir();
            assert!(exists, "{}: `{command}`: no `{option} {name}`", self.name);
        }
    }
}

/// The words of a command; those in quotation marks may have spaces.
fn words(command: &str) -> Vec<String> {
    let mut words = vec![String::new()];
    let mut quote = None;
    for letter in command.chars() {
        match (letter, quote) {
            ('"' | '\'', None) => quote = Some(letter),
            (letter, Some(open)) if letter == open => quote = None,
            (' ', None) => words.push(String::new()),
            (letter, _) => words.last_mut().unwrap().push(letter),
        }
    }
    words
}

/// The command with `--help`, which parses the options before it.
fn with_help(words: &[String]) -> Vec<String> {
    words.iter().cloned().chain(["--help".to_owned()]).collect()
}

/// The command with a small picture, few samples and little time.
fn small(words: &[String]) -> Vec<String> {
    let sizes: &[(&str, &str)] = match words[0].as_str() {
        "render" => &[("--size", "16x12"), ("--spp", "1")],
        "bench" if words.iter().any(|word| word == "--lines") => &[("--width", "4")],
        "bench" => &[("--width", "4"), ("--time", "1")],
        "test" => &[("--samples", "1000")],
        _ => &[],
    };
    let mut small = Vec::new();
    let mut given = words.iter();
    while let Some(word) = given.next() {
        if sizes.iter().any(|(option, _)| option == word) {
            given.next();
        } else {
            small.push(word.clone());
        }
    }
    small.extend(
        sizes.iter().flat_map(|(option, value)| [(*option).to_owned(), (*value).to_owned()]),
    );
    small
}

/// Runs the commands of a page of the repository, and returns how many of them are of `rtsl`.
pub fn run_page(name: &str) -> usize {
    let page = std::fs::read_to_string(root().join(name)).unwrap();
    let all = blocks(&page);
    if all.iter().all(|block| block.language != "sh") {
        return 0;
    }
    let (name, place) = (name.to_owned(), PathBuf::new());
    let mut page_of = Page { name, folder: checkout(), place, ran: 0 };
    for Block { language, text } in all {
        if let Some((_, name)) = language.split_once("file=") {
            page_of.folder.write(name.split(' ').next().unwrap_or(name), &text);
        }
        if language == "sh" {
            page_of.place = PathBuf::new();
            commands(&text).iter().for_each(|command| page_of.run(command));
        }
    }
    page_of.ran
}

/// The pages of a folder of the repository and those inside, without what programs made, in order.
fn pages(folder: &str) -> Vec<String> {
    let mut pages = Vec::new();
    for entry in std::fs::read_dir(root().join(folder)).unwrap() {
        let entry = entry.unwrap();
        let name = entry.file_name().into_string().unwrap();
        let path = if folder.is_empty() { name.clone() } else { format!("{folder}/{name}") };
        let is_made = name.starts_with('.') || ["target", "node_modules"].contains(&name.as_str());
        if entry.file_type().unwrap().is_dir() && !is_made {
            pages.extend(self::pages(&path));
        } else if name.ends_with(".md") {
            pages.push(path);
        }
    }
    pages.sort();
    pages
}

/// Runs the commands of the pages that `is_wanted`, and returns how many of them are of `rtsl`.
fn run_pages(is_wanted: impl Fn(&str) -> bool) -> usize {
    let is_elsewhere = |page: &str| ELSEWHERE.iter().any(|start| page.starts_with(start));
    let all = pages("").into_iter().filter(|page| is_wanted(page) && !is_elsewhere(page));
    all.map(|page| run_page(&page)).sum()
}

#[test]
fn commands_of_the_readme_run() {
    assert!(run_page("README.md") >= 12);
}

#[test]
fn commands_for_contributors_run() {
    assert!(run_page("CONTRIBUTING.md") >= 6);
}

/// The pages of the book by part, so that no page is left out.
#[test]
fn commands_of_guides_and_explanations_run() {
    let ran = run_pages(|page| {
        page.starts_with("docs/src/how-to/") || page.starts_with("docs/src/explanation/")
    });
    assert!(ran >= 20, "{ran} commands");
}

#[test]
fn commands_of_the_reference_run() {
    let ran = run_pages(|page| page.starts_with("docs/src/reference/"));
    assert!(ran >= 15, "{ran} commands");
}

#[test]
fn commands_of_all_other_pages_run() {
    let tested = ["README.md", "CONTRIBUTING.md"];
    let ran = run_pages(|page| {
        let is_book = ["how-to/", "explanation/", "reference/"];
        let is_book = is_book.iter().any(|part| page.starts_with(&format!("docs/src/{part}")));
        !is_book && !tested.contains(&page)
    });
    assert!(ran >= 6, "{ran} commands");
}

#[test]
fn commands_are_read_as_a_shell_reads_them() {
    let text = "rtsl a  # comment\nrtsl b \\\n    'c d' \"e\"\n\n# nothing\n";
    assert_eq!(commands(text), ["rtsl a", "rtsl b 'c d' \"e\""]);
    assert_eq!(words("b 'c d' \"e\""), ["b", "c d", "e"]);
}
