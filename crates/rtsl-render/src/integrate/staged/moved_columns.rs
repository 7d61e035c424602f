//! The columns of paths that are moved with them.

use std::collections::BTreeSet;

use rtsl::{ResumedBy, StageKernel, StageSurface, StagedProgram};

use super::columns::Columns;

/// The columns of paths that are moved to other lanes, by what becomes of them.
pub struct MovedColumns {
    /// The scratch arrays that anyone reads later.
    pub read: Vec<usize>,
    /// The scratch arrays with results of paths that have ended.
    pub results: Vec<usize>,
    /// The components of state with such results.
    pub state: Vec<usize>,
    /// The array of the next stage.
    pub next: usize,
    /// True if the light of paths is among the results; otherwise it stays where they were loaded.
    pub has_light: bool,
}

impl MovedColumns {
    /// Returns the columns of paths on their way from the first of some stages, whose kernels are `first`, through the
    /// others.
    pub fn new(
        program: &StagedProgram,
        columns: &Columns,
        first: &[StageKernel],
        others: &[StageKernel],
    ) -> MovedColumns {
        let all = || first.iter().chain(others);
        let stored: BTreeSet<usize> = all().flat_map(|it| it.ports.iter().copied()).collect();
        // Hosts count the searches that they make. The light that they add is not in these columns unless stages add to
        // it, too.
        let sums = [columns.searches, columns.shadow_rays].into_iter().chain(columns.lit);
        let is_moved = |array: &usize| {
            let is_counted = *array == columns.searches && !program.searches_at_end();
            is_counted || stored.contains(array)
        };
        let has_light = columns.lit.iter().any(|array| stored.contains(array));
        let sums: BTreeSet<usize> = sums.filter(is_moved).collect();
        let mut read: BTreeSet<usize> =
            others.iter().flat_map(|it| it.reads.iter().copied()).collect();
        read.extend(&sums);
        read.extend(read_by_hosts(program, columns, others));
        let outputs = all().flat_map(|it| it.outputs.iter().copied());
        let results: BTreeSet<usize> = outputs.chain(sums).collect();
        let state: BTreeSet<usize> = all().flat_map(|it| it.state.iter().copied()).collect();
        MovedColumns {
            read: read.into_iter().collect(),
            results: results.into_iter().collect(),
            state: state.into_iter().collect(),
            next: columns.next,
            has_light,
        }
    }
}

/// Returns the columns that hosts read after paths were moved.
fn read_by_hosts(
    program: &StagedProgram,
    columns: &Columns,
    kernels: &[StageKernel],
) -> BTreeSet<usize> {
    let mut read = BTreeSet::new();
    for stage in program.stages() {
        match stage.surface {
            StageSurface::None => {}
            StageSurface::Answer if program.searched().is_some() => {
                read.extend([columns.group, columns.surface_index]);
            }
            surface => {
                // Instances have been looked at before paths are moved.
                let [object, _, element] = columns.surface(surface);
                read.extend([object, element]);
            }
        }
        match stage.resumed_by {
            ResumedBy::Start | ResumedBy::Dispatch => {}
            ResumedBy::NearestHit if program.searches_at_end() => {}
            ResumedBy::NearestHit | ResumedBy::Occluded => read.extend([columns.time]),
            // Hosts that answer need to know the sample.
            ResumedBy::Trace | ResumedBy::Shade | ResumedBy::LightSample => {
                read.extend([columns.time, columns.key, columns.sample, columns.drawn]);
                read.extend(columns.counts);
            }
        }
    }
    if kernels.iter().any(|kernel| kernel.contributions > 0) {
        read.insert(columns.time);
    }
    if kernels.iter().any(|kernel| kernel.spawns > 0) {
        read.extend([columns.time, columns.sample]);
    }
    for prepared in kernels.iter().filter_map(|kernel| kernel.prepared.as_ref()) {
        read.extend([columns.time, columns.sample, columns.searches]);
        read.extend(prepared.arrays());
    }
    if program.is_of_material() {
        read.extend(columns.shaded);
    }
    read
}
