//! A scene compiles the kernels that it calls, and no others.

use std::path::{Path, PathBuf};

use rtsl::{Backend, Engine, EngineOptions, Messages, Method};
use rtsl_render::compiled::CompiledScene;
use rtsl_scene::reader::MemoryFiles;
use rtsl_scene::{LoadOptions, load_scene};

/// A class whose methods each leave a mark for the later ones.
const MARKED: &str = r"
class Marked : rt_Primitive;
scratch float used;
void intersect() { if (hit(1.0)) used = 2.0; }
void computeBounds() { rt_BoundMin = vec3(-1.0); rt_BoundMax = vec3(1.0); }
void computeNormal() { rt_GeometricNormal = vec3(0.0, 0.0, 1.0); }
void computeTextureCoordinates() { rt_TextureUV = vec2(used); }
";

fn compiled(world: &str) -> CompiledScene {
    let text = format!("{FILM}Camera \"Pinhole\"\nWorldBegin\n{world}");
    let files = [("scene.pbrt", text.as_str()), ("marked.rtsl", MARKED)];
    let files = files.map(|(name, text)| (PathBuf::from(name), text.to_owned()));
    let files = MemoryFiles(files.into());
    let loaded = load_scene(Path::new("scene.pbrt"), &files, &LoadOptions::default());
    let loaded = loaded.unwrap_or_else(|messages| panic!("{}", messages.to_text(false)));
    let options = EngineOptions { backend: Backend::Interpreter, ..EngineOptions::default() };
    let (engine, _) = Engine::new(options).expect("the interpreter is always there");
    CompiledScene::new(loaded.scene, &engine, &mut Messages::default())
        .unwrap_or_else(|messages| panic!("{}", messages.to_text(false)))
}

fn has(scene: &CompiledScene, class: &str, method: Method) -> bool {
    let shader = scene.shaders.iter().find(|it| it.program.class().name == class);
    shader.expect("the class is in the scene").kernel(method).is_some()
}

const FILM: &str = "Film \"rgb\" \"integer xresolution\" 24 \"integer yresolution\" 16\n\
     Sampler \"stratified\" \"integer xsamples\" 1 \"integer ysamples\" 1\n";
const GREY: &str = "Material \"Lambertian\"\n";
const CHECKED: &str = "Texture \"check\" \"spectrum\" \"Checker\"\n\
                       Material \"Lambertian\" \"texture kd\" \"check\"\n";
const GLOWING: &str = "MakeNamedMaterial \"glow\" \"string type\" \"Emissive\"\n\
                       NamedMaterial \"glow\"\n";

#[test]
fn texture_coordinates_are_computed_where_something_reads_them() {
    let scene = compiled(&format!("{GREY}Shape \"Sphere\"\n{CHECKED}Shape \"Disk\""));
    assert!(!has(&scene, "Sphere", Method::ComputeTextureCoordinates));
    assert!(has(&scene, "Disk", Method::ComputeTextureCoordinates));
    assert!(!has(&scene, "Disk", Method::ComputeDerivatives));
    assert!(has(&scene, "Sphere", Method::ComputeNormal));
}

#[test]
fn materials_that_shade_are_not_asked_for_emission() {
    let scene = compiled(&format!("{GREY}Shape \"Sphere\"\n{GLOWING}Shape \"Disk\""));
    for class in ["Lambertian", "Emissive"] {
        assert!(has(&scene, class, Method::Shade), "{class}");
        assert!(!has(&scene, class, Method::Emission), "{class}");
    }
}

#[test]
fn hits_are_computed_anew_where_something_reads_their_scratch() {
    for (material, reads_scratch) in [(GREY, false), (CHECKED, true)] {
        let scene = compiled(&format!("{material}Shape \"Marked\""));
        let shader = scene.shaders.iter().find(|it| it.program.class().name == "Marked");
        let reads = shader.map(|shader| shader.reads_hit_scratch);
        assert_eq!(reads, Some(reads_scratch), "{material}");
    }
}
