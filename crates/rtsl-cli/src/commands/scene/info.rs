//! `rtsl scene info`: the contents of a scene, as text or JSON.

use std::collections::BTreeMap;
use std::path::PathBuf;

use clap::Args;
use rtsl::Engine;
use rtsl_memory::Amount;
use rtsl_render::extent::scene_extent;
use rtsl_scene::reader::{DiskFiles, RecordedFiles};
use rtsl_scene::{LoadOptions, SceneSource};

use super::contents::{Contents, Image};
use crate::arguments::{InputArguments, SearchPath};
use crate::commands::render::report;
use crate::files::write_result;
use crate::outcome::{CommandResult, Outcome};
use crate::report::Reporter;

/// The command line of `rtsl scene info`.
#[derive(Debug, Args)]
pub struct InfoArguments {
    /// The scene.
    #[arg(value_name = "SCENE")]
    scene: PathBuf,
    /// Print one JSON object.
    #[arg(long)]
    json: bool,
    /// Set a parameter of the scene: `camera.fov=30`, `lamp.intensity=10,9,8`; may be repeated.
    #[arg(short = 'D', long = "define", value_name = "NAME.PARAMETER=VALUE")]
    defines: Vec<String>,
    #[command(flatten)]
    search_path: SearchPath,
    #[command(flatten)]
    input: InputArguments,
}

/// Loads the scene and prints its contents.
pub fn run(arguments: &InfoArguments, reporter: &Reporter) -> CommandResult {
    let search_path = arguments.search_path.beside(&arguments.scene, reporter)?;
    let options = LoadOptions {
        defines: arguments.defines.clone(),
        search_path: search_path.folders(),
        ..arguments.input.options()
    };
    let files = RecordedFiles::new(&DiskFiles);
    let mut source = SceneSource::read(&arguments.scene, &files, &options);
    let loaded = match source.load() {
        Ok(loaded) => loaded,
        Err(messages) => {
            report(&messages, reporter);
            return Ok(Outcome::InputAtFault);
        }
    };
    // Few boxes are computed: machine code would take longer to make.
    let extent = scene_extent(&loaded.scene, &Engine::interpreter())?;
    let contents = Contents::new(&arguments.scene, &source, &loaded, &extent, &files);
    let text = match arguments.json {
        true => serde_json::to_string_pretty(&contents).unwrap_or_default() + "\n",
        false => as_text(&contents),
    };
    write_result(None, text.as_bytes())?;
    Ok(Outcome::Done)
}

fn as_text(contents: &Contents) -> String {
    let mut table = Table::default();
    let shapes = &contents.shapes;
    table.line("scene", format!("{}, {}", contents.scene, contents.format));
    table.line("camera", contents.camera.clone());
    table.line("film", format!("{}, {} by {}", contents.film, contents.width, contents.height));
    table.line("filter", contents.filter.clone());
    let samples = contents.samples_per_pixel;
    table.line("sampler", format!("{}, {samples} samples per pixel", contents.sampler));
    let depth = contents.max_depth;
    table.line("integrator", format!("{}, to a depth of {depth}", contents.integrator));
    table.counts("shapes", &shapes.classes);
    if shapes.objects > 0 || shapes.instances > 0 {
        table.detail("objects", grouped(shapes.objects as u64));
        table.detail("instances", grouped(shapes.instances as u64));
    }
    if shapes.triangles > 0 {
        let all = match shapes.instanced_triangles == shapes.triangles {
            true => String::new(),
            false => format!(", {} with instances", grouped(shapes.instanced_triangles)),
        };
        let memory = Amount(shapes.mesh_bytes);
        table.detail("triangles", format!("{}{all}; {memory}", grouped(shapes.triangles)));
    }
    table.counts("materials", &contents.materials);
    table.counts("textures", &contents.textures);
    table.images(&contents.images);
    table.counts("lights", &contents.lights);
    table.counts("area lights", &contents.area_lights);
    if contents.emitting_shapes > 0 {
        table.detail("shapes", grouped(contents.emitting_shapes as u64));
    }
    table.line("bounds", bounds(contents));
    let items = grouped(contents.hierarchy.items);
    table
        .line("hierarchy", format!("about {} for {items} items", Amount(contents.hierarchy.bytes)));
    let bytes = contents.files.iter().map(|file| file.bytes).sum();
    table.line("files", format!("{}, {}", contents.files.len(), Amount(bytes)));
    for file in &contents.files {
        table.item(&file.path, &Amount(file.bytes).to_string());
    }
    table.line("warnings", grouped(contents.warnings.len() as u64));
    for warning in &contents.warnings {
        let line = warning.line.map_or(String::new(), |line| format!(", line {line}"));
        table.item(&format!("{}{line}", warning.code), &warning.message);
    }
    table.text
}

