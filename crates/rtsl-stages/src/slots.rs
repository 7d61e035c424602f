//! The layout of the frame: a slot for each scalar that passes through it.
//!
//! A scalar has one slot in all stages. Scalars of one type that are never live at the same point can share a slot.
//! Slots are given greedily, first to the scalars that are live at the most points. If possible a scalar gets the slot
//! of one that passes its value on to it, such as the initial value of a loop's parameter or a value that an `if`
//! yields: the slot is then often unchanged, and nothing is stored.

use std::collections::{BTreeMap, BTreeSet};

use rtsl_ir::{Function, OpKind, Scalar, Value};

use crate::live::{Kept, Live};
use crate::points::PointId;
use crate::{Slot, SlotId};

/// The slots, and which each scalar has.
#[derive(Debug, Default)]
pub(crate) struct Slots {
    pub slots: Vec<Slot>,
    of: BTreeMap<Kept, SlotId>,
}

impl Slots {
    /// Returns the slot of a scalar that is live at a point.
    pub fn of(&self, kept: Kept) -> SlotId {
        self.of[&kept]
    }

    /// Gives each scalar a slot to itself.
    pub fn separate(function: &Function, lives: &BTreeMap<PointId, Live>) -> Slots {
        let mut slots = Slots::default();
        for kept in lives.values().flat_map(|live| &live.kept) {
            if !slots.of.contains_key(kept) {
                slots.add(function, *kept);
            }
        }
        slots
    }

    /// Gives scalars that are never live at the same of these points the same slots.
    pub fn shared(function: &Function, lives: &BTreeMap<PointId, Live>) -> Slots {
        let mut points: BTreeMap<Kept, Vec<PointId>> = BTreeMap::new();
        for (point, live) in lives {
            for kept in &live.kept {
                points.entry(*kept).or_default().push(*point);
            }
        }
        let mut order: Vec<Kept> = points.keys().copied().collect();
        order.sort_by_key(|kept| std::cmp::Reverse(points[kept].len()));
        let related = related(function, &points);
        let mut taken: BTreeMap<PointId, BTreeSet<SlotId>> = BTreeMap::new();
        let mut slots = Slots::default();
        for kept in order {
            let scalar = scalar(function, kept);
            let points = &points[&kept];
            let is_free = |slot: &SlotId| {
                slots.slots[slot.0 as usize].scalar == scalar
                    && !points.iter().any(|it| taken.get(it).is_some_and(|it| it.contains(slot)))
            };
            let preferred = related.get(&kept).into_iter().flatten();
            let mut preferred = preferred.filter_map(|other| slots.of.get(other).copied());
            let all = (0..slots.slots.len() as u32).map(SlotId);
            let free = preferred.find(is_free).or_else(|| all.into_iter().find(is_free));
            let slot = match free {
                Some(slot) => {
                    slots.of.insert(kept, slot);
                    slot
                }
                None => slots.add(function, kept),
            };
            for point in points {
                taken.entry(*point).or_default().insert(slot);
            }
        }
        slots
    }

    fn add(&mut self, function: &Function, kept: Kept) -> SlotId {
        let slot = SlotId(self.slots.len() as u32);
        self.slots.push(Slot { scalar: scalar(function, kept), name: name(function, kept) });
        self.of.insert(kept, slot);
        slot
    }
}

fn scalar(function: &Function, kept: Kept) -> Scalar {
    match kept {
        Kept::Value(value) => function.scalar(value),
        Kept::Local(local, _) => function.variable(local).scalar,
    }
}

fn name(function: &Function, kept: Kept) -> String {
    match kept {
        Kept::Value(value) => {
            let name = function.names.get(value);
            name.map_or(String::new(), |name| function.names.written(name))
        }
        Kept::Local(local, index) => format!("{}@{index}", function.variable(local).name),
    }
}

/// Returns, for each of these scalars, those that it takes its value from or passes it to.
fn related(
    function: &Function,
    among: &BTreeMap<Kept, Vec<PointId>>,
) -> BTreeMap<Kept, BTreeSet<Kept>> {
    let mut related: BTreeMap<Kept, BTreeSet<Kept>> = BTreeMap::new();
    let mut relate = |values: &[Value]| {
        let kept = values.iter().map(|value| Kept::Value(*value));
        let kept: Vec<Kept> = kept.filter(|kept| among.contains_key(kept)).collect();
        for a in &kept {
            related.entry(*a).or_default().extend(kept.iter().filter(|b| *b != a));
        }
    };
    function.body.for_each_op(&mut |op| match &op.kind {
        OpKind::If { then, otherwise, .. } => {
            let sides = then.yields.iter().zip(&otherwise.yields);
            for (result, (a, b)) in op.results.iter().zip(sides) {
                relate(&[result, *a, *b]);
            }
        }
        OpKind::Loop { initial, body } => {
            let carried = initial.iter().zip(&body.params).zip(&body.yields[1..]);
            for (result, ((first, param), next)) in op.results.iter().zip(carried) {
                relate(&[result, *first, *param, *next]);
            }
        }
        _ => {}
    });
    related
}
