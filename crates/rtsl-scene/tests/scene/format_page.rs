//! The page of pbrt's names and parameters: each row is given to the reader, and its last column is what that says.
//! `UPDATE_EXPECT=1` prints the column.

use std::collections::{BTreeMap, BTreeSet};
use std::io;
use std::path::{Path, PathBuf};
use std::sync::Mutex;

use rtsl_scene::reader::FileSource;
use rtsl_scene::{LoadOptions, SceneSource};

use crate::paint;

const PAGE: &str =
    concat!(env!("CARGO_MANIFEST_DIR"), "/../../docs/src/reference/scenes/format.md");

/// The files that rows name, and the scene, which changes from row to row.
struct Files {
    scene: Mutex<String>,
    others: BTreeMap<PathBuf, Vec<u8>>,
}

impl Files {
    fn new() -> Self {
        let ply = "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\n\
            property float z\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n\
            0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n";
        let files: [(&str, Vec<u8>); 5] = [
            ("part.pbrt", b"Shape \"sphere\"".to_vec()),
            ("lenses.dat", b"0 2 0 20\n50 2 1.5 20\n-50 50 1 20\n".to_vec()),
            ("mesh.ply", ply.as_bytes().to_vec()),
            ("image.png", image()),
            ("paint.bsdf", paint::paint(1)),
        ];
        let others = files.into_iter().map(|(path, bytes)| (PathBuf::from(path), bytes)).collect();
        Files { scene: Mutex::default(), others }
    }
}

impl FileSource for Files {
    fn read(&self, path: &Path) -> io::Result<Vec<u8>> {
        if path == Path::new(SCENE) {
            return Ok(self.scene.lock().unwrap().clone().into_bytes());
        }
        self.others.get(path).cloned().ok_or_else(|| io::ErrorKind::NotFound.into())
    }

    fn list(&self, _: &Path) -> io::Result<Vec<PathBuf>> {
        Ok(Vec::new())
    }
}

const SCENE: &str = "scene.pbrt";

/// Loads one scene after the other; classes are compiled once.
struct Reader<'f> {
    files: &'f Files,
    source: SceneSource<'f>,
}

impl<'f> Reader<'f> {
    fn new(files: &'f Files) -> Self {
        let source = SceneSource::read(Path::new(SCENE), files, &LoadOptions::default());
        Reader { files, source }
    }

    /// The first lines of the messages of loading a scene.
    fn messages(&mut self, text: &str) -> Vec<String> {
        *self.files.scene.lock().unwrap() = text.to_owned();
        self.source = self.source.read_again();
        let messages = match self.source.load() {
            Ok(loaded) => loaded.warnings.to_text(false),
            Err(messages) => messages.to_text(false),
        };
        let is_head = |line: &&str| line.starts_with("error") || line.starts_with("warning");
        messages.lines().filter(is_head).map(str::to_owned).collect()
    }
}

fn image() -> Vec<u8> {
    let mut file = Vec::new();
    let mut encoder = png::Encoder::new(&mut file, 2, 2);
    encoder.set_color(png::ColorType::Rgb);
    encoder.write_header().unwrap().write_image_data(&[100; 12]).unwrap();
    file
}

/// An entity of the page.
#[derive(Clone)]
struct Entity {
    kind: String,
    name: String,
}

