//! The texts of classes.

use expect_test::expect;

use crate::{input, link, node, outputs_of, text_of, with_material};

#[test]
fn numbers_are_initial_values_and_graphs_are_functions() {
    let text = with_material(
        r#"<nodegraph name="g">
             <input name="low" type="float" value="0.1"/>
             <texcoord name="uv" type="vector2"/>
             <separate2 name="parts" type="multioutput"><input name="in" type="vector2" nodename="uv"/></separate2>
             <add name="sum" type="float">
               <input name="in1" type="float" nodename="parts" output="outx"/>
               <input name="in2" type="float" interfacename="low"/>
             </add>
             <output name="out" type="float" nodename="sum"/>
           </nodegraph>
           <standard_surface name="surface" type="surfaceshader">
             <input name="base_color" type="color3" value="0.5, 0.2, 0.1"/>
             <input name="specular_roughness" type="float" nodegraph="g" output="out"/>
             <input name="specular_IOR" type="float" value="1.4"/>
           </standard_surface>"#,
    );
    expect![[r#"
        /// `m` of `test.mtlx`, translated from MaterialX.
        class M : StandardSurface;

        public texture color baseColor = color(vec3(0.5, 0.2, 0.1));
        public texture float specularIor = 1.4;

        float specularRoughness() {
            vec2 n0 = rt_TextureUV;
            float n1 = n0.x;
            float n2 = n1 + 0.1;
            return n2;
        }
    "#]]
    .assert_eq(&text_of(&text));
}

#[test]
fn images_are_references() {
    let text = with_material(
        r#"<tiledimage name="wood" type="color3">
             <input name="file" type="filename" value="wood.png" colorspace="srgb_texture"/>
             <input name="uvtiling" type="vector2" value="4, 2"/>
           </tiledimage>
           <image name="alpha" type="color4">
             <input name="file" type="filename" value="leaf.png"/>
             <input name="uaddressmode" type="string" value="mirror"/>
           </image>
           <open_pbr_surface name="surface" type="surfaceshader">
             <input name="base_color" type="color3" nodename="wood"/>
             <input name="geometry_opacity" type="float" nodename="alpha" channels="a"/>
           </open_pbr_surface>"#,
    );
    expect![[r#"
        import shaders.materialx.placement as mxPlacement;

        /// `m` of `test.mtlx`, translated from MaterialX.
        class M : OpenPbr;

        [[doc "The image `wood.png`, sRGB."]]
        public rt_Texture image1;
        [[doc "The image `leaf.png`, linear."]]
        public rt_Texture image2;
        [[doc "Whether it has opacity."]]
        public bool image2HasOpacity = true;

        color baseColor() {
            vec2 n0 = rt_TextureUV;
            vec2 n1 = (n0 * vec2(4.0, 2.0) - vec2(0.0));
            vec2 n2 = vec2(rt_du, rt_dv) * abs(vec2(4.0, 2.0));
            vec3 n3 = isSet(image1) ? rgb(image1.lookup(n1, n2.x, n2.y)) : vec3(0.0);
            return color(n3);
        }

        float geometryOpacity() {
            vec2 n0 = rt_TextureUV;
            vec2 n4 = mxPlacement.wrapped(n0, ivec2(2, 0));
            vec2 n5 = vec2(rt_du, rt_dv);
            vec3 n6 = isSet(image2) ? rgb(image2.lookup(n4, n5.x, n5.y)) : vec4(0.0).xyz;
            float n7 = isSet(image2) ? (image2HasOpacity ? image2.lookupFloat(n4, n5.x, n5.y) : 1.0) : vec4(0.0).w;
            vec4 n8 = vec4(n6, n7);
            float n9 = n8.w;
            return n9;
        }
    "#]].assert_eq(&text_of(&text));
}

#[test]
fn normals_turn_the_surface() {
    let text = with_material(
        r#"<noise2d name="height" type="float"/>
           <bump name="relief" type="vector3">
             <input name="height" type="float" nodename="height"/>
           </bump>
           <standard_surface name="surface" type="surfaceshader">
             <input name="normal" type="vector3" nodename="relief"/>
           </standard_surface>"#,
    );
    expect![[r#"
        import shaders.materialx.noise as mxNoise;
        import shaders.materialx.placement as mxPlacement;

        /// `m` of `test.mtlx`, translated from MaterialX.
        class M : StandardSurface;

        vec3 surfaceNormal() {
            vec3 n0 = rt_ShadingNormal;
            vec2 n1 = rt_TextureUV;
            float n2 = mxNoise.perlin(n1) * 1.0 + 0.0;
            vec2 n3 = gradient(n2, n1);
            vec3 n4 = mxPlacement.normalOfSlope(n3, 1.0);
            vec3 n5 = mxPlacement.tangentOf(rt_ShadingNormal, rt_dPdu);
            vec3 n6 = mxPlacement.bitangentOf(rt_ShadingNormal, rt_dPdu, rt_dPdv);
            vec3 n7 = mxPlacement.mappedNormal(n4, vec2(1.0), n0, n5, n6);
            return mxPlacement.usableNormal(n7, rt_ShadingNormal, rt_GeometricNormal);
        }

        float cosineRatio(mat3 frame) { return mxPlacement.cosineRatio(rt_LightDirection, rt_ShadingNormal, frame[2]); }
    "#]].assert_eq(&text_of(&text));
}

#[test]
fn documents_define_nodes_of_their_own() {
    let text = with_material(
        r#"<xi:include href="nodes.mtlx"/>
           <twice name="once" type="float"><input name="in" type="float" value="0.2"/></twice>
           <twice name="again" type="float"><input name="in" type="float" nodename="once"/></twice>
           <gltf_pbr name="surface" type="surfaceshader">
             <input name="roughness" type="float" nodename="again"/>
           </gltf_pbr>"#,
    );
    expect![[r#"
        import shaders.materialx.color as mxColor;

        /// `m` of `test.mtlx`, translated from MaterialX.
        class M : OpenPbr;

        public texture color baseColor = color(vec3(1.0));
        public texture float baseMetalness = 1.0;

        float specularRoughness() {
            float n0 = 0.2 * 2.0;
            float n1 = n0 * 2.0;
            return mxColor.gltfRoughness(n1, 0.0);
        }
    "#]]
    .assert_eq(&text_of(&text));
}

#[test]
fn old_documents_are_read_as_new_ones() {
    let text = r#"<materialx version="1.36">
        <compare name="c" type="float">
          <input name="intest" type="float" value="0.5"/>
          <parameter name="cutoff" type="float" value="0.6"/>
          <input name="in1" type="float" value="1"/>
          <input name="in2" type="float" value="2"/>
        </compare>
        <material name="old">
          <shaderref name="s" node="standard_surface">
            <bindinput name="base_color" type="color3" value="0.2, 0.2, 0.6"/>
            <bindinput name="base" type="float" nodename="c"/>
          </shaderref>
        </material>
      </materialx>"#;
    expect![[r#"
        /// `old` of `test.mtlx`, translated from MaterialX.
        class Old : StandardSurface;

        public texture color baseColor = color(vec3(0.2, 0.2, 0.6));

        float base() {
            float n0 = 0.5 >= 0.6 ? 2.0 : 1.0;
            return n0;
        }
    "#]]
    .assert_eq(&text_of(text));
}

#[test]
fn outputs_are_textures() {
    let text = r#"<materialx version="1.39">
        <nodegraph name="g">
          <geompropvalue name="height" type="float">
            <input name="geomprop" type="string" value="my height"/>
            <input name="default" type="float" value="0.5"/>
          </geompropvalue>
          <constant name="c" type="color3"><input name="value" type="color3" value="1, 0.5, 0"/></constant>
          <multiply name="product" type="color3">
            <input name="in1" type="color3" nodename="c"/>
            <input name="in2" type="float" nodename="height"/>
          </multiply>
          <output name="out" type="color3" nodename="product"/>
        </nodegraph>
      </materialx>"#;
    expect![[r#"
        class G_out : rt_Texture;

        attribute float my_height = 0.5;
        void lookup() {
            vec3 n0 = vec3(float(my_height));
            vec3 n1 = vec3(1.0, 0.5, 0.0) * n0;
            rt_TextureColor = color(n1);
        }
    "#]]
    .assert_eq(&outputs_of(text));
}

/// Letters that XML does not allow there, and readers of MaterialX accept.
#[test]
fn tiles_and_prefixes_are_read() {
    let text = with_material(
        r#"<mine:image name="map" type="color3">
             <input name="file" type="filename" value="a.<UDIM>.png"/>
           </mine:image>
           <nodedef name="mine:ND_image" node="image" namespace="mine">
             <input name="file" type="filename" value=""/>
             <output name="out" type="color3"/>
           </nodedef>
           <nodegraph name="mine:NG_image" nodedef="mine:ND_image">
             <image name="inner" type="color3"><input name="file" type="filename" interfacename="file"/></image>
             <output name="out" type="color3" nodename="inner"/>
           </nodegraph>
           <standard_surface name="surface" type="surfaceshader">
             <input name="base_color" type="color3" nodename="map"/>
           </standard_surface>"#,
    );
    let found = text_of(&text);
    assert!(found.contains("The images `a.<UDIM>.png`") && !found.contains("error"), "{found}");
}

#[test]
fn files_have_paths_of_all_systems() {
    let image = |file: &str| {
        let image = node("image", "map", "color3", &input("file", "filename", file));
        let surface = node(
            "standard_surface",
            "surface",
            "surfaceshader",
            &link("base_color", "color3", "map"),
        );
        text_of(&with_material(&(image + &surface)).replacen(
            "<materialx",
            "<materialx fileprefix=\"maps/\"",
            1,
        ))
    };
    for (given, read) in [
        ("wood.png", "maps/wood.png"),
        ("old\\wood.png", "maps/old/wood.png"),
        ("C:\\maps\\wood.png", "C:/maps/wood.png"),
        ("/maps/wood.png", "/maps/wood.png"),
        ("wood.%(UDIM)d.png", "maps/wood.<UDIM>.png"),
        ("wood.<UVTILE>.png", "maps/wood.<UVTILE>.png"),
    ] {
        let text = image(given);
        assert!(text.contains(&format!("`{read}`")), "{given}: {text}");
    }
}

#[test]
fn further_coordinates_are_attributes() {
    let of = |coordinates: &str| {
        let image = node(
            "image",
            "map",
            "float",
            &(input("file", "filename", "a.png") + &link("texcoord", "vector2", "uv")),
        );
        let surface =
            node("standard_surface", "surface", "surfaceshader", &link("base", "float", "map"));
        text_of(&with_material(&(coordinates.to_owned() + &image + &surface)))
    };
    let primvar = |name: &str| {
        of(&node("UsdPrimvarReader", "uv", "vector2", &input("varname", "string", name)))
    };
    let second = [
        of(&node("texcoord", "uv", "vector2", &input("index", "integer", "1"))),
        of(&node("geompropvalue", "uv", "vector2", &input("geomprop", "string", "UV1"))),
        primvar("st1"),
        primvar("map2"),
    ];
    for text in second {
        assert!(text.contains("attribute vec2 uv1 = vec2(0.0);"), "{text}");
        assert!(text.contains("vec2 n0 = uv1;") && !text.contains("error"), "{text}");
    }
    assert!(primvar("st").contains("vec2 n0 = rt_TextureUV;"));
    let text = of(&node("texcoord", "uv", "vector2", &input("index", "integer", "8")));
    assert!(text.contains("E0632") && text.contains("7 is the last"), "{text}");
}

/// A graph within another reads the inputs of that one.
#[test]
fn graphs_are_within_graphs() {
    let text = with_material(
        r#"<nodegraph name="outer">
             <input name="tint" type="color3" value="0.5, 0.1, 0.1"/>
             <nodegraph name="inner">
               <input name="of" type="color3" interfacename="tint"/>
               <multiply name="half" type="color3">
                 <input name="in1" type="color3" interfacename="of"/>
                 <input name="in2" type="float" value="0.5"/>
               </multiply>
               <output name="out" type="color3" nodename="half"/>
             </nodegraph>
             <output name="out" type="color3" nodegraph="inner" output="out"/>
           </nodegraph>
           <standard_surface name="surface" type="surfaceshader">
             <input name="base_color" type="color3" nodegraph="outer" output="out"/>
           </standard_surface>"#,
    );
    let found = text_of(&text);
    assert!(found.contains("vec3(0.5, 0.1, 0.1) * ") && !found.contains("error"), "{found}");
}

#[test]
fn nodes_name_definitions_of_namespaces() {
    let text = with_material(
        r#"<nodedef name="ND_grey" node="grey" namespace="studio"><output name="out" type="float"/></nodedef>
           <nodegraph name="NG_grey" nodedef="ND_grey" namespace="studio">
             <constant name="c" type="float"><input name="value" type="float" value="0.25"/></constant>
             <output name="out" type="float" nodename="c"/>
           </nodegraph>
           <grey name="g" type="float" nodedef="ND_grey"/>
           <standard_surface name="surface" type="surfaceshader">
             <input name="base" type="float" nodename="g"/>
           </standard_surface>"#,
    );
    assert!(text_of(&text).contains("public texture float base = 0.25;"));
}

#[test]
fn materials_may_be_within_graphs() {
    let material =
        node("surfacematerial", "Inner", "material", &link("surfaceshader", "surfaceshader", "s"));
    let surface = node("standard_surface", "s", "surfaceshader", "");
    let graph = |output: &str| {
        text_of(&format!(
            "<materialx><nodegraph name=\"g\">{surface}{material}{output}</nodegraph></materialx>"
        ))
    };
    let output = "<output name=\"out\" type=\"material\" nodename=\"Inner\"/>";
    assert!(graph(output).contains("class G_out : StandardSurface;"), "{}", graph(output));
    assert!(graph("").contains("class G_Inner : StandardSurface;"), "{}", graph(""));
}

#[test]
fn materials_without_surfaces_are_left_out_beside_others() {
    let empty = node("surfacematerial", "Empty", "material", "");
    let surface = node("standard_surface", "surface", "surfaceshader", "");
    let text = text_of(&with_material(&(empty.clone() + &surface)));
    assert!(text.contains("`Empty` has no surface: it is left out"), "{text}");
    assert!(text.contains("class M : StandardSurface"), "{text}");
    let alone = text_of(&format!("<materialx>{empty}</materialx>"));
    assert!(alone.contains("E0631") && alone.contains("`Empty` has no surface"), "{alone}");
}

/// Materials of old documents share the names of shaders, and inherit them.
#[test]
fn old_materials_have_shaders_of_their_own() {
    let material = |name: &str, rest: &str| format!("<material name=\"{name}\"{rest}</material>");
    let shader = |base: &str| {
        format!(
            "><shaderref name=\"s\" node=\"standard_surface\">\
             <bindinput name=\"base\" type=\"float\" value=\"{base}\"/></shaderref>"
        )
    };
    let all = [
        material("First", &shader("0.25")),
        material("Second", &shader("0.5")),
        material("Third", " inherit=\"Second\">"),
        material("Fourth", "><materialinherit name=\"i\" material=\"First\"/>"),
    ];
    let text = text_of(&format!("<materialx version=\"1.36\">{}</materialx>", all.concat()));
    let bases: Vec<&str> = text.lines().filter_map(|it| it.split("float base = ").nth(1)).collect();
    assert_eq!(bases, ["0.25;", "0.5;", "0.5;", "0.25;"], "{text}");
}

#[test]
fn materials_override_shaders_of_the_oldest_documents() {
    let text = text_of(
        r#"<materialx version="1.25">
             <shader name="standard_surface" shadertype="surface">
               <input name="base" type="float" value="1.0" publicname="base_public"/>
               <input name="coat" type="float" value="0.5" publicname="coat_public"/>
             </shader>
             <material name="paint">
               <shaderref name="standard_surface" shadertype="surface"/>
               <override name="base_public" type="float" value="0.25"/>
             </material>
           </materialx>"#,
    );
    for line in ["class Paint : StandardSurface;", "float base = 0.25;", "float coat = 0.5;"] {
        assert!(text.contains(line), "{text}");
    }
}

#[test]
fn inputs_without_values_keep_those_of_the_node() {
    let inputs = input("base", "float", "") + &input("thin_walled", "boolean", "True");
    let text =
        text_of(&with_material(&node("standard_surface", "surface", "surfaceshader", &inputs)));
    assert!(!text.contains(" base ") && text.contains("public bool thinWalled = true;"), "{text}");
}

#[test]
fn colors_are_surfaces_that_emit() {
    let of = |input: &str| {
        text_of(&with_material(&format!(
            "<constant name=\"c\" type=\"color4\">\
             <input name=\"value\" type=\"color4\" value=\"0.2, 0.6, 0.3, 0.5\"/></constant>\n\
             <convert name=\"surface\" type=\"surfaceshader\">{input}</convert>"
        )))
    };
    expect![[r#"
        import shaders.materialx.color as mxColor;

        /// `m` of `test.mtlx`, translated from MaterialX.
        class M : OpenPbr;

        public texture color emissionColor = color(vec3(0.2, 0.6, 0.3));
        public texture float baseWeight = 0.0;
        public texture float specularWeight = 0.0;
        public bool geometryThinWalled = true;
        public texture float emissionLuminance = 1.0 * 1.0 / max(mxColor.unlitOpacity(1.0, 0.0 * vec3(1.0)), 1e-6);
    "#]].assert_eq(&of(&input("in", "color3", "0.2, 0.6, 0.3")));
    expect![[r#"
        import shaders.materialx.color as mxColor;

        /// `m` of `test.mtlx`, translated from MaterialX.
        class M : OpenPbr;

        public texture float baseWeight = 0.0;
        public texture float specularWeight = 0.0;
        public bool geometryThinWalled = true;
        public texture float emissionLuminance = 1.0 * 0.5 / max(mxColor.unlitOpacity(0.5, 0.0 * vec3(1.0)), 1e-6);
        public texture float geometryOpacity = mxColor.unlitOpacity(0.5, 0.0 * vec3(1.0));

        color emissionColor() {
            vec3 n0 = vec4(0.2, 0.6, 0.3, 0.5).xyz;
            return color(n0);
        }
    "#]].assert_eq(&of(&link("in", "color4", "c")));
    expect![[r#"
        import shaders.materialx.color as mxColor;

        /// `m` of `test.mtlx`, translated from MaterialX.
        class M : OpenPbr;

        public texture color emissionColor = color(vec3(0.5));
        public texture float baseWeight = 0.0;
        public texture float specularWeight = 0.0;
        public bool geometryThinWalled = true;
        public texture float emissionLuminance = 1.0 * 1.0 / max(mxColor.unlitOpacity(1.0, 0.0 * vec3(1.0)), 1e-6);
    "#]].assert_eq(&of(&input("in", "float", "0.5")));
    expect![[r#"
        import shaders.materialx.color as mxColor;

        /// `m` of `test.mtlx`, translated from MaterialX.
        class M : OpenPbr;

        public texture color emissionColor = color(vec3(0.0));
        public texture float baseWeight = 0.0;
        public texture float specularWeight = 0.0;
        public bool geometryThinWalled = true;
        public texture float emissionLuminance = 1.0 * 1.0 / max(mxColor.unlitOpacity(1.0, 0.0 * vec3(1.0)), 1e-6);
    "#]].assert_eq(&of(""));
}
