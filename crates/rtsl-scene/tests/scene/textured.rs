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
        ("\"bool roughness\" true", "`roughness` is of type `float`, found"),
        ("\"texture roughness\" [\"checks\" \"checks\"]", "`roughness` takes 1 names, found 2"),
    ] {
        let messages = material(&format!("Material \"conductor\" {parameter}")).unwrap_err();
        assert!(messages.contains(message), "{messages}");
    }
}

/// pbrt reads them, too.
#[test]
fn values_outside_of_their_ranges_are_taken() {
    let rough = material("Material \"conductor\" \"float roughness\" 1.5 \"rgb eta\" [-0.1 1 1]");
    let (rough, messages) = rough.unwrap_or_else(|messages| panic!("{messages}"));
    assert_eq!(floats(&rough, "roughness"), [1.5]);
    assert_eq!(floats(&rough, "eta"), [-0.1, 1.0, 1.0]);
    assert_eq!(messages.matches("warning[W0502]").count(), 2, "{messages}");
    assert!(messages.contains("1.5 is not between 0 and 1"), "{messages}");
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

/// The part of the light that a medium returns, as its class computes it.
#[test]
fn subsurface_materials_are_media_by_name_by_coefficients_or_by_reflectance() {
    let simplified = |parameters: &str| {
        let made = material(&format!("Material \"subsurface\" {parameters}"));
        let (made, messages) = made.unwrap_or_else(|messages| panic!("{messages}"));
        assert_eq!(messages.matches("warning[").count(), 1, "{messages}");
        let expected =
            "material `subsurface` is simplified: light leaves its surface where it enters it";
        assert!(messages.contains(expected), "{messages}");
        assert_eq!(made.class().name, "Subsurface");
        assert_eq!(made.buffer("albedos").unwrap().len(), 33);
        made
    };
    let coefficients = |made: &Instance| [floats(made, "sigmaA"), floats(made, "sigmaS")];
    let milk = coefficients(&simplified(""));
    assert_eq!(
        milk,
        coefficients(&simplified(
            "\"rgb sigma_a\" [0.0011 0.0024 0.014] \"rgb sigma_s\" [2.55 3.21 3.77]"
        ))
    );
    // The part of scattering in extinction, and the rest.
    for (absorption, scattering) in milk[0].iter().zip(&milk[1]) {
        assert!((absorption + scattering - 1.0).abs() < 1e-6 && *scattering > 0.99, "{milk:?}");
    }
    // The name of a named material is another.
    let made = material(
        "MakeNamedMaterial \"soap\" \"string type\" \"subsurface\" \"string name\" \"Cream\"\n\
         NamedMaterial \"soap\"",
    );
    let cream = simplified("\"string name\" \"Cream\"");
    assert_eq!(floats(&made.unwrap().0, "sigmaS"), floats(&cream, "sigmaS"));
    let named = "\"string name\" \"Skin1\" \"rgb sigma_a\" [9 9 9] \"texture reflectance\" \"paint\" \"float g\" 0.5";
    let skin = simplified(named);
    assert_eq!(coefficients(&skin), coefficients(&simplified("\"string name\" \"Skin1\"")));
    assert!(skin.reference("reflectance").is_none());
    // Coefficients of named media are reduced ones, so that they are independent of `g`.
    assert_eq!(skin.buffer("albedos"), simplified("\"string name\" \"Marble\"").buffer("albedos"));
    let given =
        simplified("\"rgb sigma_a\" [1 2 3] \"texture sigma_s\" \"paint\" \"rgb reflectance\" 0.5");
    assert_eq!(floats(&given, "sigmaA"), [1.0, 2.0, 3.0]);
    assert!(given.reference("sigmaS").is_some() && given.reference("reflectance").is_none());
    let diffuse =
        simplified("\"texture reflectance\" \"paint\" \"rgb mfp\" [1 2 3] \"float scale\" 10");
    assert!(diffuse.reference("reflectance").is_some());
    assert_eq!(floats(&simplified("\"float eta\" 0.5"), "eta"), [1.0]);
    let messages = material("Material \"subsurface\" \"string name\" \"Skin9\"").unwrap_err();
    assert!(messages.contains("`name` is `Skin9`, which is no medium"), "{messages}");
    assert!(messages.contains("expected one of Apple, Chicken1"), "{messages}");
}
