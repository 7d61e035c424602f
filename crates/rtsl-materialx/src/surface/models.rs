//! OpenPBR Surface, Autodesk Standard Surface, Disney's principled surface, and surfaces without light.

use super::{Surface, parameter};

/// OpenPBR Surface.
pub const OPEN_PBR: Surface = Surface {
    node: "open_pbr_surface",
    class: "OpenPbr",
    direct: "base_weight:float base_color:color3 base_diffuse_roughness:float base_metalness:float \
             specular_weight:float specular_color:color3 specular_roughness:float specular_ior:float \
             specular_roughness_anisotropy:float transmission_weight:float transmission_color:color3 \
             transmission_depth:float transmission_scatter:color3 transmission_scatter_anisotropy:float \
             transmission_dispersion_scale:float transmission_dispersion_abbe_number:float subsurface_weight:float \
             subsurface_color:color3 subsurface_radius:float subsurface_radius_scale:color3 \
             subsurface_scatter_anisotropy:float fuzz_weight:float fuzz_color:color3 fuzz_roughness:float \
             coat_weight:float coat_color:color3 coat_roughness:float coat_roughness_anisotropy:float coat_ior:float \
             coat_darkening:float thin_film_weight:float thin_film_thickness:float thin_film_ior:float \
             emission_luminance:float emission_color:color3 geometry_opacity:float geometry_thin_walled:boolean",
    computed: &[
        parameter(
            "geometryTangent",
            "vec3",
            "!geometry_tangent:vector3=@Tworld",
            "mxPlacement.partsOf({geometry_tangent}, rt_ShadingNormal, rt_dPdu, rt_dPdv)",
        ),
        parameter(
            "geometryCoatTangent",
            "vec3",
            "!geometry_coat_tangent:vector3=@Tworld",
            "mxPlacement.partsOf({geometry_coat_tangent}, rt_ShadingNormal, rt_dPdu, rt_dPdv)",
        ),
        parameter(
            "geometryCoatNormal",
            "vec3",
            "!geometry_coat_normal:vector3=@Nworld",
            "mxPlacement.partsOf({geometry_coat_normal}, rt_ShadingNormal, rt_dPdu, rt_dPdv)",
        ),
    ],
    normal: Some(("geometry_normal", "{}")),
    ignored: &[],
};

/// Autodesk Standard Surface.
pub const STANDARD_SURFACE: Surface = Surface {
    node: "standard_surface",
    class: "StandardSurface",
    direct: "base:float base_color:color3 diffuse_roughness:float metalness:float specular:float specular_color:color3 \
             specular_roughness:float specular_IOR:float specular_anisotropy:float specular_rotation:float \
             transmission:float transmission_color:color3 transmission_depth:float transmission_scatter:color3 \
             transmission_scatter_anisotropy:float transmission_dispersion:float transmission_extra_roughness:float \
             subsurface:float subsurface_color:color3 subsurface_radius:color3 subsurface_scale:float \
             subsurface_anisotropy:float sheen:float sheen_color:color3 sheen_roughness:float coat:float \
             coat_color:color3 coat_roughness:float coat_anisotropy:float coat_rotation:float coat_IOR:float \
             coat_affect_color:float coat_affect_roughness:float thin_film_thickness:float thin_film_IOR:float \
             emission_color:color3 opacity:color3 thin_walled:boolean",
    computed: &[
        parameter("emissionWeight", "float", "!emission:float=0", "{emission}"),
        parameter(
            "coatNormal",
            "vec3",
            "!coat_normal:vector3=@Nworld",
            "mxPlacement.partsOf({coat_normal}, rt_ShadingNormal, rt_dPdu, rt_dPdv)",
        ),
    ],
    normal: Some(("normal", "{}")),
    ignored: &["tangent"],
};

/// Disney's principled surface, whose lobes are those of Standard Surface.
pub const DISNEY_PRINCIPLED: Surface = Surface {
    node: "disney_principled",
    class: "StandardSurface",
    direct: "subsurface:float sheen:float",
    computed: &[
        parameter("base", "float", "!", "1.0"),
        parameter("baseColor", "color", "! baseColor:color3=0.16", "{baseColor}"),
        parameter("metalness", "float", "!metallic:float=0", "{metallic}"),
        parameter("specularRoughness", "float", "! roughness:float=0.5", "{roughness}"),
        parameter("specularAnisotropy", "float", "!anisotropic:float=0", "{anisotropic}"),
        parameter(
            "specularIor",
            "float",
            "!specular:float=0.5 !ior:float=1.5 specTrans:float=0",
            "mix(mxColor.iorOf(0.08 * {specular}), {ior}, {specTrans})",
        ),
        parameter(
            "specularColor",
            "color",
            "!specularTint:float=0 baseColor:color3=0.16",
            "mix(vec3(1.0), {baseColor}, {specularTint})",
        ),
        parameter(
            "sheenColor",
            "color",
            "!sheen:float=0 sheenTint:float=0.5 baseColor:color3=0.16",
            "mix(vec3(1.0), {baseColor}, {sheenTint})",
        ),
        parameter("coat", "float", "!clearcoat:float=0", "{clearcoat}"),
        parameter(
            "coatRoughness",
            "float",
            "!clearcoat:float=0 clearcoatGloss:float=1",
            "1.0 - {clearcoatGloss}",
        ),
        parameter("transmission", "float", "!specTrans:float=0", "{specTrans}"),
        parameter(
            "transmissionColor",
            "color",
            "!specTrans:float=0 baseColor:color3=0.16",
            "{baseColor}",
        ),
        parameter(
            "subsurfaceColor",
            "color",
            "!subsurface:float=0 baseColor:color3=0.16",
            "{baseColor}",
        ),
        parameter(
            "subsurfaceRadius",
            "color",
            "!subsurfaceDistance:color3=1",
            "{subsurfaceDistance}",
        ),
    ],
    normal: None,
    ignored: &[],
};

/// The part of light that a surface without light stops.
const UNLIT_INPUTS: &str =
    "! opacity:float=1 transmission:float=0 transmission_color:color3=1 emission:float=1";

/// A surface that emits and is not lit.
pub const UNLIT: Surface = Surface {
    node: "surface_unlit",
    class: "OpenPbr",
    direct: "emission_color:color3",
    computed: &[
        parameter("baseWeight", "float", "!", "0.0"),
        parameter("specularWeight", "float", "!", "0.0"),
        parameter("geometryThinWalled", "bool", "!", "true"),
        parameter(
            "emissionLuminance",
            "float",
            UNLIT_INPUTS,
            "{emission} * {opacity} / max(mxColor.unlitOpacity({opacity}, {transmission} * {transmission_color}), 1e-6)",
        ),
        parameter(
            "geometryOpacity",
            "float",
            "!opacity:float=1 !transmission:float=0 transmission_color:color3=1",
            "mxColor.unlitOpacity({opacity}, {transmission} * {transmission_color})",
        ),
    ],
    normal: None,
    ignored: &[],
};
