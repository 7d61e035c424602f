//! The names and parameters of the format, and what stands for them: text in, instances out.

use std::path::{Path, PathBuf};

use rtsl::{Backend, Engine, EngineOptions, Messages};
use rtsl_image::{Image, ImageOptions, write_image};
use rtsl_render::batch::BatchScene;
use rtsl_render::compiled::CompiledScene;
use rtsl_scene::reader::{DiskFiles, MemoryFiles};
use rtsl_scene::{LoadOptions, Loaded, load_scene};

fn load(world: &str) -> Result<Loaded, Messages> {
    let text = format!("Camera \"perspective\"\nWorldBegin\n{world}");
    let files = MemoryFiles([(PathBuf::from("scene.pbrt"), text)].into());
    load_scene(Path::new("scene.pbrt"), &files, &LoadOptions::default())
}

fn loaded(world: &str) -> Loaded {
    load(world).unwrap_or_else(|messages| panic!("{}", messages.to_text(false)))
}

#[test]
fn a_texture_or_a_number_cuts_a_shape_out() {
    let shapes = "Texture \"holes\" \"float\" \"Checker\"\n\
        Shape \"sphere\" \"texture alpha\" \"holes\"\nShape \"Plane\" \"float alpha\" 0.25\n\
        Shape \"trianglemesh\" \"point3 P\" [0 0 0 1 0 0 0 1 0] \"float alpha\" 1\nShape \"disk\"\n";
    let loaded = loaded(shapes);
    let alphas = loaded.scene.objects.iter().map(|object| object.alpha.as_ref());
    let classes: Vec<Option<&str>> =
        alphas.map(|alpha| alpha.map(|it| it.class().name.as_str())).collect();
    assert_eq!(classes, [Some("Checker"), Some("Constant"), None, None]);
    assert_eq!(loaded.warnings.to_text(false), "");
    // Of the renderers one does without.
    let options = EngineOptions { backend: Backend::Interpreter, ..EngineOptions::default() };
    let (engine, _) = Engine::new(options).expect("the interpreter is there");
    let mut warnings = Messages::default();
    CompiledScene::new(loaded.scene.clone(), &engine, &mut warnings).expect("it compiles");
    let interactive = warnings.to_text(false);
    assert_eq!(interactive.matches("warning[W0601]").count(), 1, "said once: {interactive}");
    let mut warnings = Messages::default();
    BatchScene::new(&loaded.scene, &engine, &mut warnings, &|_| {}).expect("it compiles");
    assert_eq!(warnings.to_text(false), "");
}

#[test]
fn what_cuts_a_shape_out_has_to_be_a_texture() {
    let message = |shape: &str| load(shape).unwrap_err().to_text(false);
    let unknown = message("Shape \"Sphere\" \"texture alpha\" \"holes\"\n");
    assert!(unknown.contains("unknown texture `holes`"), "{unknown}");
    let wrong = message("Shape \"Sphere\" \"bool alpha\" true\n");
    assert!(wrong.contains("`alpha` refers to a texture"), "{wrong}");
}

/// The class and a member of each material, texture or light, as numbers.
fn numbers(instance: &rtsl::Instance, member: &str) -> Vec<f32> {
    let words = instance.member(member).unwrap_or_default();
    words.iter().map(|word| f32::from_bits(*word)).collect()
}

#[test]
fn materials_of_the_format_have_classes() {
    let names = [
        "diffuse",
        "conductor",
        "dielectric",
        "thindielectric",
        "coateddiffuse",
        "coatedconductor",
        "diffusetransmission",
    ];
    let shapes = names.map(|name| format!("Material \"{name}\"\nShape \"sphere\"\n"));
    let loaded = loaded(&shapes.concat());
    let classes: Vec<&str> =
        loaded.scene.materials.iter().map(|it| it.class().name.as_str()).collect();
    assert_eq!(
        classes,
        [
            "Lambertian",
            "Conductor",
            "Dielectric",
            "ThinDielectric",
            "CoatedDiffuse",
            "CoatedConductor",
            "DiffuseTransmission",
        ]
    );
    assert!(loaded.warnings.is_empty(), "{}", loaded.warnings.to_text(false));
}

