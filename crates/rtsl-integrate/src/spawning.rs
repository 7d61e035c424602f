//! Rays that a path spawns: each becomes a path of its own, at the next depth, whose light is added to that of the
//! first.
//!
//! A stage that spawns at a few places, none of them in a loop, [keeps](super::kept_requests) the new paths in arrays.
//! Others make a request for each vector of lanes.

use rtsl_ir::{Function, Op, OpKind, Query, Region, Scalar, UnaryOp, Value, Variable, VariableId};
use rtsl_link::Linking;

use crate::arithmetic::{Arithmetic, Vector};
use crate::camera::WEIGHT_COLUMNS;
use crate::sampler::KEY_COLUMN;
use crate::stage_linker::StageLinker;

/// The number of scalars of a spawned path, the operands of its query.
pub const SPAWN_SCALARS: usize = 13;

/// The number of those that are floats; the others are unsigned integers.
pub const SPAWN_FLOATS: usize = 11;

/// The greatest number of places that have arrays.
pub const MAX_SPAWNS: usize = 4;

/// The scratch array that counts the rays that a path has spawned.
pub const CHILDREN_COLUMN: &str = "path.children";

/// Returns the name of the scratch array with a scalar of the path that is spawned at a place.
pub fn spawn_column(place: usize, index: usize) -> String {
    format!("spawn.{place}.{index}")
}

/// Returns the place of the scratch with a spawned path; `None` for other variables.
pub fn place_of_spawn(variable: &Variable) -> Option<usize> {
    let scalars = variable.name.strip_prefix("spawn.")?;
    scalars.split_once('.')?.0.parse().ok()
}

impl StageLinker {
    /// Spawns the path of a ray with this weight.
    pub(crate) fn spawn(&mut self, operands: &[Value], to: &mut Vec<Op>) -> Linking<()> {
        let vector = |first: usize| [operands[first], operands[first + 1], operands[first + 2]];
        let (mut origin, direction, mut weight) = (vector(0), vector(3), vector(7));
        let call = self.shade_call(to)?;
        let children = match &call {
            Some(call) => call.children,
            None => self.passed_value(CHILDREN_COLUMN, Scalar::U32),
        };
        let code = &mut Arithmetic { linker: &mut *self, to: &mut *to };
        let (mut key, mut before) = (code.column(KEY_COLUMN, Scalar::U32)?, code.word(0)?);
        if let Some(call) = &call {
            origin = code.leave(&call.surface, origin, direction)?;
            weight = code.each(|it, channel| it.multiply(call.weight[channel], weight[channel]))?;
            (key, before) = (call.key, call.before);
        }
        let throughput = code.throughput(weight)?;
        let bound = code.greatest_weight(weight)?;
        let key = code.begin_child(key, children)?;
        let words = [bound, key, before];
        let path = [&origin[..], &direction, &operands[6..7], &throughput, &words].concat();
        self.emit(to, OpKind::Query(Query::SpawnPath, path), &[], false).map(drop)
    }
}

impl Arithmetic<'_> {
    /// The product of the weights of the path and of a ray that it spawns.
    fn throughput(&mut self, weight: Vector) -> Linking<Vector> {
        self.each(|it, channel| {
            let of_path = it.column(WEIGHT_COLUMNS[channel], Scalar::F32)?;
            it.multiply(of_path, weight[channel])
        })
    }

    /// The greatest magnitude of a weight; a NaN counts for as much as the weights after it.
    fn greatest_weight(&mut self, weight: Vector) -> Linking<Value> {
        let [red, green, blue] =
            self.each(|it, channel| it.unary(UnaryOp::Abs, weight[channel]))?;
        let greatest = self.larger(red, green)?;
        self.larger(greatest, blue)
    }

    /// Counts a ray of the path with a key, and returns the key of the ray's own path.
    fn begin_child(&mut self, key: Value, children: VariableId) -> Linking<Value> {
        let count = self.next_count(children)?;
        let key = self.hash_with(key, u32::MAX)?;
        self.hash(key, count)
    }
}

/// The places at which a stage and the method that shades its surface spawn paths, or add light.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Places {
    /// Their number.
    pub count: usize,
    /// True if any is in a loop.
    pub is_any_repeated: bool,
}

impl Places {
    /// Returns the places of a query in a function, in which the method `inlined` takes the place of queries for the
    /// colour of a shaded surface.
    pub fn of(query: Query, function: &Function, inlined: Option<&Function>) -> Places {
        let mut places = Places::default();
        places.add(query, &function.body, inlined, false);
        places
    }

    fn add(
        &mut self,
        query: Query,
        region: &Region,
        inlined: Option<&Function>,
        is_repeated: bool,
    ) {
        for op in &region.ops {
            match &op.kind {
                OpKind::Query(asked, _) if *asked == query => {
                    self.count += 1;
                    self.is_any_repeated |= is_repeated;
                }
                OpKind::Query(Query::OwnShade, _) => {
                    if let Some(method) = inlined {
                        self.add(query, &method.body, None, is_repeated);
                    }
                }
                _ => {}
            }
            let is_repeated = is_repeated || matches!(op.kind, OpKind::Loop { .. });
            op.kind.regions().for_each(|region| self.add(query, region, inlined, is_repeated));
        }
    }

    /// True if each place can keep what it makes until the stage ends.
    pub fn can_be_kept(self, greatest: usize) -> bool {
        !self.is_any_repeated && self.count <= greatest
    }
}
