//! A scene of Embree with what it refers to.

use std::ffi::c_void;

use anyhow::{Result, ensure};

use crate::embree::{Arguments4, Bounds, Context3, Embree, Handle, Queries};
use crate::geometry::{Geometry, bounds, intersect, occluded};
use crate::rays::Rays;

/// Geometries, ready for rays.
pub struct Scene {
    embree: Embree,
    device: Handle,
    scene: Handle,
    /// Never moved, since Embree has their addresses.
    geometries: Vec<Geometry>,
}

impl Scene {
    /// Builds a scene; geometry i has the number i.
    ///
    /// # Errors
    /// If Embree makes no device.
    pub fn new(embree: Embree, geometries: Vec<Geometry>) -> Result<Scene> {
        // Safety: a null pointer stands for the usual configuration.
        let device = unsafe { (embree.new_device)(std::ptr::null()) };
        ensure!(!device.is_null(), "Embree makes no device");
        // Safety: the device is one.
        let scene = unsafe { (embree.new_scene)(device) };
        let scene = Scene { embree, device, scene, geometries };
        for geometry in &scene.geometries {
            scene.attach(geometry);
        }
        // Safety: the scene is one, and its geometries are complete.
        unsafe { (scene.embree.commit_scene)(scene.scene) };
        Ok(scene)
    }

    fn attach(&self, geometry: &Geometry) {
        let embree = &self.embree;
        let user = std::ptr::from_ref(geometry).cast::<c_void>();
        // Safety: the handles are of their types, and the geometry stays where it is as long as the scene is there.
        unsafe {
            let handle = (embree.new_geometry)(self.device, Embree::USER_GEOMETRY);
            (embree.set_primitive_count)(handle, geometry.len() as u32);
            (embree.set_user_data)(handle, user);
            (embree.set_bounds)(handle, bounds, std::ptr::null());
            (embree.set_intersect)(handle, intersect);
            (embree.set_occluded)(handle, occluded);
            (embree.commit_geometry)(handle);
            (embree.attach_geometry)(self.scene, handle);
            (embree.release_geometry)(handle);
        }
    }

    /// The box around everything.
    pub fn bounds(&self) -> Bounds {
        let mut bounds = Bounds::default();
        // Safety: the scene is built.
        unsafe { (self.embree.scene_bounds)(self.scene, &mut bounds) };
        bounds
    }

    /// Finds the nearest hits of rays that go about the same way.
    pub fn intersect(&self, rays: &mut Rays) {
        self.query(self.embree.intersect, rays);
    }

    /// Makes the far ends of rays that hit anything -infinity.
    pub fn occluded(&self, rays: &mut Rays) {
        self.query(self.embree.occluded, rays);
    }

    /// The distance of a ray's nearest hit by a loop over all primitives, without Embree.
    pub fn nearest_in_turn(&self, origin: [f32; 3], direction: [f32; 3], near: f32) -> f32 {
        let geometries = self.geometries.iter();
        geometries.fold(f32::INFINITY, |far, it| it.nearest(origin, direction, near, far))
    }

    fn query(&self, queries: Queries, rays: &mut Rays) {
        if rays.count() == 1 && !rays.is_valid(0) {
            return;
        }
        let packet = match rays.count() {
            4 => Some(0),
            8 => Some(1),
            16 => Some(2),
            _ => None,
        };
        let (scene, (valid, words)) = (self.scene, rays.pointers());
        // Safety: the rays are of the size that the function takes, and aligned as it asks for.
        unsafe {
            match (queries, packet) {
                (Queries::Three { one, .. }, None) => one(scene, &mut Context3::coherent(), words),
                (Queries::Three { packets, .. }, Some(index)) => {
                    packets[index](valid, scene, &mut Context3::coherent(), words);
                }
                (Queries::Four { one, .. }, None) => one(scene, words, &mut Arguments4::coherent()),
                (Queries::Four { packets, .. }, Some(index)) => {
                    packets[index](valid, scene, words, &mut Arguments4::coherent());
                }
            }
        }
    }
}

impl Drop for Scene {
    fn drop(&mut self) {
        // Safety: nobody has them any more.
        unsafe {
            (self.embree.release_scene)(self.scene);
            (self.embree.release_device)(self.device);
        }
    }
}
