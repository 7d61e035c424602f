//! The places of hit shapes as data of the kernels that compute surfaces.

use rtsl::{LaneBlock, QueryColumns};
use rtsl_math::Affine;

use crate::compiled::CompiledScene;
use crate::compiled::object::Object;
use crate::compiled::placement::Placement;
use crate::integrate::wavefront::PathHit;

/// The places of shapes of one traversal class.
pub struct Places<'a> {
    scene: &'a CompiledScene,
    /// True if the shapes have spaces of their own.
    are_placed: bool,
}

impl<'a> Places<'a> {
    /// Returns the places of shapes of a class.
    pub fn new(scene: &'a CompiledScene, class: u32) -> Places<'a> {
        Places { scene, are_placed: scene.class(class).is_placed() }
    }

    /// Stores the places of hit shapes in the columns, of which the first array is given; the times of the rays are
    /// there already.
    pub fn store(&self, hits: &[PathHit], columns: &mut LaneBlock, first: usize) {
        let mut start = 0;
        for run in hits.chunk_by(|a, b| (a.object, a.instance) == (b.object, b.instance)) {
            let mut lanes = PlacedLanes { columns, first, start, end: start + run.len() };
            start = lanes.end;
            let object = &self.scene.objects[run[0].object as usize];
            self.store_object(run, object, &mut lanes);
            if let Some(placement) = self.scene.placement(run[0].instance) {
                store_group(&placement, &mut lanes);
            }
        }
    }

    fn store_object(&self, hits: &[PathHit], object: &Object, lanes: &mut PlacedLanes<'_>) {
        for axis in 0..3 {
            let extents = lanes.column(QueryColumns::EXTENTS + axis);
            for (extent, hit) in extents.iter_mut().zip(hits) {
                *extent = self.scene.extents.lengths(hit.object, hit.element)[axis];
            }
        }
        lanes.fill(QueryColumns::SIDE, if object.reverse_orientation { -1.0 } else { 1.0 });
        lanes.fill(QueryColumns::VOLUME, object.volume_scale);
        if self.are_placed {
            let maps = [&object.inverse, &object.forward, &object.sizes];
            for (first, map) in (QueryColumns::MAPS..).step_by(12).zip(maps) {
                lanes.fill_map(first, map);
            }
        }
    }
}

fn store_group(placement: &Placement<'_>, lanes: &mut PlacedLanes<'_>) {
    if !placement.moves() {
        return store_group_at(placement, 0.0, lanes);
    }
    for lane in lanes.start..lanes.end {
        let PlacedLanes { columns, first, .. } = lanes;
        let time = columns.floats(*first + QueryColumns::TIME)[lane];
        let mut lane = PlacedLanes { columns, first: *first, start: lane, end: lane + 1 };
        store_group_at(placement, time, &mut lane);
    }
}

fn store_group_at(placement: &Placement<'_>, time: f32, lanes: &mut PlacedLanes<'_>) {
    lanes.fill_map(QueryColumns::GROUP, &placement.inverse_at(time));
    lanes.fill_map(QueryColumns::GROUP + 12, &placement.map_at(time));
    lanes.fill(QueryColumns::GROUP_VOLUME, placement.volume_scale(time) as f32);
}

/// Lanes of columns that have the same place.
pub struct PlacedLanes<'a> {
    /// The block with the columns.
    pub columns: &'a mut LaneBlock,
    /// The first array of the columns.
    pub first: usize,
    /// The first lane.
    pub start: usize,
    /// The lane after the last.
    pub end: usize,
}

impl PlacedLanes<'_> {
    /// Returns their numbers in a column.
    pub fn column(&mut self, column: usize) -> &mut [f32] {
        &mut self.columns.floats_mut(self.first + column)[self.start..self.end]
    }

    /// Fills a column with a number.
    pub fn fill(&mut self, column: usize, number: f32) {
        self.column(column).fill(number);
    }

    /// Fills twelve columns with a map.
    pub fn fill_map(&mut self, first: usize, map: &Affine) {
        let numbers = map.columns.as_flattened().iter();
        (first..).zip(numbers).for_each(|(column, number)| self.fill(column, *number));
    }
}