impl Entity {
    /// The parameters without which the entity cannot be made.
    fn required(&self) -> &'static [(&'static str, &'static str)] {
        const P: (&str, &str) = ("point3 P", "[0 0 0 1 0 0 0 1 0 1 1 1]");
        match (self.kind.as_str(), self.name.as_str()) {
            ("Camera", "realistic") => &[("string lensfile", "\"lenses.dat\"")],
            ("Shape", "plymesh") => &[("string filename", "\"mesh.ply\"")],
            ("Shape", "loopsubdiv") => &[P, ("integer indices", "[0 1 2 1 2 3]")],
            ("Shape", "trianglemesh" | "bilinearmesh" | "curve") => {
                &[P, ("integer indices", "[0 1 2 3]")]
            }
            ("Texture", "imagemap" | "ptex") => &[("string filename", "\"image.png\"")],
            ("Material", "measured") => &[("string filename", "\"paint.bsdf\"")],
            ("LightSource", "goniometric" | "projection") => {
                &[("string filename", "\"image.png\"")]
            }
            ("Material", "mix") => &[("string materials", "[\"one\" \"other\"]")],
            _ => &[],
        }
    }

    /// A scene with the entity and the parameter.
    fn scene(&self, parameter: Option<(&str, &str)>) -> String {
        let mut parameters = String::new();
        let given = parameter.map(|(declaration, _)| name_of(declaration));
        for (declaration, value) in self.required() {
            // A triangle takes three of the corners.
            let value = if *declaration == "integer indices" && self.name == "trianglemesh" {
                "[0 1 2]"
            } else {
                value
            };
            if given != Some(name_of(declaration))
                && !(self.name == "curve" && *declaration == "integer indices")
            {
                parameters += &format!(" \"{declaration}\" {value}");
            }
        }
        if let Some((declaration, value)) = parameter {
            parameters += &format!(" \"{declaration}\" {value}");
        }
        let Entity { kind, name } = self;
        let entity = format!("{kind} \"{name}\"{parameters}\n");
        let camera = "Camera \"perspective\"\n";
        let world = "WorldBegin\nTexture \"t\" \"spectrum\" \"constant\"\n\
            MakeNamedMaterial \"one\" \"string type\" \"diffuse\"\n\
            MakeNamedMaterial \"other\" \"string type\" \"diffuse\"\n";
        match kind.as_str() {
            "Camera" => format!("{entity}{world}"),
            "Film" | "PixelFilter" | "Sampler" | "Integrator" => format!("{camera}{entity}{world}"),
            "Texture" => {
                let kind = match parameter {
                    Some((declaration, _)) if declaration.starts_with("float ") => "float",
                    _ => "spectrum",
                };
                format!("{camera}{world}Texture \"x\" \"{kind}\" \"{name}\"{parameters}\n")
            }
            "Shape" | "LightSource" => format!("{camera}{world}{entity}"),
            _ => format!("{camera}{world}{entity}Shape \"sphere\"\n"),
        }
    }

    /// A value of a parameter, other than its default.
    fn value(&self, kind: &str, name: &str, default: &str) -> String {
        if let Some((_, value)) = self.required().iter().find(|(it, _)| name_of(it) == name) {
            let is_triangle = self.name == "trianglemesh" && name == "indices";
            return if is_triangle { "[0 1 2]".to_owned() } else { (*value).to_owned() };
        }
        let fixed = match (name, kind) {
            ("screenwindow", _) => "[-1 1 -0.5 0.5]",
            ("cropwindow", _) => "[0.25 0.5 0.25 0.5]",
            ("pixelbounds", _) => "[10 20 10 20]",
            ("sensor", _) => "\"canon_eos_5d\"",
            ("portal", _) => "[0 0 1 1 0 1 1 1 1 0 1 1]",
            ("uv", _) => "[0 0 1 0 0 1 0.5 0.5]",
            ("N", _) if self.name == "curve" => "[0 0 1 0 0 1]",
            ("N" | "S", _) => "[0 0 1 0 0 1 0 0 1 0 0 1]",
            ("faceIndices", _) => "[0]",
            ("zmin", _) => "-0.5",
            ("zmax" | "innerradius", _) => "0.5",
            ("filename" | "imagefilename" | "emissionfilename" | "normalmap", _)
                if self.kind != "Film" =>
            {
                "\"image.png\""
            }
            ("B" | "C" | "alpha", "float") => "0.5",
            ("name", _) => "\"Skin1\"",
            ("focusdistance", _) => "5",
            (_, "texture") => "\"t\"",
            (_, "rgb") => "[0.2 0.3 0.4]",
            (_, "spectrum") => "[360 0.5 830 0.6]",
            (_, "blackbody") => "4000",
            (_, "point3" | "vector3") => "[0 2 1]",
            (_, "bool") if default == "true" => "false",
            (_, "bool") => "true",
            _ => "",
        };
        if !fixed.is_empty() {
            return fixed.to_owned();
        }
        let number = default.split([' ', ',']).next().and_then(|word| word.parse::<f64>().ok());
        let number = number.filter(|number| number.is_finite());
        match kind {
            "string" => {
                let last = default.rsplit('"').nth(1).unwrap_or("none");
                format!("\"{last}\"")
            }
            "integer" => format!("{}", number.unwrap_or(1.0).abs() + 1.0),
            _ => format!("{}", 0.5 * number.unwrap_or(1.0) + 0.25),
        }
    }
}

/// The name in a declaration.
fn name_of(declaration: &str) -> &str {
    declaration.rsplit(' ').next().unwrap_or(declaration)
}

