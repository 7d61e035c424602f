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
