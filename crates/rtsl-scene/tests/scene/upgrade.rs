//! Scenes of earlier versions of pbrt: what they become, and that reading them is reading what they become.

use std::path::{Path, PathBuf};

use expect_test::{Expect, expect};
use rtsl::{Diagnostics, SourceMap};
use rtsl_scene::Description;
use rtsl_scene::reader::{Conversion, ConversionOptions, MemoryFiles, convert_scene, read_scene};

const OLD: &str = "old.pbrt";

fn files(texts: &[(&str, &str)]) -> MemoryFiles {
    MemoryFiles(
        texts.iter().map(|(path, text)| (PathBuf::from(path), (*text).to_owned())).collect(),
    )
}

fn convert(output: &str, texts: &[(&str, &str)], inline: bool) -> Conversion {
    let options = ConversionOptions { inline, ..ConversionOptions::default() };
    match convert_scene(Path::new(OLD), Path::new(output), &files(texts), &options) {
        Ok(conversion) => conversion,
        Err(messages) => panic!("{}", messages.to_text(false)),
    }
}

/// The first lines of messages.
fn heads(messages: &str) -> String {
    let is_head = |line: &&str| line.starts_with("error") || line.starts_with("warning");
    messages.lines().filter(is_head).map(|line| format!("# {line}\n")).collect()
}

/// Checks the text that directives before the world, or in it, become, and that a scene with them is read as one with
/// that text.
fn check(text: &str, expected: Expect) {
    let conversion = convert("new.pbrt", &[(OLD, &format!("{text}\nWorldEnd\n"))], false);
    let new = &conversion.files[0].1;
    let all = format!("{}{new}", heads(&conversion.warnings.to_text(false)));
    expected.assert_eq(&all);
    assert!(conversion.was_old);
}

fn description(path: &str, texts: &[(&str, &str)]) -> (Description, String) {
    let (mut map, mut diagnostics) = (SourceMap::new(), Diagnostics::new());
    let description = read_scene(Path::new(path), &files(texts), &mut map, &mut diagnostics);
    (description, rtsl::render::all_to_text(&map, diagnostics.iter(), false))
}

/// All of a description but the places in files.
fn shown(description: &Description) -> String {
    let mut text = String::new();
    for entity in &description.entities {
        let parameters: Vec<String> = entity
            .parameters
            .iter()
            .map(|it| format!("{:?} {} {:?}", it.kind, it.name, it.values))
            .collect();
        text += &format!(
            "{:?} {:?} {:?} {:?} {}\n",
            entity.kind,
            entity.class,
            entity.name,
            entity.transform,
            parameters.join("; ")
        );
    }
    let Description { shapes, objects, instances, lights, .. } = description;
    let objects: Vec<_> = objects.iter().map(|it| (&it.name, &it.shapes)).collect();
    let instances: Vec<_> = instances.iter().map(|it| (it.object, it.transform)).collect();
    format!("{text}{shapes:?}\n{objects:?}\n{instances:?}\n{lights:?}\n")
}