#[test]
fn flat_patches_are_parallelograms() {
    let patch = |rest: &str| {
        let text = format!("Shape \"bilinearmesh\" \"point3 P\" [0 0 0  2 0 0  0 1 1  2 1 1{rest}");
        let loaded = loaded(&text);
        (loaded.scene.objects[0].primitive.clone(), loaded.warnings.to_text(false))
    };
    let class = |rest: &str| patch(rest).0.class().name.clone();
    assert_eq!(class("]"), "Parallelogram");
    assert_eq!(class("] \"integer indices\" [0 1 2 3] \"float alpha\" 0.5"), "Parallelogram");
    assert_eq!(class("] \"integer indices\" [1 0 3 2]"), "BilinearMesh");
    assert_eq!(class("  3 3 3] \"integer indices\" [0 1 2 3  1 3 4 2]"), "BilinearMesh");
    assert_eq!(class("] \"normal N\" [0 0 1 0 0 1 0 0 1 0 0 1]"), "BilinearMesh");
    assert_eq!(class("] \"point2 uv\" [0 0 1 0 0 1 2 2]"), "BilinearMesh");
    let bent = loaded("Shape \"bilinearmesh\" \"point3 P\" [0 0 0  2 0 0  0 1 1  2 1 1.01]");
    assert_eq!(bent.scene.objects[0].primitive.class().name, "BilinearMesh");
    let (square, warnings) = patch("] \"point2 uv\" [1 0 3 0 1 4 3 4]");
    assert_eq!(warnings, "");
    assert_eq!(numbers(&square, "sideV"), [0.0, 1.0, 1.0]);
    assert_eq!(numbers(&square, "uv"), [1.0, 0.0]);
    assert_eq!(numbers(&square, "uvAlongV"), [0.0, 4.0]);
}

#[test]
fn spectra_become_colours() {
    let loaded = loaded(
        "LightSource \"infinite\" \"blackbody L\" 6500 \"float scale\" 2\n\
         LightSource \"point\" \"rgb I\" [1 2 3] \"float power\" 25.132741\n\
         LightSource \"spot\" \"float power\" 1 \"float coneangle\" 90 \"float conedeltaangle\" 30\n\
         Material \"conductor\" \"spectrum eta\" \"metal-Au-eta\" \"spectrum k\" \"metal-Au-k\"\n\
         Shape \"sphere\"\nMaterial \"dielectric\" \"spectrum eta\" \"glass-BK7\"\nShape \"sphere\"\n\
         Material \"coatedconductor\" \"spectrum conductor.k\" [360 2 830 2]\nShape \"sphere\"\n",
    );
    let [gold, glass, coated] = loaded.scene.materials.as_slice() else { panic!() };
    assert_eq!(numbers(gold, "eta"), [0.1217, 0.3929, 1.5871]);
    assert_eq!(numbers(glass, "eta"), [1.5168]);
    assert!(numbers(coated, "k").iter().all(|k| (k - 2.0).abs() < 1e-6));
    let radiance = numbers(&loaded.scene.lights[0].light, "radiance");
    assert!(radiance.iter().all(|component| (component - 1.0).abs() < 0.08), "{radiance:?}");
    let strength = numbers(&loaded.scene.lights[1].light, "strength");
    assert!((strength[0] - 2.0).abs() < 1e-6, "{strength:?}");
    let strength = numbers(&loaded.scene.lights[2].light, "strength");
    // The cosine of the edge's middle is 1/4.
    assert!((strength[0] - 1.0 / (1.5 * std::f32::consts::PI)).abs() < 1e-6, "{strength:?}");
}

#[test]
fn wrong_spectra_are_errors() {
    for (spectrum, problem) in [
        ("\"spectrum eta\" \"metal-Ag\"", "did you mean `metal-"),
        ("\"spectrum eta\" [700 1 400 1]", "wavelengths do not increase"),
        ("\"spectrum eta\" [1 2 3 4 5]", "takes 2 numbers a value"),
        ("\"blackbody eta\" [-3]", "one temperature"),
    ] {
        let text = format!("Material \"conductor\" {spectrum}\nShape \"sphere\"\n");
        let messages = load(&text).unwrap_err().to_text(false);
        assert!(messages.contains(problem), "{messages}");
    }
}

