//! Shapes. Those that pbrt-v4 does not have become triangles.

use super::context::Context;
use super::nurbs;
use super::parameters::Parameters;
use super::surfaces::{self, Surface};

/// Returns the name of a shape.
pub fn shape(name: &str, parameters: &mut Parameters<'_>, context: &mut Context) -> String {
    parameters.remove(&["discarddegenerateUVs", "shadowalpha"]);
    let surface = match name {
        "trianglemesh" => {
            coordinates(parameters);
            return name.to_owned();
        }
        "loopsubdiv" => {
            parameters.rename("nlevels", "levels");
            return name.to_owned();
        }
        "cone" => surfaces::cone(parameters),
        "paraboloid" => surfaces::paraboloid(parameters),
        "hyperboloid" => surfaces::hyperboloid(parameters),
        "heightfield" => surfaces::height_field(parameters),
        "nurbs" => nurbs::patch(parameters),
        other => return other.to_owned(),
    };
    let Some(Surface { positions, normals, uvs, indices }) = surface else {
        let message = format!("this `{name}` has not the parameters of one: it is kept as it is");
        context.note(message, parameters.span());
        return name.to_owned();
    };
    parameters.remove(&["radius", "height", "zmin", "zmax", "p1", "p2", "phimax"]);
    parameters.set_points("P", 3, positions);
    if !normals.is_empty() {
        parameters.set_points("N", 3, normals);
    }
    parameters.set_points("uv", 2, uvs);
    parameters.set_integers("indices", indices);
    "trianglemesh".to_owned()
}

/// Gives a mesh the texture coordinates of its older parameters.
fn coordinates(parameters: &mut Parameters<'_>) {
    for name in ["st", "uv"] {
        let Some(numbers) = parameters.numbers(name).map(<[f64]>::to_vec) else { continue };
        if name == "st" || parameters.find("uv").is_some_and(|it| it.is_numbers()) {
            parameters.take(name);
            parameters.set_points("uv", 2, numbers);
        }
    }
}
