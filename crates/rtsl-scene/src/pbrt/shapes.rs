//! Shapes. The arguments of meshes are made by [`super::mesh_shape`].

use super::name::{Names, PbrtName};
use super::parallelogram::Parallelogram;
use crate::description::EntityKind;

pub static NAMES: Names = Names {
    kind: EntityKind::Shape,
    implemented: &[
        shape("sphere", "Sphere").along_z().without(&["zmin", "zmax", "phimax"]),
        shape("disk", "Disk")
            .along_z()
            .renaming(&[("innerradius", "innerRadius")])
            .without(&["phimax"]),
        shape("cylinder", "Cylinder")
            .along_z()
            .renaming(&[("zmin", "yMin"), ("zmax", "yMax")])
            .without(&["phimax"]),
        shape("trianglemesh", "TriangleMesh"),
        shape("bilinearmesh", "BilinearMesh"),
        shape("plymesh", "TriangleMesh"),
        shape("gltf", "TriangleMesh"),
    ],
    left_out: &["curve", "loopsubdiv"],
    without_effect: &["shadowalpha", "displacement", "displacement.edgelength"],
    choose: |entity| Parallelogram::of(entity).map(|_| &PARALLELOGRAM),
};

/// `bilinearmesh` with a single parallelogram.
static PARALLELOGRAM: PbrtName = shape("bilinearmesh", "Parallelogram");

const fn shape(name: &'static str, class: &'static str) -> PbrtName {
    PbrtName::new(EntityKind::Shape, name, class)
}
