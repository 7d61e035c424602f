//! Shapes. The arguments of meshes are made by [`super::mesh_shape`].

use super::curve;
use super::name::{Names, PbrtName};
use super::parallelogram::Parallelogram;
use super::translation::Translation;
use crate::description::{Entity, EntityKind};

pub static NAMES: Names = Names {
    kind: EntityKind::Shape,
    implemented: &[
        shape("sphere", "Sphere").along_z().translated_by(drop_clipping),
        shape("disk", "Disk").along_z().renaming(DISK).translated_by(drop_clipping),
        shape("cylinder", "Cylinder").along_z().renaming(HEIGHTS).translated_by(drop_sweep),
        shape("trianglemesh", "TriangleMesh"),
        shape("bilinearmesh", "BilinearMesh"),
        shape("plymesh", "TriangleMesh"),
        shape("loopsubdiv", "TriangleMesh"),
        shape("gltf", "TriangleMesh"),
        shape("curve", "Curve").made_by(curve::curves, curve::PARAMETERS),
    ],
    left_out: &[],
    // `S` are tangents, which no class takes.
    without_effect: &["shadowalpha", "displacement", "displacement.edgelength", "S"],
    choose: |entity| match entity.class.as_str() {
        "sphere" if is_clipped(entity) || is_part(entity) => Some(&PARTIAL_SPHERE),
        "disk" if is_part(entity) => Some(&PARTIAL_DISK),
        "cylinder" if is_part(entity) => Some(&PARTIAL_CYLINDER),
        "bilinearmesh" => Parallelogram::of(entity).map(|_| &PARALLELOGRAM),
        _ => None,
    },
};

/// `sphere` with `zmin`, `zmax` or `phimax`.
static PARTIAL_SPHERE: PbrtName =
    shape("sphere", "PartialSphere").along_z().renaming(HEIGHTS).translated_by(complete_sphere);

/// `disk` with `phimax`.
static PARTIAL_DISK: PbrtName =
    shape("disk", "PartialDisk").along_z().renaming(DISK).translated_by(limit_sweep);

/// `cylinder` with `phimax`.
static PARTIAL_CYLINDER: PbrtName =
    shape("cylinder", "PartialCylinder").along_z().renaming(HEIGHTS).translated_by(limit_sweep);

/// `bilinearmesh` with a single parallelogram.
static PARALLELOGRAM: PbrtName = shape("bilinearmesh", "Parallelogram");

const HEIGHTS: &[(&str, &str)] = &[("zmin", "yMin"), ("zmax", "yMax"), ("phimax", "sweep")];
const DISK: &[(&str, &str)] = &[("innerradius", "innerRadius"), ("phimax", "sweep")];

const fn shape(name: &'static str, class: &'static str) -> PbrtName {
    PbrtName::new(EntityKind::Shape, name, class)
}

/// True if a sphere ends below its upper pole or above its lower one.
fn is_clipped(entity: &Entity) -> bool {
    let radius = entity.number("radius").unwrap_or(1.0);
    let within = |name| entity.number(name).is_some_and(|z| z.abs() < radius);
    within("zmin") || within("zmax")
}

/// True if a shape does not go around its axis.
fn is_part(entity: &Entity) -> bool {
    entity.number("phimax").is_some_and(|degrees| degrees < 360.0)
}

/// Drops the limits of a whole shape, which its class has not.
fn drop_clipping(shape: &mut Translation<'_>) {
    drop_sweep(shape);
    shape.take("zmin");
    shape.take("zmax");
}

fn drop_sweep(shape: &mut Translation<'_>) {
    shape.take("phimax");
    shape.take("sweep");
}

/// Completes the limits of a part of a sphere: those that are not given depend on its radius.
fn complete_sphere(shape: &mut Translation<'_>) {
    let radius = shape.number("radius", 1.0);
    for (name, limit) in [("yMin", -radius), ("yMax", radius)] {
        if shape.find(name).is_none() {
            shape.set(name, vec![limit]);
        }
    }
    if shape.find("sweep").is_none() {
        shape.set("sweep", vec![360.0]);
    }
    limit_sweep(shape);
}

/// The least angle of a part, in degrees: the density of a smaller one would not fit a float.
const LEAST_SWEEP: f64 = 0.1;

fn limit_sweep(shape: &mut Translation<'_>) {
    if let Some(Some(degrees)) = shape.take_number("sweep") {
        shape.set("sweep", vec![degrees.clamp(LEAST_SWEEP, 360.0)]);
    }
}