#[test]
fn settings_are_those_of_the_current_format() {
    check(
        "LookAt 0 0 -5  0 0 0  0 1 0 # eye\n\
         Camera \"environment\" \"float hither\" 1e-3 \"float shutteropen\" [0.50]\n\
         Camera \"perspective\" \"float halffov\" 20 \"float shutteropen\" 0 \"float shutterclose\" 0\n\
         Film \"image\" \"string filename\" [\"a.tga\"] \"float scale\" 1.5 \"bool display\" [\"true\"]\n\
             \"float maxsampleluminance\" [20] \"integer xresolution\" [ 200 ]\n\
         PixelFilter \"gaussian\" \"float xwidth\" 2.50 \"float alpha\" 2\n\
         Sampler \"lowdiscrepancy\" \"integer pixelsamples\" 16\n\
         Sampler \"random\" \"integer pixelsamples\" 16.0\n\
         Sampler \"maxmindist\" \"integer dimensions\" 4\n\
         Accelerator \"grid\"\n\
         Accelerator \"bvh\" \"string splitmethod\" \"sah\"\n\
         VolumeIntegrator \"single\" \"float stepsize\" .1\n\
         SurfaceIntegrator \"directlighting\" \"integer maxdepth\" 5 \"string strategy\" \"all\"\n",
        expect![[r##"
            # warning[W0601]: integrator `directlighting` is not supported: `path` takes its place
            LookAt 0 0 -5 0 0 0 0 1 0
            Camera "spherical"
                "float shutteropen" [0.50]
                "string mapping" [ "equirectangular" ]
            Camera "perspective"
                "float fov" [ 40 ]
            Film "rgb"
                "string filename" [ "a.exr" ]
                "float maxcomponentvalue" [20]
                "integer xresolution" [ 200 ]
                "float iso" [ 150 ]
            PixelFilter "gaussian"
                "float xradius" 2.50
                "float sigma" [ 0.5 ]
            Sampler "paddedsobol"
                "integer pixelsamples" 16
            Sampler "independent"
                "integer pixelsamples" [ 16 ]
            Sampler "pmj02bn"
            Accelerator "bvh"
                "string splitmethod" "sah"
            Integrator "path"
                "integer maxdepth" 5
        "##]],
    );
    check(
        "Renderer \"metropolis\" \"integer samplesperpixel\" 128\nSurfaceIntegrator \"path\"\n",
        expect![[r##"
            # warning[W0601]: integrator `metropolis` is not supported: `mlt` takes its place
            Integrator "mlt"
        "##]],
    );
    check(
        "Integrator \"sppm\" \"integer numiterations\" 10 \"float radius\" .5\n\
             \"string lightsamplestrategy\" \"spatial\" \"float rrthreshold\" 1\n",
        expect![[r##"
            # warning[W0601]: `numiterations` has no effect: the sampler gives the number of samples
            Integrator "sppm"
                "float radius" .5
        "##]],
    );
    check(
        "Integrator \"directlighting\"",
        expect![[r##"
        # warning[W0601]: integrator `directlighting` is not supported: `path` takes its place
        Integrator "path"
            "integer maxdepth" [ 1 ]
    "##]],
    );
    check(
        "SurfaceIntegrator \"photonmap\" \"integer nused\" 50",
        expect![[r##"
            # warning[W0601]: integrator `photonmap` is not supported: `path` takes its place
            Integrator "path"
        "##]],
    );
}

#[test]
fn textures_are_those_of_the_current_format() {
    check(
        "Texture \"a\" \"color\" \"imagemap\" \"string filename\" \"a.png\" \"bool trilinear\" \"true\" \"float gamma\" 2.2\n\
         Texture \"b\" \"float\" \"imagemap\" \"string filename\" \"a.png\" \"bool gamma\" [\"false\"] \"bool trilinear\" \"false\"\n\
         Texture \"c\" \"float\" \"scale\" \"texture tex1\" \"b\" \"float tex2\" [-.25]\n\
         Texture \"d\" \"color\" \"scale\" \"texture tex1\" \"a\" \"rgb tex2\" [.5 .5 .5]\n\
         Texture \"e\" \"color\" \"scale\" \"color tex1\" [.5 .2 .1] \"color tex2\" [2 2 2]\n\
         Texture \"f\" \"color\" \"scale\" \"texture tex1\" \"a\" \"texture tex2\" \"d\"\n\
         Texture \"g\" \"color\" \"scale\" \"texture tex1\" \"a\" \"rgb tex2\" [1 0 0]\n\
         Texture \"h\" \"color\" \"uv\" \"float uscale\" 2 \"float vscale\" -1\n\
         Texture \"i\" \"color\" \"checkerboard\" \"string aamode\" \"none\" \"rgb tex1\" [1 0 0]\n\
         Texture \"j\" \"color\" \"fbm\" \"integer octaves\" 3\n",
        expect![[r##"
            # warning[W0601]: a texture times a texture is scaled by the mean of the second one
            # warning[W0601]: a colour times a texture is mixed from black and the colour by the texture's mean
            Texture "a" "spectrum" "imagemap"
                "string filename" "a.png"
                "string filter" [ "trilinear" ]
                "string encoding" [ "gamma 2.2" ]
            Texture "b" "float" "imagemap"
                "string filename" "a.png"
                "string filter" [ "bilinear" ]
                "string encoding" [ "linear" ]
            Texture "c" "float" "scale"
                "texture tex" "b"
                "float scale" [-.25]
            Texture "d" "spectrum" "scale"
                "texture tex" "a"
                "float scale" [ 0.5 ]
            Texture "e" "spectrum" "constant"
                "rgb value" [ 1 0.4 0.2 ]
            Texture "a-float" "float" "imagemap"
                "string filename" "a.png"
                "string filter" [ "trilinear" ]
                "string encoding" [ "gamma 2.2" ]
            Texture "d-float" "float" "scale"
                "texture tex" [ "a-float" ]
                "float scale" [ 0.5 ]
            Texture "f" "spectrum" "scale"
                "texture tex" "a"
                "texture scale" [ "d-float" ]
            Texture "g" "spectrum" "mix"
                "rgb tex1" [ 0 0 0 ]
                "rgb tex2" [ 1 0 0 ]
                "texture amount" [ "a-float" ]
            Texture "h" "spectrum" "bilerp"
                "float uscale" 2
                "float vscale" -1
                "float vdelta" [ 1 ]
                "rgb v00" [ 0 0 0 ]
                "rgb v01" [ 0 1 0 ]
                "rgb v10" [ 1 0 0 ]
                "rgb v11" [ 1 1 0 ]
            Texture "i" "spectrum" "checkerboard"
                "rgb tex1" [1 0 0]
            Texture "j-float" "float" "fbm"
                "integer octaves" 3
            Texture "j" "spectrum" "mix"
                "rgb tex1" [ 0 0 0 ]
                "rgb tex2" [ 1 1 1 ]
                "texture amount" [ "j-float" ]
        "##]],
    );
}

#[test]
fn materials_are_those_of_the_current_format() {
    check(
        "WorldBegin\n\
         Texture \"bumps\" \"float\" \"fbm\"\n\
         Material \"matte\" \"color Kd\" [0.50 .25 .1] \"float sigma\" 20 \"texture bumpmap\" \"bumps\"\n\
         Material \"plastic\" \"color Kd\" [2 .25 .1] \"color Ks\" [.3 .3 .3] \"float roughness\" .1\n\
         Material \"plastic\" \"color Ks\" [0 0 0] \"float roughness\" .1\n\
         Material \"substrate\" \"color Ks\" [.5 .5 .5] \"float uroughness\" [.05]\n\
         Material \"glass\" \"color Kr\" [1 1 1] \"color Kt\" [.9 .9 .9] \"float index\" 1.33\n\
         Material \"metal\" \"spectrum eta\" \"metal-Cu-eta\" \"float roughness\" .01\n\
         Material \"shinymetal\" \"color Kr\" [.8 .8 .8] \"color Ks\" [.8 .8 .8]\n\
         Material \"mirror\" \"color Kr\" [.9 .9 .9]\n\
         Material \"uber\" \"color Kr\" [0 0 0] \"float index\" 1.2 \"color opacity\" [1 1 1]\n\
         Material \"translucent\" \"color Kd\" [.2 .2 .2] \"color reflect\" [.5 .5 .5]\n\
         Material \"kdsubsurface\" \"color Kd\" [.2 .2 .2] \"color mfp\" [1 1 1]\n\
         Material \"subsurface\" \"color sigma_prime_s\" [3 3 3] \"float index\" 1.3\n\
         Material \"disney\" \"color color\" [.2 .3 .4] \"float metallic\" 1\n\
         Material \"fourier\" \"string bsdffile\" \"a.bsdf\"\n\
         Material \"hair\" \"color color\" [.2 .1 .1] \"float beta_m\" .2\n\
         Material \"none\"\n\
         Material \"\"\n\
         MakeNamedMaterial \"a\" \"string type\" [\"matte\"] \"color Kd\" [1 0 0]\n\
         MakeNamedMaterial \"b\" \"string type\" \"mirror\"\n\
         MakeNamedMaterial \"c\" \"string type\" \"mix\" \"string namedmaterial1\" \"a\"\n\
             \"string namedmaterial2\" \"b\" \"color amount\" [.25 .25 .25]\n\
         NamedMaterial \"c\"\n",
        expect![[r##"
            # warning[W0601]: `sigma` of material `matte` has no effect: it is left out
            # warning[W0601]: `Ks` has no effect: the index of refraction determines the highlight
            # warning[W0601]: `reflectance` is greater than 1: it is limited to that
            # warning[W0601]: `Ks` of material `substrate` has no effect: it is left out
            # warning[W0601]: `Kt` of material `glass` has no effect: it is left out
            # warning[W0601]: `Ks` of material `shinymetal` has no effect: it is left out
            # warning[W0601]: `reflect` of material `translucent` has no effect: it is left out
            # warning[W0601]: material `disney` is not supported: `diffuse` takes its place
            # warning[W0601]: material `fourier` is not supported: `diffuse` takes its place

            WorldBegin

            Texture "bumps" "float" "fbm"
            Material "diffuse"
                "rgb reflectance" [0.50 .25 .1]
                "texture displacement" "bumps"
            Material "coateddiffuse"
                "rgb reflectance" [ 1 0.25 0.1 ]
                "float roughness" .1
            Material "diffuse"
            Material "coateddiffuse"
                "float uroughness" [.05]
            Material "dielectric"
                "float eta" 1.33
            Material "conductor"
                "spectrum eta" "metal-Cu-eta"
                "float roughness" .01
            Material "conductor"
                "rgb reflectance" [.8 .8 .8]
            Material "conductor"
                "float roughness" [ 0 ]
                "spectrum eta" [ "metal-Ag-eta" ]
                "spectrum k" [ "metal-Ag-k" ]
            Material "coateddiffuse"
                "float eta" 1.2
            Material "diffusetransmission"
                "rgb transmittance" [.2 .2 .2]
            Material "subsurface"
                "rgb reflectance" [.2 .2 .2]
                "rgb mfp" [1 1 1]
            Material "subsurface"
                "rgb sigma_s" [3 3 3]
                "float eta" 1.3
            Material "diffuse"
                "rgb reflectance" [.2 .3 .4]
            Material "diffuse"
            Material "hair"
                "rgb reflectance" [.2 .1 .1]
                "float beta_m" .2
            Material "interface"
            Material "interface"
            MakeNamedMaterial "a"
                "string type" [ "diffuse" ]
                "rgb reflectance" [1 0 0]
            MakeNamedMaterial "b"
                "string type" [ "conductor" ]
                "float roughness" [ 0 ]
                "spectrum eta" [ "metal-Ag-eta" ]
                "spectrum k" [ "metal-Ag-k" ]
            MakeNamedMaterial "c"
                "string type" "mix"
                "float amount" [ 0.25 ]
                "string materials" [ "b" "a" ]
            NamedMaterial "c"
        "##]],
    );
}

#[test]
fn opacity_is_the_alpha_of_shapes() {
    check(
        "WorldBegin\n\
         Texture \"leaf\" \"color\" \"imagemap\" \"string filename\" \"leaf.png\"\n\
         Texture \"dim\" \"color\" \"scale\" \"texture tex1\" \"leaf\" \"color tex2\" [.5 .5 .5]\n\
         MakeNamedMaterial \"a\" \"string type\" \"uber\" \"color opacity\" [.2 .3 .4]\n\
         AttributeBegin\n\
         Material \"uber\" \"texture opacity\" \"dim\"\n\
         Shape \"sphere\"\n\
         Shape \"sphere\" \"float alpha\" .5\n\
         AttributeEnd\n\
         Shape \"disk\"\n\
         NamedMaterial \"a\"\n\
         Shape \"cylinder\"\n",
        expect![[r#"

            WorldBegin

            Texture "leaf" "spectrum" "imagemap"
                "string filename" "leaf.png"
            Texture "dim" "spectrum" "scale"
                "texture tex" "leaf"
                "float scale" [ 0.5 ]
            MakeNamedMaterial "a"
                "string type" [ "coateddiffuse" ]
            AttributeBegin
                Texture "leaf-float" "float" "imagemap"
                    "string filename" "leaf.png"
                Texture "dim-float" "float" "scale"
                    "texture tex" [ "leaf-float" ]
                    "float scale" [ 0.5 ]
                Material "coateddiffuse"
                Shape "sphere"
                    "texture alpha" [ "dim-float" ]
                Shape "sphere"
                    "float alpha" .5
            AttributeEnd
            Shape "disk"
            NamedMaterial "a"
            Shape "cylinder"
                "float alpha" [ 0.3 ]
        "#]],
    );
}

#[test]
fn lights_are_those_of_the_current_format() {
    check(
        "WorldBegin\n\
         LightSource \"infinite\" \"string mapname\" [\"sky.exr\"] \"color L\" [2 2 2] \"color scale\" [3 3 3] \"integer nsamples\" 4\n\
         LightSource \"infinite\" \"string mapname\" [\"sky.exr\"] \"color L\" [1 0 0]\n\
         LightSource \"point\" \"color I\" [1 2 3] \"color scale\" [2 1 1] \"point from\" [0 1 0]\n\
         LightSource \"spot\" \"blackbody I\" [3000 1.5] \"rgb scale\" [2 2 2]\n\
         LightSource \"goniometric\" \"string mapname\" \"a.exr\"\n\
         LightSource \"projection\" \"string mapname\" \"a.exr\" \"color I\" [5 5 5] \"float fov\" 30\n\
         LightSource \"distant\" \"xyz L\" [0.950456 1 1.089058] \"point to\" [0 0 1]\n\
         AreaLightSource \"area\" \"color L\" [5 5 5] \"integer nsamples\" 8\n",
        expect![[r##"
            # warning[W0601]: pbrt-v4 needs a sky of equal areas: `imgtool makeequiarea` makes one
            # warning[W0601]: the colour of `L` has no effect on a light with a map

            WorldBegin

            LightSource "infinite"
                "string filename" ["sky.exr"]
                "float scale" [ 6 ]
            LightSource "infinite"
                "string filename" ["sky.exr"]
                "float scale" [ 0.2126 ]
            LightSource "point"
                "rgb I" [ 2 2 3 ]
                "point3 from" [0 1 0]
            LightSource "spot"
                "blackbody I" [ 3000 ]
                "float scale" [ 3 ]
            LightSource "goniometric"
                "string filename" "a.exr"
            LightSource "projection"
                "float fov" 30
                "string filename" "a.exr"
                "float scale" [ 5 ]
            LightSource "distant"
                "rgb L" [ 0.9998491783939998 1.000012713512 1.000320978526 ]
                "point3 to" [0 0 1]
            AreaLightSource "diffuse"
                "rgb L" [5 5 5]
        "##]],
    );
}

#[test]
fn shapes_are_those_of_the_current_format() {
    check(
        "WorldBegin\n\
         Shape \"trianglemesh\" \"point P\" [0 0 0 1 0 0 0 1 0] \"integer indices\" [0 1 2] \"float st\" [0 0 1 0 0 1]\n\
         Shape \"trianglemesh\" \"point P\" [0 0 0 1.0 0 0 0 1 0] \"float uv\" [0 0 1 0 0 1] \"bool discarddegenerateUVs\" \"true\"\n\
         Shape \"loopsubdiv\" \"integer nlevels\" 2 \"point P\" [0 0 0 1 0 0 0 1 0] \"integer indices\" [0 1 2]\n\
         Shape \"plymesh\" \"string filename\" \"a.ply\" \"texture shadowalpha\" \"x\"\n\
         Shape \"heightfield\" \"integer nu\" 2 \"integer nv\" 2 \"float Pz\" [0 .1 .2 .3]\n\
         Material \"plastic\" \"color Kd\" [0 1 0]\n\
         Shape \"sphere\" \"color Kd\" [1 0 0] \"float radius\" 2\n\
         Shape \"sphere\" \"float wobble\" 2 \"float radius\" 3 \"float radius\" 4\n",
        expect![[r##"
            # warning[W0601]: parameter `radius` is given twice: the last one counts
            # warning[W0601]: `wobble` has no effect: pbrt-v4's shape `sphere` has no such parameter

            WorldBegin

            Shape "trianglemesh"
                "point3 P" [0 0 0 1 0 0 0 1 0]
                "integer indices" [0 1 2]
                "point2 uv" [ 0 0 1 0 0 1 ]
            Shape "trianglemesh"
                "point3 P" [0 0 0 1.0 0 0 0 1 0]
                "point2 uv" [ 0 0 1 0 0 1 ]
            Shape "loopsubdiv"
                "integer levels" 2
                "point3 P" [0 0 0 1 0 0 0 1 0]
                "integer indices" [0 1 2]
            Shape "plymesh"
                "string filename" "a.ply"
            Shape "trianglemesh"
                "point3 P" [ 0 0 0 1 0 0.1 0 1 0.2 1 1 0.3 ]
                "point2 uv" [ 0 0 1 0 0 1 1 1 ]
                "integer indices" [ 0 1 3 0 3 2 ]
            Material "coateddiffuse"
                "rgb reflectance" [0 1 0]
            AttributeBegin
                Material "coateddiffuse"
                    "rgb reflectance" [1 0 0]
                Shape "sphere"
                    "float radius" 2
            AttributeEnd
            Shape "sphere"
                "float radius" 4
        "##]],
    );
}

#[test]
fn blocks_of_transforms_restore_nothing_else() {
    check(
        "WorldBegin\n\
         TransformBegin\n\
         Rotate 30 0 1 0\n\
         Material \"mirror\"\n\
         Material \"matte\"\n\
         ReverseOrientation\n\
         AttributeBegin Material \"glass\" AttributeEnd\n\
         TransformEnd\n\
         Shape \"sphere\"\n",
        expect![[r#"

            WorldBegin

            AttributeBegin
                Rotate 30 0 1 0
                Material "conductor"
                    "float roughness" [ 0 ]
                    "spectrum eta" [ "metal-Ag-eta" ]
                    "spectrum k" [ "metal-Ag-k" ]
                Material "diffuse"
                ReverseOrientation
                AttributeBegin
                    Material "dielectric"
                AttributeEnd
            AttributeEnd
            Material "diffuse"
            ReverseOrientation
            Shape "sphere"
        "#]],
    );
}

#[test]
fn things_of_the_same_name_get_names_of_their_own() {
    check(
        "WorldBegin\n\
         Texture \"t\" \"color\" \"constant\" \"color value\" [1 0 0]\n\
         Texture \"t\" \"float\" \"constant\" \"float value\" 3\n\
         Texture \"t\" \"color\" \"constant\" \"color value\" [0 1 0]\n\
         MakeNamedMaterial \"m\" \"string type\" \"matte\" \"texture Kd\" \"t\" \"texture bumpmap\" \"t\"\n\
         MakeNamedMaterial \"m\" \"string type\" \"mirror\"\n\
         NamedMaterial \"m\"\n\
         ObjectBegin \"o\"\n\
         ObjectEnd\n\
         ObjectBegin \"o\"\n\
         ObjectEnd\n\
         ObjectInstance \"o\"\n",
        expect![[r#"

            WorldBegin

            Texture "t" "spectrum" "constant"
                "rgb value" [1 0 0]
            Texture "t" "float" "constant"
                "float value" 3
            Texture "t-renamed-0" "spectrum" "constant"
                "rgb value" [0 1 0]
            MakeNamedMaterial "m"
                "string type" [ "diffuse" ]
                "texture reflectance" [ "t-renamed-0" ]
                "texture displacement" "t"
            MakeNamedMaterial "m-renamed-0"
                "string type" [ "conductor" ]
                "float roughness" [ 0 ]
                "spectrum eta" [ "metal-Ag-eta" ]
                "spectrum k" [ "metal-Ag-k" ]
            NamedMaterial "m-renamed-0"
            ObjectBegin "o"
            ObjectEnd
            ObjectBegin "o-renamed-0"
            ObjectEnd
            ObjectInstance "o-renamed-0"
        "#]],
    );
}

#[test]
fn only_the_first_world_is_rendered() {
    check(
        "WorldBegin\nShape \"sphere\"\nWorldEnd\nFilm \"image\"\nWorldBegin\nShape \"disk\"\n",
        expect![[r##"
        # warning[W0601]: only the first world of a file is rendered

        WorldBegin

        Shape "sphere"
    "##]],
    );
}

/// A scene with something of each kind.
const SCENE: &str = "\
    Scale -1.0 1 1\n\
    LookAt 0 1 -5  0 0 0  0 1 0\n\
    Camera \"perspective\" \"float fov\" [ 40.0 ]\n\
    Film \"image\" \"integer xresolution\" 32 \"integer yresolution\" 24 \"float scale\" .3\n\
    PixelFilter \"gaussian\" \"float alpha\" 3\n\
    Sampler \"stratified\" \"bool jitter\" true \"integer xsamples\" 2 \"integer ysamples\" 2\n\
    SurfaceIntegrator \"whitted\"\n\
    WorldBegin\n\
    LightSource \"distant\" \"color L\" [.7 .7 .7] \"color scale\" [1.3 1.3 1.3]\n\
    Texture \"uv\" \"color\" \"uv\"\n\
    Texture \"half\" \"color\" \"scale\" \"texture tex1\" \"uv\" \"color tex2\" [.5 .5 .5]\n\
    MakeNamedMaterial \"thin\" \"string type\" \"uber\" \"texture Kd\" \"half\" \"texture opacity\" \"uv\"\n\
    TransformBegin\n\
    Translate .1 .2 .3\n\
    NamedMaterial \"thin\"\n\
    TransformEnd\n\
    Include \"parts/ball.pbrt\"\n\
    ObjectBegin \"o\"\n\
    Include \"parts/ball.pbrt\"\n\
    ObjectEnd\n\
    Rotate 30 1 0 0\n\
    ObjectInstance \"o\"\n\
    AttributeBegin\n\
    AreaLightSource \"area\" \"blackbody L\" [6500 1.1] \"integer nsamples\" 4\n\
    Shape \"cone\" \"float height\" 1.7\n\
    Shape \"nurbs\" \"integer nu\" 3 \"integer nv\" 2 \"integer uorder\" 3 \"integer vorder\" 2\n\
        \"float uknots\" [0 0 0 1 1 1] \"float vknots\" [0 0 1 1]\n\
        \"point P\" [0 0 0  1 0 1  2 0 0  0 1 0  1 1 1  2 1 0]\n\
    AttributeEnd\n\
    WorldEnd\n";

const BALL: &str =
    "# a ball\nShape \"sphere\" \"float radius\" [ 0.123456789 ]\n    \"color Kd\" [1 0 0]\n";

#[test]
fn a_scene_is_read_as_what_it_is_converted_to() {
    let texts = [(OLD, SCENE), ("parts/ball.pbrt", BALL)];
    let (old, messages) = description(OLD, &texts);
    assert!(!messages.contains("error"), "{messages}");
    assert_eq!(messages.matches("[W0604]").count(), 1, "{messages}");
    for inline in [false, true] {
        let conversion = convert("new.pbrt", &texts, inline);
        let written: Vec<(&str, &str)> = conversion
            .files
            .iter()
            .map(|(path, text)| (path.to_str().unwrap(), text.as_str()))
            .collect();
        let names: Vec<&str> = written.iter().map(|(path, _)| *path).collect();
        match inline {
            true => assert_eq!(names, ["new.pbrt"]),
            false => assert_eq!(names, ["parts/ball-v4.pbrt", "new.pbrt"]),
        }
        let (new, messages) = description("new.pbrt", &written);
        assert_eq!(messages, "");
        let (old, new) = (shown(&old), shown(&new));
        assert_eq!(old.lines().count(), new.lines().count());
        for (old, new) in old.lines().zip(new.lines()) {
            let shortened = |line: &str| line.chars().take(400).collect::<String>();
            assert!(old == new, "{}\n{}", shortened(old), shortened(new));
        }
    }
}

#[test]
fn numbers_keep_their_spelling() {
    let conversion = convert("new.pbrt", &[(OLD, SCENE), ("parts/ball.pbrt", BALL)], true);
    let text = &conversion.files[0].1;
    for spelled in
        ["Scale -1.0 1 1\n", "\"float fov\" [ 40.0 ]", "\"float radius\" [ 0.123456789 ]"]
    {
        assert!(text.contains(spelled), "{text}");
    }
}

#[test]
fn files_are_found_from_the_folder_of_the_result() {
    let main = "Include \"a/part.pbrt\"\nInclude \"b/part.pbrt\"\nInclude \"a/part.pbrt\"\nMaterial \"matte\"\n";
    let part = "Shape \"plymesh\" \"string filename\" \"meshes/x.ply\"\n";
    let texts = [(OLD, main), ("a/part.pbrt", part), ("b/part.pbrt", part)];
    let conversion = convert("results/new.pbrt", &texts, false);
    let written: Vec<(String, &str)> = conversion
        .files
        .iter()
        .map(|(path, text)| (path.display().to_string(), text.as_str()))
        .collect();
    let part = "Shape \"plymesh\"\n    \"string filename\" [ \"../meshes/x.ply\" ]\n";
    let main = "Include \"a/part-v4.pbrt\"\nInclude \"b/part-v4.pbrt\"\nInclude \"a/part-v4.pbrt\"\nMaterial \"diffuse\"\n";
    let expected = [
        ("results/a/part-v4.pbrt".to_owned(), part),
        ("results/b/part-v4.pbrt".to_owned(), part),
        ("results/new.pbrt".to_owned(), main),
    ];
    assert_eq!(written, expected);
    assert_eq!(conversion.sources.len(), 3);
}

#[test]
fn an_included_file_may_lack_parameters_that_follow() {
    let texts = [
        (OLD, "Include \"part.pbrt\" \"float radius\" 2\nWorldEnd\n"),
        ("part.pbrt", "Shape \"sphere\"\n"),
    ];
    let conversion = convert("new.pbrt", &texts, false);
    let text = "Shape \"sphere\"\n    \"float radius\" 2\n";
    assert_eq!(conversion.files, [(PathBuf::from("new.pbrt"), text.to_owned())]);
}

#[test]
fn errors_stop_a_conversion() {
    for (text, code) in [
        ("Shape \"sphere\" \"float radius\" x\nWorldEnd", "E0602"),
        ("Include \"missing.pbrt\"\nWorldEnd", "E0601"),
        ("Include \"old.pbrt\"\nWorldEnd", "E0605"),
    ] {
        let files = files(&[(OLD, text)]);
        let converted = convert_scene(
            Path::new(OLD),
            Path::new("new.pbrt"),
            &files,
            &ConversionOptions::default(),
        );
        let messages = converted.expect_err("an error").to_text(false);
        assert_eq!(messages.matches("error[").count(), 1, "{messages}");
        assert!(messages.contains(code), "{messages}");
    }
}

#[test]
fn files_outside_have_a_remedy_that_converting_takes() {
    let texts = [("s/old.pbrt", "Include \"../secret\"\nWorldEnd\n"), ("secret", "Shape [\n")];
    let options = ConversionOptions::default();
    let converted =
        convert_scene(Path::new("s/old.pbrt"), Path::new("s/new.pbrt"), &files(&texts), &options);
    expect![[r#"
        error[E0601]: cannot read `secret`
          ┌─ s/old.pbrt:1:9
          │
        1 │ Include "../secret"
          │         ^^^^^^^^^^^ named here
          │
          = help: it lies outside the folder of the scene, so no more is told of it; a copy of it beside the scene shows what is wrong

    "#]]
    .assert_eq(&converted.expect_err("an error").to_text(false));
}

#[test]
fn files_that_include_one_another_are_bounded() {
    let twice = |name: &str| format!("Include \"{name}\"\nInclude \"{name}\"\n");
    let mut texts: Vec<(String, String)> = (0..40)
        .map(|depth| (format!("{depth}.pbrt"), twice(&format!("{}.pbrt", depth + 1))))
        .collect();
    texts.push(("40.pbrt".to_owned(), "Translate 1 2 3\n".to_owned()));
    texts.push((OLD.to_owned(), "Include \"0.pbrt\"\nWorldEnd\n".to_owned()));
    let texts: Vec<(&str, &str)> =
        texts.iter().map(|(path, text)| (path.as_str(), text.as_str())).collect();
    for inline in [false, true] {
        let options =
            ConversionOptions { inline, input_memory: Some(rtsl_memory::Amount(1 << 20)) };
        let converted =
            convert_scene(Path::new(OLD), Path::new("new.pbrt"), &files(&texts), &options);
        let messages = converted.expect_err("a limit").to_text(false);
        assert!(messages.contains("error[E0615]"), "{messages}");
    }
}

#[test]
fn names_alone_tell_the_version_unless_shaders_could_have_them() {
    let scene = "Camera \"perspective\"\nWorldBegin\nMaterial \"matte\" \"color Kd\" [1 0 0]\nShape \"sphere\"\n";
    let (read, messages) = description("a/s.pbrt", &[("a/s.pbrt", scene)]);
    assert!(messages.contains("[W0604]"), "{messages}");
    assert_eq!(read.entities[1].class, "diffuse");
    let (read, messages) = description(
        "a/s.pbrt",
        &[("a/s.pbrt", scene), ("a/own.rtsl", "class matte : rt_Material;")],
    );
    assert_eq!((messages.as_str(), read.entities[1].class.as_str()), ("", "matte"));
}

#[test]
fn the_first_message_tells_how_to_convert() {
    let (_, messages) =
        description(OLD, &[(OLD, "Camera \"perspective\"\nWorldBegin\nWorldEnd\n")]);
    expect![[r#"
        warning[W0604]: `old.pbrt` is in the format of an earlier version of pbrt: it is read as `pbrt --upgrade` would convert it
         = help: `rtsl scene convert old.pbrt -o NEW.pbrt` writes it in the format of pbrt-v4

    "#]].assert_eq(&messages);
}

#[test]
fn scenes_of_the_current_format_stay_as_they_are() {
    let scene = "# a comment\nCamera \"perspective\"   \"float fov\" 40.0\nWorldBegin\n\
        Transform [ 1 0 0 0  0 1 0 0  0 0 1 0  0 0 0 1 ]\nActiveTransform All\n\
        Option \"seed\" 3\nTransformBegin\nTransformEnd\nShape \"sphere\" \"rgb x\" [1 2 3]\n";
    let conversion = convert("new.pbrt", &[(OLD, scene)], false);
    assert!(!conversion.was_old && conversion.warnings.is_empty());
    expect![[r#"
        Camera "perspective"
            "float fov" 40.0

        WorldBegin

        Transform [ 1 0 0 0 0 1 0 0 0 0 1 0 0 0 0 1 ]
        ActiveTransform All
        Option "seed" 3
        TransformBegin
        TransformEnd
        Shape "sphere"
            "rgb x" [1 2 3]
    "#]]
    .assert_eq(&conversion.files[0].1);
}
