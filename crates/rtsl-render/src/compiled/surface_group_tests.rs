//! A group has the kernels that its queries call, and no others.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use rtsl::{Backend, Engine, EngineOptions, Messages};
use rtsl_scene::reader::MemoryFiles;
use rtsl_scene::{LoadOptions, load_scene};

use super::*;
use crate::compiled::RenderScene;

/// A class whose methods each leave a mark for the later ones.
const MARKED: &str = r"
class Marked : rt_Primitive;
scratch float used;
void intersect() { if (hit(1.0)) used = 2.0; }
void computeBounds() { rt_BoundMin = vec3(-1.0); rt_BoundMax = vec3(1.0); }
void computeNormal() { rt_GeometricNormal = vec3(0.0, 0.0, 1.0); }
void computeTextureCoordinates() { rt_TextureUV = vec2(used); }
";

const GREY: &str = "Material \"Lambertian\"\n";
const CHECKED: &str = "Texture \"check\" \"spectrum\" \"Checker\"\n\
                       Material \"Lambertian\" \"texture kd\" \"check\"\n";
const GLOWING: &str = "MakeNamedMaterial \"glow\" \"string type\" \"Emissive\"\n\
                       NamedMaterial \"glow\"\n";

fn compiled(world: &str) -> RenderScene {
    let text = format!("Camera \"Pinhole\"\nWorldBegin\n{world}");
    let files = [("scene.pbrt", text.as_str()), ("marked.rtsl", MARKED)];
    let files = files.map(|(name, text)| (PathBuf::from(name), text.to_owned()));
    let files = MemoryFiles(files.into());
    let loaded = load_scene(Path::new("scene.pbrt"), &files, &LoadOptions::default());
    let loaded = loaded.unwrap_or_else(|messages| panic!("{}", messages.to_text(false)));
    let options = EngineOptions { backend: Backend::Interpreter, ..EngineOptions::default() };
    let (engine, _) = Engine::new(options).expect("the interpreter is always there");
    RenderScene::new(&loaded.scene, &engine, &[], &mut Messages::default(), &|_| {})
        .unwrap_or_else(|messages| panic!("{}", messages.to_text(false)))
}

/// Returns the groups for a query, by the shapes' classes.
fn groups(scene: &RenderScene, query: Query) -> BTreeMap<&str, SurfaceGroup> {
    let made = scene.make_groups(&[query].into());
    let (groups, _) = made.unwrap_or_else(|diagnostics| panic!("{diagnostics:?}"));
    let class = |key: &GroupKey| scene.compiled.class(key.class).name.as_str();
    groups.into_iter().map(|group| (class(&group.key), group)).collect()
}

#[test]
fn texture_coordinates_are_computed_where_something_reads_them() {
    let scene = compiled(&format!("{GREY}Shape \"Sphere\"\n{CHECKED}Shape \"Disk\""));
    let groups = groups(&scene, Query::Bsdf);
    let stores = |class: &str, name: &str| {
        let surfaces = groups[class].surfaces.as_ref().expect("it is asked about");
        let variable = lookup_state(name).expect("the table has it");
        surfaces.surface().state_components().contains(variable.first_component)
    };
    for (name, [of_grey, of_checked]) in [
        ("rt_GeometricNormal", [true, true]),
        ("rt_TextureUV", [false, true]),
        ("rt_du", [false, true]),
        ("rt_InverseRayDirection", [false, false]),
    ] {
        assert_eq!(stores("Sphere", name), of_grey, "{name}");
        assert_eq!(stores("Disk", name), of_checked, "{name}: the checks are filtered");
    }
}

#[test]
fn materials_that_shade_are_not_asked_for_emission() {
    let scene = compiled(&format!("{GREY}Shape \"Sphere\"\n{GLOWING}Shape \"Disk\""));
    for (class, group) in groups(&scene, Query::Shade) {
        let material = scene.classes().material_of(&group.key);
        assert!(material.has(Method::Shade) && material.has(Method::Emission), "{class}");
        assert_eq!(called_methods(material, &[Query::Shade].into()), [Method::Shade], "{class}");
        assert!(group.material.emission.is_none(), "{class}");
    }
}
