//! Cameras.

use super::name::{Names, PbrtName};
use crate::description::EntityKind;

pub static NAMES: Names = Names {
    kind: EntityKind::Camera,
    implemented: &[
        camera("perspective", "Pinhole").with_defaults(&[("fov", &[90.0])]),
        camera("orthographic", "Orthographic"),
        camera("spherical", "Environment"),
    ],
    left_out: &[],
    without_effect: &[],
    choose: |_| None,
};

const fn camera(name: &'static str, class: &'static str) -> PbrtName {
    PbrtName::new(EntityKind::Camera, name, class)
}
