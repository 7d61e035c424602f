//! The library's `OpenPbr` against a second implementation: Adobe's headers, which `RTSL_OPENPBR_HEADERS` names the
//! folder of. Without it the test passes and says so.

use std::path::{Path, PathBuf};

use rtsl::Value;

use crate::sampling::call::Shader;
use crate::sampling::materials::{Meeting, albedos};

/// Parameters other than the defaults, and by how much the albedos may differ. The reasons of differences above
/// [`SAME`] stand beside them.
type Case = (&'static [(&'static str, f32)], f32);

/// The difference that tables of both implementations, and the numbers of samples, explain.
const SAME: f32 = 0.02;

const CASES: [Case; 17] = [
    (&[], SAME),
    (&[("specularRoughness", 0.0)], SAME),
    (&[("specularRoughness", 0.8)], SAME),
    (&[("specularIor", 2.5)], SAME),
    (&[("specularWeight", 0.0)], SAME),
    (&[("specularWeight", 0.5)], SAME),
    (&[("baseDiffuseRoughness", 1.0)], SAME),
    (&[("baseMetalness", 1.0)], SAME),
    // Light between facets: by Kulla and Conty here, by Turquin there.
    (&[("baseMetalness", 1.0), ("specularRoughness", 0.9)], 0.08),
    (&[("baseMetalness", 1.0), ("specularRoughness", 0.6)], SAME),
    (&[("baseMetalness", 0.5)], SAME),
    (&[("transmissionWeight", 1.0), ("specularRoughness", 0.1)], SAME),
    (&[("coatWeight", 1.0)], SAME),
    (&[("coatWeight", 1.0), ("coatRoughness", 0.5)], SAME),
    // The headers leave out what fuzz reflects towards the light, and so are not the same both ways.
    (&[("fuzzWeight", 1.0)], 0.07),
    // The matte base below loses of all colours what the film reflects of the one that it reflects most.
    (&[("thinFilmWeight", 1.0)], 0.06),
    (&[("thinFilmWeight", 1.0), ("baseWeight", 0.0)], SAME),
];

#[test]
fn albedos_are_those_of_a_second_implementation() {
    let Some(headers) = std::env::var_os("RTSL_OPENPBR_HEADERS").map(PathBuf::from) else {
        println!("left out: RTSL_OPENPBR_HEADERS names no folder");
        return;
    };
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../integrations/openpbr");
    let file = folder.join("adobe_open_pbr.rtsl");
    let mut different = Vec::new();
    for (parameters, allowed) in CASES {
        let arguments = || parameters.iter().map(|(name, value)| (*name, Value::from(*value)));
        let ours = Shader::library("OpenPbr", arguments().collect());
        let theirs = Shader::file(&file, &headers, "AdobeOpenPbr", arguments().collect());
        for part in [0.0, 0.45, 0.8] {
            let meeting = Meeting::new(part, false);
            let (ours, theirs) = (albedos(&ours, &meeting), albedos(&theirs, &meeting));
            println!("{parameters:?}, {part} of a right angle: {ours:.3}, the headers {theirs:.3}");
            if (ours - theirs).abs().max_element() > allowed {
                different.push((parameters, part, ours, theirs));
            }
        }
    }
    assert!(different.is_empty(), "{different:#?}");
}
