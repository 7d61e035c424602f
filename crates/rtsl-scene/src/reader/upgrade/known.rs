//! The parameters of pbrt-v4's entities, which takes any other for an error.

use crate::EntityKind;

/// The parameters of a class of a kind; `None` if pbrt-v4 has no such class.
pub fn parameters(kind: EntityKind, class: &str) -> Option<[&'static [&'static str]; 2]> {
    let (common, classes): (&[&str], &[(&str, &[&str])]) = match kind {
        EntityKind::Camera => (SHUTTER, CAMERAS),
        EntityKind::Film => (FILM, FILMS),
        EntityKind::Filter => (&["xradius", "yradius"], FILTERS),
        EntityKind::Sampler => (&["seed"], SAMPLERS),
        EntityKind::Integrator if matches!(class, "ambientocclusion" | "function") => {
            (&[], INTEGRATORS)
        }
        EntityKind::Integrator => (&["maxdepth"], INTEGRATORS),
        EntityKind::Texture => (&[], TEXTURES),
        EntityKind::Material if matches!(class, "hair" | "interface" | "mix") => (&[], MATERIALS),
        EntityKind::Material => (&["displacement", "normalmap"], MATERIALS),
        EntityKind::AreaLight => {
            (&["scale", "power"], &[("diffuse", &["L", "twosided", "filename"])])
        }
        EntityKind::Light => (&["scale"], LIGHTS),
        EntityKind::Shape => (&["alpha"], SHAPES),
    };
    let (_, own) = classes.iter().find(|(name, _)| *name == class)?;
    Some([common, own])
}

const SHUTTER: &[&str] = &["shutteropen", "shutterclose"];

const CAMERAS: &[(&str, &[&str])] = &[
    ("perspective", &["frameaspectratio", "screenwindow", "lensradius", "focaldistance", "fov"]),
    ("orthographic", &["frameaspectratio", "screenwindow", "lensradius", "focaldistance"]),
    ("spherical", &["frameaspectratio", "screenwindow", "lensradius", "focaldistance", "mapping"]),
    ("realistic", &["lensfile", "aperturediameter", "focusdistance", "aperture"]),
];

const FILM: &[&str] = &[
    "xresolution",
    "yresolution",
    "cropwindow",
    "pixelbounds",
    "diagonal",
    "filename",
    "savefp16",
    "iso",
    "whitebalance",
    "sensor",
    "maxcomponentvalue",
];

const FILMS: &[(&str, &[&str])] = &[
    ("rgb", &[]),
    ("gbuffer", &["coordinatesystem"]),
    ("spectral", &["nbuckets", "lambdamin", "lambdamax"]),
];

const FILTERS: &[(&str, &[&str])] = &[
    ("box", &[]),
    ("gaussian", &["sigma"]),
    ("mitchell", &["B", "C"]),
    ("sinc", &["tau"]),
    ("triangle", &[]),
];

const SAMPLERS: &[(&str, &[&str])] = &[
    ("halton", &["pixelsamples", "randomization"]),
    ("sobol", &["pixelsamples", "randomization"]),
    ("paddedsobol", &["pixelsamples", "randomization"]),
    ("zsobol", &["pixelsamples", "randomization"]),
    ("pmj02bn", &["pixelsamples"]),
    ("independent", &["pixelsamples"]),
    ("stratified", &["jitter", "xsamples", "ysamples"]),
];

const INTEGRATORS: &[(&str, &[&str])] = &[
    ("path", &["lightsampler", "regularize"]),
    ("volpath", &["lightsampler", "regularize"]),
    ("simplepath", &["samplelights", "samplebsdf"]),
    ("simplevolpath", &[]),
    ("randomwalk", &[]),
    ("lightpath", &[]),
    ("bdpt", &["regularize", "visualizestrategies", "visualizeweights"]),
    (
        "mlt",
        &[
            "regularize",
            "bootstrapsamples",
            "chains",
            "mutationsperpixel",
            "largestepprobability",
            "sigma",
        ],
    ),
    ("sppm", &["photonsperiteration", "radius", "seed"]),
    ("ambientocclusion", &["cossample", "maxdistance"]),
    ("function", &["function", "filename", "skipbad", "imagefilename"]),
];

/// The parameter of a `scale` with a colour.
const FACTOR: &str = "factor";

