//! Checks that a kernel can be called with a [record](RayRecord) of a host.

use std::collections::BTreeSet;

use rtsl_abi::{CallMode, RayRecord};
use rtsl_ir::{VariableId, VariableKind};

use crate::kernel::{Kernel, OpKind, Region};

/// The reason a kernel cannot be called with a record.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum RecordError {
    /// The kernel has another call mode, or its method accepts no hits.
    #[error("records are for packets of rays that may hit something")]
    CallMode,
    /// It reads or stores state for which the record has no row.
    #[error("the record has no row for a component of `{0}`")]
    NoRow(String),
    /// It reads or stores scratch, or takes members of objects.
    #[error("records have no storage for `{0}`")]
    NoPlace(String),
    /// It requests rays, light or random numbers from the host.
    #[error("it makes requests to its host, but a record has no host")]
    AsksHost,
}

impl Kernel {
    /// Checks that a record has every row that the kernel reads and stores.
    ///
    /// # Errors
    /// See [`RecordError`].
    pub fn check_record(&self, record: &RayRecord) -> Result<(), RecordError> {
        if self.mode != CallMode::Packet || self.accepted_output().is_none() {
            return Err(RecordError::CallMode);
        }
        for id in used_variables(self) {
            let variable = self.variable(id);
            let name = || variable.variable.name.clone();
            let mut components = variable.location..variable.location + variable.variable.len;
            match variable.variable.kind {
                VariableKind::State if !components.all(|it| record.rows.contains_key(&it)) => {
                    return Err(RecordError::NoRow(name()));
                }
                VariableKind::Scratch => return Err(RecordError::NoPlace(name())),
                _ if variable.of_objects => return Err(RecordError::NoPlace(name())),
                _ => {}
            }
        }
        if self.asks_host() {
            return Err(RecordError::AsksHost);
        }
        Ok(())
    }
}

fn used_variables(kernel: &Kernel) -> BTreeSet<VariableId> {
    let mut used = kernel.outputs.iter().map(|output| output.variable).collect();
    add_used_variables(&kernel.prologue, &mut used);
    add_used_variables(&kernel.body, &mut used);
    used
}

fn add_used_variables(region: &Region, used: &mut BTreeSet<VariableId>) {
    for op in &region.ops {
        if let OpKind::Load(variable, _)
        | OpKind::Store { variable, .. }
        | OpKind::Length(variable) = op.kind
        {
            used.insert(variable);
        }
        op.kind.regions().for_each(|region| add_used_variables(region, used));
    }
}

#[cfg(test)]
mod tests {
    use rtsl_ir::Function;

    use super::*;
    use rtsl_abi::Layout;

    fn record(rows: &[u32]) -> RayRecord {
        let rows = rows.iter().map(|component| (*component, *component)).collect();
        RayRecord { rays: 0, mask: None, instances: 8, number: None, rows, marks: Vec::new() }
    }

    fn check(text: &str, mode: CallMode) -> Result<(), RecordError> {
        let function: Function = text.parse().unwrap_or_else(|error| panic!("{error}"));
        let mut layout = Layout::default();
        layout.scratch.insert("s".to_owned(), 0);
        let kernel = crate::lower(&function, &layout, mode, 4).unwrap();
        let distance = rtsl_spec::lookup_state("rt_HitDistance").unwrap().first_component;
        kernel.check_record(&record(&[distance]))
    }

    const HIT: &str =
        "function f state rt_HitDistance: f32[1] scratch s: f32[1] accepted a: bool[1] {
        %t: f32 = load state:rt_HitDistance@0 %c: bool = less %t, %t ";

    #[test]
    fn kernels_with_rows_and_without_requests_fit() {
        let hit = format!("{HIT} return accepted:a@0 = %c, state:rt_HitDistance@0 = %t }}");
        assert_eq!(check(&hit, CallMode::Packet), Ok(()));
        assert_eq!(check(&hit, CallMode::Stream), Err(RecordError::CallMode));
        let none = format!("{HIT} return state:rt_HitDistance@0 = %t }}");
        assert_eq!(check(&none, CallMode::Packet), Err(RecordError::CallMode));
        let scratch = format!("{HIT} return accepted:a@0 = %c, scratch:s@0 = %t }}");
        assert_eq!(check(&scratch, CallMode::Packet), Err(RecordError::NoPlace("s".to_owned())));
        let asks = format!(
            "{HIT} %r: f32 = rand return accepted:a@0 = %c, state:rt_HitDistance@0 = %r }}"
        );
        assert_eq!(check(&asks, CallMode::Packet), Err(RecordError::AsksHost));
        let other = HIT.replace("rt_HitDistance", "rt_Epsilon");
        let other = format!("{other} return accepted:a@0 = %c }}");
        let row = RecordError::NoRow("rt_Epsilon".to_owned());
        assert_eq!(check(&other, CallMode::Packet), Err(row));
    }
}
