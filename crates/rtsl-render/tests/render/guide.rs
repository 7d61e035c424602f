//! The scenes and shaders of the book, assembled as a reader would, render without a message.
//!
//! A block ```` ```pbrt file=NAME ```` or ```` ```rtsl file=NAME ```` is a file; with `append` it goes to the end of
//! that file. After each scene block its scene is rendered, with the files as they are by then.

use std::collections::BTreeMap;
use std::path::Path;

use rtsl_image::Aov;
use rtsl_render::{RenderRequest, render_scene};

/// The blocks of a page with the words of their fences.
fn blocks(page: &str) -> Vec<(Vec<&str>, String)> {
    let mut blocks: Vec<(Vec<&str>, String)> = Vec::new();
    let mut inside = false;
    for line in page.lines() {
        if let Some(fence) = line.strip_prefix("```") {
            inside = !inside;
            if inside {
                blocks.push((fence.split(' ').collect(), String::new()));
            }
        } else if inside && let Some((_, text)) = blocks.last_mut() {
            text.push_str(line);
            text.push('\n');
        }
    }
    blocks
}

/// Renders the scenes of pages that are read one after the other.
fn render_scenes_of(pages: &[&str]) -> usize {
    let book = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../docs/src");
    let folder = tempfile::tempdir().expect("the folder can be made");
    let mut files: BTreeMap<String, String> = BTreeMap::new();
    let mut rendered = 0;
    for page in pages {
        let text_of_page = std::fs::read_to_string(book.join(page)).expect("the page is there");
        for (words, text) in blocks(&text_of_page) {
            let Some(name) = words.iter().find_map(|word| word.strip_prefix("file=")) else {
                continue;
            };
            let file = files.entry(name.to_owned()).or_default();
            if !words.contains(&"append") {
                file.clear();
            }
            file.push_str(&text);
            std::fs::write(folder.path().join(name), file.as_str())
                .expect("the file can be written");
            if words[0] == "pbrt" {
                render(page, &folder.path().join(name), aovs_of(&text_of_page, name));
                rendered += 1;
            }
        }
    }
    rendered
}

/// The AOVs with which a page renders a scene.
fn aovs_of(page: &str, scene: &str) -> Vec<Aov> {
    let command = format!("rtsl render {scene} ");
    let commands = page.lines().filter(|line| line.contains(&command));
    let names = commands.filter_map(|line| line.split_once("--aov ")?.1.split(' ').next());
    names.flat_map(|names| names.split(',')).map(Aov::from_name).collect()
}

fn render(page: &str, scene: &Path, aovs: Vec<Aov>) {
    let request = RenderRequest {
        aovs,
        scene: scene.to_path_buf(),
        size: Some((16, 12)),
        samples: Some(1),
        ..RenderRequest::default()
    };
    let messages = match render_scene(&request) {
        Ok(result) if result.warnings.is_empty() => return,
        Ok(result) => result.warnings,
        Err(messages) => messages,
    };
    panic!("{page}, {}:\n{}", scene.display(), messages.to_text(false));
}

#[test]
fn scenes_of_the_tutorial_render() {
    let pages = ["first-picture", "primitive", "material", "testing"];
    let pages = pages.map(|page| format!("tutorial/{page}.md"));
    assert_eq!(render_scenes_of(&pages.each_ref().map(String::as_str)), 4);
}

#[test]
fn scenes_of_the_guides_render() {
    assert_eq!(render_scenes_of(&["how-to/integrator.md"]), 1);
}

#[test]
fn scenes_of_the_reference_render() {
    assert!(render_scenes_of(&["reference/scenes.md"]) > 0);
}