const TEXTURES: &[(&str, &[&str])] = &[
    ("directionmix", &["tex1", "tex2", "dir"]),
    ("constant", &["value"]),
    // The colour by which this program scales, which pbrt-v4 has not, is for scenes that are not written.
    ("scale", &["tex", "scale", FACTOR]),
    ("mix", &["tex1", "tex2", "amount"]),
    (
        "bilerp",
        &[
            "mapping", "uscale", "vscale", "udelta", "vdelta", "v1", "v2", "v00", "v01", "v10",
            "v11",
        ],
    ),
    (
        "checkerboard",
        &[
            "mapping",
            "uscale",
            "vscale",
            "udelta",
            "vdelta",
            "v1",
            "v2",
            "dimension",
            "tex1",
            "tex2",
        ],
    ),
    ("dots", &["mapping", "uscale", "vscale", "udelta", "vdelta", "v1", "v2", "inside", "outside"]),
    (
        "imagemap",
        &[
            "mapping",
            "uscale",
            "vscale",
            "udelta",
            "vdelta",
            "v1",
            "v2",
            "filename",
            "wrap",
            "maxanisotropy",
            "filter",
            "encoding",
            "scale",
            "invert",
        ],
    ),
    ("fbm", &["octaves", "roughness"]),
    ("wrinkled", &["octaves", "roughness"]),
    ("windy", &[]),
    ("marble", &["octaves", "roughness", "scale", "variation"]),
    ("ptex", &["filename", "encoding", "scale"]),
];

const LIGHTS: &[(&str, &[&str])] = &[
    ("point", &["I", "from", "power"]),
    ("spot", &["I", "from", "to", "coneangle", "conedeltaangle", "power"]),
    ("distant", &["L", "from", "to", "illuminance"]),
    ("infinite", &["L", "filename", "illuminance", "portal"]),
    ("goniometric", &["I", "filename", "power"]),
    ("projection", &["filename", "fov", "power"]),
];

const MATERIALS: &[(&str, &[&str])] = &[
    ("diffuse", &["reflectance"]),
    (
        "conductor",
        &["eta", "k", "reflectance", "roughness", "uroughness", "vroughness", "remaproughness"],
    ),
    ("dielectric", &["eta", "roughness", "uroughness", "vroughness", "remaproughness"]),
    ("thindielectric", &["eta"]),
    (
        "coateddiffuse",
        &[
            "reflectance",
            "eta",
            "roughness",
            "uroughness",
            "vroughness",
            "remaproughness",
            "thickness",
            "maxdepth",
            "nsamples",
            "g",
            "albedo",
        ],
    ),
    ("diffusetransmission", &["reflectance", "transmittance", "scale"]),
    ("mix", &["materials", "amount"]),
    ("interface", &[]),
    ("measured", &["filename"]),
    (
        "coatedconductor",
        &[
            "interface.eta",
            "interface.roughness",
            "interface.uroughness",
            "interface.vroughness",
            "conductor.eta",
            "conductor.k",
            "reflectance",
            "conductor.roughness",
            "conductor.uroughness",
            "conductor.vroughness",
            "remaproughness",
            "thickness",
            "maxdepth",
            "nsamples",
            "g",
            "albedo",
        ],
    ),
    (
        "hair",
        &[
            "sigma_a",
            "reflectance",
            "color",
            "eumelanin",
            "pheomelanin",
            "eta",
            "beta_m",
            "beta_n",
            "alpha",
        ],
    ),
    (
        "subsurface",
        &[
            "name",
            "sigma_a",
            "sigma_s",
            "reflectance",
            "mfp",
            "scale",
            "eta",
            "g",
            "roughness",
            "uroughness",
            "vroughness",
            "remaproughness",
        ],
    ),
];

const SHAPES: &[(&str, &[&str])] = &[
    ("sphere", &["radius", "zmin", "zmax", "phimax"]),
    ("disk", &["height", "radius", "innerradius", "phimax"]),
    ("cylinder", &["radius", "zmin", "zmax", "phimax"]),
    ("trianglemesh", &["P", "indices", "N", "S", "uv", "faceIndices"]),
    ("bilinearmesh", &["P", "indices", "N", "uv", "faceIndices", "emissionfilename"]),
    ("plymesh", &["filename", "displacement", "edgelength"]),
    ("loopsubdiv", &["P", "indices", "levels", "scheme"]),
    ("curve", &["P", "basis", "degree", "type", "N", "width", "width0", "width1", "splitdepth"]),
];

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use super::*;
    use crate::reader::format_page::{PageEntity, entities};

    #[test]
    fn parameters_are_those_of_the_formats_page() {
        let mut differences = Vec::new();
        for PageEntity { kind, class, parameters: expected } in entities() {
            let Some(known) = parameters(kind, &class) else {
                differences.push(format!("{kind:?} {class} is missing"));
                continue;
            };
            let known = known.into_iter().flatten().copied().filter(|name| *name != FACTOR);
            let known: BTreeSet<&str> = known.collect();
            let expected: BTreeSet<&str> = expected.iter().map(|(_, name)| name.as_str()).collect();
            if known != expected {
                let here: Vec<_> = known.difference(&expected).collect();
                let there: Vec<_> = expected.difference(&known).collect();
                differences
                    .push(format!("{kind:?} {class}: {here:?} here alone, {there:?} there alone"));
            }
        }
        assert!(differences.is_empty(), "{differences:#?}");
    }
}
