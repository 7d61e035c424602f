//! Parameters that a scene sets to numbers or to textures.

use std::sync::Arc;

use rtsl::Instance;
use rtsl_scene::reader::DiskFiles;
use rtsl_scene::{LoadOptions, SceneSource};

/// Loads a scene with a sphere of this material, and returns the material and the messages, or those of the failure.
fn material(directives: &str) -> Result<(Arc<Instance>, String), String> {
    let folder = tempfile::tempdir().unwrap();
    let scene = format!(
        "Camera \"perspective\"\nWorldBegin\n\
         Texture \"checks\" \"float\" \"checkerboard\" \"float tex1\" 0.2 \"float tex2\" 0.7\n\
         Texture \"paint\" \"spectrum\" \"constant\" \"rgb value\" [0.1 0.2 0.3]\n\
         {directives}\nShape \"sphere\"\n"
    );
    let path = folder.path().join("scene.pbrt");
    std::fs::write(&path, scene).unwrap();
    let mut source = SceneSource::read(&path, &DiskFiles, &LoadOptions::default());
    let loaded = source.load().map_err(|messages| messages.to_text(false))?;
    Ok((loaded.scene.materials[0].clone(), loaded.warnings.to_text(false)))
}

fn made(directives: &str) -> Arc<Instance> {
    let (material, messages) = material(directives).unwrap_or_else(|messages| panic!("{messages}"));
    assert_eq!(messages, "", "{directives}");
    material
}

fn floats(instance: &Instance, member: &str) -> Vec<f32> {
    instance.member(member).unwrap().iter().map(|word| f32::from_bits(*word)).collect()
}

#[test]
fn a_parameter_of_pbrt_is_a_number_or_a_texture() {
    for name in ["conductor", "dielectric", "coateddiffuse"] {
        let number = made(&format!("Material \"{name}\" \"float roughness\" 0.25"));
        assert_eq!(floats(&number, "roughness"), [0.25]);
        assert!(number.reference("roughness").is_none());
        let textured = made(&format!(
            "Material \"{name}\" \"texture roughness\" \"checks\" \"texture vroughness\" \"checks\""
        ));
        assert_eq!(textured.reference("roughness").unwrap().class().name, "Checkerboard");
        assert_eq!(textured.reference("roughnessV").unwrap().class().name, "Checkerboard");
        assert!(textured.reference("roughnessU").is_none());
    }
    let metal = made(
        "Material \"coatedconductor\" \"texture conductor.eta\" \"paint\" \"rgb conductor.k\" [1 2 3] \
         \"texture interface.roughness\" \"checks\"",
    );
    assert_eq!(metal.reference("eta").unwrap().class().name, "Constant");
    assert_eq!(floats(&metal, "k"), [1.0, 2.0, 3.0]);
    assert!(metal.reference("coatRoughness").is_some());
}

#[test]
fn colours_are_numbers_greys_or_textures() {
    let diffuse = |parameter: &str| made(&format!("Material \"diffuse\" {parameter}"));
    assert_eq!(floats(&diffuse("\"rgb reflectance\" [0.1 0.2 0.3]"), "kd"), [0.1, 0.2, 0.3]);
    assert_eq!(floats(&diffuse(""), "kd"), [0.5; 3]);
    assert!(diffuse("\"texture reflectance\" \"paint\"").reference("kd").is_some());
    let own =
        made("Material \"Principled\" \"texture metallic\" \"checks\" \"float baseColor\" 0.75");
    assert_eq!(floats(&own, "baseColor"), [0.75; 3]);
    assert!(own.reference("metallic").is_some());
}

#[test]
fn what_is_neither_is_an_error() {
    for (parameter, message) in [
        ("\"texture roughness\" \"nothing\"", "nothing"),
        (
            "\"float roughness\" [0.1 0.2]",
            "`roughness` is of type `float`, which takes 1 numbers, found 2",
        ),
        ("\"float roughness\" 2", "2 is not between 0 and 1"),
        ("\"bool roughness\" true", "`roughness` is of type `float`, found"),
        ("\"texture roughness\" [\"checks\" \"checks\"]", "`roughness` takes 1 names, found 2"),
    ] {
        let messages = material(&format!("Material \"conductor\" {parameter}")).unwrap_err();
        assert!(messages.contains(message), "{messages}");
    }
}

#[test]
fn hair_takes_textures() {
    let hair = made(
        "Material \"hair\" \"texture beta_m\" \"checks\" \"texture beta_n\" \"checks\" \"texture alpha\" \"checks\" \
         \"texture eta\" \"checks\" \"texture pheomelanin\" \"checks\"",
    );
    for name in ["betaM", "betaN", "tilt", "eta", "pheomelanin"] {
        assert_eq!(hair.reference(name).unwrap().class().name, "Checkerboard", "{name}");
    }
    assert_eq!(floats(&hair, "eumelanin"), [0.0]);
}
