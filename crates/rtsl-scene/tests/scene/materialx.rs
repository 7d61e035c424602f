//! Materials of MaterialX documents in scenes.

use std::path::{Path, PathBuf};

use rtsl_scene::reader::{FileSource, MemoryFiles};
use rtsl_scene::{LoadOptions, Loaded, load_scene};

const DOCUMENT: &str = r#"<materialx version="1.39" colorspace="srgb_texture" fileprefix="maps/">
  <image name="map" type="color3">
    <input name="file" type="filename" value="wood.png"/>
  </image>
  <image name="same" type="color3">
    <input name="file" type="filename" value="wood.png"/>
  </image>
  <image name="missing" type="float">
    <input name="file" type="filename" value="none.png"/>
    <input name="default" type="float" value="0.4"/>
  </image>
  <add name="sum" type="color3">
    <input name="in1" type="color3" nodename="map"/>
    <input name="in2" type="color3" nodename="same"/>
  </add>
  <standard_surface name="one" type="surfaceshader">
    <input name="base_color" type="color3" nodename="sum"/>
    <input name="specular_roughness" type="float" nodename="missing"/>
  </standard_surface>
  <surfacematerial name="First" type="material">
    <input name="surfaceshader" type="surfaceshader" nodename="one"/>
  </surfacematerial>
  <open_pbr_surface name="two" type="surfaceshader">
    <input name="base_metalness" type="float" value="1"/>
  </open_pbr_surface>
  <surfacematerial name="Second" type="material">
    <input name="surfaceshader" type="surfaceshader" nodename="two"/>
  </surfacematerial>
</materialx>"#;

/// A white PNG image of one pixel.
fn png() -> Vec<u8> {
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, 1, 1);
    encoder.set_color(png::ColorType::Rgb);
    let mut writer = encoder.write_header().unwrap();
    writer.write_image_data(&[255; 3]).unwrap();
    writer.finish().unwrap();
    bytes
}

fn load(material: &str) -> Result<Loaded, String> {
    load_document(material, DOCUMENT)
}

fn load_document(material: &str, document: &str) -> Result<Loaded, String> {
    let scene = format!("Camera \"perspective\"\nWorldBegin\n{material}\nShape \"sphere\"\n");
    let files: MemoryFiles<Vec<u8>> = MemoryFiles::default()
        .with("scenes/scene.pbrt", scene.into_bytes())
        .with("scenes/a/document.mtlx", document.as_bytes().to_vec())
        .with("scenes/a/broken.mtlx", b"<materialx>".to_vec())
        .with("scenes/a/maps/wood.png", png())
        .with("scenes/a/maps/tile.1001.png", png())
        .with("scenes/a/maps/tile.1012.png", png())
        .with("scenes/a/maps/tile.10123.png", png())
        .with("scenes/a/maps/tile_u2_v1.png", png());
    let files: &dyn FileSource = &files;
    load_scene(Path::new("scenes/scene.pbrt"), files, &LoadOptions::default())
        .map_err(|messages| messages.to_text(false))
}

#[test]
fn a_document_gives_a_material_with_its_images() {
    let material = "Material \"materialx\" \"string file\" \"a/document.mtlx\" \"string material\" \"First\" \
                    \"float metalness\" 0.5";
    let loaded = load(material).unwrap();
    let instance = &loaded.scene.materials[0];
    assert_eq!(instance.class().name, "First");
    let names: Vec<&str> = instance.class().parameters.iter().map(|it| it.name.as_str()).collect();
    assert!(names.contains(&"image1") && names.contains(&"metalness"), "{names:?}");
    assert!(!names.contains(&"baseColor") && !names.contains(&"image3"), "{names:?}");
    let warnings = loaded.warnings.to_text(false);
    let missing = PathBuf::from("scenes/a/maps/none.png");
    assert!(warnings.contains(&missing.display().to_string()), "{warnings}");
    assert!(warnings.contains("document.mtlx:9"), "{warnings}");
}

#[test]
fn a_document_with_several_materials_needs_a_name() {
    let error = load("Material \"materialx\" \"string file\" \"a/document.mtlx\"").unwrap_err();
    assert!(error.contains("E0501") && error.contains("`First`, `Second`"), "{error}");
    let named = |name: &str| {
        format!(
            "Material \"materialx\" \"string file\" \"a/document.mtlx\" \"string material\" \"{name}\""
        )
    };
    assert!(load(&named("Second")).is_ok());
    let error = load(&named("Secnd")).unwrap_err();
    assert!(error.contains("did you mean `Second`?"), "{error}");
}

