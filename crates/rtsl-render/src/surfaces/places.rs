//! The places of hit shapes as data of the kernels that compute surfaces.

use rtsl::{LaneBlock, SurfaceColumns};
use rtsl_math::Affine;

use crate::compiled::CompiledScene;
use crate::compiled::object::Object;
use crate::integrate::wavefront::PathHit;

/// The places of shapes of one traversal class.
pub struct Places<'a> {
    scene: &'a CompiledScene,
    /// True if the shapes have spaces of their own.
    are_placed: bool,
    /// True if instances may place the shapes' groups.
    are_grouped: bool,
}

impl<'a> Places<'a> {
    /// Returns the places of shapes of a class.
    pub fn new(scene: &'a CompiledScene, class: u32, are_grouped: bool) -> Places<'a> {
        Places { scene, are_placed: scene.class(class).is_placed(), are_grouped }
    }

    /// Stores the places of hit shapes in the columns, of which the first array is given; the times of the rays are
    /// there already.
    pub fn store(&self, hits: &[PathHit], columns: &mut LaneBlock, first: usize) {
        let mut start = 0;
        for run in hits.chunk_by(|a, b| (a.object, a.instance) == (b.object, b.instance)) {
            let mut lanes = Lanes { columns, first, start, end: start + run.len() };
            start = lanes.end;
            let object = &self.scene.objects[run[0].object as usize];
            self.store_object(run, object, &mut lanes);
            if self.are_grouped {
                self.store_group(run[0].instance, &mut lanes);
            }
        }
    }

    fn store_object(&self, hits: &[PathHit], object: &Object, lanes: &mut Lanes<'_>) {
        for axis in 0..3 {
            let extents = lanes.column(SurfaceColumns::EXTENTS + axis);
            for (extent, hit) in extents.iter_mut().zip(hits) {
                *extent = self.scene.extents.lengths(hit.object, hit.element)[axis];
            }
        }
        lanes.fill(SurfaceColumns::SIDE, if object.reverse_orientation { -1.0 } else { 1.0 });
        lanes.fill(SurfaceColumns::VOLUME, object.volume_scale);
        if self.are_placed {
            let maps = [&object.inverse, &object.forward, &object.sizes];
            for (first, map) in (SurfaceColumns::MAPS..).step_by(12).zip(maps) {
                lanes.fill_map(first, map);
            }
        }
    }

    fn store_group(&self, instance: u32, lanes: &mut Lanes<'_>) {
        let placement = self.scene.placement(instance);
        lanes.fill(SurfaceColumns::GROUP, if placement.is_some() { 1.0 } else { 0.0 });
        let Some(placement) = placement else { return };
        let store = |lanes: &mut Lanes<'_>, time: f32| {
            lanes.fill_map(SurfaceColumns::GROUP + 1, &placement.inverse_at(time));
            lanes.fill_map(SurfaceColumns::GROUP + 13, &placement.map_at(time));
            lanes.fill(SurfaceColumns::GROUP + 25, placement.volume_scale(time) as f32);
        };
        if !placement.moves() {
            return store(lanes, 0.0);
        }
        for lane in lanes.start..lanes.end {
            let time = lanes.columns.floats(lanes.first + SurfaceColumns::TIME)[lane];
            let Lanes { columns, first, .. } = lanes;
            store(&mut Lanes { columns, first: *first, start: lane, end: lane + 1 }, time);
        }
    }
}

/// Lanes whose shapes have the same place.
struct Lanes<'a> {
    columns: &'a mut LaneBlock,
    /// The first array of the columns.
    first: usize,
    start: usize,
    end: usize,
}

impl Lanes<'_> {
    fn column(&mut self, column: usize) -> &mut [f32] {
        &mut self.columns.floats_mut(self.first + column)[self.start..self.end]
    }

    fn fill(&mut self, column: usize, number: f32) {
        self.column(column).fill(number);
    }

    /// Fills twelve columns with a map.
    fn fill_map(&mut self, first: usize, map: &Affine) {
        let numbers = map.columns.as_flattened().iter();
        (first..).zip(numbers).for_each(|(column, number)| self.fill(column, *number));
    }
}
