//! The preview surface of USD, whose layers are those of OpenPBR.

use super::{Surface, parameter};

/// `UsdPreviewSurface`. Its normal is in tangent space.
pub const PREVIEW_SURFACE: Surface = Surface {
    node: "UsdPreviewSurface",
    class: "OpenPbr",
    direct: "",
    computed: &[
        parameter("baseColor", "color", "! diffuseColor:color3=0.18", "{diffuseColor}"),
        parameter(
            "baseMetalness",
            "float",
            "!metallic:float=0 useSpecularWorkflow:integer=0",
            "{useSpecularWorkflow} == 1 ? 0.0 : {metallic}",
        ),
        parameter("specularRoughness", "float", "! roughness:float=0.5", "{roughness}"),
        parameter("specularIor", "float", "!ior:float=1.5", "{ior}"),
        parameter(
            "specularWeight",
            "float",
            "!useSpecularWorkflow:integer=0 specularColor:color3=0 ior:float=1.5",
            "{useSpecularWorkflow} == 1 ? mxColor.greatest({specularColor}) / mxColor.reflectance({ior}) : 1.0",
        ),
        parameter(
            "specularColor",
            "color",
            "!useSpecularWorkflow:integer=0 specularColor:color3=0",
            "{useSpecularWorkflow} == 1 ? {specularColor} / max(mxColor.greatest({specularColor}), 1e-6) : vec3(1.0)",
        ),
        parameter("coatWeight", "float", "!clearcoat:float=0", "{clearcoat}"),
        parameter(
            "coatRoughness",
            "float",
            "!clearcoat:float=0 clearcoatRoughness:float=0.01",
            "{clearcoatRoughness}",
        ),
        parameter("coatIor", "float", "!clearcoat:float=0", "1.5"),
        parameter("coatDarkening", "float", "!clearcoat:float=0", "0.0"),
        parameter("emissionLuminance", "float", "!emissiveColor:color3=0", "1.0"),
        parameter("emissionColor", "color", "!emissiveColor:color3=0", "{emissiveColor}"),
        parameter(
            "geometryOpacity",
            "float",
            "!opacity:float=1 opacityThreshold:float=0",
            "{opacityThreshold} <= 0.0 ? {opacity} : ({opacity} >= {opacityThreshold} ? 1.0 : 0.0)",
        ),
    ],
    normal: Some((
        "normal",
        "mxPlacement.mappedNormal(0.5 * {} + 0.5, vec2(1.0), rt_ShadingNormal, \
         mxPlacement.tangentOf(rt_ShadingNormal, rt_dPdu), \
         mxPlacement.bitangentOf(rt_ShadingNormal, rt_dPdu, rt_dPdv))",
    )),
    ignored: &["displacement"],
};