#[test]
fn documents_that_cannot_be_read_are_errors_at_their_names() {
    let error = load("Material \"materialx\"").unwrap_err();
    assert!(error.contains("E0501") && error.contains("string file"), "{error}");
    let error = load("Material \"materialx\" \"string file\" \"none.mtlx\"").unwrap_err();
    assert!(error.contains("E0601") && error.contains("scene.pbrt:3"), "{error}");
    let error = load("Material \"materialx\" \"string file\" \"a/broken.mtlx\"").unwrap_err();
    assert!(error.contains("E0630") && error.contains("broken.mtlx:1"), "{error}");
    // The material is not reported again.
    assert_eq!(error.matches("error").count(), 1, "{error}");
}

/// A document with a material `Mixed` of two models, whose part `inner` another material has in a graph of its own.
const MIXTURE: &str = r#"<materialx version="1.39">
  <standard_surface name="inner" type="surfaceshader">
    <input name="metalness" type="float" value="1"/>
  </standard_surface>
  <gltf_pbr name="other" type="surfaceshader"/>
  <mix name="mixed" type="surfaceshader">
    <input name="fg" type="surfaceshader" nodename="inner"/>
    <input name="bg" type="surfaceshader" nodename="other"/>
    <input name="mix" type="float" value="0.25"/>
  </mix>
  <surfacematerial name="Mixed" type="material">
    <input name="surfaceshader" type="surfaceshader" nodename="mixed"/>
  </surfacematerial>
  <nodegraph name="g">
    <open_pbr_surface name="inner" type="surfaceshader"/>
    <mix name="m" type="surfaceshader">
      <input name="fg" type="surfaceshader" nodename="inner"/>
      <input name="mix" type="float" value="0.5"/>
    </mix>
    <output name="out" type="surfaceshader" nodename="m"/>
  </nodegraph>
  <surfacematerial name="Second" type="material">
    <input name="surfaceshader" type="surfaceshader" nodegraph="g" output="out"/>
  </surfacematerial>
</materialx>"#;

#[test]
fn a_mixture_refers_to_its_parts() {
    let named = |name: &str| {
        format!(
            "Material \"materialx\" \"string file\" \"a/document.mtlx\" \"string material\" \"{name}\""
        )
    };
    let material =
        format!("{} \"float amount\" 0.75\nShape \"sphere\"\n{}", named("Mixed"), named("Second"));
    let loaded = load_document(&material, MIXTURE).unwrap();
    let parts = |class: &str| {
        let mut all = loaded.scene.materials.iter();
        let mixture = all.find(|it| it.class().name == class).unwrap();
        // The parameters for metal tell the models apart.
        ["first", "second"].map(|member| {
            let part = mixture.reference(member)?;
            let mut names = part.class().parameters.iter().map(|it| it.name.clone());
            names.find(|name| name.to_lowercase().ends_with("metalness"))
        })
    };
    let [metalness, base_metalness] = ["metalness", "baseMetalness"].map(|it| Some(it.to_owned()));
    assert_eq!(parts("Mixed"), [base_metalness.clone(), metalness]);
    assert_eq!(parts("Second"), [None, base_metalness]);
    let mixed = loaded.scene.materials.iter().find(|it| it.class().name == "Mixed").unwrap();
    assert_eq!(mixed.member("amount"), Some(&[0.75f32.to_bits()][..]));
}

#[test]
fn tiles_are_the_files_that_exist() {
    let load = |file: &str| {
        let document = format!(
            "<materialx version=\"1.39\" fileprefix=\"maps/\">\
             <image name=\"map\" type=\"color3\"><input name=\"file\" type=\"filename\" value=\"{file}\"/></image>\
             <standard_surface name=\"s\" type=\"surfaceshader\">\
             <input name=\"base_color\" type=\"color3\" nodename=\"map\"/></standard_surface></materialx>"
        );
        let material = "Material \"materialx\" \"string file\" \"a/document.mtlx\"";
        load_document(material, &document).unwrap()
    };
    for (file, numbers) in
        [("tile.<UDIM>.png", vec![1001, 1012]), ("tile_<UVTILE>.png", vec![1002])]
    {
        let loaded = load(file);
        let tiles = loaded.scene.materials[0].reference("image1").unwrap();
        assert_eq!(tiles.class().name, "ImageTiles");
        assert_eq!(tiles.buffer("numbers").unwrap()[..], numbers, "{file}");
    }
    let loaded = load("none.<UDIM>.png");
    assert!(loaded.scene.materials[0].reference("image1").is_none());
    let warnings = loaded.warnings.to_text(false);
    assert!(warnings.contains("`a/maps/none.<UDIM>.png` is left out"), "{warnings}");
}
