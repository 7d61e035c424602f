//! The scenes and shaders of the manual, assembled as a reader would, render without a message.
//!
//! A block ```` ```pbrt file=NAME ```` or ```` ```rtsl file=NAME ```` is a file; with `append` it goes to the end of
//! that file. After each scene block its scene is rendered, with the files as they are by then.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

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

/// A folder that is removed when the test ends.
struct Folder(PathBuf);

impl Folder {
    fn new(page: &str) -> Folder {
        let path = std::env::temp_dir().join(format!("rtsl-{page}-{}", std::process::id()));
        std::fs::create_dir_all(&path).expect("the folder can be made");
        Folder(path)
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        let _ = std::fs::remove_dir_all(&self.0);
    }
}

fn render_scenes_of(page: &str) -> usize {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../docs").join(page);
    let text = std::fs::read_to_string(path).expect("the page is there");
    let folder = Folder::new(page);
    let mut files: BTreeMap<String, String> = BTreeMap::new();
    let mut rendered = 0;
    for (words, text) in blocks(&text) {
        let Some(name) = words.iter().find_map(|word| word.strip_prefix("file=")) else { continue };
        let file = files.entry(name.to_owned()).or_default();
        if !words.contains(&"append") {
            file.clear();
        }
        file.push_str(&text);
        std::fs::write(folder.0.join(name), file.as_str()).expect("the file can be written");
        if words[0] != "pbrt" {
            continue;
        }
        let request = RenderRequest {
            scene: folder.0.join(name),
            size: Some((16, 12)),
            samples: Some(1),
            ..RenderRequest::default()
        };
        match render_scene(&request) {
            Ok(result) => assert!(
                result.warnings.is_empty(),
                "{page}, {name}:\n{}",
                result.warnings.to_text(false)
            ),
            Err(messages) => panic!("{page}, {name}:\n{}", messages.to_text(false)),
        }
        rendered += 1;
    }
    rendered
}

#[test]
fn scenes_of_the_guide_render() {
    assert_eq!(render_scenes_of("guide.md"), 4);
}

#[test]
fn scenes_of_the_scene_page_render() {
    assert!(render_scenes_of("scenes.md") > 0);
}
