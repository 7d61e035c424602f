//! The places of hit shapes as data of the kernels that compute surfaces.

use std::ops::Range;

use rtsl::QueryColumns;

use crate::compiled::CompiledScene;
use crate::compiled::placement::Placement;
use crate::integrate::query_block::QueryBlock;
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

    /// Stores the places of hit shapes in the columns; the times of the rays are there already.
    pub fn store(&self, hits: &[PathHit], columns: &mut QueryBlock) {
        let mut start = 0;
        for run in hits.chunk_by(|a, b| (a.object, a.instance) == (b.object, b.instance)) {
            let lanes = start..start + run.len();
            start = lanes.end;
            self.store_object(run, lanes.clone(), columns);
            if let Some(placement) = self.scene.placement(run[0].instance) {
                store_group(&placement, lanes, columns);
            }
        }
    }

    /// Stores the place of an object that these lanes hit.
    fn store_object(&self, hits: &[PathHit], lanes: Range<usize>, columns: &mut QueryBlock) {
        let object = &self.scene.objects[hits[0].object as usize];
        for (lane, hit) in lanes.clone().zip(hits) {
            let extents = self.scene.extents.lengths(hit.object, hit.element);
            columns.set_vector(QueryColumns::EXTENTS, lane, extents);
        }
        let side = if object.reverse_orientation { -1.0 } else { 1.0 };
        columns.column_mut(QueryColumns::SIDE)[lanes.clone()].fill(side);
        columns.column_mut(QueryColumns::VOLUME)[lanes.clone()].fill(object.volume_scale);
        if self.are_placed {
            let maps = [&object.inverse, &object.forward, &object.sizes];
            for (first, map) in (QueryColumns::MAPS..).step_by(12).zip(maps) {
                columns.set_map(first, lanes.clone(), map);
            }
        }
    }
}

/// Stores the place of a group that these lanes hit, at the times of their rays.
fn store_group(placement: &Placement<'_>, lanes: Range<usize>, columns: &mut QueryBlock) {
    let store = |columns: &mut QueryBlock, time: f32, lanes: Range<usize>| {
        columns.set_map(QueryColumns::GROUP, lanes.clone(), &placement.inverse_at(time));
        columns.set_map(QueryColumns::GROUP + 12, lanes.clone(), &placement.map_at(time));
        let volume = placement.volume_scale(time) as f32;
        columns.column_mut(QueryColumns::GROUP_VOLUME)[lanes].fill(volume);
    };
    if !placement.moves() {
        return store(columns, 0.0, lanes);
    }
    for lane in lanes {
        let time = columns.column(QueryColumns::TIME)[lane];
        store(columns, time, lane..lane + 1);
    }
}
