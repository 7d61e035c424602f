//! The columns of paths that are moved with them.

use std::collections::BTreeSet;

use rtsl::{Query, ResumedBy, StageKernel, StageSurface, StagedProgram};

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
        let is_lit_by_hosts = |kernel: &StageKernel| {
            let by_host = [Query::Contribute, Query::OwnShade];
            kernel.contributions > 0 || by_host.iter().any(|query| kernel.queries.contains(query))
        };
        let stored: BTreeSet<usize> = all().flat_map(|it| it.ports.iter().copied()).collect();
        let mut sums = BTreeSet::from([columns.searches, columns.shadow_rays]);
        sums.extend(columns.lit);
        if program.searches_at_end() && !all().any(is_lit_by_hosts) {
            // No host changes them.
            sums.retain(|array| stored.contains(array));
        }
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
            surface => read.extend(columns.surface(surface)),
        }
        match stage.resumed_by {
            ResumedBy::Start | ResumedBy::Dispatch => {}
            ResumedBy::NearestHit if program.searches_at_end() => {}
            // Hosts that answer need to know the sample.
            _ => {
                read.extend([columns.time, columns.key, columns.sample, columns.drawn]);
                read.extend(columns.counts);
            }
        }
    }
    let adds_light = |kernel: &StageKernel| kernel.contributions > 0 || kernel.spawns > 0;
    if kernels.iter().any(adds_light) {
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