/// Lines of a name and a value.
#[derive(Default)]
struct Table {
    text: String,
}

/// The columns of names, and of the names of items.
const NAMES: usize = 14;
const ITEMS: usize = 32;

impl Table {
    fn line(&mut self, name: &str, value: String) {
        self.text += &format!("{name:NAMES$}{value}\n");
    }

    fn detail(&mut self, name: &str, value: String) {
        self.line(&format!("  {name}"), value);
    }

    fn item(&mut self, name: &str, value: &str) {
        self.text += &format!("  {name:ITEMS$} {value}\n");
    }

    /// A number of things, with those of each class.
    fn counts(&mut self, name: &str, counts: &BTreeMap<String, usize>) {
        let total: usize = counts.values().sum();
        let mut classes: Vec<(&String, &usize)> = counts.iter().collect();
        classes.sort_by_key(|(_, count)| std::cmp::Reverse(**count));
        let classes: Vec<String> = classes
            .iter()
            .map(|(class, count)| format!("{} {class}", grouped(**count as u64)))
            .collect();
        let separator = if classes.is_empty() { "" } else { ": " };
        self.line(name, format!("{}{separator}{}", grouped(total as u64), classes.join(", ")));
    }

    fn images(&mut self, images: &[Image]) {
        let size = Amount(images.iter().map(|image| image.bytes).sum());
        let paged: Amount = images.iter().filter(|it| it.in_file).map(|it| Amount(it.bytes)).sum();
        let place = match paged {
            Amount(0) => String::new(),
            paged => format!(", {paged} of them in temporary files"),
        };
        self.line("images", format!("{}, {size} of texels{place}", images.len()));
        for Image { name, width, height, channels, bits, bytes, in_file } in images {
            let format = format!("{width} by {height}, {channels} channels of {bits} bits");
            let place = if *in_file { " in a temporary file" } else { "" };
            self.item(name, &format!("{format}, {}{place}", Amount(*bytes)));
        }
    }
}

fn bounds(contents: &Contents) -> String {
    let corner = |[x, y, z]: [f32; 3]| format!("({x:.6} {y:.6} {z:.6})");
    let unbounded = match contents.unbounded_shapes {
        0 => String::new(),
        1 => "; one shape is unbounded".to_owned(),
        count => format!("; {count} shapes are unbounded"),
    };
    match contents.bounds {
        Some([min, max]) => format!("{} to {}{unbounded}", corner(min), corner(max)),
        None => format!("none{unbounded}"),
    }
}

/// A number with its digits in groups of three.
fn grouped(number: u64) -> String {
    let digits = number.to_string();
    let first = digits.len() % 3;
    let (head, rest) = digits.split_at(first);
    let groups = rest.as_bytes().chunks(3).map(|group| String::from_utf8_lossy(group).into_owned());
    let head = Some(head.to_owned()).filter(|head| !head.is_empty());
    head.into_iter().chain(groups).collect::<Vec<String>>().join(" ")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn digits_are_grouped() {
        let numbers = [0, 12, 123, 1234, 123_456, 1_234_567];
        let expected = ["0", "12", "123", "1 234", "123 456", "1 234 567"];
        assert_eq!(numbers.map(grouped), expected);
    }
}
