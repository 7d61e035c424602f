//! `rtsl materialx`: texts of materials, their contracts, and counts.

use std::path::Path;

use crate::command::{DONE, Folder, INPUT_AT_FAULT, WRONG_USAGE};

/// A document of the repository.
fn document(name: &str) -> String {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../scenes/materialx").join(name);
    std::fs::read_to_string(path).unwrap()
}

/// Two surfaces of closures: layers with emission and holes, and rough glass.
const CLOSURES: &str = r#"<materialx version="1.39">
  <oren_nayar_diffuse_bsdf name="matte" type="BSDF">
    <input name="color" type="color3" value="0.8, 0.3, 0.2"/>
    <input name="roughness" type="float" value="0.3"/>
  </oren_nayar_diffuse_bsdf>
  <dielectric_bsdf name="varnish" type="BSDF">
    <input name="roughness" type="vector2" value="0.1, 0.2"/>
  </dielectric_bsdf>
  <layer name="varnished" type="BSDF">
    <input name="top" type="BSDF" nodename="varnish"/>
    <input name="base" type="BSDF" nodename="matte"/>
  </layer>
  <conductor_bsdf name="metal" type="BSDF">
    <input name="roughness" type="vector2" value="0.3, 0.3"/>
  </conductor_bsdf>
  <texcoord name="uv" type="vector2"/>
  <extract name="u" type="float"><input name="in" type="vector2" nodename="uv"/></extract>
  <mix name="mixed" type="BSDF">
    <input name="fg" type="BSDF" nodename="metal"/>
    <input name="bg" type="BSDF" nodename="varnished"/>
    <input name="mix" type="float" nodename="u"/>
  </mix>
  <sheen_bsdf name="fibres" type="BSDF"><input name="weight" type="float" value="0.5"/></sheen_bsdf>
  <layer name="all" type="BSDF">
    <input name="top" type="BSDF" nodename="fibres"/>
    <input name="base" type="BSDF" nodename="mixed"/>
  </layer>
  <uniform_edf name="glow" type="EDF"><input name="color" type="color3" value="0.1, 0, 0"/></uniform_edf>
  <surface name="layered" type="surfaceshader">
    <input name="bsdf" type="BSDF" nodename="all"/>
    <input name="edf" type="EDF" nodename="glow"/>
    <input name="opacity" type="float" value="0.7"/>
  </surface>
  <surfacematerial name="Layered" type="material">
    <input name="surfaceshader" type="surfaceshader" nodename="layered"/>
  </surfacematerial>
  <dielectric_bsdf name="boundary" type="BSDF">
    <input name="scatter_mode" type="string" value="RT"/>
    <input name="roughness" type="vector2" value="0.2, 0.2"/>
  </dielectric_bsdf>
  <surface name="clear" type="surfaceshader">
    <input name="bsdf" type="BSDF" nodename="boundary"/>
  </surface>
  <surfacematerial name="Clear" type="material">
    <input name="surfaceshader" type="surfaceshader" nodename="clear"/>
  </surfacematerial>
</materialx>"#;

#[test]
fn translated_materials_keep_the_contracts() {
    let folder = Folder::new("materialx");
    folder.write("marble.mtlx", document("marble.mtlx"));
    folder.write("closures.mtlx", CLOSURES);
    for name in ["marble", "closures"] {
        let (from, to) = (format!("{name}.mtlx"), format!("{name}.rtsl"));
        let ran = folder.run(&["materialx", &from, "-o", &to]);
        assert_eq!(ran.code(), DONE, "{}", ran.errors());
        let ran = folder.run(&["test", &to]);
        assert_eq!(ran.code(), DONE, "{}", ran.output());
    }
}

/// Hair with a colour for each lobe, brown absorption, and a fifth of it missing.
const HAIR: &str = r#"<materialx version="1.39">
  <chiang_hair_roughness name="rough" type="multioutput"/>
  <deon_hair_absorption_from_melanin name="brown" type="vector3"/>
  <chiang_hair_bsdf name="strand" type="BSDF">
    <input name="tint_R" type="color3" value="0.9, 0.8, 0.7"/>
    <input name="tint_TT" type="color3" value="0.5, 0.8, 0.7"/>
    <input name="roughness_R" type="vector2" nodename="rough" output="roughness_R"/>
    <input name="roughness_TT" type="vector2" nodename="rough" output="roughness_TT"/>
    <input name="roughness_TRT" type="vector2" nodename="rough" output="roughness_TRT"/>
    <input name="absorption_coefficient" type="vector3" nodename="brown"/>
    <input name="cuticle_angle" type="float" value="0.47"/>
  </chiang_hair_bsdf>
  <surface name="s" type="surfaceshader">
    <input name="bsdf" type="BSDF" nodename="strand"/>
    <input name="opacity" type="float" value="0.8"/>
  </surface>
  <surfacematerial name="Brown" type="material">
    <input name="surfaceshader" type="surfaceshader" nodename="s"/>
  </surfacematerial>
</materialx>"#;

/// As the library's hair, that of documents is not reciprocal.
#[test]
fn hair_keeps_all_contracts_but_reciprocity() {
    let folder = Folder::new("materialx");
    folder.write("hair.mtlx", HAIR);
    let ran = folder.run(&["materialx", "hair.mtlx", "-o", "hair.rtsl"]);
    assert_eq!(ran.code(), DONE, "{}", ran.errors());
    let shown = folder.run(&["test", "hair.rtsl"]).output();
    let broken = shown.matches("BROKEN").count();
    assert_eq!(broken, shown.matches("BROKEN  light takes the same way back").count(), "{shown}");
    assert!(shown.contains("held    samples are distributed as evaluatePDF says"), "{shown}");
}

