//! Checks a draft: every way to a suspension has stored what is live there.
//!
//! In the finished form a slot without a value can't be told from one that is 0. In a draft it can: slots are locals,
//! and a local that nothing has been stored to has no value.

use std::collections::{BTreeMap, BTreeSet};

use rtsl_ir::{Constant, Function, OpKind, Region, Value};

use crate::emit::Draft;
use crate::{Port, SlotId, Stage};

/// Checks that a draft stores the live slots of the stages that it names as the next.
pub(crate) fn check(draft: &Draft, stages: &[Stage]) -> Result<(), String> {
    let mut constants = BTreeMap::new();
    draft.function.body.for_each_op(&mut |op| {
        if let OpKind::Constant(Constant::I32(constant)) = op.kind {
            constants.insert(op.results.get(0), constant);
        }
    });
    let check = Check { function: &draft.function, draft, stages, constants };
    check.region(&draft.function.body, &mut BTreeSet::new())
}

struct Check<'a> {
    function: &'a Function,
    draft: &'a Draft,
    stages: &'a [Stage],
    constants: BTreeMap<Value, i32>,
}

impl Check<'_> {
    /// Checks a region; adds the slots that it certainly stores.
    fn region(&self, region: &Region, stored: &mut BTreeSet<SlotId>) -> Result<(), String> {
        for op in &region.ops {
            match &op.kind {
                OpKind::Store(local, _, value) if *local == self.draft.next => {
                    self.suspension(*value, stored)?;
                }
                OpKind::Store(local, ..) => {
                    if let Some(Port::Frame(slot)) = self.draft.ports.get(local) {
                        stored.insert(*slot);
                    }
                }
                OpKind::If { then, otherwise, .. } => {
                    let mut other = stored.clone();
                    self.region(then, stored)?;
                    self.region(otherwise, &mut other)?;
                    stored.retain(|slot| other.contains(slot));
                }
                OpKind::Loop { body, .. } => self.region(body, stored)?,
                _ => {}
            }
        }
        Ok(())
    }

    fn suspension(&self, next: Value, stored: &BTreeSet<SlotId>) -> Result<(), String> {
        let next = self.constants.get(&next);
        let Some(stage) = next.and_then(|next| self.stages.get(usize::try_from(*next).ok()?))
        else {
            return Ok(());
        };
        match stage.live.iter().find(|slot| !stored.contains(slot)) {
            None => Ok(()),
            Some(slot) => Err(format!(
                "{} does not store slot {}, which is live in {}",
                self.function.name, slot.0, stage.function.name
            )),
        }
    }
}
