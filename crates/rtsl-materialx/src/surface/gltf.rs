//! The surface of glTF: all its layers are those of OpenPBR.

use super::{Surface, parameter};

/// glTF PBR.
pub const GLTF_PBR: Surface = Surface {
    node: "gltf_pbr",
    class: "OpenPbr",
    direct: "",
    computed: &[
        // The library's base is darker.
        parameter("baseColor", "color", "! base_color:color3=1", "{base_color}"),
        parameter("baseMetalness", "float", "! metallic:float=1", "{metallic}"),
        parameter(
            "specularRoughness",
            "float",
            "! roughness:float=1 anisotropy_strength:float=0",
            "mxColor.gltfRoughness({roughness}, {anisotropy_strength})",
        ),
        parameter(
            "specularRoughnessAnisotropy",
            "float",
            "!anisotropy_strength:float=0 roughness:float=1",
            "mxColor.gltfAnisotropy({roughness}, {anisotropy_strength})",
        ),
        parameter(
            "geometryTangent",
            "vec3",
            "!anisotropy_rotation:float=0",
            "vec3(cos({anisotropy_rotation}), sin({anisotropy_rotation}), 0.0)",
        ),
        parameter("specularIor", "float", "!ior:float=1.5", "{ior}"),
        // Metal is as bright as its colour.
        parameter(
            "specularWeight",
            "float",
            "!specular:float=1 metallic:float=1",
            "mix({specular}, 1.0, {metallic})",
        ),
        parameter(
            "specularColor",
            "color",
            "!specular_color:color3=1 metallic:float=1",
            "mix({specular_color}, vec3(1.0), {metallic})",
        ),
        parameter("transmissionWeight", "float", "!transmission:float=0", "{transmission}"),
        parameter(
            "transmissionColor",
            "color",
            "!transmission:float=0 base_color:color3=1 thickness:float=0 attenuation_distance:float=0 \
             attenuation_color:color3=1",
            "{thickness} > 0.0 && {attenuation_distance} > 0.0 ? {attenuation_color} : {base_color}",
        ),
        parameter(
            "transmissionDepth",
            "float",
            "!thickness:float=0 attenuation_distance:float=0",
            "{thickness} > 0.0 ? {attenuation_distance} : 0.0",
        ),
        parameter(
            "geometryThinWalled",
            "bool",
            "!transmission:float=0 thickness:float=0",
            "{thickness} <= 0.0",
        ),
        parameter("coatWeight", "float", "!clearcoat:float=0", "{clearcoat}"),
        parameter(
            "coatRoughness",
            "float",
            "!clearcoat:float=0 clearcoat_roughness:float=0",
            "{clearcoat_roughness}",
        ),
        parameter("coatIor", "float", "!clearcoat:float=0", "1.5"),
        parameter("coatDarkening", "float", "!clearcoat:float=0", "0.0"),
        parameter(
            "geometryCoatNormal",
            "vec3",
            "!clearcoat_normal:vector3=@Nworld",
            "mxPlacement.partsOf({clearcoat_normal}, rt_ShadingNormal, rt_dPdu, rt_dPdv)",
        ),
        parameter(
            "fuzzWeight",
            "float",
            "!sheen_color:color3=0",
            "mxColor.greatest({sheen_color})",
        ),
        parameter(
            "fuzzColor",
            "color",
            "!sheen_color:color3=0",
            "{sheen_color} / max(mxColor.greatest({sheen_color}), 1e-6)",
        ),
        parameter(
            "fuzzRoughness",
            "float",
            "!sheen_color:color3=0 sheen_roughness:float=0",
            "{sheen_roughness}",
        ),
        parameter(
            "emissionLuminance",
            "float",
            "!emissive:color3=0 emissive_strength:float=1",
            "{emissive_strength}",
        ),
        parameter("emissionColor", "color", "!emissive:color3=0", "{emissive}"),
        parameter(
            "geometryOpacity",
            "float",
            "!alpha_mode:integer=0 alpha:float=1 alpha_cutoff:float=0.5",
            "{alpha_mode} == 0 ? 1.0 : ({alpha_mode} == 2 ? {alpha} : ({alpha} >= {alpha_cutoff} ? 1.0 : 0.0))",
        ),
        parameter("thinFilmWeight", "float", "!iridescence:float=0", "{iridescence}"),
        parameter(
            "thinFilmIor",
            "float",
            "!iridescence:float=0 iridescence_ior:float=1.3",
            "{iridescence_ior}",
        ),
        parameter(
            "thinFilmThickness",
            "float",
            "!iridescence:float=0 iridescence_thickness:float=100",
            "0.001 * {iridescence_thickness}",
        ),
    ],
    normal: Some(("normal", "{}")),
    ignored: &["tangent", "dispersion"],
};