#[test]
fn what_is_not_supported_is_said_once_and_left_out() {
    let loaded = loaded(
        "Texture \"rough\" \"float\" \"dots\" \"float inside\" 1\n\
         Material \"hair\" \"float beta_m\" 0.3\nShape \"sphere\"\nShape \"curve\" \"string type\" \"flat\"\n\
         Shape \"curve\"\nShape \"disk\" \"float phimax\" 90\nShape \"disk\" \"float phimax\" 90\n\
         Material \"conductor\" \"texture roughness\" \"rough\" \"string normalmap\" \"bumps.png\"\n\
         Shape \"sphere\"\nMaterial \"interface\"\nShape \"sphere\"\nLightSource \"projection\"\n",
    );
    let scene = &loaded.scene;
    assert_eq!((scene.objects.len(), scene.lights.len()), (4, 0));
    let classes: Vec<&str> = scene.materials.iter().map(|it| it.class().name.as_str()).collect();
    assert_eq!(classes, ["Lambertian", "Conductor"]);
    let warnings = loaded.warnings.to_text(false);
    for once in [
        "material `hair` is not supported: `Lambertian` takes its place",
        "texture `dots` is not supported: `Constant` takes its place",
        "shape `curve` is not supported: it is left out",
        "light `projection` is not supported: it is left out",
        "`phimax` of shape `disk` has no effect",
        "`roughness` of material `conductor` has no effect",
        "`normalmap` of material `conductor` has no effect",
    ] {
        assert_eq!(warnings.matches(once).count(), 1, "{once}: {warnings}");
    }
    assert_eq!(warnings.matches("warning[").count(), 7, "{warnings}");
}

#[test]
fn mixtures_and_textures_refer_to_their_parts() {
    let loaded = loaded(
        "Texture \"a\" \"spectrum\" \"checkerboard\" \"rgb tex1\" [1 0 0] \"float uscale\" 4\n\
         Texture \"b\" \"spectrum\" \"scale\" \"texture tex\" \"a\" \"float scale\" 0.5\n\
         Texture \"c\" \"spectrum\" \"mix\" \"texture tex1\" \"b\" \"float amount\" 0.2\n\
         MakeNamedMaterial \"one\" \"string type\" \"diffuse\" \"texture reflectance\" \"c\"\n\
         MakeNamedMaterial \"other\" \"string type\" \"dielectric\"\n\
         Material \"mix\" \"string materials\" [\"one\" \"other\"] \"float amount\" 0.25\n\
         Shape \"sphere\"\n",
    );
    assert_eq!(loaded.scene.materials[0].class().name, "Mix");
    assert!(loaded.warnings.is_empty(), "{}", loaded.warnings.to_text(false));
}

#[test]
fn images_are_read_for_textures_and_skies() {
    let folder = tempfile::tempdir().unwrap();
    let mut image = Image::new(4, 2).unwrap();
    image.pixels[0] = [1.0, 0.0, 0.0];
    image.pixels[7] = [0.0, 0.0, 0.5];
    for name in ["image.exr", "image.png"] {
        write_image(&image, &folder.path().join(name), &ImageOptions::default()).unwrap();
    }
    let scene = folder.path().join("scene.pbrt");
    let text = "Camera \"perspective\"\nWorldBegin\n\
        LightSource \"infinite\" \"string filename\" \"image.exr\" \"float scale\" 3\n\
        Texture \"map\" \"spectrum\" \"imagemap\" \"string filename\" \"image.png\" \"string wrap\" \"clamp\" \"float vscale\" 2\n\
        Material \"diffuse\" \"texture reflectance\" \"map\"\nShape \"sphere\" \"texture alpha\" \"map\"\n";
    std::fs::write(&scene, text).unwrap();
    let loaded = load_scene(&scene, &DiskFiles, &LoadOptions::default());
    let loaded = loaded.unwrap_or_else(|messages| panic!("{}", messages.to_text(false)));
    let map = loaded.scene.objects[0].alpha.as_ref().unwrap();
    assert_eq!(map.class().name, "Image");
    assert_eq!(map.member("size"), Some(&[4, 2][..]));
    assert_eq!(map.member("wrap"), Some(&[1][..]));
    assert_eq!(numbers(map, "repeat"), [1.0, 2.0]);
    let sky = &loaded.scene.lights[0].light;
    assert_eq!((sky.class().name.as_str(), numbers(sky, "strength")), ("ImageSky", vec![3.0]));
    assert_eq!(sky.member("size"), Some(&[4, 2][..]));
}

#[test]
fn a_file_that_is_no_image_is_an_error() {
    for light in ["", " \"string filename\" \"scene.pbrt\""] {
        let text = format!("Texture \"t\" \"spectrum\" \"imagemap\"{light}\n");
        let messages = load(&text).unwrap_err().to_text(false);
        assert!(
            messages.contains("names no file") || messages.contains("neither a PNG"),
            "{messages}"
        );
    }
}

#[test]
fn a_texture_for_a_number_is_refused_with_advice() {
    let text = "Texture \"holes\" \"float\" \"Checker\"\n\
        Material \"Principled\" \"texture roughness\" \"holes\"\n";
    let messages = load(text).unwrap_err().to_text(false);
    assert!(messages.contains("error[E0607]: `roughness` is of type `float`, found a texture"));
    let advice = "help: give a value; a class takes textures by members of type `rt_Texture`";
    assert!(messages.contains(advice), "{messages}");
}