/// Two metals of closures, and paint that lets light pass.
const MIXTURE: &str = r#"<materialx version="1.39">
  <conductor_bsdf name="metal" type="BSDF"/>
  <surface name="steel" type="surfaceshader">
    <input name="bsdf" type="BSDF" nodename="metal"/>
    <input name="opacity" type="float" value="0.6"/>
  </surface>
  <standard_surface name="paint" type="surfaceshader">
    <input name="base_color" type="color3" value="0.1, 0.2, 0.6"/>
  </standard_surface>
  <texcoord name="uv" type="vector2"/>
  <extract name="u" type="float"><input name="in" type="vector2" nodename="uv"/></extract>
  <mix name="both" type="surfaceshader">
    <input name="fg" type="surfaceshader" nodename="steel"/>
    <input name="bg" type="surfaceshader" nodename="paint"/>
    <input name="mix" type="float" nodename="u"/>
  </mix>
  <mix name="three" type="surfaceshader">
    <input name="fg" type="surfaceshader" nodename="steel"/>
    <input name="bg" type="surfaceshader" nodename="both"/>
    <input name="mix" type="float" value="0.3"/>
  </mix>
  <surfacematerial name="Two" type="material">
    <input name="surfaceshader" type="surfaceshader" nodename="both"/>
  </surfacematerial>
  <surfacematerial name="Three" type="material">
    <input name="surfaceshader" type="surfaceshader" nodename="three"/>
  </surfacematerial>
</materialx>"#;

/// In scenes mixtures are tested with the surfaces that they mix.
#[test]
fn mixtures_keep_the_contracts() {
    let folder = Folder::new("materialx");
    folder.write("mixture.mtlx", MIXTURE);
    let ran = folder.run(&["materialx", "mixture.mtlx"]);
    for class in ["class Two : Mix;", "class Three : rt_Material;"] {
        assert!(ran.output().contains(class), "{}{}", ran.output(), ran.errors());
    }
    let shape = |name: &str| {
        format!(
            "Material \"materialx\" \"string file\" \"mixture.mtlx\" \"string material\" \"{name}\"\n\
             Shape \"sphere\"\n"
        )
    };
    let scene = format!("Camera \"perspective\"\nWorldBegin\n{}{}", shape("Two"), shape("Three"));
    folder.write("scene.pbrt", scene);
    let ran = folder.run(&["test", "scene.pbrt", "--samples", "4000"]);
    assert_eq!(ran.code(), DONE, "{}{}", ran.output(), ran.errors());
}

#[test]
fn a_material_is_chosen_by_its_name() {
    let folder = Folder::new("materialx");
    folder.write("wall.mtlx", document("wall.mtlx"));
    let ran = folder.run(&["materialx", "wall.mtlx", "--material", "Copper"]);
    assert!(ran.output().contains("class Copper : OpenPbr;"), "{}", ran.output());
    assert!(!ran.output().contains("Bricks"), "{}", ran.output());
    let ran = folder.run(&["materialx", "wall.mtlx", "--material", "Coper"]);
    assert_eq!(ran.code(), INPUT_AT_FAULT);
    assert!(ran.errors().contains("did you mean `Copper`?"), "{}", ran.errors());
    let ran = folder.run(&["materialx", "wall.mtlx", "--outputs", "--material", "Copper"]);
    assert_eq!(ran.code(), WRONG_USAGE);
}

#[test]
fn outputs_are_textures_with_values() {
    let folder = Folder::new("materialx");
    folder.write(
        "ramp.mtlx",
        r#"<materialx version="1.39">
            <ramplr name="r" type="float"><input name="valuer" type="float" value="2"/></ramplr>
            <output name="out" type="float" nodename="r"/>
        </materialx>"#,
    );
    let ran = folder.run(&["materialx", "ramp.mtlx", "--outputs", "-o", "ramp.rtsl"]);
    assert_eq!(ran.code(), DONE, "{}", ran.errors());
    let ran = folder.run(&["eval", "ramp.rtsl", "lookup", "--state", "rt_TextureUV=0.25,0"]);
    assert!(ran.output().contains("rt_FloatTextureValue = 0.5"), "{}", ran.output());
}

#[test]
fn nothing_is_written_for_documents_with_errors() {
    let folder = Folder::new("materialx");
    folder.write("bad.mtlx", "<materialx><surfacematerial name=\"m\"/></materialx>");
    let ran = folder.run(&["materialx", "bad.mtlx", "-o", "bad.rtsl"]);
    assert_eq!(ran.code(), INPUT_AT_FAULT);
    assert!(
        ran.errors().contains("E0631") && ran.errors().contains("bad.mtlx:1"),
        "{}",
        ran.errors()
    );
    assert!(!folder.0.path().join("bad.rtsl").exists());
    let ran = folder.run(&["materialx", "none.mtlx"]);
    assert!(ran.errors().contains("E0601"), "{}", ran.errors());
}

#[test]
fn documents_of_a_folder_are_counted() {
    let folder = Folder::new("materialx");
    folder.write("marble.mtlx", document("marble.mtlx"));
    folder.write("empty.mtlx", "<materialx version=\"1.39\"/>");
    folder.write("broken.mtlx", "<materialx");
    let ran = folder.run(&["materialx", "--check", "."]);
    assert_eq!(ran.code(), DONE, "{}", ran.errors());
    assert!(
        ran.output().contains("3 documents, of which 1 have neither materials nor outputs")
            && ran.output().contains("1 translated, 1 compiled, 1 with finite values"),
        "{}",
        ran.output()
    );
    let ran = folder.run(&["materialx", "--check", ".", "--json"]);
    let counts: serde_json::Value = serde_json::from_str(&ran.output()).unwrap();
    assert_eq!(counts["counts"]["finite"], 1);
    assert_eq!(counts["documents"][2]["stage"], "finite");
}