/// The cell for messages: what is said besides `known`.
fn cell(found: &[String], known: &BTreeSet<String>) -> String {
    let said: Vec<String> = found
        .iter()
        .filter(|message| !known.contains(*message))
        .map(|message| match message.split_once("]: ") {
            Some((head, text)) if head.starts_with("error") => format!("error: {text}"),
            Some((_, text)) => text.to_owned(),
            None => message.clone(),
        })
        .collect();
    if said.is_empty() { "read".to_owned() } else { said.join("; ").replace('|', "\\|") }
}

/// The cell for all types of a parameter.
fn parameter_cell(
    reader: &mut Reader<'_>,
    entity: &Entity,
    declaration: &str,
    default: &str,
    known: &BTreeSet<String>,
) -> String {
    let (kinds, name) = declaration.rsplit_once(' ').expect("a type and a name");
    let mut cells: Vec<(String, Vec<&str>)> = Vec::new();
    for kind in kinds.split(", ") {
        let value = entity.value(kind, name, default);
        let found = reader.messages(&entity.scene(Some((&format!("{kind} {name}"), &value))));
        let cell = cell(&found, known);
        match cells.iter_mut().find(|(other, _)| *other == cell) {
            Some((_, kinds)) => kinds.push(kind),
            None => cells.push((cell, vec![kind])),
        }
    }
    match cells.as_slice() {
        [(cell, _)] => cell.clone(),
        several => {
            let parts = several.iter().map(|(cell, kinds)| format!("{}: {cell}", kinds.join(", ")));
            parts.collect::<Vec<_>>().join("; ")
        }
    }
}

/// The scene of a row of the table of directives.
fn directive_scene(directive: &str) -> String {
    let camera = "Camera \"perspective\"\n";
    let is_early =
        ["TransformTimes", "Accelerator", "Option"].iter().any(|it| directive.starts_with(it));
    if is_early {
        format!("{camera}{directive}\nWorldBegin\n")
    } else {
        format!("{camera}WorldBegin\n{directive}\nShape \"sphere\"\n")
    }
}

/// The page with the last column of each table as the reader has it.
fn printed(page: &str) -> String {
    let files = Files::new();
    let mut reader = Reader::new(&files);
    let mut entity: Option<Entity> = None;
    let mut known = BTreeSet::new();
    let mut lines = Vec::new();
    for line in page.lines() {
        if let Some((kind, name)) = line.strip_prefix("### ").and_then(|it| it.split_once(' ')) {
            let name = name.trim_matches('`').to_owned();
            entity = Some(Entity { kind: kind.to_owned(), name });
        } else if line.starts_with("## ") {
            entity = None;
        }
        let cells: Vec<&str> = line.split('|').map(str::trim).collect();
        let is_row = line.starts_with('|')
            && !line.starts_with("|---")
            && !matches!(cells[1], "parameter" | "directive");
        if !is_row {
            lines.push(line.to_owned());
            continue;
        }
        let text = cells[1].trim_matches('`');
        lines.push(match &entity {
            None => format!(
                "| {} | {} |",
                cells[1],
                cell(&reader.messages(&directive_scene(text)), &BTreeSet::new())
            ),
            Some(entity) if text.is_empty() => {
                let found = reader.messages(&entity.scene(None));
                let cell = cell(&found, &BTreeSet::new());
                known = found.into_iter().collect();
                format!("| | | {cell} |")
            }
            Some(entity) => {
                let cell = parameter_cell(&mut reader, entity, text, cells[2], &known);
                format!("| {} | {} | {cell} |", cells[1], cells[2])
            }
        });
    }
    lines.join("\n") + "\n"
}

#[test]
fn the_page_says_what_the_reader_does() {
    let page = std::fs::read_to_string(PAGE).expect("there is a page");
    let printed = printed(&page);
    if std::env::var_os("UPDATE_EXPECT").is_some() {
        std::fs::write(PAGE, &printed).unwrap();
        return;
    }
    for (found, expected) in page.lines().zip(printed.lines()) {
        assert_eq!(
            found, expected,
            "docs/src/reference/scenes/format.md is stale; run this test with UPDATE_EXPECT=1"
        );
    }
    let rows = page.lines().filter(|line| line.starts_with("| `")).count();
    assert!(rows > 400, "{rows} rows");
    let read = page.lines().filter(|line| line.ends_with("| read |")).count();
    assert!(read > 200, "{read} of {rows} are read");
}
